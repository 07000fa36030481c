"""The notes' a = A f + b against statics and Newton."""

from __future__ import annotations

import math

import numpy as np
import pytest

import physics
from physics import scenes
from physics.analysis.resting_contact import resting_contact

pytestmark = pytest.mark.interpreted


def test_block_at_rest_is_carried_by_its_corners():
    """Σ f = m g, no acceleration; A is singular (four corners of one face, rank 3) and the solver says solved."""
    world = physics.World(scenes.rest(), dt=0.005)
    contact = resting_contact(world)
    assert len(contact.forces) == 4
    assert np.linalg.matrix_rank(contact.A) == 3
    assert contact.result.residual < 1e-12
    assert contact.forces.sum() == pytest.approx(6 * scenes.GRAVITY, rel=1e-12)
    assert np.abs(contact.accelerations).max() < 1e-12
    moment = np.cross(contact.points - world.pos[0, 0], contact.forces[:, None] * contact.normals).sum(axis=0)
    assert np.abs(moment).max() < 1e-11


def test_agrees_with_the_step_of_the_world():
    """A frictionless block pressed off centre: the stepping contact forces have the same sum and moment."""
    scene = physics.Scene(scenes.rest().bodies, scenes.rest().walls, [physics.Gravity(), physics.Contact()])
    world = physics.World(scene, dt=1e-3)
    load = np.array([0, -30.0, 0, 5.0, 0, -20.0])
    contact = resting_contact(world, wrench=load)
    world.step(load[None, None], steps=3)
    points, forces = world.contacts()
    assert forces.sum(axis=0) == pytest.approx((contact.forces[:, None] * contact.normals).sum(axis=0), rel=1e-6)
    stepped = np.cross(points - world.pos[0, 0], forces).sum(axis=0)
    assert stepped == pytest.approx(-load[3:] * [1, 1, 1], abs=1e-4)


def test_lifts_off_where_the_load_pulls():
    """A torque beyond m g b tips the block over an edge: the corners of the other side accelerate upwards."""
    world = physics.World(scenes.rest(), dt=0.005)
    torque = 1.5 * 6 * scenes.GRAVITY * 2.5
    contact = resting_contact(world, wrench=(0, 0, 0, 0, 0, torque))
    left = contact.points[:, 0] < 0
    assert (contact.accelerations[~left] > 0.1).all() != (contact.accelerations[left] > 0.1).all()
    lifted = contact.accelerations > 0.1
    assert lifted.sum() == 2
    assert np.abs(contact.forces[lifted]).max() == 0
    assert contact.forces.min() >= 0


def test_centripetal_acceleration_is_in_b():
    """A sphere pendulum's worth of ω x (ω x r): a block spinning on its face about the vertical has none along it,
    one rolling about an edge axis has -ω² r."""
    body = physics.Block((5, 3, 2), 6.0, pos=(0, 1.5, 0), angvel=(0, 0, 0.5), linvel=(0.75, 1.25, 0))
    scene = physics.Scene([body], [physics.HalfSpace((0, 1, 0))], [physics.Gravity(), physics.Contact()])
    contact = resting_contact(physics.World(scene, dt=0.005))
    # Turning about the edge x = -2.5: only that edge touches (the other rises), b = -g + ω² 1.5.
    assert contact.b == pytest.approx([-scenes.GRAVITY + 0.25 * 1.5] * 2, rel=1e-12)


def test_incline_forces_are_the_normal_share_of_the_weight():
    world = physics.World(scenes.incline(math.radians(20), 0.5), dt=0.005)
    assert resting_contact(world).forces.sum() == pytest.approx(
        6 * scenes.GRAVITY * math.cos(math.radians(20)), rel=1e-9
    )


def test_indices_are_checked():
    world = physics.World(scenes.rest(), dt=0.005)
    with pytest.raises(ValueError, match="index, body is 1, 0"):
        resting_contact(world, index=1)
    with pytest.raises(ValueError, match=r"wrench has shape \(3,\)"):
        resting_contact(world, wrench=(1, 2, 3))
