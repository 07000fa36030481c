"""Refusals, warnings and reports of scenes and steps that cannot do something."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import physics
from physics import Status, scenes
from physics.kernels.state import layout as at
from tests.tiers.sweep import sweep

pytestmark = pytest.mark.interpreted

PRESETS = ("fast", "balanced", "precise", "reference")
FLOOR = physics.HalfSpace((0, 1, 0), 0.0)
LAWS = [physics.Gravity((0, 0, 0)), physics.Contact(restitution=0.5), physics.Friction(0.5)]


# --- bodies in the same place --------------------------------------------------------------------------------------


def pair(pos, size=(1, 1, 1)):
    return physics.Scene([physics.Sphere(2.0, 1.0, pos=(1, 2, 3)), physics.Block(size, 1.0, pos=pos)], [], LAWS)


@pytest.mark.parametrize("pos", [(1, 2, 3), (1, 2 + 4e-16, 3)])
def test_bodies_with_their_centres_in_the_same_place_are_refused(pos):
    with pytest.raises(ValueError, match=r"bodies 0 and 1 in world 0 .* pos \[1.0, 2.0, 3.0\] and .*; allowed are"):
        physics.World(pair(pos))


def test_bodies_are_not_put_in_the_same_place_and_nothing_changes_then():
    world = physics.World(pair((9, 9, 9)), worlds=3)
    before = world.state.tobytes()
    places = world.pos.copy()
    places[2, 0] = places[2, 1]
    with pytest.raises(ValueError, match=r"set_state: bodies 0 and 1 in world 2 .*\[9.0, 9.0, 9.0\]"):
        world.set_state(pos=places)
    assert world.state.tobytes() == before


def test_the_centre_of_the_shape_counts_not_that_of_mass():
    """A block's geometric centre may lie beside its centre of mass."""
    ball, block = physics.Sphere(2.0, 1.0), {"size": (1, 1, 1), "mass": 1.0, "inertia_body": (0.2, 0.2, 0.2)}
    with pytest.raises(ValueError, match="bodies 0 and 1"):
        physics.World(physics.Scene([ball, physics.Block(**block, pos=(0.1, 0, 0), center=(-0.1, 0, 0))], [], LAWS))
    physics.World(physics.Scene([ball, physics.Block(**block, center=(0.1, 0, 0))], [], LAWS))


def test_bodies_that_do_not_touch_each_other_may_share_a_place():
    effects = [physics.Contact(between_bodies=False)]
    physics.World(physics.Scene([physics.Sphere(1.0, 1.0, pos=(0, 2, 0))] * 2, [FLOOR], effects))


def test_many_bodies_of_equal_coordinates_are_told_apart():
    """Towers and grids share two coordinates of three."""
    bodies = [physics.Sphere(0.1, 1.0, pos=(i, j, k)) for i in range(3) for j in range(3) for k in range(3)]
    physics.World(physics.Scene(bodies, [], LAWS))
    with pytest.raises(ValueError, match="bodies 13 and 27"):
        physics.World(physics.Scene([*bodies, physics.Sphere(0.2, 1.0, pos=(1, 1, 1))], [], LAWS))


@pytest.mark.parametrize("accuracy", PRESETS)
@pytest.mark.parametrize(
    "bodies",
    [
        [physics.Block((1, 1, 1), 1.0), physics.Block((1, 1, 1), 1.0, pos=(0, 0.75, 0))],
        [physics.Block((4, 4, 4), 1.0), physics.Sphere(0.2, 1.0, pos=(0, 0.5, 0))],
    ],
    ids=["a quarter of the edge", "inside"],
)
def test_bodies_put_into_each_other_are_lifted_apart_and_the_first_report_says_so(bodies, accuracy):
    world = physics.World(physics.Scene(bodies, [], LAWS), worlds=2, accuracy=accuracy)
    world.set_state(pos=[[(0, 0, 0), (50, 0, 0)]], worlds=[1])
    report = world.step()
    depth = 0.25 if len({body.kind for body in bodies}) == 1 else 1.7
    assert list(report.status) == [Status.OVERLAP, Status.OK]
    assert not report.ok
    np.testing.assert_allclose(report.overlap, (depth, 0), rtol=0, atol=1e-12)
    assert list(report.messages()) == [0]
    assert f"overlap is {depth} m" in report.messages()[0]
    assert world.step(steps=100).status[0] == Status.OK
    assert np.abs(world.linvel).max() < 1e-9
    assert abs(world.pos[0, 1, 1] - world.pos[0, 0, 1]) == pytest.approx(1.0 if depth == 0.25 else 2.2, abs=1e-4)
    world.set_state(pos=[[body.pos for body in bodies]], worlds=[1])
    assert world.step().status[1] == Status.OVERLAP


