"""The stage between impacts: exact flight of what touches nothing, Moreau's midpoint step of what does."""

from __future__ import annotations

import math

from physics.kernels.compile.decorators import inlined, kernel
from physics.kernels.contact_law.target_velocity import CLOSING_SHARE, LARGEST_TURN, UNSEEN, gainless
from physics.kernels.flight.free_flight import coast, drift
from physics.kernels.forces.held_loads import hold_contact_loads, hold_loads
from physics.kernels.forces.two_body_spring import hold_linked_loads
from physics.kernels.forces.world_energy_budget import note_start, pay_together
from physics.kernels.half_space.contact_point import wandering_point
from physics.kernels.math import quaternion as qt
from physics.kernels.multibody.data import warm_start as kept
from physics.kernels.multibody.data.contact_set import (
    acceleration_of,
    local_velocity,
    matrix,
    minus,
    pair_slop,
    plus,
    put,
    refresh,
    relative_velocity,
    vector,
)
from physics.kernels.multibody.data.kinematics import place_body
from physics.kernels.multibody.stepping.energy_budget import (
    keep_loaded,
    note_loaded,
    stage_has_gained,
    take_stage_back,
    turn_loaded,
    vector_of,
)
from physics.kernels.multibody.stepping.solve_and_apply import settle, settle_smoothly
from physics.kernels.state import layout as at
from physics.kernels.state.body import angular_velocity, read_state, write_state
from physics.kernels.state.layout import ELLIPSOID, SPHERE
from physics.kernels.state.sleeping import sleeps
from physics.kernels.time_stepping.contact_stages import STILL_SHARE


@inlined
def drift_body(b, h, gyroscopic, tilted, many):
    """Body b after half a free drift: position and attitude at constant momenta."""
    x, q, v, L = read_state(many.now, b)
    write_state(many.now, b, (plus(x, h, v), drift(q, L, many.bodies[b], h, gyroscopic, tilted), v, L))


@inlined
def _centripetal(b, k, first, side, h, many):
    """ω x ṙ of one end of contact k, world frame [m/s²].

    0 of a sphere, whose point of contact does not turn, and where it says nothing about the end of a stage of length h.
    """
    shape, w = many.bodies[b].shape, vector(many.twist, b, 3)
    if shape == SPHERE or qt.dot(w, w) * h * h > LARGEST_TURN * LARGEST_TURN:
        return (0.0, 0.0, 0.0)
    if shape == ELLIPSOID:
        d, n = many.bodies[b].dims, vector(many.frame, k, 0)
        n = (-side * n[0], -side * n[1], -side * n[2])
        _, rate = wandering_point((d[0], d[1], d[2]), matrix(many.rotation, b), w, n)
        return qt.cross(w, rate)
    return qt.cross(w, qt.cross(w, vector(many.arm, k, first)))


@inlined
def _coriolis(k, many):
    """Half of what the normal's turning gives to the relative velocity along it, [m/s²]: n·(ω x u).

    A point that slides at u on a face that turns at ω meets it where another normal was: the gap's second derivative
    has 2 n·(u x ω) beside the accelerations of the points.
    """
    owner, n = many.owner[k], vector(many.frame, k, 0)
    if owner < 0:
        return 0.0
    return qt.dot(n, qt.cross(vector(many.twist, owner, 3), relative_velocity(k, many.twist, many)))


@inlined
def aim_rest(n, h, many):
    """Targets of the resting stage over h, with gaps at its middle; see `target_velocity.aim_rest`.

    A contact that was apart at the start may close what is left of its gap at the middle in the half that follows.
    Under error control, what a point on a circle has risen by then is no gap: it would make the velocity an
    error of first order.
    """
    half = 0.5 * h
    for k in range(n):
        a, b = many.ends[k, 0], many.ends[k, 1]
        slop = pair_slop(a, b, many)
        c = _centripetal(a, k, 0, -1.0, h, many)
        if b >= 0:
            c = minus(c, _centripetal(b, k, 3, 1.0, h, many))
        t = qt.matvec(matrix(many.frame, k), (-half * c[0], -half * c[1], -half * c[2]))
        gap = many.gap[k]
        if many.settings[0].in_time == 1:
            t = (t[0] + h * _coriolis(k, many), t[1], t[2])
            gap += 0.5 * half * t[0]
        t = gainless(t, local_velocity(k, many))
        if gap > slop:
            t = (t[0] - gap / half, t[1], t[2])
        elif gap > 0.0:
            t = (t[0] - CLOSING_SHARE * gap / h, t[1], t[2])
        negligible = max(many.settings[0].tolerance * acceleration_of(k, many) * h, UNSEEN * slop / h)
        if max(abs(t[0]), max(abs(t[1]), abs(t[2]))) <= negligible:
            t = (0.0, 0.0, 0.0)
        put(many.target, k, 0, t)


