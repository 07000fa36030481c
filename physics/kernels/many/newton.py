"""Contact problems on which sweeps crawl: Newton's method on the twists of all bodies, in a proximal-point iteration.

What `physics.kernels.proximal` does for one body, for a world of them. With x the change of all twists, for impulses q
near the solution let

    p(x) = law(q - ρ u(x)),    u(x) = J x + b,

contact by contact; x = M⁻¹ Jᵀ p(x) is a nonlinear system for the twists alone, whose Newton matrix
1 + M⁻¹ Jᵀ ρ p' J has a 6 x 6 block where two bodies touch (`envelope`). Then q = p(x) and again. A round contracts by
about 1/(1 + ρ w) with w the smallest mobility that matters: the inverse of the heaviest mass that a contact may have to
carry, whatever that contact's own mass is. So ρ is a multiple of the largest mass in the problem.

The first guess is that everything holds: then the law is linear, and one linear system is the answer for whatever
stands still, however high or heavy. Where ρ grows too large for Newton's method to find its pieces, the round is
thrown away and ρ shrinks.
"""

from __future__ import annotations

from physics.kernels.compiler import inlined, kernel
from physics.kernels.many.contacts import put, vector
from physics.kernels.many.envelope import SIZE, factor, lay_out, substitute
from physics.kernels.many.sweeps import residual_of
from physics.kernels.many.system import defect, fill_matrix, law, take_answer

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
    fill_matrix(n, count, rho, False, many)
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
        after, worst = defect(n, rho, False, many)
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
        take_answer(k, vector(impulse, k, 0), many)
    for b in range(many.twist.shape[0]):
        for c in range(SIZE):
            many.twist[b, c] = many.free[b, c] - many.defect[b, c]


@inlined
def _copy(n, source, target):
    for k in range(n):
        put(target, k, 0, vector(source, k, 0))


@inlined
def _take_trial(n, many):
    """Take the impulses of the last `defect`, as the law allows them, and the twists that belong to them."""
    for k in range(n):
        put(many.impulse, k, 0, law(vector(many.trial, k, 0), many.mu[k]))
    _apply(n, many.impulse, many)


@inlined
def _restore(n, many):
    """Back to the best impulses met."""
    _copy(n, many.saved, many.impulse)
    _apply(n, many.impulse, many)


@kernel
def _round(n, count, rho, enough, limit, many):
    """p(x) at the x that solves x = M⁻¹ Jᵀ p(x) to `enough` [m/s], into `many.impulse` and the twists: Newton steps."""
    norm, worst = defect(n, rho, False, many)
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
    fill_matrix(n, count, rho, True, many)
    factor(count, many)
    for _ in range(HOLD_ROUNDS):
        defect(n, rho, True, many)
        _follow(count, many)
        defect(n, rho, True, many)
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
