"""Stage with compliant contacts of bodies that touch each other: the θ-method of `contact_law.compliance`.

A contact point of two bodies has one spring and one damper, as at a wall: the gap g is that of the pair, and the scene
has one stiffness k and one damping c for all contacts. So a body on another one that is much heavier, or fixed, moves
as on a wall. The stage of length h drifts by (1 - θ) h, solves the contact problem, and drifts by θ h. Its normal rows
have the compliance γ = 1/(h D) and the target t with

    D = θ (θhk + c),    t = -[k (θ (g + (θh)² b/2) + (1 - θ) min(g⁰, 0)) + c (θ²h b + (1 - θ) g'⁰)]/D.

g⁰ and g'⁰ are gap and rate at the start, g is the gap after the first drift, and b the acceleration of the gap by
turning. The damper of a contact that is still open at the start acts from the next stage on (c = 0 here). θ follows
from a bound λ of the fastest rate of all contacts of the world,

    θ = max(½, 1 - 1/(λh)),    λ = max(√(k w), c w),    w = max over bodies of Σ W_kk over the contacts k of a body.

w is at least the largest eigenvalue of the normal part of W: let w_a and w_b be the shares of two bodies in W_kk. Then
(x_a - x_b)² <= (W_kk/w_a) x_a² + (W_kk/w_b) x_b², so that W is bounded by a matrix with one block for each body, whose
trace is Σ W_kk. Fixed bodies and walls have no share.

A depth that no force has caused does not push: the springs of a body store at most the energy that they stored at the
end of the last stage. The target of a stage that would gain energy is replaced by one without b, and without a target
along the plane. After the stage bodies are moved apart where a contact is deeper than the problem has foretold
(`position_correction`), since no force has done the work of that depth.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined
from physics.kernels.contact_law.compliance import contact_damping, contact_stiffness
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import as_vector, row_vector
from physics.kernels.multibody.data.arrays import (
    LOADED_MOMENTA,
    PRE_LOAD_VELOCITY,
    WARM_BODY_A,
    WARM_BODY_B,
    WARM_CONTACT_COUNT,
    WARM_CONTACT_SIZE,
    WARM_HEADER_SIZE,
    WARM_STAGE_LENGTH,
)
from physics.kernels.multibody.data.contact_set import add_scaled, pair_slop, slip_velocity, subtract
from physics.kernels.multibody.data.driven_bodies import driven_work
from physics.kernels.multibody.data.warm_depths import depth_column
from physics.kernels.multibody.solver.contact_operator import apply_body_inv_inertia
from physics.kernels.multibody.stepping.allowed_error import allowed_depth
from physics.kernels.state import layout as at
from physics.kernels.state.fixed_body import is_fixed

# Points whose springs may push a body at once, and that turning may raise its mobility by; parts in which an
# oscillation turns by a radian at the least tolerance; and the angle beyond which a substep leaves springs unresolved.
_POINTS = 8.0
_TRIALS_PER_RADIAN = 1000.0
_MAX_ANGLE = 20.0


@inlined
def _normal_speed(k, many):
    return qt.dot(row_vector(many.contacts.frame, k, 0), slip_velocity(k, many))


@inlined
def _share(k, b, first, many):
    """Share of body b in W_kk of contact k [1/kg]; `first` is the column of its arm."""
    m = qt.cross(row_vector(many.contacts.arm, k, first), row_vector(many.contacts.frame, k, 0))
    return many.bodies.inv_mass[b] + qt.dot(m, apply_body_inv_inertia(b, m, many))


@inlined
def contact_mobility(k, many):
    """Entry W_kk of contact k without its compliance [1/kg]."""
    a, b = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1]
    return _share(k, a, 0, many) + (_share(k, b, 3, many) if b >= 0 else 0.0)


@inlined
def _largest_mobility(n, many):
    """Bound w of the largest eigenvalue of the normal part of W, over n contacts [1/kg]; see the module."""
    total = many.compliance.mobility
    for b in range(total.shape[0]):
        total[b] = 0.0
    for k in range(n):
        a, b = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1]
        w = _share(k, a, 0, many)
        if b >= 0:
            w += _share(k, b, 3, many)
            total[b] += w
        total[a] += w
    most = 0.0
    for b in range(total.shape[0]):
        most = max(most, total[b])
    return most


@inlined
def _add_square(total, a, b, depth, many):
    """Add the square of a depth to `total` of body a, or half of it to each body of a pair that moves."""
    half = 0.5 * depth * depth
    total[a] += half
    total[b if b >= 0 and not is_fixed(b, many.bodies) else a] += half


@inlined
def _paid_share(b, many):
    """Share of the depths of body b that forces have caused."""
    if b < 0 or not many.compliance.found[b] > many.compliance.paid[b]:
        return 1.0
    found, paid = many.compliance.found[b], many.compliance.paid[b]
    return 1.0 if math.sqrt(found) <= math.sqrt(paid) + allowed_depth(b, many) else math.sqrt(paid / found)


@inlined
def _note_start_gaps(n, world, memory, many):
    """Note the gaps of the n contacts at the start of a stage, without the depth that no force has caused.

    Points of contact come and go, and bodies that a stage has left overlapping by a little would start with energy in
    stiff springs. The springs of a body store at most what they stored when the last stage ended: its depths shrink by
    the same factor. A user who has just placed the bodies has done the work of all depths.
    """
    soft = many.compliance
    for b in range(soft.paid.shape[0]):
        soft.paid[b] = soft.found[b] = 0.0
    for k in range(int(memory[world, WARM_CONTACT_COUNT])):
        row = WARM_HEADER_SIZE + WARM_CONTACT_SIZE * k
        a, b = int(memory[world, row + WARM_BODY_A]), int(memory[world, row + WARM_BODY_B])
        _add_square(soft.paid, a, b, memory[world, depth_column(k, many)], many)
    for k in range(n):
        depth = min(many.contacts.gap[k], 0.0)
        _add_square(soft.found, many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], depth, many)
    is_placed = memory[world, WARM_STAGE_LENGTH] == 0.0
    for k in range(n):
        share = min(_paid_share(many.contacts.bodies[k, 0], many), _paid_share(many.contacts.bodies[k, 1], many))
        soft.unpaid[k] = 0.0 if is_placed else (share - 1.0) * min(many.contacts.gap[k], 0.0)
        soft.start_gap[k] = many.contacts.gap[k] + soft.unpaid[k]


def _halves(n, world, h, memory, many):
    return 0.5 * h, 0.5 * h


@if_given("many.compliance", _halves)
def split_stage(n, world, h, memory, many):
    """Lengths (1 - θ) h and θ h [s] of the drifts before and after the impulses of n contacts, in a stage of h [s].

    The gaps at the start are kept for the targets; `memory` has those at the end of the last stage of the world. With
    rigid contact both lengths are h/2.
    """
    _note_start_gaps(n, world, memory, many)
    w, body = _largest_mobility(n, many), many.bodies.body[0]
    rate = max(math.sqrt(contact_stiffness(body) * w), contact_damping(body) * w)
    theta = max(0.5, 1.0 - 1.0 / (rate * h)) if n > 0 else 0.5
    many.compliance.last_drift[0] = theta * h
    return (1.0 - theta) * h, theta * h


def _no_trials(h, many):
    return 0


@if_given("many.compliance", _no_trials)
def trials_of_springs(h, many):
    """Number of parts that springs may ask for in a substep of h [s] under error control, refused ones included.

    It goes with the angle by which the fastest spring oscillates, up to `_MAX_ANGLE`: stiffer springs are not resolved.
    """
    rate, body = 0.0, many.bodies.body[0]
    for b in range(many.bodies.state.shape[0]):
        if not is_fixed(b, many.bodies):
            w = _POINTS * many.bodies.inv_mass[b]
            rate = max(rate, max(math.sqrt(contact_stiffness(body) * w), contact_damping(body) * w))
    return int(_TRIALS_PER_RADIAN * min(rate * h, _MAX_ANGLE))


@inlined
def aim_at_springs(k, gain, before, after, many):
    """Set normal target and compliance γ of contact k in a stage with drifts of `before` and `after` [s].

    `gain` is the acceleration of its gap by turning [m/s²]. Gaps and velocities are those between the drifts, before
    loads and impulses act.
    """
    soft, body, h = many.compliance, many.bodies.body[0], before + after
    stiffness, damping, theta = contact_stiffness(body), contact_damping(body), after / h
    if soft.start_gap[k] > pair_slop(many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], many):
        damping = 0.0
    D = theta * (after * stiffness + damping)
    start, gap, speed = min(soft.start_gap[k], 0.0), many.contacts.gap[k] + soft.unpaid[k], _normal_speed(k, many)
    soft.give[k] = 1.0 / (h * D)
    soft.plain[k, 0] = -(stiffness * (theta * gap + (1.0 - theta) * start) + damping * (1.0 - theta) * speed) / D
    soft.plain[k, 1] = gap
    speed -= before * gain
    soft.start_speed[k] = speed
    gap += 0.5 * after * after * gain
    push = stiffness * (theta * gap + (1.0 - theta) * start)
    push += damping * (theta * after * gain + (1.0 - theta) * speed)
    many.contacts.target[k, 0], soft.coast_gap[k] = -push / D, gap


@if_given("many.compliance")
def foretell_end_gaps(n, after, many):
    """Foretell the gaps of the n contacts at the end of the stage, whose last drift is `after` [s] long."""
    for k in range(n):
        many.compliance.end_gap[k] = many.compliance.coast_gap[k] + after * _normal_speed(k, many)


def _without_lift(k, many):
    return min(many.contacts.target[k, 0], 0.0)


@if_given("many.compliance", _without_lift)
def dissipative_target(k, many):
    """Normal target of contact k that cannot raise the energy [m/s]: that of its spring if nothing turned."""
    many.compliance.coast_gap[k] = many.compliance.plain[k, 1]
    return many.compliance.plain[k, 0]


@inlined
def _body_gain(b, before, after, many):
    """Energy that body b has gained in a stage, less the work of its loads, and its size [J].

    Its place moves for `before` [s] at the velocity before the impulses, and for `after` [s] at that after them.
    """
    body, M = many.bodies.body[b], many.bodies.momenta
    v, w = row_vector(M, b, PRE_LOAD_VELOCITY), row_vector(M, b, PRE_LOAD_VELOCITY + 3)
    v_new, w_new = row_vector(many.bodies.state, b, at.LINVEL), row_vector(many.bodies.twist, b, 3)
    L, a = row_vector(many.bodies.state, b, at.ANGMOM), as_vector(body.free_acceleration)
    gain = 0.5 * body.mass * qt.dot(subtract(v_new, v), add_scaled(v, 1.0, v_new))
    gain += 0.5 * qt.dot(subtract(L, row_vector(M, b, LOADED_MOMENTA + 3)), add_scaled(w, 1.0, w_new))
    gain -= body.mass * (before * qt.dot(a, v) + after * qt.dot(a, v_new))
    square = (before + after) ** 2 * qt.dot(a, a)
    return gain, 0.5 * (body.mass * (qt.dot(v, v) + square) + abs(qt.dot(L, w_new)))


@inlined
def energy_with_springs(n, h, many):
    """Gain of energy of a stage of length h [s], that of the springs of n contacts included, and its size [J].

    The work of loads and of driven bodies is no gain.
    """
    gain, size, after = 0.0, 0.0, many.compliance.last_drift[0]
    for b in range(many.bodies.state.shape[0]):
        if many.bodies.touched[b] == 1:
            more, scale = _body_gain(b, h - after, after, many)
            gain, size = gain + more, size + scale
    for k in range(n):
        start, end = min(many.compliance.start_gap[k], 0.0), min(many.compliance.end_gap[k], 0.0)
        gain += 0.5 * contact_stiffness(many.bodies.body[0]) * (end * end - start * start)
    work = driven_work(n, many)
    return gain - work, size + abs(work)


@if_given("many.compliance")
def measure_from_due_depth(n, many):
    """Measure the gaps of the n contacts from the depth that the contact problem has foretold, after a stage.

    Compliances are cleared, since positions are corrected as those of rigid bodies. Under error control no correction
    follows a depth that is within the error of a part.
    """
    for k in range(n):
        many.compliance.give[k] = 0.0
        many.contacts.gap[k] -= min(many.compliance.end_gap[k], 0.0)
        if abs(many.contacts.gap[k]) <= allowed_depth(many.contacts.bodies[k, 0], many):
            many.contacts.gap[k] = 0.0


def _share_of_depth(gap, goal, many):
    return goal


@if_given("many.compliance", _share_of_depth)
def correction_of(gap, goal, many):
    """Displacement that takes back the whole depth beyond the due one, so that no spring stores it [m]."""
    return -gap