@inlined
def hold_all_loads(h, gyroscopic, tilted, many):
    """Hold the loads of the middle of a stage of length h for every body; nothing where there are no fields."""
    if hold_linked_loads(h, gyroscopic, tilted, many):
        return
    for b in range(many.now.shape[0]):
        if many.touched[b] == 1:
            hold_contact_loads(read_state(many.now, b), h, gyroscopic, tilted, many.bodies[b])
        else:
            hold_loads(read_state(many.now, b), h, gyroscopic, tilted, many.bodies[b])


@inlined
def still_speed(h, many):
    """Residual that the stage is solved to whatever the tolerance allows; see `contact_stages.still_speed`."""
    least = math.inf
    for b in range(many.now.shape[0]):
        slop_speed = many.bodies[b].slop / h
        if many.touched[b] == 1 and many.settings[0].tolerance * many.bodies[b].acceleration * h > slop_speed:
            least = min(least, STILL_SHARE * slop_speed)
    return least


@inlined
def load_speed(h, many):
    """Speed that the loads of the stage alone give to what touches, at most [m/s]."""
    most = 0.0
    for b in range(many.now.shape[0]):
        if many.touched[b] == 1:
            most = max(most, many.bodies[b].acceleration * h)
    return most


@inlined
def move_all(n, world, h, friction, gyroscopic, tilted, scheme, sleep, memory, report, many):
    """`midpoint_step` under the loads that are held."""
    half, first = 0.5 * h, world * many.now.shape[0]
    for b in range(many.now.shape[0]):
        if sleeps(first + b, sleep):
            continue
        if many.touched[b] == 0:
            write_state(many.now, b, coast(read_state(many.now, b), h, gyroscopic, tilted, scheme, many.bodies[b]))
            continue
        drift_body(b, half, gyroscopic, tilted, many)
        place_body(b, tilted, many)
        _, q, _, L = read_state(many.now, b)
        put(many.twist, b, 3, angular_velocity(q, L, many.bodies[b], tilted))
    if n == 0:
        kept.forget_awake(world, h, sleep, memory, many)
        return
    refresh(many)
    aim_rest(n, h, many)
    for b in range(many.now.shape[0]):
        if many.touched[b] == 1:
            body = many.bodies[b]
            a, torque = vector_of(body.free_acceleration), vector_of(body.torque)
            note_loaded(b, vector(many.now, b, at.LINVEL), many)
            put(many.now, b, at.LINVEL, plus(vector(many.now, b, at.LINVEL), h, a))
            put(many.now, b, at.ANGMOM, plus(vector(many.now, b, at.ANGMOM), h, torque))
            keep_loaded(b, many)
            turn_loaded(b, tilted, many)
    kept.load(n, world, h, friction, memory, many)
    many.settings[0].still, many.settings[0].rests = still_speed(h, many), 1 - many.settings[0].in_time
    many.settings[0].load = load_speed(h, many)
    settle(n, world, friction, report, many)
    if stage_has_gained(n, h, many):
        take_stage_back(n, tilted, many)
        settle(n, world, friction, report, many)
        if friction is not None and stage_has_gained(n, h, many):
            take_stage_back(n, tilted, many)
            settle_smoothly(n, many)
    many.settings[0].still, many.settings[0].rests, many.settings[0].load = math.inf, 0, 0.0
    kept.store(n, world, h, sleep, memory, many)
    for b in range(many.now.shape[0]):
        if many.touched[b] == 1:
            drift_body(b, half, gyroscopic, tilted, many)


@kernel
def glide(n, world, h, friction, gyroscopic, tilted, scheme, sleep, memory, report, many):
    """Every body after h: exact flight, or Moreau's midpoint step with the n contacts of the set."""
    hold_all_loads(h, gyroscopic, tilted, many)
    note_start(tilted, many, many.bodies[0])
    move_all(n, world, h, friction, gyroscopic, tilted, scheme, sleep, memory, report, many)
    pay_together(h, 0, tilted, many, many.bodies[0])
