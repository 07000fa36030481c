"""Spring and damper from a point of a body to a fixed anchor, and a push at a point of a body.

With e the vector from the anchor to the point, l = |e| and u the velocity of the point,

    F = -(k (l - l0) + c u·e/l) e/l,    energy ½ k (l - l0)².

k is the stiffness, l0 the rest length and c the damping. Where l = 0 the spring does not pull, and the damper has its
limit -c u.

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
SPRING_STIFFNESS = 7  # k [N/m]; 0 in the row of a body that the spring is not attached to
SPRING_DAMPING = 8  # c [N s/m]

# Columns of a push.
PUSH_FORCE = 3  # [N]; 0 in the row of a body that is not pushed
PUSH_IS_BODY_FIXED = 6  # 1: along the body axes, 0: along the world's


@inlined
def spring_vector(state, p):
    """Geometry (arm, e, l) of a spring in the world frame [m], from the body's `FieldState` and the parameters p.

    The arm goes from the centre of mass to the spring's point of the body, e from the anchor to that point; l = |e|.
    """
    arm = qt.matvec(state.R, (p[SPRING_POINT], p[SPRING_POINT + 1], p[SPRING_POINT + 2]))
    e = minus(plus(state.x, arm), (p[SPRING_ANCHOR], p[SPRING_ANCHOR + 1], p[SPRING_ANCHOR + 2]))
    return arm, e, math.sqrt(qt.dot(e, e))


@inlined
def spring_damper_load(arm, e, l, u, p):
    """Force and torque about the centre of mass by a spring with damper, from its (arm, e, l) of `spring_vector`.

    u is the velocity of the body's point relative to the anchor [m/s].
    """
    if l == 0.0:
        return acting_at(arm, times(-p[SPRING_DAMPING], u))
    s = p[SPRING_STIFFNESS] * (l - p[SPRING_LENGTH]) + p[SPRING_DAMPING] * qt.dot(u, e) / l
    return acting_at(arm, times(-s / l, e))


@inlined
def spring(state, p, t):
    """Force and torque about the centre of mass by a spring to an anchor, from a `FieldState` and the parameters p."""
    if p[SPRING_STIFFNESS] == 0.0 and p[SPRING_DAMPING] == 0.0:
        return ZERO, ZERO
    arm, e, l = spring_vector(state, p)
    return spring_damper_load(arm, e, l, velocity_at(state, arm), p)


@inlined
def spring_energy(state, p, t):
    """Potential energy of a spring to a fixed anchor, ½ k (l - l0)² [J]."""
    _, _, l = spring_vector(state, p)
    return 0.5 * p[SPRING_STIFFNESS] * (l - p[SPRING_LENGTH]) * (l - p[SPRING_LENGTH])


@inlined
def mean_spring(states, p, t):
    """Force and torque of a spring over a whole stage: the discrete gradient of its energy (Gonzalez 1996).

    `states` are the `FieldState` at the middle, the start and the end of the stage. Let e⁻ and e⁺ be the vectors along
    the spring at start and end, and l⁻ and l⁺ their lengths. With the means e and l of both, F = -k (1 - l0/l) e does
    exactly the work that the energy loses: F·(e⁺ - e⁻) = ½ k (l⁻ - l0)² - ½ k (l⁺ - l0)², since
    (e⁺ - e⁻)·(e⁺ + e⁻) = l⁺² - l⁻².
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
    """Rates (λ, Ω², γ) of a spring on one body: damping, squared frequency, turning (`implicit_loads`)."""
    if p[SPRING_STIFFNESS] == 0.0 and p[SPRING_DAMPING] == 0.0:
        return ZERO
    force, _ = spring(state, p, 0.0)
    arm, _, _ = spring_vector(state, p)
    w = mobility_bound(arm, state.mass, J)
    return (p[SPRING_DAMPING] * w, p[SPRING_STIFFNESS] * w + arm_frequency_squared(force, arm, J), 0.0)


@inlined
def implicit_spring_stiffness(h, w, e, l, p):
    """Direction of a spring, and its stiffness Z of `implicit_loads` along and across that direction [kg].

    h is the length of the stage, e and l are those of `spring_vector`, and w bounds the mobility of the spring's point,
    or the sum of both points' mobilities [1/kg]. Across the direction the stiffness is k (1 - l0/l), by the tension. A
    compressed spring would have a negative stiffness there; it is taken as 0.
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
    """Soften the loads (acceleration, torque) of a stage of length h by a spring (`implicit_loads`)."""
    if p[SPRING_STIFFNESS] == 0.0 and p[SPRING_DAMPING] == 0.0:
        return loads
    arm, e, l = spring_vector(state, p)
    n, along, across = implicit_spring_stiffness(h, mobility_bound(arm, state.mass, J), e, l, p)
    force, _ = spring(state, p, 0.0)
    loads = soften_at(loads, arm, n, along, across, R, state.mass, J)
    return soften_arm(loads, h, force, arm, R, J)


@inlined
def push_load(state, p, t):
    """Force and torque about the centre of mass by a push: a constant force at a point of the body.

    The force is constant in the world frame, or in the body frame if PUSH_IS_BODY_FIXED is set.
    """
    force = (p[PUSH_FORCE], p[PUSH_FORCE + 1], p[PUSH_FORCE + 2])
    if p[PUSH_IS_BODY_FIXED] != 0.0:
        force = qt.matvec(state.R, force)
    return acting_at(qt.matvec(state.R, (p[SPRING_POINT], p[SPRING_POINT + 1], p[SPRING_POINT + 2])), force)


@inlined
def push_rates(state, p, J, h):
    """Rates (λ, Ω², γ) of a push on one body: damping, squared frequency, turning (`implicit_loads`).

    A force with a fixed direction in the world makes the body swing like a pendulum.
    """
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
    """Soften the loads (acceleration, torque) of a stage of length h by a push (`implicit_loads`)."""
    if p[PUSH_IS_BODY_FIXED] != 0.0:
        return loads
    force, point = (
        (p[PUSH_FORCE], p[PUSH_FORCE + 1], p[PUSH_FORCE + 2]),
        (p[SPRING_POINT], p[SPRING_POINT + 1], p[SPRING_POINT + 2]),
    )
    return soften_arm(loads, h, force, point, R, J)
