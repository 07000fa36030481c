"""The free-rotation flow against series in exact rationals, closed forms and the high-precision reference."""

from __future__ import annotations

import types
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from physics.compiler.decorators import kernel
from physics.kernels.flight import free_rotation
from physics.kernels.math import quaternion as qt
from physics.kernels.state.layout import SERIES_SIZE
from tests.reference import rigid_body as ref
from tests.tiers.sweep import sweep

BLOCK = np.array([6.5, 14.5, 17.0])
EPS = np.finfo(float).eps


@kernel
def _repeat(q, L, J, series, h, steps):
    for _ in range(steps):
        q = free_rotation.free_rotation(q, L, J, series, h)
    return q


def turn(moments, quat, L, h, steps=1):
    """Attitude after `steps` flows of h each."""
    J = tuple(1.0 / np.asarray(moments, float))
    series = np.zeros(SERIES_SIZE)
    free_rotation.attitude_series(*J, series)
    return np.array(_repeat(tuple(map(float, quat)), tuple(map(float, L)), J, series, float(h), steps))


def momentum(moments, quat, angvel_body):
    """World angular momentum [kg m²/s] of a body spinning at `angvel_body` in its frame."""
    return ref.rotation_matrix(np.asarray(quat, float)) @ (np.asarray(moments) * angvel_body)


# --- the coefficients, derived anew -----------------------------------------------------------------------------


def _exact_modification(J, m, order):
    """s and d, coefficients of h^0 .. h^order, by exact Taylor series of the flow from momentum m."""
    a = (J[2] - J[1], J[0] - J[2], J[1] - J[0])
    M = [[Fraction(x)] for x in m]
    q = [[Fraction(1)], [Fraction(0)], [Fraction(0)], [Fraction(0)]]
    signs = (((1, 0, -1), (2, 1, -1), (3, 2, -1)), ((0, 0, 1), (2, 2, 1), (3, 1, -1)),
             ((0, 1, 1), (3, 0, 1), (1, 2, -1)), ((0, 2, 1), (1, 1, 1), (2, 0, -1)))  # fmt: skip
    for n in range(order + 2):
        w = [[J[c] * x for x in M[c]] for c in range(3)]

        def product(x, y, n=n):
            return sum(x[i] * y[n - i] for i in range(n + 1))

        rate = [a[c] * product(M[(c + 1) % 3], M[(c + 2) % 3]) for c in range(3)]
        dq = [sum(s * product(q[i], w[c]) for i, c, s in row) / 2 for row in signs]
        for c in range(3):
            M[c].append(rate[c] / (n + 1))
        for c in range(4):
            q[c].append(dq[c] / (n + 1))
    f = []
    for c in range(3):
        e = [sum(q[0][i] * q[c + 1][n - i] for i in range(n + 1)) for n in range(order + 2)]
        total = [2 * M[c][0], *M[c][1 : order + 2]]
        quotient = []
        for n in range(order + 2):
            known = sum(total[n - i] * quotient[i] for i in range(n))
            quotient.append((4 * e[n] - known) / total[0])
        f.append(quotient[1:])
    s = [(x - y) / (J[0] - J[1]) for x, y in zip(f[0], f[1])]
    d = [x - J[0] * y for x, y in zip(f[0], s)]
    return s, d, f


@pytest.mark.parametrize("m", [(1, 2, 3), (2, 1, 5), (3, 7, 1)])
def test_modified_inertia_series_is_that_of_the_exact_flow(m):
    """The kernel's polynomials give the exact rational coefficients of s and d up to h⁶, and one s and d fit
    all three axes: that is the theorem of McLachlan and Zanna."""
    J = (Fraction(1), Fraction(1, 2), Fraction(1, 3))
    s, d, f = _exact_modification(J, m, 6)
    for n in range(7):
        assert f[2][n] == s[n] * J[2] + d[n]
    series = np.zeros(SERIES_SIZE)
    free_rotation.attitude_series(*map(float, J), series)
    mm = float(sum(x * x for x in m))
    ee = float(sum(j * x * x for j, x in zip(J, m)))
    first = {1: (0, 2), 2: (2, 3), 3: (5, 4)}
    for k, (at, size) in first.items():
        powers = np.array([mm ** (k - i) * ee**i for i in range(size)])
        for exact, offset in ((s, 0), (d, 9)):
            terms = series[offset + at : offset + at + size] * powers
            # Sums of at most five terms of rounded coefficients (each a few roundings).
            assert float(exact[2 * k]) == pytest.approx(terms.sum(), abs=40 * EPS * np.abs(terms).sum())


