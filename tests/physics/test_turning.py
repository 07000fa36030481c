"""Bodies that turn by 0.3 to 3 rad a step meet what they meet when nobody cuts time (`tests.reference.turning`)."""

from __future__ import annotations

import numpy as np
import pytest

import physics
from benchmarks import turning
from tests.reference import turning as truth
from tests.tiers.sweep import sweep

FEW = {"ball": 40, "cube": 30, "hull": 30, "rod": 15, "wall": 40, "ellipsoid": 30, "ellipsoid-wall": 40}


@pytest.fixture(scope="module", params=sweep(turning.THINGS, set(turning.THINGS) - {"hull", "rod", "ellipsoid"}))
def drawn(request):
    return turning.draw(request.param, FEW[request.param], seed=1)


@pytest.mark.parametrize("accuracy", sweep(turning.PRESETS, turning.PRESETS[1:2]))
def test_what_turns_misses_nothing_and_invents_nothing(drawn, accuracy):
    found = turning.run(drawn, accuracy)
    assert found["finite"]
    assert 0 < found["meet"] < found["placements"]
    assert (found["missed"], found["invented"]) == (0, 0), found["which"]


def test_the_truth_knows_a_disc():
    """A rod that turns about its middle in a plane comes as near to a ball in it as its end does, or goes through."""
    for far, least in ((1.05, -0.05 - 0.01), (1.2, 0.2 - 0.1 - 5e-5)):
        one, rest = np.array([[1.0, 0, 0, 0]]), np.zeros((1, 3))
        top = truth.Top(1.0, 2.0, rest, one, rest, np.array([[0.0, 0.0, 100.0]]), np.zeros(3))
        ball = far * np.array([0.0, 1.0, 0.0])
        half = np.array([1, 0.01, 0.01])
        found, _ = truth.least(
            lambda t, ball=ball, top=top, half=half: truth.apart_from_ball(*top.at(0, t), half, ball, 0.1), 0.03
        )
        if least > 0:
            assert found == pytest.approx(far - 0.1 - np.hypot(1, 0.01), abs=1e-5)
        else:
            assert found < -0.04


def test_separating_axes_agree_with_a_ball_about_a_point():
    """A tiny cube is a ball to the truth: the two distances differ by its half diagonal at most."""
    rng = np.random.default_rng(4)
    half, tiny = np.array([1, 0.02, 0.05]), 1e-6
    rod, cube = truth.polyhedron(truth.box_corners(2 * half)), truth.polyhedron(truth.box_corners([2 * tiny] * 3))
    R = truth.Rotation.random(20, random_state=1).as_matrix()
    x, eye = np.einsum("tij,tj->ti", R, half * rng.uniform(-2, 2, (20, 3))), np.broadcast_to(np.eye(3), (20, 3, 3))
    x[::2] *= 0.4
    other = truth.apart(x, R, rod, np.zeros((20, 3)), eye, cube)
    ball = truth.apart_from_ball(x, R, half, np.zeros(3), tiny)
    assert (other[ball > 0] <= ball[ball > 0] + 2 * tiny).all()  # near a corner no axis is as far as the distance
    assert (other[ball > 0] > 0).all()
    assert np.abs(other[ball < 0] - ball[ball < 0]).max() < 2 * tiny


@pytest.mark.interpreted
def test_edges_of_slender_blocks_push_apart():
    """Rods that cross by less than 11 degrees' tilt far from their middles, whose middles are on other sides of a face.

    The product of their edges is the normal; the face that it nearly is looks to the far side, and must not be taken.
    """
    size, count = (2.0, 0.02, 0.02), 200
    scene = physics.Scene(
        [physics.Block(size, 1.0), physics.Block(size, 1.0, pos=(0, 1, 0))], [], [physics.Contact(0.0)]
    )
    world = physics.World(scene, worlds=count, dt=1e-6)
    rng = np.random.default_rng(5)
    pos, quat, linvel = np.zeros((count, 2, 3)), np.zeros((count, 2, 4)), np.zeros((count, 2, 3))
    rod, kept = truth.polyhedron(truth.box_corners(size)), 0
    while kept < count:
        q = rng.standard_normal((2, 4))
        q /= np.linalg.norm(q, axis=1)[:, None]
        R, S = (truth.Rotation.from_quat(p[[1, 2, 3, 0]]).as_matrix() for p in q)
        n = np.cross(R[:, 0], S[:, 0])
        n /= np.linalg.norm(n)
        s, t = rng.uniform(-0.95, 0.95, 2)
        up = 0.01 * (np.abs(n @ R[:, 1:]).sum() + np.abs(n @ S[:, 1:]).sum())  # an edge of each touches there
        x = (up - 1e-7) * n + t * S[:, 0] - s * R[:, 0]
        if not -2e-7 < truth.apart(x[None], R[None], rod, np.zeros((1, 3)), S[None], rod)[0] < 0:
            continue
        pos[kept, 0], quat[kept], linvel[kept, 0] = x, q, -10 * n
        kept += 1
    world.set_state(pos, quat, linvel, np.zeros_like(pos))
    world.step()
    assert (np.abs(world.linvel - linvel).max(axis=(1, 2)) > 1e-3).all()
