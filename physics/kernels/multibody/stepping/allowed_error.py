"""Error that a part of a substep may have under error control (`adaptive_substep`)."""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined
from physics.kernels.math import quaternion as qt

# In tolerances of the contact problem. The residual of a solve changes velocities by a few tolerances, however short
# the part is.
ERROR_PER_TOLERANCE = 100.0


@inlined
def allowed_error(many):
    """Error that a part may have, as a share of a body's size and speed."""
    return ERROR_PER_TOLERANCE * many.settings[0].tolerance


@inlined
def reference_speed(v, w, body):
    """Speed to which errors of a body's velocity are compared, from its twist (v, w) [m/s].

    It is at least √(r a): the speed that loads of acceleration a give over a bounding radius r.
    """
    turning = body.radius * math.sqrt(qt.dot(w, w))
    return math.sqrt(qt.dot(v, v)) + turning + math.sqrt(body.radius * body.acceleration)


@inlined
def allowed_depth(b, many):
    """Error that a part may have in the place of body b [m]; 0 without error control."""
    return many.settings[0].is_error_controlled * allowed_error(many) * many.bodies.body[b].radius