# --- the flow ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("angvel", "duration", "h"),
    sweep(
        [
            ((0.1, 5.0, 0.1), 4.0, 0.01),
            ((0.1, 5.0, 0.1), 20.0, 0.01),
            ((0.1, 5.0, 0.1), 20.0, 0.1),
            ((1.0, 100.0, 1.0), 1.0, 0.01),
        ],
        [((0.1, 5.0, 0.1), 4.0, 0.01)],  # `test_flight` takes the 20 s
    ),
)
def test_tumbling_near_the_intermediate_axis_agrees_with_the_reference(angvel, duration, h):
    """Issue: at most 1e-9 rad after 20 s at step 0.01. Rounding grows with the unstable axis at rate
    σ = ω √((I2-I1)(I3-I2)/(I1 I3)) = 0.43 ω up to half a turn and then alternately shrinks and grows (the next test
    says how far); and 1 s at ω = 100 is as many turns as 20 s at ω = 5."""
    moments = BLOCK
    truth, _, error = ref.free_rotation(moments, (1.0, 0, 0, 0), angvel, duration, 40)
    assert error < 1e-13
    got = turn(moments, (1, 0, 0, 0), moments * np.array(angvel), h, round(duration / h))
    assert ref.orientation_error(got, truth) <= 1e-9


@kernel
def _turned(q, L, J, series, h):
    return free_rotation.free_rotation(q, L, J, series, h)


def storing(moments, angvel, h, steps):
    """Root mean square of the angle [rad] that `steps` attitudes make of rounding when they are stored, and only then.

    A component is off by ulp/√12 (rms), along no radius; the linearised flow, by differences, takes that to the end.
    """
    J, series = tuple(1.0 / moments), np.zeros(SERIES_SIZE)
    free_rotation.attitude_series(*J, series)
    held, offset = (tuple(map(float, moments * angvel)), J, series, h), 1e-5
    q, attitudes, flows = (1.0, 0.0, 0.0, 0.0), [], []
    for _ in range(steps):
        ends = [[_turned(qt.normalise(tuple(q + sign * offset * e)), *held) for sign in (1.0, -1.0)] for e in np.eye(4)]
        flows.append(np.array([np.subtract(*pair) for pair in ends]).T / (2.0 * offset))
        q = _turned(q, *held)
        attitudes.append(q)
    square, rest = 0.0, np.eye(4)
    for q, flow in zip(reversed(attitudes), reversed(flows), strict=True):
        square += np.sum((rest @ (np.eye(4) - np.outer(q, q)) * np.spacing(np.abs(q))) ** 2) / 12.0
        rest = rest @ flow
    return 2.0 * np.sqrt(square)  # a turn by an angle moves a quaternion by half of it


def test_tumbling_is_off_by_the_rounding_of_its_attitudes():
    """Stored alone they are off by 4.7e-11 rad. What is computed in between doubles that, and no more (over eight spins
    in a row: 9.4e-11, rms); within three times the mean lie 99.7 % of a normal distribution."""
    spin, h, steps = np.array([0.1, 5.0, 0.1]), 0.01, 2000
    alone = storing(BLOCK, spin, h, steps)
    assert alone == pytest.approx(4.67e-11, rel=0.01)
    truth, _, _ = ref.free_rotation(BLOCK, (1.0, 0, 0, 0), spin, h * steps, 20)
    assert ref.orientation_error(turn(BLOCK, (1, 0, 0, 0), BLOCK * spin, h, steps), truth) <= 3 * 2 * alone


def test_a_long_step_equals_many_short_ones():
    """The flow is exact, so cutting it up changes rounding only: 1 s in 1, 10 or 1000 pieces."""
    L = BLOCK * np.array([1.0, 0.3, -2.0])
    whole = turn(BLOCK, (1, 0, 0, 0), L, 1.0)
    for pieces in (10, 1000):
        # Each piece rounds the attitude by a few EPS; the motion is not near the unstable axis.
        assert ref.orientation_error(turn(BLOCK, (1, 0, 0, 0), L, 1.0 / pieces, pieces), whole) < 20 * pieces * EPS


def test_period_of_the_momentum_is_that_of_the_elliptic_functions():
    """4 K(k)/ω_p by SciPy's K, whatever the order of the axes; a plate's own frame turns at (1/I1 - 1/I3) L3."""
    rng = np.random.default_rng(0)
    for _ in range(200):
        moments, angvel = np.sort(1.0 + rng.random(3)), rng.normal(size=3)  # within the triangle's bound
        order = rng.permutation(3)
        found = free_rotation.momentum_period(tuple((moments * angvel)[order]), tuple(1.0 / moments[order]))
        # K has the condition k²/k'² in its modulus; JacobiTop has it from differences of energies.
        assert found == pytest.approx(ref.JacobiTop(moments, angvel).period, rel=1e-9)
    found = free_rotation.momentum_period((0.1, 0.2, 5.0), (1.0, 1.0, 0.5))
    assert found == pytest.approx(2 * np.pi / (0.5 * 5.0), rel=8 * EPS)
    assert free_rotation.momentum_period((0.0, 1.0, 0.0), (1.0, 0.5, 0.25)) == np.inf  # about the middle axis


