"""Pushes and gusts: their effect on a free body, their times, and that they follow the seed."""

from __future__ import annotations

import numpy as np
import pytest

import physics
from rigid_env.tasks import Gust, Push, Uniform
from rigid_env.tasks.disturbances import direction, quiet_steps
from rigid_env.tasks.worlds import Worlds
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
    assert set(lengths[:-1]) == {10}  # control steps in 0.25 s


def test_directions_are_unit_vectors_of_all_directions_alike():
    shares = np.random.default_rng(1).random((20_000, 2))
    for axes in ("x", "xz", "xyz"):
        vectors = np.array([direction(share, axes) for share in shares])
        np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), 1.0, rtol=1e-12)
        # Means of n unit vectors deviate by less than 1 / sqrt(n) = 0.007; five deviations.
        np.testing.assert_allclose(vectors.mean(axis=0), 0.0, atol=0.036)
        assert not vectors[:, ["xyz".index(a) for a in "xyz" if a not in axes]].any()


def test_waiting_times_are_nearly_exponential():
    task = disturbed(Push(0, every=2.0), worlds=4000)
    first = task.disturbed.next[0] * task.control_dt
    # Whole steps of 0.025 s, without memory: mean 2, deviation 2 within 1%; five standard errors of the mean.
    assert first.mean() == pytest.approx(2.0, abs=5 * 2.0 / np.sqrt(4000))
    assert (first < 2.0).mean() == pytest.approx(1 - (80 / 81) ** 80, abs=5 * 0.5 / np.sqrt(4000))


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


PULLING = np.array([[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]])
LIMITED = physics.Actuator(limit_force=20.0), physics.Actuator(limit_force=20.0, lag=0.1), physics.Actuator(delay=0.012)


@pytest.mark.parametrize("actuator", LIMITED)
def test_no_actuator_stands_between_a_disturbance_and_its_body(actuator):
    """A push of 0.7 m/s has 4.2 N s, 840 N over a physics step; without gravity a gust of 1 has the weight, 58.86 N."""
    for kind, change in (
        (Push(speed=0.7, every=1e-9, axes="x"), 0.7),
        (Gust(force=1.0, every=1e-9, axes="x"), 9.81 / 40),
    ):
        task = disturbed(kind, effects=[actuator])
        task.step(STILL)
        assert abs(task.world.linvel[0, 0, 0]) == pytest.approx(change, rel=1e-12)
        assert task.world.actuation.past is None


@pytest.mark.parametrize("actuator", [None, *LIMITED])
@pytest.mark.parametrize("frame_skip", [1, 5])
def test_a_command_acts_beside_a_disturbance_as_it_does_alone(actuator, frame_skip):
    """Momenta add up: 6 kg, no gravity, steps of 5 ms, so that a rounding is 1e-15 m/s."""
    settings = {"effects": [actuator] if actuator else [], "frame_skip": frame_skip}
    kinds = Push(speed=0.7, every=0.2, axes="z"), Gust(force=0.3, lasts=0.1, every=0.1, axes="y")
    alone, both, still = (disturbed(*each, seed=3, **settings) for each in ((), kinds, kinds))
    for _ in range(160 // frame_skip):
        alone.step(PULLING)
        both.step(PULLING)
        still.step(STILL)
    assert np.abs(still.world.linvel[0, 0, 1:]).min() > 0.1
    assert alone.world.linvel[0, 0, 0] > 0.1
    np.testing.assert_allclose(both.world.linvel, alone.world.linvel + still.world.linvel, rtol=0, atol=1e-12)


def test_the_wrench_of_an_action_has_no_disturbance_in_it():
    """A penalty on effort does not punish the wind."""
    task = disturbed(Push(speed=0.7, every=1e-9, axes="z"), Gust(force=0.3, every=1e-9, axes="y"))
    alone = disturbed()
    for each in (task, alone):
        each.step(PULLING)
    np.testing.assert_array_equal(Worlds(task).wrench, Worlds(alone).wrench)
    # in pictures there are both
    assert abs(task.load[0, 0, 1]) == pytest.approx(0.3 * 6.0 * 9.81, rel=1e-12)
    np.testing.assert_array_equal(task.load[0, 0, [0, 2]], task.wrench[0, 0, [0, 2]])
    np.testing.assert_array_equal(alone.load, alone.wrench)


@pytest.mark.parametrize(("lasts", "steps"), [(0.25, 10), (0.3, 12), (0.26, 10), (0.27, 11), (1e-6, 1), (0.0, 1)])
def test_a_gust_lasts_the_nearest_number_of_control_steps(lasts, steps):
    """Also late in an episode, where sums of times would round: a control step takes 0.025 s."""
    task = disturbed(Gust(lasts=lasts, every=0.2), worlds=5, seed=1, frame_skip=1, dt=0.025)
    blowing = []
    for _ in range(400):
        task.step(np.zeros((5, 6)))
        blowing.append(task.load.any(axis=(1, 2)))
    lengths = [runs for world in np.array(blowing).T for runs in lengths_of(world)]
    assert len(lengths) > 50
    # gusts that follow each other without a quiet step in between make one run of a multiple
    assert {length % steps for length in lengths} == {0}
    assert lengths.count(steps) > 0.5 * len(lengths)


def lengths_of(blowing: np.ndarray) -> np.ndarray:
    """Lengths of the runs that have ended."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], blowing.astype(int)))))
    return np.diff(edges)[::2]


@pytest.mark.parametrize("mean", [0.0, 0.3, 5.0, 80.0, 1e30])
def test_quiet_steps_have_their_mean_and_forget_how_long_they_took(mean):
    shares = (np.arange(20_000) + 0.5) / 20_000
    steps = np.array([quiet_steps(mean, share) for share in shares], dtype=float)
    if mean > 1e20:
        assert (steps > 2**40).all()
        return
    # the largest of 20,000 even shares leaves out a tail of (1 + ln 40,000) / 40,000 of the mean
    assert steps.mean() == pytest.approx(mean, rel=1e-3, abs=1e-3)
    if mean:
        assert (steps > 0).mean() == pytest.approx(mean / (1.0 + mean), abs=1e-4)
        assert (steps > 1).sum() / (steps > 0).sum() == pytest.approx(mean / (1.0 + mean), abs=1e-3)
