"""Error that a part of a substep may have under error control (`adaptive_substep`)."""

from __future__ import annotations

from physics.compiler.decorators import inlined

# In tolerances of the contact problem. The residual of a solve changes velocities by a few tolerances, however short
# the part is.
ERROR_PER_TOLERANCE = 100.0


@inlined
def allowed_error(many):
    """Error that a part may have, as a share of a body's size and speed."""
    return ERROR_PER_TOLERANCE * many.settings[0].tolerance


@inlined
def allowed_depth(b, many):
    """Error that a part may have in the place of body b [m]; 0 without error control."""
    return many.settings[0].is_error_controlled * allowed_error(many) * many.bodies.body[b].radius
