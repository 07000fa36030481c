"""Sweeps over all contacts of a world with the circular Coulomb cone, on the twists of bodies (`contact_operator`).

A visit of one contact answers it alone (`one_contact.answer`), and sweeps go up and down the list in turns, so that
loads travel through a stack in both senses.

Most contacts are soon answered and stay so: where something lands on a pile, few others have anything to do. A contact
is visited only if one of its bodies has been pushed since, and it is left as it is where it is off by less than the
tolerance. The returned impulses are checked whole.
"""

from __future__ import annotations

from physics.kernels.compile.decorators import inlined, kernel
from physics.kernels.contact_solver.one_contact import LOST, answer, heading
from physics.kernels.math import quaternion as qt
from physics.kernels.multibody.data.contact_set import minus, put, vector
from physics.kernels.multibody.solver.contact_operator import natural_map, on_disk, residual_of
from physics.kernels.multibody.solver.contact_rows import (
    BLOCK,
    IMPULSE,
    INVERSE,
    MU,
    STIFF,
    UNKNOWN,
    line_up,
    push,
    put_inverse,
    six,
    take_back,
    velocity,
)
from physics.kernels.multibody.solver.normal_rows import (
    assemble_normal,
    normal_velocity,
    push_normal,
    set_motion,
    set_twists,
)

# Share of the tolerance to which one contact is answered, and within which it is left as it is, each that is
# answered leaving those of two bodies to be visited again; and the same without friction.
LEFT_SHARE = 0.9
NORMAL_SHARE = 0.1

# Of a contact that has been seen to miss too much: it is visited and answered whatever its bodies did.
NEVER = -1

# Goings through the list for each sweep allowed, at most: with little to visit they cost little, but not nothing.
PASSES = 10

# Half of the sweeps between two extrapolations, an even number: those up and down belong together. Slow sweeps contract
# along one direction with a ratio q near 1, which two changes tell; the rest of that series, q/(1 - q) times the last
# change, is added at once. See `physics.kernels.contact_solver.gauss_seidel`. (Two more sweeps between them save a
# tenth of the visits where the tolerance is loose, and leave arches at their limit unsolved five times as often at
# `precise`.) There is no extrapolation if so few sweeps are allowed: the small rest is no series.
HALF_PERIOD = 2
RATIO_LIMIT = 0.998

# Of impulses that are not kept: no visit has a number as low.
NO_MARK = -2


@inlined
def _is_answered(i, a, b, many):
    """True if neither of two bodies (b < 0: a wall) has been pushed since the last visit i."""
    return many.visited[i] >= many.pushed[a] and (b < 0 or many.visited[i] >= many.pushed[b])


@inlined
def is_answered(k, many):
    """True if no body of contact k has been pushed since its last visit."""
    return _is_answered(k, many.ends[k, 0], many.ends[k, 1], many)


@inlined
def _mark_pushed(a, b, visit, many):
    """Note that two bodies (b < 0: a wall) have been pushed in this visit."""
    many.pushed[a] = visit
    if b >= 0:
        many.pushed[b] = visit


@inlined
def answer_normal(k, visit, small, many):
    """Answer contact k along its normal if it is off by more than `small`: its error before, as a velocity [m/s].

    `visit` is the number of this visit.
    """
    many.visited[k] = visit
    p, normal = many.impulse[k, 0], many.block[k, 0]
    d = max(0.0, p - (normal_velocity(k, many) - many.target[k, 0]) / normal) - p
    off = abs(d) * normal
    if off > small:
        many.impulse[k, 0] = p + d
        push_normal(k, d, many)
        _mark_pushed(many.ends[k, 0], many.ends[k, 1], visit, many)
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
        assemble_normal(k, many)
        many.visited[k] = NEVER
        _mark_pushed(many.ends[k, 0], many.ends[k, 1], 0, many)
    set_motion(first, last, many)
    while not residual <= goal and sweeps < limit:
        worst, before = 0.0, visits
        for i in range(first, last):
            k = many.queue[i if sweeps % 2 == 0 else first + last - 1 - i]
            if is_answered(k, many):
                continue
            visits += 1
            worst = max(worst, answer_normal(k, visits, NORMAL_SHARE * goal, many))
        sweeps += 1
        if worst <= goal or sweeps == limit:
            set_twists(first, last, many)
            residual = residual_of(first, last, None, many)
        if visits == before:
            break  # all are answered, and stay so
    return sweeps, residual


