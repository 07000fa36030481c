"""Spring and damper from a point of a body to a fixed anchor, and a push at a point of a body.

With e the vector from the anchor to the point, l = |e| and u the velocity of the point,

    F = -(k (l - l0) + c u·e/l) e/l,    energy ½ k (l - l0)².

Where l = 0 the direction is that of the velocity (the damper's limit), and the spring does not pull.
"""

from __future__ import annotations

import math

from physics.kernels import quaternion as qt
from physics.kernels.compiler import inlined
from physics.kernels.fields.state import ZERO, acting_at, minus, plus, times, velocity_at

# Columns of a spring.
POINT = 0  # body frame, from the centre of mass [m]
ANCHOR = 3  # world frame [m]
LENGTH = 6  # l0 [m]
STIFFNESS = 7  # k [N/m]; 0 for other bodies than the spring's
DAMPING = 8  # c [N s/m]
SIZE = 9

# Columns of a push.
FORCE = 3  # [N]; 0 for other bodies than the push's
TURNS = 6  # 1: along the body axes, 0: along the world's
PUSH_SIZE = 7


@inlined
def stretch(state, p):
    """Point of the body relative to its centre of mass, vector to it from the anchor, and its length."""
    arm = qt.matvec(state.R, (p[POINT], p[POINT + 1], p[POINT + 2]))
    e = minus(plus(state.x, arm), (p[ANCHOR], p[ANCHOR + 1], p[ANCHOR + 2]))
    return arm, e, math.sqrt(qt.dot(e, e))


@inlined
def spring(state, p, t):
    """(force, torque) of a spring."""
    if p[STIFFNESS] == 0.0 and p[DAMPING] == 0.0:
        return ZERO, ZERO
    arm, e, l = stretch(state, p)
    u = velocity_at(state, arm)
    if l == 0.0:
        return acting_at(arm, times(-p[DAMPING], u))
    s = p[STIFFNESS] * (l - p[LENGTH]) + p[DAMPING] * qt.dot(u, e) / l
    return acting_at(arm, times(-s / l, e))


@inlined
def spring_energy(state, p, t):
    """½ k (l - l0)² [J]."""
    _, _, l = stretch(state, p)
    return 0.5 * p[STIFFNESS] * (l - p[LENGTH]) * (l - p[LENGTH])


@inlined
def push(state, p, t):
    """(force, torque) of a constant force at a point of the body."""
    force = (p[FORCE], p[FORCE + 1], p[FORCE + 2])
    if p[TURNS] != 0.0:
        force = qt.matvec(state.R, force)
    return acting_at(qt.matvec(state.R, (p[POINT], p[POINT + 1], p[POINT + 2])), force)
