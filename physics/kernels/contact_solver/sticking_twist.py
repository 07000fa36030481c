"""Twist of a body whose contacts all stick, and the moments of the contacts that it follows from (see `sticking`)."""

from __future__ import annotations

import math
from typing import NamedTuple

from physics.compiler.decorators import inlined
from physics.kernels.contact_solver.impulse_distribution import first_active, solve_symmetric
from physics.kernels.half_space.contact_point import contact_arm, wall_of
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus
from physics.kernels.state.layout import WALL_NORMAL, WALL_TANGENT_1, WALL_TANGENT_2

# For a rectangular patch det K / tr(K)³ is (1 - s) s / 8, with s the smaller share of its second moment. Below this
# limit (edges 1 : 350) the patch counts as a line.
_COLLINEAR_LIMIT = 1.0e-6

# Errors of the target velocities up to this share of the largest target are rounding (of a least-squares fit over a
# patch that is not a line).
RIGID_TWIST_TOLERANCE = 1.0e-11


class FreeMotion(NamedTuple):
    """Motion of the body without contact impulses, world frame.

    Attributes
    ----------
    R : tuple of 9 floats
        Principal frame to world.
    v : tuple of 3 floats
        Velocity of the centre of mass [m/s].
    L : tuple of 3 floats
        Angular momentum about it [kg m²/s].
    """

    R: tuple
    v: tuple
    L: tuple


class BoltGroup(NamedTuple):
    """Centroid and second moment of the contacts that are to stick, those with a flag in `solver.active`; world frame.

    Attributes
    ----------
    count : int
        Number of these contacts.
    center : tuple of 3 floats
        Their centroid r̄, from the centre of mass [m].
    second : tuple of 6 floats
        Their second moment K (00, 01, 02, 11, 12, 22) about the centroid [m²].
    is_line : bool
        True if they are on a line, or at a point.
    """

    count: int
    center: tuple
    second: tuple
    is_line: bool


@inlined
def bolt_group(n, count, scratch):
    """Make the `BoltGroup` of the active contacts, `count` of the n contacts in `scratch`."""
    contacts = scratch.contacts
    cx = cy = cz = 0.0
    for i in range(n):
        if scratch.solver.active[i] == 0:
            continue
        cx += contacts.arm[i, 0]
        cy += contacts.arm[i, 1]
        cz += contacts.arm[i, 2]
    c = (cx / count, cy / count, cz / count)
    xx = xy = xz = yy = yz = zz = 0.0
    for i in range(n):
        if scratch.solver.active[i] == 0:
            continue
        x, y, z = minus(contact_arm(contacts, i), c)
        xx += x * x
        xy += x * y
        xz += x * z
        yy += y * y
        yz += y * z
        zz += z * z
    k = (yy + zz, -xy, -xz, xx + zz, -yz, xx + yy)
    return BoltGroup(count, c, k, count < 3 or _is_collinear(k))


@inlined
def _is_collinear(k):
    det = k[0] * (k[3] * k[5] - k[4] * k[4]) - k[1] * (k[1] * k[5] - k[4] * k[2]) + k[2] * (k[1] * k[4] - k[3] * k[2])
    return not det > _COLLINEAR_LIMIT * (k[0] + k[3] + k[5]) ** 3


@inlined
def world_target(i, scratch):
    """Target velocity of contact i in the world frame [m/s]."""
    contacts = scratch.contacts
    n, a, b = contacts.target[i, 0], contacts.target[i, 1], contacts.target[i, 2]
    walls, wall = scratch.scene.walls, wall_of(contacts.slot[i], scratch.scene)
    return (
        n * walls[wall, WALL_NORMAL] + a * walls[wall, WALL_TANGENT_1] + b * walls[wall, WALL_TANGENT_2],
        n * walls[wall, WALL_NORMAL + 1] + a * walls[wall, WALL_TANGENT_1 + 1] + b * walls[wall, WALL_TANGENT_2 + 1],
        n * walls[wall, WALL_NORMAL + 2] + a * walls[wall, WALL_TANGENT_1 + 2] + b * walls[wall, WALL_TANGENT_2 + 2],
    )


@inlined
def largest_target_speed(n, contacts):
    """Largest component of the target velocities of n contacts [m/s]."""
    largest = 0.0
    for i in range(n):
        for c in range(3):
            largest = max(largest, abs(contacts.target[i, c]))
    return largest


@inlined
def _target_moments(n, group, scratch):
    """Mean of the target velocities t_i of the active contacts [m/s], and Σ d_i x t_i, d_i from their centroid."""
    count, c = group.count, group.center
    s = (0.0, 0.0, 0.0)
    m = (0.0, 0.0, 0.0)
    for i in range(n):
        if scratch.solver.active[i] == 0:
            continue
        t = world_target(i, scratch)
        d = qt.cross(minus(contact_arm(scratch.contacts, i), c), t)
        s = (s[0] + t[0], s[1] + t[1], s[2] + t[2])
        m = (m[0] + d[0], m[1] + d[1], m[2] + d[2])
    return (s[0] / count, s[1] / count, s[2] / count), m