def test_many_turns_at_once_follow_the_elliptic_functions_and_the_parts():
    """60 to 20,000 rad at once: momentum in the body's frame by the closed form, attitude by many pieces.

    A part rounds the momentum by EPS, which changes the rate of the rest: at worst EPS times parts times angle. By
    periods that is so for one period only; the pieces, too short for periods, have all of it.
    """
    rng = np.random.default_rng(1)
    for _ in range(60):
        spread = 0.05 + rng.random(3)
        moments, angvel = spread.sum() - spread, rng.normal(size=3)
        m = moments * angvel
        angle = 10.0 ** rng.uniform(np.log10(60.0), np.log10(2e4))
        h = angle / np.sqrt((m * m / moments).sum() / moments.min())
        at_once = turn(moments, (1, 0, 0, 0), m, h)
        top = ref.JacobiTop(moments, angvel)
        parts = top.period * angle / h / free_rotation.PART_ANGLE_LIMIT
        found = ref.rotation_matrix(at_once).T @ m
        assert np.abs(found - moments * top.angvel_body(h)).max() < EPS * parts * angle * np.linalg.norm(m)
        if angle < 1000.0:
            pieces = int(angle / 40.0) + 1
            in_pieces = turn(moments, (1, 0, 0, 0), m, h / pieces, pieces)
            assert ref.orientation_error(at_once, in_pieces) < EPS * angle / free_rotation.PART_ANGLE_LIMIT * angle
            assert ref.orientation_error(turn(moments, at_once, m, -h), (1, 0, 0, 0)) < 2 * EPS * parts * angle


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("angle", [0.05, 1.0, 1e5, 1e8, 1e12])
def test_a_turn_about_a_principal_axis_is_plain_at_any_angle(axis, angle):
    """Also about the middle one, where the momentum has no period. The angle is rounded to EPS of itself."""
    L = np.zeros(3)
    L[axis] = BLOCK[axis]  # 1 rad/s
    expected = np.zeros(4)
    expected[0], expected[1 + axis] = np.cos(angle / 2), np.sin(angle / 2)
    assert ref.orientation_error(turn(BLOCK, (1, 0, 0, 0), L, angle), expected) < 4 * EPS * (1 + angle)


@pytest.mark.parametrize("moments", [(1.0, 1.0 + 1e-9, 1.5), (1.0 - 1e-13, 1.0, 1.0 + 1e-13)])
def test_a_turn_too_far_to_follow_keeps_the_energy(moments):
    """1e9 rad of a body whose moments are equal to 1e-9: attitude unknown, energy as it was to rounding."""
    m = np.array([0.6, 0.8, 1e-10])
    end = ref.rotation_matrix(turn(moments, (1, 0, 0, 0), m, 1e9)).T @ m
    assert (end**2 / moments).sum() == pytest.approx((m**2 / moments).sum(), rel=20 * EPS)


def _part_of_many_digits():
    """One part of the flow as plain Python: of extended numbers, it has no rounding of doubles."""
    product, unit = (types.FunctionType(f.py_func.__code__, {}) for f in (qt.multiply, qt.renormalise))
    half = types.FunctionType(free_rotation._half_angle.py_func.__code__, vars(free_rotation))
    names = {
        **vars(free_rotation),
        "qt": types.SimpleNamespace(multiply=product, renormalise=unit),
        "_half_angle": half,
    }
    return types.FunctionType(free_rotation._part.py_func.__code__, names)


@pytest.mark.skipif(np.finfo(np.longdouble).eps > 1e-18, reason="no extended numbers on this machine")
@pytest.mark.parametrize("limit", [free_rotation.TINY_SQUARE, free_rotation.SMALL_SQUARE])
def test_terms_are_left_out_only_where_rounding_is_larger(limit):
    """At the very angle up to which terms are left out they change an attitude by less than half a last digit of 1.

    Of random bodies, rods and plates among them, that turn about any axis.
    """
    part, rng, wide = _part_of_many_digits(), np.random.default_rng(0), np.longdouble
    worst = 0.0
    for _ in range(1500):
        spread = 10.0 ** rng.uniform(-6, 0, 3)  # second moments Σ m x²: any are those of a body
        J = (1.0 / (spread.sum() - spread)).astype(wide)
        m = (rng.normal(size=3) * 10.0 ** rng.uniform(-4, 0, 3)).astype(wide)
        m *= np.sqrt(wide(limit) / (J.max() * (J * m) @ m))
        series = np.zeros(SERIES_SIZE, dtype=wide)
        free_rotation.write_attitude_series(*J, series)
        start, sums = (wide(1), wide(0), wide(0), wide(0)), (m @ m, (J * m) @ m)
        without, fully = (
            np.array(part(start, tuple(m), tuple(J), series, *sums, limit * factor, wide(1))[0])
            for factor in (1.0, 1.0 + 1e-9)
        )
        worst = max(worst, float(np.abs(without - fully).max()))
    assert 0.0 < worst < EPS / 2


