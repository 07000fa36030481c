"""Drag on the spin: T = -(c + d |ω|) ω, about the centre of mass.

References
----------
G. Kirchhoff 1876 for the linear law of a slowly turning sphere, c = 8π η r³.
"""

from __future__ import annotations

import math

from physics.kernels import quaternion as qt
from physics.kernels.compiler import inlined
from physics.kernels.fields.state import ZERO, times

# Columns.
LINEAR = 0  # c [N m s]
QUADRATIC = 1  # d [N m s²]
SIZE = 2


@inlined
def angular_drag(state, p, t):
    """(force, torque) of the drag on the spin."""
    w = state.w
    return ZERO, times(-(p[LINEAR] + p[QUADRATIC] * math.sqrt(qt.dot(w, w))), w)