@inlined
def _angular_velocity_about_line(n, group, vc, m, free, scratch):
    """Angular velocity of a body whose active contacts, on a line, move at their targets, world frame [rad/s].

    vc is the mean of the target velocities t and `m` is Σ d x t, both of `_target_moments`. Across the line the angular
    velocity is the least-squares fit Σ d x t / Σ|d|². Along the line's unit vector e it is α, from the condition that
    the contacts exert no moment about the line: e·(I ω - L - c x M (v₁ - v)) = 0, with the mass M, the centroid c, and
    v₁ = vc - ω x c.
    """
    body = scratch.body
    J, c, k, (R, v, L) = body.J, group.center, group.second, free
    first = minus(contact_arm(scratch.contacts, first_active(n, scratch.solver)), c)
    size2 = 0.5 * (k[0] + k[3] + k[5])
    s = 1.0 / math.sqrt(first[0] * first[0] + first[1] * first[1] + first[2] * first[2])
    e = (s * first[0], s * first[1], s * first[2])
    s = 1.0 / size2
    w = (s * m[0], s * m[1], s * m[2])
    eb, wb = qt.transposed_matvec(R, e), qt.transposed_matvec(R, w)
    Ie = (eb[0] / J[0], eb[1] / J[1], eb[2] / J[2])
    wc = qt.cross(w, c)
    ec = qt.cross(e, c)
    gain = (vc[0] - wc[0] - v[0], vc[1] - wc[1] - v[1], vc[2] - wc[2] - v[2])
    top = qt.dot(e, L) - qt.dot(Ie, wb) + body.mass * qt.dot(ec, gain)
    alpha = top / (qt.dot(Ie, eb) + body.mass * qt.dot(ec, ec))
    return (w[0] + alpha * e[0], w[1] + alpha * e[1], w[2] + alpha * e[2])


@inlined
def _point_impulse(r, t, free, body):
    """Impulse at the point r, from the centre of mass, that gives this point the velocity t, world frame [N s].

    `free` is the motion without the impulse.
    """
    J, q, (R, v, L) = body.J, 1.0 / body.mass, free
    x, y, z = qt.transposed_matvec(R, r)
    Lb = qt.transposed_matvec(R, L)
    wb = (J[0] * Lb[0], J[1] * Lb[1], J[2] * Lb[2])
    turn = qt.cross(wb, (x, y, z))
    goal = minus(qt.transposed_matvec(R, minus(t, v)), turn)
    W = (
        q + J[2] * y * y + J[1] * z * z, -J[2] * x * y, -J[1] * x * z,
        q + J[2] * x * x + J[0] * z * z, -J[0] * y * z,
        q + J[1] * x * x + J[0] * y * y,
    )  # fmt: skip
    return qt.matvec(R, solve_symmetric(W, goal))


@inlined
def sticking_twist(n, group, no_target, free, scratch):
    """Velocity and angular velocity of the body whose active contacts move at their targets, world frame.

    `no_target` is true if all targets are zero.
    """
    zero = (0.0, 0.0, 0.0)
    if no_target and not group.is_line:
        return zero, zero
    c = group.center
    vc, m = _target_moments(n, group, scratch)
    if group.count == 1:
        J, R, L = scratch.body.J, free.R, free.L
        P = _point_impulse(c, vc, free, scratch.body)
        m = qt.cross(c, P)
        b = qt.transposed_matvec(R, (L[0] + m[0], L[1] + m[1], L[2] + m[2]))
        w = qt.matvec(R, (J[0] * b[0], J[1] * b[1], J[2] * b[2]))
    elif group.is_line:
        w = _angular_velocity_about_line(n, group, vc, m, free, scratch)
    else:
        w = solve_symmetric(group.second, m)
    return minus(vc, qt.cross(w, c)), w


@inlined
def largest_free_speed(n, free, scratch):
    """Largest component of contact velocities without impulses, less their targets [m/s]: the scale of a residual."""
    J, (R, v, L) = scratch.body.J, free
    b = qt.transposed_matvec(R, L)
    w = qt.matvec(R, (J[0] * b[0], J[1] * b[1], J[2] * b[2]))
    largest = 0.0
    for i in range(n):
        m = qt.cross(w, contact_arm(scratch.contacts, i))
        t = world_target(i, scratch)
        largest = max(largest, abs(v[0] + m[0] - t[0]), abs(v[1] + m[1] - t[1]), abs(v[2] + m[2] - t[2]))
    return largest
