"""Contact set of a world: one row per contact, with points that move with the bodies during a stage."""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.contact_law.materials import friction_at, restitution_at
from physics.kernels.half_space import support_function as geo
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.arrays import FEATURES_PER_PAIR, NUM_CONTACTS, NUM_DROPPED, NUM_STOPPING
from physics.kernels.multibody.data.capsule_axes import normal_between_axes
from physics.kernels.multibody.data.capsules import is_capsule
from physics.kernels.multibody.data.clipped_points import clear_follow
from physics.kernels.multibody.data.compliance import is_pressed_in
from physics.kernels.multibody.data.cylinder_balls import ball_arm, is_beside_cylinder, normal_beside_cylinder
from physics.kernels.multibody.data.cylinders import is_cylinder, rolling_arm
from physics.kernels.multibody.data.driven_bodies import moving_body_at, relative_to_driven, take_driven_velocity
from physics.kernels.multibody.data.driven_faces import driven_owner
from physics.kernels.multibody.data.fixed_bodies import body_at, end_of, moving_first
from physics.kernels.multibody.data.grain import grain_tangents
from physics.kernels.multibody.data.pair_materials import pair_coefficients
from physics.kernels.multibody.data.parts import (
    body_of,
    first_part,
    from_body,
    from_center,
    lower_body_first,
    note_parts,
    second_part,
)
from physics.kernels.multibody.data.rolling_points import rolls_on_rim
from physics.kernels.state.layout import ELLIPSOID, SPHERE

# Owner of a contact whose normal is that of a plane between two bodies that pass each other (`stepping.passing_pairs`).
PARTED = -2

# Owner of such a contact whose impulses at its two points keep their moment, since to balance it would add energy.
UNBALANCED = -3

# Depth, in slops, that a touching contact must reach to count as stopping its bodies. It is more than 2 √3: so much do
# two bodies lose along any direction that are thinned by a slop each (`stepping.passing_pairs`).
DEEP_SHARE = 4.0

# Gap at which bodies that turn far have arrived, as a share of the smaller bounding radius, unless the slop is larger.
# From there a contact's speed predicts the time of impact well enough, and the gap is still large beside rounding.
ARRIVAL_SHARE = 1.0e-7


@inlined
def row_matrix(rows, i):
    """Read nine numbers of row i of an array: a 3 x 3 matrix, row by row."""
    return (
        rows[i, 0], rows[i, 1], rows[i, 2], rows[i, 3], rows[i, 4], rows[i, 5], rows[i, 6], rows[i, 7], rows[i, 8],
    )  # fmt: skip


@inlined
def put_vector(rows, i, first, a):
    """Write the vector a into row i of an array, from column `first` on."""
    rows[i, first], rows[i, first + 1], rows[i, first + 2] = a


@inlined
def subtract(a, b):
    """Difference a - b of two vectors."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@inlined
def add_scaled(a, s, b):
    """Sum a + s b of two vectors a and b, for a number s."""
    return (a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2])


@inlined
def tangent_basis(n):
    """Two unit vectors that complete the unit vector n to a right-handed frame.

    The first tangent is made from a world axis: the one that follows the axis along which n is largest. So for a normal
    along a world axis, the frame is exactly a permutation of the world axes.
    """
    x, y, z = abs(n[0]), abs(n[1]), abs(n[2])
    e = (0.0, 1.0, 0.0)
    if y > x and y >= z:
        e = (0.0, 0.0, 1.0)
    elif z > x and z > y:
        e = (1.0, 0.0, 0.0)
    t = add_scaled(e, -qt.dot(e, n), n)
    s = 1.0 / math.sqrt(qt.dot(t, t))
    t = (s * t[0], s * t[1], s * t[2])
    return t, qt.cross(n, t)


@inlined
def write_contact_frame(k, n, many):
    """Write the frame (normal, two tangents) of contact k, for its unit normal n in the world frame.

    If contact k - 1 has the same normal, its tangents are copied. Those along axes of friction are in `grain`.
    """
    frame = many.contacts.frame
    if k > 0 and n == row_vector(frame, k - 1, 0):
        t1, t2 = row_vector(frame, k - 1, 3), row_vector(frame, k - 1, 6)
    else:
        t1, t2 = tangent_basis(n)
    t1, t2 = grain_tangents(k, n, t1, t2, many)
    put_vector(frame, k, 0, n)
    put_vector(frame, k, 3, t1)
    put_vector(frame, k, 6, t2)


@inlined
def relative_velocity(k, t, many):
    """Velocity of contact k's point on the first body relative to that on the second, world frame [m/s].

    t (bodies, 6) holds the twists of all bodies. A second body that is fixed counts as still even if it is driven.
    """
    a, b = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1]
    u = add_scaled(row_vector(t, a, 0), 1.0, qt.cross(row_vector(t, a, 3), row_vector(many.contacts.arm, k, 0)))
    if b >= 0:
        u = subtract(
            u, add_scaled(row_vector(t, b, 0), 1.0, qt.cross(row_vector(t, b, 3), row_vector(many.contacts.arm, k, 3)))
        )
    return u


@inlined
def slip_velocity(k, many):
    """Velocity of contact k's point on the first body relative to that on the second, which may be driven [m/s]."""
    return relative_to_driven(k, relative_velocity(k, many.bodies.twist, many), many)


