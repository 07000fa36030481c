"""Independent oracles for the motion of one rigid body: no kernel of the engine is used here.

Three of them, which share no formula beyond Euler's equations, so that each
vouches for the others: DOP853 on the world-frame state (x, q, P, L); a Taylor
series in multiple precision of the body-frame equations; and the closed form
of the torque-free top in Jacobi elliptic functions.

Sources: Witkin and Baraff, *Physically Based Modeling* (SIGGRAPH course notes,
1997), "Rigid Body Simulation I", sections 2-4, for the equations; Landau and
Lifshitz, *Mechanics*, 3rd ed., 1976, section 37, for the asymmetrical top
(derived once more in `JacobiTop`); Hairer, Nørsett and Wanner, *Solving
Ordinary Differential Equations I*, 2nd ed., 1993, section I.8, for Taylor
coefficients by recurrence, section II.5 for DOP853.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import mpmath
import numpy as np
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipkinc, ellipkm1

Wrench = Callable[[float, np.ndarray], tuple[np.ndarray, np.ndarray]]


class RigidState(NamedTuple):
    """Position [m], quaternion (w, x, y, z) body to world, P [kg m/s], L [kg m²/s]; world frame."""

    pos: np.ndarray
    quat: np.ndarray
    momentum: np.ndarray
    angular_momentum: np.ndarray


def quaternion_product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Hamilton product of two quaternions (w, x, y, z)."""
    vector = a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])
    return np.array([a[0] * b[0] - a[1:] @ b[1:], *vector])


def rotation_matrix(q: np.ndarray) -> np.ndarray:
    """Body-to-world rotation (3, 3) of a quaternion of any length, 1 + 2 s (w [u]x + [u]x²), s = 1/|q|²."""
    skew = np.array([[0, -q[3], q[2]], [q[3], 0, -q[1]], [-q[2], q[1], 0]])
    return np.eye(3) + 2 / (q @ q) * (q[0] * skew + skew @ skew)


def orientation_error(q1: np.ndarray, q2: np.ndarray) -> float:
    """Angle [rad], 0 to π, of the rotation between two orientations.

    Twice the arc tangent of vector over scalar part of q1* q2, which is accurate
    to rounding for small angles; the arc cosine of the scalar part alone
    sees nothing below 1e-8.
    """
    q1, q2 = np.asarray(q1, dtype=float), np.asarray(q2, dtype=float)
    between = quaternion_product(q1 * [1, -1, -1, -1], q2)
    return 2 * float(np.arctan2(np.linalg.norm(between[1:]), abs(between[0])))


def integrate_rigid_body(
    mass: float,
    inertia_body: np.ndarray,
    state: RigidState,
    duration: float,
    gravity: np.ndarray = (0, 0, 0),
    wrench: Wrench | None = None,
    rtol: float = 1e-13,
) -> RigidState:
    """State after `duration` [s], by DOP853 on Y = (x, q, P, L).

    Parameters
    ----------
    mass, inertia_body : float, (3, 3)
        [kg], [kg m²] about the centre of mass, body frame.
    state : RigidState
        Where it starts.
    gravity : (3,)
        [m/s²], world frame.
    wrench : callable, optional
        (t, Y) -> force [N], torque [N m] about the centre of mass, world frame.
    rtol : float
        Relative tolerance; the absolute one is `rtol` times 1e-2 in SI units.
    """
    inverse = np.linalg.inv(inertia_body)
    gravity = np.asarray(gravity, dtype=float)
    none = np.zeros(3), np.zeros(3)

    def derivative(t: float, Y: np.ndarray) -> np.ndarray:
        q, P, L = Y[3:7], Y[7:10], Y[10:]
        R = rotation_matrix(q)
        omega = R @ inverse @ R.T @ L
        force, torque = none if wrench is None else wrench(t, Y)
        spin = quaternion_product(np.array([0, *omega]), q)
        return np.concatenate([P / mass, spin / 2, mass * gravity + force, torque])

    solution = solve_ivp(derivative, (0, duration), np.concatenate(state), method="DOP853", rtol=rtol, atol=1e-2 * rtol)
    assert solution.success, solution.message
    Y = solution.y[:, -1]
    return RigidState(Y[:3], Y[3:7] / np.linalg.norm(Y[3:7]), Y[7:10], Y[10:])


class FreeRotation(NamedTuple):
    """Quaternion body to world, angular velocity in the body frame [rad/s], bound of both errors."""

    quat: np.ndarray
    angvel_body: np.ndarray
    error: float


