"""Quick proof that two bodies meet: a point that both hold at the end of a stage (`stepping.passing_pairs`)."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import physics
from physics.kernels.multibody.data.contact_set import PARTED, UNBALANCED
from physics.kernels.multibody.narrowphase.gjk import gjk_distance, support_point
from physics.kernels.multibody.stepping.passing_pairs import _have_point_in_common, _holds_point
from physics.kernels.multibody.stepping.solve_and_apply import apply_impulses, leave_moments
from tests.kernels.called import called
from tests.kernels.test_tumbling import HULL_POINTS

pytestmark = pytest.mark.interpreted

SHAPES = {
    "block": lambda pos: physics.Block((2.0, 0.4, 0.6), 1.0, pos=pos),
    "sphere": lambda pos: physics.Sphere(0.4, 1.0, pos=pos),
    "ellipsoid": lambda pos: physics.Ellipsoid((1.0, 0.2, 0.3), 1.0, pos=pos),
    "hull": lambda pos: physics.Hull(HULL_POINTS, 1.0, pos=pos),
}
CONTACT = [physics.Contact(0.0)]
THINNER = 0.03
EYE = tuple(np.eye(3).ravel())


def scratch_of(first, second):
    """Scratch of a world with two bodies, and the switch of hulls."""
    world = physics.World(physics.Scene([SHAPES[first]((5.0, 0.0, 0.0)), SHAPES[second]((0.0, 0.0, 0.0))], [], CONTACT))
    world.step()  # writes shapes and sizes
    return world.scratch[0], True if "hull" in (first, second) else None


def directions(rng, count) -> np.ndarray:
    n = rng.standard_normal((count, 3))
    return n / np.linalg.norm(n, axis=1)[:, None]


@pytest.mark.parametrize("shape", SHAPES)
def test_a_body_holds_a_point_only_below_all_of_its_planes(shape):
    """A point is in a convex body if n·p <= h(n) for all n, with the support h of the body as thin as it is taken.

    Directions at random find most points outside. A hull is more cautious: it may deny a point that it holds.
    """
    many, hulls = scratch_of(shape, "sphere")
    rng = np.random.default_rng(5)
    around = directions(rng, 300)

    def heights(thinner):
        tips = [called(support_point, 0, (0.0, 0.0, 0.0), EYE, tuple(n), thinner, hulls, many) for n in around]
        return np.einsum("ij,ij->i", around, np.array(tips))

    thin, thinnest = heights(THINNER), heights(3.0 * THINNER)
    held = 0
    for p in rng.uniform(-1.1, 1.1, (150, 3)) * (1.0, 0.5, 0.5):
        if called(_holds_point, 0, tuple(p), THINNER, hulls, many):
            held += 1
            assert np.all(around @ p <= thin + 1e-12)
        elif shape != "hull":
            assert not np.all(around @ (1.1 * p) <= thinnest)
    assert held > 3


@pytest.mark.parametrize("second", SHAPES)
@pytest.mark.parametrize("first", SHAPES)
def test_bodies_with_a_point_in_common_are_not_parted_by_any_plane(first, second):
    """The distance of the hull of both places, from an independent search, is then 0."""
    many, hulls = scratch_of(first, second)
    rng, found = np.random.default_rng(6), 0
    many.contacts.bodies[0] = 0, 1
    for _ in range(60):
        now, later = [], []
        n, middle = directions(rng, 1)[0], rng.uniform(-0.2, 0.2, 3)
        for b, side in ((0, 1.0), (1, -1.0)):
            turned = Rotation.random(random_state=rng.integers(1 << 30))
            moved = Rotation.from_rotvec(rng.uniform(-0.2, 0.2, 3)) * turned
            x = middle + side * rng.uniform(0.1, 0.6) * n
            many.bodies.state[b, :3] = x
            many.contacts.arm[0, 3 * b : 3 * b + 3] = middle - x
            now.append((tuple(x), tuple(turned.as_matrix().ravel())))
            later.append((tuple(x - side * rng.uniform(0.0, 0.3) * n), tuple(moved.as_matrix().ravel())))
        now, later = tuple(now), tuple(later)
        if called(_have_point_in_common, 0, now, later, THINNER, hulls, many):
            found += 1
            assert called(gjk_distance, 0, 1, now, later, tuple(n), 1e-9, THINNER, hulls, many)[1] == 0.0
    assert found > 3


def test_the_moment_of_points_apart_is_balanced_and_the_twists_know_it():
    """An impulse at two points apart has a moment. Both bodies take it up, unless a solve has added energy by that."""
    many, _ = scratch_of("block", "sphere")
    J = [np.zeros((3, 3)) for _ in range(2)]
    for b in range(2):
        J[b][np.triu_indices(3)] = many.bodies.inv_inertia[b]
        J[b] += np.triu(J[b], 1).T
    p, arms, signs = np.array((3.0, 0.0, 0.0)), np.array([(-1.0, 0.1, 0.2), (0.4, 0.0, 0.0)]), (1.0, -1.0)
    many.contacts.bodies[0], many.contacts.frame[0] = (0, 1), np.eye(3).ravel()
    many.contacts.arm[0], many.contacts.impulse[0] = arms.ravel(), p
    for owner in (PARTED, UNBALANCED):
        many.contacts.owner[0] = PARTED
        if owner == UNBALANCED:
            called(leave_moments, 1, many)
        assert many.contacts.owner[0] == owner
        many.bodies.state[:, 7:13] = 0.0
        for b in range(2):  # as solves leave them
            many.bodies.twist[b] = *(signs[b] * many.bodies.inv_mass[b] * p), *(J[b] @ np.cross(arms[b], signs[b] * p))
        called(apply_impulses, 1, many)
        x, v, L = many.bodies.state[:, :3], many.bodies.state[:, 7:10], many.bodies.state[:, 10:13]
        np.testing.assert_allclose(many.bodies.twist[:, 3:], [J[b] @ L[b] for b in range(2)], rtol=0, atol=1e-13)
        moment = (np.cross(x, v / many.bodies.inv_mass[:, None]) + L).sum(axis=0)
        apart = np.cross(x[0] + arms[0] - x[1] - arms[1], p)
        np.testing.assert_allclose(moment, apart if owner == UNBALANCED else np.zeros(3), rtol=0, atol=1e-13)
