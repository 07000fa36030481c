"""Contact problems on which sweeps crawl: Newton's method on the twists of all bodies, in a proximal-point iteration.

What `physics.kernels.proximal` does for one body, for a world of them. With x the change of all twists, for impulses q
near the solution let

    p(x) = law(q - ρ u(x)),    u(x) = J x + b,

contact by contact; x = M⁻¹ Jᵀ p(x) is a nonlinear system for the twists alone, whose Newton matrix
1 + M⁻¹ Jᵀ ρ p' J has a 6 x 6 block where two bodies touch (`envelope`). Then q = p(x) and again. A round contracts by
about 1/(1 + ρ w) with w the smallest mobility that matters: the inverse of the heaviest mass that a contact may have to
carry, whatever that contact's own mass is. So ρ is a multiple of the largest mass in the problem, and a heavy block on
a light one takes no more rounds than two of a kind.

The first guess is that everything holds: then the law is linear, and one linear system is the answer for whatever
stands still, however high or heavy. Where ρ grows too large for Newton's method to find its pieces, the round is
thrown away and ρ shrinks.
"""

from __future__ import annotations

import math

from physics.kernels import quaternion as qt
from physics.kernels.compiler import inlined, kernel
from physics.kernels.many.contacts import local_velocity, matrix, minus, plus, put, vector
from physics.kernels.many.envelope import SIZE, block_of, clear, factor, lay_out, substitute
from physics.kernels.many.sweeps import residual_of, turned

# ρ in units of the largest mass: of the guess that everything holds, with its rounds and the share of the residual
# asked for at which they end; of the first round after that guess, and after sweeps; its growth from round to round,
# the largest, and what it shrinks by when a round fails.
HOLD_FACTOR = 1.0e4
HOLD_ROUNDS = 5
HOLD_SHARE = 1.0e-3
AFTER_HOLD = 10.0
AFTER_SWEEPS = 0.1
FACTOR_GROWTH = 10.0
FACTOR_LIMIT = 1.0e8
FACTOR_LOSS = 30.0

# Rounds that may fail; Newton steps of a round, halvings of a step, and steps without progress, at most.
FAILED_ROUNDS = 4
NEWTON_STEPS = 20
HALVINGS = 10
FAILED_STEPS = 2

# A round is solved to this share of the residual met so far, or of a hundred times the one that is asked for.
ROUND_SHARE = 0.01
ENOUGH = 100.0

# Multiplications of a contact in one sweep, of one in the Newton matrix, and of a row of the envelope per width².
SWEEP_WORK = 250.0
CONTACT_WORK = 1500.0
BLOCK_WORK = 2.0 * SIZE**3

# Work that Newton's method may take, in that of the sweeps allowed; fewer steps than these lead nowhere.
WORTH = 4.0
LEAST_STEPS = 6


@inlined
def _law(y, mu):
    """The impulse that `y` stands for: no pull, and the tangential part inside its disk."""
    normal = max(y[0], 0.0)
    size, limit = math.sqrt(y[1] * y[1] + y[2] * y[2]), mu * normal
    s = limit / size if size > limit else 1.0
    return normal, s * y[1], s * y[2]


@inlined
def _take_answer(k, p, many):
    """Take M⁻¹ Jᵀ p of contact k off the defects of its bodies."""
    p = qt.transposed_matvec(matrix(many.frame, k), p)
    g, a, b = many.defect, many.ends[k, 0], many.ends[k, 1]
    put(g, a, 0, plus(vector(g, a, 0), -many.lightness[a], p))
    put(g, a, 3, minus(vector(g, a, 3), turned(a, qt.cross(vector(many.arm, k, 0), p), many)))
    if b >= 0:
        put(g, b, 0, plus(vector(g, b, 0), many.lightness[b], p))
        put(g, b, 3, plus(vector(g, b, 3), 1.0, turned(b, qt.cross(vector(many.arm, k, 3), p), many)))


@kernel
def _defect(n, rho, all_hold, many):
    """x - M⁻¹ Jᵀ p(x) of every body into `many.defect`, p(x) into `many.trial`: (its norm by mass, largest velocity).

    With `all_hold` the law is left out: p = q - ρ u.
    """
    for b in range(many.twist.shape[0]):
        for c in range(SIZE):
            many.defect[b, c] = many.twist[b, c] - many.free[b, c]
    for k in range(n):
        u, t, q = local_velocity(k, many), vector(many.target, k, 0), vector(many.impulse, k, 0)
        y = (q[0] - rho * (u[0] - t[0]), q[1] - rho * (u[1] - t[1]), q[2] - rho * (u[2] - t[2]))
        p = y if all_hold else _law(y, many.mu[k])
        put(many.aim, k, 0, y)
        put(many.trial, k, 0, p)
        _take_answer(k, p, many)
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
def _fill_matrix(n, count, rho, all_hold, many):
    """Newton's matrix at the point of the last `_defect`."""
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


@inlined
def _follow(count, many):
    """Solve the factored system for the defect and take it off the twists."""
    for i in range(count):
        for c in range(SIZE):
            many.change[i, c] = -many.defect[many.order[i], c]
    substitute(count, many.change, many)
    for i in range(count):
        for c in range(SIZE):
            many.twist[many.order[i], c] += many.change[i, c]


