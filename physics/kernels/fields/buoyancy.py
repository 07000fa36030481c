"""Buoyancy in a fluid at rest below a plane: F = ρ g V n at the centre of the submerged part.

Its energy is ρ g V times the depth of that centre: lifting the body lets the fluid fill what it leaves.

References
----------
Archimedes, *On Floating Bodies*, book I, proposition 5.
"""

from __future__ import annotations

from physics.kernels import quaternion as qt
from physics.kernels.compiler import inlined
from physics.kernels.fields.state import ZERO, acting_at, plus, times
from physics.kernels.fields.submerged import submerged
from physics.kernels.layout import SPHERE

# Columns.
NORMAL = 0  # of the surface, up
OFFSET = 3  # the fluid is where normal·x <= offset [m]
WEIGHT = 4  # ρ g [N/m³]
SIZE = 5


@inlined
def _wet(state, p):
    """Volume of the submerged part, its centre relative to the centre of mass, and the height of that."""
    n = (p[NORMAL], p[NORMAL + 1], p[NORMAL + 2])
    height = qt.dot(n, plus(state.x, state.center)) - p[OFFSET]
    volume, centre = submerged(state.shape, state.dims, qt.transposed_matvec(state.R, n), height)
    r = qt.matvec(state.R, centre)
    return volume, plus(state.center, r), height + qt.dot(n, r), n


@inlined
def buoyancy(state, p, t):
    """(force, torque) of the fluid."""
    volume, arm, _, n = _wet(state, p)
    force = times(p[WEIGHT] * volume, n)
    if state.shape == SPHERE and state.center == ZERO:
        return force, ZERO  # along the line through the centre, whatever rounding says
    return acting_at(arm, force)


@inlined
def buoyancy_energy(state, p, t):
    """ρ g V times the depth of the submerged part's centre [J]."""
    volume, _, height, _ = _wet(state, p)
    return -p[WEIGHT] * volume * height