@given(st.tuples(*[st.floats(-30, 30)] * 3), st.sampled_from([0.003, 0.02, 0.5]))
def test_flow_keeps_unit_length_energy_and_reverses(angvel, h):
    """|q| = 1 and 2E = Σ L_k²/I_k to rounding, and the flow of -h undoes that of h."""
    L = BLOCK * np.array(angvel)
    q = turn(BLOCK, (1, 0, 0, 0), L, h)
    parts = 1 + 17 * np.linalg.norm(angvel) / 6.5 * h / free_rotation.PART_ANGLE_LIMIT
    assert abs(np.linalg.norm(q) - 1) < 8 * EPS
    m = ref.rotation_matrix(q).T @ L
    energy, start = np.sum(m * m / BLOCK), np.sum(L * L / BLOCK)
    assert energy == pytest.approx(start, rel=30 * EPS * parts, abs=1e-300)
    back = turn(BLOCK, q, L, -h)
    # Rounding of each part, amplified at most by exp(σ h) with σ below 0.5 |ω|.
    assert ref.orientation_error(back, (1.0, 0, 0, 0)) < 30 * EPS * parts * np.exp(0.5 * np.linalg.norm(angvel) * h)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_spin_about_a_principal_axis_is_a_plain_rotation(axis):
    """Relative equilibrium: q = (cos ωt/2, sin ωt/2 e_axis)."""
    w = np.zeros(3)
    w[axis] = 0.7
    q = turn(BLOCK, (1, 0, 0, 0), BLOCK * w, 0.05, 20)
    expected = np.r_[np.cos(0.35), np.sin(0.35) * np.eye(3)[axis]]
    assert np.abs(q - expected).max() < 60 * EPS


@pytest.mark.parametrize("spin", [1e3, 1e5])
def test_hard_case_1_thin_plate_at_a_thousand_to_a_hundred_thousand_radians_per_second(spin):
    """A thin symmetric plate: the exact motion is the spin about its axis at λ = (1 - I3/I1) ω3 in the frame that
    precesses about L at |L|/I1. Angles grow like ω t, and so does their rounding."""
    moments = np.array([1.0, 1.0, 1.98])
    angvel = spin * np.array([0.02, 0.0, 1.0])
    h, steps = 0.01, 3
    L = moments * angvel
    got = turn(moments, (1, 0, 0, 0), L, h, steps)
    t = h * steps
    l_hat, rate = L / np.linalg.norm(L), np.linalg.norm(L) / moments[0]
    own = (1 - moments[2] / moments[0]) * angvel[2]
    precession = np.r_[np.cos(rate * t / 2), np.sin(rate * t / 2) * l_hat]
    spinning = np.r_[np.cos(own * t / 2), 0, 0, np.sin(own * t / 2)]
    expected = ref.quaternion_product(precession, spinning)
    assert np.isfinite(got).all()
    # rate * t itself is rounded to EPS rate t; the parts of the step add a few roundings each, of random sign.
    assert ref.orientation_error(got, expected) < 40 * EPS * rate * t + 1e-12


def test_hard_case_2_period_of_the_intermediate_axis_flip():
    """I = (1, 2, 3), ω = (0.01, 1, 0.02): body momentum returns after T = 4 K(k)/ω_p = 33.195 s."""
    moments, angvel = np.array([1.0, 2.0, 3.0]), np.array([0.01, 1.0, 0.02])
    period = ref.JacobiTop(moments, angvel).period
    assert period == pytest.approx(33.195, abs=5e-4)
    L = moments * angvel
    q = turn(moments, (1, 0, 0, 0), L, period / 4000, 4000)
    m = ref.rotation_matrix(q).T @ L
    # 4000 roundings, amplified by at most exp(σ T/4), σ = √(1/3), in each of four passes.
    assert np.abs(m - L).max() < 4000 * EPS * np.exp(period / 4 / np.sqrt(3)) * 3


def test_isotropic_rotation_is_constant_spin():
    """All moments equal: ω stays, whatever the axis."""
    w = np.array([0.3, -1.0, 2.0])
    q = np.array(free_rotation.isotropic_rotation((1.0, 0.0, 0.0, 0.0), tuple(2.5 * w), 0.4, 0.5))
    half = 0.25 * np.linalg.norm(w)
    assert np.abs(q - np.r_[np.cos(half), np.sin(half) * w / np.linalg.norm(w)]).max() < 8 * EPS
