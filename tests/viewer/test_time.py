"""Time in a session: the past comes back bit for bit, the future is forgotten, real time is kept or told."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import physics
import rigid_env
from physics import scenes
from rigid_env.viewer import session as module
from tests.viewer.conftest import session_of, state_of, take

STEPS = 70


def act(session, k) -> None:
    """Whatever a user does before step k."""
    if k == 17:
        session.drag(0, (0.5, 0.2, 0.0), (2.0, 5.0, 1.0))
    if k in (20, 21):
        session.drag(0, (0.5, 0.2, 0.0), (2.0, 4.0 + 0.1 * k, 0.0))
    if k in (24, 48):
        session.kick(0, (3.0, 1.0, -2.0))
        session.kick(0, (0.0, 2.0, 0.0))
    if k == 32:
        session.set_friction(0.1)
        session.set_gravity(4.0)
    if k == 40:
        session.set_restitution(0.9)
    if k == 50:
        session.release()


def lived(what, **arguments):
    """A session of some steps with inputs, and its times, states and events before each and after the last."""
    session = session_of(what, **arguments)
    seen = []
    for k in range(STEPS + 1):
        act(session, k)
        seen.append((session.time, state_of(session), session.events))
        if k < STEPS:
            assert session.step(), session.message
    return session, seen


def short_episodes():
    """Episodes of nine control steps, so that seeking crosses their ends."""
    return gym.make("rigid_env/BlockReach-v0", max_episode_steps=9)


@pytest.fixture(scope="module", params=["shove", "rigid_env/BlockReach-v0", short_episodes])
def story(request):
    what = request.param
    return lived(what() if callable(what) else what, seed=3)


def test_the_story_has_all_that_can_go_wrong(story):
    session, seen = story
    assert len(session.samples) == STEPS + 1
    assert len({state.tobytes() for _, state, _ in seen}) > 50
    assert seen[-1][2]  # events


@settings(max_examples=25)
@given(data=st.data())
def test_any_moment_comes_back_bit_for_bit(story, data):
    """From any other one, in any order: the hand, sliders, actions and the next episodes included."""
    session, seen = story
    for k in data.draw(st.lists(st.integers(0, STEPS), min_size=1, max_size=4)):
        time, state, events = seen[k]
        session.seek(time)
        assert session.time == time
        assert state_of(session).tobytes() == state.tobytes()
        assert session.events == events
    assert len(session.samples) == STEPS + 1  # looking back forgets nothing


def test_few_states_are_kept_and_all_moments_come_back(monkeypatch):
    """With no room at all for states: those from which the rest is found again."""
    monkeypatch.setattr("rigid_env.viewer.history.ROOM", 0)
    session, seen = lived("drop")
    for k in (STEPS, 33, 5):
        session.seek(seen[k][0])
        assert np.array_equal(state_of(session), seen[k][1])


def test_going_on_from_the_past_forgets_the_future():
    session, seen = lived("drop")
    session.seek(seen[30][0])
    take(session, 5)
    assert len(session.samples) == 36
    assert session.span[1] == session.time == session.samples.time[-1]
    session.seek(1e9)
    assert session.time < seen[40][0]
    # the slider of step 32 is among what is forgotten
    assert session.settings["gravity"] == 9.81


def test_an_input_in_the_past_forgets_the_future_and_counts():
    session, seen = lived("drop")
    session.seek(seen[16][0])  # a state is kept of this very step
    session.set_gravity(1.0)
    take(session, 20)
    now = state_of(session)
    session.seek(seen[10][0])
    session.seek(1e9)
    assert np.array_equal(state_of(session), now)
    assert session.settings["gravity"] == 1.0


def test_steps_and_events_are_those_of_simulate():
    session = session_of("drop")
    take(session, 150)
    known = physics.simulate(scenes.drop(), 1.5)
    assert np.array_equal(session.subject.world.pos[0], known.pos[-1])
    assert [(event.kind, event.body, event.impulse) for event in session.events] == [
        (event.kind, event.body, event.impulse) for event in known.events
    ]
    assert session.samples.energy[-1] == pytest.approx(known.energy[-1].sum(), rel=1e-12)


def test_real_time_becomes_steps():
    session = session_of("drop")
    assert session.advance(1.0) == 0  # it is not playing
    session.play()
    session.speed = 0.5
    assert session.advance(0.03) == 1
    assert session.advance(0.01) == 1  # half a step was left over
    session.speed = 2.0
    assert session.advance(0.02) == 4
    session.pause()
    assert session.advance(0.02) == 0


def test_what_there_is_no_time_for_is_left_out_and_told(monkeypatch):
    monkeypatch.setattr(module, "BUDGET", 0.0)
    session = session_of("drop")
    session.play()
    for _ in range(30):
        assert session.advance(0.05) == 1
    assert "cannot keep up: speed 0.2" in session.message
    for _ in range(60):
        session.advance(0.01)
    assert session.message == ""


@pytest.mark.parametrize("speed", [0.0, -1.0, np.nan, "fast"])
def test_speed_is_positive(speed):
    session = session_of("drop")
    with pytest.raises(ValueError, match=r"speed is .*allowed"):
        session.speed = speed
    assert session.speed == 1.0


def test_reset_begins_anew_with_the_sliders_where_they_are():
    session, seen = lived("drop")
    session.reset()
    assert session.time == 0.0
    assert np.array_equal(state_of(session), seen[0][1])
    assert session.settings == {"gravity": 4.0, "friction": 0.1, "restitution": 0.9}
    assert session.events == []
    assert len(session.samples) == 1


def test_reset_with_a_seed_is_that_of_the_environment():
    session = session_of("rigid_env/BlockReach-v0", seed=1)
    env = rigid_env.BlockReachEnv()
    for seed in (7, 1):
        session.reset(seed)
        env.reset(seed=seed)
        assert session.seed == seed
        assert np.array_equal(session.subject.world.pos, env.task.world.pos)
    take(session, 5)
    now = state_of(session)
    session.reset()
    take(session, 5)  # the same random actions
    assert np.array_equal(state_of(session), now)
    with pytest.raises(ValueError, match="seed is -1; allowed"):
        session.reset(-1)
    assert np.array_equal(state_of(session), now)


def test_an_error_of_a_policy_pauses_at_a_whole_moment():
    def policy(observations):
        if session.time > 0.2:
            raise RuntimeError("no idea")
        return np.zeros((1, 6))

    session = session_of(rigid_env.BlockReachEnv(), policy=policy)
    session.play()
    for _ in range(20):
        session.advance(0.05)
    assert not session.is_playing
    assert session.message == "RuntimeError: no idea"
    now = state_of(session)
    assert not session.step()
    assert np.array_equal(state_of(session), now)
    session.seek(0.1)
    take(session, 2)


def test_a_fault_pauses_and_is_told():
    session = session_of(scenes.tumble())
    session.kick(0, (1e200, 0.0, 0.0))
    session.play()
    session.advance(0.05)
    assert not session.is_playing
    assert "body 0" in session.message
    assert session.events[-1].kind == "fault"
