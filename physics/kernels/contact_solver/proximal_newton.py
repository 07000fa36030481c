"""Solve contact problems by Newton's method on the body's twist, inside a proximal point method.

It is for problems on which sweeps converge slowly: bodies on the verge of sliding, whose contacts nearly stick, or
creep, or of which one sticks while others slide. Four contacts of a face also leave the impulses undetermined. The
change x of the body's twist is determined, and has six components for any number of contacts. Let q be impulses near
the solution, and

    p(x) = law(q - ρ u(x)),    u(x) = J x + b.

For each contact the law takes max(0, p_n), and then projects p_t on the disk |p_t| <= μ p_n; ρ is a large multiple of
the contact's mass. Then x = M⁻¹ Jᵀ p(x) is a nonlinear system for the twist alone, and piecewise nearly linear. Its
Newton matrix 1 - M⁻¹ Jᵀ p'(u) J is not singular when impulses are undetermined. A *round* solves this system and sets
q = p(x). Each round brings q nearer to the contact law, by about the factor 1/(1 + ρ W), so a few rounds with growing ρ
are enough.

References
----------
.. [1] R. T. Rockafellar, *Monotone operators and the proximal point algorithm*, SIAM J. Control Optim. 14,
   1976.
.. [2] P. Alart, A. Curnier, *A mixed formulation for frictional contact problems prone to Newton like
   solution methods*, Comput. Methods Appl. Mech. Eng. 92, 1991 (`law` and its derivative).
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.contact_law.compliance import scale_by_compliance
from physics.kernels.contact_solver.gauss_seidel import LOCAL_NORMAL_RHO, cone_residual, update_contact_velocities

# ρ in units of a contact's normal mass 1/W_nn: in the first round, its growth from round to round, and its largest
# value, at which rounding times ρ is still below the tolerance. With a larger ρ there are fewer rounds, but Newton
# steps overshoot more often.
_PROXIMAL_FACTOR = 1.0e3
_FACTOR_GROWTH = 10.0
_FACTOR_LIMIT = 1.0e6

# Largest numbers of rounds, of Newton steps of a round, of halvings of a step, and of steps of a round that do not make
# the defect smaller.
_MAX_ROUNDS = 12
_MAX_NEWTON_STEPS = 20
_MAX_HALVINGS = 6
_MAX_FAILURES = 5

# Largest numbers of rounds and Newton steps in a quick turn. Problems that are not solved by then profit more from a
# few sweeps in between than from more steps.
_QUICK_ROUNDS = 6
_QUICK_NEWTON_STEPS = 8

# The system of a round is solved to this share of the tolerance.
_ROUND_TOLERANCE_SHARE = 0.01


@inlined
def _fixed_point_residual(n, factor, inv_mass, scratch):
    """Compute the defect x - M⁻¹ Jᵀ p(x) of the twist x in `solver.twist`; return its size as a velocity [m/s].

    p(x) are the impulses of the contact law, projected from q - ρ u(x), with the present impulses q. The defect goes to
    `solver.defect`, p(x) to `solver.trial`, and q - ρ u to `contacts.velocity`. `factor` is ρ in units of each
    contact's normal mass.
    """
    body, contacts, solver = scratch.body, scratch.contacts, scratch.solver
    frame, angular, response = contacts.frame, contacts.angular, contacts.response
    x, g, p, y, q = solver.twist, solver.defect, solver.trial, contacts.velocity, contacts.impulse
    for c in range(6):
        g[c] = x[c]
    for i in range(n):
        r = 3 * i
        rho = factor * solver.local[i, LOCAL_NORMAL_RHO]
        for s in range(r, r + 3):
            u = contacts.bias[s] + (
                (frame[s, 0] * x[0] + frame[s, 1] * x[1] + frame[s, 2] * x[2])
                + (angular[s, 0] * x[3] + angular[s, 1] * x[4] + angular[s, 2] * x[5])
            )
            y[s] = q[s] - rho * u
        y[r] = scale_by_compliance(y[r], rho, body)
        size, limit = math.sqrt(y[r + 1] * y[r + 1] + y[r + 2] * y[r + 2]), contacts.friction[i] * max(y[r], 0.0)
        s = limit / size if size > limit else 1.0
        p[r], p[r + 1], p[r + 2] = max(y[r], 0.0), s * y[r + 1], s * y[r + 2]
        for s in range(r, r + 3):
            for c in range(3):
                g[c] -= inv_mass * frame[s, c] * p[s]
                g[c + 3] -= response[s, c] * p[s]
    linear = g[0] * g[0] + g[1] * g[1] + g[2] * g[2]
    return math.sqrt(linear + body.radius * body.radius * (g[3] * g[3] + g[4] * g[4] + g[5] * g[5]))


@inlined
def _jacobian_entry(s, c, contacts):
    """Entry c (0 to 5) of row s of the contact Jacobian J."""
    return contacts.frame[s, c] if c < 3 else contacts.angular[s, c - 3]


@inlined
def _fill_newton_matrix(n, factor, inv_mass, scratch):
    """Fill `solver.newton` (6 x 7) with the Newton matrix 1 - M⁻¹ Jᵀ p'(u) J, and with -defect in column 6.

    `_fixed_point_residual` must have been called at the present twist.
    """
    body, contacts, solver = scratch.body, scratch.contacts, scratch.solver
    A, y, frame, response = solver.newton, contacts.velocity, contacts.frame, contacts.response
    for a in range(6):
        for b in range(6):
            A[a, b] = 0.0
        A[a, a] = 1.0
        A[a, 6] = -solver.defect[a]
    for i in range(n):
        r = 3 * i
        if not y[r] > 0.0:
            continue
        rho = factor * solver.local[i, LOCAL_NORMAL_RHO]
        size, limit = math.sqrt(y[r + 1] * y[r + 1] + y[r + 2] * y[r + 2]), contacts.friction[i] * y[r]
        da = db = 0.0
        k11 = k22 = 1.0
        k12 = 0.0
        if size > limit:
            da, db, s = y[r + 1] / size, y[r + 2] / size, limit / size
            k11, k12, k22 = s * (1.0 - da * da), -s * da * db, s * (1.0 - db * db)
        for b in range(6):
            jn = scale_by_compliance(rho, rho, body) * _jacobian_entry(r, b, contacts)
            ja, jb = rho * _jacobian_entry(r + 1, b, contacts), rho * _jacobian_entry(r + 2, b, contacts)
            pa = k11 * ja + k12 * jb
            pb = k12 * ja + k22 * jb
            if size > limit:
                pa += contacts.friction[i] * da * jn
                pb += contacts.friction[i] * db * jn
            for a in range(3):
                A[a, b] += inv_mass * (frame[r, a] * jn + frame[r + 1, a] * pa + frame[r + 2, a] * pb)
                A[a + 3, b] += response[r, a] * jn + response[r + 1, a] * pa + response[r + 2, a] * pb


@inlined
def solve_six(A):
    """Solve the 6 x 6 linear system A, with the right-hand side in column 6, by Gauss's elimination.

    The solution is written to column 6; the other columns are overwritten.
    """
    for k in range(6):
        best = k
        for a in range(k + 1, 6):
            if abs(A[a, k]) > abs(A[best, k]):
                best = a
        if best != k:
            for b in range(k, 7):
                A[k, b], A[best, b] = A[best, b], A[k, b]
        s = 1.0 / A[k, k]
        for a in range(k + 1, 6):
            f = s * A[a, k]
            for b in range(k + 1, 7):
                A[a, b] -= f * A[k, b]
    for k in range(5, -1, -1):
        for b in range(k + 1, 6):
            A[k, 6] -= A[k, b] * A[b, 6]
        A[k, 6] /= A[k, k]


@inlined
def _newton_step(n, size, factor, inv_mass, scratch):
    """Make one damped Newton step on the twist; return the new size of the defect [m/s], which was `size` before."""
    solver = scratch.solver
    x, start, step = solver.twist, solver.start, solver.newton
    _fill_newton_matrix(n, factor, inv_mass, scratch)
    solve_six(solver.newton)
    for c in range(6):
        start[c] = x[c]
    after = size
    t = 1.0
    for _ in range(_MAX_HALVINGS):
        for c in range(6):
            x[c] = start[c] + t * step[c, 6]
        after = _fixed_point_residual(n, factor, inv_mass, scratch)
        if after < size:
            break
        t *= 0.5
    return after


@inlined
def _twist_of_impulses(n, inv_mass, scratch):
    """Write the change of the body's twist by `contacts.impulse`, x = M⁻¹ Jᵀ p, into `solver.twist`."""
    contacts = scratch.contacts
    x, p = scratch.solver.twist, contacts.impulse
    for c in range(6):
        x[c] = 0.0
    for s in range(3 * n):
        for c in range(3):
            x[c] += inv_mass * contacts.frame[s, c] * p[s]
            x[c + 3] += contacts.response[s, c] * p[s]


