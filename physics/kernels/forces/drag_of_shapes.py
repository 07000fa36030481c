"""Drag of any body: the law of `drag`, in scenes with hulls, capsules, cylinders or compounds.

Shadows A(u)|u|, with u in the axes of the body, and axis y of a round one:

    hull        ½ Σ |a·u| over its triangles, a normal to each with its area as length     (Cauchy)
    capsule     π r² |u| + 2 r l √(u_x² + u_z²)       (radius r, length l of its cylinder)
    cylinder    π r² |u_y| + 2 r h √(u_x² + u_z²)     (height h)

Each part of a compound has the drag of a body of its own, at its own centre and with the velocity there. Parts do not
shelter each other. The linear part acts at the geometric centre of a body, of a compound at its centre of mass.

References
----------
A. Cauchy, *Mémoire sur la rectification des courbes et la quadrature des surfaces courbes*, 1850.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.forces.body_shapes import is_whole, part_count, read_part, triangle, triangle_range
from physics.kernels.forces.drag import DRAG_LINEAR, DRAG_STRENGTH, swept_volume_rate
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
from physics.kernels.state.layout import CAPSULE, CYLINDER, HULL

# Column of the parameters p at which the shapes begin.
DRAG_SHAPES = 2


@kernel
def _swept_by_triangles(i, u, p, first):
    """A(u)|u| of a hull [m³/s], with u in its axes."""
    total = 0.0
    begin, end = triangle_range(i, p, first)
    for k in range(begin, end, 9):
        a, b, c = triangle(p, k)
        total += abs(qt.dot(qt.cross(minus(b, a), minus(c, a)), u))
    return 0.25 * total


@inlined
def swept_by_part(i, part, u, p, first):
    """Volume of air that the shadow of part i sweeps per second at the relative velocity u, A(u)|u| [m³/s].

    `part` is that of `body_shapes.read_part`; u is in the world frame.
    """
    shape, dims, R, _ = part
    if shape != HULL and shape != CAPSULE and shape != CYLINDER:
        return swept_volume_rate(shape, dims, R, u)
    b = qt.transposed_matvec(R, u)
    if shape == HULL:
        return _swept_by_triangles(i, b, p, first)
    r, across = dims[0], math.sqrt(b[0] * b[0] + b[2] * b[2])
    if shape == CYLINDER:
        return math.pi * r * r * abs(b[1]) + 4.0 * r * dims[1] * across
    return math.pi * r * r * math.sqrt(qt.dot(b, b)) + 4.0 * r * (dims[1] - r) * across


@inlined
def _point_count(p):
    """Number of points at which drag acts: one, or the parts of a compound and its centre of mass."""
    return 1 if is_whole(p, DRAG_SHAPES) else part_count(p, DRAG_SHAPES) + 1


@inlined
def _point(i, state, p):
    """Point i at which drag acts: (arm [m], velocity u relative to the air [m/s], quadratic and linear part of k).

    The arm is from the centre of mass. The force is -k u, the parts of k are in kg/s.
    """
    if i == part_count(p, DRAG_SHAPES):
        return ZERO, minus(state.v, state.air), 0.0, p[DRAG_LINEAR]
    part = read_part(i, state, p, DRAG_SHAPES)
    u = minus(velocity_at(state, part[3]), state.air)
    linear = p[DRAG_LINEAR] if is_whole(p, DRAG_SHAPES) else 0.0
    return part[3], u, p[DRAG_STRENGTH] * swept_by_part(i, part, u, p, DRAG_SHAPES), linear


@kernel
def drag_of_shapes(state, p, t):
    """Force and torque about the centre of mass by drag, from a body's `FieldState` and the parameters p."""
    force, torque = ZERO, ZERO
    for i in range(_point_count(p)):
        arm, u, quadratic, linear = _point(i, state, p)
        f, m = acting_at(arm, times(-(quadratic + linear), u))
        force, torque = plus(force, f), plus(torque, m)
    return force, torque


@kernel
def rates_of_shapes(state, p, J, h):
    """Rates (λ, Ω², γ) of drag on one body: damping, squared frequency, turning (`implicit_loads`)."""
    damping = square = 0.0
    for i in range(_point_count(p)):
        arm, u, quadratic, linear = _point(i, state, p)
        damping += (2.0 * quadratic + linear) * mobility_bound(arm, state.mass, J)
        square += arm_frequency_squared(times(quadratic + linear, u), arm, J)
    return (damping, square, 0.0)


@kernel
def soften_drag_of_shapes(loads, h, R, state, p, J):
    """Soften the loads (acceleration, torque) of a stage of length h by the damping of drag, point by point."""
    for i in range(_point_count(p)):
        arm, u, quadratic, linear = _point(i, state, p)
        along, across, speed = 2.0 * quadratic + linear, quadratic + linear, math.sqrt(qt.dot(u, u))
        n = (1.0, 0.0, 0.0)
        if speed > 0.0:
            n = times(1.0 / speed, u)
        s = h * implicit_share(h * along * mobility_bound(arm, state.mass, J))
        loads = soften_at(loads, arm, n, s * along, s * across, R, state.mass, J)
        loads = soften_arm(loads, h, times(across, u), arm, R, J)
    return loads
