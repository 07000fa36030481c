"""Drag of air or water on the velocity of a body.

    F = -(½ ρ C A(u) |u| + c) u,    u = velocity of the geometric centre relative to the air

A(u) is the area of the body's shadow along u. A(u)|u| needs no direction, and is 0 at u = 0:

    block      4 Σ d_j d_k |u_i|                    (each pair of faces under its own angle)
    ellipsoid  π √(Σ (d_j d_k u_i)²)                (sphere: π r² |u|)

with u in body axes. The force acts at the geometric centre.

References
----------
Rayleigh, *On the resistance of fluids*, Phil. Mag. 1876, for the quadratic law; G. G. Stokes 1851 for the linear one;
the shadow of an ellipsoid: G. T. Vickers, *The projected areas of ellipsoids and cylinders*, Powder Technol. 86, 1996.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined
from physics.kernels.forces.force_field_state import acting_at, velocity_at
from physics.kernels.forces.implicit_loads import (
    arm_frequency_squared,
    implicit_share,
    mobility_bound,
    soften_arm,
    soften_at,
)
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, times
from physics.kernels.state.layout import BLOCK, SPHERE

# Columns of the parameters p.
DRAG_STRENGTH = 0  # ½ ρ C [kg/m³]
DRAG_LINEAR = 1  # c [N s/m]


@inlined
def swept_volume_rate(shape, dims, R, u):
    """Volume of air that a body's shadow sweeps per second at the relative velocity u, A(u) |u| [m³/s].

    R is the body's rotation matrix; u is in the world frame.
    """
    if shape == SPHERE:
        return math.pi * dims[0] * dims[0] * math.sqrt(qt.dot(u, u))
    b = qt.transposed_matvec(R, u)
    a = (dims[1] * dims[2] * b[0], dims[2] * dims[0] * b[1], dims[0] * dims[1] * b[2])
    if shape == BLOCK:
        return 4.0 * (abs(a[0]) + abs(a[1]) + abs(a[2]))
    return math.pi * math.sqrt(qt.dot(a, a))


@inlined
def drag(state, p, t):
    """Force and torque about the centre of mass by drag, from a body's `FieldState` and the parameters p."""
    u = minus(velocity_at(state, state.center), state.air)
    k = p[DRAG_STRENGTH] * swept_volume_rate(state.shape, state.dims, state.R, u) + p[DRAG_LINEAR]
    return acting_at(state.center, times(-k, u))


@inlined
def _slopes(state, p):
    """Velocity u of the geometric centre relative to the air, and slopes of the drag force along and across u [N s/m].

    A slope is the change of the force per change of u; for the quadratic part it is twice as large along u.
    """
    u = minus(velocity_at(state, state.center), state.air)
    quadratic = p[DRAG_STRENGTH] * swept_volume_rate(state.shape, state.dims, state.R, u)
    return u, 2.0 * quadratic + p[DRAG_LINEAR], quadratic + p[DRAG_LINEAR]


@inlined
def drag_rates(state, p, J, h):
    """Rates (λ, Ω², γ) of drag on one body: damping, squared frequency, turning (`implicit_loads`)."""
    u, along, across = _slopes(state, p)
    return (
        along * mobility_bound(state.center, state.mass, J),
        arm_frequency_squared(times(across, u), state.center, J),
        0.0,
    )


@inlined
def soften_drag(loads, h, R, state, p, J):
    """Soften the loads (acceleration, torque) of a stage of length h by the damping of drag (`implicit_loads`).

    For quadratic drag along a line the result is exact: v' = v/(1 + h k v/m).
    """
    u, along, across = _slopes(state, p)
    speed = math.sqrt(qt.dot(u, u))
    n = (1.0, 0.0, 0.0)
    if speed > 0.0:
        n = times(1.0 / speed, u)
    s = h * implicit_share(h * along * mobility_bound(state.center, state.mass, J))
    loads = soften_at(loads, state.center, n, s * along, s * across, R, state.mass, J)
    return soften_arm(loads, h, times(across, u), state.center, R, J)
