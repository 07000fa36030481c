"""Kinematics of the bodies of a world: rotations, geometric centres, inverse inertias and twists of their states."""

from __future__ import annotations

from physics.compiler.decorators import if_given, inlined
from physics.kernels.half_space.contact_point import geometric_center
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.contact_set import put_vector
from physics.kernels.multibody.data.driven_bodies import drift_driven_bodies, is_driven
from physics.kernels.multibody.data.fixed_bodies import is_still
from physics.kernels.multibody.data.parts import place_parts
from physics.kernels.state import layout as at
from physics.kernels.state.body import angular_velocity, principal_attitude, read_state


@inlined
def update_body_pose(b, offset_frame, many):
    """Compute rotation, geometric centre and inverse inertia of body b from its state, in the world frame.

    `offset_frame` is None unless some body has an offset frame (`state.groups.FlightSwitches`). Results are written to
    `many.bodies`.
    """
    x, q, _, _ = read_state(many.bodies.state, b)
    body = many.bodies.body[b]
    R = qt.to_matrix(q)
    for c in range(9):
        many.bodies.rotation[b, c] = R[c]
    put_vector(many.bodies.center, b, 0, geometric_center(x, R, body, offset_frame))
    place_parts(b, many)
    P = R
    if offset_frame is not None:
        P = qt.to_matrix(principal_attitude(q, body, offset_frame))
    J, K = body.J, many.bodies.inv_inertia
    K[b, 0] = J[0] * P[0] * P[0] + J[1] * P[1] * P[1] + J[2] * P[2] * P[2]
    K[b, 1] = J[0] * P[0] * P[3] + J[1] * P[1] * P[4] + J[2] * P[2] * P[5]
    K[b, 2] = J[0] * P[0] * P[6] + J[1] * P[1] * P[7] + J[2] * P[2] * P[8]
    K[b, 3] = J[0] * P[3] * P[3] + J[1] * P[4] * P[4] + J[2] * P[5] * P[5]
    K[b, 4] = J[0] * P[3] * P[6] + J[1] * P[4] * P[7] + J[2] * P[5] * P[8]
    K[b, 5] = J[0] * P[6] * P[6] + J[1] * P[7] * P[7] + J[2] * P[8] * P[8]


@inlined
def update_poses_and_twists(offset_frame, many):
    """Compute rotation, geometric centre, inverse inertia and twist of every body that moves from its state.

    Those of all others stay as `stepping.still_bodies` has computed them.
    """
    for b in range(many.bodies.state.shape[0]):
        if is_still(b, many):
            continue
        update_body_pose(b, offset_frame, many)
        put_vector(many.bodies.twist, b, 0, row_vector(many.bodies.state, b, at.LINVEL))
        q, L = read_state(many.bodies.state, b)[1], row_vector(many.bodies.state, b, at.ANGMOM)
        put_vector(many.bodies.twist, b, 3, angular_velocity(q, L, many.bodies.body[b], offset_frame))


@if_given("many.driven")
def move_driven_bodies(h, offset_frame, many):
    """Move all driven bodies by the time h [s], and compute their new poses."""
    drift_driven_bodies(h, many)
    for b in range(many.bodies.state.shape[0]):
        if is_driven(b, many):
            update_body_pose(b, offset_frame, many)
