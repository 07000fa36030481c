"""Buoyancy of a body in a fluid at rest below a plane: F = ρ g V n at the centre of the submerged part.

V is the volume of that part, n the upward normal of the plane, ρ the density of the fluid. The potential energy is
ρ g V times the depth of the centre of the submerged part.

References
----------
Archimedes, *On Floating Bodies*, book I, proposition 5.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined
from physics.kernels.forces.force_field_state import ZERO, acting_at
from physics.kernels.forces.implicit_loads import soften_at
from physics.kernels.forces.submerged_volume import submerged_part
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import plus, times
from physics.kernels.state.layout import BLOCK, SPHERE

# Columns of the parameters p.
FLUID_NORMAL = 0  # of the surface, up
FLUID_OFFSET = 3  # the fluid is where normal·x <= offset [m]
FLUID_WEIGHT = 4  # ρ g [N/m³]


@inlined
def _wet(state, p):
    """Submerged part of a body, from its `FieldState` and the parameters p: (volume [m³], centre, height, n).

    The centre of the submerged part is relative to the centre of mass, world frame [m]. The height is that of this
    centre above the fluid's surface [m], negative below it, and n is the surface's normal.
    """
    n = (p[FLUID_NORMAL], p[FLUID_NORMAL + 1], p[FLUID_NORMAL + 2])
    height = qt.dot(n, plus(state.x, state.center)) - p[FLUID_OFFSET]
    volume, centre = submerged_part(state.shape, state.dims, qt.transposed_matvec(state.R, n), height)
    r = qt.matvec(state.R, centre)
    return volume, plus(state.center, r), height + qt.dot(n, r), n


@inlined
def buoyancy(state, p, t):
    """Force and torque about the centre of mass by buoyancy, from a body's `FieldState` and the parameters p."""
    volume, arm, _, n = _wet(state, p)
    force = times(p[FLUID_WEIGHT] * volume, n)
    if state.shape == SPHERE and state.center == ZERO:
        return force, ZERO  # along the line through the centre, whatever rounding says
    return acting_at(arm, force)


@inlined
def buoyancy_energy(state, p, t):
    """Potential energy of buoyancy: ρ g V times the depth of the submerged part's centre [J]."""
    volume, _, height, _ = _wet(state, p)
    return -p[FLUID_WEIGHT] * volume * height


@inlined
def _largest_section(state):
    """Upper bound of the area of any plane section of a body [m²]: the area of its largest shadow."""
    d = state.dims
    a = (d[1] * d[2], d[2] * d[0], d[0] * d[1])
    size = math.sqrt(qt.dot(a, a))
    return 4.0 * size if state.shape == BLOCK else math.pi * size


@inlined
def _squares(state, p, J, h):
    """Upper bounds of the squared frequencies with which a floating body heaves, and rolls [1/s²].

    Both are 0 if the fluid's surface stays clear of the body in half a step h before and after now. Heaving has
    ρ g A/m, with the area A of the largest section.

    Rolling about an axis: the second moment of the section about it is at most A (d_j² + d_k²)/3 for a block and
    A (d_j² + d_k²)/4 for an ellipsoid. Their moments of inertia are m (d_j² + d_k²)/3 and m (d_j² + d_k²)/5. So rolling
    has at most 5/4 of ρ g A/m. A centre of mass at the distance |c| from the geometric centre adds ρ g V |c| J, with
    V <= 2 A |d|.
    """
    d, c = state.dims, state.center
    height = qt.dot((p[FLUID_NORMAL], p[FLUID_NORMAL + 1], p[FLUID_NORMAL + 2]), plus(state.x, c)) - p[FLUID_OFFSET]
    reach = math.sqrt(qt.dot(d, d)) + 0.5 * h * math.sqrt(qt.dot(state.v, state.v))
    if abs(height) > reach:
        return 0.0, 0.0
    heave = p[FLUID_WEIGHT] * _largest_section(state) / state.mass
    offset = 2.0 * math.sqrt(qt.dot(d, d) * qt.dot(c, c)) * state.mass * max(J[0], J[1], J[2])
    return heave, heave * (1.25 + offset)


@inlined
def buoyancy_rates(state, p, J, h):
    """Rates (λ, Ω², γ) of buoyancy on one body: damping, squared frequency, turning (`implicit_loads`)."""
    heave, roll = _squares(state, p, J, h)
    if state.shape == SPHERE and state.center == ZERO:
        return (0.0, heave, 0.0)
    return (0.0, max(heave, roll), 0.0)


@inlined
def soften_buoyancy(loads, h, R, state, p, J):
    """Soften the loads (acceleration, torque) of a stage of length h by upper bounds of buoyancy's stiffness."""
    heave, roll = _squares(state, p, J, h)
    n = (p[FLUID_NORMAL], p[FLUID_NORMAL + 1], p[FLUID_NORMAL + 2])
    s = 0.25 * h * h
    a, T = soften_at(loads, ZERO, n, s * heave * state.mass, 0.0, R, state.mass, J)
    if state.shape == SPHERE and state.center == ZERO:
        return a, T
    return a, times(1.0 / (1.0 + s * roll), T)
