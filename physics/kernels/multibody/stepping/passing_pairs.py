"""Pairs of bodies that pass each other within a stage: their contact acts along a plane that parts them.

A contact of two bodies that are apart keeps its normal through the stage: the direction between their nearest points at
the start. For a body that slides past an edge, a contact with this normal can block its way. For such pairs the normal
is taken from the motion instead. If bodies a and b move freely and turn little, their Minkowski difference A - B sweeps
the convex hull of its places at the start and at the end of the stage. If that hull does not hold the origin, the
bodies never touch. The direction n in which it is nearest to the origin then parts them: n·(a - b) > 0 for all their
points at the start, at the end and in between. The contact gets the normal n, and gives no impulse unless something
else pushes the bodies together. If nothing else is near them, the contact is dropped.

Bodies are taken thinner by the slop, and by the depth to which they land in other bodies within the stage: an edge that
stands out by less is no obstacle.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined, kernel, shared_kernel
from physics.kernels.half_space.contact_point import center_arm
from physics.kernels.math import quaternion as qt
from physics.kernels.math.quaternion import to_matrix
from physics.kernels.math.vector import as_vector, row_vector
from physics.kernels.multibody.data import warm_start as kept
from physics.kernels.multibody.data.arrays import NUM_CONTACTS
from physics.kernels.multibody.data.capsules import half_length, is_capsule
from physics.kernels.multibody.data.compliance import is_pressed_in
from physics.kernels.multibody.data.contact_set import (
    DEEP_SHARE,
    FEATURES_PER_PAIR,
    PARTED,
    add_contact,
    add_scaled,
    end_of_pair,
    is_stopping,
    pair_slop,
    row_matrix,
    subtract,
)
from physics.kernels.multibody.data.cylinders import is_cylinder
from physics.kernels.multibody.data.driven_bodies import attitude_after
from physics.kernels.multibody.data.fixed_bodies import body_at, end_of
from physics.kernels.multibody.data.hull_tables import FIRST_CORNER, FIRST_FACE, LAST_FACE
from physics.kernels.multibody.data.parts import body_of, first_part, posed_part, second_part
from physics.kernels.multibody.narrowphase.gjk import gjk_distance, support_point
from physics.kernels.state.body import read_state
from physics.kernels.state.layout import BLOCK, HULL, SPHERE

# Distance below which thinned bodies count as touching, as a share of the slop: GJK cannot tell less from rounding.
_TOUCH_SHARE = 1.0e-2

# Cosine of the angle below which two directions are the same (4e-4 rad).
_SAME_DIRECTION = 1.0 - 1.0e-7

# Marks of the contacts of a pair until targets are set: the pair passes even if it is thinned by the slop alone; it
# meets however thin it is. The mark 0 is for pairs in between.
_PASSING = 1.0
_MEETING = -1.0

# Largest landing depth, in slops: twice the `_SOFT_LANDING_SLOPS` of `impact`, since the resting stage stops a landing
# at its middle. A deeper contact is an impact, or an overlap that a user made.
_MAX_DEPTH_SLOPS = 200.0

# Largest depth by which bodies are taken thinner, as a share of their smallest half-width.
_MAX_THINNING_SHARE = 0.5


@inlined
def _parts_of(k, many):
    """Parts of contact k, bodies where these are no compounds; the second is below 0 for a wall."""
    return first_part(k, many), second_part(body_at(many.contacts.bodies[k, 1], many), k, many)


@inlined
def _depth_after(k, h, many):
    """Depth of contact k after h [s] at its present speed [m]; negative if the contact is still open."""
    return -many.contacts.gap[k] - h * many.contacts.speed[k]


@inlined
def _smallest_half_width(b, many):
    """Smallest half-width of body b [m]; for a hull that of its bounding block."""
    d = many.bodies.body[b].dims
    if many.bodies.body[b].shape == SPHERE:
        return d[0]
    return min(d[0], min(d[1], d[2]))


@inlined
def _is_beside_pair(k, a, b, many):
    """True if contact k belongs to another pair than parts a and b, and one of its bodies is that of a or b.

    If the body of b is fixed, bodies that touch it do not count: they do not move it.
    """
    one, other = _parts_of(k, many)
    if one == a and other == b:
        return False
    a, b = body_of(a, many), body_of(b, many)
    c, d, end = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], end_of(b, many)
    return c in (a, b) or d == a or (d == end and end >= 0)


@kernel
def _thinning(a, b, n, h, many):
    """Depth by which parts a and b are taken thinner [m]: the slop, plus their bodies' landing depth within h [s].

    The landing depth is the largest depth to which one of them goes into other bodies or walls, among the n contacts.
    Pairs that are marked as passing do not count, nor do depths beyond `_MAX_DEPTH_SLOPS`.
    """
    slop, landing = pair_slop(a, b, many), 0.0
    for k in range(n):
        if not _is_beside_pair(k, a, b, many) or many.contacts.target[k, 0] == _PASSING:
            continue
        depth = max(_depth_after(k, h, many), -many.contacts.gap[k])
        if depth <= _MAX_DEPTH_SLOPS * slop:
            landing = max(landing, depth)
    most = _MAX_THINNING_SHARE * min(_smallest_half_width(a, many), _smallest_half_width(b, many))
    return min(slop + landing, most)


@inlined
def _moves_as_foreseen(a, b, gap, n, h, many):
    """True if nothing else is near parts a and b, and their loads cannot close the gap [m] within h [s].

    "Near" means a contact with another part or a wall, among the n of the set.
    """
    for k in range(n):
        if _is_beside_pair(k, a, b, many):
            return False
    a, b = body_of(a, many), body_of(b, many)
    one, other = many.bodies.body[a].free_acceleration, many.bodies.body[b].free_acceleration
    g = subtract(as_vector(one), as_vector(other))
    return 0.25 * h * h * h * h * qt.dot(g, g) < gap * gap


@inlined
def _is_stopping(k, h, many):
    """True if contact k of two bodies would stop them within h [s]; see `contact_set.is_stopping`."""
    slop = pair_slop(many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], many)
    gap = many.contacts.gap[k]
    return is_stopping(gap, many.contacts.speed[k], slop, h) and not is_pressed_in(gap, many)


@inlined
def _end_pose(part, h, gyroscopic, offset_frame, many):
    """Pose of a part after h [s] of motion at constant momenta: (geometric centre [m], rotation matrix)."""
    b = body_of(part, many)
    x, q, v, L = read_state(many.bodies.state, b)
    R = to_matrix(attitude_after(b, q, L, h, gyroscopic, offset_frame, many))
    x = add_scaled(x, h, v)
    if offset_frame is not None:
        x = add_scaled(x, 1.0, center_arm(R, many.bodies.body[b]))
    return posed_part(part, x, R, many)


@kernel
def _hull_holds_point(b, p, thinner, many):
    """True if point p, in the frame of hull b, lies below each face of the hull by more than `thinner` [m]."""
    tables = many.narrowphase.hulls
    first = tables.of[b, FIRST_CORNER]
    for f in range(tables.of[b, FIRST_FACE], tables.of[b, LAST_FACE]):
        corner = row_vector(tables.corners, first + tables.ring[tables.loops[f, 0]], 0)
        if not qt.dot(row_vector(tables.normals, f, 0), subtract(corner, p)) > thinner:
            return False
    return True


@inlined
def _holds_point(b, p, thinner, hulls, many):
    """True if body b, shrunk by `thinner` [m] on all sides, holds point p.

    p leads from the body's geometric centre, in the body frame [m]. `hulls` is None if the scene has no hulls.
    """
    d, shape = many.bodies.body[b].dims, many.bodies.body[b].shape
    if hulls is not None:  # noqa: SIM102 (a branch of its own is what the compiler prunes)
        if shape == HULL:
            return _hull_holds_point(b, p, thinner, many)
    if is_capsule(b, many):
        y = half_length(b, many)
        p = (p[0], p[1] - min(max(p[1], -y), y), p[2])
    if is_cylinder(b, many):
        return abs(p[1]) < d[1] - thinner and p[0] * p[0] + p[2] * p[2] < (d[0] - thinner) ** 2
    if shape == SPHERE or is_capsule(b, many):
        return qt.dot(p, p) < (d[0] - thinner) ** 2
    d = (d[0] - thinner, d[1] - thinner, d[2] - thinner)
    if shape == BLOCK:
        return abs(p[0]) < d[0] and abs(p[1]) < d[1] and abs(p[2]) < d[2]
    f = (p[0] / d[0], p[1] / d[1], p[2] / d[2])
    return qt.dot(f, f) < 1.0


@inlined
def _have_point_in_common(k, now, later, thinner, hulls, many):
    """True if the two parts of contact k, shrunk by `thinner` [m], certainly overlap in the later poses.

    Each body carries its contact point along. The test asks whether both bodies hold the middle between these two
    points. If it fails, the bodies may still overlap. `now` and `later` are pairs of poses (geometric centre, rotation
    matrix).
    """
    a, b = _parts_of(k, many)
    (c, R), (d, S) = now
    (x, P), (y, Q) = later
    from_c = subtract(row_vector(many.bodies.state, body_of(a, many), 0), c)
    from_d = subtract(row_vector(many.bodies.state, body_of(b, many), 0), d)
    p = add_scaled(row_vector(many.contacts.arm, k, 0), 1.0, from_c)
    q = add_scaled(row_vector(many.contacts.arm, k, 3), 1.0, from_d)
    p, q = qt.transposed_matvec(R, p), qt.transposed_matvec(S, q)
    half = subtract(add_scaled(y, 1.0, qt.matvec(Q, q)), add_scaled(x, 1.0, qt.matvec(P, p)))
    return _holds_point(a, add_scaled(p, 0.5, qt.transposed_matvec(P, half)), thinner, hulls, many) and _holds_point(
        b, add_scaled(q, -0.5, qt.transposed_matvec(Q, half)), thinner, hulls, many
    )


@kernel
def _parting_direction(k, thinner, h, gyroscopic, offset_frame, hulls, many):
    """Find a direction that separates the parts of contact k throughout h [s]: (unit vector out of the second, found).

    The bodies are shrunk by `thinner` [m] on all sides.
    """
    (a, b), way = _parts_of(k, many), row_vector(many.contacts.frame, k, 0)
    now = (
        (row_vector(many.bodies.center, a, 0), row_matrix(many.bodies.rotation, a)),
        (row_vector(many.bodies.center, b, 0), row_matrix(many.bodies.rotation, b)),
    )
    later = (_end_pose(a, h, gyroscopic, offset_frame, many), _end_pose(b, h, gyroscopic, offset_frame, many))
    if _have_point_in_common(k, now, later, thinner, hulls, many):
        return way, False
    touch = _TOUCH_SHARE * pair_slop(a, b, many)
    n, gap = gjk_distance(a, b, now, later, way, touch, thinner, hulls, many)
    return n, gap > 0.0


@inlined
def _point_along(k, b, first, n, hulls, many):
    """Point of body b that reaches farthest along the unit vector n, world frame [m].

    Of a capsule it is that of the ball with which it touches in contact k: the farthest end of its axis may be far from
    the other body, and would turn the capsule. `first` is the column of the body's anchor.
    """
    R = row_matrix(many.bodies.rotation, b)
    if is_capsule(b, many):
        arm = qt.matvec(R, row_vector(many.contacts.anchor, k, first))
        return add_scaled(add_scaled(row_vector(many.bodies.center, b, 0), 1.0, arm), many.bodies.body[b].dims[0], n)
    return support_point(b, row_vector(many.bodies.center, b, 0), R, n, 0.0, hulls, many)


@kernel
def _gap_along(k, n, hulls, many):
    """Gap of the bodies a and b of contact k along the unit vector n out of b: (gap [m], point of a, point of b).

    The points are the nearest ones, in the world frame [m].
    """
    a, b = _parts_of(k, many)
    p = _point_along(k, a, 0, (-n[0], -n[1], -n[2]), hulls, many)
    q = _point_along(k, b, 3, n, hulls, many)
    return qt.dot(n, subtract(p, q)), p, q


@inlined
def _fastest_stopping(first, last, h, many):
    """Fastest contact in [first, last), all of one pair, among those that would stop the pair within h [s]; -1: none.

    A contact with a wall does not count, nor a pair that `conservative_advancement` serves since a body turns far.
    """
    a, b = many.contacts.bodies[first, 0], body_at(many.contacts.bodies[first, 1], many)
    found = -1
    if b < 0 or many.bodies.spin_bound[a] > 0.0 or many.bodies.spin_bound[b] > 0.0:
        return found
    for k in range(first, last):
        if _is_stopping(k, h, many) and (found < 0 or many.contacts.speed[k] < many.contacts.speed[found]):
            found = k
    return found


@kernel
def _mark_of_pair(k, n, h, gyroscopic, offset_frame, hulls, many):
    """Mark of the pair whose fastest contact is k: `_PASSING`, `_MEETING`, or 0 for neither.

    A pair is meeting if no plane parts its bodies even when they are thinned by `_thinning`. It is passing if a plane
    parts them when they are thinned by the slop alone, and the plane is not across the normal of contact k. n is the
    number of contacts in the set, h the length of the stage [s].
    """
    (a, b), way = _parts_of(k, many), row_vector(many.contacts.frame, k, 0)
    slop, thinnest = pair_slop(a, b, many), _thinning(a, b, n, h, many)
    m, is_parted = _parting_direction(k, thinnest, h, gyroscopic, offset_frame, hulls, many)
    if not is_parted:
        return _MEETING
    if thinnest > slop:
        m, is_parted = _parting_direction(k, slop, h, gyroscopic, offset_frame, hulls, many)
    return _PASSING if is_parted and qt.dot(way, m) <= _SAME_DIRECTION else 0.0


@inlined
def _mark_pairs(n, h, gyroscopic, offset_frame, hulls, many):
    """Write the mark of each pair, as found by `_mark_of_pair`, for each of its contacts.

    Marks are stored in `many.contacts.target`, since targets are set later in the stage. n is the number of contacts in
    the set, h the length of the stage [s].
    """
    for k in range(n):
        many.contacts.target[k, 0] = 0.0
    k = 0
    while k < n:
        last = end_of_pair(k, n, many)
        found = _fastest_stopping(k, last, h, many)
        if found >= 0:
            mark = _mark_of_pair(found, n, h, gyroscopic, offset_frame, hulls, many)
            for i in range(k, last):
                many.contacts.target[i, 0] = mark
        k = last


@kernel
def _redirect_pair(k, n, to, h, gyroscopic, offset_frame, hulls, many):
    """Replace the contacts of a passing pair by one contact in row `to` of the set: (whether it passes, next row).

    k is the pair's fastest contact, of n in the set. The old contacts stay in two cases. The direction that parts the
    bodies may be the normal of contact k already. Or the bodies touch along that direction, unless contact k is deeper
    than their thinning allows along any direction. Passing bodies that nothing else can push get no contact.
    """
    (a, b), way = _parts_of(k, many), row_vector(many.contacts.frame, k, 0)
    mark, thinner = many.contacts.target[k, 0], _thinning(a, b, n, h, many)
    if mark == _MEETING or (mark != _PASSING and not thinner > pair_slop(a, b, many)):
        return False, to
    m, is_parted = _parting_direction(k, thinner, h, gyroscopic, offset_frame, hulls, many)
    if not is_parted or qt.dot(way, m) > _SAME_DIRECTION:
        return False, to
    gap, p, q = _gap_along(k, m, hulls, many)
    if not gap > pair_slop(a, b, many):
        return _depth_after(k, h, many) > DEEP_SHARE * thinner, to
    if _moves_as_foreseen(a, b, gap, n, h, many):
        return True, to
    many.counts[NUM_CONTACTS] = to
    add_contact(a, b, FEATURES_PER_PAIR - 1, PARTED, m, (p, q), gap, h, many)
    return True, many.counts[NUM_CONTACTS]


@shared_kernel
def redirect_passing_pairs(n, h, gyroscopic, offset_frame, hulls, many):
    """Replace the contacts of each pair that passes within h [s] by one along a plane that parts the two bodies.

    n is the number of contacts in the set; the new number is written to `many.counts[NUM_CONTACTS]`. `gyroscopic` and
    `offset_frame` are switches of `state.groups.FlightSwitches`; `hulls` is None if the scene has none.
    """
    _mark_pairs(n, h, gyroscopic, offset_frame, hulls, many)
    k, left = 0, 0
    while k < n:
        last, is_passing = end_of_pair(k, n, many), False
        found = _fastest_stopping(k, last, h, many)
        if found >= 0:
            is_passing, left = _redirect_pair(found, n, left, h, gyroscopic, offset_frame, hulls, many)
        if not is_passing:
            for i in range(k, last):
                if left < i:
                    kept.copy_contact(i, left, many)
                left += 1
        k = last
    many.counts[NUM_CONTACTS] = left
