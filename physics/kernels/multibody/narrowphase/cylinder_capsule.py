"""Contacts of a cylinder and a capsule.

A capsule touches with balls about points of its axis (`capsule_contacts`): about both ends, and about the points that
are nearest to the side or to a rim, or at which the axis passes the outline of an end. Each ball touches the nearest
point of the cylinder. A ball near a rim that touches elsewhere is left out, and so is one whose place is known.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.segments import nearest_places, point_on_segment
from physics.kernels.math.vector import minus, plus, row_vector, times
from physics.kernels.multibody.data.arrays import NUM_CONTACTS
from physics.kernels.multibody.data.capsules import half_axis, half_length
from physics.kernels.multibody.data.contact_set import add_scaled, pair_slop
from physics.kernels.multibody.data.cylinder_balls import nearest_of_cylinder
from physics.kernels.multibody.data.cylinders import axis_of, rim_arm, rotation_of
from physics.kernels.multibody.data.parts import body_of, first_part
from physics.kernels.multibody.narrowphase.box_sat import FLAT_COSINE
from physics.kernels.multibody.narrowphase.cylinder_face import add_of_pair
from physics.kernels.multibody.narrowphase.plane_faces import part_over
from physics.kernels.multibody.narrowphase.rim_line import rim_line_normal

# Features of a contact: two ends of the axis; then its place nearest to the axis of the cylinder, those nearest to each
# rim, and two where it passes the outline of each end.
_NEAR_SIDE, _NEAR_RIM, _PASSES_END = 2, 3, 5


@inlined
def _is_known(pair, s, first, many):
    """True if a contact from row `first` of the set on is that of the ball at place s of the capsule's axis."""
    can, capsule = pair
    l, slop = half_length(capsule, many), pair_slop(body_of(can, many), body_of(capsule, many), many)
    for k in range(first, many.counts[NUM_CONTACTS]):
        column = 0 if first_part(k, many) == capsule else 3
        if abs(many.contacts.anchor[k, column + 1] - s * l) <= slop:
            return True
    return False


@kernel
def _add_ball(pair, feature, s, first, margin, h, many):
    """Add the contact of the ball at place s of the axis, -1 to 1, if it is near enough and not known yet."""
    (can, capsule), r = pair, many.bodies.body[pair[1]].dims[0]
    p = point_on_segment(row_vector(many.bodies.center, capsule, 0), half_axis(capsule, many), s)
    distance, m, q = nearest_of_cylinder(can, p, many)
    if distance - r > margin or _is_known(pair, s, first, many):
        return
    origin = row_vector(many.bodies.center, capsule, 0)
    n = times(-1.0, m)
    points = (minus(q, origin), minus(add_scaled(p, r, n), origin))
    add_of_pair(pair, feature, -1, n, points, distance - r, h, many)


@kernel
def _add_near_rim(pair, end, first, margin, h, many):
    """Add the ball that is nearest to a rim, if it touches there."""
    can, capsule = pair
    x, u = row_vector(many.bodies.center, capsule, 0), half_axis(capsule, many)
    R, l = rotation_of(can, many), half_length(capsule, many)
    y, way, d = axis_of(R), minus(row_vector(many.bodies.center, can, 0), x), many.bodies.body[can].dims
    n = rim_line_normal(add_scaled(way, (2.0 * end - 1.0) * d[1], y), y, d[0], times(1.0 / l, u))
    p = plus(way, rim_arm(can, end, R, times(-1.0, n), many))
    s = qt.dot(p, u) / (l * l)
    if not abs(s) < 1.0:
        return
    m = nearest_of_cylinder(can, plus(x, times(s, u)), many)[1]
    if -qt.dot(m, n) >= FLAT_COSINE:
        _add_ball(pair, _NEAR_RIM + end, s, first, margin, h, many)


@kernel
def _add_passing(pair, end, first, margin, h, many):
    """Add the balls where the axis passes the outline of an end."""
    can, capsule = pair
    x, u = row_vector(many.bodies.center, capsule, 0), half_axis(capsule, many)
    way = minus(x, row_vector(many.bodies.center, can, 0))
    one, two, _, _ = part_over(can, end, minus(way, u), plus(way, u), 0.0, many)
    if one <= two:
        _add_ball(pair, _PASSES_END + 2 * end, 2.0 * one - 1.0, first, margin, h, many)
        _add_ball(pair, _PASSES_END + 2 * end + 1, 2.0 * two - 1.0, first, margin, h, many)


@kernel
def collide_cylinder_capsule(can, capsule, margin, h, many):
    """Add the contacts of a cylinder and a capsule whose gaps are at most `margin` [m].

    h is the length of the stage [s].
    """
    pair, first = (can, capsule), many.counts[NUM_CONTACTS]
    x, u = row_vector(many.bodies.center, capsule, 0), half_axis(capsule, many)
    for end in range(2):
        _add_ball(pair, end, 2.0 * end - 1.0, first, margin, h, many)
    for end in range(2):
        _add_near_rim(pair, end, first, margin, h, many)
        _add_passing(pair, end, first, margin, h, many)
    y = times(many.bodies.body[can].dims[1], axis_of(rotation_of(can, many)))
    s, _, is_crossing = nearest_places(x, u, row_vector(many.bodies.center, can, 0), y)
    if is_crossing and abs(s) < 1.0:
        _add_ball(pair, _NEAR_SIDE, s, first, margin, h, many)
