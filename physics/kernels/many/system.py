"""The system that `newton` solves: its defect x - M⁻¹ Jᵀ p(x), and its matrix 1 + M⁻¹ Jᵀ ρ p' J."""

from __future__ import annotations

import math

from physics.kernels import quaternion as qt
from physics.kernels.compiler import inlined, kernel
from physics.kernels.many.blocks import SIZE, clear, place_of, six
from physics.kernels.many.contacts import local_velocity, matrix, put, vector
from physics.kernels.many.response import push, turned


@inlined
def law(y, mu):
    """The impulse that `y` stands for: no pull, and the tangential part inside its disk."""
    normal = max(y[0], 0.0)
    size, limit = math.sqrt(y[1] * y[1] + y[2] * y[2]), mu * normal
    s = limit / size if size > limit else 1.0
    return normal, s * y[1], s * y[2]


@kernel
def defect(part, rho, all_hold, many):
    """x - M⁻¹ Jᵀ p(x) of every body of an island into `many.defect`, p(x) into `many.trial`.

    Returns its norm by mass, and its largest velocity. With `all_hold` the law is left out: p = q - ρ u.
    """
    first, last, begin, end = part
    for i in range(begin, end):
        b = many.order[i]
        for c in range(SIZE):
            many.defect[b, c] = many.twist[b, c] - many.free[b, c]
    for i in range(first, last):
        k = many.queue[i]
        u, t, q = local_velocity(k, many), vector(many.target, k, 0), vector(many.impulse, k, 0)
        y = (q[0] - rho * (u[0] - t[0]), q[1] - rho * (u[1] - t[1]), q[2] - rho * (u[2] - t[2]))
        p = y if all_hold else law(y, many.mu[k])
        put(many.aim, k, 0, y)
        put(many.trial, k, 0, p)
        push(k, (-p[0], -p[1], -p[2]), many.defect, many)
    total = worst = 0.0
    for i in range(begin, end):
        b = many.order[i]
        v, w, r = vector(many.defect, b, 0), vector(many.defect, b, 3), many.bodies[b].radius
        square = qt.dot(v, v) + r * r * qt.dot(w, w)
        total += many.bodies[b].mass * square
        worst = max(worst, square)
    return math.sqrt(total), math.sqrt(worst)


