"""Hold a body whose loads its contacts can bear without sliding, where other solvers let it slide.

Coulomb's law alone does not tell whether such a body moves. Four contacts of a face may share a load in many ways, and
each has a limit of friction of its own: some let the body slide, others hold it. The law accepts both. Here a body
that can hold does hold, as in statics: it stays at rest if any impulses in the friction cones bear its loads.

Of these impulses the least are taken, which are unique. Let A be the 6 x 3n matrix from impulses p to their sum and
moment, W what all contacts sticking exert (`sticking_twist`), and K the product of the friction cones. To minimise
|p|²/2 over K with A p = W is to solve, for six multipliers λ,

    A p(λ) = W,    p(λ) = the point of K nearest to Aᵀ λ.

This is the gradient of a convex function, |p(λ)|²/2 - λ·W, which Newton's method minimises. If no impulses in K bear W,
the function has no lower bound, and the search ends without a result.

References
----------
.. [1] J. Malick, *A dual approach to semidefinite least-squares problems*, SIAM J. Matrix Anal. Appl. 26, 2004, for
   the dual function of the nearest point of a cone's section.
.. [2] M. Fukushima, Z.-Q. Luo, P. Tseng, *Smoothing functions for second-order-cone complementarity problems*, SIAM J.
   Optim. 12, 2002, for the nearest point of a friction cone and its derivative.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.contact_law.anisotropic_friction import friction_ratio, unstretch_tangents
from physics.kernels.contact_law.materials import friction_of
from physics.kernels.contact_solver.proximal_newton import solve_six
from physics.kernels.contact_solver.sticking_twist import (
    RIGID_TWIST_TOLERANCE,
    FreeMotion,
    bolt_group,
    largest_target_speed,
    sticking_twist,
    world_target,
)
from physics.kernels.half_space.contact_point import contact_arm, wall_axes, wall_of
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, times
from physics.kernels.state.body import apply_inv_inertia

# A solution nearly holds if no contact moves by more than this share of the fastest contact without impulses.
_SHARE_OF_HOLDING = 0.5

# Largest number of Newton steps, and of halvings of a step. Of 300 random loads at 99 % of what friction can hold the
# hardest needed 15 steps.
_MAX_NEWTON_STEPS = 30
_MAX_HALVINGS = 20

# Share of the linear decrease by which a step must lower the function; an error of the function that is rounding; and
# errors of the sum and the moment that count as zero. All are in units of W.
_SUFFICIENT_DECREASE = 1.0e-4
_ROUNDING = 1.0e-15
_ZERO = 1.0e-13

# Added to the diagonal of Newton's matrix, in units of its trace: this share of the error, at least the second number.
# Open contacts leave the matrix singular.
_REGULARISATION = 3.0e-3
_LEAST_REGULARISATION = 1.0e-14

# Below this value of the function no impulses of several walls bear the loads, in practice: they would be ten times as
# large as these. For one wall see `_lower_bound`.
_LOWEST = -50.0


@inlined
def _fastest_contact(n, v, w, scratch):
    """Largest speed of n contacts at the twist (v, w), less their targets [m/s]."""
    largest = 0.0
    for i in range(n):
        m, t = qt.cross(w, contact_arm(scratch.contacts, i)), world_target(i, scratch)
        d = (v[0] + m[0] - t[0], v[1] + m[1] - t[1], v[2] + m[2] - t[2])
        largest = max(largest, qt.dot(d, d))
    return math.sqrt(largest)


@inlined
def nearly_holds(n, free, v, L, scratch):
    """True if a solution with the motion (v, L) leaves n contacts nearly at their targets; `free` is the `FreeMotion`.

    The first test takes few operations, and sorts out most bodies that slide.
    """
    J, r = scratch.body.J, scratch.body.radius
    push, turn = minus(v, free.v), times(r * max(J[0], max(J[1], J[2])), minus(L, free.L))
    gain2 = qt.dot(push, push) + qt.dot(turn, turn)
    if n < 3 or qt.dot(v, v) > 4.0 * (_SHARE_OF_HOLDING * _SHARE_OF_HOLDING) * gain2:
        return False
    most = _fastest_contact(n, free.v, apply_inv_inertia(free.R, free.L, J), scratch)
    return _fastest_contact(n, v, apply_inv_inertia(free.R, L, J), scratch) <= _SHARE_OF_HOLDING * most


@inlined
def _add_outer(A, s, a, b):
    """Add s m mᵀ to the matrix in the first six columns of A; m is made of the vectors a and b."""
    m = a[0], a[1], a[2], b[0], b[1], b[2]
    for i in range(6):
        for j in range(6):
            A[i, j] += s * m[i] * m[j]


@inlined
def _add_contact(i, push, turn, scratch):
    """Impulse of contact i at the multipliers (push, turn): its sum, its moment, and the square of its size.

    Moments are in units of the body's radius times the impulse. `solver.trial` gets the impulse, along stretched
    tangents; the derivative is added to `solver.newton`.
    """
    A, p = scratch.solver.newton, scratch.solver.trial
    slot = scratch.contacts.slot[i]
    n, a, b = wall_axes(scratch.scene.walls, wall_of(slot, scratch.scene))
    b, mu = times(friction_ratio(scratch.body), b), friction_of(slot, scratch)
    r = times(1.0 / scratch.body.radius, contact_arm(scratch.contacts, i))
    z = plus(push, qt.cross(turn, r))
    y, ya, yb = qt.dot(n, z), qt.dot(a, z), qt.dot(b, z)
    size = math.sqrt(ya * ya + yb * yb)
    if size <= mu * y:  # within the cone, or at its tip, where the search starts
        _add_outer(A, 1.0, n, qt.cross(r, n))
        _add_outer(A, 1.0, a, qt.cross(r, a))
        _add_outer(A, 1.0, b, qt.cross(r, b))
    elif mu * size <= -y:  # nearest to the tip
        y = ya = yb = 0.0
    else:
        da, db, y = ya / size, yb / size, (y + mu * size) / (1.0 + mu * mu)
        ya, yb = mu * y * da, mu * y * db
        along, across = plus(n, plus(times(mu * da, a), times(mu * db, b))), plus(times(-db, a), times(da, b))
        _add_outer(A, 1.0 / (1.0 + mu * mu), along, qt.cross(r, along))
        _add_outer(A, mu * y / size, across, qt.cross(r, across))
    p[3 * i], p[3 * i + 1], p[3 * i + 2] = y, ya, yb
    f = plus(times(y, n), plus(times(ya, a), times(yb, b)))
    return f, qt.cross(r, f), y * y + ya * ya + yb * yb


@inlined
def _evaluate(n, push, turn, F, T, scratch):
    """Value of the convex function at the multipliers (push, turn), and its gradient, two vectors.

    `solver.newton` gets the second derivatives, `solver.trial` the impulses. The n contacts are to exert (F, T).
    """
    A = scratch.solver.newton
    for i in range(6):
        for j in range(6):
            A[i, j] = 0.0
    value, down, round_ = -(qt.dot(push, F) + qt.dot(turn, T)), times(-1.0, F), times(-1.0, T)
    for i in range(n):
        f, m, size2 = _add_contact(i, push, turn, scratch)
        value, down, round_ = value + 0.5 * size2, plus(down, f), plus(round_, m)
    return value, down, round_


@inlined
def _lower_bound(n, scratch):
    """Value below which the function of n contacts cannot be if there are impulses that bear W, with |F| + |T| = 1.

    At its least value it is -|p|²/2. The normal impulses of one wall add up to at most 1, and so do their squares; with
    friction |p|² is at most 1 + μ².
    """
    first, last = scratch.contacts.slot[0], scratch.contacts.slot[n - 1]
    if wall_of(first, scratch.scene) != wall_of(last, scratch.scene):
        return _LOWEST
    mu = friction_of(first, scratch)
    return -0.5 * (1.0 + mu * mu)


@inlined
def _newton_direction(error, down, round_, scratch):
    """Newton's step from the gradient (down, round_) of the size `error`, two vectors, and whether there is one."""
    A = scratch.solver.newton
    trace = 0.0
    for i in range(6):
        trace += A[i, i]
    for i in range(3):
        A[i, 6], A[i + 3, 6] = -down[i], -round_[i]
    for i in range(6):
        A[i, i] += (_REGULARISATION * error + _LEAST_REGULARISATION) * trace
    if not trace > 0.0:
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), False
    solve_six(A)
    return (A[0, 6], A[1, 6], A[2, 6]), (A[3, 6], A[4, 6], A[5, 6]), True


