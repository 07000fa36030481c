"""Schemes on the rigid state: discrete closed forms, order against the oracle, drift of two formulations."""

import math
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from physics.kernels.flight import integrators
from physics.kernels.math import quaternion
from tests.reference.rigid_body import (
    JacobiTop,
    RigidState,
    free_rotation,
    integrate_rigid_body,
    orientation_error,
    rotation_matrix,
)

EPS = np.finfo(float).eps
SCHEMES = {
    integrators.EXPLICIT_EULER: integrators.explicit_euler,
    integrators.SEMI_IMPLICIT_EULER: integrators.semi_implicit_euler,
    integrators.MIDPOINT: integrators.midpoint,
    integrators.RK4: integrators.rk4,
}
every_scheme = pytest.mark.parametrize("code", SCHEMES)

ZERO = (0.0, 0.0, 0.0)
START = (1.0, 0.0, 0.0, 0.0)
MASS = 6.0
MOMENTS = (6.5, 14.5, 17.0)
J = tuple(1 / i for i in MOMENTS)
# A block of 5 x 3 x 2 m tumbling under gravity and a held wrench.
TUMBLE = {
    "x": (0.0, 6.0, 0.0),
    "q": (0.5, -0.5, 0.5, 0.5),
    "v": (1.0, -2.0, 3.0),
    "L": (9.0, 20.0, -15.0),
    "force": (3.0, 5.0, -2.0),
    "torque": (6.0, -8.0, 4.0),
    "g": (0.0, -9.81, 0.0),
    "inv_mass": 1 / MASS,
    "J": J,
}

vectors = st.tuples(*[st.floats(-10, 10)] * 3)
unit_quaternions = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: math.hypot(*q) > 0.1).map(quaternion.normalise)
codes = st.sampled_from(list(SCHEMES))
steps_sizes = st.floats(1e-4, 0.1)


def grouped(x, q, v, L, force, torque, g, inv_mass, J):
    """State, load and inertia as the schemes take them."""
    return (x, q, v, L), integrators.Load(force, torque, g), integrators.Inertia(inv_mass, J)


def spinning(scheme, attitude, L, inverse, h, steps):
    """`steps` steps of a torque-free `scheme`; the attitude after them."""
    x, v = ZERO, ZERO
    for _ in range(steps):
        x, attitude, v, L = scheme(*grouped(x, attitude, v, L, ZERO, ZERO, ZERO, 1.0, inverse), h)
    return attitude


# --- order -------------------------------------------------------------------------------------------


@cache
def truth() -> RigidState:
    """The tumbling block after 1 s, good to 2e-12: rtol 1e-13, about 20 steps."""
    held = np.array(TUMBLE["force"]), np.array(TUMBLE["torque"])
    start = RigidState(*(np.array(TUMBLE[name]) for name in "xqvL"))
    start = start._replace(momentum=MASS * start.momentum)
    return integrate_rigid_body(MASS, np.diag(MOMENTS), start, 1.0, TUMBLE["g"], lambda t, Y: held)


def assert_order(errors, order):
    """Every slope of log error over log h, h halved from one to the next, is `order` ± 0.1."""
    slopes = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert np.abs(slopes - order).max() <= 0.1, (errors, slopes)


ORDERS = [
    (integrators.EXPLICIT_EULER, 1, 512),
    (integrators.SEMI_IMPLICIT_EULER, 1, 512),
    (integrators.MIDPOINT, 2, 128),
    (integrators.RK4, 4, 32),
]


@pytest.mark.parametrize(("code", "order", "fewest"), ORDERS)
def test_order_of_the_attitude_of_a_tumbling_block(code, order, fewest):
    ends = [integrators.integrate(code, *grouped(**TUMBLE), 1 / n, n) for n in (fewest, 2 * fewest, 4 * fewest)]
    assert_order([orientation_error(q, truth().quat) for _, q, _, _ in ends], order)


@pytest.mark.parametrize(("code", "order", "fewest"), ORDERS[:2])
def test_order_of_the_position_by_the_two_euler_methods(code, order, fewest):
    ends = [integrators.integrate(code, *grouped(**TUMBLE), 1 / n, n) for n in (fewest, 2 * fewest)]
    assert_order([np.linalg.norm(x - truth().pos) for x, _, _, _ in ends], order)


