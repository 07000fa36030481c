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

from physics.compiler.decorators import inlined
from physics.kernels.forces.force_field_state import ZERO, acting_at, velocity_at
from physics.kernels.forces.implicit_loads import (
    arm_frequency_squared,
    implicit_share,
    mobility_bound,
    soften_arm,
    soften_at,
)
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, times

# Columns of a spring.
SPRING_POINT = 0  # body frame, from the centre of mass [m]
SPRING_ANCHOR = 3  # world frame [m]
SPRING_LENGTH = 6  # l0 [m]
SPRING_STIFFNESS = 7  # k [N/m]; 0 for other bodies than the spring's
SPRING_DAMPING = 8  # c [N s/m]

# Columns of a push.
PUSH_FORCE = 3  # [N]; 0 for other bodies than the push's
PUSH_IS_BODY_FIXED = 6  # 1: along the body axes, 0: along the world's


@inlined
def spring_vector(state, p):
    """Point of the body relative to its centre of mass, vector to it from the anchor, and its length."""
    arm = qt.matvec(state.R, (p[SPRING_POINT], p[SPRING_POINT + 1], p[SPRING_POINT + 2]))
    e = minus(plus(state.x, arm), (p[SPRING_ANCHOR], p[SPRING_ANCHOR + 1], p[SPRING_ANCHOR + 2]))
    return arm, e, math.sqrt(qt.dot(e, e))


@inlined
def spring_damper_load(arm, e, l, u, p):
    """(force, torque) at a point with velocity u, on a line along e of length l."""
    if l == 0.0:
        return acting_at(arm, times(-p[SPRING_DAMPING], u))
    s = p[SPRING_STIFFNESS] * (l - p[SPRING_LENGTH]) + p[SPRING_DAMPING] * qt.dot(u, e) / l
    return acting_at(arm, times(-s / l, e))


@inlined
def spring(state, p, t):
    """(force, torque) of a spring."""
    if p[SPRING_STIFFNESS] == 0.0 and p[SPRING_DAMPING] == 0.0:
        return ZERO, ZERO
    arm, e, l = spring_vector(state, p)
    return spring_damper_load(arm, e, l, velocity_at(state, arm), p)


@inlined
def spring_energy(state, p, t):
    """½ k (l - l0)² [J]."""
    _, _, l = spring_vector(state, p)
    return 0.5 * p[SPRING_STIFFNESS] * (l - p[SPRING_LENGTH]) * (l - p[SPRING_LENGTH])


@inlined
def mean_spring(states, p, t):
    """(force, torque) of a spring between two states: the discrete gradient of its energy (Gonzalez 1996).

    With e the mean of the vectors at both ends and l the mean of their lengths, F = -k (1 - l0/l) e does exactly the
    work that the energy loses, F·(e1 - e0) = ½ k (l_0 - l0)² - ½ k (l_1 - l0)², since (e1 - e0)·(e1 + e0) = l_1² -
    l_0².
    """
    if p[SPRING_STIFFNESS] == 0.0 and p[SPRING_DAMPING] == 0.0:
        return ZERO, ZERO
    middle, first, last = states
    before, after = spring_vector(first, p), spring_vector(last, p)
    arm, e = times(0.5, plus(before[0], after[0])), times(0.5, plus(before[1], after[1]))
    l = 0.5 * (before[2] + after[2])
    return spring_damper_load(arm, e, l, velocity_at(middle, arm), p)


@inlined
def spring_rates(state, p, J, h):
    """Rates of `implicit_loads`."""
    if p[SPRING_STIFFNESS] == 0.0 and p[SPRING_DAMPING] == 0.0:
        return ZERO
    force, _ = spring(state, p, 0.0)
    arm, _, _ = spring_vector(state, p)
    w = mobility_bound(arm, state.mass, J)
    return (p[SPRING_DAMPING] * w, p[SPRING_STIFFNESS] * w + arm_frequency_squared(force, arm, J), 0.0)


@inlined
def implicit_spring_stiffness(h, w, e, l, p):
    """Direction of a spring, and Z of `implicit_loads` along and across it [kg]; w is its points' mobility [1/kg].

    Across the line the stiffness is that of its tension, k (1 - l0/l). A compressed spring would have a negative one,
    which is left out.
    """
    spring, damper = (
        0.25 * h * h * p[SPRING_STIFFNESS],
        h * implicit_share(h * p[SPRING_DAMPING] * w) * p[SPRING_DAMPING],
    )
    if l == 0.0:
        return (1.0, 0.0, 0.0), spring + damper, spring + damper
    return times(1.0 / l, e), spring + damper, spring * max(1.0 - p[SPRING_LENGTH] / l, 0.0)


@inlined
def soften_spring(loads, h, R, state, p, J):
    """Softened loads of `implicit_loads`."""
    if p[SPRING_STIFFNESS] == 0.0 and p[SPRING_DAMPING] == 0.0:
        return loads
    arm, e, l = spring_vector(state, p)
    n, along, across = implicit_spring_stiffness(h, mobility_bound(arm, state.mass, J), e, l, p)
    force, _ = spring(state, p, 0.0)
    loads = soften_at(loads, arm, n, along, across, R, state.mass, J)
    return soften_arm(loads, h, force, arm, R, J)


@inlined
def push_load(state, p, t):
    """(force, torque) of a constant force at a point of the body."""
    force = (p[PUSH_FORCE], p[PUSH_FORCE + 1], p[PUSH_FORCE + 2])
    if p[PUSH_IS_BODY_FIXED] != 0.0:
        force = qt.matvec(state.R, force)
    return acting_at(qt.matvec(state.R, (p[SPRING_POINT], p[SPRING_POINT + 1], p[SPRING_POINT + 2])), force)


@inlined
def push_rates(state, p, J, h):
    """Rates of `implicit_loads`: a force with a fixed direction in the world makes the body swing like a pendulum."""
    if p[PUSH_IS_BODY_FIXED] != 0.0:
        return ZERO
    return (
        0.0,
        arm_frequency_squared(
            (p[PUSH_FORCE], p[PUSH_FORCE + 1], p[PUSH_FORCE + 2]),
            (p[SPRING_POINT], p[SPRING_POINT + 1], p[SPRING_POINT + 2]),
            J,
        ),
        0.0,
    )


@inlined
def soften_push(loads, h, R, state, p, J):
    """Softened loads of `implicit_loads`."""
    if p[PUSH_IS_BODY_FIXED] != 0.0:
        return loads
    force, point = (
        (p[PUSH_FORCE], p[PUSH_FORCE + 1], p[PUSH_FORCE + 2]),
        (p[SPRING_POINT], p[SPRING_POINT + 1], p[SPRING_POINT + 2]),
    )
    return soften_arm(loads, h, force, point, R, J)
