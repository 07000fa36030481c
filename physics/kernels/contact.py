"""The contact set of one body: which features take part, where they are, what velocity is asked of them."""

from __future__ import annotations

from physics.kernels import geometry as geo
from physics.kernels import quaternion as qt
from physics.kernels.arms import arm_and_rate, center_arm, feature_of, geometric_center, wall_normal, wall_of
from physics.kernels.compiler import inlined, kernel
from physics.kernels.laws import STIFFNESS, number_of
from physics.kernels.layout import BLOCK, OFFSET, SPHERE, VERTEX_COUNT

# Share of a resting contact's gap that a step closes. In the linear iteration of gap and velocity over steps,
# λ² - (1 - β/2) λ + β/2 = 0, the root is double (fastest approach without overshoot) for β = 6 - 4√2.
CLOSING_SHARE = 0.3431457505076198

# Slops within which what approaches has arrived. Features that touched together may be two slops apart, and the place
# of the first one's impact is half a slop off: an edge that comes down again does so with both its ends at once.
TOGETHER = 3.0

# Turn in a stage beyond which accelerations at its middle say nothing about its end any more [rad].
LARGEST_TURN = 0.5

stiffness = number_of(STIFFNESS)  # of contact that gives (`compliance`)

# Share of the slop below which the displacement of a contact in one step does not count.
UNSEEN = 1.0e-3


@inlined
def is_clear(x, v, h, work):
    """Whether the bounding sphere stays clear of every wall during a free flight of h from x with velocity v.

    The gap of the sphere is a parabola in time; it is bounded below by its start plus what the velocity and
    the acceleration can each take off. A contact could only matter when this is false.
    """
    walls, a = work.walls, work.free_acceleration
    half = 0.5 * h * h
    for k in range(walls.shape[0]):
        n = wall_normal(walls, k)
        gap = qt.dot(n, x) - walls[k, OFFSET] - work.radius
        gap += min(0.0, h * qt.dot(n, v)) + min(0.0, half * (n[0] * a[0] + n[1] * a[1] + n[2] * a[2]))
        if not gap > 0.0:
            return False
    return True


@inlined
def _admit(gap, speed, slop, margin, reach, acceleration, h, is_last):
    """Whether a feature belongs to the contact set of this stage.

    It does when it touches (gap <= slop); when it is so near and so slow that the step's own acceleration
    could bring it to the wall (it then rests, and restitution would not act); and, in the last stage that a
    substep may have, when it would pass through the wall before the substep ends.
    """
    if gap <= slop or (gap <= TOGETHER * slop and speed < 0.0):
        return True
    if is_last and gap + h * speed - reach <= slop:
        return True
    return gap <= margin and speed >= -acceleration * h and speed <= 0.0


@inlined
def gather(x, R, v, w, h, tilted, work):
    """Fill `work` (slot, gap, speed, mask) with the contact set at this pose.

    Parameters
    ----------
    x, v, w : tuples of 3 floats
        Position, velocity, angular velocity, world frame [m, m/s, rad/s].
    R : tuple of 9 floats
        Body frame to world.
    h : float
        Time that the stage is to cover [s].

    Returns
    -------
    count : int
        Contacts found.
    depth : float
        Deepest penetration among them [m], 0 if none.
    """
    walls, features, shape, radius = work.walls, work.features, work.shape, work.radius
    slop, acceleration = work.slop, work.acceleration
    if stiffness(work) > 0.0:  # springs push where there is no gap left
        acceleration = 0.0
    dims = (work.dims[0], work.dims[1], work.dims[2])
    center = geometric_center(x, R, work, tilted)
    reach = 0.5 * acceleration * h * h
    margin = slop + reach
    count = 0
    depth = 0.0
    for k in range(walls.shape[0]):
        work.mask[k] = 0
        n = wall_normal(walls, k)
        d = qt.dot(n, center) - walls[k, OFFSET]
        near = max(margin, TOGETHER * slop)
        if work.is_last:
            near += h * (abs(v[0]) + abs(v[1]) + abs(v[2]) + radius * (abs(w[0]) + abs(w[1]) + abs(w[2])))
        if d > radius + near:
            continue
        e = geo.scaled_normal(shape, dims, R, n)
        if d - geo.support(shape, dims, e) > near:
            continue
        vn = qt.dot(n, v)
        m = qt.cross(n, w)  # n·(ω x r) = (n x ω)·r
        if shape == BLOCK:
            mb = qt.transposed_matvec(R, m)
            if tilted is not None:
                vn += qt.dot(m, center_arm(R, work))
            em = (dims[0] * mb[0], dims[1] * mb[1], dims[2] * mb[2])
            for vertex in range(VERTEX_COUNT):
                gap = d + geo.vertex_height(e, vertex)
                if gap > near:
                    continue
                speed = vn + geo.vertex_height(em, vertex)
                if _admit(gap, speed, slop, margin, reach, acceleration, h, work.is_last):
                    count = _record(count, k, vertex, features, gap, speed, work)
                    depth = max(depth, -gap)
        else:
            gap = d - geo.support(shape, dims, e)
            speed = vn + qt.dot(m, geo.support_arm(shape, dims, R, n, e))
            if _admit(gap, speed, slop, margin, reach, acceleration, h, work.is_last):
                count = _record(count, k, 0, features, gap, speed, work)
                depth = max(depth, -gap)
    return count, depth


