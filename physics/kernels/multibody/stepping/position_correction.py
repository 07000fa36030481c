"""Position correction: push overlapping bodies apart, without giving them a velocity.

The displacements of the bodies solve a frictionless contact problem with depths as targets instead of velocities. The
solution is the least displacement, in the kinetic metric, that takes back half of each overlap beyond half a slop.
Momenta change only to keep the angular momentum, and to keep the energy from growing (`energy_budget`).
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel, shared_kernel
from physics.kernels.contact_law.compliance import ENERGY_GAIN_TOLERANCE
from physics.kernels.math import quaternion as qt
from physics.kernels.math.union_find import find_root
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.arrays import TURN_GAIN
from physics.kernels.multibody.data.contact_set import add_scaled, pair_slop, put_vector, subtract, update_contacts
from physics.kernels.multibody.data.kinematics import update_body_pose
from physics.kernels.multibody.solver.contact_operator import apply_body_inv_inertia
from physics.kernels.multibody.solver.islands import union_contacts
from physics.kernels.multibody.stepping.compliant_stage import correction_of, measure_from_due_depth
from physics.kernels.multibody.stepping.energy_budget import (
    cap_rotational_energy,
    clamp_body_inside_walls,
    free_lift_work,
    take_kinetic_energy,
    work_against_loads,
)
from physics.kernels.multibody.stepping.position_sweeps import sweep_positions
from physics.kernels.state import layout as at
from physics.kernels.state.body import angular_velocity, read_state, write_state

# Share of the depth beyond half a slop that one correction takes back. Since bodies turn, the whole depth would
# overshoot.
_CORRECTION_SHARE = 0.5

# Largest number of corrections in a stage, and the depth in slops above which another one follows, if the last one
# helped. Loads of a million times the weight may turn bodies deep into others, and these are moved out at once.
_MAX_ROUNDS = 30
_DEEP_SLOPS = 100.0

# Largest gain of a body by its turn in the air that is not taken from its motion, as a share of its rotational energy.
# Depths halve from one correction to the next, and so do these gains: together they are that of a resting stage.
_FREE_TURN_SHARE = 0.5 * ENERGY_GAIN_TOLERANCE

# Largest gain of two bodies without relative motion that is not taken from them, as a share of their rotational energy.
_FREE_SPIN_SHARE = 1.0e-6

# Largest error of the displacements, relative to the largest target or to so many slops, whichever is larger; if solves
# have a fine tolerance, the square root of the tolerance in its place, since errors add up over landings. Then the
# largest number of sweeps, and that for deep penetrations: a light body between a wall and a heavy body needs as many
# sweeps as the ratio of the masses. A stage leaves half of the depth anyway, so that a coarse error does no harm.
_CORRECTION_ERROR = 1.0e-2
_ERROR_SLOPS = 10.0
_CORRECTION_SWEEPS = 50
_DEEP_SWEEPS = 1000


@inlined
def _set_displacement_targets(n, many):
    """Set the target displacements of the n contacts along their normals: (deepest penetration, allowed error [m]).

    The penetration is in slops of its pair; contacts deeper than 1 slop have a target above 0. The allowed error is
    that of a displacement.
    """
    deepest, largest, least = 0.0, 0.0, math.inf
    for k in range(n):
        slop, gap = pair_slop(many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], many), many.contacts.gap[k]
        goal = -max(gap, 0.0)
        if gap < -slop:
            goal = -_CORRECTION_SHARE * (gap + 0.5 * slop)
            goal = correction_of(gap, goal, many)
            largest, least = max(largest, goal), min(least, slop)
        deepest = max(deepest, -gap / slop)
        put_vector(many.contacts.target, k, 0, (goal, 0.0, 0.0))
    return deepest, min(_CORRECTION_ERROR, math.sqrt(many.settings[0].tolerance)) * max(largest, _ERROR_SLOPS * least)


@inlined
def _pose_inside_walls(b, offset_frame, many):
    """Update the pose of body b, and move its geometric centre inside all walls."""
    update_body_pose(b, offset_frame, many)
    clamp_body_inside_walls(b, many)


@kernel
def _mark_held_islands(n, many):
    """Mark the islands of the n contacts that a wall pushes: `many.islands.of_body` is 1 at their root, else 0."""
    union_contacts(n, many)
    for b in range(many.bodies.state.shape[0]):
        many.islands.of_body[b] = 0
    for k in range(n):
        if many.contacts.bodies[k, 1] < 0 and many.contacts.impulse[k, 0] > 0.0:
            many.islands.of_body[find_root(many.contacts.bodies[k, 0], many.islands.parent)] = 1


@inlined
def _is_held(b, many):
    """True if a wall pushes the island of body b (`_mark_held_islands`)."""
    return many.islands.of_body[find_root(b, many.islands.parent)] == 1


@inlined
def _add_angular_momentum(b, s, turn, many):
    """Add s times the vector `turn` to the angular momentum of body b."""
    put_vector(many.bodies.state, b, at.ANGMOM, add_scaled(row_vector(many.bodies.state, b, at.ANGMOM), s, turn))


@inlined
def _spin(b, many):
    """Angular velocity of body b from its angular momentum, world frame [rad/s]."""
    return apply_body_inv_inertia(b, row_vector(many.bodies.state, b, at.ANGMOM), many)


@inlined
def _share_that_takes(energy, stock):
    """Share s of a relative velocity to remove, so that its energy `stock` decreases by `energy` [J].

    It solves energy = stock (1 - (1 - s)²).
    """
    return 1.0 - math.sqrt(max(0.0, 1.0 - energy / stock)) if stock > 0.0 else 0.0


@kernel
def _take_relative_energy(a, b, energy, many):
    """Take `energy` [J] from the relative motion of bodies a and b, with both total momenta kept.

    It is taken first from the relative velocity along the line of centres. The rest is taken from the difference of the
    angular velocities, with a lower bound of their reduced moment of inertia. Returns False, and takes nothing, if both
    together have less.
    """
    inverse = many.bodies.inv_mass[a] + many.bodies.inv_mass[b]
    way = subtract(row_vector(many.bodies.state, a, at.POS), row_vector(many.bodies.state, b, at.POS))
    u = subtract(row_vector(many.bodies.state, a, at.LINVEL), row_vector(many.bodies.state, b, at.LINVEL))
    square, w, K = qt.dot(way, way), subtract(_spin(a, many), _spin(b, many)), many.bodies.inv_inertia
    along = qt.dot(u, way) / square if square > 0.0 else 0.0
    inertia = 1.0 / (K[a, 0] + K[a, 3] + K[a, 5] + K[b, 0] + K[b, 3] + K[b, 5])
    central, spinning = 0.5 * along * along * square / inverse, 0.5 * inertia * qt.dot(w, w)
    if energy > central + spinning:
        return False
    part = min(energy, central)
    p = _share_that_takes(part, central) * along / inverse
    for body, sign in ((a, -1.0), (b, 1.0)):
        v = row_vector(many.bodies.state, body, at.LINVEL)
        put_vector(many.bodies.state, body, at.LINVEL, add_scaled(v, sign * p * many.bodies.inv_mass[body], way))
    s = _share_that_takes(energy - part, spinning) * inertia
    _add_angular_momentum(a, -s, w, many)
    _add_angular_momentum(b, s, w, many)
    return True


@kernel
def _keep_angular_momentum(n, many):
    """Turn the bodies of each of the n contacts, to keep the angular momentum that their displacement would add.

    A displacement of a by p n/m_a and of b by -p n/m_b adds p n x (v_a - v_b). Both bodies take up a part of it, in
    proportion to their m r² (mass, bounding radius). The energy that this adds is stored in
    `many.contacts.rebound_impulse` [J].
    """
    for k in range(n):
        a, b, p = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], many.contacts.impulse[k, 0]
        many.contacts.rebound_impulse[k, 0] = 0.0
        if b < 0 or not p > 0.0:
            continue
        u = subtract(row_vector(many.bodies.state, a, at.LINVEL), row_vector(many.bodies.state, b, at.LINVEL))
        turn = qt.cross(u, row_vector(many.contacts.frame, k, 0))
        one = many.bodies.body[a].radius ** 2 / many.bodies.inv_mass[a]
        on_a = p * one / (one + many.bodies.body[b].radius ** 2 / many.bodies.inv_mass[b])
        on_b = p - on_a
        v, w = apply_body_inv_inertia(a, turn, many), apply_body_inv_inertia(b, turn, many)
        gain = on_a * qt.dot(turn, _spin(a, many)) + on_b * qt.dot(turn, _spin(b, many))
        gain += 0.5 * (on_a * on_a * qt.dot(turn, v) + on_b * on_b * qt.dot(turn, w))
        many.contacts.rebound_impulse[k, 0] = gain
        _add_angular_momentum(a, on_a, turn, many)
        _add_angular_momentum(b, on_b, turn, many)


@inlined
def _spin_energy(b, many):
    return 0.5 * qt.dot(row_vector(many.bodies.state, b, at.ANGMOM), _spin(b, many))


@kernel
def _pay_for_spins(n, offset_frame, many):
    """Take the energy that `_keep_angular_momentum` and turns have added from the relative motion of the bodies.

    A body's gain by its turn is taken at the first of its contacts that has pushed it. If the relative motion has too
    little, and the energy is not negligible, it is taken from the motion of both bodies, which changes their momentum.
    """
    for k in range(n):
        a, b, gain = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], many.contacts.rebound_impulse[k, 0]
        if b < 0 or not many.contacts.impulse[k, 0] > 0.0:
            continue
        gain += many.bodies.momenta[a, TURN_GAIN] + many.bodies.momenta[b, TURN_GAIN]
        many.bodies.momenta[a, TURN_GAIN] = many.bodies.momenta[b, TURN_GAIN] = 0.0
        if not gain > 0.0 or _take_relative_energy(a, b, gain, many):
            continue
        one, other = _spin_energy(a, many), _spin_energy(b, many)
        if gain > _FREE_SPIN_SHARE * (one + other):
            take_kinetic_energy(a, gain * one / (one + other), offset_frame, many)
            take_kinetic_energy(b, gain * other / (one + other), offset_frame, many)


@inlined
def _displace(b, offset_frame, many):
    """Move and turn body b by the displacement in `many.bodies.twist`; return the work against its loads [J].

    The work is 0 if no wall pushes the island of b. There b keeps its angular momentum L, and what ½ L·I⁻¹L gains is
    stored for `_pay_for_spins`, unless it is negligible.
    """
    x, q, v, L = read_state(many.bodies.state, b)
    start, before = x, 0.5 * qt.dot(L, angular_velocity(q, L, many.bodies.body[b], offset_frame))
    turn = qt.exp_map(row_vector(many.bodies.twist, b, 3))
    x, q = add_scaled(x, 1.0, row_vector(many.bodies.twist, b, 0)), qt.normalise(qt.multiply(turn, q))
    write_state(many.bodies.state, b, (x, q, v, L))
    if not _is_held(b, many):
        gain = 0.5 * qt.dot(L, angular_velocity(q, L, many.bodies.body[b], offset_frame)) - before
        many.bodies.momenta[b, TURN_GAIN] = gain if gain > _FREE_TURN_SHARE * before else 0.0
        return 0.0
    cap_rotational_energy(b, before, offset_frame, many)
    return work_against_loads(b, start, many)


@inlined
def _displace_all(offset_frame, many):
    """Move and turn all pushed bodies; take the work of lifting from the kinetic energy of the lifted bodies."""
    total = ups = free = 0.0
    for b in range(many.bodies.state.shape[0]):
        many.bodies.lift_work[b] = many.bodies.momenta[b, TURN_GAIN] = 0.0
        if many.bodies.touched[b] == 0:
            continue
        free += free_lift_work(b, many)
        if many.sweeps.pushed[b] > 0:
            lift = _displace(b, offset_frame, many)
            _pose_inside_walls(b, offset_frame, many)
            many.bodies.lift_work[b] = max(lift, 0.0)
            total, ups = total + lift, ups + max(lift, 0.0)
    if total > free:
        for b in range(many.bodies.state.shape[0]):
            if many.bodies.lift_work[b] > 0.0:
                take_kinetic_energy(b, many.bodies.lift_work[b] * (total / ups), offset_frame, many)


@inlined
def _correct_once(n, offset_frame, many):
    """Correct the positions of the bodies of the n contacts once; return the deepest penetration before, in slops.

    Arms and gaps are first updated to the bodies' present places.
    """
    update_contacts(many)
    measure_from_due_depth(n, many)
    deepest, error = _set_displacement_targets(n, many)
    if not deepest > 1.0:
        return deepest
    sweep_positions(
        n, error, _DEEP_SWEEPS if deepest > _DEEP_SLOPS else min(_CORRECTION_SWEEPS, many.settings[0].sweeps), many
    )
    _mark_held_islands(n, many)
    _keep_angular_momentum(n, many)
    _displace_all(offset_frame, many)
    _pay_for_spins(n, offset_frame, many)
    return deepest


@shared_kernel
def correct_positions(n, offset_frame, many):
    """Move the bodies of the n contacts apart where they overlap by more than the slop.

    A correction repeats while the deepest penetration is above `_DEEP_SLOPS` and decreases. `offset_frame` is a switch
    of `state.groups.FlightSwitches`.
    """
    for b in range(many.bodies.state.shape[0]):
        if many.bodies.touched[b] == 1:
            _pose_inside_walls(b, offset_frame, many)
    before = math.inf
    for _ in range(_MAX_ROUNDS):
        deepest = _correct_once(n, offset_frame, many)
        if not _DEEP_SLOPS < deepest < before:
            break
        before = deepest