@kernel
def _newton_step(n, count, rho, norm, many):
    """One damped Newton step on the twists from a defect of the given norm: the new (norm, largest velocity)."""
    _fill_matrix(n, count, rho, False, many)
    factor(count, many)
    for i in range(count):
        b = many.order[i]
        for c in range(SIZE):
            many.change[i, c] = -many.defect[b, c]
            many.before[b, c] = many.twist[b, c]
    substitute(count, many.change, many)
    after, worst, t = norm, 0.0, 1.0
    for _ in range(HALVINGS):
        for i in range(count):
            b = many.order[i]
            for c in range(SIZE):
                many.twist[b, c] = many.before[b, c] + t * many.change[i, c]
        after, worst = _defect(n, rho, False, many)
        if after < norm:
            break
        t *= 0.5
    return after, worst


@inlined
def _apply(n, impulse, many):
    """Twists from the free ones and the given impulses."""
    for b in range(many.twist.shape[0]):
        for c in range(SIZE):
            many.defect[b, c] = 0.0
    for k in range(n):
        _take_answer(k, vector(impulse, k, 0), many)
    for b in range(many.twist.shape[0]):
        for c in range(SIZE):
            many.twist[b, c] = many.free[b, c] - many.defect[b, c]


@inlined
def _copy(n, source, target):
    for k in range(n):
        put(target, k, 0, vector(source, k, 0))


@inlined
def _take_trial(n, many):
    """Take the impulses of the last `_defect`, as the law allows them, and the twists that belong to them."""
    for k in range(n):
        put(many.impulse, k, 0, _law(vector(many.trial, k, 0), many.mu[k]))
    _apply(n, many.impulse, many)


@inlined
def _restore(n, many):
    """Back to the best impulses met."""
    _copy(n, many.saved, many.impulse)
    _apply(n, many.impulse, many)


@kernel
def _round(n, count, rho, enough, limit, many):
    """p(x) at the x that solves x = M⁻¹ Jᵀ p(x) to `enough` [m/s], into `many.impulse` and the twists: Newton steps."""
    norm, worst = _defect(n, rho, False, many)
    steps = failures = 0
    while worst > enough and steps < limit and failures <= FAILED_STEPS:
        after, worst = _newton_step(n, count, rho, norm, many)
        steps += 1
        if not after < norm:
            failures += 1
        norm = after
    _take_trial(n, many)
    return steps


@inlined
def _steps_worth(n, count, sweeps, many):
    """Newton steps that take `WORTH` times the work of so many sweeps: in a wide pile each of them is dear."""
    work = n * CONTACT_WORK
    for i in range(count):
        width = i - many.first[i] + 1
        work += BLOCK_WORK * width * width
    return int(WORTH * sweeps * n * SWEEP_WORK / work)


@inlined
def _heaviest(count, many):
    """Largest mass among the bodies of the problem [kg]."""
    mass = 0.0
    for i in range(count):
        mass = max(mass, many.bodies[many.order[i]].mass)
    return mass


@kernel
def prepare_newton(n, sweeps, many):
    """Number the bodies for the linear system: Newton steps that the problem is worth, 0 where they are too dear.

    A problem of n contacts that may take so many sweeps is worth `WORTH` times their work.
    """
    count = lay_out(n, many)
    if count == 0:
        return 0, 0
    steps = _steps_worth(n, count, sweeps, many)
    return count, steps if steps >= LEAST_STEPS else 0


@kernel
def guess_all_hold(n, count, friction, residual, goal, many):
    """Impulses as if every contact held, if that makes the residual smaller; the residual then [m/s].

    The law being linear, its matrix is factored once, and a few rounds of q = p(x) cost little more than one: what
    stands still is solved so far below the goal that the steps to come find nothing to do.
    """
    rho = HOLD_FACTOR * _heaviest(count, many)
    _copy(n, many.impulse, many.saved)
    _fill_matrix(n, count, rho, True, many)
    factor(count, many)
    for _ in range(HOLD_ROUNDS):
        _defect(n, rho, True, many)
        _follow(count, many)
        _defect(n, rho, True, many)
        _take_trial(n, many)
        now = residual_of(n, friction, many)
        if not now < residual:
            _restore(n, many)
            break
        residual = now
        _copy(n, many.impulse, many.saved)
        if residual <= HOLD_SHARE * goal:
            break
    return residual


@kernel
def newton_contacts(n, count, friction, residual, goal, limit, scale, many):
    """Improve the impulses of the world's contact problem until the residual is within `goal` [m/s].

    Parameters
    ----------
    n, count : int
        Contacts, and bodies in them. `many.impulse` is the start, `many.free` the twists without any impulse;
        `many.impulse` and `many.twist` receive the best that was met.
    residual, goal : float
        Of the start, and asked for [m/s].
    limit : int
        Newton steps at most.
    scale : float
        ρ of the first round, in units of the largest mass.

    Returns
    -------
    steps : int
    residual : float
        [m/s], measured on what is returned.
    """
    mass, failures, steps = _heaviest(count, many), 0, 0
    _copy(n, many.impulse, many.saved)
    while residual > goal and failures <= FAILED_ROUNDS and steps < limit:
        enough = ROUND_SHARE * min(ENOUGH * goal, residual)
        steps += max(1, _round(n, count, scale * mass, enough, min(NEWTON_STEPS, limit - steps), many))
        now = residual_of(n, friction, many)
        if now < residual:
            residual = now
            _copy(n, many.impulse, many.saved)
            scale = min(FACTOR_GROWTH * scale, FACTOR_LIMIT)
        else:
            failures += 1
            scale /= FACTOR_LOSS
            _restore(n, many)
    return steps, residual
