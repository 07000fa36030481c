"""Target velocities of the contacts of a set: at an impact, and at the end of a resting stage."""

from __future__ import annotations

from typing import NamedTuple

from physics.compiler.decorators import inlined, kernel
from physics.compiler.simd import LANE_COUNT, larger, select_lanes, smaller
from physics.kernels.half_space.contact_point import contact_arm_and_rate, wall_normal, wall_of
from physics.kernels.half_space.persistent_contacts import is_persistent_contact
from physics.kernels.math import quaternion as qt
from physics.kernels.math.simd_gather import broadcast, gather_column_from, gather_numbers_from, scatter_columns
from physics.kernels.state.layout import BLOCK, SPHERE

# Share of a resting contact's gap that a step closes. In the linear iteration of gap and velocity over steps,
# λ² - (1 - β/2) λ + β/2 = 0, the root is double (fastest approach without overshoot) for β = 6 - 4√2.
GAP_CLOSING_SHARE = 0.3431457505076198

# Turn in a stage beyond which accelerations at its middle say nothing about its end any more [rad].
MAX_TARGET_TURN = 0.5

# Share of the slop below which the displacement of a contact in one step does not count.
NEGLIGIBLE_SLOP_SHARE = 1.0e-3

# Of the contacts of a set: none is fast enough for an impact, some are left so by the last stage, some hit their wall.
NO_IMPACT, RESIDUAL_APPROACH, TRUE_IMPACT = range(3)


class StageMotion(NamedTuple):
    """Motion of a body at the middle of a stage, before the impulses; world frame."""

    R: tuple  # 9 scalars, body to world
    v: tuple  # 3 scalars [m/s]
    w: tuple  # 3 scalars, angular velocity [rad/s]
    alpha: tuple  # 3 scalars, angular acceleration of free turning [rad/s²]


class TargetLimits(NamedTuple):
    """Terms of the targets of a resting stage that all contacts share."""

    half: float  # half the length of the stage [s]
    is_turning: bool  # whether what turning adds counts
    negligible: float  # smaller targets are 0 [m/s]
    rate: float  # share of a gap that may be closed, per time [1/s]


@inlined
def may_have_impact(bounce_speed, slop_speed, scratch):
    """True if a contact of the set is fast enough for an impact; else no impact is looked for."""
    return scratch.contacts.approach > (min(bounce_speed, slop_speed) if scratch.body.restitution > 0.0 else slop_speed)


@inlined
def set_impact_targets(n, bounce_speed, slop_speed, y, h, offset_frame, memory, scratch):
    """Set the targets of an impact; return its kind: nothing, contacts to bring to rest, or an impact.

    A contact that approaches faster than `bounce_speed` leaves with e times that speed (Newton's law); one that
    approaches slower is brought to rest, since its rebound would be over within the step, and if it also is slower
    than `slop_speed` plus its gap by h it closes less than the slop within the step and is left to
    the resting stage. One that leaves may be turned round, to e times its speed: with that, and only with that, no
    frictionless impact of several contacts gains energy (Moreau; theory, section 8).

    A contact that continues from the last stage has hit nothing (`persistent_contacts`). It is brought to rest, and its
    speed set to zero, without an impact.
    """
    contacts = scratch.contacts
    found, rate = NO_IMPACT, 1.0 / h
    for i in range(n):
        s = -contacts.speed[i]
        goal = 0.0
        is_bounce = scratch.body.restitution > 0.0 and s > bounce_speed
        if is_bounce or s < 0.0:
            goal = scratch.body.restitution * s
        if is_bounce or s > slop_speed + max(contacts.gap[i], 0.0) * rate:
            if is_persistent_contact(i, y, h, offset_frame, memory, scratch):
                contacts.speed[i] = goal = 0.0
                found = max(found, RESIDUAL_APPROACH)
            else:
                found = TRUE_IMPACT
        contacts.target[i, 0] = goal
        contacts.target[i, 1] = 0.0
        contacts.target[i, 2] = 0.0
    return found


@inlined
def is_above_wall(i, n, scratch):
    """True if a contact of the wall of contact i is still above it."""
    contacts = scratch.contacts
    if not contacts.widest > scratch.body.slop:
        return False
    wall = wall_of(contacts.slot[i], scratch.scene)
    for j in range(n):
        if contacts.gap[j] > scratch.body.slop and wall_of(contacts.slot[j], scratch.scene) == wall:
            return True
    return False


@inlined
def clamp_target_to_energy(target, u):
    """Limit a target (normal, tangents) for a contact of the velocity u to at most a reversal of u.

    Impulses p that change contact velocities from u to u' change the energy by p·(u + u')/2: a push with u' <= -u adds
    nothing, nor does what holds at |u'| <= |u|. Where a body turns by much less than a radian in a stage the target
    is just -u. Where it turns by more, ω x ṙ says nothing about the end of the stage, and is as large as one likes.
    Along the wall a target t longer than u is shortened to |u|²/|t| <= |u|: the same where they are nearly equal, and
    one division.
    """
    most, square = u[1] * u[1] + u[2] * u[2], target[1] * target[1] + target[2] * target[2]
    share = select_lanes(square > most, most / square, 1.0)
    return smaller(target[0], larger(-u[0], 0.0)), share * target[1], share * target[2]