def test_bodies_that_touch_do_not_overlap():
    world = physics.World(pair((1, 4.4999, 3)))
    assert world.step().overlap[0] == 0.0


# --- effects that are missing --------------------------------------------------------------------------------------


def test_walls_without_contact_warn_of_the_line_that_made_the_scene():
    with pytest.warns(physics.SceneWarning, match=r"add physics.Contact\(\)") as told:
        physics.Scene([physics.Sphere(1.0, 1.0)], [FLOOR], [physics.Gravity((0, -9.81, 0))])
    assert [one.filename for one in told] == [__file__]


def test_usual_scenes_do_not_warn():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for name in scenes.SCENES:
            scenes.by_name(name)
        physics.Scene([physics.Sphere(1.0, 1.0)], [], [physics.Gravity((0, -9.81, 0))])
        physics.Scene([physics.Sphere(1.0, 1.0)] * 2, [], [])
        physics.Scene([physics.Sphere(1.0, 1.0)], [FLOOR], [physics.Contact()])


# --- numbers that overflow -----------------------------------------------------------------------------------------

HUGE = (1e120, 1e154, 1e160, 1e300, 1.7e308)


def blocks(count, height):
    bodies = [physics.Block((5, 3, 2), 6.0, pos=(0, height + 3.0 * k, 0)) for k in range(count)]
    return physics.Scene(bodies, [FLOOR], [physics.Gravity((0, -9.81, 0)), *LAWS[1:]])


@pytest.mark.parametrize("accuracy", PRESETS)
@pytest.mark.parametrize("height", [1.5, 50.0])
@pytest.mark.parametrize("count", [1, 2])
def test_loads_that_move_nothing_are_reported(accuracy, height, count):
    """All components, both signs: the state is kept, bit for bit, and the report says which body is at fault."""
    world = physics.World(blocks(count, height), accuracy=accuracy)
    world.step(steps=2)
    start = world.snapshot()
    for size in HUGE:
        for column in range(6):
            for sign in (1.0, -1.0):
                world.restore(start)
                before = world.state.tobytes()
                wrench = world.no_wrench()
                wrench[0, -1, column] = sign * size
                report = world.step(wrench)
                assert report.status[0] == Status.FAULT
                assert report.fault_body[0] == count - 1
                assert report.messages()[0].startswith(f"body {count - 1}: a body's loads or its new state")
                assert world.state.tobytes() == before
    world.restore(start)
    assert world.step().status[0] == Status.OK


@pytest.mark.parametrize("accuracy", PRESETS)
def test_forces_that_can_be_borne_move_as_newton_says_or_are_reported(accuracy):
    """F h/m to rounding for a body in flight and at rest, up to what is too large."""
    for height in (1.5, 50.0):
        world = physics.World(blocks(1, height), accuracy=accuracy)
        world.step(steps=2)
        start = world.snapshot()
        for size in (1e10, 1e30, 1e60, 1e90, 1e99):
            world.restore(start)
            before = world.linvel.copy()
            wrench = world.no_wrench()
            wrench[0, 0, 1] = size
            report = world.step(wrench)
            assert report.ok
            expected = size / 6.0 * 0.01 - 0.0981
            np.testing.assert_allclose((world.linvel - before)[0, 0, 1], expected, rtol=1e-12)


