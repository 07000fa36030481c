"""The scenes with a known outcome: the truths themselves, and what `balanced` reaches at 10 ms."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import physics
from physics.work_precision.contender import EngineContender
from rigid_env.lab.measure import truths

CASES = {case.key: case for case in truths.CASES}
G = truths.G


def error_at(case, dt):
    """Error of a case at `balanced`."""
    seen = EngineContender(case.scene(), physics.PRESETS["balanced"], dt).watch(round(case.duration / dt))
    return case.truth().errors(seen)["error"]


def path(t, **columns):
    """A `truths.Path`; columns that are not given are zero."""
    n = len(t)
    blank = {"pos": np.zeros((n, 3)), "quat": np.zeros((n, 4)), "linvel": np.zeros((n, 3)), "angvel": np.zeros((n, 3))}
    return truths.Path(np.asarray(t), **{**blank, **columns})


def bouncing(restitution, dt=0.01, duration=9.4, shift=0.0):
    """The face-down drop in closed form, each bounce `shift` seconds late."""
    t = dt * np.arange(round(duration / dt) + 1)
    pos, linvel = np.zeros((len(t), 3)), np.zeros((len(t), 3))
    for i, now in enumerate(t):
        start, speed = math.sqrt(2.0 / G) + shift, math.sqrt(2.0 * G)
        if now <= start:
            pos[i, 1], linvel[i, 1] = 1.0 - 0.5 * G * now**2, -G * now
        else:
            speed *= restitution
            while speed > 1e-6 and now > start + 2 * speed / G:
                start, speed = start + 2 * speed / G, speed * restitution
            if speed > 1e-6:
                s = now - start
                pos[i, 1], linvel[i, 1] = speed * s - 0.5 * G * s * s, speed - G * s
    pos[:, 1] += 1.5
    return path(t, pos=pos, linvel=linvel)


def test_the_elastic_drop_in_closed_form_has_no_error():
    # A dozen roundings of numbers up to 10.
    assert truths.elastic_error(bouncing(1.0)) <= 1e-13
    assert truths.elastic_error(bouncing(1.0, shift=1e-3)) == pytest.approx(1e-3, rel=1e-9)
    assert truths.elastic_error(bouncing(1.0, duration=5.0)) == math.inf


def test_the_damped_drop_in_closed_form_is_right_to_a_sample():
    """Rest is seen at the sample after it: up to 10 ms late; the first apex is exact."""
    assert truths.damped_error(bouncing(0.5, duration=2.0)) <= 0.01
    assert truths.damped_error(bouncing(0.9, duration=2.0)) == math.inf


def test_a_wrong_first_apex_is_an_error():
    seen = bouncing(0.5, duration=2.0, dt=1e-4)
    high = replace(seen, linvel=seen.linvel * 1.01)
    assert truths.damped_error(high) > 0.002


@pytest.mark.parametrize("spin", [(0.1, 5.0, 0.1), (1.0, 100.0, 1.0)])
def test_the_true_rotation_knows_its_error(spin):
    """Two tolerances agree a hundred times better than the goals ask for, and the attitude is a unit quaternion."""
    duration = {5.0: 20.0, 100.0: 5.0}[spin[1]]
    goal = {5.0: 1e-10, 100.0: 1e-8}[spin[1]]
    assert truths.truth_error(spin, duration) <= 2 * goal
    assert np.linalg.norm(truths.free_attitude(spin, duration)) == pytest.approx(1.0, abs=1e-15)


def test_small_angles_are_measured_accurately():
    turned = (math.cos(5e-13), math.sin(5e-13), 0.0, 0.0)
    assert truths.angle_between((1, 0, 0, 0), turned) == pytest.approx(1e-12, rel=1e-12)
    assert truths.angle_between((1, 0, 0, 0), (-1, 0, 0, 0)) == 0.0
    assert truths.angle_between((1, 0, 0, 0), (0, 1, 0, 0)) == pytest.approx(math.pi, rel=1e-12)


# At 10 ms and `balanced`: the errors that the project set out to reach.
# Where none is listed the goal is not reached yet (`damped`, `sphere`).
# `tumble` is three times what rounding leaves of 2,000 attitudes in the mean, 1e-10 rad (`test_rotation` says why).
REACHED = {
    "tumble": 3e-10,
    "high_spin": 1e-8,
    "elastic": 1e-9,
    "slide": 1e-4,
    "creep": 1e-12,
    "slip": 1e-6,
    "vertex": 1e-12,
}


@pytest.mark.parametrize("key", REACHED)
def test_balanced_reaches_the_goal_at_10_ms(key):
    case = CASES[key]
    assert error_at(case, 0.01) <= REACHED[key]


@pytest.mark.parametrize("dt", [0.02, 0.05, 0.1])
def test_balanced_reaches_the_goal_for_tumbling_in_fewer_steps(dt):
    assert error_at(CASES["tumble"], dt) <= 1e-10


@pytest.mark.parametrize("key", ["slide", "sphere"])
def test_the_error_falls_with_the_step(key):
    """Second order between events, first order in where friction changes from slip to stick: at least by 4 in 5 ms."""
    case = CASES[key]
    coarse, fine = (error_at(case, dt) for dt in (0.02, 0.005))
    assert fine <= 0.25 * coarse * 1.1


def test_a_soft_contact_rests_when_it_is_as_still_as_it_gets():
    """A speed of 1 mm/s that never ends: at rest up to 4 v/g of twice that earlier, and a sample later."""
    seen = bouncing(0.5, duration=2.0, dt=1e-3)
    at_rest = np.flatnonzero(seen.linvel[:, 1] == 0.0)[1:]
    seen.linvel[at_rest, 1] = 1e-3 * (-1.0) ** at_rest
    rest = 3.0 * math.sqrt(2.0 / G)
    assert rest - 8e-3 / G <= truths.time_of_rest(seen) <= rest + 1e-3
    seen.linvel[at_rest, 1] *= 100.0
    assert truths.time_of_rest(seen) == math.inf


def test_a_body_that_sank_has_an_error_and_no_exception():
    """The apex after a bounce under the floor is below it: a peer may do that."""
    t = np.array([0.0, 0.1, 0.2])
    pos, linvel = np.zeros((3, 3)), np.zeros((3, 3))
    linvel[:, 1] = (-1.0, -1.0, 0.1)
    assert truths.damped_error(path(t, pos=pos, linvel=linvel)) == math.inf


def test_truths_state_what_they_know():
    for case in truths.CASES:
        truth = case.truth()
        assert truth.unit == case.unit
        assert (truth.own_error > 0) == (truth.text != "closed form")