@pytest.mark.parametrize(
    ("scheme", "order", "fewest"), [(integrators.matrix_explicit_euler, 1, 1024), (integrators.matrix_rk4, 4, 64)]
)
def test_order_of_the_matrix_formulation(scheme, order, fewest):
    exact = rotation_matrix(truth().quat)
    errors = []
    for n in (fewest, 2 * fewest):
        held = {name: value for name, value in TUMBLE.items() if name not in "xqvL"}
        state = (TUMBLE["x"], quaternion.to_matrix(TUMBLE["q"]), TUMBLE["v"], TUMBLE["L"])
        for _ in range(n):
            state = scheme(*grouped(*state, **held), 1 / n)
        errors.append(np.abs(np.reshape(state[1], (3, 3)) - exact).max())
    assert_order(errors, order)


@every_scheme
def test_momenta_of_the_tumbling_block_are_exact(code):
    n = 256
    x, q, v, L = integrators.integrate(code, *grouped(**TUMBLE), 1 / n, n)
    # n additions to numbers ≤ 32.
    assert np.abs(np.array(L) - truth().angular_momentum).max() <= n * EPS * 32
    assert np.abs(np.array(v) - truth().momentum / MASS).max() <= n * EPS * 32
    assert abs(math.hypot(*q) - 1) <= 4 * EPS
    if code in (integrators.MIDPOINT, integrators.RK4):
        assert np.abs(x - truth().pos).max() <= n * EPS * 32


# --- discrete closed forms ---------------------------------------------------------------------------


@every_scheme
@settings(deadline=None, max_examples=40)
@given(x=vectors, v=vectors, force=vectors, g=vectors, h=steps_sizes, n=st.integers(0, 200))
def test_free_flight_is_the_discrete_parabola(code, x, v, force, g, h, n):
    """x_n = x_0 + n h v_0 + c h² a with c = n (n - 1) / 2, n (n + 1) / 2 or n² / 2."""
    c = {integrators.EXPLICIT_EULER: n * (n - 1) / 2, integrators.SEMI_IMPLICIT_EULER: n * (n + 1) / 2}.get(
        code, n * n / 2
    )
    x_n, _, v_n, _ = integrators.integrate(code, *grouped(x, START, v, ZERO, force, ZERO, g, 0.5, J), h, n)
    a = np.array(g) + 0.5 * np.array(force)
    # |a| ≤ 15, so |v| ≤ 10 + 15 n h ≤ 310 and |x| ≤ 10 + 310 n h; each of n steps rounds v and x by EPS,
    # and what v has lost is moved on for n h ≤ 20 s.
    reach = 10 + 15 * n * h
    assert np.abs(v_n - (np.array(v) + n * h * a)).max() <= (n + 4) * EPS * reach
    bound = (n + 4) * EPS * (10 + 2 * reach * n * h)
    assert np.abs(x_n - (np.array(x) + n * h * np.array(v) + c * h * h * a)).max() <= bound


def factor(code, start, middle, end):
    """Factor of q in a step about a fixed axis: the scheme on h z' = i y z, y = h ω / 2 at three times.

    With y constant it is the stability polynomial at iy.
    """
    a, m, b = 1j * start, 1j * middle, 1j * end
    if code == integrators.MIDPOINT:
        return 1 + m * (1 + a / 2)
    if code == integrators.RK4:
        k2 = m * (1 + a / 2)
        k3 = m * (1 + k2 / 2)
        return 1 + (a + 2 * k2 + 2 * k3 + b * (1 + k3)) / 6
    return 1 + (a if code == integrators.EXPLICIT_EULER else b)


@every_scheme
@settings(deadline=None, max_examples=40)
@given(q=unit_quaternions, axis=vectors, size=st.floats(-10, 10), torque=st.floats(-10, 10), h=steps_sizes)
def test_a_sphere_spun_up_about_a_fixed_axis_turns_by_the_phases_of_its_steps(code, q, axis, size, torque, h):
    """For explicit Euler without torque, n steps turn by 2 n atan(h |ω| / 2)."""
    n, inverse = 50, 0.5
    axis = np.array(axis) / math.hypot(*axis) if math.hypot(*axis) > 1e-3 else np.array([0.6, 0.0, 0.8])
    L, tau = (tuple(float(a) for a in axis * f) for f in (size, torque))
    _, q_n, _, _ = integrators.integrate(code, *grouped(ZERO, q, ZERO, L, ZERO, tau, ZERO, 1.0, (inverse,) * 3), h, n)
    y = h * inverse / 2 * (size + torque * h * np.arange(0, n + 0.5, 0.5))
    angle = sum(2 * np.angle(factor(code, *y[2 * k : 2 * k + 3])) for k in range(n))
    turn = quaternion.exp_map(tuple(float(a) for a in axis * angle))
    # 50 steps of 20 roundings of EPS/2 in the parts of q, twice that in the angle; angle ≤ 150 by 4 EPS.
    assert orientation_error(quaternion.multiply(turn, q), q_n) <= 1600 * EPS