@inlined
def _answer_one(W, V, mu, step, p, u, goal):
    """Impulse of a contact that answers its own velocity u, all others held; W and its inverse V are symmetric."""
    own = qt.symmetric_matvec(W, p)
    b = minus(u, own)
    if b[0] >= 0.0:
        return (0.0, 0.0, 0.0)
    q = minus(p, qt.symmetric_matvec(V, u))
    if q[0] >= 0.0 and q[1] * q[1] + q[2] * q[2] <= (mu * q[0]) * (mu * q[0]):
        return q
    x, y = (p[1], p[2]) if p[0] > 0.0 and p[1] * p[1] + p[2] * p[2] > 0.0 else (q[1], q[2])
    x, y = heading(-x, -y, mu)
    full = (W[0], W[1], W[2], W[1], W[3], W[4], W[2], W[4], W[5])
    what, q, _ = answer(full, b, mu, W[3] + W[5], goal, x, y, False)
    if what != LOST:
        return q
    # The normal impulse first, then the tangential step, back on the disk.
    normal = max(0.0, p[0] - u[0] / W[0])
    d = normal - p[0]
    x, y = on_disk(p[1] - step * (u[1] + W[1] * d), p[2] - step * (u[2] + W[2] * d), mu * normal)
    return (normal, x, y)


@inlined
def _size(i, d, many):
    """A change d of an impulse, as a velocity [m/s]."""
    return max(abs(d[0]) * many.visit[i, BLOCK], max(abs(d[1]), abs(d[2])) * many.visit[i, STIFF])


@inlined
def _keep_before(i, p, marks, many):
    """Keep the impulse of visit i as it was at two moments, if it has not been visited since then."""
    if many.visited[i] <= marks[0]:
        put(many.settled, i, 0, p)
    if many.visited[i] <= marks[1]:
        put(many.trend, i, 0, p)


@inlined
def _visit(i, number, marks, small, many):
    """Answer visit i if it is off by more than `small`, or has been seen to be: its error before [m/s].

    The error is a velocity, the contact's residual or a little more. `number` is that of this visit.
    """
    W, p = six(i, BLOCK, many), vector(many.visit, i, IMPULSE)
    _keep_before(i, p, marks, many)
    left = 0.0 if many.visited[i] == NEVER else small
    many.visited[i] = number
    if many.visit[i, INVERSE] == UNKNOWN:
        put_inverse(i, W, many)
    u = velocity(i, many)
    q = _answer_one(W, six(i, INVERSE, many), many.visit[i, MU], 1.0 / many.visit[i, STIFF], p, u, small)
    d = minus(q, p)
    off = _size(i, d, many)
    if off > left:
        put(many.visit, i, IMPULSE, q)
        push(i, d, many)
        _mark_pushed(many.side[i, 0], many.side[i, 1], number, many)
    return off


@inlined
def _ratio(count, marks, many):
    """Ratio of the last change of the impulses to the one before, in the metric of W_nn; 0: not along it."""
    product = square = 0.0
    for i in range(count):
        if many.visited[i] <= marks[0]:
            continue
        p, weight = vector(many.visit, i, IMPULSE), many.visit[i, BLOCK]
        middle = vector(many.trend, i, 0) if many.visited[i] > marks[1] else p
        before = minus(middle, vector(many.settled, i, 0))
        product += weight * qt.dot(minus(p, middle), before)
        square += weight * qt.dot(before, before)
    return min(product / square, RATIO_LIMIT) if product > 0.0 else 0.0


