"""Set the target velocities of the contacts in the contact set: of an impact, or of the end of a resting stage.

A target is the contact velocity (normal, tangents) that a solve aims at: 0 for rest, -e u_n for a rebound.
"""

from __future__ import annotations

from typing import NamedTuple

from physics.compiler.decorators import inlined, kernel
from physics.compiler.simd import LANE_COUNT, larger, select_lanes, smaller
from physics.kernels.contact_law.materials import least_bounce_speed, restitution_of
from physics.kernels.half_space.contact_point import contact_arm_and_rate, wall_normal, wall_of
from physics.kernels.half_space.persistent_contacts import is_persistent_contact
from physics.kernels.math import quaternion as qt
from physics.kernels.math.simd_gather import broadcast, gather_column_from, gather_numbers_from, scatter_columns
from physics.kernels.state.layout import BLOCK, SPHERE

# Share β of a resting contact's gap that a step closes. Gap and velocity change from step to step by a linear map with
# eigenvalues λ² - (1 - β/2) λ + β/2 = 0. They are equal, for the fastest approach without overshoot, at β = 6 - 4√2.
GAP_CLOSING_SHARE = 0.3431457505076198

# Turn in a stage beyond which accelerations at its middle no longer tell the velocities at its end [rad].
MAX_TARGET_TURN = 0.5

# A contact's displacement in one step below this share of the slop is neglected.
NEGLIGIBLE_SLOP_SHARE = 1.0e-3

# Results of `set_impact_targets`: no contact approaches fast enough for an impact; only persistent contacts do, by an
# error of the last stage; some contact hits its wall.
NO_IMPACT, RESIDUAL_APPROACH, TRUE_IMPACT = range(3)


class StageMotion(NamedTuple):
    """Motion of a body at the middle of a stage, before the impulses; world frame."""

    R: tuple  # 9 scalars, body to world
    v: tuple  # 3 scalars [m/s]
    w: tuple  # 3 scalars, angular velocity [rad/s]
    alpha: tuple  # 3 scalars, angular acceleration of free turning [rad/s²]


class TargetLimits(NamedTuple):
    """Numbers in the targets of a resting stage that are the same for all contacts."""

    half: float  # half the length of the stage [s]
    is_turning: bool  # True if the velocity that contacts gain by turning is taken into account
    negligible: float  # smaller targets are 0 [m/s]
    rate: float  # share of a gap that the stage may close, over the length of the stage [1/s]


@inlined
def may_have_impact(bounce_speed, slop_speed, scratch):
    """True if a contact of the set approaches fast enough for an impact, so that `set_impact_targets` is needed.

    The limit is `slop_speed` [m/s], or `bounce_speed` if that is smaller and the body has a restitution.
    """
    return scratch.contacts.approach > (min(bounce_speed, slop_speed) if scratch.body.restitution > 0.0 else slop_speed)


@inlined
def set_impact_targets(n, bounce_speed, slop_speed, y, h, offset_frame, memory, scratch):
    """Set the target velocities of n contacts for an impact; return NO_IMPACT, RESIDUAL_APPROACH or TRUE_IMPACT.

    The targets, `contacts.target`, depend on the normal speed of each contact:

    - A contact that approaches faster than `bounce_speed` [m/s] rebounds with e times its speed (Newton's law).
    - A contact that approaches more slowly is brought to rest, since its rebound would be over within the step. It only
      makes an impact if it is also faster than `slop_speed` [m/s] plus its gap over h; else the resting stage stops it.
    - A contact that leaves may be turned round, to approach with e times its speed. Only with this rule does no
      frictionless impact of several contacts gain energy (Moreau; theory, section 8).

    A persistent contact, which continues from the last stage (`persistent_contacts`), has hit nothing. It is brought to
    rest, and its speed is set to zero. h is the time left of the substep [s], and y the state.
    """
    contacts = scratch.contacts
    found, rate = NO_IMPACT, 1.0 / h
    for i in range(n):
        s = -contacts.speed[i]
        goal = 0.0
        e = restitution_of(contacts.slot[i], scratch)
        is_bounce = e > 0.0 and s > least_bounce_speed(bounce_speed, contacts.slot[i], scratch)
        if is_bounce or s < 0.0:
            goal = e * s
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
    """True if any of the n contacts at the wall of contact i has a gap of more than a slop."""
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
    """Limit a target velocity (normal, tangents) so that a contact with the velocity u gains no energy.

    All six components are `Lanes`, one lane for each of up to four contacts. An impulse p that changes the contact
    velocity from u to u' changes the energy by p·(u + u')/2. So a push needs u'_n <= -u_n, and friction that holds
    needs |u'_t| <= |u_t|. Targets of a body that turns by much less than a radian in a stage are within these limits.
    Where it turns by more, targets from accelerations in the middle of the stage may have any size. Along the wall a
    target t longer than u_t is shortened to |u_t|²/|t| <= |u_t|, which needs a single division and is the same where
    the lengths are nearly equal.
    """
    most, square = u[1] * u[1] + u[2] * u[2], target[1] * target[1] + target[2] * target[2]
    share = select_lanes(square > most, most / square, 1.0)
    return smaller(target[0], larger(-u[0], 0.0)), share * target[1], share * target[2]


