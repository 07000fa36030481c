"""Grid columns of the broad phase: bodies far apart across the sweep's axis are never compared.

The two world axes across the sweep's axis, u and v, are cut into strips about two mean box widths wide. A grid column
is a strip of u crossed with a strip of v. A body is listed in every column that its box enters, in the order of the
sweep. Large bodies enter many columns. If all lists together exceed their room, the strips are made wider, down to a
single column that holds every body.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.multibody.data.arrays import ENTRIES_PER_BODY

# Width of a strip, in mean widths of the boxes: a box then enters about (1 + 1/2)² columns.
BOXES_PER_STRIP = 2.0


@inlined
def _cut(k, many):
    """Cut world axis k into strips over the extent of all boxes.

    Returns (lowest coordinate [m], strips per metre, number of strips).
    """
    box, count = many.bodies.box, many.bodies.box.shape[0]
    low, high, total = box[0, k], box[0, k + 3], 0.0
    for b in range(count):
        low, high = min(low, box[b, k]), max(high, box[b, k + 3])
        total += box[b, k + 3] - box[b, k]
    width = BOXES_PER_STRIP * total / count
    most = math.sqrt(float(count))
    if not high - low >= width or not width > 0.0:  # also if a coordinate is not finite
        return low, 0.0, 1
    strips = int(min((high - low) / width, most))
    return low, strips / (high - low), strips


@inlined
def strip_index(x, low, density, strips):
    """Index of the strip that contains coordinate x [m], from `low`, `density` and `strips` as `_cut` returns them."""
    return min(max(int((x - low) * density), 0), strips - 1)


@inlined
def body_strips(b, u, v, cuts, many):
    """Strips that the box of body b covers along axes u and v: (first of u, last of u, first of v, last of v).

    `cuts` are the results of `_cut` for u and v, in one tuple.
    """
    box = many.bodies.box
    lu, du, nu, lv, dv, nv = cuts
    return (
        strip_index(box[b, u], lu, du, nu), strip_index(box[b, u + 3], lu, du, nu),
        strip_index(box[b, v], lv, dv, nv), strip_index(box[b, v + 3], lv, dv, nv),
    )  # fmt: skip


@inlined
def _count_entries(u, v, cuts, many):
    """Count the bodies in each grid column c, in `many.broadphase.first_entry[c + 1]`; return the sum of the counts.

    For u, v and `cuts` see `body_strips`.
    """
    first, total = many.broadphase.first_entry, 0
    for c in range(cuts[2] * cuts[5] + 1):
        first[c] = 0
    for b in range(many.bodies.box.shape[0]):
        i_first, i_last, j_first, j_last = body_strips(b, u, v, cuts, many)
        for i in range(i_first, i_last + 1):
            for j in range(j_first, j_last + 1):
                first[i * cuts[5] + j + 1] += 1
        total += (i_last - i_first + 1) * (j_last - j_first + 1)
    return total


@kernel
def fill_columns(u, v, many):
    """List all bodies in the columns that their boxes enter; return the cuts of axes u and v (see `body_strips`).

    Column c = i * strips of v + j, for strip i of u and strip j of v, has the bodies
    `many.broadphase.entry[first_entry[c] : first_entry[c + 1]]`, in the order of `many.broadphase.order`.
    `many.broadphase.cursor[c]` is set to the column's first position.
    """
    lu, du, nu = _cut(u, many)
    lv, dv, nv = _cut(v, many)
    cuts = (lu, du, nu, lv, dv, nv)
    while _count_entries(u, v, cuts, many) > ENTRIES_PER_BODY * many.bodies.box.shape[0]:
        du, nu = (0.5 * du, nu // 2) if nu > 1 else (0.0, 1)
        dv, nv = (0.5 * dv, nv // 2) if nv > 1 else (0.0, 1)
        cuts = (lu, du, nu, lv, dv, nv)
    first, cursor = many.broadphase.first_entry, many.broadphase.cursor
    for c in range(nu * nv):
        first[c + 1] += first[c]
        cursor[c] = first[c]
    for r in range(many.broadphase.order.shape[0]):
        b = many.broadphase.order[r]
        i_first, i_last, j_first, j_last = body_strips(b, u, v, cuts, many)
        for i in range(i_first, i_last + 1):
            for j in range(j_first, j_last + 1):
                c = i * nv + j
                many.broadphase.entry[cursor[c]] = b
                cursor[c] += 1
    for c in range(nu * nv):
        cursor[c] = first[c]
    return cuts
