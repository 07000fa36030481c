"""Broad phase: find the pairs of bodies that may touch within a stage.

Sweep and prune: every body has a swept box, which contains its motion in the stage. The boxes are sorted along the
world axis along which the bodies' centres vary most. A body is then compared with later ones until a box begins beyond
the end of its own. Only bodies in the same grid column across that axis are compared (`grid`). Pairs are returned in
the order of their bodies' indices, so that results for two bodies do not depend on the places of others.

In a world with room for all pairs, up to 2 `PAIRS_PER_BODY` + 1 bodies, each body is compared with each instead: that
is faster than to sort so few.

Reference: D. Baraff, *Dynamic simulation of non-penetrating rigid bodies*, PhD thesis, Cornell, 1992, section 2.3.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined, kernel
from physics.kernels.half_space import support_function as geo
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.broadphase.grid import body_strips, fill_columns
from physics.kernels.multibody.data.arrays import NUM_DROPPED, NUM_PAIRS
from physics.kernels.multibody.data.capsules import half_length, is_capsule
from physics.kernels.multibody.data.collision_groups import share_group
from physics.kernels.multibody.data.contact_set import pair_slop, subtract
from physics.kernels.multibody.data.cylinders import cylinder_half_extent, is_cylinder
from physics.kernels.multibody.data.fixed_bodies import is_still, may_form_pair
from physics.kernels.multibody.data.parts import is_compound
from physics.kernels.state.layout import BLOCK, HULL, POS, SPHERE, WALL_NORMAL, WALL_OFFSET

# Bound of the factor by which growing spin moves points farther than the initial spin would (`surface_motion_bound`).
_SPIN_GROWTH = 1.5


@inlined
def center_motion_bound(b, h, many):
    """Bound of the displacement of body b's centre of mass within h [s] without contact [m]."""
    t = many.bodies.twist
    return h * (abs(t[b, 0]) + abs(t[b, 1]) + abs(t[b, 2])) + 0.5 * h * h * many.bodies.body[b].acceleration


@inlined
def surface_motion_bound(b, h, many):
    """Bound of the displacement of any point of body b within h [s] without contact [m].

    Rotation adds at most two bounding radii. The angular velocity ω of a body that turns far may grow meanwhile. Its
    derivative is at most ω²/√3 in size, so that a turn of θ at the initial rate becomes at most -√3 log(1 - θ/√3). The
    chord of that turn is at most 1.5 θ, or 2, in bounding radii.
    """
    t = many.bodies.twist
    turn = h * (abs(t[b, 3]) + abs(t[b, 4]) + abs(t[b, 5]))
    if many.bodies.spin_bound[b] > 0.0:
        turn *= _SPIN_GROWTH
    return center_motion_bound(b, h, many) + many.bodies.body[b].radius * min(turn, 2.0)


@inlined
def may_reach_wall(b, wall, h, many):
    """True if the bounding sphere of body b may touch a wall within h [s]; `wall` is the wall's index.

    False if their collision groups keep them apart. Rotation does not move the sphere, so that a body that spins fast
    far from the wall does not count.
    """
    d = (
        qt.dot(row_vector(many.walls, wall, WALL_NORMAL), row_vector(many.bodies.state, b, POS))
        - many.walls[wall, WALL_OFFSET]
    )
    near = not d > many.bodies.body[b].radius + center_motion_bound(b, h, many) + many.bodies.body[b].slop
    return near and share_group(b, -1 - wall, many)


@inlined
def may_meet(a, b, h, many):
    """True if the bounding spheres of bodies a and b may touch within h [s]."""
    far = (
        many.bodies.body[a].radius
        + many.bodies.body[b].radius
        + center_motion_bound(a, h, many)
        + center_motion_bound(b, h, many)
    )
    far += pair_slop(a, b, many)
    d = subtract(row_vector(many.bodies.state, a, POS), row_vector(many.bodies.state, b, POS))
    return not qt.dot(d, d) > far * far


