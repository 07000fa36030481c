"""Pushes and gusts: their effect on a free body, their times, and that they follow the seed."""

from __future__ import annotations

import numpy as np
import pytest

import physics
from rigid_env.tasks import Gust, Push, Uniform
from rigid_env.tasks.disturbances import direction
from tests.tasks.conftest import Free, started

pytestmark = pytest.mark.interpreted

STILL = np.zeros((1, 6))


def disturbed(*kinds, worlds: int = 1, seed: int = 0, **settings):
    """A floating block with disturbances."""

    class Disturbed(Free):
        disturbances = kinds

    return started(Disturbed(worlds, **settings), seed)


def test_a_push_changes_the_speed_by_what_it_says_at_once():
    task = disturbed(Push(0, speed=0.75, every=0.2, axes="xyz"))
    velocity = task.world.linvel[0, 0].copy()
    pushes = 0
    for _ in range(200):
        task.step(STILL)
        change = task.world.linvel[0, 0] - velocity
        velocity += change
        if np.linalg.norm(change) > 1e-12:  # more than a rounding
            pushes += 1
            # Force speed m / dt over a step of dt: a few roundings.
            assert np.linalg.norm(change) == pytest.approx(0.75, rel=1e-12)
    # 5 s with a push each 0.2 s: 25 in the mean, at most one in each control step of 0.025 s; 6 deviations of 5.
    assert 5 < pushes < 55


def test_a_gust_blows_as_hard_and_as_long_as_it_says():
    task = disturbed(Gust(0, force=0.4, lasts=0.25, every=1.0, axes="x"), seed=2)
    blowing, last = [], 0.0
    for _ in range(400):
        task.step(STILL)
        speed = task.world.linvel[0, 0, 0]
        blowing.append(abs(speed - last) > 0.0)
        if blowing[-1]:  # weight per mass is 9.81 m/s² without gravity; a control step takes 0.025 s
            assert abs(speed - last) == pytest.approx(0.4 * 9.81 * 0.025, rel=1e-9)
        last = speed
    edges = np.flatnonzero(np.diff(np.array([0, *blowing, 0])))
    lengths = edges[1::2] - edges[::2]
    assert len(lengths) >= 2
    # 0.25 s are ten control steps; it begins with one, so that it acts in ten, or eleven by rounding of the times.
    assert set(lengths[:-1]) <= {10, 11}


def test_directions_are_unit_vectors_of_all_directions_alike():
    shares = np.random.default_rng(1).random((20_000, 2))
    for axes in ("x", "xz", "xyz"):
        vectors = np.array([direction(share, axes) for share in shares])
        np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), 1.0, rtol=1e-12)
        # Means of n unit vectors deviate by less than 1 / sqrt(n) = 0.007; five deviations.
        np.testing.assert_allclose(vectors.mean(axis=0), 0.0, atol=0.036)
        assert not vectors[:, ["xyz".index(a) for a in "xyz" if a not in axes]].any()


def test_waiting_times_are_exponential():
    task = disturbed(Push(0, every=2.0), worlds=4000)
    first = task.disturbed.next[0]
    # Mean and deviation of the exponential law are both 2; five standard errors of the mean.
    assert first.mean() == pytest.approx(2.0, abs=5 * 2.0 / np.sqrt(4000))
    assert (first < 2.0).mean() == pytest.approx(1 - np.exp(-1), abs=5 * 0.5 / np.sqrt(4000))


def test_disturbances_follow_the_seed_and_not_the_place_in_the_batch():
    kinds = Push(0, Uniform(0.1, 1.0), 0.3), Gust(0, every=0.3)
    batch, alone = disturbed(*kinds, worlds=3, seed=5), disturbed(*kinds, seed=6)
    for _ in range(80):
        batch.step(np.zeros((3, 6)))
        alone.step(STILL)
    np.testing.assert_array_equal(batch.world.state[1], alone.world.state[0])
    assert not np.array_equal(batch.world.state[0], batch.world.state[1])


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: disturbed(Push(1)), ("body", "1", "0 to 0")),
        (lambda: disturbed("storm"), ("disturbances", "'storm'", "Push and Gust")),
        (lambda: Push(every=0.0), ("every", "0")),
        (lambda: Gust(axes="w"), ("axes", "'w'")),
        (lambda: Gust(lasts="long"), ("lasts", "'long'")),
    ],
)
def test_refusals_name_field_value_and_what_is_allowed(make, words):
    with pytest.raises(ValueError, match="allowed") as error:
        make()
    assert all(word in str(error.value) for word in words), str(error.value)


def test_a_push_under_gravity_is_told_by_the_status():
    task = disturbed(Push(0, speed=0.5, every=0.1), frame_skip=1)
    task.step(STILL)
    assert task.status[0] == physics.Status.OK
