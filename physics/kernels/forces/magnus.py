"""Magnus lift: the force on a spinning body, perpendicular to its velocity.

    F = ½ ρ C π r³ ω x u,    u = velocity relative to the air,  r = (d1 d2 d3)^(1/3)

r is the geometric mean of the body's half extents d1, d2 and d3. C is the lift coefficient, ρ the density of the air.
The force acts at the centre of mass.

References
----------
S. I. Rubinow, J. B. Keller, *The transverse force on a spinning sphere moving in a viscous fluid*, J. Fluid Mech. 11,
1961: C = 2 at small Reynolds numbers. A. M. Nathan, *The effect of spin on the flight of a baseball*, Am. J. Phys. 76,
2008: about 1 for sports balls.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined
from physics.kernels.forces.force_field_state import ZERO
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, times

# Columns of the parameters p.
MAGNUS_STRENGTH = 0  # ½ ρ C [kg/m³]


@inlined
def magnus(state, p, t):
    """Force and torque about the centre of mass by Magnus lift, from a body's `FieldState` and the parameters p."""
    d = state.dims
    u = minus(state.v, state.air)
    return times(p[MAGNUS_STRENGTH] * math.pi * d[0] * d[1] * d[2], qt.cross(state.w, u)), ZERO


@inlined
def _turning(state, p):
    """Angular velocity vector at which the lift turns the velocity of the body [rad/s]."""
    d = state.dims
    return times(p[MAGNUS_STRENGTH] * math.pi * d[0] * d[1] * d[2] / state.mass, state.w)


@inlined
def magnus_rates(state, p, J, h):
    """Rates (λ, Ω², γ) of Magnus lift on one body: damping, squared frequency, turning (`implicit_loads`)."""
    b = _turning(state, p)
    return (0.0, 0.0, math.sqrt(qt.dot(b, b)))


@inlined
def soften_magnus(loads, h, R, state, p, J):
    """Soften the loads (acceleration a, torque) of a stage of length h by the implicit midpoint rule of Magnus lift.

    The rule keeps the speed. With the vector b, half of the angle by which the lift turns the velocity in h, the new
    acceleration a' solves a' - b x a' = a; the torque stays as it is.
    """
    a, T = loads
    b = times(0.5 * h, _turning(state, p))
    x = plus(a, plus(qt.cross(b, a), times(qt.dot(b, a), b)))
    return times(1.0 / (1.0 + qt.dot(b, b)), x), T
