"""Contact set of one body at walls: the features that take part in a stage, with their gaps and normal speeds."""

from __future__ import annotations

from physics.compiler.decorators import inlined, kernel
from physics.compiler.simd import LANE_COUNT, store_lanes
from physics.kernels.half_space import support_function as geo
from physics.kernels.half_space.contact_point import center_arm, feature_of, geometric_center, wall_normal, wall_of
from physics.kernels.half_space.persistent_contacts import is_still_pressed, last_normal_impulse, turning_acceleration
from physics.kernels.math import quaternion as qt
from physics.kernels.state.body import angular_velocity
from physics.kernels.state.contact_law_dispatch import LAW_STIFFNESS, law_parameter
from physics.kernels.state.layout import BLOCK, ELLIPSOID, VERTEX_COUNT, WALL_OFFSET

# A feature that approaches its wall counts as arrived within this many slops. Features that touched together may be two
# slops apart, and the place of the first one's impact is half a slop off. So an edge that lands again does so with both
# of its ends at once.
SIMULTANEOUS_SLOPS = 3.0

_stiffness = law_parameter(LAW_STIFFNESS)  # of compliant contact [N/m] (`compliance`), 0 where contact is rigid


@inlined
def is_flight_clear(x, v, h, scratch):
    """True if the bounding sphere stays clear of every wall during a free flight of h from x with velocity v.

    The gap of the sphere is a parabola in time. Its lower bound is the gap at the start, less the largest losses by
    velocity and by acceleration. Contacts need to be looked for only when the result is false.
    """
    walls, a = scratch.scene.walls, scratch.body.free_acceleration
    half = 0.5 * h * h
    for k in range(walls.shape[0]):
        n = wall_normal(walls, k)
        gap = qt.dot(n, x) - walls[k, WALL_OFFSET] - scratch.body.radius
        gap += min(0.0, h * qt.dot(n, v)) + min(0.0, half * (n[0] * a[0] + n[1] * a[1] + n[2] * a[2]))
        if not gap > 0.0:
            return False
    return True


@inlined
def _admit(gap, speed, slop, reach, soft, slot, h, memory, scratch):
    """True if a feature with this gap [m] and normal speed [m/s] belongs to the contact set of a stage of length h.

    A feature belongs to the set in three cases:

    - It touches: gap <= slop, or three slops if it approaches.
    - It approaches, and would meet the wall at a speed of at most `soft` [m/s]. Loads could have made it as fast within
      the stage, so it has no impact (`target_velocity.set_impact_targets`).
    - It can get to the wall within the stage, `reach` [m] being the distance by loads, and either it pushed in the last
      stage (`persistent_contacts`), or this is the last stage that the substep may have.
    """
    if gap <= slop or (gap <= SIMULTANEOUS_SLOPS * slop and speed < 0.0):
        return True
    if speed <= 0.0 and speed * speed + 2.0 * scratch.body.acceleration * gap <= soft * soft:
        return True
    return gap + h * speed - reach <= slop and (
        scratch.stage.is_last == 1 or last_normal_impulse(slot, memory, scratch) > 0.0
    )


@inlined
def _admission_bounds(v, w, h, scratch):
    """Bounds that a stage of length h has in `_admit`, for a body with velocity v and angular velocity w.

    Returns (reach, soft, near): the distance [m] and the speed [m/s] that loads can give a feature within h, and a gap
    [m] beyond which no feature belongs to the set.
    """
    body = scratch.body
    slop, acceleration = body.slop, body.acceleration
    if _stiffness(body) > 0.0:  # springs push where there is no gap left
        acceleration = 0.0
    reach, soft = 0.5 * acceleration * h * h, acceleration * h
    # A contact whose rebound would last longer than `rest_share` of the stage has an impact: it needs a lower `soft`.
    if body.restitution > scratch.settings.rest_share:
        soft *= scratch.settings.rest_share / body.restitution
    near = max(slop + reach, SIMULTANEOUS_SLOPS * slop)
    if body.shape == ELLIPSOID:
        near += 0.5 * h * h * turning_acceleration(w, body)
    if scratch.stage.is_last:
        near += h * (abs(v[0]) + abs(v[1]) + abs(v[2]) + body.radius * (abs(w[0]) + abs(w[1]) + abs(w[2])))
    return reach, soft, near


