"""Impacts as events: which bodies, where, and with what impulse; they add up to the change of momentum."""

from __future__ import annotations

import numpy as np
import pytest

import physics
from physics.analysis import simulate
from physics.kernels.time_stepping import event_log

pytestmark = pytest.mark.interpreted

PRESETS = ("fast", "balanced", "precise", "reference")
FLOOR = physics.HalfSpace((0, 1, 0), 0.0)


def laws(restitution, friction=0.5):
    return [
        physics.Gravity((0, 0, 0)), physics.Contact(restitution=restitution), physics.Friction(friction)
    ]  # fmt: skip


def impacts(run):
    return [event for event in run.events if event.kind == "impact"]


def received(run, body):
    """(3,) sum of the impulses on a body [N s]."""
    total = np.zeros(3)
    for event in impacts(run):
        total += np.multiply(event.impulse, (event.body == body) - 1.0 * (event.other == body))
    return total


def check_momenta(run, masses, share):
    """Every body's momentum changes by its impulses, to a share of the largest momentum there is."""
    scale = max(m * np.linalg.norm(v) for m, v in zip(masses, run.linvel[0]))
    for body, mass in enumerate(masses):
        change = mass * (run.linvel[-1, body] - run.linvel[0, body])
        np.testing.assert_allclose(received(run, body), change, rtol=0, atol=share * scale)


@pytest.mark.parametrize("accuracy", PRESETS)
@pytest.mark.parametrize("e", [0.5, 1.0])
def test_two_spheres_head_on_give_the_impulse_of_the_closed_form(accuracy, e):
    """J = (1 + e) m M/(m + M) times the speed of approach, once, at the point between the centres."""
    m, M = 2.0, 3.0
    bodies = [
        physics.Sphere(0.5, m, linvel=(1, 0, 0)),
        physics.Sphere(0.75, M, pos=(2.25, 0, 0), linvel=(-1, 0, 0)),
    ]
    run = physics.simulate(physics.Scene(bodies, [], laws(e)), 1.0, accuracy)
    (hit,) = impacts(run)
    tolerance = 1e-5 if accuracy == "fast" else 2e-6
    assert (hit.body, hit.other, hit.wall) == (0, 1, -1)
    assert hit.t == pytest.approx(0.5, abs=tolerance)
    np.testing.assert_allclose(hit.impulse, ((1 + e) * m * M / (m + M) * -2.0, 0, 0), rtol=0, atol=4e-15 * 10)
    np.testing.assert_allclose(hit.normal, (-1, 0, 0), rtol=0, atol=1e-15)
    np.testing.assert_allclose(hit.point, (1, 0, 0), rtol=0, atol=tolerance)
    check_momenta(run, (m, M), 1e-14)


@pytest.mark.parametrize("accuracy", PRESETS[1:])
def test_a_cradle_of_blocks_hands_the_momentum_on_pair_by_pair(accuracy):
    """Equal blocks, e = 1, a gap between each two: m v goes through every pair once, at the middle of its faces."""
    m, v, gap = 2.0, 3.0, 0.1
    bodies = [
        physics.Block((1, 1, 1), m, pos=((1 + gap) * k, 0, 0), linvel=(v if k == 0 else 0, 0, 0)) for k in range(5)
    ]
    run = physics.simulate(physics.Scene(bodies, [], laws(1.0)), 0.3, accuracy)
    hits = impacts(run)
    assert [(hit.body, hit.other) for hit in hits] == [(0, 1), (1, 2), (2, 3), (3, 4)]
    for k, hit in enumerate(hits):
        assert hit.t == pytest.approx((k + 1) * gap / v, abs=1e-4)
        np.testing.assert_allclose(hit.impulse, (-m * v, 0, 0), rtol=0, atol=1e-3 * m * v)
        np.testing.assert_allclose(hit.point, ((1 + gap) * (k + 1) - 0.5, 0, 0), rtol=0, atol=1e-4)
        np.testing.assert_allclose(hit.normal, (-1, 0, 0), rtol=0, atol=1e-12)
    check_momenta(run, [m] * 5, 1e-12)