@inlined
def velocity_in_contact_frame(k, t, many):
    """Relative velocity at contact k for the twists t, in the contact frame: (normal, two tangents) [m/s]."""
    return qt.matvec(row_matrix(many.contacts.frame, k), relative_velocity(k, t, many))


@inlined
def contact_velocity(k, many):
    """Relative velocity at contact k for the bodies' present twists, in the contact frame [m/s]."""
    return velocity_in_contact_frame(k, many.bodies.twist, many)


@inlined
def pair_slop(a, b, many):
    """Largest gap at which bodies a and b count as touching, or body a and a wall if b < 0 [m]."""
    b = body_at(b, many)
    if b < 0:
        return many.bodies.body[a].slop
    return min(many.bodies.body[a].slop, many.bodies.body[b].slop)


@inlined
def is_parted(k, many):
    """True if the normal of contact k parts two bodies that pass each other."""
    return many.contacts.owner[k] <= PARTED


@inlined
def parted_slack(k, many):
    """Depth to which contact k may close beyond its gap [m]: `DEEP_SHARE` slops if its owner is `PARTED`, else 0.

    The bodies of a `PARTED` contact pass each other, and `stepping.passing_pairs` takes them thinner than they are.
    """
    if not is_parted(k, many):
        return 0.0
    return DEEP_SHARE * pair_slop(many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], many)


@inlined
def smaller_radius(a, b, many):
    """Bounding radius of the smaller one of bodies a and b, or of body a if b is a wall [m]."""
    radius, b = many.bodies.body[a].radius, body_at(b, many)
    if b >= 0:
        radius = min(radius, many.bodies.body[b].radius)
    return radius


@inlined
def arrival_gap(a, b, many):
    """Gap at which bodies a and b (b < 0: a wall) count as touching if one of them turns far in the stage [m]."""
    return max(pair_slop(a, b, many), ARRIVAL_SHARE * smaller_radius(a, b, many))


@inlined
def _may_turn_far(a, b, many):
    """True if body a or body b may turn far in this stage (`stepping.conservative_advancement`); b < 0 is a wall."""
    return many.bodies.spin_bound[a] > 0.0 or (b >= 0 and many.bodies.spin_bound[b] > 0.0)


@inlined
def relative_acceleration_bound(k, many):
    """Bound of the acceleration of contact k's two points relative to each other, without contact impulses [m/s²]."""
    a, b = many.contacts.bodies[k, 0], moving_body_at(many.contacts.bodies[k, 1], many)
    if b < 0:
        return many.bodies.body[a].acceleration
    return many.bodies.body[a].acceleration + many.bodies.body[b].acceleration


@inlined
def _combine_materials(k, a, b, many):
    """Write friction and restitution coefficients of contact k, between bodies a and b (b < 0: wall)."""
    body = many.bodies.body[a]
    if b < 0:
        mu, e = friction_at(-1 - b, body), restitution_at(-1 - b, body)
    else:
        mu, e = pair_coefficients(a, b, many)
    many.contacts.mu[k], many.contacts.restitution[k] = mu, e


