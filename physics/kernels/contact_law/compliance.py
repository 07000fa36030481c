"""Compliant contact: springs and dampers between contact points and walls, by the θ-method, stable at any stiffness.

A contact point with the gap g pushes with the force f = -k g - c g', and never pulls: 0 <= f ⟂ f + k g + c g' >= 0.
Here k is the stiffness, c the damping, and g' the rate of the gap. A stage of length h drifts (1 - θ) h with the old
velocities and θ h with the new ones. Its impulse p weights the values at the start (0) and at the end (1) in the same
way:

    p = -h (k g_θ + c g'_θ),    g_θ = (1 - θ) g⁰ + θ g¹,    g'_θ likewise.

If the point begins above the wall, g⁰ > 0, then g⁰ counts as 0: so the spring stores at most the energy that the motion
has paid for. Let g be the gap after the first drift, u the new normal velocity of the point there, and b the normal
acceleration that turning gives to it (`target_velocity.set_resting_targets`). Then g¹ = g + θh u + (θh)² b/2 and
g'¹ = u + θh b, which are linear in u. So the contact problem has the normal rows

    0 <= p ⟂ u + γ p - t >= 0,    γ = 1/(h D),    D = θ (θhk + c),
    t = -[k (θ (g + (θh)² b/2) + (1 - θ) g⁰) + c (θ²h b + (1 - θ) g'⁰)]/D,

with the compliance γ added to the diagonal of W, and the target t. In equilibrium g = g⁰ = -p/(hk) at any h and θ: the
sag is exact. Turning is no parabola, so a point may end deeper than g¹, which is its *due depth*. The body is then
moved, so that the point has its due depth (`correct_spring_depth`). A depth for which no force has done work would be
energy from nothing in a stiff spring.

θ = ½ is the midpoint rule: it is of second order, and a spring keeps its energy, p (u⁰ + u¹)/2 = -k (g¹² - g⁰²)/2.
θ = 1 is implicit Euler, which brings motion that a step does not resolve to rest in one step. For ½ <= θ <= 1 no energy
is gained. Let λ be the fastest rate of the contacts, the larger of √(k w) and c w, with w = Σ W_nn over all contacts,
which is at least the largest eigenvalue. The stage has

    θ = max(½, 1 - 1/(λh)):

the midpoint rule where λh <= 2, and towards implicit Euler beyond.

References
----------
E. Hairer, G. Wanner, *Solving Ordinary Differential Equations II*, 2nd ed., 1996, section IV.3, for the stability of
θ-methods.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined
from physics.kernels.contact_law.restitution_energy import lift_conserving_energy
from physics.kernels.contact_law.target_velocity import MAX_TARGET_TURN, NEGLIGIBLE_SLOP_SHARE
from physics.kernels.half_space.contact_point import (
    contact_arm,
    contact_arm_and_rate,
    feature_of,
    place_arms,
    wall_normal,
    wall_of,
)
from physics.kernels.half_space.contact_set import feature_gap, nearest_outside_set
from physics.kernels.math import quaternion as qt
from physics.kernels.state import layout as at
from physics.kernels.state.body import angular_velocity, apply_inv_inertia, kinetic_energy, principal_attitude
from physics.kernels.state.contact_law_dispatch import LAW_DAMPING, LAW_STIFFNESS, if_law, law_parameter

# Share of its energy that a body may gain in a resting stage, by errors of third order in the step.
ENERGY_GAIN_TOLERANCE = 2.0e-5

contact_stiffness = law_parameter(LAW_STIFFNESS)
contact_damping = law_parameter(LAW_DAMPING)


@inlined
def _along(x, s, n):
    return x[0] + s * n[0], x[1] + s * n[1], x[2] + s * n[2]


def _halves(n, y, h, offset_frame, scratch):
    return 0.5 * h, 0.5 * h


@if_law((LAW_STIFFNESS,), _halves)
def split_stage_by_theta(n, y, h, offset_frame, scratch):
    """Lengths (1 - θ) h and θ h [s] of the drifts before and after the impulses of a stage of length h from y.

    n is the number of contacts. In scenes without compliant contact both are h/2.
    """
    body = scratch.body
    q = y[1]
    place_arms(n, qt.to_matrix(q), offset_frame, scratch)
    R = qt.to_matrix(principal_attitude(q, body, offset_frame))
    w = n / body.mass
    for i in range(n):
        m = qt.cross(
            contact_arm(scratch.contacts, i),
            wall_normal(scratch.scene.walls, wall_of(scratch.contacts.slot[i], scratch.scene)),
        )
        w += qt.dot(m, apply_inv_inertia(R, m, body.J))
    rate = max(math.sqrt(contact_stiffness(body) * w), contact_damping(body) * w)
    theta = max(0.5, 1.0 - 1.0 / (rate * h))
    return (1.0 - theta) * h, theta * h


def _no_aim(*arguments):
    return None


@if_law((LAW_STIFFNESS,), _no_aim)
def set_spring_targets(n, x, motion, before, after, offset_frame, scratch):
    """Set the normal targets of n compliant contacts and the compliance γ of the stage, after `set_resting_targets`.

    The stage has two drifts, `before` and `after` [s] long. x and `motion` (`StageMotion`) are position and motion of
    the body between them, before the impulses. `contacts.gap` has the gaps at the start. Written are `contacts.target`,
    `contacts.end_gap` (the gaps at the end, so far without the new velocities) and `body.give`, γ [1/kg].
    """
    scene, body, contacts = scratch.scene, scratch.body, scratch.contacts
    R, v, w, alpha = motion
    h = before + after
    k, c = contact_stiffness(body), contact_damping(body)
    theta = after / h
    D = theta * (after * k + c)
    body.give = 1.0 / (h * D)
    dims = (body.dims[0], body.dims[1], body.dims[2])
    is_turning = qt.dot(w, w) * h * h <= MAX_TARGET_TURN * MAX_TARGET_TURN
    for i in range(n):
        wall = wall_of(contacts.slot[i], scene)
        normal = wall_normal(scene.walls, wall)
        r, rate = contact_arm_and_rate(
            body.shape, dims, R, w, normal, feature_of(contacts.slot[i], scene), offset_frame, body
        )
        gain = 0.0
        if is_turning:
            gain = qt.dot(normal, qt.cross(w, rate)) + qt.dot(normal, qt.cross(alpha, r))
        speed = qt.dot(normal, v) + qt.dot(normal, qt.cross(w, r)) - before * gain
        gap = feature_gap(contacts.slot[i], x, R, offset_frame, scratch) + 0.5 * after * after * gain
        push = k * (theta * gap + (1.0 - theta) * min(contacts.gap[i], 0.0))
        push += c * (theta * after * gain + (1.0 - theta) * speed)
        contacts.target[i, 0] = -push / D
        contacts.end_gap[i] = gap


@if_law((LAW_STIFFNESS,), _no_aim)
def predict_end_gaps(n, v, w, after, scratch):
    """Complete the gaps at the end of the stage, `contacts.end_gap` [m], by the motion of the last drift.

    `after` is the length of that drift [s], v and w are velocity and angular velocity after the impulses.
    """
    contacts = scratch.contacts
    for i in range(n):
        normal = wall_normal(scratch.scene.walls, wall_of(contacts.slot[i], scratch.scene))
        contacts.end_gap[i] += after * (qt.dot(normal, v) + qt.dot(normal, qt.cross(w, contact_arm(contacts, i))))


def _as_it_ends(n, y, end, h, offset_frame, report, scratch):
    return end


@inlined
def _lifted(n, x, R, share, offset_frame, scratch):
    """Move the position x out of walls until no contact point is deeper than `share` of its due depth; return it.

    The due depth of a contact is the depth that the contact problem predicted; `contacts.end_gap` holds it as a
    negative gap. R is the body's rotation matrix.
    """
    contacts = scratch.contacts
    least = NEGLIGIBLE_SLOP_SHARE * scratch.body.slop
    for i in range(n):
        lift = share * min(contacts.end_gap[i], 0.0) - feature_gap(contacts.slot[i], x, R, offset_frame, scratch)
        if lift > least:
            x = _along(x, lift, wall_normal(scratch.scene.walls, wall_of(contacts.slot[i], scratch.scene)))
    return x


@inlined
def _work_of_loads(y, end, h, offset_frame, body):
    """Work of the held loads on a body over h from y to `end`, plus its loss of kinetic energy [J]."""
    a, T, v, L = body.free_acceleration, body.torque, end[2], end[3]
    d = end[0][0] - y[0][0], end[0][1] - y[0][1], end[0][2] - y[0][2]
    lost = kinetic_energy(y[1], y[2], y[3], body, offset_frame) - kinetic_energy(end[1], v, L, body, offset_frame)
    if T[0] != 0.0 or T[1] != 0.0 or T[2] != 0.0:
        first, last = angular_velocity(y[1], y[3], body, offset_frame), angular_velocity(end[1], L, body, offset_frame)
        turn = 0.5 * (first[0] + last[0]), 0.5 * (first[1] + last[1]), 0.5 * (first[2] + last[2])
        lost += h * (T[0] * turn[0] + T[1] * turn[1] + T[2] * turn[2])
    return lost + body.mass * (a[0] * d[0] + a[1] * d[1] + a[2] * d[2])


@inlined
def _stored(n, x, R, offset_frame, scratch):
    """Energy in the springs of n contacts, for a body at the position x with the rotation matrix R [J]."""
    stored = 0.0
    for i in range(n):
        gap = min(feature_gap(scratch.contacts.slot[i], x, R, offset_frame, scratch), 0.0)
        stored += 0.5 * contact_stiffness(scratch.body) * gap * gap
    return stored


@inlined
def _without_excess(y, end, excess, h, offset_frame, report, scratch):
    """State after a stage from y to `end`, with the energy `excess` [J], which it has created, taken from the motion.

    An excess within the errors of the stage and of its solve is left. If the kinetic energy is smaller than the excess,
    the body stays at the pose of y without velocity, and is reported as unresolved motion.
    """
    body = scratch.body
    x, q, v, L = end
    size = kinetic_energy(y[1], y[2], y[3], body, offset_frame)
    size += body.mass * h * h * qt.dot(body.free_acceleration, body.free_acceleration)
    if not excess > max(scratch.settings.tolerance, ENERGY_GAIN_TOLERANCE) * size:
        return end
    motion = kinetic_energy(q, v, L, body, offset_frame)
    if not excess < motion:
        report[body.world, at.UNRESOLVED_MOTION] += 1.0
        return y[0], y[1], (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    s = math.sqrt(1.0 - excess / motion)
    return x, q, (s * v[0], s * v[1], s * v[2]), (s * L[0], s * L[1], s * L[2])


@if_law((LAW_STIFFNESS,), _as_it_ends)
def correct_spring_depth(n, y, end, h, offset_frame, report, scratch):
    """Correct the end of a compliant stage of length h from y to `end`: lift contact points that are too deep.

    A point is too deep below its due depth, which the contact problem has foretold (`contacts.end_gap`). Returns the
    corrected end. Contact points outside the set are moved out of walls. The springs then store at most the
    sum of their energy before, of the loss of kinetic energy, and of the work of loads; the body is lifted further
    where they store more. (Damping stops a point at the turning rate of the stage's start. It leaves the point too deep
    if the impulses have slowed the turning.) Friction coefficients far above 1 may push a turning point by more than
    its spring takes; this energy is taken from the motion.
    """
    body = scratch.body
    x, q, v, L = end
    R, least = qt.to_matrix(q), NEGLIGIBLE_SLOP_SHARE * body.slop
    x = _lifted(n, x, R, 1.0, offset_frame, scratch)
    before = 0.0
    for i in range(n):
        before += 0.5 * contact_stiffness(body) * min(scratch.contacts.gap[i], 0.0) ** 2
    stored = _stored(n, x, R, offset_frame, scratch)
    if stored > before:
        budget = before + _work_of_loads(y, (x, q, v, L), h, offset_frame, body)
        if stored > budget:
            x = _lifted(n, x, R, math.sqrt(max(budget, 0.0) / stored), offset_frame, scratch)
            stored = _stored(n, x, R, offset_frame, scratch)
    gap, slot = nearest_outside_set(x, R, offset_frame, scratch)
    if gap < -least:
        x = _along(x, -gap, wall_normal(scratch.scene.walls, wall_of(slot, scratch.scene)))
    end = lift_conserving_energy(x, end, offset_frame, body)
    excess = stored - before - _work_of_loads(y, end, h, offset_frame, body)
    return _without_excess(y, end, excess, h, offset_frame, report, scratch)


def _as_it_is(block, body):
    return block


@if_law((LAW_STIFFNESS,), _as_it_is)
def add_block_compliance(W, body):
    """Add the compliance γ to the normal entry of W, a contact's own Delassus block, nine scalars row by row."""
    return W[0] + body.give, W[1], W[2], W[3], W[4], W[5], W[6], W[7], W[8]


def _as_assembled(n, width, scratch):
    return None


@if_law((LAW_STIFFNESS,), _as_assembled)
def add_delassus_compliance(n, width, scratch):
    """Add the compliance γ to the normal diagonal entries of the Delassus matrix, with `width` rows per contact."""
    for i in range(n):
        scratch.contacts.delassus[width * i, width * i] += scratch.body.give


def _unyielding(value, rho, body):
    return value


@if_law((LAW_STIFFNESS,), _unyielding)
def scale_by_compliance(value, rho, body):
    """Divide `value` by 1 + ρ γ, with ρ = `rho` and the compliance γ of contact; without compliance it stays the same.

    `value` = q - ρ u is the normal impulse of a proximal step at a rigid wall. At a compliant wall
    p = q - ρ (u + γ p) gives p = (q - ρ u)/(1 + ρ γ). The slope of the impulse has the same factor.
    """
    return value / (1.0 + rho * body.give)
