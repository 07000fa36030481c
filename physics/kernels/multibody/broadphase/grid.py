"""Columns for the broad phase: bodies far apart across the sweep's axis are never compared.

The two world axes across that of the sweep are cut into strips about two mean boxes wide; a body is listed in every
column that its box enters, in the sweep's order. A body that is large enters many; where all lists together would be
long the strips are made wider, up to one column with everything in it, which is the sweep alone.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.multibody.data.arrays import ENTRIES_PER_BODY

# Width of a strip in mean widths of a box: a box then enters about (1 + 1/2)² columns.
BOXES_PER_STRIP = 2.0


@inlined
def _cut(k, many):
    """Cut axis k into strips: (lowest coordinate, strips per metre, strips)."""
    box, count = many.bodies.box, many.bodies.box.shape[0]
    low, high, total = box[0, k], box[0, k + 3], 0.0
    for b in range(count):
        low, high = min(low, box[b, k]), max(high, box[b, k + 3])
        total += box[b, k + 3] - box[b, k]
    width = BOXES_PER_STRIP * total / count
    most = math.sqrt(float(count))
    if not high - low >= width or not width > 0.0:  # also what is not finite
        return low, 0.0, 1
    strips = int(min((high - low) / width, most))
    return low, strips / (high - low), strips


@inlined
def strip_index(x, low, density, strips):
    """Index of the strip that contains coordinate x."""
    return min(max(int((x - low) * density), 0), strips - 1)


@inlined
def body_strips(b, u, v, cuts, many):
    """First and last strips of body b along both axes: (u from, u to, v from, v to)."""
    box = many.bodies.box
    lu, du, nu, lv, dv, nv = cuts
    return (
        strip_index(box[b, u], lu, du, nu), strip_index(box[b, u + 3], lu, du, nu),
        strip_index(box[b, v], lv, dv, nv), strip_index(box[b, v + 3], lv, dv, nv),
    )  # fmt: skip


@inlined
def _count_entries(u, v, cuts, many):
    """Count the bodies that enter column c into `many.broadphase.first_entry[c + 1]`; return the number of entries."""
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
    """List the bodies, in the order of `many.broadphase.order`, in the columns along axes u and v; return the cuts.

    Column c = strip of u * strips of v + strip of v has `many.broadphase.entry[first_entry[c] : first_entry[c + 1]]`;
    `many.broadphase.cursor[c]` is where it begins.
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