@inlined
def half_extent(b, axis, many):
    """Half the width of body b along a world axis (0, 1 or 2) [m].

    For a hull or compound it is half the width of the bounding block.
    """
    R, d, shape = many.bodies.rotation, many.bodies.body[b].dims, many.bodies.body[b].shape
    if shape == SPHERE:
        return d[0]
    if is_capsule(b, many):
        return half_length(b, many) * abs(R[b, 3 * axis + 1]) + d[0]
    if is_cylinder(b, many):
        return cylinder_half_extent(d, R[b, 3 * axis + 1])
    if shape == HULL or is_compound(b, many):
        shape = BLOCK
    e = (d[0] * R[b, 3 * axis], d[1] * R[b, 3 * axis + 1], d[2] * R[b, 3 * axis + 2])
    return geo.support(shape, (d[0], d[1], d[2]), e)


@inlined
def write_swept_box(b, h, many):
    """Write `many.bodies.box` of body b: a box around all its possible places within h [s], plus the slop."""
    margin = surface_motion_bound(b, h, many) + many.bodies.body[b].slop
    for axis in range(3):
        half = half_extent(b, axis, many) + margin
        many.bodies.box[b, axis] = many.bodies.center[b, axis] - half
        many.bodies.box[b, axis + 3] = many.bodies.center[b, axis] + half


@inlined
def widest_axis(many):
    """World axis along which the bodies' geometric centres have the largest variance: 0, 1 or 2."""
    best, axis, count = -1.0, 0, many.bodies.state.shape[0]
    for k in range(3):
        total = square = 0.0
        for b in range(count):
            total += many.bodies.center[b, k]
        for b in range(count):
            d = many.bodies.center[b, k] - total / count
            square += d * d
        if square > best:
            best, axis = square, k
    return axis


@inlined
def _merge(first, middle, last, axis, many):
    """Merge the runs [first, middle) and [middle, last) of `many.broadphase.order` into one sorted run.

    Bodies are sorted by the lower end of their boxes along a world axis.
    """
    order, merged, box = many.broadphase.order, many.broadphase.merged, many.bodies.box
    i, j = first, middle
    for k in range(first, last):
        if j >= last or (i < middle and box[order[i], axis] <= box[order[j], axis]):
            merged[k] = order[i]
            i += 1
        else:
            merged[k] = order[j]
            j += 1
    for k in range(first, last):
        order[k] = merged[k]


@inlined
def sort_bodies(axis, many):
    """Write `many.broadphase.order`: bodies sorted by the lower end of their boxes along an axis, ties by index."""
    count = many.broadphase.order.shape[0]
    for b in range(count):
        many.broadphase.order[b] = b
    width = 1
    while width < count:
        first = 0
        while first + width < count:
            _merge(first, first + width, min(first + 2 * width, count), axis, many)
            first += 2 * width
        width *= 2


@inlined
def _overlap(a, b, many):
    box = many.bodies.box
    for k in range(3):
        if box[a, k] > box[b, k + 3] or box[b, k] > box[a, k + 3]:
            return False
    return True


@inlined
def _pair_in_column(a, i, j, axes, cuts, count, many):
    """Add the near pairs of body a with later bodies of one grid column to `many.broadphase.pairs`.

    The column is strip i of u and strip j of v, with axes = (sweep's axis, u, v). `cuts` are as in `grid.body_strips`.
    A pair that shares several columns is added in the first of them only. `count` is the number of pairs so far;
    returns the new number.
    """
    axis, u, v = axes
    box, nv = many.bodies.box, cuts[5]
    column = i * nv + j
    many.broadphase.cursor[column] += 1  # past a
    for k in range(many.broadphase.cursor[column], many.broadphase.first_entry[column + 1]):
        b = many.broadphase.entry[k]
        if box[b, axis] > box[a, axis + 3]:
            break
        if not (_overlap(a, b, many) and may_form_pair(a, b, many) and share_group(a, b, many)):
            continue
        a_i, _, a_j, _ = body_strips(a, u, v, cuts, many)
        b_i, _, b_j, _ = body_strips(b, u, v, cuts, many)
        if max(a_i, b_i) != i or max(a_j, b_j) != j:
            continue  # added in another column: that of the lower corner of the boxes' overlap
        if count == many.broadphase.pairs.shape[0]:
            many.counts[NUM_DROPPED] += 1
            continue
        many.broadphase.pairs[count, 0], many.broadphase.pairs[count, 1] = a, b
        count += 1
    return count


