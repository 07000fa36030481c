"""Sweeps over the contacts of an island with the circular Coulomb cone (block Gauss-Seidel on twists).

A visit solves one contact alone (`one_contact.solve_contact_block`) while all other impulses stay. Sweeps go up and
down the list in turns, so that loads travel through a stack in both directions.

Most contacts are soon solved and stay so: where a body lands on a pile, few contacts change. So a contact is visited
only if one of its bodies has been pushed since its last visit. It is left as it is if its error is below the tolerance.
The residual of the returned impulses is checked for all contacts.

A motion of bodies is their twist in `many.sweeps.motion`. Visits are numbered from 1 on.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined, kernel
from physics.kernels.contact_solver.one_contact import CONTACT_UNSOLVED, friction_direction, solve_contact_block
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.compliance import per_spring, plus_give_velocity
from physics.kernels.multibody.data.contact_set import put_vector, subtract
from physics.kernels.multibody.solver.contact_operator import (
    max_contact_residual,
    natural_map_residual,
    project_on_disk,
)
from physics.kernels.multibody.solver.contact_rows import (
    NOT_INVERTED,
    VISIT_BLOCK,
    VISIT_IMPULSE,
    VISIT_INVERSE,
    VISIT_LAMBDA_MAX,
    VISIT_MU,
    apply_visit_impulse,
    read_visit_impulses,
    visit_block,
    visit_velocity_error,
    write_block_inverse,
    write_visits,
)
from physics.kernels.multibody.solver.normal_rows import (
    apply_normal_impulse,
    assemble_normal_row,
    motion_from_twists,
    normal_velocity,
    twists_from_motion,
)

# Share of the goal within which a contact is left as it is, with friction and without. Each correction makes the
# contacts of two bodies due for another visit.
_SKIP_SHARE = 0.9
_NORMAL_SKIP_SHARE = 0.1

# Number of the last visit of a contact whose residual is too large: it is visited and corrected in any case.
_MUST_VISIT = -1

# Largest number of passes through the list, per allowed sweep. A pass with few visits costs little, but not nothing.
_PASSES_PER_SWEEP = 10

# Half of the number of sweeps between two extrapolations; even, since a sweep up and a sweep down belong together. Slow
# sweeps contract the error along one direction by a ratio q near 1 per period, which follows from two changes. The rest
# of the series, q/(1 - q) times the last change, is then added at once (`physics.kernels.contact_solver.gauss_seidel`).
# With two more sweeps between extrapolations, a tenth of the visits is saved at loose tolerances, but arches at their
# limit stay unsolved five times as often at `precise`. If fewer sweeps are allowed than a period has, there is no
# extrapolation.
_HALF_PERIOD = 2
_MAX_CONTRACTION_RATIO = 0.998

# Mark of a moment without stored impulses: less than the number of any visit.
_NO_HISTORY = -2


@inlined
def _is_up_to_date(i, a, b, many):
    """True if neither body a nor body b (b < 0: a wall) has been pushed since the last visit of their contact i."""
    return many.sweeps.visited[i] >= many.sweeps.pushed[a] and (
        b < 0 or many.sweeps.visited[i] >= many.sweeps.pushed[b]
    )


@inlined
def is_contact_up_to_date(k, many):
    """True if no body of contact k has been pushed since its last visit."""
    return _is_up_to_date(k, many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], many)


@inlined
def _mark_pushed(a, b, visit, many):
    """Record that bodies a and b (b < 0: a wall) have been pushed in the visit with this number."""
    many.sweeps.pushed[a] = visit
    if b >= 0:
        many.sweeps.pushed[b] = visit


@inlined
def relax_normal_impulse(k, visit, small, many):
    """Correct contact k along its normal if its error exceeds `small`; return the error before [m/s].

    The error is that of the impulse, as a velocity. `visit` is the number of this visit.
    """
    many.sweeps.visited[k] = visit
    p, normal = many.contacts.impulse[k, 0], many.contacts.block[k, 0]
    d = max(0.0, p - plus_give_velocity(k, normal_velocity(k, many) - many.contacts.target[k, 0], many) / normal) - p
    off = abs(d) * normal
    if off > small:
        many.contacts.impulse[k, 0] = p + d
        apply_normal_impulse(k, d, many)
        _mark_pushed(many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], visit, many)
    return off


@kernel
def sweep_normals(first, last, residual, goal, limit, many):
    """Do `sweep_contacts` without friction: improve the impulses along the normals only.

    A corrected contact is skipped until one of its bodies has been pushed again. A contact whose error is a small share
    of the goal is not corrected. So easy problems need few visits.
    """
    sweeps = visits = 0
    for i in range(first, last):
        k = many.islands.contacts[i]
        assemble_normal_row(k, many)
        many.sweeps.visited[k] = _MUST_VISIT
        _mark_pushed(many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], 0, many)
    motion_from_twists(first, last, many)
    while not residual <= goal and sweeps < limit:
        worst, before = 0.0, visits
        for i in range(first, last):
            k = many.islands.contacts[i if sweeps % 2 == 0 else first + last - 1 - i]
            if is_contact_up_to_date(k, many):
                continue
            visits += 1
            worst = max(worst, relax_normal_impulse(k, visits, _NORMAL_SKIP_SHARE * goal, many))
        sweeps += 1
        if worst <= goal or sweeps == limit:
            twists_from_motion(first, last, many)
            residual = max_contact_residual(first, last, None, many)
        if visits == before:
            break  # all contacts are solved, and no body moves any more
    return sweeps, residual


@inlined
def _solve_one_contact(W, V, mu, step, p, u, goal):
    """New impulse of one contact that solves it while all other impulses stay.

    p is its present impulse and u its velocity error at p. W is the contact's Delassus block and V its inverse, as (00,
    01, 02, 11, 12, 22). `mu` is the friction coefficient, `step` is 1/λ_max of the tangential part of W, and `goal` the
    allowed residual [m/s].
    """
    own = qt.symmetric_matvec(W, p)
    b = subtract(u, own)
    if b[0] >= 0.0:
        return (0.0, 0.0, 0.0)
    q = subtract(p, qt.symmetric_matvec(V, u))
    if q[0] >= 0.0 and q[1] * q[1] + q[2] * q[2] <= (mu * q[0]) * (mu * q[0]):
        return q
    x, y = (p[1], p[2]) if p[0] > 0.0 and p[1] * p[1] + p[2] * p[2] > 0.0 else (q[1], q[2])
    x, y = friction_direction(-x, -y, mu)
    full = (W[0], W[1], W[2], W[1], W[3], W[4], W[2], W[4], W[5])
    what, q, _ = solve_contact_block(full, b, mu, W[3] + W[5], goal, x, y, False)
    if what != CONTACT_UNSOLVED:
        return q
    # Fallback: the normal impulse first, then a tangential step, projected on the disk of the friction cone.
    normal = max(0.0, p[0] - u[0] / W[0])
    d = normal - p[0]
    x, y = project_on_disk(p[1] - step * (u[1] + W[1] * d), p[2] - step * (u[2] + W[2] * d), mu * normal)
    return (normal, x, y)


@inlined
def _as_velocity(i, d, many):
    """Size of a change d of the impulse in row i, as the velocity that it would cause alone [m/s].

    The normal part is multiplied by W_nn, the tangential part by λ_max.
    """
    return max(
        abs(d[0]) * many.sweeps.visit_rows[i, VISIT_BLOCK],
        max(abs(d[1]), abs(d[2])) * many.sweeps.visit_rows[i, VISIT_LAMBDA_MAX],
    )


@inlined
def _save_history(i, p, marks, many):
    """Store the impulse p of contact row i as its value at two earlier moments, if it has not changed since.

    `marks` are the numbers of the last visits before the two moments.
    """
    if many.sweeps.visited[i] <= marks[0]:
        put_vector(many.sweeps.impulse_4_sweeps_ago, i, 0, p)
    if many.sweeps.visited[i] <= marks[1]:
        put_vector(many.sweeps.impulse_2_sweeps_ago, i, 0, p)


@inlined
def _relax_contact(i, number, marks, small, many):
    """Correct contact row i if its error exceeds `small`, or if it is flagged; return the error before [m/s].

    The error is a velocity: the contact's residual or a little more. `number` is the number of this visit; `marks` are
    as in `_save_history`.
    """
    W, p = visit_block(i, VISIT_BLOCK, many), row_vector(many.sweeps.visit_rows, i, VISIT_IMPULSE)
    _save_history(i, p, marks, many)
    left = 0.0 if many.sweeps.visited[i] == _MUST_VISIT else small
    many.sweeps.visited[i] = number
    if many.sweeps.visit_rows[i, VISIT_INVERSE] == NOT_INVERTED:
        write_block_inverse(i, W, many)
    u = visit_velocity_error(i, many)
    q = _solve_one_contact(
        W,
        visit_block(i, VISIT_INVERSE, many),
        many.sweeps.visit_rows[i, VISIT_MU],
        1.0 / many.sweeps.visit_rows[i, VISIT_LAMBDA_MAX],
        p,
        u,
        small,
    )
    d = subtract(q, p)
    off = _as_velocity(i, d, many)
    if off > left:
        put_vector(many.sweeps.visit_rows, i, VISIT_IMPULSE, q)
        apply_visit_impulse(i, d, many)
        _mark_pushed(many.sweeps.visit_bodies[i, 0], many.sweeps.visit_bodies[i, 1], number, many)
    return off


@inlined
def _contraction_ratio(count, marks, many):
    """Ratio of the impulses' last change to the change before, weighted with W_nn; 0 if the two are not parallel.

    The changes are those between the two moments of `marks` and the present. `count` is the number of contacts.
    """
    product = square = 0.0
    for i in range(count):
        if many.sweeps.visited[i] <= marks[0]:
            continue
        p, weight = row_vector(many.sweeps.visit_rows, i, VISIT_IMPULSE), many.sweeps.visit_rows[i, VISIT_BLOCK]
        middle = row_vector(many.sweeps.impulse_2_sweeps_ago, i, 0) if many.sweeps.visited[i] > marks[1] else p
        before = subtract(middle, row_vector(many.sweeps.impulse_4_sweeps_ago, i, 0))
        product += weight * qt.dot(subtract(p, middle), before)
        square += weight * qt.dot(before, before)
    return min(product / square, _MAX_CONTRACTION_RATIO) if product > 0.0 else 0.0


@inlined
def _extrapolate(count, ratio, number, marks, small, many):
    """Continue the last change of the impulses as a geometric series with this ratio, and add the rest of the series.

    The impulses are projected into their cones, and the motion of the bodies is updated. Bodies at contacts whose
    impulses change by more than `small` [m/s] are marked as pushed in the visit `number`. `count` and `marks` are as in
    `_contraction_ratio`.
    """
    s = ratio / (1.0 - ratio)
    for i in range(count):
        if many.sweeps.visited[i] <= marks[1]:
            continue
        p = row_vector(many.sweeps.visit_rows, i, VISIT_IMPULSE)
        d = subtract(p, row_vector(many.sweeps.impulse_2_sweeps_ago, i, 0))
        normal = max(0.0, p[0] + s * d[0])
        x, y = project_on_disk(p[1] + s * d[1], p[2] + s * d[2], many.sweeps.visit_rows[i, VISIT_MU] * normal)
        d = (normal - p[0], x - p[1], y - p[2])
        put_vector(many.sweeps.visit_rows, i, VISIT_IMPULSE, (normal, x, y))
        apply_visit_impulse(i, d, many)
        if _as_velocity(i, d, many) > small:
            _mark_pushed(many.sweeps.visit_bodies[i, 0], many.sweeps.visit_bodies[i, 1], number, many)


@inlined
def _flag_unsolved(count, small, many):
    """Flag the contacts with a residual above `small` [m/s] for a visit; return the largest residual [m/s].

    Other contacts, of the first `count` rows, are visited once one of their bodies is pushed.
    """
    worst = 0.0
    for i in range(count):
        R = many.sweeps.visit_rows
        step = 1.0 / R[i, VISIT_LAMBDA_MAX]
        u, normal = per_spring(visit_velocity_error(i, many), R[i, VISIT_BLOCK], step, many)
        miss = natural_map_residual(row_vector(R, i, VISIT_IMPULSE), u, normal, step, R[i, VISIT_MU])
        many.sweeps.visited[i] = 0 if miss <= small else _MUST_VISIT
        _mark_pushed(many.sweeps.visit_bodies[i, 0], many.sweeps.visit_bodies[i, 1], 0, many)
        if not miss <= worst:  # also true for NaN
            worst = miss
    return worst


@kernel
def _sweep(count, is_up, visits, marks, small, many):
    """Sweep once over the first `count` contact rows: (largest error [m/s], visits so far).

    The sweep goes up the rows if `is_up`, else down, and skips rows that need no visit. `marks` and `small` are as in
    `_relax_contact`.
    """
    worst = 0.0
    for j in range(count):
        i = j if is_up else count - 1 - j
        if not _is_up_to_date(i, many.sweeps.visit_bodies[i, 0], many.sweeps.visit_bodies[i, 1], many):
            visits += 1
            worst = max(worst, _relax_contact(i, visits, marks, small, many))
    return worst, visits


@kernel
def _sweep_until_solved(count, residual, goal, limit, many):
    """Sweep until the residual is at most `goal`, or `limit` visits per contact are used up: (visits, residual [m/s]).

    `residual` is that of the start; `count` is the number of contacts.
    """
    small, most, passes, visits, since, marks = _SKIP_SHARE * goal, limit * count, 0, 0, 0, (_NO_HISTORY, _NO_HISTORY)
    while not residual <= goal and visits < most and passes < _PASSES_PER_SWEEP * limit:
        if since == 0:
            marks = (visits, _NO_HISTORY)
        elif since == _HALF_PERIOD:
            marks = (marks[0], visits)
        worst, visits = _sweep(count, passes % 2 == 0, visits, marks, small, many)
        passes, since = passes + 1, since + 1
        if worst <= goal or visits >= most or passes == _PASSES_PER_SWEEP * limit:
            residual, since = _flag_unsolved(count, goal, many), 0
        elif since == 2 * _HALF_PERIOD:
            ratio, since = _contraction_ratio(count, marks, many) if limit > since else 0.0, 0
            if ratio > 0.0:
                _extrapolate(count, ratio, visits + 1, marks, small, many)
    return visits, residual


@kernel
def sweep_contacts(first, last, friction, residual, goal, limit, many):
    """Improve the impulses of `many.islands.contacts[first:last]` by sweeps: (sweeps, residual [m/s]).

    It stops at a residual of at most `goal`, or after `limit` sweeps. n visits for n contacts count as a sweep; the
    last sweep begun is finished. `residual` is that of the start, and `friction` is None if the scene has no friction.
    `contacts.impulse` and `bodies.twist` hold the start, consistent with each other, and receive the result.
    """
    if friction is None:
        return sweep_normals(first, last, residual, goal, limit, many)
    if residual <= goal or limit <= 0:
        return 0, residual
    count = last - first
    motion_from_twists(first, last, many)
    write_visits(first, last, many)
    visits, residual = _sweep_until_solved(count, _flag_unsolved(count, _SKIP_SHARE * goal, many), goal, limit, many)
    read_visit_impulses(first, last, many)
    twists_from_motion(first, last, many)
    return max(1, visits // count), residual