@inlined
def _in_frame(k, a, walls):
    """Vector in the frame of wall k: normal, tangents."""
    return (
        a[0] * walls[k, 0] + a[1] * walls[k, 1] + a[2] * walls[k, 2],
        a[0] * walls[k, 3] + a[1] * walls[k, 4] + a[2] * walls[k, 5],
        a[0] * walls[k, 6] + a[1] * walls[k, 7] + a[2] * walls[k, 8],
    )


@kernel
def _wandering(k, R, w, offset_frame, scratch):
    """`contact_arm_and_rate` of a body without vertices at wall k, apart from the code of blocks."""
    body = scratch.body
    dims = (body.dims[0], body.dims[1], body.dims[2])
    return contact_arm_and_rate(body.shape, dims, R, w, wall_normal(scratch.scene.walls, k), 0, offset_frame, body)


@inlined
def _wandering_point(k, R, w, alpha, offset_frame, scratch):
    """Return ω x r, ω x ṙ and α x r of a body without vertices at wall k, four times each."""
    r, rate = _wandering(k, R, w, offset_frame, scratch)
    turn, a, b = qt.cross(w, r), qt.cross(w, rate), qt.cross(alpha, r)
    return (
        (broadcast(turn[0]), broadcast(turn[1]), broadcast(turn[2])),
        (broadcast(a[0]), broadcast(a[1]), broadcast(a[2])),
        (broadcast(b[0]), broadcast(b[1]), broadcast(b[2])),
    )


@inlined
def _aim_at_wall(first, n, motion, limits, offset_frame, scratch):
    """Do `set_resting_targets` for contacts from `first` on, up to four of one wall; return the next contact."""
    scene, contacts = scratch.scene, scratch.contacts
    walls, arm = scene.walls, contacts.arm
    R, v, w, alpha = motion
    half, is_turning, negligible, rate = limits
    k, last = wall_of(contacts.slot[first], scene), first
    while last + 1 < min(n, first + LANE_COUNT) and wall_of(contacts.slot[last + 1], scene) == k:
        last += 1
    t0 = t1 = t2 = broadcast(0.0)
    if is_turning:
        r = (
            gather_column_from(arm, 0, first, last),
            gather_column_from(arm, 1, first, last),
            gather_column_from(arm, 2, first, last),
        )
        turn = qt.cross(w, r)
        a, b = qt.cross(w, turn), qt.cross(alpha, r)
        if scratch.body.shape != BLOCK:
            turn, a, b = _wandering_point(k, R, w, alpha, offset_frame, scratch)
        u = (v[0] + turn[0], v[1] + turn[1], v[2] + turn[2])
        c = (-half * (a[0] + b[0]), -half * (a[1] + b[1]), -half * (a[2] + b[2]))
        t0, t1, t2 = clamp_target_to_energy(_in_frame(k, c, walls), _in_frame(k, u, walls))
    if is_above_wall(first, n, scratch):
        t0 = t0 - rate * gather_numbers_from(contacts.gap, first, last)
    is_little = larger(abs(t0), larger(abs(t1), abs(t2))) <= negligible
    t0, t1, t2 = select_lanes(is_little, 0.0, t0), select_lanes(is_little, 0.0, t1), select_lanes(is_little, 0.0, t2)
    scatter_columns(contacts.target, first, last, t0, t1, t2)
    return last + 1


@kernel
def _aim_at_others(first, n, motion, limits, offset_frame, scratch):
    """Do `set_resting_targets` for contacts from `first` on; seldom called, since most bodies touch one wall."""
    while first < n:
        first = _aim_at_wall(first, n, motion, limits, offset_frame, scratch)


@inlined
def set_resting_targets(n, motion, h, offset_frame, scratch):
    """Set the targets of a resting stage over h, from the motion at its middle before the impulses (`StageMotion`).

    The impulses act at the middle of the step, the target is the velocity at its end, half a step later: by then a
    point has gained h/2 (ω x ṙ + α x r), α the angular acceleration of free turning, and that is taken off. Of a vertex
    ṙ = ω x r; the lowest point of an ellipsoid wanders over it; of a sphere it is 0. A feature still above the wall may
    close `GAP_CLOSING_SHARE` of its gap (all of it in a substep's last stage). A target smaller than the tolerance of
    the solve, or one that would move a contact by less than `NEGLIGIBLE_SLOP_SHARE` slops in the step, is 0: a body
    comes to rest to the last bit, and contacts that hold are not asked to move apart by next to nothing.
    """
    body = scratch.body
    w = motion.w
    is_turning = 0.0 < qt.dot(w, w) * h * h <= MAX_TARGET_TURN * MAX_TARGET_TURN and body.shape != SPHERE
    negligible = max(scratch.settings.tolerance * body.acceleration * h, NEGLIGIBLE_SLOP_SHARE * body.slop / h)
    rate = (1.0 if scratch.stage.is_last else GAP_CLOSING_SHARE) / h
    limits = TargetLimits(0.5 * h, is_turning, negligible, rate)
    first = _aim_at_wall(0, n, motion, limits, offset_frame, scratch)
    if first < n:
        _aim_at_others(first, n, motion, limits, offset_frame, scratch)
