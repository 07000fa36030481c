"""The course notes on one page against closed forms; `test_textbook_kernels.py` holds the kernels against that page."""

from __future__ import annotations

import ast
import math
import re
import sys
from pathlib import Path

import numpy as np
import pytest

from physics import textbook as tb
from tests.reference.rigid_body import RigidState, integrate_rigid_body, orientation_error

ROOT = Path(__file__).parents[2]
PAGE = Path(tb.__file__)
EPS = np.finfo(float).eps
G, MASS, SIZE = 9.81, 6.0, (5.0, 3.0, 2.0)
MOMENTS = np.array([6.5, 14.5, 17.0])
FLOOR = (tb.HalfSpace((0.0, 1.0, 0.0)),)
AIR = np.zeros((0, 3), dtype=int)
FACE_DOWN = (0.0, 1.5, 0.0)


def run(scene, Y, duration, h):
    for _ in range(round(duration / h)):
        Y = tb.step(scene, Y, h)
    return Y


def energy(scene, Y):
    _, _, v, omega = tb.auxiliary(scene, Y)
    return 0.5 * (Y[7:10] @ v + Y[10:] @ omega) - scene.mass * np.dot(scene.gravity, Y[:3])


def on_floor(quat, **motion):
    """State of the block whose lowest vertex touches the floor."""
    q = np.array(quat) / np.linalg.norm(quat)
    scene = tb.Scene(walls=FLOOR)
    lowest = tb.gaps(scene, tb.make_state(scene, np.zeros(3), q)).min()
    return tb.make_state(scene, (0.0, -lowest, 0.0), q, **motion)


def incline(angle, **settings):
    """Scene and state of the block face down on an incline that falls along +x, `angle` in rad."""
    normal = (math.sin(angle), math.cos(angle), 0.0)
    scene = tb.Scene(walls=(tb.HalfSpace(normal),), **settings)
    quat = (math.cos(angle / 2), 0.0, 0.0, -math.sin(angle / 2))
    return scene, tb.make_state(scene, 1.5 * np.array(normal), quat)


def resting(scene, Y):
    """Contacts of a state at rest, and their forces and accelerations."""
    contacts, _ = tb.find_contacts(scene, Y)
    return contacts, *tb.resting_contact(scene, Y, contacts)[1:]


# --- the page -------------------------------------------------------------------------------------------------------


def test_page_is_short_and_imports_numpy_alone():
    text = PAGE.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 250
    imported = [node for node in ast.walk(ast.parse(text)) if isinstance(node, (ast.Import, ast.ImportFrom))]
    names = {alias.name for node in imported if isinstance(node, ast.Import) for alias in node.names}
    names |= {node.module for node in imported if isinstance(node, ast.ImportFrom)}
    assert names - {"numpy"} <= set(sys.stdlib_module_names)


@pytest.mark.parametrize("scheme", ["event_driven", "time_stepping"])
def test_stages_have_the_names_of_the_kernels(scheme):
    """The schemes differ in the last stage alone: the events end at rest, time stepping puts bodies to sleep."""

    def stages(text):
        return re.findall(r"^(\d)\. ((?:\w+ )*\w+)  ", text, re.MULTILINE)

    kernel = (ROOT / "physics" / "kernels" / scheme / "step.py").read_text(encoding="utf-8")
    assert len(stages(tb.__doc__)) == 7
    count = 7 if scheme == "event_driven" else 6
    assert stages(tb.__doc__)[:count] == stages(kernel)[:count]
    for name in re.findall(r"`(\w+)`", tb.__doc__):
        assert callable(getattr(tb, name))


@pytest.mark.parametrize(
    "name", ["find_contacts", "resolve_impacts", "solve_contacts", "lemke", "rk4", "correct_positions"]
)
def test_functions_have_the_names_of_the_kernels(name):
    sources = [path.read_text(encoding="utf-8") for path in (ROOT / "physics" / "kernels").rglob("*.py")]
    assert hasattr(tb, name)
    assert any(f"\ndef {name}(" in source for source in sources)


# --- free flight ----------------------------------------------------------------------------------------------------


