"""The system that `newton` solves: its defect x - M⁻¹ Jᵀ p(x), and its matrix 1 + M⁻¹ Jᵀ ρ p' J."""

from __future__ import annotations

import math

from physics.kernels import quaternion as qt
from physics.kernels.compiler import inlined, kernel
from physics.kernels.many.contacts import local_velocity, matrix, minus, plus, put, vector
from physics.kernels.many.envelope import SIZE, block_of, clear
from physics.kernels.many.sweeps import turned


@inlined
def law(y, mu):
    """The impulse that `y` stands for: no pull, and the tangential part inside its disk."""
    normal = max(y[0], 0.0)
    size, limit = math.sqrt(y[1] * y[1] + y[2] * y[2]), mu * normal
    s = limit / size if size > limit else 1.0
    return normal, s * y[1], s * y[2]


@inlined
def take_answer(k, p, many):
    """Take M⁻¹ Jᵀ p of contact k off the defects of its bodies."""
    p = qt.transposed_matvec(matrix(many.frame, k), p)
    g, a, b = many.defect, many.ends[k, 0], many.ends[k, 1]
    put(g, a, 0, plus(vector(g, a, 0), -many.lightness[a], p))
    put(g, a, 3, minus(vector(g, a, 3), turned(a, qt.cross(vector(many.arm, k, 0), p), many)))
    if b >= 0:
        put(g, b, 0, plus(vector(g, b, 0), many.lightness[b], p))
        put(g, b, 3, plus(vector(g, b, 3), 1.0, turned(b, qt.cross(vector(many.arm, k, 3), p), many)))


@kernel
def defect(n, rho, all_hold, many):
    """x - M⁻¹ Jᵀ p(x) of every body into `many.defect`, p(x) into `many.trial`: (its norm by mass, largest velocity).

    With `all_hold` the law is left out: p = q - ρ u.
    """
    for b in range(many.twist.shape[0]):
        for c in range(SIZE):
            many.defect[b, c] = many.twist[b, c] - many.free[b, c]
    for k in range(n):
        u, t, q = local_velocity(k, many), vector(many.target, k, 0), vector(many.impulse, k, 0)
        y = (q[0] - rho * (u[0] - t[0]), q[1] - rho * (u[1] - t[1]), q[2] - rho * (u[2] - t[2]))
        p = y if all_hold else law(y, many.mu[k])
        put(many.aim, k, 0, y)
        put(many.trial, k, 0, p)
        take_answer(k, p, many)
    total = worst = 0.0
    for b in range(many.twist.shape[0]):
        if many.touched[b] == 1:
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
def _add_block(i, j, D, rho, many):
    """Add M⁻¹ Jᵀ ρ p' J for ends i and j of a contact to the block of their bodies."""
    row, reply = many.row, many.reply
    A, place = block_of(many.rank[many.at_end[i]], many.rank[many.at_end[j]], many)
    for c in range(SIZE):
        x, y, z = rho * row[j, 0, c], rho * row[j, 1, c], rho * row[j, 2, c]
        p = D[0] * x + D[1] * y + D[2] * z
        q = D[3] * x + D[4] * y + D[5] * z
        s = D[6] * x + D[7] * y + D[8] * z
        for r in range(SIZE):
            A[place, r, c] += reply[i, 0, r] * p + reply[i, 1, r] * q + reply[i, 2, r] * s


@kernel
def fill_matrix(n, count, rho, all_hold, many):
    """Newton's matrix at the point of the last `defect`."""
    clear(count, many)
    for k in range(n):
        y = (1.0, 0.0, 0.0) if all_hold else vector(many.aim, k, 0)
        if not y[0] > 0.0:
            continue
        D = _slopes(y, many.mu[k])
        many.at_end[0], many.at_end[1] = many.ends[k, 0], many.ends[k, 1]
        ends = 1
        _write_rows(k, 0, 0, 1.0, many)
        if many.ends[k, 1] >= 0:
            _write_rows(k, 1, 3, -1.0, many)
            ends = 2
        for i in range(ends):
            for j in range(ends):
                _add_block(i, j, D, rho, many)