@every_scheme
@settings(deadline=None, max_examples=20)
@given(q=unit_quaternions, L=vectors, h=steps_sizes)
def test_angular_momentum_without_torque_is_constant_bit_for_bit(code, q, L, h):
    assert integrators.integrate(code, *grouped(ZERO, q, ZERO, L, ZERO, ZERO, ZERO, 1.0, J), h, 50)[3] == L


@pytest.mark.parametrize(
    ("attitude", "code"),
    [(integrators.euler_attitude, 1), (integrators.midpoint_attitude, 3), (integrators.rk4_attitude, 4)],
)
def test_the_quaternion_left_alone_grows_by_the_stability_polynomial(attitude, code):
    """Explicit Euler: |q| by sqrt(1 + (h |ω| / 2)²) a step."""
    h, n, L, inverse = 0.05, 400, (1.0, -2.0, 2.0), 0.5
    held = () if code == 1 else (ZERO,)
    q = START
    for _ in range(n):
        q = attitude(q, L, *held, (inverse,) * 3, h)
    growth = abs(factor(code, *[h * inverse * 3 / 2] * 3))
    # 400 steps of 8 roundings.
    assert math.hypot(*q) == pytest.approx(growth**n, rel=n * 8 * EPS)
    if code == 1:
        assert growth == pytest.approx(math.sqrt(1 + (h * 1.5 / 2) ** 2), rel=2 * EPS)


@pytest.mark.parametrize(
    ("scheme", "code"),
    [(integrators.matrix_explicit_euler, integrators.EXPLICIT_EULER), (integrators.matrix_rk4, integrators.RK4)],
)
def test_the_matrix_left_alone_drifts_in_the_two_columns_across_the_axis(scheme, code):
    """RᵀR = a aᵀ + |p(ih|ω|)|²ⁿ (1 - a aᵀ), a the axis in the body; |p|² = 1 + (h |ω|)² for Euler."""
    h, n, L, inverse = 0.05, 100, (1.0, -2.0, 2.0), 0.5
    R0 = quaternion.to_matrix((0.5, -0.5, 0.5, 0.5))
    R = np.reshape(spinning(scheme, R0, L, (inverse,) * 3, h, n), (3, 3))
    axis = np.array(quaternion.transposed_matvec(R0, L)) / 3
    growth = abs(factor(code, *[h * inverse * 3] * 3)) ** (2 * n)
    expected = np.outer(axis, axis) + growth * (np.eye(3) - np.outer(axis, axis))
    # Euler's RᵀR reaches 1.7. A rounding of EPS/2 of every entry at every step makes 561 EPS/2 of it at the most (the
    # linearised map says so; after 400 steps 7 million, as ω = R J RᵀL tilts with R); six of them, relative to the
    # largest entry, are n 10 EPS.
    assert np.abs(R.T @ R - expected).max() <= n * 10 * EPS * max(growth, 1)
    if code == integrators.RK4:
        y = h * 1.5
        assert growth == pytest.approx((1 - y**6 / 72 + y**8 / 576) ** n, rel=n * 4 * EPS)


def test_the_matrix_drifts_64_times_as_fast_as_the_quaternion_by_rk4():
    """1 - |p(iy)|² = y⁶/72 (1 - y²/8): y = h|ω| for R, half of it for q, so a factor 64 (1 - 3 y²/32)."""
    h, n, L, inverse = 0.2, 100, (0.0, 0.0, 2.0), 1.0
    q, y = START, 0.4
    for _ in range(n):
        q = integrators.rk4_attitude(q, L, ZERO, (inverse,) * 3, h)
    R = np.reshape(spinning(integrators.matrix_rk4, quaternion.to_matrix(START), L, (inverse,) * 3, h, n), (3, 3))
    ratio = math.log(R[:, 0] @ R[:, 0]) / math.log(np.dot(q, q))
    # log(1 - s) = -s (1 + s/2 ...) with s = 6e-5 per step; |q|² is off 1 by 1e-4 and known to 1e-13: 1e-9.
    assert ratio == pytest.approx(64 * (1 - y**2 / 8) / (1 - y**2 / 32), rel=4e-5)


# --- laws --------------------------------------------------------------------------------------------