def test_centre_flies_on_a_parabola():
    """RK4 is exact on it: what is left is one rounding of x (some 20 m) a step."""
    Y = tb.make_state(tb.Scene(), (0, 1e3, 0), linvel=(3, 20, -1), angvel=(1, 2, 3))
    Y = run(tb.Scene(), Y, 2.0, 0.01)
    np.testing.assert_allclose(Y[:3], [6.0, 1e3 + 40.0 - 2.0 * G, -2.0], rtol=0, atol=200 * 1e3 * EPS)
    np.testing.assert_allclose(Y[7:10] / MASS, [3.0, 20.0 - 2.0 * G, -1.0], rtol=0, atol=200 * 20 * EPS)


def test_free_top_turns_as_dop853_says_to_fourth_order():
    """Near its middle axis at ω = 5/s: a step's error is (ω h)⁵/120, and the unstable axis multiplies it."""
    scene = tb.Scene(walls=(), gravity=(0, 0, 0))
    start = tb.make_state(scene, np.zeros(3), angvel=(0.1, 5.0, 0.1))
    truth = integrate_rigid_body(
        MASS, np.diag(MOMENTS), RigidState(start[:3], start[3:7], start[7:10], start[10:]), 2.0
    )
    ends = [run(scene, start, 2.0, h) for h in (0.01, 0.005)]
    off = [orientation_error(end[3:7], truth.quat) for end in ends]
    assert off[0] < 2.0 * 5.0 * (5.0 * 0.01) ** 4 / 120 * math.exp(2.0 * 5.0 * math.sqrt(8.0 * 2.5 / (6.5 * 17.0)))
    assert 14.0 < off[0] / off[1] < 18.0
    # L̇ = 0: not a bit of L changes.
    np.testing.assert_array_equal(ends[0][10:], start[10:])


def test_inertia_is_that_of_the_exercise():
    _, inverse, _, omega = tb.auxiliary(tb.Scene(), tb.make_state(tb.Scene(), FACE_DOWN, angvel=(1, 2, 3)))
    np.testing.assert_allclose(np.linalg.inv(inverse), np.diag(MOMENTS), rtol=4 * EPS)
    np.testing.assert_allclose(omega, [1, 2, 3], rtol=4 * EPS)


# --- impacts --------------------------------------------------------------------------------------------------------

TURNED = (0.9, 0.3, 0.2, 0.1)


def test_vertex_without_friction_gets_the_impulse_of_the_notes():
    """j = -(1 + e) u_n / (1/M + n·(I⁻¹ (r x n) x r)), in its direction n, with its moment r x j n."""
    scene = tb.Scene(walls=FLOOR, friction=0.0)
    Y = on_floor(TURNED, linvel=(1.0, -4.0, 0.5), angvel=(0.3, -0.7, 0.2))
    ((vertex, _, _),), ((normal_speed, _, _),) = tb.find_contacts(scene, Y)
    arms, inverse, _, _ = tb.auxiliary(scene, Y)
    r, n = arms[vertex], np.array([0.0, 1.0, 0.0])
    j = -(1 + 0.3) * normal_speed / (1 / MASS + n @ np.cross(inverse @ np.cross(r, n), r))
    after = tb.resolve_impacts(scene, Y)
    np.testing.assert_allclose(after[7:10] - Y[7:10], j * n, rtol=0, atol=1e-11)  # residual 1e-12 of some 10 N s
    np.testing.assert_allclose(after[10:] - Y[10:], np.cross(r, j * n), rtol=0, atol=3e-11)
    assert after[:7].tolist() == Y[:7].tolist()


