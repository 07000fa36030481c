"""Newton's method on the twists of all bodies of an island, in a proximal-point iteration.

It serves problems on which sweeps converge slowly. `physics.kernels.contact_solver.proximal_newton` is the same method
for one body. Let x be the change of all twists, q impulses near the solution, and ρ a penalty. For each contact let

    p(x) = proj(q - ρ u(x)),    u(x) = J x + b,

with proj the projection on the friction cone. Then x = M⁻¹ Jᵀ p(x) is a nonlinear system for the twists alone. Its
Newton matrix 1 + M⁻¹ Jᵀ ρ p' J has a 6 x 6 block where two bodies touch (`block_lu`). A proximal round solves it, and
sets q = p(x) for the next round. A round contracts the error by about 1/(1 + ρ w), with w the smallest mobility that
matters. That is the inverse of the heaviest mass that a contact may have to carry, whatever the masses at the contact
are. So ρ is a multiple of the largest mass in the problem.

The first guess is that every contact sticks: then p(x) is linear, and one linear system solves any island that stands
still, however high or heavy. If ρ grows too large for Newton's method to converge, the round is discarded and ρ
shrinks.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.arrays import COLUMN_SIZE, NUM_BATCHES
from physics.kernels.multibody.data.contact_set import put_vector
from physics.kernels.multibody.solver import contact_batches as of
from physics.kernels.multibody.solver.block_lu import TWIST_DOFS, factor_system, solve_factored
from physics.kernels.multibody.solver.contact_operator import apply_contact_impulse, max_contact_residual
from physics.kernels.multibody.solver.minimum_degree import order_elimination
from physics.kernels.multibody.solver.newton_system import assemble_newton_matrix, compute_defect, project_impulse

# ρ in units of the largest mass: its value for the guess that every contact sticks, and the rounds of that guess; then
# its growth from round to round, its largest value, and the factor by which it shrinks when a round fails.
_STICK_RHO = 1.0e4
_STICK_ROUNDS = 5
_RHO_GROWTH = 10.0
_RHO_LIMIT = 1.0e8
_RHO_DECREASE = 30.0

# Largest numbers of failed rounds, of Newton steps of a round, of halvings of a step, of steps without progress.
FAILED_ROUNDS = 4
_NEWTON_STEPS = 20
_STEP_HALVINGS = 10
FAILED_STEPS = 2

# A round is solved to this share of the best residual so far, or of a hundred times the goal, whichever is less.
_ROUND_SHARE = 0.01
_ROUND_FLOOR = 100.0

# Time of a contact in one sweep, of a contact in one Newton step, and of a product of two blocks [ns].
_SWEEP_COST = 25.0
_CONTACT_COST = 230.0
_BLOCK_COST = 60.0

# Allowed cost of iterations with the linear system, in costs of all sweeps allowed. It is small while a pile moves,
# since the next step brings a new problem. It is large once the pile nearly rests: a solution then lasts for long, and
# an unsolved pile creeps for ever. Then the least number of iterations that is worth a start.
MOVING_BUDGET = 10.0
RESTING_BUDGET = 200.0
MIN_NEWTON_STEPS = 12


@inlined
def _apply_newton_direction(part, many):
    """Solve the factored system for the defect, and subtract the solution from the twists of the island `part`."""
    _, _, begin, end = part
    solve_factored(begin, end, many.newton.defect, many)
    for i in range(begin, end):
        b = many.islands.bodies[i]
        for c in range(TWIST_DOFS):
            many.bodies.twist[b, c] -= many.newton.defect[b, c + c // 3]


@kernel
def _newton_step(part, rho, norm, many):
    """Take one damped Newton step on the twists of an island: (norm of the new defect, its largest velocity [m/s]).

    `norm` is the norm of the defect before. The step is halved until the norm decreases. `part` is as in
    `newton_contacts`, `rho` the penalty ρ [kg].
    """
    _, _, begin, end = part
    assemble_newton_matrix(part, rho, False, many)
    factor_system(begin, end, many)
    for i in range(begin, end):
        b = many.islands.bodies[i]
        for c in range(TWIST_DOFS):
            many.newton.before[b, c] = many.bodies.twist[b, c]
        for c in range(COLUMN_SIZE):
            many.newton.change[b, c] = many.newton.defect[b, c]
    solve_factored(begin, end, many.newton.change, many)
    after, worst, t = norm, 0.0, 1.0
    for _ in range(_STEP_HALVINGS):
        for i in range(begin, end):
            b = many.islands.bodies[i]
            for c in range(TWIST_DOFS):
                many.bodies.twist[b, c] = many.newton.before[b, c] - t * many.newton.change[b, c + c // 3]
        after, worst = compute_defect(part, rho, False, many)
        if after < norm:
            break
        t *= 0.5
    return after, worst


@inlined
def _apply_impulses(part, many):
    """Copy the impulses in the batches to the contacts of the island `part`, and compute the twists they cause."""
    _, _, begin, end = part
    for i in range(begin, end):
        b = many.islands.bodies[i]
        for c in range(TWIST_DOFS):
            many.bodies.twist[b, c] = many.bodies.free_twist[b, c]
    for g in range(many.counts[NUM_BATCHES]):
        p = of.batch_vector(g, of.PROX_IMPULSE, many)
        of.scatter_batch(g, p, many.contacts.impulse, many)
        of.apply_batch_impulse(g, p, many.bodies.twist, 3, many)


@inlined
def _gather_impulses(many):
    """Copy the contacts' impulses into the batches, as the present and as the best impulses."""
    for g in range(many.counts[NUM_BATCHES]):
        p = of.gather_batch(g, many.contacts.impulse, many)
        of.put_batch_vector(g, of.PROX_IMPULSE, p, many)
        of.put_batch_vector(g, of.PROX_BEST, p, many)


