"""Spring and damper from a point of a body to a fixed anchor, and a push at a point of a body.

With e the vector from the anchor to the point, l = |e| and u the velocity of the point,

    F = -(k (l - l0) + c u·e/l) e/l,    energy ½ k (l - l0)².

Where l = 0 the direction is that of the velocity (the damper's limit), and the spring does not pull.

References
----------
O. Gonzalez, *Time integration and discrete Hamiltonian systems*, J. Nonlinear Sci. 6, 1996 (discrete gradients).
"""

from __future__ import annotations

import math

from physics.kernels.compile.decorators import inlined
from physics.kernels.forces.force_field_state import ZERO, acting_at, minus, plus, times, velocity_at
from physics.kernels.forces.implicit_loads import arm_square, implicit_share, mobility_bound, soften_arm, soften_at
from physics.kernels.math import quaternion as qt

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
def line_load(arm, e, l, u, p):
    """(force, torque) at a point of velocity u, on a line along e whose length is l."""
    if l == 0.0:
        return acting_at(arm, times(-p[DAMPING], u))
    s = p[STIFFNESS] * (l - p[LENGTH]) + p[DAMPING] * qt.dot(u, e) / l
    return acting_at(arm, times(-s / l, e))


@inlined
def spring(state, p, t):
    """(force, torque) of a spring."""
    if p[STIFFNESS] == 0.0 and p[DAMPING] == 0.0:
        return ZERO, ZERO
    arm, e, l = stretch(state, p)
    return line_load(arm, e, l, velocity_at(state, arm), p)


@inlined
def spring_energy(state, p, t):
    """½ k (l - l0)² [J]."""
    _, _, l = stretch(state, p)
    return 0.5 * p[STIFFNESS] * (l - p[LENGTH]) * (l - p[LENGTH])


@inlined
def mean_spring(states, p, t):
    """(force, torque) of a spring between two states: the discrete gradient of its energy (Gonzalez 1996).

    With e the mean of the vectors at both ends and l the mean of their lengths, F = -k (1 - l0/l) e does just what the
    energy loses, F·(e1 - e0) = ½ k (l_0 - l0)² - ½ k (l_1 - l0)², since (e1 - e0)·(e1 + e0) = l_1² - l_0².
    """
    if p[STIFFNESS] == 0.0 and p[DAMPING] == 0.0:
        return ZERO, ZERO
    middle, first, last = states
    before, after = stretch(first, p), stretch(last, p)
    arm, e = times(0.5, plus(before[0], after[0])), times(0.5, plus(before[1], after[1]))
    l = 0.5 * (before[2] + after[2])
    return line_load(arm, e, l, velocity_at(middle, arm), p)


@inlined
def spring_rates(state, p, J, h):
    """Rates of `implicit_loads`."""
    if p[STIFFNESS] == 0.0 and p[DAMPING] == 0.0:
        return ZERO
    force, _ = spring(state, p, 0.0)
    arm, _, _ = stretch(state, p)
    w = mobility_bound(arm, state.mass, J)
    return (p[DAMPING] * w, p[STIFFNESS] * w + arm_square(force, arm, J), 0.0)


@inlined
def line_stiffness(h, w, e, l, p):
    """Direction of a spring, and Z of `implicit_loads` along it and across [kg]; w the mobility of its points [1/kg].

    Across the line it is as stiff as it is tight, k (1 - l0/l); a spring that pushes would push over, which is left
    out.
    """
    spring, damper = 0.25 * h * h * p[STIFFNESS], h * implicit_share(h * p[DAMPING] * w) * p[DAMPING]
    if l == 0.0:
        return (1.0, 0.0, 0.0), spring + damper, spring + damper
    return times(1.0 / l, e), spring + damper, spring * max(1.0 - p[LENGTH] / l, 0.0)


@inlined
def soften_spring(loads, h, R, state, p, J):
    """Loads as `implicit_loads` has them."""
    if p[STIFFNESS] == 0.0 and p[DAMPING] == 0.0:
        return loads
    arm, e, l = stretch(state, p)
    n, along, across = line_stiffness(h, mobility_bound(arm, state.mass, J), e, l, p)
    force, _ = spring(state, p, 0.0)
    loads = soften_at(loads, arm, n, along, across, R, state.mass, J)
    return soften_arm(loads, h, force, arm, R, J)


@inlined
def push(state, p, t):
    """(force, torque) of a constant force at a point of the body."""
    force = (p[FORCE], p[FORCE + 1], p[FORCE + 2])
    if p[TURNS] != 0.0:
        force = qt.matvec(state.R, force)
    return acting_at(qt.matvec(state.R, (p[POINT], p[POINT + 1], p[POINT + 2])), force)


@inlined
def push_rates(state, p, J, h):
    """Rates of `implicit_loads`: a force along the world's axes swings the body."""
    if p[TURNS] != 0.0:
        return ZERO
    return (0.0, arm_square((p[FORCE], p[FORCE + 1], p[FORCE + 2]), (p[POINT], p[POINT + 1], p[POINT + 2]), J), 0.0)


@inlined
def soften_push(loads, h, R, state, p, J):
    """Loads as `implicit_loads` has them."""
    if p[TURNS] != 0.0:
        return loads
    force, point = (p[FORCE], p[FORCE + 1], p[FORCE + 2]), (p[POINT], p[POINT + 1], p[POINT + 2])
    return soften_arm(loads, h, force, point, R, J)