def free_rotation(
    moments: np.ndarray, quat: np.ndarray, angvel_body: np.ndarray, duration: float, digits: int = 40
) -> FreeRotation:
    """Torque-free rotation by a Taylor series in `digits` decimal digits, with an error estimate.

    Parameters
    ----------
    moments : (3,)
        Principal moments [kg m²], body frame.
    quat, angvel_body : (4,), (3,)
        Unit quaternion body to world and angular velocity [rad/s], body frame, at t = 0.
    duration : float
        [s].

    Returns
    -------
    FreeRotation
        `error` is the largest difference between this run and one with steps
        2/3 as long and four more terms, plus the rounding of the result to float64.
    """
    with mpmath.workdps(digits):
        start = [mpmath.mpf(float(a)) for a in (*angvel_body, *quat)]
        steps = 1 + int(2 * float(np.linalg.norm(angvel_body)) * abs(duration))
        coarse = _taylor(moments, start, duration, steps, order=digits)
        fine = _taylor(moments, start, duration, (3 * steps + 1) // 2, order=digits + 4)
        difference = max(abs(a - b) for a, b in zip(coarse, fine))
        result = np.array([float(a) for a in fine])
    error = float(difference) + float(np.finfo(float).eps * np.abs(result).max())
    return FreeRotation(result[3:], result[:3], error)


def _taylor(moments: np.ndarray, start: list, duration: float, steps: int, order: int) -> list:
    """(ω, q) after `steps` Taylor steps of `order` terms, all in multiple precision."""
    I = [mpmath.mpf(float(a)) for a in moments]
    euler = [(I[(i + 1) % 3] - I[(i + 2) % 3]) / I[i] for i in range(3)]
    h = mpmath.mpf(float(duration)) / steps
    now = start
    for _ in range(steps):
        series = [[a] for a in now]
        for k in range(order):
            for row, rate in zip(series, taylor_coefficients(series, euler)):
                row.append(rate / (k + 1))
        now = [mpmath.polyval(row[::-1], h) for row in series]
    return now


def taylor_coefficients(series: list, euler: list) -> list:
    """Next Taylor coefficient of ω' = (I_j - I_k)/I_i ω_j ω_k and of q' = q ω / 2 (Cauchy products)."""
    a, b, c, w, x, y, z = series

    def product(left: list, right: list) -> mpmath.mpf:
        return mpmath.fdot(left, right[::-1])

    return [
        euler[0] * product(b, c),
        euler[1] * product(c, a),
        euler[2] * product(a, b),
        -(product(x, a) + product(y, b) + product(z, c)) / 2,
        (product(w, a) + product(y, c) - product(z, b)) / 2,
        (product(w, b) + product(z, a) - product(x, c)) / 2,
        (product(w, c) + product(x, b) - product(y, a)) / 2,
    ]


class JacobiTop:
    """Torque-free top with three different principal moments, in closed form.

    Parameters
    ----------
    moments : (3,)
        Principal moments [kg m²], all different, in any order.
    angvel_body : (3,)
        Angular velocity [rad/s] at t = 0, body frame, not on the separatrix L² = 2 E I2.

    Notes
    -----
    Name the moments I1 < I2 < I3 and put ω = (a1 cn u, a2 sn u, a3 dn u) with
    u = ω_p t + u0 into Euler's equations; by cn' = -sn dn, sn' = cn dn and
    dn' = -k² sn cn they hold if

        a1² = (2E I3 - L²) / (I1 (I3 - I1)),   a2² = (2E I3 - L²) / (I2 (I3 - I2)),
        a3² = (L² - 2E I1) / (I3 (I3 - I1)),   a1 ω_p I1 = (I3 - I2) a2 a3,
        ω_p² = (I3 - I2)(L² - 2E I1) / (I1 I2 I3),
        k² = (I2 - I1)(2E I3 - L²) / ((I3 - I2)(L² - 2E I1)),
        1 - k² = (I3 - I1)(L² - 2E I2) / ((I3 - I2)(L² - 2E I1)).

    So k < 1 for L² > 2 E I2. Otherwise 1 and 3 change places, in every formula;
    where the relabelling is a reflection it turns the sign of ω, an axial vector.
    The differences are taken as sums of squares: L² - 2E I1 is
    I2 (I2 - I1) ω2² + I3 (I3 - I1) ω3², and so on, so that nothing cancels.
    """

    def __init__(self, moments: np.ndarray, angvel_body: np.ndarray) -> None:
        moments, angvel = np.asarray(moments, dtype=float), np.asarray(angvel_body, dtype=float)
        order = np.argsort(moments)
        I, w = moments[order], angvel[order]
        above_separatrix = I[2] * (I[2] - I[1]) * w[2] ** 2 - I[0] * (I[1] - I[0]) * w[0] ** 2
        if len(set(moments)) < 3 or above_separatrix == 0:
            raise ValueError("the closed form wants three different moments and L² ≠ 2 E I2")
        self.order = order if above_separatrix > 0 else order[::-1]
        self.sign = np.linalg.det(np.eye(3)[self.order])
        I1, I2, I3 = moments[self.order]
        w1, w2, w3 = self.sign * angvel[self.order]
        to_third = I1 * (I3 - I1) * w1**2 + I2 * (I3 - I2) * w2**2
        to_first = I2 * (I2 - I1) * w2**2 + I3 * (I3 - I1) * w3**2
        a1, a2 = np.sqrt(to_third / (I1 * (I3 - I1))), np.sqrt(to_third / (I2 * (I3 - I2)))
        a3 = np.copysign(np.sqrt(to_first / (I3 * (I3 - I1))), w3)
        a2 = np.copysign(a2, (I3 - I2) * a3)
        self.amplitude = np.array([a1, a2, a3])
        self.rate = np.sqrt((I3 - I2) * to_first / (I1 * I2 * I3))
        self.complement = abs((I3 - I1) * above_separatrix / ((I3 - I2) * to_first))
        self.phase = 0.0 if to_third == 0 else ellipkinc(np.arctan2(w2 / a2, w1 / a1), 1 - self.complement)

    @property
    def period(self) -> float:
        """Period 4 K(k) / ω_p [s] of the angular velocity in the body frame."""
        return float(4 * ellipkm1(self.complement) / self.rate)

    def angvel_body(self, t: float | np.ndarray) -> np.ndarray:
        """Angular velocity (..., 3) [rad/s], body frame, at time t [s]."""
        sn, cn, dn, _ = ellipj(self.rate * np.asarray(t) + self.phase, 1 - self.complement)
        angvel = np.empty((*np.shape(t), 3))
        angvel[..., self.order] = self.sign * self.amplitude * np.stack([cn, sn, dn], axis=-1)
        return angvel
