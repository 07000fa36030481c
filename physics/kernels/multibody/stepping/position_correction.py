"""Push overlapping bodies apart: positions only; velocities change where that would gain energy (`energy_budget`).

The displacements of the bodies solve the frictionless contact problem whose targets are depths instead of velocities:
the least displacement, in the metric of mass, that brings every contact of the set back to half a slop. A quarter of
overlap therefore comes apart without speed.
"""

from __future__ import annotations

import math

from physics.kernels.compile.decorators import inlined, shared_kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.contact_set import add_scaled, pair_slop, put_vector, update_contacts
from physics.kernels.multibody.data.kinematics import update_body_pose
from physics.kernels.multibody.stepping.energy_budget import (
    cap_rotational_energy,
    clamp_body_inside_walls,
    free_lift_work,
    take_kinetic_energy,
    work_against_loads,
)
from physics.kernels.multibody.stepping.position_sweeps import sweep_positions
from physics.kernels.state.body import angular_velocity, read_state, write_state

# Share of the depth beyond half a slop that one stage takes back: turning makes the whole of it overshoot.
_CORRECTION_SHARE = 0.5

# Rounds, and the depth in slops from which on there is another, if the last one helped: what loads of a million times
# the weight have turned deep into others is taken out at once.
_MAX_ROUNDS = 30
_DEEP_SLOPS = 100.0

# Error of the displacements at most, relative to the largest target, or to so many slops where that is less,
# and sweeps for it at most, if a contact problem may take as many: something light between a wall and something heavy
# needs as many as their masses differ. A stage leaves half of the depth anyway, and half a slop less than the slop:
# what is off by less is done with. Where solves are finer than that the error is the root of their tolerance, since
# what it leaves grows with every landing.
_CORRECTION_ERROR = 1.0e-2
_ERROR_SLOPS = 10.0
_CORRECTION_SWEEPS = 50
_DEEP_SWEEPS = 1000


@inlined
def _set_displacement_targets(n, many):
    """Set the target displacements along the normals: (deepest penetration, negligible error of a displacement [m]).

    The penetration is in slops of its pair: from 1 on there are some displacements.
    """
    deepest, largest, least = 0.0, 0.0, math.inf
    for k in range(n):
        slop, gap = pair_slop(many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], many), many.contacts.gap[k]
        goal = -max(gap, 0.0)
        if gap < -slop:
            goal = -_CORRECTION_SHARE * (gap + 0.5 * slop)
            largest, least = max(largest, goal), min(least, slop)
        deepest = max(deepest, -gap / slop)
        put_vector(many.contacts.target, k, 0, (goal, 0.0, 0.0))
    return deepest, min(_CORRECTION_ERROR, math.sqrt(many.settings[0].tolerance)) * max(largest, _ERROR_SLOPS * least)


@inlined
def _pose_inside_walls(b, offset_frame, many):
    """Place of body b with its centre inside all walls."""
    update_body_pose(b, offset_frame, many)
    clamp_body_inside_walls(b, offset_frame, many)


@inlined
def _displace(b, offset_frame, many):
    """Move and turn body b by what `many.bodies.twist` says; the work that it takes against its loads [J]."""
    x, q, v, L = read_state(many.bodies.state, b)
    start, before = x, 0.5 * qt.dot(L, angular_velocity(q, L, many.bodies.work[b], offset_frame))
    turn = qt.exp_map(row_vector(many.bodies.twist, b, 3))
    x = add_scaled(x, 1.0, row_vector(many.bodies.twist, b, 0))
    write_state(many.bodies.state, b, (x, qt.normalise(qt.multiply(turn, q)), v, L))
    cap_rotational_energy(b, before, offset_frame, many)
    return work_against_loads(b, start, many)


@inlined
def _displace_all(offset_frame, many):
    """Move and turn the bodies, and let those that were lifted pay for what all of them were (`energy_budget`)."""
    total = ups = free = 0.0
    for b in range(many.bodies.state.shape[0]):
        many.bodies.lift_work[b] = 0.0
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
    """One round for the n contacts, posed where the bodies are: the deepest that anything was, in its slop."""
    update_contacts(many)
    deepest, error = _set_displacement_targets(n, many)
    if not deepest > 1.0:
        return deepest
    sweep_positions(
        n, error, _DEEP_SWEEPS if deepest > _DEEP_SLOPS else min(_CORRECTION_SWEEPS, many.settings[0].sweeps), many
    )
    _displace_all(offset_frame, many)
    return deepest


@shared_kernel
def correct_positions(n, offset_frame, many):
    """Move the bodies of the n contacts apart where they overlap by more than the slop."""
    for b in range(many.bodies.state.shape[0]):
        if many.bodies.touched[b] == 1:
            _pose_inside_walls(b, offset_frame, many)
    before = math.inf
    for _ in range(_MAX_ROUNDS):
        deepest = _correct_once(n, offset_frame, many)
        if not _DEEP_SLOPS < deepest < before:
            break
        before = deepest