@pytest.mark.parametrize("friction", [0.0, 0.2, 0.5, 5.0])
@pytest.mark.parametrize("quat", [TURNED, (1.0, 0.0, 0.0, 0.2), (1.0, 0.0, 0.0, 0.0)], ids=["vertex", "edge", "face"])
def test_impact_obeys_newton_and_coulomb_and_the_balances(quat, friction):
    """One, two and four vertices at once; the block flies along x and turns about the vertical, so that they slip."""
    scene = tb.Scene(walls=FLOOR, friction=friction)
    Y = on_floor(quat, linvel=(2.0, -4.0, 0.5), angvel=(0.0, 0.7, 0.0))
    contacts, before = tb.find_contacts(scene, Y)
    assert len(contacts) == {TURNED: 1, (1.0, 0.0, 0.0, 0.2): 2, (1.0, 0.0, 0.0, 0.0): 4}[quat]
    J, response, _ = tb.contact_jacobian(scene, Y, contacts)
    problem = before * [1.3, 1.0, 1.0]
    p = tb.solve_contacts(J @ response, problem.ravel(), friction, np.zeros((len(contacts), 2)))
    after = (before.ravel() + J @ response @ p).reshape(-1, 3)
    # Momentum: the state gets these impulses and their moments, nothing else.
    Z = tb.resolve_impacts(scene, Y)
    np.testing.assert_allclose(Z[7:] - Y[7:], J.T @ p, rtol=0, atol=1e-9)
    # Energy: ½ p·(u⁻ + u⁺), and none is gained.
    gain = energy(scene, Z) - energy(scene, Y)
    assert gain == pytest.approx(0.5 * p @ (before + after).ravel(), abs=1e-9)
    assert gain < 0.0
    for (push, *grip), (un, *ut), (un0, *_) in zip(p.reshape(-1, 3), after, before):
        slip = np.linalg.norm(ut)
        assert push >= -1e-10
        assert un + 0.3 * un0 >= -1e-10
        assert push * (un + 0.3 * un0) == pytest.approx(0.0, abs=1e-9)
        assert np.linalg.norm(grip) <= friction * push + 1e-10
        # Maximal dissipation: friction at its limit against the slip after the impact, or no slip.
        np.testing.assert_allclose(slip * np.array(grip), -friction * push * np.array(ut), rtol=0, atol=1e-9)


def test_elastic_impact_of_a_face_reverses_the_fall():
    scene = tb.Scene(walls=FLOOR, restitution=1.0, friction=0.0)
    Y = tb.make_state(scene, FACE_DOWN, linvel=(0, -3, 0))
    Z = tb.resolve_impacts(scene, Y)
    np.testing.assert_allclose(Z[7:], [0, 18, 0, 0, 0, 0], rtol=0, atol=1e-10)


def test_bisection_meets_the_floor_when_the_parabola_does():
    """From 1 m at e = 1: back at the top after 2 √(2 h/g), whatever the step; time is bisected to 1e-12 s."""
    scene = tb.Scene(walls=FLOOR, restitution=1.0, friction=0.0)
    period = 2 * math.sqrt(2.0 / G)
    Y = run(scene, tb.make_state(scene, (0, 2.5, 0)), period, period / 7)
    assert Y[1] == pytest.approx(2.5, abs=1e-10)
    assert Y[8] == pytest.approx(0.0, abs=6 * 1e-10)


# --- resting contact ------------------------------------------------------------------------------------------------


def test_four_coplanar_vertices_carry_the_weight():
    """A is singular; forces are not unique, but each pushes, their sum is M g and their moment is zero."""
    scene = tb.Scene()
    Y = tb.make_state(scene, FACE_DOWN)
    contacts, f, a = resting(scene, Y)
    assert len(contacts) == 4
    assert f[:, 0].min() >= 0.0
    assert f[:, 0].sum() == pytest.approx(MASS * G, abs=1e-10)
    assert np.abs(a).max() < 1e-10
    arms, *_ = tb.auxiliary(scene, Y)
    n_moments = np.cross(arms[contacts[:, 0]], f[:, :1] * [0.0, 1.0, 0.0])
    np.testing.assert_allclose(n_moments.sum(axis=0), 0.0, atol=1e-10)


def test_falling_on_an_edge_presses_with_less_than_the_weight():
    """Without friction N = M g/(1 + M d²/I), d the level distance of the edge from the centre, I along it."""
    angle = 0.3
    scene = tb.Scene(walls=FLOOR, friction=0.0)
    Y = on_floor((math.cos(angle / 2), 0.0, 0.0, math.sin(angle / 2)))
    contacts, f, _ = resting(scene, Y)
    d = 2.5 * math.cos(angle) - 1.5 * math.sin(angle)
    assert len(contacts) == 2
    assert f[:, 0].sum() == pytest.approx(MASS * G / (1 + MASS * d**2 / 17.0), abs=1e-10)


