"""Rolling and spin friction where bodies touch each other: torques at contacts with a round body.

Let p be the normal impulse of a contact, n its normal, and ω the angular velocity of its first body relative to the
second one. The first body gets the angular impulse T, the second one -T:

    across the normal   |T| <= a p,    T against ω - (n·ω) n   (rolling friction, coefficient a [m])
    along the normal    |T| <= b p,    T against (n·ω) n       (spin friction, coefficient b [m])

Each part has its largest size while the bodies roll or spin on each other, and else the size that stops them
(`time_stepping.rolling_friction` has the sources). So T is a fixed point of

    G(T) = proj(T - ρ ω(T)),

with proj the projection of both parts on their limits, and ω(T) the result of the contact problem in which T acts on
the bodies. 1/ρ is a bound of the answer of ω to T, if no contact pushes. While bodies roll on, G(T) has its limits as
soon as the impulses p are known, after two solves. Else Anderson's method takes the combination of the last few T
for which their errors G(T) - T cancel best. It is exact after as many solves as there are unknowns, where T depends
linearly on them.

All of this is left out of kernels whose scene declares neither effect: `many.resistance` is None there.

References
----------
H. F. Walker, P. Ni, *Anderson acceleration for fixed-point iterations*, SIAM J. Numer. Anal. 49, 2011.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.full_pivot_solve import solve_full_pivot
from physics.kernels.math.vector import minus, plus, row_vector, times
from physics.kernels.multibody.data.arrays import TORQUE_HISTORY
from physics.kernels.multibody.data.contact_set import is_parted, put_vector
from physics.kernels.multibody.data.cylinders import is_cylinder
from physics.kernels.multibody.data.driven_bodies import moving_body_at
from physics.kernels.multibody.data.fixed_bodies import body_at
from physics.kernels.multibody.data.parts import first_part, second_part
from physics.kernels.multibody.data.rolling_points import may_roll
from physics.kernels.multibody.solver.contact_operator import apply_body_inv_inertia
from physics.kernels.multibody.solver.solve import solve_contacts
from physics.kernels.state import layout as at
from physics.kernels.time_stepping.rolling_friction import rolling_radius, spin_radius

# Largest number of solves of the contact problem in a stage.
_MAX_SOLVES = 40

# Solves after which the limits of the torques stay those of the impulses so far. Bodies that wedge each other hold any
# stress, and each solve may find another one.
_SOLVES_OF_PUSHES = 8

# Least allowed error of a torque, as a share of the largest limit, that rounding leaves. The allowed error is else the
# tolerance: a torque that stops a body errs by this share only, and the next stage stops the rest.
_ROUNDING = 1.0e-12


@inlined
def _is_round(part, many):
    shape = many.bodies.body[part].shape
    return shape == at.SPHERE or shape == at.ELLIPSOID or shape == at.CAPSULE


@inlined
def _is_round_at(k, b, many):
    """True if one of the parts at contact k has no faces; `b` is the second end as of `fixed_bodies.body_at`."""
    return _is_round(first_part(k, many), many) or (b >= 0 and _is_round(second_part(b, k, many), many))


@if_given("many.bodies.cylinders", False)
def _is_on_face(k, many):
    """True if contact k is one of a cylinder that does not roll there, such as on its face: it may only spin."""
    b = body_at(many.contacts.bodies[k, 1], many)
    has_cylinder = is_cylinder(first_part(k, many), many) or (b >= 0 and is_cylinder(second_part(b, k, many), many))
    return has_cylinder and not may_roll(k, many) and not _is_round_at(k, b, many)


@inlined
def _resists(k, many):
    """True if a body at contact k is round there, and the contact is not between bodies that pass each other.

    A cylinder is round where its rims or its side roll, and may spin on a face.
    """
    if is_parted(k, many):
        return False
    b = body_at(many.contacts.bodies[k, 1], many)
    return _is_round_at(k, b, many) or may_roll(k, many) or _is_on_face(k, many)


@inlined
def _answer_bound(b, many):
    """Bound of the largest eigenvalue of the inverse inertia of body b [1/(kg m²)]: its largest sum of a row."""
    K = many.bodies.inv_inertia
    x, y, z = abs(K[b, 1]), abs(K[b, 2]), abs(K[b, 4])
    return max(abs(K[b, 0]) + x + y, max(x + abs(K[b, 3]) + z, y + z + abs(K[b, 5])))


@kernel
def _find_resisting(n, many):
    """Write the inverse steps 1/ρ of the n contacts, 0 of those without torques; return the number of the others."""
    found, count = many.resistance, 0
    for b in range(found.count.shape[0]):
        found.count[b] = 0
    for k in range(n):
        found.answer[k] = 0.0
        if _resists(k, many):
            count += 1
            found.answer[k] = 1.0
            found.count[many.contacts.bodies[k, 0]] += 1
            if many.contacts.bodies[k, 1] >= 0:
                found.count[many.contacts.bodies[k, 1]] += 1
    for k in range(n):
        a, b = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1]
        if found.answer[k] > 0.0:
            found.answer[k] = found.count[a] * _answer_bound(a, many)
            if b >= 0:
                found.answer[k] += found.count[b] * _answer_bound(b, many)
    return count


@inlined
def _limited(T, n, across, along):
    """Torque T with its part along the unit vector n at most `along`, and the rest at most `across` [kg m²/s]."""
    spin = qt.dot(n, T)
    roll = minus(T, times(spin, n))
    size = math.sqrt(qt.dot(roll, roll))
    s = across / size if size > across else 1.0
    return plus(times(s, roll), times(min(max(spin, -along), along), n))


@inlined
def _limits(k, many):
    """Largest torques of contact k, across and along its normal [kg m²/s]."""
    body, p = many.bodies.body[many.contacts.bodies[k, 0]], many.resistance.push[k]
    if _is_on_face(k, many):
        return 0.0, spin_radius(body) * p
    return rolling_radius(body) * p, spin_radius(body) * p


@inlined
def _take_pushes(n, many):
    """Take the present normal impulses of n contacts as those that limit their torques."""
    for k in range(n):
        many.resistance.push[k] = max(many.contacts.impulse[k, 0], 0.0)


@inlined
def _relative_spin(k, many):
    """Angular velocity of the first body of contact k relative to the second one, which may be driven [rad/s]."""
    w = row_vector(many.bodies.twist, many.contacts.bodies[k, 0], 3)
    b = moving_body_at(many.contacts.bodies[k, 1], many)
    return minus(w, row_vector(many.bodies.twist, b, 3)) if b >= 0 else w


@kernel
def _find_errors(n, many):
    """Write the errors G(T) - T of the torques of n contacts; return the largest as a share of the largest limit."""
    found, worst, most = many.resistance, 0.0, 0.0
    for k in range(n):
        error = (0.0, 0.0, 0.0)
        if found.answer[k] > 0.0:
            T, normal = row_vector(found.torque, k, 0), row_vector(many.contacts.frame, k, 0)
            across, along = _limits(k, many)
            aim = minus(T, times(1.0 / found.answer[k], _relative_spin(k, many)))
            error = minus(_limited(aim, normal, across, along), T)
            worst, most = max(worst, qt.dot(error, error)), max(most, max(across, along))
        put_vector(found.error, k, 0, error)
    return math.sqrt(worst) / most if most > 0.0 else math.sqrt(worst)


@inlined
def _stored(rows, i, k):
    return rows[i, k, 0], rows[i, k, 1], rows[i, k, 2]


@inlined
def _product(n, a, i, b, j, answer):
    """Sum of products of the vectors a[i] and b[j] of n contacts, weighted with 1/ρ."""
    total = 0.0
    for k in range(n):
        total += answer[k] * (a[i, k, 0] * b[j, k, 0] + a[i, k, 1] * b[j, k, 1] + a[i, k, 2] * b[j, k, 2])
    return total


@kernel
def _remember(n, trial, many):
    """Store torques and errors of the n contacts, and in another row how they have changed since the last trial."""
    T, E = many.resistance.torque_change, many.resistance.error_change
    row = (trial - 1) % TORQUE_HISTORY
    for k in range(n):
        for c in range(3):
            torque, error = many.resistance.torque[k, c], many.resistance.error[k, c]
            if trial > 0:
                T[row, k, c], E[row, k, c] = torque - T[TORQUE_HISTORY, k, c], error - E[TORQUE_HISTORY, k, c]
            T[TORQUE_HISTORY, k, c], E[TORQUE_HISTORY, k, c] = torque, error


@kernel
def _take_next_torques(n, trial, many):
    """Write the torques of n contacts for the next solve, by Anderson's method, within their limits."""
    found, m = many.resistance, min(trial, TORQUE_HISTORY)
    A, D, answer = found.equations, found.error_change, found.answer
    for i in range(m):
        for j in range(m):
            A[i, j] = _product(n, D, i, D, j, answer)
        A[i, m] = _product(n, D, i, D, TORQUE_HISTORY, answer)
    solve_full_pivot(m, A, found.order, found.share)
    for k in range(n):
        T = plus(row_vector(found.torque, k, 0), row_vector(found.error, k, 0))
        for i in range(m):
            change = plus(_stored(found.torque_change, i, k), _stored(D, i, k))
            T = minus(T, times(found.share[i], change))
        across, along = _limits(k, many)
        put_vector(found.torque, k, 0, _limited(T, row_vector(many.contacts.frame, k, 0), across, along))


