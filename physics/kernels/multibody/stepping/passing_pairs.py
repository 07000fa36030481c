"""Pairs of bodies that pass each other within a stage: their contact acts along a plane that parts them.

A contact of two bodies that are apart keeps its direction through the stage, which is that between their nearest
points now. To a body that slides past an edge this direction is a wall across its way. Motion decides instead: where
bodies move freely and turn little, their difference A - B sweeps the convex hull of both its places, at the start and
at the end. If that hull does not hold the origin, the two never touch, and the direction n in which it is nearest to
the origin parts them all along: n·(a - b) > 0 for all their points at both ends, and between them. The contact is then
along n, and gives no impulse unless something else pushes the two together. Bodies that nothing else is near have none.

Bodies are taken thinner by the slop each, and by the depth to which they land in others within the stage: an edge that
stands out by less than that is no obstacle.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined, kernel, shared_kernel
from physics.kernels.flight.free_flight import drift_attitude
from physics.kernels.half_space.contact_point import center_arm
from physics.kernels.math import quaternion as qt
from physics.kernels.math.quaternion import to_matrix
from physics.kernels.math.vector import as_vector, row_vector
from physics.kernels.multibody.data import warm_start as kept
from physics.kernels.multibody.data.arrays import NUM_CONTACTS
from physics.kernels.multibody.data.contact_set import (
    DEEP_SHARE,
    FEATURES_PER_PAIR,
    PARTED,
    add_contact,
    add_scaled,
    is_stopping,
    pair_slop,
    row_matrix,
    subtract,
)
from physics.kernels.multibody.data.hull_tables import FIRST_CORNER, FIRST_FACE, LAST_FACE
from physics.kernels.multibody.narrowphase.gjk import gjk_distance, support_point
from physics.kernels.state.body import read_state
from physics.kernels.state.layout import BLOCK, HULL, SPHERE

# Share of the slop below which the distance between thinned bodies counts as none: what GJK cannot tell from rounding.
_TOUCH_SHARE = 1.0e-2

# Cosine of the angle below which two directions are the same (4e-4 rad).
_SAME_DIRECTION = 1.0 - 1.0e-7

# Marks of the contacts of a pair, until targets are set: it passes if it is thinned by the slop; it meets, however
# thin. Others stand between.
_PASSING = 1.0
_MEETING = -1.0

# Slops up to which the depth that bodies go in counts as a landing: twice the `_SOFT_LANDING_SLOPS` of `impact`, which
# the resting stage stops at its middle. Deeper is an impact, or an overlap that a user made.
_MAX_DEPTH_SLOPS = 200.0

# Share of the smallest half-width by which bodies are taken thinner at most.
_MAX_THINNING_SHARE = 0.5


@inlined
def _depth_after(k, h, many):
    """Depth of contact k after h at its present speed [m]."""
    return -many.contacts.gap[k] - h * many.contacts.speed[k]


@inlined
def _smallest_half_width(b, many):
    """Smallest half-width of body b [m]; of a hull that of the block with its `dimensions`."""
    d = many.bodies.body[b].dims
    if many.bodies.body[b].shape == SPHERE:
        return d[0]
    return min(d[0], min(d[1], d[2]))


@kernel
def _thinning(a, b, n, h, many):
    """By how much bodies a and b are taken thinner [m]: the slop, and how deep they land in others within h.

    They do not land in bodies that they are marked to pass.
    """
    slop, landing = pair_slop(a, b, many), 0.0
    for k in range(n):
        c, d = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1]
        if (c == a and d == b) or (c not in (a, b) and d not in (a, b)) or many.contacts.target[k, 0] == _PASSING:
            continue
        depth = max(_depth_after(k, h, many), -many.contacts.gap[k])
        if depth <= _MAX_DEPTH_SLOPS * slop:
            landing = max(landing, depth)
    most = _MAX_THINNING_SHARE * min(_smallest_half_width(a, many), _smallest_half_width(b, many))
    return min(slop + landing, most)


@inlined
def _moves_as_foreseen(a, b, gap, n, h, many):
    """True if nothing else is near bodies a and b, and their loads do not close their gap within h."""
    for k in range(n):
        c, d = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1]
        if (c != a or d != b) and (c in (a, b) or d in (a, b)):
            return False
    one, other = many.bodies.body[a].free_acceleration, many.bodies.body[b].free_acceleration
    g = subtract(as_vector(one), as_vector(other))
    return 0.25 * h * h * h * h * qt.dot(g, g) < gap * gap


@inlined
def _is_stopping(k, h, many):
    """True if contact k of two bodies would stop them within h."""
    slop = pair_slop(many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], many)
    return is_stopping(many.contacts.gap[k], many.contacts.speed[k], slop, h)


@inlined
def _end_pose(b, h, gyroscopic, offset_frame, many):
    """(geometric centre, rotation) of body b after h of free motion at constant momenta."""
    x, q, v, L = read_state(many.bodies.state, b)
    R = to_matrix(drift_attitude(q, L, many.bodies.body[b], h, gyroscopic, offset_frame))
    x = add_scaled(x, h, v)
    if offset_frame is not None:
        x = add_scaled(x, 1.0, center_arm(R, many.bodies.body[b]))
    return x, R


@kernel
def _hull_holds_point(b, p, thinner, many):
    """True if point p, in the frame of hull b, lies below each of its faces by `thinner` [m]."""
    tables = many.narrowphase.hulls
    first = tables.of[b, FIRST_CORNER]
    for f in range(tables.of[b, FIRST_FACE], tables.of[b, LAST_FACE]):
        corner = row_vector(tables.corners, first + tables.ring[tables.loops[f, 0]], 0)
        if not qt.dot(row_vector(tables.normals, f, 0), subtract(corner, p)) > thinner:
            return False
    return True


@inlined
def _holds_point(b, p, thinner, hulls, many):
    """True if body b, thinned, holds point p in its frame."""
    d, shape = many.bodies.body[b].dims, many.bodies.body[b].shape
    if hulls is not None:  # noqa: SIM102 (a branch of its own is what the compiler prunes)
        if shape == HULL:
            return _hull_holds_point(b, p, thinner, many)
    if shape == SPHERE:
        return qt.dot(p, p) < (d[0] - thinner) ** 2
    d = (d[0] - thinner, d[1] - thinner, d[2] - thinner)
    if shape == BLOCK:
        return abs(p[0]) < d[0] and abs(p[1]) < d[1] and abs(p[2]) < d[2]
    f = (p[0] / d[0], p[1] / d[1], p[2] / d[2])
    return qt.dot(f, f) < 1.0


@inlined
def _have_point_in_common(k, now, later, thinner, hulls, many):
    """True if both bodies of contact k, thinned, hold the middle of where they carry its point; False says nothing."""
    a, b = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1]
    (c, R), (d, S) = now
    (x, P), (y, Q) = later
    p = add_scaled(row_vector(many.contacts.arm, k, 0), 1.0, subtract(row_vector(many.bodies.state, a, 0), c))
    q = add_scaled(row_vector(many.contacts.arm, k, 3), 1.0, subtract(row_vector(many.bodies.state, b, 0), d))
    p, q = qt.transposed_matvec(R, p), qt.transposed_matvec(S, q)
    half = subtract(add_scaled(y, 1.0, qt.matvec(Q, q)), add_scaled(x, 1.0, qt.matvec(P, p)))
    return _holds_point(a, add_scaled(p, 0.5, qt.transposed_matvec(P, half)), thinner, hulls, many) and _holds_point(
        b, add_scaled(q, -0.5, qt.transposed_matvec(Q, half)), thinner, hulls, many
    )


@kernel
def _parting_direction(k, thinner, h, gyroscopic, offset_frame, hulls, many):
    """Direction out of b that parts the bodies a and b of contact k throughout h, and whether there is one."""
    a, b, way = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], row_vector(many.contacts.frame, k, 0)
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


@kernel
def _gap_along(a, b, n, hulls, many):
    """Gap between two bodies along n, and their nearest points along it [m]."""
    x, y = row_vector(many.bodies.center, a, 0), row_vector(many.bodies.center, b, 0)
    p = support_point(a, x, row_matrix(many.bodies.rotation, a), (-n[0], -n[1], -n[2]), 0.0, hulls, many)
    q = support_point(b, y, row_matrix(many.bodies.rotation, b), n, 0.0, hulls, many)
    return qt.dot(n, subtract(p, q)), p, q


@inlined
def _end_of_pair(k, n, many):
    """First contact after k, of the n in the set, of another pair."""
    a, b = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1]
    while k < n and many.contacts.bodies[k, 0] == a and many.contacts.bodies[k, 1] == b:
        k += 1
    return k


@inlined
def _fastest_stopping(first, last, h, many):
    """Fastest contact of a pair that would stop it; -1 without one, or if `conservative_advancement` serves it."""
    a, b, found = many.contacts.bodies[first, 0], many.contacts.bodies[first, 1], -1
    if b < 0 or many.bodies.spin_bound[a] > 0.0 or many.bodies.spin_bound[b] > 0.0:
        return found
    for k in range(first, last):
        if _is_stopping(k, h, many) and (found < 0 or many.contacts.speed[k] < many.contacts.speed[found]):
            found = k
    return found


@kernel
def _mark_of_pair(k, n, h, gyroscopic, offset_frame, hulls, many):
    """Mark of the pair whose fastest contact is k, of n in the set: `_PASSING`, `_MEETING` or 0.

    A pair that meets even where it is as thin as it may get needs no second look.
    """
    a, b, way = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], row_vector(many.contacts.frame, k, 0)
    slop, thinnest = pair_slop(a, b, many), _thinning(a, b, n, h, many)
    m, is_parted = _parting_direction(k, thinnest, h, gyroscopic, offset_frame, hulls, many)
    if not is_parted:
        return _MEETING
    if thinnest > slop:
        m, is_parted = _parting_direction(k, slop, h, gyroscopic, offset_frame, hulls, many)
    return _PASSING if is_parted and qt.dot(way, m) <= _SAME_DIRECTION else 0.0


@inlined
def _mark_pairs(n, h, gyroscopic, offset_frame, hulls, many):
    """Write the mark of each pair into `many.contacts.target` of its contacts; targets are set later."""
    for k in range(n):
        many.contacts.target[k, 0] = 0.0
    k = 0
    while k < n:
        last = _end_of_pair(k, n, many)
        found = _fastest_stopping(k, last, h, many)
        if found >= 0:
            mark = _mark_of_pair(found, n, h, gyroscopic, offset_frame, hulls, many)
            for i in range(k, last):
                many.contacts.target[i, 0] = mark
        k = last


@kernel
def _redirect_pair(k, n, to, h, gyroscopic, offset_frame, hulls, many):
    """Replace the contacts of a passing pair by one, at `to`; k is its fastest contact, of n in the set.

    Returns whether the pair passes, and the new number of contacts. A contact that lands along its own direction stays.
    So does a contact of bodies that touch along the plane between them, unless it is deeper than their thinning along
    any direction. Bodies that nothing else can push have no contact.
    """
    a, b, way = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], row_vector(many.contacts.frame, k, 0)
    mark, thinner = many.contacts.target[k, 0], _thinning(a, b, n, h, many)
    if mark == _MEETING or (mark != _PASSING and not thinner > pair_slop(a, b, many)):
        return False, to
    m, is_parted = _parting_direction(k, thinner, h, gyroscopic, offset_frame, hulls, many)
    if not is_parted or qt.dot(way, m) > _SAME_DIRECTION:
        return False, to
    gap, p, q = _gap_along(a, b, m, hulls, many)
    if not gap > pair_slop(a, b, many):
        return _depth_after(k, h, many) > DEEP_SHARE * thinner, to
    if _moves_as_foreseen(a, b, gap, n, h, many):
        return True, to
    many.counts[NUM_CONTACTS] = to
    add_contact(a, b, FEATURES_PER_PAIR - 1, PARTED, m, (p, q), gap, h, many)
    return True, many.counts[NUM_CONTACTS]


@shared_kernel
def redirect_passing_pairs(n, h, gyroscopic, offset_frame, hulls, many):
    """Replace the contacts of each pair that passes within h by one along a plane that parts the two."""
    _mark_pairs(n, h, gyroscopic, offset_frame, hulls, many)
    k, left = 0, 0
    while k < n:
        last, is_passing = _end_of_pair(k, n, many), False
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
