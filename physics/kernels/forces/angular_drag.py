"""Drag of the air on the rotation of a body: T = -(c + d |ω|) ω, about the centre of mass.

References
----------
G. Kirchhoff 1876 for the linear law of a slowly turning sphere, c = 8π η r³.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined
from physics.kernels.forces.force_field_state import ZERO
from physics.kernels.forces.implicit_loads import implicit_share
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import times

# Columns of the parameters p.
ANGULAR_DRAG_LINEAR = 0  # c [N m s]
ANGULAR_DRAG_QUADRATIC = 1  # d [N m s²]


@inlined
def angular_drag(state, p, t):
    """Force (zero) and torque by drag on the rotation of a body, from its `FieldState` and the parameters p."""
    w = state.w
    return ZERO, times(-(p[ANGULAR_DRAG_LINEAR] + p[ANGULAR_DRAG_QUADRATIC] * math.sqrt(qt.dot(w, w))), w)


@inlined
def _slope(state, p):
    """Slope of the drag torque: its change per change of the angular speed |ω| [N m s]."""
    return p[ANGULAR_DRAG_LINEAR] + 2.0 * p[ANGULAR_DRAG_QUADRATIC] * math.sqrt(qt.dot(state.w, state.w))


@inlined
def angular_drag_rates(state, p, J, h):
    """Rates (λ, Ω², γ) of angular drag on one body: damping, squared frequency, turning (`implicit_loads`)."""
    return (_slope(state, p) * max(J[0], J[1], J[2]), 0.0, 0.0)


@inlined
def soften_angular_drag(loads, h, R, state, p, J):
    """Soften the torque of the loads of a stage of length h by angular drag, for each principal axis alone."""
    a, T = loads
    z, m = h * _slope(state, p), qt.transposed_matvec(R, T)
    m = (
        m[0] / (1.0 + implicit_share(z * J[0]) * z * J[0]),
        m[1] / (1.0 + implicit_share(z * J[1]) * z * J[1]),
        m[2] / (1.0 + implicit_share(z * J[2]) * z * J[2]),
    )
    return a, qt.matvec(R, m)
