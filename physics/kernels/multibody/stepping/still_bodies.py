"""Still bodies: fixed ones without a prescribed motion, whose poses and boxes are computed once for a call."""

from __future__ import annotations

from physics.compiler.decorators import if_given
from physics.kernels.multibody.broadphase.sweep_and_prune import write_swept_box
from physics.kernels.multibody.data.contact_set import put_vector
from physics.kernels.multibody.data.fixed_bodies import is_still
from physics.kernels.multibody.data.kinematics import update_body_pose


@if_given("many.bodies.fixed")
def place_still_bodies(offset_frame, many):
    """Compute poses and boxes of all bodies that nothing moves, and clear their twists."""
    for b in range(many.bodies.state.shape[0]):
        if is_still(b, many):
            update_body_pose(b, offset_frame, many)
            put_vector(many.bodies.twist, b, 0, (0.0, 0.0, 0.0))
            put_vector(many.bodies.twist, b, 3, (0.0, 0.0, 0.0))
            many.bodies.spin_bound[b] = 0.0
            write_swept_box(b, 0.0, many)
