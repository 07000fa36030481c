"""Contact points of a lone body follow edges: their velocities against two narrow phases, a moment apart."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import physics
from physics.kernels.multibody.data.allocation import make_bodies_workspace
from physics.kernels.multibody.data.arrays import NUM_CONTACTS
from physics.kernels.multibody.narrowphase.dispatch import find_contacts
from physics.rotations import rotation_matrices
from physics.scene.parts import SHAPE_CODES
from physics.scene.polyhedra import polyhedra
from tests.kernels.called import called

pytestmark = pytest.mark.interpreted

SETTINGS = {"relative_slop": 1e-6, "tolerance": 1e-6, "sweeps": 100, "splits": 8, "rest_share": 0.5}
MOMENT = 1e-6  # [s]
TABLE = (2.0, 1.0, 1.5)


def as_hull(block: physics.Block) -> physics.Hull:
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * np.array(block.size) / 2
    given = {} if block.fixed else {"mass": block.mass}
    return physics.Hull(corners.tolist(), fixed=block.fixed, pos=block.pos, quat=block.quat, **given)


def touching(table, block, velocity, spin):
    """Contacts by their ids: (point, velocity with which it follows its edge, material it is carried by)."""
    bodies = [table, block]
    many = make_bodies_workspace(
        2, np.zeros((0, 10)), (), polyhedra(bodies), np.array([1, 0]), lone=True, meet=2, **SETTINGS
    )
    many.bodies.body["shape"] = [SHAPE_CODES[body.kind] for body in bodies]
    many.bodies.body["dims"] = [body.dimensions for body in bodies]
    many.bodies.body["radius"] = [body.bounding_radius(body.dimensions) for body in bodies]
    many.bodies.body["mass"] = many.bodies.body["acceleration"] = 1.0
    many.bodies.body["slop"] = 1e-6
    many.bodies.center[:] = many.bodies.state[:, :3] = [body.pos for body in bodies]
    many.bodies.rotation[:] = [rotation_matrices(np.array(body.quat)).ravel() for body in bodies]
    many.bodies.twist[1, :3], many.bodies.twist[1, 3:] = velocity, spin
    hulls = True if "hull" in (table.kind, block.kind) else None
    called(find_contacts, 0.01, None, hulls, 0, None, many)
    found = {}
    for k in range(many.counts[NUM_CONTACTS]):
        point = many.bodies.center[1] + many.contacts.arm[k, :3]
        other = 0 if many.contacts.owner[k] == 1 else 1  # the points are those of the incident face
        arm = point - many.bodies.center[other]
        carried = many.bodies.twist[other, :3] + np.cross(many.bodies.twist[other, 3:], arm)
        found[int(many.contacts.id[k])] = point, carried + many.lone.follow[k]
    return found


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), kinds=st.sampled_from([(0, 0), (1, 0), (0, 1), (1, 1)]))
def test_contact_points_move_as_the_next_narrow_phase_finds_them(seed, kinds):
    """A block slides and turns on a table, over its rims. Each point of contact moves as found a moment later.

    Second derivatives of the points are up to 1e4 m/s² where edges cross at 0.05 rad, which is 1e-2 m/s in a moment.
    """
    rng = np.random.default_rng(seed)
    yaw, place = rng.uniform(-math.pi, math.pi), rng.uniform(-1.0, 1.0, 2)
    velocity, spin = np.array([*rng.normal(size=2), 0.0])[[0, 2, 1]], np.array([0.0, rng.normal(), 0.0])
    size = rng.uniform(0.4, 1.2, 3)

    def block(t):
        angle = yaw + spin[1] * t
        pos = np.array([place[0], 0.5 + size[1] / 2, place[1]]) + velocity * t
        return physics.Block(size, 1.0, pos=pos, quat=(math.cos(angle / 2), 0, math.sin(angle / 2), 0))

    table = physics.Block(TABLE, fixed=True)
    shapes = [as_hull if kind else (lambda body: body) for kind in kinds]
    before, after = (touching(shapes[0](table), shapes[1](block(t)), velocity, spin) for t in (0.0, MOMENT))
    for name in before.keys() & after.keys():
        moved = (after[name][0] - before[name][0]) / MOMENT
        np.testing.assert_allclose(before[name][1], moved, atol=1e-2)
