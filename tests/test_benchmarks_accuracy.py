"""Error against truth: the truths themselves, the front, and what `balanced` reaches at 10 ms."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from benchmarks import accuracy, truths
from benchmarks.accuracy import Point, goals_met, mark_front

CASES = {case.key: case for case in truths.CASES}
G = truths.G


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
REACHED = {
    "tumble": 1e-10,
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
    assert case.error(accuracy.watch(case, "balanced", 0.01)) <= REACHED[key]


@pytest.mark.parametrize("key", ["slide", "sphere"])
def test_the_error_falls_with_the_step(key):
    """Second order between events, first order in where friction changes from slip to stick: at least by 4 in 5 ms."""
    case = CASES[key]
    coarse, fine = (case.error(accuracy.watch(case, "balanced", dt)) for dt in (0.02, 0.005))
    assert fine <= 0.25 * coarse * 1.1


def test_front_holds_what_nothing_beats():
    points = [Point("c", "fast", 0.01, error, us) for error, us in ((1.0, 1.0), (0.5, 2.0), (0.7, 3.0), (0.1, 4.0))]
    marked = mark_front(points[::-1])
    assert [p.us for p in marked] == [1.0, 2.0, 3.0, 4.0]
    assert [p.is_front for p in marked] == [True, True, False, True]


def test_a_goal_needs_one_setting_that_meets_both():
    case = replace(CASES["slide"], key="c", goals=((0.6, 1.5), (0.6, 2.5)))
    points = [Point("c", "fast", 0.01, 1.0, 1.0), Point("c", "fast", 0.005, 0.5, 2.0)]
    (_, _, missed), (_, _, met) = goals_met(case, points)
    assert missed is None
    assert met == points[1]


def test_the_program_writes_what_it_measured(tmp_path):
    import typer

    app = typer.Typer()
    app.command()(accuracy.main)
    file = tmp_path / "accuracy.json"
    result = CliRunner().invoke(app, ["vertex", "--quick", "--json", str(file)])
    assert result.exit_code == 0, result.output
    rows = json.loads(file.read_text())["rows"]
    assert {row["case"] for row in rows} == {"vertex"}
    assert len(rows) == 2 * len(accuracy.LADDER)
    assert all(row["us"] > 0 and row["error"] >= 0 for row in rows)
    assert CliRunner().invoke(app, ["nothing"]).exit_code != 0
