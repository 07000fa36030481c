"""Buoyancy of any body: the law of `buoyancy`, in scenes with hulls, capsules, cylinders or compounds.

*Hull*: the part below the plane consists of cones with a common tip, a point of the plane, over the wet parts of its
triangles (`submerged_volume`). *Capsule, cylinder*: `wet_revolution`. *Compound*: the sum over its parts; where parts
overlap, the fluid counts twice, as the mass does.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.forces.body_shapes import (
    BOUND,
    VOLUME,
    VOLUME_OFFSET,
    is_whole,
    part_count,
    read_part,
    triangle,
    triangle_range,
)
from physics.kernels.forces.buoyancy import FLUID_NORMAL, FLUID_OFFSET, FLUID_WEIGHT
from physics.kernels.forces.force_field_state import ZERO, acting_at
from physics.kernels.forces.implicit_loads import soften_at
from physics.kernels.forces.submerged_volume import submerged_part
from physics.kernels.forces.wet_revolution import wet_revolution
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, times
from physics.kernels.state.layout import BLOCK, CAPSULE, CYLINDER, HULL

# Column of the parameters p at which the shapes begin.
FLUID_SHAPES = 5


@inlined
def _cone(a, b, c, tip):
    """Volume of the tetrahedron of a triangle and the point `tip` [m³], and the volume times its centre [m⁴]."""
    volume = qt.dot(minus(a, tip), qt.cross(minus(b, tip), minus(c, tip))) / 6.0
    return volume, times(0.25 * volume, plus(plus(a, b), plus(c, tip)))


@inlined
def _cut(a, b, above_a, above_b):
    """Point at which the edge from a to b meets the plane, from the heights of both ends."""
    return plus(a, times(above_a / (above_a - above_b), minus(b, a)))


@kernel
def _wet_triangle(a, b, c, n, height, tip):
    """Cone over the part of a triangle below the plane n·x = -height, as `_cone` has it."""
    ha, hb, hc = qt.dot(n, a) + height, qt.dot(n, b) + height, qt.dot(n, c) + height
    wet = (1 if ha <= 0.0 else 0) + (1 if hb <= 0.0 else 0) + (1 if hc <= 0.0 else 0)
    if wet == 0:
        return 0.0, ZERO
    if wet == 3:
        return _cone(a, b, c, tip)
    # Turn the corners so that a is the only one on its side.
    if (hb <= 0.0) == (wet == 1):
        a, b, c, ha, hb, hc = b, c, a, hb, hc, ha
    elif (hc <= 0.0) == (wet == 1):
        a, b, c, ha, hb, hc = c, a, b, hc, ha, hb
    p, q = _cut(a, b, ha, hb), _cut(a, c, ha, hc)
    if wet == 1:
        return _cone(a, p, q, tip)
    volume, moment = _cone(p, b, c, tip)
    more, further = _cone(p, c, q, tip)
    return volume + more, plus(moment, further)


@kernel
def _wet_hull(i, n, height, p):
    """Volume of the part of hull i below the plane n·x = -height, and its centre, in its axes; see `submerged_part`."""
    tip = times(-height, n)
    volume, moment = 0.0, ZERO
    begin, end = triangle_range(i, p, FLUID_SHAPES)
    for k in range(begin, end, 9):
        a, b, c = triangle(p, k)
        v, m = _wet_triangle(a, b, c, n, height, tip)
        volume, moment = volume + v, plus(moment, m)
    return volume, times(1.0 / volume, moment) if volume > 0.0 else ZERO


@inlined
def _wet_part(i, state, p):
    """Submerged part of part i of a body: (volume [m³], its centre from the centre of mass [m], height above it [m]).

    The centre is in the world frame; its height is above the surface, negative below it.
    """
    up = (p[FLUID_NORMAL], p[FLUID_NORMAL + 1], p[FLUID_NORMAL + 2])
    shape, dims, R, place = read_part(i, state, p, FLUID_SHAPES)
    height = qt.dot(up, plus(state.x, place)) - p[FLUID_OFFSET]
    n = qt.transposed_matvec(R, up)
    if shape == HULL:
        volume, centre = _wet_hull(i, n, height, p)
    elif shape == CAPSULE:
        volume, centre = wet_revolution(dims[0], dims[1] - dims[0], True, n, height)
    elif shape == CYLINDER:
        volume, centre = wet_revolution(dims[0], dims[1], False, n, height)
    else:
        volume, centre = submerged_part(shape, dims, n, height)
    r = qt.matvec(R, centre)
    return volume, plus(place, r), height + qt.dot(up, r)


@kernel
def buoyancy_of_shapes(state, p, t):
    """Force and torque about the centre of mass by buoyancy, from a body's `FieldState` and the parameters p."""
    up = (p[FLUID_NORMAL], p[FLUID_NORMAL + 1], p[FLUID_NORMAL + 2])
    force, torque = ZERO, ZERO
    for i in range(part_count(p, FLUID_SHAPES)):
        volume, arm, _ = _wet_part(i, state, p)
        f, m = acting_at(arm, times(p[FLUID_WEIGHT] * volume, up))
        force, torque = plus(force, f), plus(torque, m)
    return force, torque


