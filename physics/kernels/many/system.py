"""The system that `newton` solves: its defect x - M⁻¹ Jᵀ p(x), and its matrix 1 + M⁻¹ Jᵀ ρ p' J."""

from __future__ import annotations

import math

from physics.kernels import quaternion as qt
from physics.kernels.compiler import inlined, kernel
from physics.kernels.many.blocks import SIZE, clear, place_of, six
from physics.kernels.many.contacts import local_velocity, put, vector
from physics.kernels.many.sweeps import push, turned


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
def _write_rows(k, end, first, sign, many):
    """Jacobian rows of one end of contact k, and what its body answers to each: `many.row`, `many.reply`."""
    r, E, b = vector(many.arm, k, first), many.frame, many.ends[k, end]
    m = many.lightness[b]
    for c in range(3):
        e = vector(E, k, 3 * c)
        g = qt.cross(r, e)
        h = turned(b, g, many)
        for s in range(3):
            many.row[end, c, s], many.row[end, c, s + 3] = sign * e[s], sign * g[s]
            many.reply[end, c, s], many.reply[end, c, s + 3] = sign * m * e[s], sign * h[s]


@inlined
def _weigh(end, D, rho, many):
    """`many.weighed`: ρ p' times the rows of one end."""
    row, out = many.row, many.weighed
    for c in range(SIZE):
        x, y, z = rho * row[end, 0, c], rho * row[end, 1, c], rho * row[end, 2, c]
        out[end, 0, c] = D[0] * x + D[1] * y + D[2] * z
        out[end, 1, c] = D[3] * x + D[4] * y + D[5] * z
        out[end, 2, c] = D[6] * x + D[7] * y + D[8] * z


@inlined
def _add_product(A, place, i, j, many):
    """Add M⁻¹ Jᵀ ρ p' J, of end i to end j of a contact, to the block A[place]."""
    reply, x, y, z = many.reply, six(many.weighed, j, 0), six(many.weighed, j, 1), six(many.weighed, j, 2)
    for r in range(SIZE):
        a, b, c, old = reply[i, 0, r], reply[i, 1, r], reply[i, 2, r], six(A, place, r)
        A[place, r, 0], A[place, r, 1], A[place, r, 2], A[place, r, 3], A[place, r, 4], A[place, r, 5] = (
            old[0] + (a * x[0] + b * y[0] + c * z[0]), old[1] + (a * x[1] + b * y[1] + c * z[1]),
            old[2] + (a * x[2] + b * y[2] + c * z[2]), old[3] + (a * x[3] + b * y[3] + c * z[3]),
            old[4] + (a * x[4] + b * y[4] + c * z[4]), old[5] + (a * x[5] + b * y[5] + c * z[5]),
        )  # fmt: skip


@inlined
def add_contact(k, D, rho, many):
    """Add M⁻¹ Jᵀ ρ D J of contact k to the blocks of its bodies; D: nine numbers, row by row."""
    a, b = many.ends[k, 0], many.ends[k, 1]
    _write_rows(k, 0, 0, 1.0, many)
    _weigh(0, D, rho, many)
    _add_product(many.diagonal, a, 0, 0, many)
    if b < 0:
        return
    _write_rows(k, 1, 3, -1.0, many)
    _weigh(1, D, rho, many)
    _add_product(many.diagonal, b, 1, 1, many)
    if many.rank[a] < many.rank[b]:
        place = place_of(a, b, many)
        _add_product(many.upper, place, 0, 1, many)
        _add_product(many.lower, place, 1, 0, many)
    else:
        place = place_of(b, a, many)
        _add_product(many.upper, place, 1, 0, many)
        _add_product(many.lower, place, 0, 1, many)


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
