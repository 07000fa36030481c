"""Time for which bodies that turn far stay clear: the bounds hold, and are good enough to get there."""

from __future__ import annotations

import numpy as np
import pytest

import physics
from physics.compiler.decorators import kernel
from physics.kernels.half_space.conservative_advancement import safe_advance, spin_bound
from physics.kernels.multibody.narrowphase.gjk import gjk_distance
from physics.kernels.state.layout import HULL, SPHERE
from tests.kernels.called import called
from tests.reference import turning as truth
from tests.reference.separation import largest_separation

pytestmark = pytest.mark.interpreted

HULL_POINTS = ((1.0, 0.0, -0.6), (-0.5, 0.9, -0.6), (-0.5, -0.9, -0.6), (0.2, 0.1, 1.1), (0.9, 0.8, 0.3))
SHAPES = {
    "block": physics.Block((2.0, 0.1, 0.6), 1.0),
    "sphere": physics.Sphere(0.4, 1.0),
    "ellipsoid": physics.Ellipsoid((1.0, 0.05, 0.3), 1.0),
    "hull": physics.Hull(HULL_POINTS, 1.0),
}


@kernel
def safe_time_of(y, horizon, scratch):
    """(bound of |ω|, gap, safe time) of a body and the first wall."""
    spin = spin_bound(y[1], y[3], horizon, None, scratch[0].body)
    gap, t = safe_advance(y, 0, horizon, spin, None, scratch[0])
    return spin, gap, t


def support(body, R, n) -> np.ndarray:
    """Reach of a body along the directions n (k, 3) from its place."""
    local = np.atleast_2d(n) @ R
    if isinstance(body, physics.Hull):
        return (local @ np.array(body.polyhedron.vertices).T).max(axis=1)
    if isinstance(body, physics.Block):
        return np.abs(local) @ (0.5 * np.array(body.size))
    return np.linalg.norm(local * (body.semi_axes if isinstance(body, physics.Ellipsoid) else body.radius), axis=1)


@pytest.mark.parametrize("second", SHAPES)
@pytest.mark.parametrize("first", SHAPES)
def test_the_distance_of_two_bodies_is_a_bound_that_falls_short_by_a_tenth_at_most(first, second):
    """The result is n·d - s_a(-n) - s_b(n) for the direction that comes out, which no distance is below."""
    if first == second == "sphere":
        pytest.skip("their distance is needed nowhere")
    a, b = SHAPES[first], SHAPES[second]
    place = (5.0, 0.0, 0.0)
    scene = physics.Scene([type(a)(**{**_parts(a), "pos": place}), b], [], [physics.Contact(0.0)])
    many = physics.World(scene).scratch[0]
    has_hulls = True if "hull" in (first, second) else None
    for k, body in enumerate((a, b)):
        many.bodies.body[k]["shape"] = {"block": 0, "sphere": SPHERE, "ellipsoid": 2, "hull": HULL}[(first, second)[k]]
        many.bodies.body[k]["dims"] = _dims(body)
    rng = np.random.default_rng(3)
    for k in range(12):
        R, S = (truth.Rotation.random(random_state=rng.integers(1 << 30)).as_matrix() for _ in range(2))
        d = rng.standard_normal(3)
        d *= (0.5 + 1.5 * rng.random()) / np.linalg.norm(d)
        n, gap = called(
            gjk_distance,
            0,
            1,
            ((tuple(d), tuple(R.ravel())), ((0.0, 0.0, 0.0), tuple(S.ravel()))),
            None,
            tuple(d),
            1e-9,
            0.0,
            has_hulls,
            many,
        )
        best = largest_separation(lambda n, R=R: support(a, R, -n), lambda n, S=S: support(b, S, n), d, seed=k)
        n = np.array(n)
        if gap > 0:
            assert gap == pytest.approx(n @ d - support(a, R, -n)[0] - support(b, S, n)[0], abs=1e-12)
        assert gap >= 0.89 * best  # the search's largest: at most the distance


def _parts(body) -> dict:
    if isinstance(body, physics.Hull):
        return {"points": HULL_POINTS, "mass": 1.0}
    if isinstance(body, physics.Sphere):
        return {"radius": body.radius, "mass": 1.0}
    key = "size" if isinstance(body, physics.Block) else "semi_axes"
    return {key: getattr(body, key), "mass": 1.0}


def _dims(body):
    if isinstance(body, physics.Hull):
        return body.dimensions
    if isinstance(body, physics.Sphere):
        return (body.radius,) * 3
    return 0.5 * np.array(body.size) if isinstance(body, physics.Block) else body.semi_axes


@pytest.mark.parametrize("shape", ["block", "ellipsoid"])
def test_no_wall_is_reached_within_the_safe_time(shape):
    """Against the closed form of free motion, at 400 moments; mostly it is more than the gap over a point's speed."""
    rng, half = np.random.default_rng(6), np.array([1.0, 0.05, 0.05])
    body = physics.Block(tuple(2 * half), 1.0) if shape == "block" else physics.Ellipsoid(tuple(half), 1.0)
    moved = type(body)(**{**_parts(body), "pos": (0.0, 5.0, 0.0)})
    effects = [physics.Gravity((0, -9.81, 0)), physics.Contact(0.0)]
    scene = physics.Scene([moved], [physics.HalfSpace((0, 1, 0), 0.0)], effects)
    world, (along, across, _) = physics.World(scene), np.diag(body.inertia)
    normal, gravity, tried, shares = np.array([0, 1.0, 0]), np.array([0, -9.81, 0.0]), 0, []
    while tried < 40:
        q = rng.standard_normal((1, 4))
        q /= np.linalg.norm(q)
        angvel, linvel = 30 * rng.standard_normal((1, 3)), 3 * rng.standard_normal((1, 3))
        pos = np.array([[0.0, rng.uniform(0.1, 1.2), 0.0]])
        top = truth.Top(along, across, pos, q, linvel, angvel, gravity)

        def gap(t, top=top):
            x, R = top.at(0, t)
            if shape == "block":
                return truth.apart_from_wall(x, R, truth.box_corners(2 * half), normal, 0.0)
            return truth.ellipsoid_from_wall(x, R, half, normal, 0.0)

        if not gap(np.zeros(1))[0] > 1e-3:
            continue
        tried += 1
        world.set_state(pos, q, linvel, angvel)
        world.step(dt=1e-12)  # writes the body's record
        L = tuple(world.state[0, 10:13])
        horizon = 0.1
        spin, found, t = called(
            safe_time_of, (tuple(pos[0]), tuple(q[0]), tuple(linvel[0]), L), horizon, world.scratch[0]
        )
        assert spin >= np.linalg.norm(angvel) * (1 - 1e-12)
        assert found == pytest.approx(gap(np.zeros(1))[0], abs=1e-12)
        assert (gap(np.linspace(0, t, 400)) > 0).all()
        shares.append(t / min(horizon, found / (np.linalg.norm(linvel) + np.linalg.norm(angvel))))
    assert min(shares) > 0.3
    assert np.median(shares) > 1.0