@pytest.mark.compiled
@pytest.mark.parametrize("accuracy", sweep(["precise", "reference"], ["precise"]))
@pytest.mark.parametrize("walls", sweep([[], [FLOOR]], [[]]))
def test_a_torque_that_turns_too_often_to_be_followed_is_reported(accuracy, walls):
    """L = T h all the same. Many turns, by kernels that others need anyway: compiled."""
    body = physics.Block((5, 3, 2), 6.0, pos=(0, 50, 0))
    world = physics.World(physics.Scene([body], walls, LAWS), accuracy=accuracy)
    wrench = world.no_wrench()
    wrench[0, 0, 3] = 1e20
    assert world.step(wrench).status[0] == Status.UNRESOLVED
    assert world.state[0, 10] == pytest.approx(1e18, rel=1e-12)


@pytest.mark.parametrize("accuracy", ["balanced", "precise"])
def test_steppers_and_trajectories_say_so_too(accuracy):
    world = physics.World(blocks(1, 1.5), accuracy=accuracy)
    step = physics.Stepper(world)
    step.wrench[0, 0, 0] = 1e160
    step()
    assert world.report.status[0] == Status.FAULT
    run = physics.simulate(blocks(1, 1.5), 0.02, accuracy, wrench=lambda t, world: np.full((1, 6), 1e160))
    assert [report.status[0] for report in run.reports] == [Status.FAULT] * 2
    assert [(event.kind, event.body) for event in run.events].count(("fault", 0)) == 2
    assert not run.ok


@pytest.mark.parametrize("accuracy", PRESETS)
def test_gravity_that_is_too_strong_is_reported(accuracy):
    world = physics.World(blocks(1, 1.5), accuracy=accuracy)
    world.set_parameters(gravity=(0, -1e200, 0))
    assert world.step().status[0] == Status.FAULT


@pytest.mark.parametrize("accuracy", sweep(PRESETS, ["fast", "balanced"]))
@pytest.mark.parametrize("count", [1, 2])
@pytest.mark.parametrize("name", ["pos", "linvel", "angvel"])
def test_states_that_are_too_large_are_reported(name, count, accuracy):
    """And kept; upwards, where no wall stops them."""
    world = physics.World(blocks(count, 50.0), accuracy=accuracy)
    for value in (1e101, 1e154, 1e200, 1e300, 1.7e308):
        given = getattr(blocks(count, 50.0).bodies[0], name)
        given = np.array([[given] * count])
        given[0, :, 1] += 3.0 * np.arange(count) if name == "pos" else 0.0
        given[0, count - 1, 1] = value
        world.set_state(**{name: given})
        before = world.state[:, : at.ANGVEL].tobytes()  # the angular velocity is derived anew
        report = world.step()
        assert report.status[0] == Status.FAULT
        assert report.fault_body[0] == count - 1
        assert world.state[:, : at.ANGVEL].tobytes() == before
        world.set_state(**{name: getattr(physics.World(blocks(count, 50.0)), name)})
        assert world.step().status[0] == Status.OK


def test_a_step_in_which_gravity_moves_a_body_by_many_radii_warns():
    """Block of radius √(25 + 9 + 4)/2 m = 3.1 m: ½ g t² is 100 radii at 7.9 s. Free flight is exact at any step."""
    scene = physics.scenes.drop()
    with pytest.warns(physics.SceneWarning, match=r"dt is 10.0 s: gravity moves a body 49\d m .*; in 0.79 s it falls"):
        physics.World(scene, dt=10.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        physics.World(scene, dt=1.0)
        physics.World(physics.Scene(scene.bodies, effects=[physics.Gravity()]), dt=1e3)


def test_explain_says_that_bodies_pass_through_each_other():
    balls = [physics.Sphere(1.0, 1.0), physics.Sphere(1.0, 1.0, pos=(3, 0, 0))]
    assert "not declared: bodies pass through each other" in physics.World(physics.Scene(balls)).plan.explain()
    assert "pass through" not in physics.World(physics.Scene(balls[:1])).plan.explain()