@kernel
def energy_of_shapes(state, p, t):
    """Potential energy of buoyancy: ρ g V times the depth of the submerged part's centre [J], over all parts."""
    energy = 0.0
    for i in range(part_count(p, FLUID_SHAPES)):
        volume, _, height = _wet_part(i, state, p)
        energy -= p[FLUID_WEIGHT] * volume * height
    return energy


@kernel
def _largest_section(i, state, p):
    """Upper bound of the area of any plane section of part i [m²]: that of its largest shadow."""
    shape, d, _, _ = read_part(i, state, p, FLUID_SHAPES)
    if shape == HULL:
        area = 0.0
        begin, end = triangle_range(i, p, FLUID_SHAPES)
        for k in range(begin, end, 9):
            a, b, c = triangle(p, k)
            m = qt.cross(minus(b, a), minus(c, a))
            area += 0.25 * math.sqrt(qt.dot(m, m))
        return area
    if shape == CAPSULE:
        return math.pi * d[0] * d[0] + 4.0 * d[0] * (d[1] - d[0])
    if shape == CYLINDER:
        return d[0] * math.sqrt((math.pi * d[0]) ** 2 + 16.0 * d[1] * d[1])
    a = (d[1] * d[2], d[2] * d[0], d[0] * d[1])
    size = math.sqrt(qt.dot(a, a))
    return 4.0 * size if shape == BLOCK else math.pi * size


@inlined
def _squares(state, p, J, h):
    """Squared frequencies with which a floating body heaves and rolls at most [1/s²], as those of `buoyancy`.

    The ratio of second moments is again 5/4 at most for uniform bodies. The distance c of the centre of the volume V
    from that of mass adds ρ g V c J. V is at most 2 A R, with the bound R of the body; that of a compound is known.
    """
    c = math.sqrt(qt.dot(state.center, state.center))
    bound = max(p[FLUID_SHAPES + BOUND], math.sqrt(qt.dot(state.dims, state.dims)) + c)
    height = qt.dot((p[FLUID_NORMAL], p[FLUID_NORMAL + 1], p[FLUID_NORMAL + 2]), state.x) - p[FLUID_OFFSET]
    if abs(height) > bound + 0.5 * h * math.sqrt(qt.dot(state.v, state.v)):
        return 0.0, 0.0
    area = 0.0
    for i in range(part_count(p, FLUID_SHAPES)):
        area += _largest_section(i, state, p)
    heave = p[FLUID_WEIGHT] * area / state.mass
    volume = 2.0 * area * bound if is_whole(p, FLUID_SHAPES) else p[FLUID_SHAPES + VOLUME]
    moment = p[FLUID_WEIGHT] * volume * max(p[FLUID_SHAPES + VOLUME_OFFSET], c)
    return heave, 1.25 * heave + moment * max(J[0], J[1], J[2])


@kernel
def buoyancy_rates_of_shapes(state, p, J, h):
    """Rates (λ, Ω², γ) of buoyancy on one body: damping, squared frequency, turning (`implicit_loads`)."""
    heave, roll = _squares(state, p, J, h)
    return (0.0, max(heave, roll), 0.0)


@kernel
def soften_buoyancy_of_shapes(loads, h, R, state, p, J):
    """Soften the loads (acceleration, torque) of a stage of length h by upper bounds of buoyancy's stiffness."""
    heave, roll = _squares(state, p, J, h)
    n = (p[FLUID_NORMAL], p[FLUID_NORMAL + 1], p[FLUID_NORMAL + 2])
    s = 0.25 * h * h
    a, T = soften_at(loads, ZERO, n, s * heave * state.mass, 0.0, R, state.mass, J)
    return a, times(1.0 / (1.0 + s * roll), T)
