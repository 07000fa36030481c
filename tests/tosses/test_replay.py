"""Replays begin where the measurement does, and with nothing else of it."""

from dataclasses import replace

import numpy as np
import pytest

from rigid_env.lab.tosses import data
from rigid_env.lab.tosses.flight import disturb, first_flight, measure_flight, rest_scale
from rigid_env.lab.tosses.metric import compare
from rigid_env.lab.tosses.replay import BATCH, Cube, Recording, Starts, attitude, batches, replay, starts, sunken


def test_own_tosses_are_replayed_to_rounding(made, true_cube):
    poses, us = replay(made.lengths, starts(made, true_cube, Recording()), true_cube)
    errors = compare(made.states, poses, made.offsets)
    # the body-frame angular velocity of the file is rounded once more; bounces magnify it
    assert np.median(errors.position) < 1e-12
    assert us > 0.0


def test_only_the_first_frame_counts(made, true_cube):
    changed = data.Tosses(made.states.copy(), made.offsets, made.numbers)
    others = np.setdiff1d(np.arange(len(made.states)), made.offsets[:-1])
    changed.states[others] = made.states[others[::-1]]
    a, b = (replay(t.lengths, starts(t, true_cube, Recording()), true_cube)[0] for t in (made, changed))
    np.testing.assert_array_equal(a, b)


def test_tosses_do_not_depend_on_their_batch(made, true_cube):
    begin = starts(made, true_cube, Recording())
    lengths = made.lengths - np.arange(len(made))
    together, _ = replay(lengths, begin, true_cube)
    offsets = np.concatenate(([0], np.cumsum(lengths)))
    for i in (0, 7):
        alone, _ = replay(lengths[[i]], Starts(*(v[[i]] for v in vars(begin).values())), true_cube)
        np.testing.assert_array_equal(alone, together[offsets[i] : offsets[i + 1]])


def test_batches_hold_every_toss_once():
    groups = list(batches(np.arange(2, 2 + 3 * BATCH - 1)))
    assert len(groups) == 3
    assert sorted(np.concatenate(groups)) == list(range(3 * BATCH - 1))


def test_flight_follows_the_parabola_that_the_recording_means(made):
    cube = Cube(gravity=9.6)
    begin = starts(made, cube, Recording(length_scale=1.02, is_midframe=True))
    first = made.first
    np.testing.assert_allclose(begin.pos, 1.02 * first[:, data.POS], rtol=1e-15)
    expected = 1.02 * first[:, data.LINVEL] - [0.0, 0.0, 0.5 * 9.6 / 148.0]
    np.testing.assert_allclose(begin.linvel, expected, rtol=0, atol=1e-15)


def test_a_cube_that_starts_under_the_table_is_lifted_onto_it():
    cube = Cube(table=0.001)
    quat = np.array([[1.0, 0.0, 0.0, 0.0]])
    begin = Starts(np.array([[0.0, 0.0, data.HALF_WIDTH - 0.005]]), quat, np.zeros((1, 3)), np.zeros((1, 3)))
    np.testing.assert_allclose(sunken(begin, cube), [0.006], rtol=1e-12)
    poses, _ = replay(np.array([5]), begin, cube)
    np.testing.assert_allclose(poses[:, 2], data.HALF_WIDTH + 0.001, rtol=0, atol=1e-6)


def test_flight_measures_gravity_and_the_centre_of_mass(made):
    flights = data.join([first_flight(toss) for toss in made], made.numbers)  # the shift changes what is near the table
    shifted = data.Tosses(flights.states.copy(), flights.offsets, flights.numbers)
    offset = np.array([0.001, -0.002, 0.006])
    R = attitude(flights.states[:, data.QUAT])
    spin = R.apply(flights.states[:, data.ANGVEL])
    shifted.states[:, data.POS] -= R.apply(offset)
    shifted.states[:, data.LINVEL] -= np.cross(spin, R.apply(offset))
    for tosses, expected in ((flights, np.zeros(3)), (shifted, offset)):
        flight = measure_flight(tosses)
        assert flight.gravity == pytest.approx(9.81, rel=1e-9)
        np.testing.assert_allclose(flight.center_of_mass, expected, rtol=0, atol=1e-10)
        # a spin is the same over the whole flight, and the starts are exact
        assert max(*flight.linvel_noise, *flight.angvel_noise) < 1e-9


def test_rest_scale_is_that_of_the_lengths(made):
    scaled = data.Tosses(Recording(length_scale=0.98).lengths(made.states), made.offsets, made.numbers)
    assert rest_scale(scaled) / rest_scale(made) == pytest.approx(1.0 / 0.98, rel=1e-12)


def test_disturbed_starts_have_the_noise_and_keep_the_pose(made, rng, true_cube):
    flight = replace(measure_flight(made), linvel_noise=(0.0, 0.0, 0.1), angvel_noise=(2.0, 0.0, 0.0))
    begin = starts(made, true_cube, Recording())
    other = disturb(begin, flight, rng)
    np.testing.assert_array_equal(other.pos, begin.pos)
    np.testing.assert_array_equal(other.linvel[:, :2], begin.linvel[:, :2])
    # standard deviation of 24 samples: to 15 %, three times that allowed
    assert (other.angvel - begin.angvel)[:, 0].std() == pytest.approx(2.0, rel=0.45)


def test_a_heavy_side_is_where_the_flights_show_it():
    from tests.tosses.conftest import make_tosses

    cube = Cube(heavy_x=0.001, heavy_y=-0.002, heavy_z=0.006)
    made = make_tosses(6, cube)
    flight = measure_flight(made)
    assert flight.gravity == pytest.approx(9.81, rel=1e-9)
    np.testing.assert_allclose(flight.center_of_mass, cube.center_of_mass, rtol=0, atol=1e-10)