@inlined
def _write_anchor(k, part, first, point, n, many):
    """Write arm and anchor of contact k for its end on a part, at `point` (world frame) [m].

    Both lead from the body's centre of mass to the point, in the world frame and in the body frame. The anchor of a
    capsule leads to the point of its axis above, along the contact's normal n. In the part of a compound, anchors lead
    from its geometric centre, in its own frame. `first` is the column of this end.
    """
    arm = subtract(point, row_vector(many.bodies.state, body_of(part, many), 0))
    put_vector(many.contacts.arm, k, first, arm)
    if is_capsule(part, many):
        arm = add_scaled(arm, many.bodies.body[part].dims[0] if first == 0 else -many.bodies.body[part].dims[0], n)
    arm = from_center(part, arm, many)
    put_vector(many.contacts.anchor, k, first, qt.transposed_matvec(row_matrix(many.bodies.rotation, part), arm))


@inlined
def _first_body_share(a, b, many):
    """Weight of part a's contact point in the common contact point of parts a and b, for a normal that neither owns.

    The weight is 1 if a is rounder than b, 0 if b is rounder than a, else 1/2: the point of a round body stays under
    its centre. A sphere is rounder than a capsule, a capsule is rounder than an ellipsoid, and an ellipsoid is rounder
    than a block or a hull.
    """
    one, other = many.bodies.body[a].shape, many.bodies.body[b].shape
    if one != other:
        for shape in (SPHERE, ELLIPSOID):
            if one == shape:
                return 1.0
            if other == shape:
                return 0.0
            if is_capsule(a, many):
                return 1.0
            if is_capsule(b, many):
                return 0.0
    return 0.5


@inlined
def _join_points(k, a, b, owner, gap, n, many):
    """Let both arms of contact k, between parts a and b, end in one point halfway across the gap along n.

    Equal and opposite impulses at one point keep the total angular momentum of both bodies, even across a gap. If one
    body owns the normal, the other body's point is taken, since that point slides along the owner's face.
    """
    way = subtract(
        row_vector(many.bodies.state, body_of(a, many), 0), row_vector(many.bodies.state, body_of(b, many), 0)
    )
    one = add_scaled(row_vector(many.contacts.arm, k, 0), -0.5 * gap, n)
    other = add_scaled(row_vector(many.contacts.arm, k, 3), 0.5 * gap, n)
    if owner < 0:
        from_one = add_scaled(one, 1.0, way)
        other = add_scaled(other, _first_body_share(a, b, many), subtract(from_one, other))
    elif owner == b:
        other = add_scaled(one, 1.0, way)
    put_vector(many.contacts.arm, k, 0, subtract(other, way))
    put_vector(many.contacts.arm, k, 3, other)


@inlined
def end_of_pair(k, n, many):
    """Index of the first contact after k, among the n of the set, that belongs to another pair of parts."""
    a, b = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1]
    one, other = first_part(k, many), second_part(b, k, many)
    while k < n and many.contacts.bodies[k, 0] == a and many.contacts.bodies[k, 1] == b:
        if first_part(k, many) != one or second_part(b, k, many) != other:
            break
        k += 1
    return k


@inlined
def is_stopping(gap, speed, slop, h):
    """True if a contact would stop its bodies within h [s], because they would overlap at their present speed.

    `gap` [m] and `speed` [m/s] are along the normal; `slop` [m] is that of the pair. Bodies that touch already must
    close by `DEEP_SHARE` slops to count.
    """
    return gap + h * speed < (0.0 if gap > slop else -DEEP_SHARE * slop)