@inlined
def _extrapolate(count, ratio, number, marks, small, many):
    """Add to the impulses the rest of the series of their last change, and bring them back into the cones.

    The motion of the bodies follows.
    """
    s = ratio / (1.0 - ratio)
    for i in range(count):
        if many.visited[i] <= marks[1]:
            continue
        p = vector(many.visit, i, IMPULSE)
        d = minus(p, vector(many.trend, i, 0))
        normal = max(0.0, p[0] + s * d[0])
        x, y = on_disk(p[1] + s * d[1], p[2] + s * d[2], many.visit[i, MU] * normal)
        d = (normal - p[0], x - p[1], y - p[2])
        put(many.visit, i, IMPULSE, (normal, x, y))
        push(i, d, many)
        if _size(i, d, many) > small:
            _mark_pushed(many.side[i, 0], many.side[i, 1], number, many)


@inlined
def _look(count, small, many):
    """The residual [m/s]. Who misses more than `small` is to be visited, others once a body of theirs moves."""
    worst = 0.0
    for i in range(count):
        R = many.visit
        miss = natural_map(vector(R, i, IMPULSE), velocity(i, many), R[i, BLOCK], 1.0 / R[i, STIFF], R[i, MU])
        many.visited[i] = 0 if miss <= small else NEVER
        _mark_pushed(many.side[i, 0], many.side[i, 1], 0, many)
        if not miss <= worst:  # also what is not a number
            worst = miss
    return worst


@kernel
def _sweep(count, is_up, visits, marks, small, many):
    """One sweep over those that have to be visited: how far an impulse was off at most [m/s], and visits so far."""
    worst = 0.0
    for j in range(count):
        i = j if is_up else count - 1 - j
        if not _is_answered(i, many.side[i, 0], many.side[i, 1], many):
            visits += 1
            worst = max(worst, _visit(i, visits, marks, small, many))
    return worst, visits


@kernel
def _sweep_on(count, residual, goal, limit, many):
    """Sweep until the residual is at most `goal`, or for so many visits: (visits, residual [m/s])."""
    small, most, passes, visits, since, marks = LEFT_SHARE * goal, limit * count, 0, 0, 0, (NO_MARK, NO_MARK)
    while not residual <= goal and visits < most and passes < PASSES * limit:
        if since == 0:
            marks = (visits, NO_MARK)
        elif since == HALF_PERIOD:
            marks = (marks[0], visits)
        worst, visits = _sweep(count, passes % 2 == 0, visits, marks, small, many)
        passes, since = passes + 1, since + 1
        if worst <= goal or visits >= most or passes == PASSES * limit:
            residual, since = _look(count, goal, many), 0
        elif since == 2 * HALF_PERIOD:
            ratio, since = _ratio(count, marks, many) if limit > since else 0.0, 0
            if ratio > 0.0:
                _extrapolate(count, ratio, visits + 1, marks, small, many)
    return visits, residual


@kernel
def sweep_contacts(first, last, friction, residual, goal, limit, many):
    """Improve the impulses of `many.queue[first:last]` by sweeps until the residual is at most `goal` [m/s].

    `many.impulse` and `many.twist`, which belong to each other, hold the start, whose residual is given, and receive
    the result. Returns the number of sweeps, `limit` at most, and the residual, measured on what is returned. As many
    visits as there are contacts count as a sweep, fewer than that as one; the last begun is finished.
    """
    if friction is None:
        return sweep_normals(first, last, residual, goal, limit, many)
    if residual <= goal or limit <= 0:
        return 0, residual
    count = last - first
    set_motion(first, last, many)
    line_up(first, last, many)
    visits, residual = _sweep_on(count, _look(count, LEFT_SHARE * goal, many), goal, limit, many)
    take_back(first, last, many)
    set_twists(first, last, many)
    return max(1, visits // count), residual