@inlined
def _write_vertices(d, vn, e, mb, scratch):
    """Write gap [m] and normal velocity [m/s] of each vertex of a block at one wall into `contacts.vertices`.

    d and vn are gap and normal velocity of the block's centre. e is the wall's normal n in the body frame, times the
    half edges (`scaled_normal`); mb is n x ω in the body frame. Four vertices are computed at a time.
    """
    body, contacts = scratch.body, scratch.contacts
    lower, upper = geo.vertex_heights(e)
    slower, faster = geo.vertex_heights((body.dims[0] * mb[0], body.dims[1] * mb[1], body.dims[2] * mb[2]))
    store_lanes(contacts.vertices, 0, 0, d + lower)
    store_lanes(contacts.vertices, 0, LANE_COUNT, d + upper)
    store_lanes(contacts.vertices, 1, 0, vn + slower)
    store_lanes(contacts.vertices, 1, LANE_COUNT, vn + faster)


@inlined
def collect_wall_contacts(y, w, h, offset_frame, memory, scratch):
    """Find the contact set of a body in the state y, and write it into `scratch.contacts`.

    Written are slot, gap and speed of each contact, the mask of each wall, and the maxima `widest` and `approach`.

    Parameters
    ----------
    y : tuple
        State: position, attitude, velocity, angular momentum.
    w : tuple of 3 floats
        Angular velocity, world frame [rad/s].
    h : float
        Length of the stage [s].
    memory : (rows, ...) float64
        Contacts of the last stage of each body (`persistent_contacts`).

    Returns
    -------
    count : int
        Contacts found.
    depth : float
        Deepest penetration among them [m], 0 if none.
    """
    body, contacts = scratch.body, scratch.contacts
    walls, features, shape, radius = scratch.scene.walls, scratch.scene.features, body.shape, body.radius
    x, q, v, _ = y
    R, slop = qt.to_matrix(q), body.slop
    dims = (body.dims[0], body.dims[1], body.dims[2])
    center = geometric_center(x, R, body, offset_frame)
    reach, soft, near = _admission_bounds(v, w, h, scratch)
    count = 0
    depth = widest = approach = 0.0
    for k in range(walls.shape[0]):
        contacts.mask[k] = 0
        n = wall_normal(walls, k)
        d = qt.dot(n, center) - walls[k, WALL_OFFSET]
        if d > radius + near:
            continue
        e = geo.scaled_normal(shape, dims, R, n)
        if d - geo.support(shape, dims, e) > near:
            continue
        vn = qt.dot(n, v)
        m = qt.cross(n, w)  # n·(ω x r) = (n x ω)·r
        if shape == BLOCK:
            if offset_frame is not None:
                vn += qt.dot(m, center_arm(R, body))
            _write_vertices(d, vn, e, qt.transposed_matvec(R, m), scratch)
            for vertex in range(VERTEX_COUNT):
                gap, speed = contacts.vertices[0, vertex], contacts.vertices[1, vertex]
                if gap > near:
                    continue
                if _admit(gap, speed, slop, reach, soft, k * features + vertex, h, memory, scratch):
                    count = _record(count, k, vertex, features, gap, speed, contacts)
                    depth, widest, approach = max(depth, -gap), max(widest, gap), max(approach, -speed)
        else:
            gap = d - geo.support(shape, dims, e)
            speed = vn + qt.dot(m, geo.support_arm(shape, dims, R, n, e))
            if _admit(gap, speed, slop, reach, soft, k, h, memory, scratch) or is_still_pressed(
                gap, k, y, h, offset_frame, memory, scratch
            ):
                count = _record(count, k, 0, features, gap, speed, contacts)
                depth, widest, approach = max(depth, -gap), max(widest, gap), max(approach, -speed)
    contacts.widest, contacts.approach = widest, approach
    return count, depth


@inlined
def _record(count, wall, feature, features, gap, speed, contacts):
    contacts.slot[count] = wall * features + feature
    contacts.gap[count] = gap
    contacts.speed[count] = speed
    contacts.mask[wall] |= 1 << feature
    return count + 1