@settings(deadline=None, max_examples=60)
@given(codes, unit_quaternions, unit_quaternions, vectors, vectors, vectors, steps_sizes)
def test_a_turned_world_gives_the_turned_result(code, turn, q, v, L, torque, h):
    body = (1 / MASS, J)
    x, q_n, v_n, L_n = integrators.integrate(
        code, *grouped(ZERO, q, v, L, ZERO, torque, (0.0, -9.81, 0.0), *body), h, 5
    )
    v, L, torque, g = (quaternion.rotate(turn, a) for a in (v, L, torque, (0.0, -9.81, 0.0)))
    turned = integrators.integrate(
        code, *grouped(ZERO, quaternion.multiply(turn, q), v, L, ZERO, torque, g, *body), h, 5
    )
    # `rotate` loses 30 EPS of a vector ≤ 22; five steps of about 20 roundings.
    for before, after in ((x, turned[0]), (v_n, turned[2]), (L_n, turned[3])):
        assert np.abs(np.subtract(quaternion.rotate(turn, before), after)).max() <= 150 * EPS * 22
    assert orientation_error(quaternion.multiply(turn, q_n), turned[1]) <= 300 * EPS


@settings(deadline=None, max_examples=60)
@given(codes, unit_quaternions, vectors, vectors, steps_sizes)
def test_opposite_quaternions_are_the_same_body(code, q, L, torque, h):
    rest = (ZERO, L, ZERO, torque, ZERO, 1.0, J)
    one = integrators.integrate(code, *grouped(ZERO, q, *rest), h, 5)
    other = integrators.integrate(code, *grouped(ZERO, tuple(-a for a in q), *rest), h, 5)
    assert np.array_equal(one[1], np.negative(other[1]))


@settings(deadline=None, max_examples=60)
@given(codes, unit_quaternions, vectors, vectors, steps_sizes)
def test_what_has_no_inverse_mass_and_inertia_stays(code, q, force, torque, h):
    x, q_n, v, _ = integrators.integrate(
        code, *grouped((1.0, 2.0, 3.0), q, ZERO, ZERO, force, torque, ZERO, 0.0, ZERO), h, 5
    )
    assert x == (1, 2, 3)
    assert v == ZERO
    # Normalisation rounds each part by 2.5 EPS a step at most.
    assert np.abs(np.subtract(q_n, q)).max() <= 15 * EPS


@every_scheme
def test_the_loop_is_its_steps_bit_for_bit(code):
    held = {name: value for name, value in TUMBLE.items() if name not in "xqvL"}
    state = tuple(TUMBLE[name] for name in "xqvL")
    for _ in range(7):
        by_code = integrators.step(code, *grouped(*state, **held), 0.01)
        state = SCHEMES[code](*grouped(*state, **held), 0.01)
        assert by_code == state
    assert integrators.integrate(code, *grouped(**TUMBLE), 0.01, 7) == state


@pytest.mark.parametrize("code", [-1, 0, 5])
def test_an_unknown_scheme_cannot_be_taken_for_a_result(code):
    assert all(np.isnan(part).all() for part in integrators.step(code, *grouped(**TUMBLE), 0.01))


# --- the oracles agree with each other ---------------------------------------------------------------


@pytest.mark.parametrize(
    ("moments", "angvel"),
    [((1, 2, 3), (0.01, 1, 0.02)), ((1, 2, 3), (0.8, 0.3, 0.2)), ((3, 1, 2), (0.5, -0.6, 0.7))],
)
def test_series_elliptic_functions_and_dop853_agree_on_the_free_top(moments, angvel):
    t = 3.0
    series = free_rotation(moments, START, angvel, t)
    assert series.error < 1e-15
    # ω_p t ≤ 5 and the amplitudes lose a few EPS each.
    assert np.abs(JacobiTop(moments, angvel).angvel_body(t) - series.angvel_body).max() <= 20 * EPS
    start = RigidState(np.zeros(3), np.array(START), np.zeros(3), np.multiply(moments, angvel))
    end = integrate_rigid_body(1.0, np.diag(moments), start, t)
    # rtol 1e-13 a step, about 20 steps.
    assert orientation_error(end.quat, series.quat) <= 2e-12


def test_the_period_of_the_intermediate_axis_is_that_of_the_published_case():
    top = JacobiTop((1, 2, 3), (0.01, 1, 0.02))
    assert top.period == pytest.approx(33.195, abs=5e-4)
    # The argument 4 K = 19 is rounded by 19 EPS; sn, cn, dn have slopes ≤ 1, the amplitudes are ≤ 1.
    assert np.abs(top.angvel_body(top.period) - [0.01, 1, 0.02]).max() <= 40 * EPS
    assert abs(top.angvel_body(top.period / 2)[1] + 1) <= 40 * EPS
