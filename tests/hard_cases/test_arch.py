"""An arch: the thickness at which it stands, by linear program and closed form; and one on its way down."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize_scalar, root_scalar

import physics
from rigid_env.hard_cases.cases.arch import NEAR, arch, joints, least_thickness, missing_force


def continuous_limit() -> float:
    """Milankovitch's thickness by mean radius (1 m) of a semicircular arch of infinitely many stones, radial joints.

    By symmetry the crown carries a horizontal thrust H only; at the limit it acts at the outer edge there. Per unit of
    weight and width the part from the crown to the angle b weighs W = t b, and its moment about the middle is
    t (1 + t²/12) (1 - cos b). It must not turn about its inner edge at any b, which asks for at least

        H_in = (W (1 - t/2) sin b - W x) / ((1 + t/2) - (1 - t/2) cos b),

    nor half the arch outwards about the outer edge of its foot, which allows at most H_out = W - W x / (1 + t/2).
    """

    def asked(b, t):
        moment = t * (1 + t**2 / 12) * (1 - np.cos(b))
        return (t * b * (1 - t / 2) * np.sin(b) - moment) / ((1 + t / 2) - (1 - t / 2) * np.cos(b))

    def spare(t):
        most = -minimize_scalar(lambda b: -asked(b, t), bounds=(0.1, np.pi / 2), method="bounded").fun
        return t * np.pi / 2 - t * (1 + t**2 / 12) / (1 + t / 2) - most

    return root_scalar(spare, bracket=(0.05, 0.2)).root


def test_the_limit_of_many_stones_is_milankovitchs():
    limit = continuous_limit()
    assert limit == pytest.approx(0.1075, abs=5e-5)
    # The hinge in the haunch is at one of the joints, π/n apart: at most π/(2 n) off the best place, where the required
    # thrust is largest. That is an error of second order, C/n²; so is the area of a stone whose arcs are chords.
    # C is read off at 51 stones and must hold, twice over, at 101 and 201.
    C = (limit - least_thickness(51)) * 51**2
    assert C > 0
    for stones in (101, 201):
        assert 0 < limit - least_thickness(stones) <= 2 * C / stones**2 + 1e-7


@pytest.mark.parametrize(("stones", "limit"), [(7, 0.0957), (15, 0.1061), (51, 0.1074)])
def test_the_limits_that_the_case_names(stones, limit):
    assert least_thickness(stones) == pytest.approx(limit, abs=5e-5)


def test_what_is_missing_grows_from_nothing_at_the_limit():
    limit = least_thickness(15)
    missing = [missing_force(15, share * limit) for share in (1.01, 0.99, 0.98, 0.96)]
    assert missing[0] <= 1e-9
    assert 0 < missing[1] < missing[2] < missing[3]
    assert missing[3] == pytest.approx(4 * missing[1], rel=0.05)  # a straight line near there


def test_the_stones_fill_the_arch_and_touch_the_floor():
    scene = arch(9, 0.2)
    ends = joints(9, 0.2)
    # A polygon's ring: 9 trapezes between radii 0.9 and 1.1, of area sin(π/9)/2 (1.1² - 0.9²) each.
    volume = sum(body.polyhedron.volume for body in scene.bodies)
    assert volume == pytest.approx(9 * np.sin(np.pi / 9) / 2 * (1.1**2 - 0.9**2) * 0.25, rel=1e-13)
    for body, here, there in zip(scene.bodies, ends, ends[1:]):
        corners = np.array(body.polyhedron.vertices) + body.pos
        expected = np.array([*here, *there])
        assert all(np.abs(corners[:, :2] - corner).max(axis=1).min() < 1e-15 for corner in expected)
        assert corners[:, 1].min() >= -1e-16


@pytest.mark.exhaustive
def test_parts_of_a_substep_are_solved_as_finely_as_it_and_no_finer():
    """Stones that turn on their edges, in parts of 1/64 of a substep and less.

    Relative to what gravity gives in such a part, 1e-10 is 1e-13 m/s, which rounding of the forces of an arch does not
    leave: 44 % of the problems were not solved to it, and each of them took all iterations there are.
    """
    world = physics.World(arch(7, (1 - NEAR) * least_thickness(7)), dt=0.01, accuracy="precise")
    solves = unsolved = 0
    for _ in range(50):
        report = world.step()
        solves += report.solves[0]
        unsolved += report.unconverged[0]
    assert report.fallbacks[0] == 0
    assert unsolved <= 0.15 * solves


@pytest.mark.exhaustive
def test_a_high_arch_at_its_limit_stays_solved_at_precise():
    """An arch that stands is not swept on where goals are next to rounding: every solve ends within its tolerance."""
    world = physics.World(arch(51, (1 + NEAR) * least_thickness(51)), dt=0.01, accuracy="precise")
    for _ in range(20):  # the first second in which one did not was the fourteenth
        report = world.step(steps=100)
        assert report.unconverged[0] == 0