@inlined
def _find_least_impulses(n, F, T, scratch):
    """Find the least impulses of n contacts with the sum F and the moment T; return whether there are any.

    They go to `solver.trial`, along stretched tangents. |F| + |T| is 1.
    """
    push, turn = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    lowest = _lower_bound(n, scratch)
    value, down, round_ = _evaluate(n, push, turn, F, T, scratch)
    for _ in range(_MAX_NEWTON_STEPS):
        error = math.sqrt(qt.dot(down, down) + qt.dot(round_, round_))
        if error <= _ZERO:
            return True
        dp, dt, is_given = _newton_direction(error, down, round_, scratch)
        if not is_given:
            return False
        slope, old, t = qt.dot(down, dp) + qt.dot(round_, dt), value, 1.0
        new_push, new_turn = push, turn
        for _ in range(_MAX_HALVINGS):
            new_push, new_turn = plus(push, times(t, dp)), plus(turn, times(t, dt))
            value, down, round_ = _evaluate(n, new_push, new_turn, F, T, scratch)
            if value <= old + _SUFFICIENT_DECREASE * t * slope + _ROUNDING * abs(old):
                break
            t *= 0.5
        if not value > lowest:
            return False
        push, turn = new_push, new_turn
    return False


@kernel
def hold_contacts(n, R, v, L, scratch):
    """Try to find impulses with which all n contacts of several on a plane or more move at their targets.

    Parameters and result are those of `sticking.solve_all_sticking`; contacts on a line are left to other solvers.

    Returns
    -------
    found : bool
        False if there are no such impulses. `contacts.impulse` is then unchanged.
    v, L : tuples of 3 floats
        Velocity and angular momentum with the contact impulses, if found.
    """
    contacts, body = scratch.contacts, scratch.body
    free, J = FreeMotion(R, v, L), body.J
    for i in range(n):
        scratch.solver.active[i] = 1
    group = bolt_group(n, n, scratch)
    if group.is_line:
        return False, v, L
    largest = largest_target_speed(n, contacts)
    v_new, w_new = sticking_twist(n, group, largest == 0.0, free, scratch)
    if largest > 0.0:
        miss = _fastest_contact(n, v_new, w_new, scratch)
        if not miss <= max(RIGID_TWIST_TOLERANCE * largest, scratch.stage.target_error_limit):
            return False, v, L
    wb = qt.transposed_matvec(R, w_new)
    L_new = qt.matvec(R, (wb[0] / J[0], wb[1] / J[1], wb[2] / J[2]))
    F, T = times(body.mass, minus(v_new, v)), times(1.0 / body.radius, minus(L_new, L))
    size = math.sqrt(qt.dot(F, F)) + math.sqrt(qt.dot(T, T))
    if not size > 0.0 or not _find_least_impulses(n, times(1.0 / size, F), times(1.0 / size, T), scratch):
        return False, v, L
    for r in range(3 * n):
        contacts.impulse[r] = size * scratch.solver.trial[r]
    unstretch_tangents(n, scratch)
    return True, v_new, L_new