@kernel
def add_contact(a, b, feature, owner, normal, points, gap, h, many):
    """Add a contact to the set if its bodies touch, or could touch within h; return False if there was no room.

    Bodies that turn far count as touching at their `arrival_gap`.

    Parameters
    ----------
    a, b : int
        Bodies, or parts of compounds, of which one may be fixed; b = -1 - k is wall k. A fixed body becomes the second
        one.
    feature : int
        Number of the touching features of this pair: below `FEATURES_PER_PAIR` unless one of the two is a hull.
    owner : int
        Body or part that the normal turns with; -1: none, unless `driven_owner` finds one; `PARTED`: the normal parts
        two bodies that pass each other, and each body keeps a point of its own.
    normal : tuple of 3 floats
        Unit vector out of b, world frame.
    points : pair of tuples of 3 floats
        Nearest points of a and b, world frame [m].
    gap : float
        Distance along the normal [m].
    h : float
        Length of the stage [s].
    many : BodiesWorkspace
        Workspace of the world.
    """
    k, count = many.counts[NUM_CONTACTS], many.bodies.center.shape[0]
    if k == many.contacts.gap.shape[0]:
        many.counts[NUM_DROPPED] += 1
        return False
    one, other, normal, points = lower_body_first(a, b, normal, points, many)
    one, other, normal, points = moving_first(one, other, normal, points, many)
    owner = driven_owner(one, other, owner, normal, many)
    a, b = body_of(one, many), body_of(other, many)
    end = end_of(b, many)
    many.contacts.bodies[k, 0], many.contacts.bodies[k, 1] = a, end
    note_parts(k, one, other, many)
    _write_anchor(k, one, 0, points[0], normal, many)
    acceleration = many.bodies.body[a].acceleration
    partner = count - 1 - other
    if b >= 0:
        _write_anchor(k, other, 3, points[1], normal, many)
        if owner != PARTED:
            _join_points(k, one, other, owner, gap, normal, many)
        acceleration += many.bodies.body[b].acceleration
        partner = other
    write_contact_frame(k, normal, many)
    take_driven_velocity(k, many)
    clear_follow(k, many)
    speed = qt.dot(normal, slip_velocity(k, many))
    slop = pair_slop(a, b, many)
    is_out_of_reach = gap > slop and gap + h * speed - 0.5 * h * h * acceleration > slop
    if is_out_of_reach and not (_may_turn_far(a, b, many) and gap <= arrival_gap(a, b, many)):
        return True
    many.contacts.gap[k], many.contacts.speed[k], many.contacts.owner[k] = gap, speed, owner
    local = normal
    if owner >= 0:
        local = qt.transposed_matvec(row_matrix(many.bodies.rotation, owner), normal)
    put_vector(many.contacts.normal, k, 0, local)
    partners = count + many.walls.shape[0]
    page = (
        feature // FEATURES_PER_PAIR * count * partners
    )  # features from `FEATURES_PER_PAIR` on have ids behind those of all lower features
    many.contacts.id[k] = (page + one * partners + partner) * FEATURES_PER_PAIR + feature % FEATURES_PER_PAIR
    _combine_materials(k, a, b, many)
    many.bodies.touched[a] = 1
    if end >= 0:
        many.bodies.touched[b] = 1
    if b >= 0 and is_stopping(gap, speed, slop, h) and not is_pressed_in(gap, many):
        many.counts[NUM_STOPPING] += 1
    many.counts[NUM_CONTACTS] = k + 1
    return True


@inlined
def add_ordered_contact(a, b, first, n, on_first, on_second, gap, h, many):
    """Add the only contact of bodies or parts a and b, with data given relative to `first`, which is a or b.

    n is the unit normal out of the other one. `on_first` and `on_second` are the points on `first` and on the other
    body, world frame [m]. For `gap`, h and `many` see `add_contact`.
    """
    if first == a:
        add_contact(a, b, 0, -1, n, (on_first, on_second), gap, h, many)
    else:
        add_contact(a, b, 0, -1, (-n[0], -n[1], -n[2]), (on_second, on_first), gap, h, many)