@pytest.mark.parametrize("accuracy", ["fast", "balanced", "precise"])
def test_a_tower_thrown_at_the_floor_tells_the_floor_from_its_blocks(accuracy):
    """Each block loses the sum of its impulses, the floor's and its neighbours'; no more pairs than met."""
    masses = (2.0, 1.0, 3.0)
    bodies = [physics.Block((1, 1, 1), m, pos=(0, 1 + 1.1 * k, 0), linvel=(0, -2, 0)) for k, m in enumerate(masses)]
    run = physics.simulate(physics.Scene(bodies, [FLOOR], laws(0.5)), 1.0, accuracy)
    met = {(hit.body, hit.wall, hit.other) for hit in impacts(run)}
    assert met == {(0, 0, -1), (0, -1, 1), (1, -1, 2)}
    first = impacts(run)[0]
    assert (first.body, first.wall) == (0, 0)
    assert first.t == pytest.approx(0.25, abs=1e-4)
    np.testing.assert_allclose(first.point, (0, 0, 0), rtol=0, atol=1e-4)
    np.testing.assert_allclose(first.normal, (0, 1, 0), rtol=0, atol=1e-12)
    assert all(np.dot(hit.impulse, hit.normal) > 0 for hit in impacts(run))
    # At `fast` the resting stage stops what would go in by 100 slops in half a step, 0.17 m/s here, without an impact,
    # and more than once in a tower.
    check_momenta(run, masses, 0.1 if accuracy == "fast" else 1e-6)


@pytest.mark.parametrize("accuracy", PRESETS)
def test_a_ball_that_hits_a_block_off_its_centre_turns_it_by_the_moment_of_its_impulse(accuracy):
    """With friction: L of the block after is (point - its centre) x the impulse on it; the ball's likewise."""
    bodies = [
        physics.Block((2, 1, 1), 4.0, inertia_body=(1, 2, 3)),
        physics.Sphere(0.25, 1.0, pos=(0.75, 1.25, 0.2), linvel=(0.5, -2, 0.3), angvel=(3, 0, -4)),
    ]
    run = physics.simulate(physics.Scene(bodies, [], laws(0.6)), 0.5, accuracy, sample_dt=0.5)
    (hit,) = impacts(run)
    assert (hit.body, hit.other) == (0, 1)
    assert abs(hit.impulse[0]) > 0.1  # friction has a part in it
    check_momenta(run, (4.0, 1.0), 1e-13)
    moment = np.cross(hit.point, hit.impulse)  # the block's centre of mass is at the origin until then
    world = physics.World(physics.Scene(bodies, [], laws(0.6)), dt=0.5, accuracy=accuracy)
    world.step()
    np.testing.assert_allclose(world.state[0, 10:13], moment, rtol=0, atol=1e-12)


@pytest.mark.parametrize("accuracy", PRESETS)
def test_impacts_with_walls_name_body_and_wall_where_bodies_meet_only_walls(accuracy):
    """One block between floor and wall, e = 1: the impulse turns the velocity round."""
    block = physics.Block((1, 1, 1), 3.0, pos=(1, 1, 0), linvel=(2, -1, 0))
    walls = [FLOOR, physics.HalfSpace((-1, 0, 0), -3.0)]
    run = physics.simulate(physics.Scene([block], walls, laws(1.0, 0.0)), 1.2, accuracy)
    floor, wall = impacts(run)
    assert (floor.body, floor.wall, floor.other, wall.body, wall.wall) == (0, 0, -1, 0, 1)
    np.testing.assert_allclose((floor.t, wall.t), (0.5, 0.75), rtol=0, atol=1e-4)
    np.testing.assert_allclose((floor.impulse, wall.impulse), ((0, 6, 0), (-12, 0, 0)), rtol=0, atol=1e-12)
    np.testing.assert_allclose((floor.point, wall.point), ((2, 0, 0), (3, 0.75, 0)), rtol=0, atol=1e-4)
    np.testing.assert_allclose((floor.normal, wall.normal), ((0, 1, 0), (-1, 0, 0)), rtol=0, atol=1e-12)


def _thrown():
    """Three balls and a block that fall on each other and the floor with friction."""
    bodies = [
        physics.Block((2, 1, 1), 4.0, pos=(0, 0.7, 0), angvel=(0.3, 0.2, 1)),
        physics.Sphere(0.3, 1.0, pos=(0.5, 1.6, 0.1), linvel=(0.5, -4, 0)),
        physics.Sphere(0.3, 2.0, pos=(-0.5, 1.8, 0.1), linvel=(0.5, -4, 1)),
    ]
    return physics.Scene(bodies, [FLOOR], laws(0.6))


@pytest.mark.parametrize("accuracy", ["balanced", "precise"])
def test_a_log_changes_nothing_and_tells_when_it_is_full(accuracy):
    """The same bits with room and without; the count goes on where the room ends, and nothing is counted without."""
    plain, logged, small = (physics.World(_thrown(), dt=0.1, accuracy=accuracy) for _ in range(3))
    logged.make_event_room(64)
    small.make_event_room(1)
    most = 0
    for _ in range(6):
        for world in (plain, logged, small):
            world.step()
        assert plain.state.tobytes() == logged.state.tobytes() == small.state.tobytes()
        assert not plain.event_counts.any()
        np.testing.assert_array_equal(logged.event_counts, small.event_counts)
        most = max(most, int(small.event_counts.max()))
        for body, count in enumerate(logged.event_counts):
            assert (np.diff(logged.event_log[body, :count, event_log.EVENT_TIME]) >= 0).all()
            assert (logged.event_log[body, :count, event_log.EVENT_KIND] == event_log.KIND_IMPACT).all()
    assert most > 1