@inlined
def _slopes(y, mu):
    """Derivative of the law at y > 0, row by row."""
    size, limit = math.sqrt(y[1] * y[1] + y[2] * y[2]), mu * y[0]
    if not limit > 0.0:
        return (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    if not size > limit:
        return (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    a, b, s = y[1] / size, y[2] / size, limit / size
    return (1.0, 0.0, 0.0, mu * a, s * (1.0 - a * a), -s * a * b, mu * b, -s * a * b, s * (1.0 - b * b))


@inlined
def _world_rows(D, E, rho):
    """Rows of ρ Eᵀ D E: D is given in the frame whose axes are the rows of E."""
    x = qt.transposed_matvec(D, (rho * E[0], rho * E[3], rho * E[6]))
    y = qt.transposed_matvec(D, (rho * E[1], rho * E[4], rho * E[7]))
    z = qt.transposed_matvec(D, (rho * E[2], rho * E[5], rho * E[8]))
    return qt.transposed_matvec(E, x), qt.transposed_matvec(E, y), qt.transposed_matvec(E, z)


@inlined
def _weigh(end, A, r, many):
    """`many.weighed`: A J of one end, J = (1, -[r]×) from the twist of its body to the velocity of its point."""
    W = many.weighed
    for c in range(3):
        g = qt.cross(r, A[c])
        W[end, c, 0], W[end, c, 1], W[end, c, 2] = A[c]
        W[end, c, 3], W[end, c, 4], W[end, c, 5] = g


@inlined
def _add_rows(B, place, r, s, x, t, y):
    """Add s x + t y to row r of the block B[place]."""
    old = six(B, place, r)
    B[place, r, 0], B[place, r, 1], B[place, r, 2], B[place, r, 3], B[place, r, 4], B[place, r, 5] = (
        old[0] + (s * x[0] + t * y[0]), old[1] + (s * x[1] + t * y[1]), old[2] + (s * x[2] + t * y[2]),
        old[3] + (s * x[3] + t * y[3]), old[4] + (s * x[4] + t * y[4]), old[5] + (s * x[5] + t * y[5]),
    )  # fmt: skip


@inlined
def _add_row(B, place, r, s, x):
    """Add s x to row r of the block B[place]."""
    old = six(B, place, r)
    B[place, r, 0], B[place, r, 1], B[place, r, 2], B[place, r, 3], B[place, r, 4], B[place, r, 5] = (
        old[0] + s * x[0], old[1] + s * x[1], old[2] + s * x[2],
        old[3] + s * x[3], old[4] + s * x[4], old[5] + s * x[5],
    )  # fmt: skip


@inlined
def _add_product(B, place, r, j, s, many):
    """Add s Jᵀ (A J of end j) to the block B[place], Jᵀ = (1; [r]×) of the end that the rows belong to."""
    x, y, z = six(many.weighed, j, 0), six(many.weighed, j, 1), six(many.weighed, j, 2)
    _add_row(B, place, 0, s, x)
    _add_row(B, place, 1, s, y)
    _add_row(B, place, 2, s, z)
    _add_rows(B, place, 3, s * r[1], z, -s * r[2], y)
    _add_rows(B, place, 4, s * r[2], x, -s * r[0], z)
    _add_rows(B, place, 5, s * r[0], y, -s * r[1], x)


@inlined
def add_contact(k, D, rho, many):
    """Add Jᵀ ρ D J of contact k to the blocks of its bodies; D: nine numbers, row by row, in the contact's frame."""
    a, b = many.ends[k, 0], many.ends[k, 1]
    A, r = _world_rows(D, matrix(many.frame, k), rho), vector(many.arm, k, 0)
    _weigh(0, A, r, many)
    _add_product(many.diagonal, a, r, 0, 1.0, many)
    if b < 0:
        return
    t = vector(many.arm, k, 3)
    _weigh(1, A, t, many)
    _add_product(many.diagonal, b, t, 1, 1.0, many)
    if many.rank[a] < many.rank[b]:
        place = place_of(a, b, many)
        _add_product(many.upper, place, r, 1, -1.0, many)
        _add_product(many.lower, place, t, 0, -1.0, many)
    else:
        place = place_of(b, a, many)
        _add_product(many.upper, place, t, 0, -1.0, many)
        _add_product(many.lower, place, r, 1, -1.0, many)


@inlined
def _respond(B, place, b, many):
    """Multiply the rows of the block B[place] by M⁻¹ of body b."""
    m = many.lightness[b]
    for c in range(SIZE):
        w = turned(b, (B[place, 3, c], B[place, 4, c], B[place, 5, c]), many)
        B[place, 0, c], B[place, 1, c], B[place, 2, c] = m * B[place, 0, c], m * B[place, 1, c], m * B[place, 2, c]
        B[place, 3, c], B[place, 4, c], B[place, 5, c] = w


@inlined
def complete_matrix(begin, end, many):
    """1 + M⁻¹ times what contacts have added."""
    for i in range(begin, end):
        b = many.order[i]
        _respond(many.diagonal, b, b, many)
        for c in range(SIZE):
            many.diagonal[b, c, c] += 1.0
        for k in range(many.start[b], many.stop[b]):
            _respond(many.upper, k, b, many)
            _respond(many.lower, k, many.column[k], many)


@kernel
def fill_matrix(part, rho, all_hold, many):
    """Newton's matrix of an island at the point of the last `defect`."""
    first, last, begin, end = part
    clear(begin, end, many)
    for i in range(first, last):
        k = many.queue[i]
        y = (1.0, 0.0, 0.0) if all_hold else vector(many.aim, k, 0)
        if y[0] > 0.0:
            add_contact(k, _slopes(y, many.mu[k]), rho, many)
    complete_matrix(begin, end, many)