@inlined
def check_penetration(x, R, offset_frame, scratch):
    """Test a body at position x, with the rotation matrix R, for features inside walls: (has_passed, is_deep).

    `has_passed` is true if a feature outside the contact set is deeper than half a slop in a wall; `is_deep` if any
    feature is deeper than a slop. The first feature that has passed ends the test, and both results are then true.
    """
    body = scratch.body
    walls, shape, least = scratch.scene.walls, body.shape, -0.5 * body.slop
    dims = (body.dims[0], body.dims[1], body.dims[2])
    center, is_deep = geometric_center(x, R, body, offset_frame), False
    for k in range(walls.shape[0]):
        n = wall_normal(walls, k)
        d = qt.dot(n, center) - walls[k, WALL_OFFSET]
        if d > body.radius:
            continue
        e, mask = geo.scaled_normal(shape, dims, R, n), scratch.contacts.mask[k]
        gap = d - geo.support(shape, dims, e)
        if gap >= least:
            continue
        if mask == 0:
            return True, True
        if shape == BLOCK:
            for vertex in range(VERTEX_COUNT):
                if not mask & (1 << vertex) and d + geo.vertex_height(e, vertex) < least:
                    return True, True
        if gap < -body.slop:
            is_deep = True
    return False, is_deep


@kernel
def nearest_outside_set(x, R, offset_frame, scratch):
    """Smallest gap [m] of all features outside the contact set, at position x and rotation R, and that feature's slot.

    Where a wall is beyond the bounding sphere, the gap of the sphere takes the place of its features' gaps: a lower
    bound, which is positive. Its slot is -1.
    """
    body = scratch.body
    walls, features, shape, radius = scratch.scene.walls, scratch.scene.features, body.shape, body.radius
    dims = (body.dims[0], body.dims[1], body.dims[2])
    center = geometric_center(x, R, body, offset_frame)
    best, slot = 1.0e300, -1
    for k in range(walls.shape[0]):
        n = wall_normal(walls, k)
        d = qt.dot(n, center) - walls[k, WALL_OFFSET]
        if d > radius:
            if d - radius < best:
                best, slot = d - radius, -1
            continue
        e = geo.scaled_normal(shape, dims, R, n)
        mask = scratch.contacts.mask[k]
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
def feature_gap(slot, x, R, offset_frame, scratch):
    """Gap [m] of the feature of a contact slot to its wall, for a body at position x with the rotation matrix R."""
    scene, body = scratch.scene, scratch.body
    walls, shape = scene.walls, body.shape
    dims = (body.dims[0], body.dims[1], body.dims[2])
    n = wall_normal(walls, wall_of(slot, scene))
    d = qt.dot(n, geometric_center(x, R, body, offset_frame)) - walls[wall_of(slot, scene), WALL_OFFSET]
    e = geo.scaled_normal(shape, dims, R, n)
    if shape == BLOCK:
        return d + geo.vertex_height(e, feature_of(slot, scene))
    return d - geo.support(shape, dims, e)


@kernel
def feature_gap_rate(slot, y, offset_frame, scratch):
    """Rate of the gap of a slot's feature in the state y [m/s]: the normal velocity of its contact point.

    The contact point of an ellipsoid wanders over the body, but along the wall: that does not change the gap.
    """
    scene, body = scratch.scene, scratch.body
    _, q, v, L = y
    walls, R, shape = scene.walls, qt.to_matrix(q), body.shape
    dims = (body.dims[0], body.dims[1], body.dims[2])
    n = wall_normal(walls, wall_of(slot, scene))
    if shape == BLOCK:
        r = geo.vertex_arm(dims, R, feature_of(slot, scene))
        if offset_frame is not None:
            c = center_arm(R, body)
            r = (r[0] + c[0], r[1] + c[1], r[2] + c[2])
    else:
        r = geo.support_arm(shape, dims, R, n, geo.scaled_normal(shape, dims, R, n))
    u = qt.cross(angular_velocity(q, L, body, offset_frame), r)
    return qt.dot(n, (v[0] + u[0], v[1] + u[1], v[2] + u[2]))


@inlined
def project_out_of_walls(x, R, offset_frame, scratch):
    """Move the position x out of walls, along their normals, so that a body deeper than the slop is half a slop deep.

    R is the body's rotation matrix; the new position is returned, and no velocity changes.
    """
    body = scratch.body
    walls, shape, radius, slop = scratch.scene.walls, body.shape, body.radius, body.slop
    dims = (body.dims[0], body.dims[1], body.dims[2])
    for k in range(walls.shape[0]):
        n = wall_normal(walls, k)
        d = qt.dot(n, geometric_center(x, R, body, offset_frame)) - walls[k, WALL_OFFSET]
        if d >= radius:
            continue
        gap = d - geo.support(shape, dims, geo.scaled_normal(shape, dims, R, n))
        if gap < -slop:
            s = -gap - 0.5 * slop
            x = (x[0] + s * n[0], x[1] + s * n[1], x[2] + s * n[2])
    return x
