"""Assemble the acceleration-level problem a = A f + b for the forces of the acting contacts in a known contact mode.

In a contact mode each acting contact *sticks* (its point has no acceleration) or *slides* (no normal acceleration; the
force is f_n (n - μ d), with the direction d of its sliding). The acceleration of a contact with the arm r_i is

    a_i = dv/dt + dω/dt x r_i + ω x dr_i/dt.

For a vertex dr/dt = ω x r; the contact point of an ellipsoid wanders over the body, and for a sphere dr/dt = 0. So the
forces solve a linear system with as many unknowns as equations: three for a sticking contact, one for a sliding one.

Three or more contacts of one wall, a *patch*, have three unknowns for their normal forces,
f_i = y_0 + y_1 a_i + y_2 b_i, affine in the place (a_i, b_i) on the wall. These have the least norm of all normal
forces with the same resultant. The equations are the three combinations of their rows with the same coefficients. A
sticking contact of a patch adds its two tangential forces. So the normal forces of a face do not jump when one of its
corners stops.

The last known forces (`given_force`) are a given part of the contact forces; the unknowns are only added to them. For
the motion of a rigid body does not determine which of its corners pushes on the floor, or on the wall beside it. A
distribution that the contact problem has found at one moment (`acceleration_problem`) is kept in this way.

`constraint_projection` uses the same rows, with velocities or gaps in place of accelerations, to bring a state back to
the contact mode by the smallest change in the kinetic metric.

Source: Witkin and Baraff, *Physically Based Modeling*, SIGGRAPH course notes, 1997, part II, section 8, for
a = A f + b. Here it has friction, and the contact mode is known.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.contact_law.anisotropic_friction import sliding_direction
from physics.kernels.contact_law.materials import limited_friction
from physics.kernels.half_space.contact_point import contact_arm_and_rate, feature_of, wall_axes, wall_normal, wall_of
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import as_vector, plus, row_vector, times
from physics.kernels.state.body import principal_attitude

# Smallest number of contacts of one wall that make a patch, with affine normal forces.
MIN_PATCH_CONTACTS = 3

# `motion.contacts.patch` of a contact whose normal force is an unknown of its own.
NO_PATCH = -1


@inlined
def apply_inverse_inertia(P, J, h):
    """Multiply a world vector h by the inverse inertia, I⁻¹ h; P is the matrix of the principal axes.

    J are the inverse principal moments [1/(kg m²)].
    """
    m = qt.transposed_matvec(P, h)
    return qt.matvec(P, (J[0] * m[0], J[1] * m[1], J[2] * m[2]))


@kernel
def free_angular_motion(y, offset_frame, body):
    """Rotation of a body in the state y, without contact forces: (R, P, ω, dω/dt), world frame.

    R and P are the rotation matrices of body axes and principal axes, and dω/dt = I⁻¹(τ - ω x L) with the torque τ.
    """
    q, L = y[1], y[3]
    R = qt.to_matrix(q)
    P = R
    if offset_frame is not None:
        P = qt.to_matrix(principal_attitude(q, body, offset_frame))
    J = body.J
    w = apply_inverse_inertia(P, J, L)
    g = qt.cross(w, L)
    t = body.torque
    return R, P, w, apply_inverse_inertia(P, J, (t[0] - g[0], t[1] - g[1], t[2] - g[2]))


@kernel
def set_contact_kinematics(y, R, w, alpha, offset_frame, scratch, motion):
    """Set arm, velocity, sliding direction and free acceleration (`constraint_error`) of each acting contact at y.

    R is the rotation matrix, w the angular velocity, and alpha the angular acceleration without contact.
    """
    scene, body = scratch.scene, scratch.body
    contacts = motion.contacts
    shape, walls = body.shape, scene.walls
    dims, a, v = as_vector(body.dims), as_vector(body.free_acceleration), y[2]
    for j in range(contacts.count):
        n = wall_normal(walls, wall_of(contacts.slot[j], scene))
        r, rate = contact_arm_and_rate(shape, dims, R, w, n, feature_of(contacts.slot[j], scene), offset_frame, body)
        u = plus(v, qt.cross(w, r))
        b = plus(plus(a, qt.cross(alpha, r)), qt.cross(w, rate))
        un = qt.dot(n, u)
        t = (u[0] - un * n[0], u[1] - un * n[1], u[2] - un * n[2])
        speed = math.sqrt(qt.dot(t, t))
        d = row_vector(contacts.start_slip_direction, j, 0)
        if speed > motion.thresholds.slip_stop_speed and qt.dot(t, d) > 0.0:
            d = times(1.0 / speed, t)
        for c in range(3):
            contacts.arm[j, c], contacts.velocity[j, c], contacts.constraint_error[j, c] = r[c], u[c], b[c]
            contacts.slip_direction[j, c] = d[c]


@inlined
def _add_to_unknown(m, r, push, row, share, unknowns):
    """Add a contact with the arm r to unknown m, with the weight `share`.

    `push` is the direction of its force, which adds to the unknown's column, and `row` is the direction of its
    constraint, which adds to the unknown's row.
    """
    h, e = qt.cross(r, push), qt.cross(r, row)
    for c in range(3):
        unknowns.column_force[m, c] += share * push[c]
        unknowns.column_moment[m, c] += share * h[c]
        unknowns.row[m, c] += share * row[c]
        unknowns.row_moment[m, c] += share * e[c]


@inlined
def sliding_force_direction(mu, axes, j, body, contacts):
    """Force of the sliding contact j per newton of its normal force: normal and opposed friction, world frame."""
    n, d = axes[0], sliding_direction(row_vector(contacts.slip_direction, j, 0), axes, body)
    return (n[0] - mu * d[0], n[1] - mu * d[1], n[2] - mu * d[2])


@inlined
def _contact_force_direction(mu, axes, j, body, contacts):
    """Force of contact j per newton of its normal force: along the normal if it sticks, with friction if it slides."""
    if contacts.sticks[j]:
        return axes[0]
    return sliding_force_direction(mu, axes, j, body, contacts)


@inlined
def _contact_force(normal, first, second, mu, axes, j, body, contacts):
    """Force of contact j with the normal force `normal` [N], world frame.

    If it sticks, `first` and `second` are its forces along the two tangents of the wall.
    """
    f = times(normal, _contact_force_direction(mu, axes, j, body, contacts))
    if contacts.sticks[j]:
        f = plus(f, plus(times(first, axes[1]), times(second, axes[2])))
    return f


@kernel
def _add_shares(mu, scratch, motion):
    """Write the sums of the given forces of all contacts, and of their moments, into `unknowns.given_wrench`.

    Without friction the given forces are left out, and the sums are zero.
    """
    contacts = motion.contacts
    force = moment = (0.0, 0.0, 0.0)
    if mu > 0.0:
        for j in range(contacts.count):
            wall = wall_of(contacts.slot[j], scratch.scene)
            axes, coefficient = wall_axes(scratch.scene.walls, wall), limited_friction(mu, wall, scratch.body)
            p = row_vector(contacts.given_force, j, 0)
            f = _contact_force(p[0], p[1], p[2], coefficient, axes, j, scratch.body, contacts)
            force, moment = plus(force, f), plus(moment, qt.cross(row_vector(contacts.arm, j, 0), f))
    for c in range(3):
        motion.unknowns.given_wrench[0, c], motion.unknowns.given_wrench[1, c] = force[c], moment[c]


@inlined
def _clear_unknowns(m, count, unknowns):
    """Set columns, rows and right-hand sides of the `count` unknowns from m on to zero."""
    for k in range(m, m + count):
        unknowns.rhs[k] = 0.0
        for c in range(3):
            unknowns.column_force[k, c] = unknowns.column_moment[k, c] = 0.0
            unknowns.row[k, c] = unknowns.row_moment[k, c] = 0.0


@kernel
def _add_sticking_unknowns(m, j, first_axis, axes, motion):
    """Add unknowns for the forces of the sticking contact j along its wall's axes, from number `first_axis` on.

    m is the number of the first unknown; the number after the last one is returned.
    """
    r, b = row_vector(motion.contacts.arm, j, 0), row_vector(motion.contacts.constraint_error, j, 0)
    motion.contacts.first_unknown[j] = m
    _clear_unknowns(m, 3 - first_axis, motion.unknowns)
    for c in range(first_axis, 3):
        _add_to_unknown(m, r, axes[c], axes[c], 1.0, motion.unknowns)
        motion.unknowns.rhs[m] = -qt.dot(axes[c], b)
        m += 1
    return m


@kernel
def _add_patch_unknowns(m, first, last, mu, axes, body, motion):
    """Add the three unknowns m, m + 1, m + 2 of the normal forces of a patch: contacts first <= j < last of one wall.

    Returns m + 3.
    """
    unknowns, contacts = motion.unknowns, motion.contacts
    _clear_unknowns(m, 3, unknowns)
    radius = body.radius
    ca = cb = 0.0
    for j in range(first, last):
        r = row_vector(contacts.arm, j, 0)
        ca += qt.dot(axes[1], r) / (last - first)
        cb += qt.dot(axes[2], r) / (last - first)
    for j in range(first, last):
        r, b = row_vector(contacts.arm, j, 0), -qt.dot(axes[0], row_vector(contacts.constraint_error, j, 0))
        push = _contact_force_direction(mu, axes, j, body, contacts)
        s = (qt.dot(axes[1], r) - ca) / radius
        t = (qt.dot(axes[2], r) - cb) / radius
        contacts.patch[j] = m
        contacts.patch_coordinate[j, 0], contacts.patch_coordinate[j, 1] = s, t
        _add_to_unknown(m, r, push, axes[0], 1.0, unknowns)
        _add_to_unknown(m + 1, r, push, axes[0], s, unknowns)
        _add_to_unknown(m + 2, r, push, axes[0], t, unknowns)
        unknowns.rhs[m] += b
        unknowns.rhs[m + 1] += s * b
        unknowns.rhs[m + 2] += t * b
    return m + 3


@kernel
def assemble_unknowns(mu, holding, scratch, motion):
    """Assemble the linear system of the contact mode in `motion.unknowns`; return its number of unknowns.

    Filled are columns (force and moment per unknown), rows (directions of constraints), `given_wrench`, and right-hand
    sides, from `constraint_error` of the contacts. `holding` is true if sticking contacts also have equations along the
    wall. mu is the largest friction coefficient at any wall, or 0 for a problem without friction.
    """
    scene = scratch.scene
    unknowns, contacts = motion.unknowns, motion.contacts
    m = first = unknowns.is_skew = 0
    _add_shares(mu, scratch, motion)
    for j in range(contacts.count):
        if mu > 0.0 and not contacts.sticks[j]:
            unknowns.is_skew = 1
    while first < contacts.count:
        wall = wall_of(contacts.slot[first], scene)
        axes, coefficient = wall_axes(scene.walls, wall), limited_friction(mu, wall, scratch.body)
        last = first
        while last < contacts.count and wall_of(contacts.slot[last], scene) == wall:
            contacts.patch[last] = NO_PATCH
            last += 1
        own = 0  # first axis along which a sticking contact has an unknown of its own
        if last - first >= MIN_PATCH_CONTACTS:
            m = _add_patch_unknowns(m, first, last, coefficient, axes, scratch.body, motion)
            own = 1
        for j in range(first, last):
            if holding and contacts.sticks[j]:
                m = _add_sticking_unknowns(m, j, own, axes, motion)
            elif own == 0:
                _clear_unknowns(m, 1, unknowns)
                _add_to_unknown(
                    m,
                    row_vector(contacts.arm, j, 0),
                    sliding_force_direction(coefficient, axes, j, scratch.body, contacts),
                    axes[0],
                    1.0,
                    unknowns,
                )
                unknowns.rhs[m] = -qt.dot(axes[0], row_vector(contacts.constraint_error, j, 0))
                contacts.first_unknown[j] = m
                m += 1
        first = last
    return m


@kernel
def recover_contact_forces(mu, scratch, motion):
    """Compute the force of each acting contact from the solved unknowns and the given forces.

    Written are `contacts.force`, in the world frame, and its normal component `contacts.normal` [N].
    """
    contacts, unknowns = motion.contacts, motion.unknowns
    for j in range(contacts.count):
        wall = wall_of(contacts.slot[j], scratch.scene)
        axes, coefficient = wall_axes(scratch.scene.walls, wall), limited_friction(mu, wall, scratch.body)
        k, p, f = contacts.first_unknown[j], contacts.patch[j], row_vector(contacts.given_force, j, 0)
        if not mu > 0.0:  # `_add_shares` leaves given forces out: the unknowns are the whole force
            f = (0.0, 0.0, 0.0)
        if p != NO_PATCH:
            s = unknowns.value[p]
            s += (
                contacts.patch_coordinate[j, 0] * unknowns.value[p + 1]
                + contacts.patch_coordinate[j, 1] * unknowns.value[p + 2]
            )
        else:
            s = unknowns.value[k]
            k += 1
        contacts.normal[j] = f[0] + s
        first = second = 0.0
        if contacts.sticks[j]:
            first, second = f[1] + unknowns.value[k], f[2] + unknowns.value[k + 1]
        f = _contact_force(contacts.normal[j], first, second, coefficient, axes, j, scratch.body, contacts)
        contacts.force[j, 0], contacts.force[j, 1], contacts.force[j, 2] = f


@inlined
def clear_last_forces(contacts):
    """Set the last known forces of all features, `contacts.last_force`, to zero."""
    for s in range(contacts.last_force.shape[0]):
        contacts.last_force[s, 0] = contacts.last_force[s, 1] = contacts.last_force[s, 2] = 0.0


@kernel
def store_last_forces(scene, contacts):
    """Store the forces of the acting contacts in `contacts.last_force`, along the wall's axes; 0 for other features."""
    clear_last_forces(contacts)
    for j in range(contacts.count):
        axes, f = wall_axes(scene.walls, wall_of(contacts.slot[j], scene)), row_vector(contacts.force, j, 0)
        for c in range(3):
            contacts.last_force[contacts.slot[j], c] = qt.dot(axes[c], f)