@inlined
def _save_impulses(many):
    """Save the present impulses in the batches as the best so far."""
    for g in range(many.counts[NUM_BATCHES]):
        of.put_batch_vector(g, of.PROX_BEST, of.batch_vector(g, of.PROX_IMPULSE, many), many)


@inlined
def _accept_trial(part, many):
    """Take over the impulses p(x) of the last `compute_defect`, projected on the cones, and the twists they cause.

    `part` is the island, as in `newton_contacts`.
    """
    for g in range(many.counts[NUM_BATCHES]):
        of.put_batch_vector(
            g,
            of.PROX_IMPULSE,
            project_impulse(of.batch_vector(g, of.PROX_PROJECTED, many), of.batch_field(g, of.LANE_MU, many)),
            many,
        )
    _apply_impulses(part, many)


@inlined
def _restore_impulses(part, many):
    """Restore the best impulses so far of the island `part`, and the twists that they cause."""
    for g in range(many.counts[NUM_BATCHES]):
        of.put_batch_vector(g, of.PROX_IMPULSE, of.batch_vector(g, of.PROX_BEST, many), many)
    _apply_impulses(part, many)


@kernel
def _proximal_round(part, rho, enough, limit, many):
    """Do one proximal round: solve x = M⁻¹ Jᵀ p(x) by Newton steps, and take over the impulses p(x).

    It stops at a defect of at most `enough` [m/s], or after `limit` steps. Returns the number of steps. `part` is as in
    `newton_contacts`, `rho` the penalty ρ [kg].
    """
    norm, worst = compute_defect(part, rho, False, many)
    steps = failures = 0
    while worst > enough and steps < limit and failures <= FAILED_STEPS:
        after, worst = _newton_step(part, rho, norm, many)
        steps += 1
        if not after < norm:
            failures += 1
        norm = after
    _accept_trial(part, many)
    return steps


@inlined
def _heaviest(part, many):
    """Largest mass among the bodies of the island `part` [kg]."""
    mass = 0.0
    for i in range(part[2], part[3]):
        mass = max(mass, many.bodies.body[many.islands.bodies[i]].mass)
    return mass


@kernel
def prepare_system(part, sweeps, worth, fewest, many):
    """Order the bodies of an island for its linear system, and batch its contacts; return the affordable iterations.

    The iterations may cost `worth` times as much as the allowed number of `sweeps`. Returns 0 if that pays for fewer
    than `fewest` iterations, which is known before much is computed, or if the system finds no room. `part` is as in
    `newton_contacts`.
    """
    first, last, begin, end = part
    contacts, worth = (last - first) * _CONTACT_COST, worth * sweeps * (last - first) * _SWEEP_COST
    products = order_elimination(first, last, begin, end, int((worth / fewest - contacts) / _BLOCK_COST), many)
    if products < 0 or not of.batch_contacts(first, last, many):
        return 0
    return min(int(worth / (contacts + products * _BLOCK_COST)), sweeps)