@kernel
def _guess_torques(n, many):
    """Write torques to start with: those of the stage before, or where there were none, against the present spins."""
    _find_errors(n, many)
    for k in range(n):
        T = row_vector(many.resistance.torque, k, 0)
        if not qt.dot(T, T) > 0.0:
            T = row_vector(many.resistance.error, k, 0)
        across, along = _limits(k, many)
        put_vector(many.resistance.torque, k, 0, _limited(T, row_vector(many.contacts.frame, k, 0), across, along))


@inlined
def _add_spin(b, s, T, many):
    w = plus(row_vector(many.bodies.twist, b, 3), times(s, apply_body_inv_inertia(b, T, many)))
    put_vector(many.bodies.twist, b, 3, w)


@kernel
def _set_loaded_twists(n, many):
    """Write the twists of all bodies without contact impulses, but with the torques of the n contacts."""
    for b in range(many.bodies.twist.shape[0]):
        for c in range(6):
            many.bodies.twist[b, c] = many.resistance.loaded[b, c]
    for k in range(n):
        if many.resistance.answer[k] > 0.0:
            T = row_vector(many.resistance.torque, k, 0)
            _add_spin(many.contacts.bodies[k, 0], 1.0, T, many)
            if many.contacts.bodies[k, 1] >= 0:
                _add_spin(many.contacts.bodies[k, 1], -1.0, T, many)


