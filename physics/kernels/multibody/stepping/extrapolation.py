"""Extrapolation of a part of a substep from a whole step and two half steps of it (Richardson).

The steps of a smooth part have errors that differ by the factor 4. A third of their difference is added to the result
of the half steps, which leaves an error of higher order. Where a part is not smooth, its error is changed by a third of
the difference at most, which error control allows.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.contact_set import add_scaled, put_vector, subtract
from physics.kernels.multibody.stepping.snapshots import SNAPSHOT_COARSE
from physics.kernels.state import layout as at
from physics.kernels.state.fixed_body import is_fixed


@inlined
def extrapolate_body(b, kept, many):
    """Add to the state of body b after two half steps a third of its difference from that of a whole step."""
    state, coarse = many.bodies.state, kept.state[SNAPSHOT_COARSE]
    for first in (at.POS, at.LINVEL, at.ANGMOM):
        fine = row_vector(state, b, first)
        put_vector(state, b, first, add_scaled(fine, 1.0 / 3.0, subtract(fine, row_vector(coarse, b, first))))
    same = 0.0
    for c in range(at.QUAT, at.QUAT + 4):
        same += state[b, c] * coarse[b, c]
    sign = math.copysign(1.0, same)  # both quaternions of an attitude are the same to a step
    for c in range(at.QUAT, at.QUAT + 4):
        state[b, c] += (state[b, c] - sign * coarse[b, c]) / 3.0
    q = qt.normalise((state[b, at.QUAT], state[b, at.QUAT + 1], state[b, at.QUAT + 2], state[b, at.QUAT + 3]))
    for c in range(4):
        state[b, at.QUAT + c] = q[c]


@inlined
def _is_same(b, kept, many):
    """True if a whole step and two half steps leave body b in the same state, as one that sleeps."""
    for c in range(many.bodies.state.shape[1]):
        if many.bodies.state[b, c] != kept.state[SNAPSHOT_COARSE, b, c]:
            return False
    return True


@if_given("many.compliance")
def extrapolate_springs(kept, many):
    """Extrapolate the states of all bodies that move, in a scene with compliant contact: its forces are continuous.

    Rigid contacts would open by it. The sum of all momenta stays.
    """
    for b in range(many.bodies.state.shape[0]):
        if not (is_fixed(b, many.bodies) or _is_same(b, kept, many)):
            extrapolate_body(b, kept, many)