@kernel
def proximal_newton(n, residual, goal, is_quick, scratch):
    """Improve the impulses of an assembled contact problem with friction until the residual is within `goal`.

    Parameters
    ----------
    n : int
        Number of contacts in `scratch`. `gauss_seidel.assemble_delassus` and `invert_contact_blocks` must have been
        called. `contacts.impulse` is the start and gets the result, `contacts.velocity` gets the contact velocities.
    residual, goal : float
        Residual of the start, and tolerance [m/s].
    is_quick : bool
        True to give up early, because sweeps and another turn of this method follow.

    Returns
    -------
    steps : int
        Newton steps made.
    residual : float
        Residual [m/s] of the resulting impulses, which are the best of all rounds.
    """
    contacts, solver = scratch.contacts, scratch.solver
    p, u, W = contacts.impulse, contacts.velocity, contacts.delassus
    rows = 3 * n
    inv_mass = 1.0 / scratch.body.mass
    steps = 0
    factor = _PROXIMAL_FACTOR
    rounds, most = (_QUICK_ROUNDS, _QUICK_NEWTON_STEPS) if is_quick else (_MAX_ROUNDS, _MAX_NEWTON_STEPS)
    for s in range(rows):
        solver.saved[s] = p[s]
    for _ in range(rounds):
        _twist_of_impulses(n, inv_mass, scratch)
        size = _fixed_point_residual(n, factor, inv_mass, scratch)
        failures = 0
        for _ in range(most):
            if not size > _ROUND_TOLERANCE_SHARE * goal:
                break
            after = _newton_step(n, size, factor, inv_mass, scratch)
            steps += 1
            if not after < size:
                failures += 1
                if failures > _MAX_FAILURES:
                    break
            size = after
        for s in range(rows):
            p[s] = solver.trial[s]
        update_contact_velocities(rows, W, p, contacts.bias, u)
        now = cone_residual(n, p, u, contacts.friction, solver.local)
        if now < residual:
            residual = now
            for s in range(rows):
                solver.saved[s] = p[s]
        if residual <= goal:
            break
        factor = min(_FACTOR_GROWTH * factor, _FACTOR_LIMIT)
    for s in range(rows):
        p[s] = solver.saved[s]
    update_contact_velocities(rows, W, p, contacts.bias, u)
    return steps, residual