@inlined
def save_best(part, many):
    """Save the present impulses of the island `part` as the best that any method has found."""
    for i in range(part[0], part[1]):
        put_vector(
            many.contacts.best_impulse,
            many.islands.contacts[i],
            0,
            row_vector(many.contacts.impulse, many.islands.contacts[i], 0),
        )


@inlined
def restore_best(part, many):
    """Restore the best impulses that any method has found for the island `part`, and the twists they cause."""
    for i in range(part[2], part[3]):
        for c in range(TWIST_DOFS):
            many.bodies.twist[many.islands.bodies[i], c] = many.bodies.free_twist[many.islands.bodies[i], c]
    for i in range(part[0], part[1]):
        k = many.islands.contacts[i]
        put_vector(many.contacts.impulse, k, 0, row_vector(many.contacts.best_impulse, k, 0))
        apply_contact_impulse(k, row_vector(many.contacts.best_impulse, k, 0), many.bodies.twist, many)


@inlined
def is_every_contact_pushing(part, many):
    """True if all contacts of the island `part` push; else they cannot all stick."""
    for i in range(part[0], part[1]):
        if not many.contacts.impulse[many.islands.contacts[i], 0] > 0.0:
            return False
    return True


@kernel
def try_all_sticking(part, friction, residual, enough, many):
    """Try impulses with every contact sticking, and keep them if the residual falls; return the residual [m/s].

    It stops at a residual of at most `enough` [m/s]. If all contacts stick, the impulses p(x) of the module are linear
    in x. So the matrix is factored once, and a few rounds cost little more than one. A resting stack is solved so far
    below the tolerance that the next steps find nothing to do. `part` and `friction` are as in `newton_contacts`;
    `residual` is that of the start.
    """
    first, last, begin, end = part
    rho = _STICK_RHO * _heaviest(part, many)
    _gather_impulses(many)
    assemble_newton_matrix(part, rho, True, many)
    factor_system(begin, end, many)
    for _ in range(_STICK_ROUNDS):
        compute_defect(part, rho, True, many)
        _apply_newton_direction(part, many)
        compute_defect(part, rho, True, many)
        _accept_trial(part, many)
        now = max_contact_residual(first, last, friction, many)
        if not now < residual:
            _restore_impulses(part, many)
            break
        residual = now
        _save_impulses(many)
        if residual <= enough:
            break
    return residual


@kernel
def newton_contacts(part, friction, residual, goal, limit, scale, many):
    """Improve the impulses of an island by proximal rounds until the residual is at most `goal`.

    Parameters
    ----------
    part : tuple of 4 ints
        Island with contacts `islands.contacts[part[0]:part[1]]` and bodies `islands.bodies[part[2]:part[3]]`.
    friction : bool or None
        None if the scene has no friction; any other value if it has. The type decides what is compiled.
    residual : float
        Residual of the start [m/s].
    goal : float
        Residual to reach [m/s].
    limit : int
        Largest number of Newton steps.
    scale : float
        ρ of the first round, in units of the largest mass.
    many : BodiesWorkspace
        Workspace of the world. `contacts.impulse` is the start, `bodies.free_twist` the twists without impulses.
        `contacts.impulse` and `bodies.twist` receive the best result.

    Returns
    -------
    steps : int
        Number of Newton steps.
    residual : float
        Residual of the returned impulses [m/s].
    """
    mass, failures, steps = _heaviest(part, many), 0, 0
    _gather_impulses(many)
    while residual > goal and failures <= FAILED_ROUNDS and steps < limit:
        enough = _ROUND_SHARE * min(_ROUND_FLOOR * goal, residual)
        steps += max(1, _proximal_round(part, scale * mass, enough, min(_NEWTON_STEPS, limit - steps), many))
        now = max_contact_residual(part[0], part[1], friction, many)
        if now < residual:
            residual = now
            _save_impulses(many)
            scale = min(_RHO_GROWTH * scale, _RHO_LIMIT)
        else:
            failures += 1
            scale /= _RHO_DECREASE
            _restore_impulses(part, many)
    return steps, residual