@pytest.mark.parametrize("accuracy", ["balanced", "precise"])
def test_a_step_with_more_events_than_room_is_taken_again(accuracy, monkeypatch):
    """`simulate` loses none."""
    whole = physics.simulate(_thrown(), 0.6, accuracy, sample_dt=0.1)
    monkeypatch.setattr(simulate, "EVENT_ROOM", 1)
    again = physics.simulate(_thrown(), 0.6, accuracy, sample_dt=0.1)
    assert whole.events == again.events
    assert len(impacts(whole)) > 3
    assert whole.pos.tobytes() == again.pos.tobytes()


def test_bodies_that_come_to_lie_on_each_other_touch_and_part():
    """Time stepping tells the pairs that rest on each other, not only the walls."""
    bodies = [physics.Block((1, 1, 1), 1.0, pos=(0, 0.5, 0)), physics.Block((1, 1, 1), 1.0, pos=(0, 1.5, 0))]
    effects = [physics.Gravity((0, -9.81, 0)), physics.Contact(restitution=0.5), physics.Friction(0.5)]

    def lift(t, world):
        load = world.no_wrench()[0]
        load[1, 1] = 30.0 if t > 0.045 else 0.0
        return load

    run = physics.simulate(physics.Scene(bodies, [FLOOR], effects), 0.1, wrench=lift)
    told = [(event.kind, event.body, event.wall, event.other) for event in run.events]
    assert told[:2] == [("touch", 0, 0, -1), ("touch", 0, -1, 1)]
    assert ("release", 0, -1, 1) in told


def test_a_step_that_is_not_kept_logs_nothing():
    """No impact is logged for a world that keeps its old state."""
    world = physics.World(_thrown())
    world.make_event_room(16)
    wrench = world.no_wrench()
    wrench[0, 1, 1] = -1e160
    world.step(wrench)
    assert world.report.faults[0] == 1
    assert not world.event_counts.any()


@pytest.mark.parametrize(
    ("count", "accuracy"),
    [
        (1, "balanced"),
        (1, "precise"),
        pytest.param(2, "balanced", marks=pytest.mark.compiled),  # others need its kernel anyway
        (2, "precise"),
    ],
)
def test_random_impacts_with_friction_and_rebound_add_up(accuracy, count, is_exhaustive):
    """Also where only a part of the rebound is made, since the whole would gain energy."""
    worlds, rng = 100 if count == 1 or accuracy == "balanced" else 10, np.random.default_rng(0)
    if count == 1 and not is_exhaustive:
        worlds = 40
    flying = physics.Block((1, 4, 0.5), 2.0, pos=(0, 8, 0))
    bodies, floor = ([flying], 0.0) if count == 1 else ([physics.Block((5, 3, 2), 6.0), flying], -1000.0)
    scene = physics.Scene(bodies, [physics.HalfSpace((0, 1, 0), floor)], laws(1.0, 1.5))
    world = physics.World(scene, worlds, dt=0.02, accuracy=accuracy)
    world.make_event_room(64)
    quat, linvel = rng.normal(size=(worlds, count, 4)), rng.normal(size=(worlds, count, 3))
    quat /= np.linalg.norm(quat, axis=2, keepdims=True)
    linvel[:, -1, 1] -= 8.0
    world.set_state(quat=quat, linvel=linvel, angvel=3 * rng.normal(size=(worlds, count, 3)))
    masses = np.array([body.mass for body in bodies])[:, None]
    before = masses * world.linvel
    world.step(steps=50)
    told = np.zeros_like(before)
    for row, (number, events) in enumerate(zip(world.event_counts, world.event_log)):
        of, body = divmod(row, count)
        for event in events[:number]:
            impulse, other = (
                event[event_log.EVENT_IMPULSE : event_log.EVENT_IMPULSE + 3],
                int(event[event_log.EVENT_OTHER]),
            )
            told[of, body] += impulse
            if other >= 0:
                told[of, other] -= impulse
    assert 0 < world.event_counts.max() <= 64
    errors = np.abs(told - (masses * world.linvel - before)).max(axis=(1, 2))
    assert errors.max() < 1e-13
    assert not world.report.overlap.any()  # nothing was put into anything, however long it flew without contact
    assert np.median(np.abs(told).max(axis=(1, 2))) > 1.0 or count == 2