@pytest.mark.parametrize("angle", [0.1, 0.45])
def test_incline_holds_up_to_the_angle_of_friction(angle):
    """tan 0.1 < 0.3 < tan 0.45; beyond, s = ½ g (sin - μ cos) t²: RK4 is exact on it."""
    scene, Y = incline(angle, friction=0.3)
    Z = run(scene, Y, 1.0, 0.05)
    rate = max(0.0, math.sin(angle) - 0.3 * math.cos(angle))
    along = np.array([math.cos(angle), -math.sin(angle), 0.0])
    np.testing.assert_allclose(Z[:3], Y[:3] + 0.5 * G * rate * along, rtol=0, atol=1e-7)  # SLOW for a moment of 1 s
    assert (Z.tolist() == Y.tolist()) == (rate == 0.0)


def test_slide_ends_where_friction_has_used_its_energy_up():
    """v²/(2 μ g) from 3 m/s; bisection ends the slip, and then nothing changes, not by a bit."""
    scene = tb.Scene(walls=FLOOR, friction=0.3)
    Y = run(scene, tb.make_state(scene, FACE_DOWN, linvel=(3, 0, 0)), 1.2, 0.05)
    np.testing.assert_allclose(Y[:3], [9 / (2 * 0.3 * G), 1.5, 0.0], rtol=0, atol=1e-9)
    assert tb.step(scene, Y, 10.0).tolist() == Y.tolist()


# --- complementarity ------------------------------------------------------------------------------------------------


def test_lemke_solves_random_semidefinite_problems(rng):
    """M = J Jᵀ of rank r and q = J v, as of contacts: solvable, singular where r < n."""
    for n, rank in [(1, 1), (4, 3), (8, 6), (8, 3), (12, 6)] * 10:
        J = rng.standard_normal((n, rank))
        M, q = J @ J.T, J @ rng.standard_normal(rank)
        z = tb.lemke(M, q)
        # Rounding of pivots grows with the condition of the basis, some 1e4 here.
        assert np.abs(np.minimum(z, M @ z + q)).max() < 1e-9 * max(1.0, z.max())


def test_lemke_solves_the_problem_of_cottle_pang_and_stone():
    """Example 4.4.2 of a positive definite M: w = 0, z = M⁻¹ (-q) where that is positive."""
    M, q = np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([-5.0, -6.0])
    np.testing.assert_allclose(tb.lemke(M, q), [4 / 3, 7 / 3], rtol=4 * EPS)


def test_problems_without_solution_are_refused():
    with pytest.raises(ArithmeticError, match="found no solution"):
        tb.lemke(np.array([[0.0]]), np.array([-1.0]))
    # A_nn - μ A_nt < 0 and b_n < 0: the more it pushes, the more it digs in (Painlevé).
    A = np.array([[1.0, 0.9, 0.0], [0.9, 1.0, 0.0], [0.0, 0.0, 1.0]])
    with pytest.raises(ArithmeticError, match="Painlevé"):
        tb.solve_contacts(A, np.array([-1.0, 0.0, 0.0]), 2.0, np.array([[1.0, 0.0]]))


# --- the exercise ---------------------------------------------------------------------------------------------------


def test_block_comes_to_rest_on_the_floor_against_a_wall():
    """Thrown at the right wall it loses energy in every step, ends on a face, and then nothing changes."""
    walls = (*FLOOR, tb.HalfSpace((1, 0, 0), -4.0), tb.HalfSpace((-1, 0, 0), -4.0))
    scene = tb.Scene(walls=walls, restitution=0.1)
    Y = tb.make_state(scene, (0, 3, 0), linvel=(7, 1, 0), angvel=(0.2, 0.1, 0.5))
    energies, deepest, met = [energy(scene, Y)], 0.0, set()
    for _ in range(200):
        Y = tb.step(scene, Y, 0.02)
        energies.append(energy(scene, Y))
        found = tb.gaps(scene, Y)
        deepest = min(deepest, found.min())
        met |= set(np.flatnonzero(found.min(axis=0) < 0.1))
    assert met == {0, 2}
    # RK4 keeps the energy of a step to (ω h)⁵/120 of some 300 J, ω below 4/s.
    assert np.diff(energies).max() < 300 * (4 * 0.02) ** 5 / 120
    assert deepest > -tb.TOUCH
    assert np.abs(Y[7:]).max() < tb.STILL
    assert (np.abs(tb.gaps(scene, Y)[:, 0]) < tb.TOUCH).sum() == 4
    assert tb.step(scene, Y, 1.0).tolist() == Y.tolist()
