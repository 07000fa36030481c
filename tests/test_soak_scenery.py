"""The soak's scenes with fixed and driven bodies: one plan, and laws that know the work of driven bodies."""

from __future__ import annotations

import numpy as np
import pytest

import physics
from benchmarks import drawn_scenery
from benchmarks.shrink import _fewer
from physics.plan.plan import make_plan
from rigid_env.hard_cases.cases import driven_supports as supports
from rigid_env.hard_cases.cases.random_scenes import Outcome, gain_limit, look

pytestmark = pytest.mark.interpreted

UP = physics.Motion(velocity=(0.3, 2, 0))


def test_all_scenes_of_the_soak_have_one_plan_and_hold_all_shapes():
    plans = set()
    for seed in range(6):
        scene = drawn_scenery.draw_scene(np.random.default_rng(seed), seed % 2 == 1)
        plans.add(make_plan(scene, "balanced").key)
        assert {body.kind for body in scene.bodies} == set(drawn_scenery.KINDS)
    assert len(plans) == 1


def hit(motion: physics.Motion | None = UP, walls=()) -> physics.World:
    """A ball above a plate that comes up, or that stands, just before they touch."""
    plate = physics.Block((4, 1, 4), fixed=True, pos=(0, -0.5, 0), motion=motion)
    ball = physics.Sphere(0.5, 1.0, pos=(0, 0.505, 0), linvel=(0, -1, 0))
    effects = [physics.Gravity(), physics.Contact(1.0), physics.Friction(0.5)]
    return physics.World(physics.Scene([ball, plate], list(walls), effects))


def test_a_plate_that_hits_a_ball_does_work_but_none_in_its_own_frame():
    world = hit()
    kinetic = physics.diagnose(world).kinetic_energy.sum()
    outcome, before = Outcome.start(1), look(world)
    world.step()
    assert physics.diagnose(world).kinetic_energy.sum() > 10 * kinetic
    outcome.note(world, before, None, world.dt)
    assert not outcome.broken_laws(gain_limit("balanced")).any()
    assert abs(before.kinetic[0] - 0.5 * (0.3**2 + 3**2)) < 1e-12
    # Energy from elsewhere is found: 1 % more of the speed relative to the plate.
    drift = np.array((0.3, 2.0, 0.0))
    world.set_state(linvel=[[drift + 1.01 * (world.linvel[0, 0] - drift), drift]])
    outcome.note(world, before, None, world.dt)
    assert outcome.law(0, gain_limit("balanced")).startswith("gained")


@pytest.mark.parametrize(
    ("motion", "walls"),
    [
        (physics.Motion(spin=(0, 1, 0)), ()),
        (physics.Motion(surface_velocity=(1, 0, 0)), ()),
        (physics.Motion.table([0, 1], pos=[(0, -0.5, 0), (0, 0.5, 0)]), ()),
        (UP, [physics.HalfSpace((1, 0, 0), -5)]),
    ],
)
def test_where_supports_move_differently_there_is_no_law_of_energy(motion, walls):
    world = hit(motion, walls)
    assert np.isnan(supports.frame_velocity(world)).all()
    outcome, before = Outcome.start(1), look(world)
    world.step()
    outcome.note(world, before, None, world.dt)
    assert outcome.gain[0] == 0.0


def test_a_fixed_body_that_moves_by_a_bit_is_found():
    world = hit(None)
    before = look(world)
    outcome = Outcome.start(1)
    outcome.note(world, before, None, world.dt)
    assert outcome.law(0, 1.0) == ""
    world.set_state(pos=[[world.pos[0, 0], (0, np.nextafter(-0.5, 0), 0)]])
    outcome.note(world, before, None, world.dt)
    assert outcome.law(0, 1.0).startswith("strayed")


def test_a_driven_body_off_its_line_is_found():
    world = hit()
    before = supports.poses(world)
    world.step()
    assert not supports.has_strayed(world, before, world.dt).any()
    world.set_state(pos=world.pos + np.array([[0, 0, 0], [1e-10, 0, 0]]))
    assert supports.has_strayed(world, before, world.dt).all()


def test_a_room_knows_who_is_outside_wherever_it_goes():
    rng = np.random.default_rng(1)
    world = physics.World(drawn_scenery.draw_scene(rng, True))
    turn = (np.cos(0.4), 0, np.sin(0.4), 0)
    room = world.names.index(supports.ROOM)
    R = supports.rotation_matrices(np.array(turn))
    middle = world.pos[0, room] + (3, 4, 5) - R @ world.scene.bodies[room].centroid
    pos, quat = world.pos.copy(), world.quat.copy()
    pos[0, room] += (3, 4, 5)
    quat[0, room] = turn
    pos[0, room + 1] = middle + R @ (9.9, 0, 0)
    world.set_state(pos=pos, quat=quat)
    assert look(world).escaped[0] == 0.0
    assert np.allclose(supports.places_in_room(world)[0, room + 1], (9.9, 0, 0))
    pos[0, room + 1] = middle + R @ (10.1, 0, 0)
    world.set_state(pos=pos)
    assert look(world).escaped[0] > 0.0


def test_one_that_leaves_a_room_counts_unless_a_report_told_of_it():
    world = physics.World(drawn_scenery.draw_scene(np.random.default_rng(1), True))
    before, pos = look(world), world.pos.copy()
    pos[0, 1] += (0, 20, 0)
    world.set_state(pos=pos)
    for is_told in (False, True):
        outcome = Outcome.start(1)
        outcome.told[:] = is_told
        outcome.note(world, before, None, world.dt)
        assert outcome.law(0, np.inf).startswith("escaped") == (not is_told)
        assert outcome.has_left.tolist() == [is_told]


def test_a_smaller_recording_leaves_out_bodies_that_no_pair_needs():
    world = physics.World(drawn_scenery.draw_scene(np.random.default_rng(0), False))
    scene, last = world.scene, world.body_count - 1
    assert _fewer(scene, last).bodies == scene.bodies[:last]  # no index changes
    pairs = {(0, 1): 0.5}
    effects = [physics.Contact(), physics.Friction(pairs=pairs)]
    two = physics.Scene([physics.Sphere(1.0, 1.0), physics.Sphere(1.0, 1.0, pos=(3, 0, 0))], effects=effects)
    assert _fewer(two, 1) is None
