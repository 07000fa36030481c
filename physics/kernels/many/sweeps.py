"""Sweeps over all contacts of a world with the exact circular Coulomb cone, on the twists of the bodies (`response`).

A visit of one contact answers it alone (`point.answer`), and sweeps go up and down the list in turns, so that loads
travel through a stack in both senses.
"""

from __future__ import annotations

from physics.kernels import quaternion as qt
from physics.kernels.compiler import inlined, kernel
from physics.kernels.many.contacts import matrix, put, vector
from physics.kernels.many.response import on_disk, put_inverse, residual_of
from physics.kernels.many.rows import normal_velocity, push_normal, push_rows, set_motion, set_twists, velocity
from physics.kernels.point import LOST, answer, heading

# Share of the residual asked for to which one contact is answered.
ANSWER_SHARE = 0.1

# Sweeps between two extrapolations, an even number: those up and down belong together. Slow sweeps contract along one
# direction with a ratio q near 1, which two changes tell; the rest of that series, q/(1 - q) times the last change, is
# added at once. See `physics.kernels.sweeps`.
EXTRAPOLATION_PERIOD = 4
RATIO_LIMIT = 0.998


@inlined
def is_answered(k, many):
    """Whether no body of contact k has been pushed since its last visit."""
    a, b = many.ends[k, 0], many.ends[k, 1]
    return many.visited[k] >= many.pushed[a] and (b < 0 or many.visited[k] >= many.pushed[b])


@inlined
def answer_normal(k, visit, small, many):
    """Answer contact k along its normal if it is off by more than `small`: how far its impulse was off, as a velocity
    [m/s]. `visit` is the number of this visit.
    """
    a, b = many.ends[k, 0], many.ends[k, 1]
    many.visited[k] = visit
    p, normal = many.impulse[k, 0], many.block[k, 0]
    d = max(0.0, p - (normal_velocity(k, many) - many.target[k, 0]) / normal) - p
    off = abs(d) * normal
    if off > small:
        many.impulse[k, 0] = p + d
        push_normal(k, d, many)
        many.pushed[a] = visit
        if b >= 0:
            many.pushed[b] = visit
    return off


@kernel
def sweep_normals(first, last, residual, goal, limit, many):
    """`sweep_contacts` without friction: impulses along the normals only.

    A contact that has been answered is passed over until a body of it has been pushed again, and it is not answered
    where what it is off by is a small share of the goal: where little is to be done, few contacts are visited.
    """
    sweeps = visits = 0
    for i in range(first, last):
        k = many.queue[i]
        many.visited[k] = -1
        many.pushed[many.ends[k, 0]] = 0
        if many.ends[k, 1] >= 0:
            many.pushed[many.ends[k, 1]] = 0
    set_motion(first, last, many)
    while not residual <= goal and sweeps < limit:
        worst, before = 0.0, visits
        for i in range(first, last):
            k = many.queue[i if sweeps % 2 == 0 else first + last - 1 - i]
            if is_answered(k, many):
                continue
            visits += 1
            worst = max(worst, answer_normal(k, visits, ANSWER_SHARE * goal, many))
        sweeps += 1
        if worst <= goal or sweeps == limit:
            set_twists(first, last, many)
            residual = residual_of(first, last, None, many)
        if visits == before:
            break  # all are answered, and stay so
    return sweeps, residual


@inlined
def _answer_one(k, p, u, goal, many):
    """Impulse of contact k that answers its own velocity, all others held."""
    W, V, mu, step = matrix(many.block, k), many.inverse, many.mu[k], many.step[k]
    own = qt.matvec(W, p)
    b = (u[0] - own[0], u[1] - own[1], u[2] - own[2])
    if b[0] >= 0.0:
        return (0.0, 0.0, 0.0)
    q = (
        p[0] - (V[k, 0] * u[0] + V[k, 1] * u[1] + V[k, 2] * u[2]),
        p[1] - (V[k, 1] * u[0] + V[k, 3] * u[1] + V[k, 4] * u[2]),
        p[2] - (V[k, 2] * u[0] + V[k, 4] * u[1] + V[k, 5] * u[2]),
    )
    if q[0] >= 0.0 and q[1] * q[1] + q[2] * q[2] <= (mu * q[0]) * (mu * q[0]):
        return q
    x, y = (p[1], p[2]) if p[0] > 0.0 and p[1] * p[1] + p[2] * p[2] > 0.0 else (q[1], q[2])
    x, y = heading(-x, -y, mu)
    what, q, _ = answer(W, b, mu, W[4] + W[8], goal, x, y, False)
    if what != LOST:
        return q
    # The normal impulse first, then the tangential step, back on the disk.
    normal = max(0.0, p[0] - u[0] / W[0])
    d = normal - p[0]
    x, y = on_disk(p[1] - step * (u[1] + W[3] * d), p[2] - step * (u[2] + W[6] * d), mu * normal)
    return (normal, x, y)


