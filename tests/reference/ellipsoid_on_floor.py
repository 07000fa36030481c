"""An ellipsoid that keeps touching the floor y = 0, and the push of the floor: by DOP853, no kernel of the engine.

The contact point is r = -R D e/|e| from the centre, e = D Rᵀn with the half-axes D and n = (0, 1, 0). With its velocity
u = v + ω x r and u' = v' + ω' x r + ω x r' the forces f follow from

    smooth    u'·n = 0,  f = f_n n,
    slides    u'·n = 0,  f = f_n (n - μ u_t/|u_t|),
    rolls     u' = 0,    f of any direction.

A contact keeps touching where f_n > 0, and keeps rolling where |f_t| < μ f_n.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from tests.reference.rigid_body import quaternion_product, rotation_matrix

SMOOTH, SLIDES, ROLLS = "smooth", "slides", "rolls"
NORMAL = np.array([0.0, 1.0, 0.0])
RTOL = 1e-12


class Motion(NamedTuple):
    """Samples of a motion in touch with the floor."""

    t: np.ndarray  # (samples,) [s]
    pos: np.ndarray  # (samples, 3) [m]
    quat: np.ndarray  # (samples, 4)
    linvel: np.ndarray  # (samples, 3) [m/s]
    angvel: np.ndarray  # (samples, 3) [rad/s]
    push: np.ndarray  # (samples,) normal force [N]
    grip: np.ndarray  # (samples,) tangential over normal force


def contact_point(axes, R):
    """(3,) lowest point of the ellipsoid from its centre, world frame [m]."""
    e = axes * (R.T @ NORMAL)
    return -R @ (axes * e) / np.linalg.norm(e)


def contact_rate(axes, R, omega):
    """(3,) velocity at which the lowest point moves, less the centre's [m/s].

    By the quotient rule: with m = Rᵀn, m' = m x Rᵀω, e = D m the point is c = -D e/|e| in the body, r' = ω x r + R c'.
    """
    m, w = R.T @ NORMAL, R.T @ omega
    e, de = axes * m, axes * np.cross(m, w)
    s = np.linalg.norm(e)
    dc = -axes * (de / s - e * (e @ de) / s**3)
    return np.cross(omega, contact_point(axes, R)) + R @ dc


def forces(axes, mass, moments, gravity, mu, mode, state):
    """(v', ω', f) of a state (x, q, v, ω): accelerations and the force of the floor [N]."""
    R, v, omega = rotation_matrix(state[3:7]), state[7:10], state[10:13]
    inverse = R @ np.diag(1.0 / moments) @ R.T
    r = contact_point(axes, R)
    cross = np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
    A = np.eye(3) / mass - cross @ inverse @ cross
    spin = inverse @ -np.cross(omega, R @ (moments * (R.T @ omega)))
    b = np.array([0.0, -gravity, 0.0]) + np.cross(spin, r) + np.cross(omega, contact_rate(axes, R, omega))
    if mode == ROLLS:
        f = np.linalg.solve(A, -b)
    else:
        along = NORMAL
        if mode == SLIDES:
            slip = v + np.cross(omega, r)
            slip[1] = 0.0
            along = NORMAL - mu * slip / np.linalg.norm(slip)
        f = -b[1] / (A @ along)[1] * along
    return np.array([0.0, -gravity, 0.0]) + f / mass, spin + inverse @ np.cross(r, f), f


def move(body, mode, times, gravity=9.81, mu=0.0):
    """`Motion` of an Ellipsoid of the engine from its start, which touches the floor, at `times` [s].

    It is what happens as long as `push` stays positive (and `grip` below the coefficient of friction where it rolls).
    """
    axes, mass, moments = np.array(body.semi_axes), body.mass, np.diag(body.inertia)

    def rate(t, y):
        dv, dw, _ = forces(axes, mass, moments, gravity, mu, mode, y)
        return np.concatenate([y[7:10], 0.5 * quaternion_product(np.array([0.0, *y[10:13]]), y[3:7]), dv, dw])

    start = np.concatenate([body.pos, body.quat, body.linvel, body.angvel])
    run = solve_ivp(rate, (0.0, times[-1]), start, "DOP853", t_eval=times, rtol=RTOL, atol=1e-13)
    f = np.array([forces(axes, mass, moments, gravity, mu, mode, y)[2] for y in run.y.T])
    quat = run.y[3:7].T / np.linalg.norm(run.y[3:7].T, axis=1, keepdims=True)
    grip = np.hypot(f[:, 0], f[:, 2]) / f[:, 1]
    return Motion(run.t, run.y[:3].T, quat, run.y[7:10].T, run.y[10:13].T, f[:, 1], grip)