@inlined
def _count_into(pairs, column, count, first, target):
    """Copy the first `count` rows of `pairs` to `target`, sorted by their entry in `column` (stable counting sort).

    `first` (bodies + 1,) is scratch.
    """
    for b in range(first.shape[0]):
        first[b] = 0
    for k in range(count):
        first[pairs[k, column] + 1] += 1
    for b in range(1, first.shape[0]):
        first[b] += first[b - 1]
    for k in range(count):
        b = pairs[k, column]
        target[first[b], 0], target[first[b], 1] = pairs[k, 0], pairs[k, 1]
        first[b] += 1


@inlined
def _is_sorted(pairs, count):
    """True if the first `count` pairs are in the order of their first body, then of their second body."""
    for k in range(1, count):
        if pairs[k, 0] < pairs[k - 1, 0] or (pairs[k, 0] == pairs[k - 1, 0] and pairs[k, 1] < pairs[k - 1, 1]):
            return False
    return True


@kernel
def _sort_pairs(count, many):
    """Sort the first `count` pairs of `many.broadphase.pairs` by their first body, then by their second body."""
    sweep = many.broadphase
    _count_into(sweep.pairs, 1, count, sweep.first_entry, sweep.sorted_pairs)
    _count_into(sweep.sorted_pairs, 0, count, sweep.first_entry, sweep.pairs)


@inlined
def _compare_all(many):
    """Write all near pairs by comparing each body with each; return their number. There must be room for all pairs."""
    count, pairs = 0, many.broadphase.pairs
    for a in range(many.bodies.state.shape[0]):
        for b in range(a + 1, many.bodies.state.shape[0]):
            if may_form_pair(a, b, many) and _overlap(a, b, many) and share_group(a, b, many):
                pairs[count, 0], pairs[count, 1] = a, b
                count += 1
    return count


@kernel
def _sweep(many):
    """Write the near pairs that sweep and prune finds; return their number."""
    axis = widest_axis(many)
    sort_bodies(axis, many)
    u, v = (axis + 1) % 3, (axis + 2) % 3
    cuts, pairs, count = fill_columns(u, v, many), many.broadphase.pairs, 0
    for r in range(many.broadphase.order.shape[0]):
        a, first = many.broadphase.order[r], count
        i_first, i_last, j_first, j_last = body_strips(a, u, v, cuts, many)
        for i in range(i_first, i_last + 1):
            for j in range(j_first, j_last + 1):
                count = _pair_in_column(a, i, j, (axis, u, v), cuts, count, many)
        for k in range(first, count):
            b = pairs[k, 1]
            pairs[k, 0], pairs[k, 1] = min(a, b), max(a, b)
    if not _is_sorted(pairs, count):
        _sort_pairs(count, many)
    return count


@kernel
def find_pairs(h, many):
    """Find all near pairs within h [s]: write `many.broadphase.pairs` and their number `many.counts[NUM_PAIRS]`.

    A near pair is two bodies a < b that may touch and whose swept boxes overlap. Pairs are sorted by a, then by b.
    Bodies that are still have their boxes already (`stepping.still_bodies`).
    """
    count = many.bodies.state.shape[0]
    for b in range(count):
        if not is_still(b, many):
            write_swept_box(b, h, many)
    is_small = count * (count - 1) <= 2 * many.broadphase.pairs.shape[0]
    many.counts[NUM_PAIRS] = _compare_all(many) if is_small else _sweep(many)
