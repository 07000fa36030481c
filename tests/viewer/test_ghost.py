"""Ghost: the same inputs at `reference`, the distance to it, and its own error."""

from __future__ import annotations

import numpy as np
import pytest

import physics
from physics import scenes
from rigid_env.viewer.ghost import Ghost, distance
from rigid_env.viewer.listening import Call
from tests.physics.test_refine import dominoes
from tests.viewer.conftest import session_of, state_of, take


@pytest.fixture(scope="module")
def haunted():
    """A drop with a ghost from the fifth step on, and a kick."""
    session = session_of("drop", accuracy="fast")
    take(session, 5)
    session.set_ghost(True)
    session.wait()
    session.kick(0, (2.0, 0.0, 1.0))
    session.set_gravity(8.0)
    take(session, 115)
    return session


def test_both_take_the_same_inputs(haunted):
    """In free flight all presets are exact, kick, slider and all; after impacts they differ, a little."""
    error, time = haunted.samples.error, haunted.samples.time
    impact = next(event.t for event in haunted.events if event.kind == "impact")
    flying = (time > 0.055) & (time < impact)
    assert flying.sum() > 50
    assert error[flying].max() < 1e-9
    assert 1e-9 < error[-1] < 0.1
    assert np.isnan(error[:6]).all()
    assert np.isnan(haunted.samples.error_of_reference).all()  # one body: exact to rounding
    assert haunted.ghost_label == "reference"
    assert haunted.samples.cost[-1] > 0.0
    assert haunted.samples.cost_of_reference[-1] > 0.0


def test_the_ghost_goes_back_along(haunted):
    last, there = haunted.time, haunted.look().ghost.bodies[0].pos
    state = state_of(haunted)
    haunted.seek(0.8)
    assert np.abs(haunted.look().ghost.bodies[0].pos - haunted.look().frame.bodies[0].pos).max() < 1e-9
    haunted.seek(last)
    assert np.array_equal(haunted.look().ghost.bodies[0].pos, there)
    assert np.array_equal(state_of(haunted), state)


def test_before_it_was_there_it_begins_anew(haunted):
    last = haunted.time
    haunted.seek(0.02)
    look = haunted.look()
    assert np.array_equal(look.ghost.bodies[0].pos, look.frame.bodies[0].pos)
    haunted.seek(last)


def test_it_can_be_switched_off():
    session = session_of("drop")
    session.set_ghost(True)
    assert session.is_compiling
    session.set_ghost(False)
    session.wait()
    assert session.look().ghost is None
    assert session.ghost_label == ""
    take(session, 2)


def test_an_episode_that_begins_takes_the_ghost_along():
    session = session_of("rigid_env/BlockReach-v0")
    session.set_ghost(True)
    session.wait()
    take(session, 3)
    session.reset(4)
    look = session.look()
    assert np.array_equal(look.ghost.bodies[0].pos, look.frame.bodies[0].pos)
    take(session, 3)
    assert session.samples.error[-1] < 0.1


def test_of_several_bodies_the_label_says_with_which_error():
    world = physics.World(dominoes())
    ghost = Ghost(world)
    assert ghost.is_estimate
    assert ghost.own_error == 0.0
    ghost.follow([Call(world.no_wrench(), 1, 0.01, None)] * 40)
    assert 0.0 < ghost.own_error < 1e-4  # of the same kernel with looser tolerances
    assert ghost.label == f"reference, itself within {ghost.own_error:.1e} m"
    assert ghost.distance(world)[0] > 1e-3  # which has not moved
    ghost.start(world.snapshot())
    assert ghost.distance(world) == (0.0, 0.0)


def test_distance_is_of_the_worst_body():
    one, other = (physics.World(scenes.tower(3)) for _ in range(2))
    pos, quat = other.pos[0].copy(), other.quat[0].copy()
    pos[1] += (0.0, 0.03, 0.04)
    pos[2] += (1.0, 0.0, 0.0)
    quat[0] = np.cos(0.1), 0.0, np.sin(0.1), 0.0
    other.set_state(pos=pos, quat=quat)
    assert distance(one, other) == pytest.approx((1.0, 0.2))
