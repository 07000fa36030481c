"""Hold a body whose loads its contacts can bear without sliding, where the contact solvers let it slide.

Coulomb's law alone does not tell whether such a body moves. Four contacts of a face may share a load in many ways, and
each has a limit of friction of its own: some let the body slide, others hold it. The law accepts both. In the
event-driven scheme a body at rest that can hold does hold, as in statics: it stays where it is if any forces in the
friction cones bear its loads. (Time stepping takes what its solvers find.)

Of these forces the least are taken, which are unique. Let A be the 6 x 3n matrix from forces p to their sum and moment,
W the opposite of the loads, and K the product of the friction cones. To minimise |p|²/2 over K with A p = W is to
solve, for six multipliers λ,

    A p(λ) = W,    p(λ) = the point of K nearest to Aᵀ λ.

This sets the gradient of a convex function, |p(λ)|²/2 - λ·W, to zero. Newton's method minimises it. If no forces in K
balance the loads, the function has no lower bound, and the search ends without a result.

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
from physics.kernels.half_space.contact_point import contact_arm, wall_axes, wall_of
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import plus, times

# Largest number of Newton steps, and of halvings of a step. Of 300 random loads at 99 % of what friction can hold the
# hardest needed 15 steps.
_MAX_NEWTON_STEPS = 30
_MAX_HALVINGS = 20

# Share of the linear decrease by which a step must lower the function; error of the function that is rounding, a
# difference of numbers up to a thousand; and error of the sum and the moment that counts as zero, in units of W.
_SUFFICIENT_DECREASE = 1.0e-4
_ROUNDING = 1.0e-12
_ZERO = 1.0e-12

# Added to the diagonal of Newton's matrix, in units of its trace: this share of the error, at least the second number.
# Open contacts leave the matrix singular.
_REGULARISATION = 3.0e-3
_LEAST_REGULARISATION = 1.0e-14

# Below this value of the function no forces of several walls balance the loads, in practice: they would be ten times as
# large as these. For one wall see `_lower_bound`.
_LOWEST = -50.0


@inlined
def _add_outer(A, s, a, b):
    """Add s m mᵀ to the matrix in the first six columns of A; m is made of the vectors a and b."""
    m = a[0], a[1], a[2], b[0], b[1], b[2]
    for i in range(6):
        for j in range(6):
            A[i, j] += s * m[i] * m[j]


@inlined
def _add_contact(i, push, turn, scratch):
    """Force of contact i at the multipliers (push, turn): its sum, its moment, and the square of its size.

    Moments are in units of the body's radius times a force. `solver.trial` gets the force, along stretched
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
    """Value below which the function of n contacts cannot be if any forces balance the loads, with |F| + |T| = 1.

    At its least value it is -|p|²/2. The normal forces of one wall add up to at most 1, and so do their squares; with
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
def _find_least_forces(n, F, T, scratch):
    """Find the least forces of n contacts with the sum F and the moment T; return whether there are any.

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
            if value <= old + _SUFFICIENT_DECREASE * t * slope + _ROUNDING:
                break
            t *= 0.5
        if not value > lowest:
            return False
        push, turn = new_push, new_turn
    return False


@kernel
def hold_at_rest(n, a, moment, scratch):
    """Try to find forces of n contacts that keep a body at rest, three at least; return whether there are any.

    Without them the centre of mass has the acceleration a [m/s²], and the angular momentum about it the rate `moment`
    [N m], both in the world frame. If found, the forces [N] take the place of impulses in `contacts.impulse`; otherwise
    that is unchanged. Of `contacts`, `slot` and `arm` are read.
    """
    body = scratch.body
    F, T = times(-body.mass, a), times(-1.0 / body.radius, moment)
    size = math.sqrt(qt.dot(F, F)) + math.sqrt(qt.dot(T, T))
    if n < 3 or not size > 0.0:
        return False
    if not _find_least_forces(n, times(1.0 / size, F), times(1.0 / size, T), scratch):
        return False
    for r in range(3 * n):
        scratch.contacts.impulse[r] = size * scratch.solver.trial[r]
    unstretch_tangents(n, scratch)
    return True