def _without_resistance(n, friction, many):
    return solve_contacts(n, friction, many)


@if_given("many.resistance", _without_resistance)
def solve_with_resistance(n, friction, many):
    """Solve the n contacts with the torques of rolling and spin friction: result of `solve_contacts`.

    The torques are left in `many.resistance.torque`. If they do not settle, the residual of the result is their error,
    as a share of their limit, or that of the contacts, whichever is larger.
    """
    for b in range(many.bodies.twist.shape[0]):
        for c in range(6):
            many.resistance.loaded[b, c] = many.bodies.twist[b, c]
    if _find_resisting(n, many) == 0:
        return solve_contacts(n, friction, many)
    _take_pushes(n, many)
    _guess_torques(n, many)
    _set_loaded_twists(n, many)
    iterations, residual, method = solve_contacts(n, friction, many)
    allowed = max(many.settings[0].tolerance, _ROUNDING)
    for trial in range(_MAX_SOLVES):
        if trial <= _SOLVES_OF_PUSHES:
            _take_pushes(n, many)
        error = _find_errors(n, many)
        if error <= allowed:
            return iterations, residual, method
        _remember(n, trial, many)
        _take_next_torques(n, trial, many)
        _set_loaded_twists(n, many)
        more, residual, used = solve_contacts(n, friction, many)
        iterations, method = max(iterations, more), max(method, used)
    return iterations, max(residual, _find_errors(n, many)), method


@if_given("many.resistance")
def drop_resistance(n, many):
    """Leave out the torques of the n contacts, after a solve with them has failed."""
    for k in range(n):
        many.resistance.answer[k] = 0.0


@if_given("many.resistance")
def apply_resistance(n, many):
    """Change the angular momenta of the bodies by the torques of the n contacts."""
    for k in range(n):
        if many.resistance.answer[k] > 0.0:
            T, a, b = row_vector(many.resistance.torque, k, 0), many.contacts.bodies[k, 0], many.contacts.bodies[k, 1]
            put_vector(many.bodies.state, a, at.ANGMOM, plus(row_vector(many.bodies.state, a, at.ANGMOM), T))
            if b >= 0:
                put_vector(many.bodies.state, b, at.ANGMOM, minus(row_vector(many.bodies.state, b, at.ANGMOM), T))