@inlined
def _record(count, wall, feature, features, gap, speed, work):
    work.slot[count] = wall * features + feature
    work.gap[count] = gap
    work.speed[count] = speed
    work.mask[wall] |= 1 << feature
    return count + 1


@inlined
def has_passed(x, R, tilted, work):
    """Whether a feature that is not in the contact set (`work.mask`) is more than half a slop behind a wall."""
    walls, shape, least = work.walls, work.shape, -0.5 * work.slop
    dims = (work.dims[0], work.dims[1], work.dims[2])
    center = geometric_center(x, R, work, tilted)
    for k in range(walls.shape[0]):
        n = wall_normal(walls, k)
        d = qt.dot(n, center) - walls[k, OFFSET]
        if d > work.radius:
            continue
        e, mask = geo.scaled_normal(shape, dims, R, n), work.mask[k]
        if d - geo.support(shape, dims, e) >= least:
            continue
        if mask == 0:
            return True
        if shape == BLOCK:
            for vertex in range(VERTEX_COUNT):
                if not mask & (1 << vertex) and d + geo.vertex_height(e, vertex) < least:
                    return True
    return False


@kernel
def nearest_outside_set(x, R, tilted, work):
    """Smallest gap [m] over all features that are not in the contact set, and the slot of its feature.

    Of a wall that the bounding sphere does not reach the sphere's gap is taken: a lower bound, and positive (slot -1).
    """
    walls, features, shape, radius = work.walls, work.features, work.shape, work.radius
    dims = (work.dims[0], work.dims[1], work.dims[2])
    center = geometric_center(x, R, work, tilted)
    best, slot = 1.0e300, -1
    for k in range(walls.shape[0]):
        n = wall_normal(walls, k)
        d = qt.dot(n, center) - walls[k, OFFSET]
        if d > radius:
            if d - radius < best:
                best, slot = d - radius, -1
            continue
        e = geo.scaled_normal(shape, dims, R, n)
        mask = work.mask[k]
        if mask == 0 and not d - geo.support(shape, dims, e) < best:
            continue
        if shape == BLOCK:
            for vertex in range(VERTEX_COUNT):
                gap = d + geo.vertex_height(e, vertex)
                if not mask & (1 << vertex) and gap < best:
                    best, slot = gap, k * features + vertex
        elif mask == 0:
            best, slot = d - geo.support(shape, dims, e), k * features
    return best, slot


@kernel
def gap_of(slot, x, R, tilted, work):
    """Gap [m] of one feature to its wall."""
    walls, shape = work.walls, work.shape
    dims = (work.dims[0], work.dims[1], work.dims[2])
    n = wall_normal(walls, wall_of(slot, work))
    d = qt.dot(n, geometric_center(x, R, work, tilted)) - walls[wall_of(slot, work), OFFSET]
    e = geo.scaled_normal(shape, dims, R, n)
    if shape == BLOCK:
        return d + geo.vertex_height(e, feature_of(slot, work))
    return d - geo.support(shape, dims, e)


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


@inlined
def push_out(x, R, tilted, work):
    """Position moved along the normals so that nothing is deeper than the slop in a wall. No velocity changes."""
    walls, shape, radius, slop = work.walls, work.shape, work.radius, work.slop
    dims = (work.dims[0], work.dims[1], work.dims[2])
    for k in range(walls.shape[0]):
        n = wall_normal(walls, k)
        d = qt.dot(n, geometric_center(x, R, work, tilted)) - walls[k, OFFSET]
        if d >= radius:
            continue
        gap = d - geo.support(shape, dims, geo.scaled_normal(shape, dims, R, n))
        if gap < -slop:
            s = -gap - 0.5 * slop
            x = (x[0] + s * n[0], x[1] + s * n[1], x[2] + s * n[2])
    return x
