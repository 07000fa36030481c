"""Guards of a contact mode: margins that stay positive while the mode lasts; the first one that is used up is an event.

- *Gap* of every feature that does not act, in radii. A dip between the ends of a step shows in the cubic through the
  gaps and their rates at both ends.
- *Push*: normal force of every contact that acts, in weights.
- *Load*: of a sliding face, of which three vertices act. The fourth vertex touches, but the affine normal force would
  pull there. The margin is this pull, in weights.
- *Cone*: of every sticking contact, the friction that it could exert beyond its present friction, in weights. Two
  sticking contacts of one wall may distribute the force along their line in any way, so they have a common margin.
- *Speed* of every sliding contact, along its direction at the start of the step, in units of the body's speed.

If a body has more contacts than its motion needs (such as a corner that sticks at the floor and at a wall), their
forces can be distributed in many ways, of which a linear solve takes one. Force guards of this one may end a mode that
could go on. `mode_acceptance` treats this case.

A contact, or its feature, *acts* if it sticks or slides in the present contact mode; otherwise it is open.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.contact_law.anisotropic_friction import unstretch_force
from physics.kernels.contact_law.materials import friction_at, friction_of
from physics.kernels.event_driven.contact_forces import NO_PATCH, free_angular_motion, recover_contact_forces
from physics.kernels.event_driven.extrapolated_midpoint import compute_state_rate, get_state_row, sliding_velocity
from physics.kernels.event_driven.workspace import ROW_END, ROW_START, Y_VELOCITY
from physics.kernels.half_space import support_function as geo
from physics.kernels.half_space.contact_point import (
    center_arm,
    feature_of,
    geometric_center,
    wall_axes,
    wall_normal,
    wall_of,
)
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import as_vector, row_vector
from physics.kernels.state.layout import BLOCK, VERTEX_COUNT, WALL_OFFSET

GUARD_NONE, GUARD_GAP, GUARD_PUSH, GUARD_CONE, GUARD_SPEED, GUARD_LOAD, GUARD_STEP_FAILED, GUARD_WATCH = range(8)

# Guards of force.
FORCE_GUARDS = (GUARD_PUSH, GUARD_CONE, GUARD_LOAD)

# Forces of this many weights are rounding: a force guard ends a mode only if its margin is below minus this.
FORCE_MARGIN_TOLERANCE = 1.0e-9


@kernel
def compute_feature_gaps(row, offset_frame, scratch, smooth):
    """Write gaps [m] and gap rates [m/s] of all features, in the state of row `row` of `smooth.y`.

    They go to the same row of `smooth.gap` and `smooth.gap_rate`. Gaps to a wall out of reach are infinite.
    """
    scene, body = scratch.scene, scratch.body
    x, q, v, m = get_state_row(smooth, row)
    R, _, w, _ = free_angular_motion((x, q, v, m), offset_frame, body)
    dims, features, shape = as_vector(body.dims), scene.features, body.shape
    center = geometric_center(x, R, body, offset_frame)
    for k in range(scene.walls.shape[0]):
        n = wall_normal(scene.walls, k)
        d = qt.dot(n, center) - scene.walls[k, WALL_OFFSET]
        if d > 2.0 * body.radius:
            for feature in range(features):
                smooth.gap[row, k * features + feature] = math.inf
            continue
        e = geo.scaled_normal(shape, dims, R, n)
        vn, turn = qt.dot(n, v), qt.cross(n, w)
        if shape == BLOCK:
            if offset_frame is not None:
                vn += qt.dot(turn, center_arm(R, body))
            b = qt.transposed_matvec(R, turn)
            f = (dims[0] * b[0], dims[1] * b[1], dims[2] * b[2])
            for vertex in range(VERTEX_COUNT):
                smooth.gap[row, k * features + vertex] = d + geo.vertex_height(e, vertex)
                smooth.gap_rate[row, k * features + vertex] = vn + geo.vertex_height(f, vertex)
        else:
            smooth.gap[row, k * features] = d - geo.support(shape, dims, e)
            smooth.gap_rate[row, k * features] = vn + qt.dot(turn, geo.support_arm(shape, dims, R, n, e))


@inlined
def cubic_minimum(g0, r0, g1, r1, h):
    """Smallest value on (0, h] of the cubic with the value g0 and the slope r0 at 0, and g1 and r1 at h."""
    low = g1
    if r0 < 0.0 and r1 > 0.0 and g0 < math.inf:
        # g0 + r0 t + c t² + k t³; its slope vanishes where 3 k t² + 2 c t + r0 = 0, r0 < 0 at the start.
        c = (3.0 * (g1 - g0) / h - 2.0 * r0 - r1) / h
        k = (r0 + r1 - 2.0 * (g1 - g0) / h) / (h * h)
        disc = c * c - 3.0 * k * r0
        if disc > 0.0:
            t = -r0 / (c + math.sqrt(disc))
            if 0.0 < t < h:
                low = min(low, g0 + t * (r0 + t * (c + t * k)))
    return low


@inlined
def least_gap_margin(h, motion):
    """Smallest gap margin of the features that do not act, over a step of h [s]: (margin [m], slot).

    The margin of a feature is its smallest gap within the step. For a feature that leaves, it is the height above its
    gap at the start, so that a bounce does not end deeper and gain energy. For one that touches and neither leaves nor
    approaches, it is this height plus the gap that counts as touching.
    """
    smooth, thresholds = motion.smooth, motion.thresholds
    least, which = math.inf, -1
    for s in range(smooth.is_active.shape[0]):
        if smooth.is_active[s] or smooth.gap[ROW_END, s] == math.inf:
            continue
        g0, g1 = smooth.gap[ROW_START, s], smooth.gap[ROW_END, s]
        if g0 <= thresholds.touch_gap and smooth.gap_rate[ROW_START, s] > thresholds.rest_speed:
            low = g1 - g0
        elif g0 <= thresholds.touch_gap:
            low = g1 - min(g0, 0.0) + thresholds.touch_gap
        else:
            low = cubic_minimum(g0, smooth.gap_rate[ROW_START, s], g1, smooth.gap_rate[ROW_END, s], h)
        if low < least:
            least, which = low, s
    return least, which


@inlined
def _cone_excess(j, mu, scratch, contacts):
    """Excess of contact j alone over its friction cone: tangential force less μ times the normal force [N]."""
    axes = wall_axes(scratch.scene.walls, wall_of(contacts.slot[j], scratch.scene))
    n, f = axes[0], unstretch_force(row_vector(contacts.force, j, 0), axes, scratch.body)
    p = contacts.normal[j]
    return math.sqrt(max(0.0, qt.dot(f, f) - qt.dot(n, f) * qt.dot(n, f))) - mu * p


@inlined
def _pair_excess(i, j, mu, scratch, contacts):
    """Excess of the two contacts i and j of one wall over their friction cones together [N].

    It is that of the most favourable distribution of the force along the line between them.
    """
    body = scratch.body
    axes = wall_axes(scratch.scene.walls, wall_of(contacts.slot[i], scratch.scene))
    a, b = row_vector(contacts.arm, i, 0), row_vector(contacts.arm, j, 0)
    e = unstretch_force((b[0] - a[0], b[1] - a[1], b[2] - a[2]), axes, body)
    s = 1.0 / math.sqrt(qt.dot(e, e))
    e = (s * e[0], s * e[1], s * e[2])
    across = qt.cross(axes[0], e)
    f, g = (
        unstretch_force(row_vector(contacts.force, i, 0), axes, body),
        unstretch_force(row_vector(contacts.force, j, 0), axes, body),
    )
    p, q = mu * contacts.normal[i], mu * contacts.normal[j]
    fa, ga = abs(qt.dot(across, f)), abs(qt.dot(across, g))
    worst = max(fa - p, ga - q)
    if worst > 0.0:
        return worst
    along = abs(qt.dot(e, f) + qt.dot(e, g))
    return along - math.sqrt((p - fa) * (p + fa)) - math.sqrt((q - ga) * (q + ga))


@kernel
def cone_excess(j, scratch, contacts):
    """Excess of the sticking contact j over its friction cone [N]; negative inside the cone.

    If exactly two contacts stick at its wall, it is that of both together (`_pair_excess`).
    """
    wall, other, holding = wall_of(contacts.slot[j], scratch.scene), j, 1
    for k in range(contacts.count):
        if k != j and contacts.sticks[k] and wall_of(contacts.slot[k], scratch.scene) == wall:
            other = k
            holding += 1
    if holding == 2 and contacts.normal[j] >= 0.0 and contacts.normal[other] >= 0.0:
        return _pair_excess(j, other, friction_at(wall, scratch.body), scratch, contacts)
    return _cone_excess(j, friction_at(wall, scratch.body), scratch, contacts)


@inlined
def least_inactive_pull(scratch, motion):
    """Margin of the load guard: the smallest pull [N] of a face's affine normal force at a touching inactive vertex.

    Returns (pull, slot of the vertex); the pull is infinite without such a vertex.
    """
    scene = scratch.scene
    contacts = motion.contacts
    least, which = math.inf, -1
    for j in range(contacts.count):
        if contacts.patch[j] == NO_PATCH or (
            j > 0 and wall_of(contacts.slot[j], scene) == wall_of(contacts.slot[j - 1], scene)
        ):
            continue
        wall, k = wall_of(contacts.slot[j], scene), contacts.patch[j]
        axes = wall_axes(scene.walls, wall)
        r = row_vector(contacts.arm, j, 0)
        for s in range(wall * scene.features, (wall + 1) * scene.features):
            if motion.smooth.is_active[s] or not motion.smooth.gap[ROW_START, s] <= motion.thresholds.touch_gap:
                continue
            # The fourth corner of a face is the sum of its two neighbours less the opposite corner.
            p = row_vector(contacts.arm, opposite_face_contact(s, wall, scene, contacts), 0)
            a = b = 0.0
            for i in range(contacts.count):
                if wall_of(contacts.slot[i], scene) == wall:
                    a += qt.dot(axes[1], row_vector(contacts.arm, i, 0))
                    b += qt.dot(axes[2], row_vector(contacts.arm, i, 0))
            a -= 2.0 * qt.dot(axes[1], p) + qt.dot(axes[1], r)
            b -= 2.0 * qt.dot(axes[2], p) + qt.dot(axes[2], r)
            pull = -motion.unknowns.value[k]
            pull -= (contacts.patch_coordinate[j, 0] + a / scratch.body.radius) * motion.unknowns.value[k + 1]
            pull -= (contacts.patch_coordinate[j, 1] + b / scratch.body.radius) * motion.unknowns.value[k + 2]
            if pull < least:
                least, which = pull, s
    return least, which


@inlined
def opposite_face_contact(slot, wall, scene, contacts):
    """Index of the acting contact diagonally opposite to the vertex `slot`, on a face with three acting contacts.

    Its vertex number differs from that of `slot` in most bits.
    """
    best, most = -1, -1
    for i in range(contacts.count):
        if wall_of(contacts.slot[i], scene) == wall:
            bits = feature_of(contacts.slot[i], scene) ^ feature_of(slot, scene)
            differing = (bits & 1) + ((bits >> 1) & 1) + ((bits >> 2) & 1)
            if differing > most:
                best, most = i, differing
    return best


@kernel
def least_force_margin(slack, scratch, motion):
    """Smallest margin of the force guards push, cone and load: (margin [weights], GUARD_ code, contact or slot).

    `slack` [weights] is added to each margin, so that rounding does not count.
    """
    contacts, smooth = motion.contacts, motion.smooth
    margin, guard, which = math.inf, GUARD_NONE, -1
    for j in range(contacts.count):
        push = contacts.normal[j] / smooth.weight + slack
        if push < margin:
            margin, guard, which = push, GUARD_PUSH, j
        if contacts.sticks[j]:
            cone = slack - cone_excess(j, scratch, contacts) / smooth.weight
            if cone < margin:
                margin, guard, which = cone, GUARD_CONE, j
    pull, slot = least_inactive_pull(scratch, motion)
    if pull / smooth.weight + slack < margin:
        margin, guard, which = pull / smooth.weight + slack, GUARD_LOAD, slot
    return margin, guard, which


@kernel
def least_start_force_margin(offset_frame, scratch, motion):
    """Smallest margin of the force guards at the start of the step [weights]."""
    compute_state_rate(ROW_START, 0.0, offset_frame, scratch, motion)
    recover_contact_forces(scratch.body.mu, scratch, motion)
    return least_force_margin(0.0, scratch, motion)[0]


@kernel
def least_guard_margin(h, heeds, slack, offset_frame, scratch, motion):
    """Smallest margin of all guards at the end of a step of h [s], ROW_END: (margin, GUARD_ code, contact or slot).

    `heeds` is True if the force guards count. They are used up when their margin is below minus `slack`.
    """
    body = scratch.body
    smooth, contacts, thresholds = motion.smooth, motion.contacts, motion.thresholds
    compute_state_rate(ROW_END, h, offset_frame, scratch, motion)
    recover_contact_forces(body.mu, scratch, motion)
    compute_feature_gaps(ROW_END, offset_frame, scratch, smooth)
    gap, which = least_gap_margin(h, motion)
    margin, guard = gap / body.radius, GUARD_GAP
    if heeds and smooth.weight > 0.0:
        least, sort, j = least_force_margin(slack, scratch, motion)
        if least < margin:
            margin, guard, which = least, sort, j
    if body.mu > 0.0 and margin >= 0.0:  # a contact may stop within the step, unless something ends it before
        scale = smooth.scale[Y_VELOCITY]
        for j in range(contacts.count):
            if not contacts.sticks[j] and friction_of(contacts.slot[j], scratch) > 0.0:
                t, _ = sliding_velocity(j, scratch.scene, contacts)
                speed = qt.dot(t, row_vector(contacts.start_slip_direction, j, 0))
                still = thresholds.slip_stop_speed
                speed = (speed + 0.5 * still if contacts.is_starting[j] else speed - still) / scale
                if speed < margin:
                    margin, guard, which = speed, GUARD_SPEED, j
    return margin, guard, which