@inlined
def _carried_point(b, k, first, side, n, many):
    """Arm of a body in contact k after its motion since the contact was found, at its part b, world frame [m].

    A block or hull carries the point along. On a sphere or ellipsoid it is the point with the present normal n of the
    contact, and so it is on the ball of a capsule, whose centre the capsule carries along. `first` is the column of the
    body's anchor; `side` is -1 for the first body and 1 for the second. On a cylinder it may roll (`cylinders`).
    """
    shape, d = many.bodies.body[b].shape, many.bodies.body[b].dims
    if shape == SPHERE:
        r = side * d[0]
        return from_body(b, (r * n[0], r * n[1], r * n[2]), many)
    if shape == ELLIPSOID:
        dims, R, m = (d[0], d[1], d[2]), row_matrix(many.bodies.rotation, b), (-side * n[0], -side * n[1], -side * n[2])
        return from_body(b, geo.support_arm(shape, dims, R, m, geo.scaled_normal(shape, dims, R, m)), many)
    if rolls_on_rim(k, b, many):
        way, place = (side * n[0], side * n[1], side * n[2]), many.contacts.anchor[k, first + 1]
        return from_body(b, rolling_arm(b, place, row_matrix(many.bodies.rotation, b), way, many), many)
    if is_beside_cylinder(k, b, first, many):
        return from_body(b, add_scaled(ball_arm(k, b, first, many), side * d[0], n), many)
    arm = qt.matvec(row_matrix(many.bodies.rotation, b), row_vector(many.contacts.anchor, k, first))
    return from_body(b, add_scaled(arm, side * d[0], n) if is_capsule(b, many) else arm, many)


@if_given("many.grain")
def turn_grain(k, n, many):
    """Write the frame of contact k anew for its unchanged normal n, since axes of friction turn with their bodies."""
    write_contact_frame(k, n, many)


@inlined
def _turn_frame(k, a, b, many):
    """Update the frame of contact k for the present poses of its parts a and b; return its normal, world frame.

    A normal with an owner turns with it. The normal of two spheres stays along the line of their centres, and
    that of two balls of capsules likewise, and that of a ball stays across a cylinder. Any other normal stays as it is.
    """
    n, owner = row_vector(many.contacts.normal, k, 0), many.contacts.owner[k]
    if owner >= 0:
        n = qt.matvec(row_matrix(many.bodies.rotation, owner), n)
        write_contact_frame(k, n, many)
    elif b >= 0 and owner > PARTED and many.bodies.body[a].shape == SPHERE == many.bodies.body[b].shape:
        d = subtract(row_vector(many.bodies.center, a, 0), row_vector(many.bodies.center, b, 0))
        size = math.sqrt(qt.dot(d, d))
        if size > 0.0:
            n = (d[0] / size, d[1] / size, d[2] / size)
            write_contact_frame(k, n, many)
    elif b >= 0 and owner > PARTED and (is_cylinder(a, many) or is_cylinder(b, many)):
        n = normal_beside_cylinder(k, a, b, n, many)
        write_contact_frame(k, n, many)
    elif b >= 0 and owner > PARTED and (is_capsule(a, many) or is_capsule(b, many)):
        n = normal_between_axes(k, a, b, n, many)
        write_contact_frame(k, n, many)
    else:
        turn_grain(k, n, many)
    return n


@kernel
def update_contacts(many):
    """Update arms, frames and gaps of all contacts of the set after a motion of the bodies.

    The gap is the distance of a contact's two points along its normal. The point on a wall is the projection of the
    body's point.
    """
    for k in range(many.counts[NUM_CONTACTS]):
        a, b = many.contacts.bodies[k, 0], body_at(many.contacts.bodies[k, 1], many)
        one, other = first_part(k, many), second_part(b, k, many)
        n = _turn_frame(k, one, other, many)
        arm = _carried_point(one, k, 0, -1.0, n, many)
        put_vector(many.contacts.arm, k, 0, arm)
        point = add_scaled(arm, 1.0, row_vector(many.bodies.state, a, 0))
        if b < 0:
            many.contacts.gap[k] = qt.dot(n, point) - many.walls[-1 - many.contacts.bodies[k, 1], 9]
            continue
        arm = _carried_point(other, k, 3, 1.0, n, many)
        put_vector(many.contacts.arm, k, 3, arm)
        gap = qt.dot(n, subtract(point, add_scaled(arm, 1.0, row_vector(many.bodies.state, b, 0))))
        many.contacts.gap[k] = gap
        if not is_parted(k, many):
            _join_points(k, one, other, many.contacts.owner[k], gap, n, many)
