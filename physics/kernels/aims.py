"""What velocity is asked of each contact of a set: at an impact, and at the end of a stage that it rests through."""

from __future__ import annotations

from physics.kernels import quaternion as qt
from physics.kernels.arms import arm_and_rate, wall_normal, wall_of
from physics.kernels.compiler import inlined, kernel
from physics.kernels.layout import BLOCK, SPHERE

# Share of a resting contact's gap that a step closes. In the linear iteration of gap and velocity over steps,
# λ² - (1 - β/2) λ + β/2 = 0, the root is double (fastest approach without overshoot) for β = 6 - 4√2.
CLOSING_SHARE = 0.3431457505076198

# Turn in a stage beyond which accelerations at its middle say nothing about its end any more [rad].
LARGEST_TURN = 0.5

# Share of the slop below which the displacement of a contact in one step does not count.
UNSEEN = 1.0e-3


@inlined
def aim_impact(n, bounce_speed, slop_speed, rate, work):
    """Targets of an impact, and whether there is one.

    A contact that approaches faster than `bounce_speed` leaves with e times that speed (Newton's law); one that
    approaches slower is brought to rest, since its rebound would be over within the step, and if it also is slower
    than `slop_speed` plus its gap times `rate` (1/h) it closes less than the slop within the step and is left to
    the resting stage. One that leaves may be turned round, to e times its speed: with that, and only with that, no
    frictionless impact of several contacts gains energy (Moreau; theory, section 8).
    """
    is_impact = False
    for i in range(n):
        s = -work.speed[i]
        goal = 0.0
        is_bounce = work.restitution > 0.0 and s > bounce_speed
        if is_bounce or s < 0.0:
            goal = work.restitution * s
        if is_bounce or s > slop_speed + max(work.gap[i], 0.0) * rate:
            is_impact = True
        work.target[i, 0] = goal
        work.target[i, 1] = 0.0
        work.target[i, 2] = 0.0
    return is_impact


@inlined
def is_closing(i, n, work):
    """Whether a contact of the wall of contact i is still above it."""
    wall = wall_of(work.slot[i], work)
    for j in range(n):
        if work.gap[j] > work.slop and wall_of(work.slot[j], work) == wall:
            return True
    return False


@inlined
def gainless(target, u):
    """A target for the velocity of a contact (normal, tangents), no more than what turns its velocity u round.

    Impulses p that change contact velocities from u to u' change the energy by p·(u + u')/2: a push with u' <= -u adds
    nothing, nor does what holds at |u'| <= |u|. Where a body turns by much less than a radian in a stage what is asked
    for is just -u. Where it turns by more, ω x ṙ says nothing about the end of the stage, and is as large as one likes.
    Along the wall a target t longer than u is shortened to |u|²/|t| <= |u|: the same where they are all but equal, and
    one division.
    """
    most, square = u[1] * u[1] + u[2] * u[2], target[1] * target[1] + target[2] * target[2]
    share = most / square if square > most else 1.0
    return min(target[0], max(-u[0], 0.0)), share * target[1], share * target[2]


@inlined
def _in_frame(k, a, walls):
    """A vector in the frame of wall k: normal, tangents."""
    return (
        a[0] * walls[k, 0] + a[1] * walls[k, 1] + a[2] * walls[k, 2],
        a[0] * walls[k, 3] + a[1] * walls[k, 4] + a[2] * walls[k, 5],
        a[0] * walls[k, 6] + a[1] * walls[k, 7] + a[2] * walls[k, 8],
    )


@kernel
def _wandering(k, R, w, tilted, work):
    """`arm_and_rate` of a body without vertices at wall k: apart, so that blocks do not carry it along."""
    dims = (work.dims[0], work.dims[1], work.dims[2])
    return arm_and_rate(work.shape, dims, R, w, wall_normal(work.walls, k), 0, tilted, work)


@inlined
def _turning_gain(s, w, a):
    """s ([ω]x² + [α]x): what a point of the body gains by turning is this times its arm."""
    return (
        -s * (w[1] * w[1] + w[2] * w[2]), s * (w[0] * w[1] - a[2]), s * (w[0] * w[2] + a[1]),
        s * (w[0] * w[1] + a[2]), -s * (w[0] * w[0] + w[2] * w[2]), s * (w[1] * w[2] - a[0]),
        s * (w[0] * w[2] - a[1]), s * (w[1] * w[2] + a[0]), -s * (w[0] * w[0] + w[1] * w[1]),
    )  # fmt: skip


@inlined
def aim_rest(n, v, w, alpha, R, h, tilted, work):
    """Targets of the resting stage over h; R is the attitude at its middle, v and w are the velocities there before it.

    The impulses act at the middle of the step, the velocity is asked for at its end, half a step later: a point has by
    then gained h/2 (ω x ṙ + α x r), α the angular acceleration of free turning, and that is taken off. Of a vertex
    ṙ = ω x r; the lowest point of an ellipsoid wanders over it; of a sphere it is 0. A feature still above the wall
    may close `CLOSING_SHARE` of its gap (all of it in a substep's last stage). What is smaller than the tolerance of
    the solve, or would move a contact by less than `UNSEEN` slops in the step, is 0: a body comes to rest to the last
    bit, and contacts that hold are not asked to move apart by next to nothing.
    """
    walls, shape = work.walls, work.shape
    half = 0.5 * h
    is_turning = 0.0 < qt.dot(w, w) * h * h <= LARGEST_TURN * LARGEST_TURN and shape != SPHERE
    negligible = max(work.tolerance * work.acceleration * h, UNSEEN * work.slop / h)
    share, gain = 1.0 if work.is_last else CLOSING_SHARE, _turning_gain(-half, w, alpha)
    for i in range(n):
        t0 = t1 = t2 = 0.0
        if is_turning:
            r = (work.arm[i, 0], work.arm[i, 1], work.arm[i, 2])
            k = wall_of(work.slot[i], work)
            c = qt.matvec(gain, r)
            if shape != BLOCK:
                r, rate = _wandering(k, R, w, tilted, work)
                a, b = qt.cross(w, rate), qt.cross(alpha, r)
                c = (-half * (a[0] + b[0]), -half * (a[1] + b[1]), -half * (a[2] + b[2]))
            u = qt.cross(w, r)
            u = (v[0] + u[0], v[1] + u[1], v[2] + u[2])
            t0, t1, t2 = gainless(_in_frame(k, c, walls), _in_frame(k, u, walls))
        if is_closing(i, n, work):
            t0 -= share * work.gap[i] / h
        if max(abs(t0), max(abs(t1), abs(t2))) <= negligible:
            t0 = t1 = t2 = 0.0
        work.target[i, 0], work.target[i, 1], work.target[i, 2] = t0, t1, t2