@inlined
def _in_frame(k, a, walls):
    """Components of the world vector a along normal and tangents of wall k."""
    return (
        a[0] * walls[k, 0] + a[1] * walls[k, 1] + a[2] * walls[k, 2],
        a[0] * walls[k, 3] + a[1] * walls[k, 4] + a[2] * walls[k, 5],
        a[0] * walls[k, 6] + a[1] * walls[k, 7] + a[2] * walls[k, 8],
    )


@kernel
def _wandering(k, R, w, offset_frame, scratch):
    """Arm of the contact point of a sphere or an ellipsoid at wall k, and its rate (`contact_arm_and_rate`).

    R is the body's rotation matrix, w its angular velocity. A separate kernel, so that it does not burden blocks.
    """
    body = scratch.body
    dims = (body.dims[0], body.dims[1], body.dims[2])
    return contact_arm_and_rate(body.shape, dims, R, w, wall_normal(scratch.scene.walls, k), 0, offset_frame, body)


@inlined
def _wandering_point(k, R, w, alpha, offset_frame, scratch):
    """Vectors ω x r, ω x ṙ and α x r of the contact point of a sphere or an ellipsoid at wall k.

    r is the arm, w the angular velocity ω and alpha the angular acceleration α. Each component is `Lanes` of four equal
    numbers.
    """
    r, rate = _wandering(k, R, w, offset_frame, scratch)
    turn, a, b = qt.cross(w, r), qt.cross(w, rate), qt.cross(alpha, r)
    return (
        (broadcast(turn[0]), broadcast(turn[1]), broadcast(turn[2])),
        (broadcast(a[0]), broadcast(a[1]), broadcast(a[2])),
        (broadcast(b[0]), broadcast(b[1]), broadcast(b[2])),
    )


@inlined
def _aim_at_wall(first, n, motion, limits, offset_frame, scratch):
    """Set the targets of a resting stage for up to four contacts of one wall, from number `first` on.

    Returns the number of the next contact. See `set_resting_targets`.
    """
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
    """Set the targets of a resting stage for all contacts from number `first` on (`set_resting_targets`).

    It is seldom called, since most bodies touch one wall with at most four contacts.
    """
    while first < n:
        first = _aim_at_wall(first, n, motion, limits, offset_frame, scratch)


@inlined
def set_resting_targets(n, motion, h, offset_frame, scratch):
    """Set the target velocities of n contacts, `contacts.target`, for a resting stage of length h [s].

    `motion` is the `StageMotion` of the body at the middle of the stage, before the impulses. The contacts are to have
    zero velocity at the end of the stage, but the impulses act in its middle. In between a contact point gains
    h/2 (ω x ṙ + α x r), with the angular acceleration α of free turning. So the target in the middle is minus this
    gain. For a vertex ṙ = ω x r; the lowest point of an ellipsoid wanders over it; for a sphere the gain is 0. A body
    that turns by more than `MAX_TARGET_TURN` has no such term.

    A feature still above the wall may close `GAP_CLOSING_SHARE` of its gap (all of it in a substep's last stage).
    Targets smaller than the tolerance of the solve are 0, and so are targets that would move a contact by less than
    `NEGLIGIBLE_SLOP_SHARE` slops in the stage. So a body comes to rest to the last bit.
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