@inlined
def _visit(k, goal, many):
    """Answer contact k; how far its impulse was off, as a velocity [m/s]: its residual or a little more."""
    u, t, p, normal = velocity(k, many), vector(many.target, k, 0), vector(many.impulse, k, 0), many.block[k, 0]
    u = (u[0] - t[0], u[1] - t[1], u[2] - t[2])
    q = _answer_one(k, p, u, goal, many)
    d = (q[0] - p[0], q[1] - p[1], q[2] - p[2])
    if d[0] == 0.0 and d[1] == 0.0 and d[2] == 0.0:
        return 0.0
    put(many.impulse, k, 0, q)
    push_rows(k, d, many)
    return max(abs(d[0]) * normal, max(abs(d[1]), abs(d[2])) / many.step[k])


@inlined
def _note_change(first, last, many):
    """`many.trend`: what the impulses have changed by since the last call. Returns its product with the change before
    and the square of that one, weighed by W_nn as kinetic energy.
    """
    product = square = 0.0
    for i in range(first, last):
        k = many.queue[i]
        p, old, before = vector(many.impulse, k, 0), vector(many.settled, k, 0), vector(many.trend, k, 0)
        d = (p[0] - old[0], p[1] - old[1], p[2] - old[2])
        product += many.block[k, 0] * qt.dot(d, before)
        square += many.block[k, 0] * qt.dot(before, before)
        put(many.trend, k, 0, d)
        put(many.settled, k, 0, p)
    return product, square


@inlined
def _extrapolate(first, last, s, many):
    """Impulses plus s times their last change, back in the cones, and the twists that belong to them."""
    for i in range(first, last):
        k = many.queue[i]
        p, d = vector(many.impulse, k, 0), vector(many.trend, k, 0)
        normal = max(0.0, p[0] + s * d[0])
        x, y = on_disk(p[1] + s * d[1], p[2] + s * d[2], many.mu[k] * normal)
        put(many.impulse, k, 0, (normal, x, y))
        put(many.settled, k, 0, (normal, x, y))
        push_rows(k, (normal - p[0], x - p[1], y - p[2]), many)


@inlined
def _begin_sweeps(first, last, many):
    set_motion(first, last, many)
    for i in range(first, last):
        k = many.queue[i]
        put_inverse(k, many)
        put(many.settled, k, 0, vector(many.impulse, k, 0))
        put(many.trend, k, 0, (0.0, 0.0, 0.0))


@kernel
def sweep_contacts(first, last, friction, residual, goal, limit, many):
    """Improve the impulses of `many.queue[first:last]` by sweeps until the residual is at most `goal` [m/s].

    `many.impulse` and `many.twist`, which belong to each other, hold the start, whose residual is given, and receive
    the result. Returns the number of sweeps, `limit` at most, and the residual, measured on what is returned.
    """
    if friction is None:
        return sweep_normals(first, last, residual, goal, limit, many)
    sweeps = 0
    if not residual <= goal:
        _begin_sweeps(first, last, many)
    while not residual <= goal and sweeps < limit:
        worst = 0.0
        for i in range(first, last):
            k = many.queue[i if sweeps % 2 == 0 else first + last - 1 - i]
            worst = max(worst, _visit(k, ANSWER_SHARE * goal, many))
        sweeps += 1
        if worst <= goal or sweeps == limit:
            set_twists(first, last, many)
            residual = residual_of(first, last, friction, many)
        elif sweeps % 2 == 0:
            product, square = _note_change(first, last, many)
            if sweeps % EXTRAPOLATION_PERIOD == 0 and product > 0.0:
                ratio = min(product / square, RATIO_LIMIT)
                _extrapolate(first, last, ratio / (1.0 - ratio), many)
    return sweeps, residual
