"""Controls of a session: the hand, sliders, accuracy and errors about them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import physics
import rigid_env
from physics import scenes
from physics.kernels.state import layout as at
from rigid_env.viewer.hand import Hand, _least_mass
from tests.viewer.conftest import session_of, state_of, take


def momentum(session) -> np.ndarray:
    return scenes.MASS * session.subject.world.linvel[0, 0].copy()


@pytest.mark.parametrize("what", ["tumble", rigid_env.BlockReachEnv])
def test_a_kick_gives_its_impulse(what):
    """In free flight, within one step; of an environment from the air, without its actions."""
    policy = {} if isinstance(what, str) else {"policy": lambda observations: np.zeros((1, 6))}
    session = session_of(what if isinstance(what, str) else what(gravity=1e-9), **policy)
    session.kick(0, (0.0, 6.0, 0.0))
    session.kick(0, (0.0, 3.0, 0.0))
    take(session, 1)
    assert momentum(session) == pytest.approx((0.0, 9.0, 0.0), abs=1e-6)
    take(session, 3)
    assert momentum(session) == pytest.approx((0.0, 9.0, 0.0), abs=1e-6)


def test_no_actuator_stands_between_the_hand_and_a_body(tmp_path):
    """Hold for a scene and an environment, with a ghost and on the way back; 9 N s in a step of 0.01 s are 900 N."""
    weak = physics.Actuator(limit_force=1.0)
    ball = physics.Scene([physics.Sphere(0.5, scenes.MASS)], effects=[physics.Gravity((0, 0, 0)), weak])
    still = {"policy": lambda observations: np.zeros((1, 6))}
    for session in (session_of(ball), session_of(rigid_env.BlockReachEnv(gravity=1e-9, effects=[weak]), **still)):
        session.set_ghost(True)
        session.wait()
        world = session.subject.world
        session.kick(0, (0.0, 9.0, 0.0))
        take(session, 3)
        assert momentum(session) == pytest.approx((0.0, 9.0, 0.0), abs=1e-6)
        assert session.samples.error[-1] < 1e-9
        now = state_of(session)
        session.seek(0.0)
        take(session, 3)
        assert np.array_equal(state_of(session), now)
        assert world.actuation.past is None


@pytest.mark.parametrize("dt", [0.01, 0.1])
def test_a_drag_brings_the_point_to_the_target(dt):
    """Held at a corner: the body swings about it for ever, but the spring itself is calm, whatever the step."""
    session = session_of("tumble", dt=dt)
    target = np.array((3.0, 4.0, 2.0))
    session.drag(0, (2.5, 1.5, 1.0), target)
    assert np.linalg.norm(session.look().drag[0] - target) > 2.0
    apart = []
    for _ in range(300):
        take(session, 1)
        held, end = session.look().drag
        assert np.array_equal(end, target)
        apart.append(np.linalg.norm(held - target))
    assert max(apart[200:]) < 0.7  # a body that turns once in 3 s pulls with its weight
    session.release()
    assert session.look().drag is None


@given(
    quat=st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1),
    arm=st.tuples(*[st.floats(-3, 3)] * 3),
)
def test_the_least_mass_at_a_point_is_at_most_the_body_s(quat, arm):
    """And no force meets less of it: u·K u of no direction u is above the largest eigenvalue."""
    world = physics.World(scenes.tumble())
    params, quat, arm = world.params[0], np.array(quat) / np.linalg.norm(quat), np.array(arm)
    least = _least_mass(params, quat, arm)
    assert 0.0 < least <= scenes.MASS * (1 + 1e-12)
    assert _least_mass(params, quat, np.zeros(3)) == pytest.approx(scenes.MASS)
    assert _least_mass(params, -quat, arm) == pytest.approx(least)


def test_a_hand_without_anything_to_do_gives_no_load():
    world, hand = physics.World(scenes.tumble()), Hand()
    assert hand.load(world, 0.01) is None
    hand.kick(0, np.ones(3))
    assert hand.copy().load(world, 0.5)[0] == pytest.approx((2, 2, 2, 0, 0, 0))


def test_sliders_act_at_once():
    session = session_of("drop")
    assert session.settings == {"gravity": 9.81, "friction": 0.5, "restitution": 0.3}
    speed = session.subject.world.linvel[0, 0, 1]
    for strength in (3.0, 0.0):
        session.set_gravity(strength)
        take(session, 1)
        now = session.subject.world.linvel[0, 0, 1]
        assert now - speed == pytest.approx(-0.01 * strength, abs=1e-12)
        speed = now
    session.set_friction(0.25)
    session.set_restitution(0.75)
    assert session.subject.world.params[0, at.FRICTION] == 0.25
    assert session.subject.world.params[0, at.RESTITUTION] == 0.75


def test_a_slider_of_an_environment_stays_in_later_episodes():
    session = session_of(rigid_env.BlockReachEnv(friction=(0.3, 0.6)))
    session.set_friction(0.1)
    assert session.settings["friction"] == 0.1
    session.reset(5)
    assert session.settings["friction"] == 0.1


@pytest.mark.interpreted
def test_effects_are_declared_in_the_copy_alone():
    scene = scenes.tower(2)
    world = physics.World(scene)
    session = session_of(world)
    assert session.settings == {"gravity": 9.81, "friction": 0.5, "restitution": 0.0}
    session.set_restitution(0.5)
    take(session, 1)
    assert world.time == 0.0
    assert not world.plan.restitution


def test_contact_laws_need_contact():
    session = session_of("tumble")
    assert set(session.settings) == {"gravity"}
    with pytest.raises(ValueError, match="friction does not act on tumble; allowed controls are drag, gravity"):
        session.set_friction(0.1)


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda s: s.drag(1, (0, 0, 0), (0, 0, 0)), "body is 1"),
        (lambda s: s.drag(0, (0, 0), (0, 0, 0)), "point_body"),
        (lambda s: s.kick(0, (0, np.nan, 0)), "impulse"),
        (lambda s: s.set_gravity(-1.0), "gravity is -1.0"),
        (lambda s: s.set_friction(-1.0), "friction is -1.0"),
        (lambda s: s.set_restitution(1.5), "restitution is 1.5"),
        (lambda s: s.set_accuracy("exact"), "accuracy is 'exact'"),
        (lambda s: s.seek("now"), "time is 'now'"),
    ],
)
def test_wrong_inputs_say_what_is_allowed_and_change_nothing(call, told):
    session = session_of("drop")
    take(session, 3)
    before, settings = state_of(session), session.settings
    with pytest.raises(ValueError, match=f"{told}.*allowed"):
        call(session)
    assert np.array_equal(state_of(session), before)
    assert session.settings == settings
    assert session.look().drag is None
    assert not session._run.history.inputs


@pytest.mark.parametrize("what", ["drop", "rigid_env/BlockReach-v0"])
def test_another_accuracy_carries_the_state_and_comes_back(what):
    session = session_of(what)
    take(session, 20)
    before, time = state_of(session), session.time
    session.set_accuracy("fast")
    session.wait()
    assert session.accuracy == "fast"
    assert session.subject.world.accuracy == physics.PRESETS["fast"]
    assert np.array_equal(state_of(session), before)
    take(session, 20)
    after = state_of(session)
    session.seek(0.5 * time)
    assert session.accuracy == "balanced"
    session.seek(1e9)
    assert session.accuracy == "fast"
    assert np.array_equal(state_of(session), after)
    session.set_accuracy("balanced")  # it is there
    assert session.accuracy == "balanced"
    assert not session.is_compiling


def test_the_old_accuracy_goes_on_while_the_new_one_compiles(monkeypatch):
    import threading

    may_go_on = threading.Event()
    session = session_of("drop")
    warm = session.subject.prepare
    monkeypatch.setattr(session.subject, "prepare", lambda name: [warm(name), may_go_on.wait][1])
    session.set_accuracy("fast")
    assert session.is_compiling
    assert "compiling fast" in session.message
    take(session, 3)
    assert session.accuracy == "balanced"
    now = state_of(session)
    may_go_on.set()
    session.wait()
    assert session.accuracy == "fast"
    assert np.array_equal(state_of(session), now)


def test_a_preset_that_does_not_compile_is_told(monkeypatch):
    def broken():
        raise RuntimeError("no room")

    session = session_of("drop")
    monkeypatch.setattr(session.subject, "prepare", lambda name: broken)
    session.set_accuracy("fast")
    session.wait()
    assert session.message == "fast: RuntimeError: no room"
    assert session.accuracy == "balanced"
    take(session, 1)
