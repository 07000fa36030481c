"""Frictionless impacts of one body at one moment, plain NumPy: all contacts at once, or one after the other.

Normal velocities u = J V of the contacts, V the body's generalised velocity with mass matrix M; an impulse p ≥ 0
changes V by M⁻¹ Jᵀ p. Newton's law asks for u⁺ = -e u⁻ of one contact. Moreau's, of many: 0 ≤ p ⟂ u⁺ + e u⁻ ≥ 0, again
and again while one approaches. It changes the energy by ½ pᵀ(u⁺ + u⁻) = ½ (1 - e) pᵀu⁻, where
-(1 + e) pᵀu⁻ = pᵀW p ≥ 0.
"""

from __future__ import annotations

from itertools import product

import numpy as np


def simultaneous(J, M, V, e, still=0.0, most=100):
    """Velocity after impacts of all contacts at once, until none approaches faster than `still` [m/s]."""
    response = np.linalg.solve(M, J.T)
    for _ in range(most):
        u = J @ V
        if (u >= -still).all():
            return V
        V = V + response @ _impulses(J @ response, (1 + e) * u)
    raise ArithmeticError(f"contacts still approach after {most} impacts")


def _impulses(W, b):
    """p of 0 ≤ p ⟂ W p + b ≥ 0, by enumeration; of several the one of least norm among its own contacts."""
    slack = 1e-12 * np.abs(b).max()
    for pushes in product((False, True), repeat=len(b)):
        on = np.array(pushes)
        p = np.zeros(len(b))
        p[on] = np.linalg.lstsq(W[np.ix_(on, on)], -b[on], rcond=None)[0]
        if (p >= -slack).all() and (W @ p + b >= -slack).all():
            return p
    raise ArithmeticError("no set of contacts pushes")


def sequential(J, M, V, e, still=0.0, most=10_000):
    """Velocity after one at a time, the fastest approach first, until none is faster than `still` [m/s]."""
    response = np.linalg.solve(M, J.T)
    for _ in range(most):
        u = J @ V
        first = int(np.argmin(u))
        if u[first] >= -still:
            return V
        V = V - response[:, first] * (1 + e) * u[first] / (J[first] @ response[:, first])
    raise ArithmeticError(f"contacts still approach after {most} impacts")


def normal_rows(normals, arms):
    """Rows (n, r x n) of the contact Jacobian."""
    return np.hstack([normals, np.cross(arms, normals)])
