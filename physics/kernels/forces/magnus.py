"""Magnus lift: the force on a spinning body, perpendicular to its velocity.

    F = ½ ρ C π r³ ω x u,    u = velocity relative to the air,  r = (d1 d2 d3)^(1/3)

r is the radius of the sphere of the same extent. It acts at the centre of mass.

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

# Columns.
MAGNUS_STRENGTH = 0  # ½ ρ C [kg/m³]


@inlined
def magnus(state, p, t):
    """(force, torque) of the lift."""
    d = state.dims
    u = minus(state.v, state.air)
    return times(p[MAGNUS_STRENGTH] * math.pi * d[0] * d[1] * d[2], qt.cross(state.w, u)), ZERO


@inlined
def _turning(state, p):
    """Angular velocity at which the lift turns the velocity [rad/s]."""
    d = state.dims
    return times(p[MAGNUS_STRENGTH] * math.pi * d[0] * d[1] * d[2] / state.mass, state.w)


@inlined
def magnus_rates(state, p, J, h):
    """Rates of `implicit_loads`."""
    b = _turning(state, p)
    return (0.0, 0.0, math.sqrt(qt.dot(b, b)))


@inlined
def soften_magnus(loads, h, R, state, p, J):
    """Loads by the implicit midpoint rule, which keeps the speed: solve x - b x x = a, b half the turn in h."""
    a, T = loads
    b = times(0.5 * h, _turning(state, p))
    x = plus(a, plus(qt.cross(b, a), times(qt.dot(b, a), b)))
    return times(1.0 / (1.0 + qt.dot(b, b)), x), T
