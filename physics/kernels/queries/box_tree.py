"""Tree of boxes around the bodies of a world, four boxes to a row, for rays that meet few of the bodies.

The bodies are ordered by halving them along the axis along which they are spread farthest, then each half, and so on.
Four bodies that follow each other form a row, and four rows that follow each other have one box each in a row of the
next level, up to a single row, the root. A ray is tested against the four boxes of a row at once. The tree changes the
time of a query, never its result: a box is a little larger than rounding needs.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from physics.compiler.decorators import inlined, kernel
from physics.compiler.simd import LANE_COUNT, larger, load_lanes, min_of_lanes, select_lanes, smaller
from physics.kernels.multibody.broadphase.sweep_and_prune import half_extent

# Share by which boxes are enlarged. Rounding of a box, and of the times at which a ray passes its planes, is below ten
# units in the last place, 2e-15; so no ray that meets a body misses its box.
ENLARGED = 1.0e-12

# Most rows of the level at which a search begins.
TOP_ROWS = 8

# Columns of `BoxTree.boxes`: four lower ends along each axis, then four upper ends.
_LOW, _HIGH = 0, 3 * LANE_COUNT
BOX_COLUMNS = 6 * LANE_COUNT

# Largest inverse of a component of a direction: it keeps products finite for directions along a coordinate plane.
_LARGEST_INVERSE = 1.0e200


class BoxTree(NamedTuple):
    """Rows of four boxes; the root is row 0, and the rows of bodies come last.

    An item is a row, or a body plus the number of rows.
    """

    boxes: np.ndarray  # (rows, BOX_COLUMNS) ends of the boxes, world frame [m]
    child: np.ndarray  # (rows, 4) int, item in each box
    order: np.ndarray  # (bodies,) int, bodies in the order of the leaves
    top: np.ndarray  # (2,) int, first row and end of the level at which a search begins
    part: np.ndarray  # (...,) int, parts of `order` that are yet to be halved
    item: np.ndarray  # (rows + bodies + 4,) int, items whose boxes a ray meets
    distance: np.ndarray  # (rows + bodies + 4,) distances at which the ray enters these boxes [m]


def make_box_tree(bodies: int) -> BoxTree:
    """Allocate the tree of a world with so many bodies."""
    levels = [-(-bodies // LANE_COUNT)]
    while levels[-1] > 1:
        levels.append(-(-levels[-1] // LANE_COUNT))
    rows, i = sum(levels), np.int64
    top = next(k for k, level in enumerate(levels) if level <= TOP_ROWS)
    first = sum(levels[top + 1 :])
    room = rows + bodies + LANE_COUNT
    return BoxTree(
        np.zeros((rows, BOX_COLUMNS)), np.zeros((rows, LANE_COUNT), i), np.zeros(bodies, i),
        np.array([first, first + levels[top]]), np.zeros(LANE_COUNT * (len(levels) + 1), i),
        np.zeros(room, i), np.zeros(room),
    )  # fmt: skip


@inlined
def _widest_axis(first, last, scratch):
    """World axis along which the centres of the bodies `order[first : last]` are spread farthest."""
    best, widest = -1.0, 0
    for axis in range(3):
        low, high = math.inf, -math.inf
        for k in range(first, last):
            x = scratch.bodies.center[scratch.tree.order[k], axis]
            low, high = min(low, x), max(high, x)
        if high - low > best:
            best, widest = high - low, axis
    return widest


@kernel
def _part_at(first, middle, last, axis, scratch):
    """Reorder `order[first : last]` so that no centre before `middle` lies beyond one from there on (quickselect)."""
    order, center = scratch.tree.order, scratch.bodies.center
    low, high = first, last - 1
    while low < high:
        pivot, i, j = center[order[(low + high) // 2], axis], low, high
        while i <= j:
            while center[order[i], axis] < pivot:
                i += 1
            while center[order[j], axis] > pivot:
                j -= 1
            if i <= j:
                order[i], order[j] = order[j], order[i]
                i, j = i + 1, j - 1
        if middle <= j:
            high = j
        elif middle >= i:
            low = i
        else:
            return


@kernel
def _order_bodies(scratch):
    """Order the bodies so that the bodies of each subtree are neighbours, by halving along the widest axis.

    A part is cut at a multiple of the bodies of a full subtree, a power of four, so that subtrees are not torn.
    """
    tree = scratch.tree
    for b in range(tree.order.shape[0]):
        tree.order[b] = b
    tree.part[0], tree.part[1], waiting = 0, tree.order.shape[0], 2
    while waiting > 0:
        waiting -= 2
        first, last = tree.part[waiting], tree.part[waiting + 1]
        if last - first <= LANE_COUNT:
            continue
        size = LANE_COUNT
        while LANE_COUNT * size < last - first:
            size *= LANE_COUNT
        subtrees = (last - first + size - 1) // size
        middle = first + (subtrees + 1) // 2 * size
        _part_at(first, middle, last, _widest_axis(first, last, scratch), scratch)
        tree.part[waiting], tree.part[waiting + 1] = first, middle
        tree.part[waiting + 2], tree.part[waiting + 3] = middle, last
        waiting += 4


@inlined
def _put_body_box(row, lane, b, scratch):
    """Write the enlarged box of body b into a lane of a row of the tree."""
    for axis in range(3):
        x, half = scratch.bodies.center[b, axis], half_extent(b, axis, scratch)
        half += ENLARGED * (abs(x) + half)
        scratch.tree.boxes[row, _LOW + LANE_COUNT * axis + lane] = x - half
        scratch.tree.boxes[row, _HIGH + LANE_COUNT * axis + lane] = x + half


@inlined
def _put_row_box(row, lane, below, tree):
    """Write the box around all boxes of the row `below` into a lane of a row of the next level."""
    boxes = tree.boxes
    for axis in range(3):
        low, high = math.inf, -math.inf
        for k in range(LANE_COUNT):
            if boxes[below, _LOW + LANE_COUNT * axis + k] < math.inf:
                low = min(low, boxes[below, _LOW + LANE_COUNT * axis + k])
                high = max(high, boxes[below, _HIGH + LANE_COUNT * axis + k])
        boxes[row, _LOW + LANE_COUNT * axis + lane] = low
        boxes[row, _HIGH + LANE_COUNT * axis + lane] = high


@inlined
def _put_no_box(row, lane, tree):
    """Write a box at infinity, which no ray meets, into a lane of a row."""
    for column in range(lane, BOX_COLUMNS, LANE_COUNT):
        tree.boxes[row, column] = math.inf


@kernel
def build_tree(scratch):
    """Build the tree of boxes around the bodies in their present poses."""
    tree = scratch.tree
    _order_bodies(scratch)
    count, end, below = tree.order.shape[0], tree.child.shape[0], -1
    while end > 0:
        first = end - (count + LANE_COUNT - 1) // LANE_COUNT
        for k in range(LANE_COUNT * (end - first)):
            row, lane = first + k // LANE_COUNT, k % LANE_COUNT
            if k >= count:
                _put_no_box(row, lane, tree)
            elif below < 0:
                tree.child[row, lane] = tree.order[k] + tree.child.shape[0]
                _put_body_box(row, lane, tree.order[k], scratch)
            else:
                tree.child[row, lane] = below + k
                _put_row_box(row, lane, below + k, tree)
        below, count, end = first, end - first, first


@inlined
def safe_inverse(x):
    """Inverse 1/x of a component of a direction, at most 1e200 in size."""
    return 1.0 / x if abs(x) * _LARGEST_INVERSE > 1.0 else math.copysign(_LARGEST_INVERSE, x)


@inlined
def _slab(row, axis, o, inverse, tree):
    """Distances at which a ray enters and leaves the four slabs of a row along an axis, as lanes [m]."""
    a = (load_lanes(tree.boxes, row, _LOW + LANE_COUNT * axis) - o) * inverse
    b = (load_lanes(tree.boxes, row, _HIGH + LANE_COUNT * axis) - o) * inverse
    return smaller(a, b), larger(a, b)


@inlined
def _box_distances(row, o, inverse, farthest, tree):
    """Distances at which a ray enters the boxes of a row, as lanes [m]; inf if a box is not met within `farthest`.

    The distance is negative for a box around the origin.
    """
    in_x, out_x = _slab(row, 0, o[0], inverse[0], tree)
    in_y, out_y = _slab(row, 1, o[1], inverse[1], tree)
    in_z, out_z = _slab(row, 2, o[2], inverse[2], tree)
    near, far = larger(larger(in_x, in_y), in_z), smaller(smaller(out_x, out_y), out_z)
    is_met = (near <= far * (1.0 + ENLARGED)) & (far >= 0.0) & (near <= farthest)
    return select_lanes(is_met, near, math.inf)


@inlined
def _put(item, distance, found, tree):
    """Put an item into the list of those that a ray meets, and keep it there if its distance is finite.

    Returns the new number of items. There is no branch: which boxes a ray meets cannot be predicted.
    """
    tree.item[found], tree.distance[found] = item, distance
    return found + (1 if distance < math.inf else 0)


@inlined
def _put_children(row, found, o, inverse, farthest, tree):
    """Append the children of a row whose boxes a ray meets to the list; return the new number of items."""
    near = _box_distances(row, o, inverse, farthest, tree)
    if not min_of_lanes(near) < math.inf:
        return found
    found = _put(tree.child[row, 0], near[0], found, tree)
    found = _put(tree.child[row, 1], near[1], found, tree)
    found = _put(tree.child[row, 2], near[2], found, tree)
    return _put(tree.child[row, 3], near[3], found, tree)


@inlined
def find_bodies(o, inverse, farthest, tree):
    """Find the bodies whose boxes a ray meets within `farthest` [m]: (first, end) of their places in `tree.item`.

    The tree is visited level by level, so that the processor works on several rows at once. In a depth-first search the
    processor would wait for each row. o is the origin of the ray, `inverse` the inverse of each component of its
    direction (`safe_inverse`). `tree.distance` is the distance of each box.
    """
    rows, found, next_item = tree.child.shape[0], 0, 0
    for row in range(tree.top[0], tree.top[1]):
        found = _put_children(row, found, o, inverse, farthest, tree)
    while next_item < found and tree.item[next_item] < rows:
        found = _put_children(tree.item[next_item], found, o, inverse, farthest, tree)
        next_item += 1
    return next_item, found
