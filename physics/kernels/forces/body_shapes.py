"""Shapes of bodies as fields read them in scenes with hulls, capsules, cylinders or compounds.

Such fields have the shapes of a body behind their other parameters, from column `first` on: the number of parts of a
compound, 0 for any other body; a bound of the distance of any point from the centre of mass; the volume, and the
distance of its centre from the centre of mass. A record of each part follows (`PART_SIZE` columns), then triangles of
the faces of hulls, nine numbers each, in body axes. A body that is no compound has one record, of which only the
triangles are read: its shape and dimensions are those of its state, since its size may differ from world to world.

`physics.scene.field_shapes` writes the columns.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined
from physics.kernels.math import quaternion as qt

# Columns from `first` on.
PART_COUNT, BOUND, VOLUME, VOLUME_OFFSET, FIRST_PART = 0, 1, 2, 3, 4

# Columns of a part: code of its shape, its geometric centre from the body's centre of mass [m], matrix from its axes to
# body axes, half axes or half extents [m], place of its first triangle behind `first`, number of its triangles.
PART_SHAPE, PART_PLACE, PART_TURN, PART_DIMS, PART_TRIANGLE, PART_TRIANGLES = 0, 1, 4, 13, 16, 17
PART_SIZE = 18


@inlined
def _three(p, i):
    return p[i], p[i + 1], p[i + 2]


@inlined
def part_count(p, first):
    """Number of parts of a body, 1 if it is no compound."""
    return max(1, int(p[first + PART_COUNT]))


@inlined
def is_whole(p, first):
    """True if a body is no compound."""
    return p[first + PART_COUNT] == 0.0


@inlined
def read_part(i, state, p, first):
    """Part i of a body: (shape, dimensions [m], matrix from its axes to the world, its centre [m]).

    The geometric centre is relative to the body's centre of mass, world frame.
    """
    if is_whole(p, first):
        return state.shape, state.dims, state.R, state.center
    row = first + FIRST_PART + PART_SIZE * i
    t, R = row + PART_TURN, state.R
    x, y, z = (p[t], p[t + 3], p[t + 6]), (p[t + 1], p[t + 4], p[t + 7]), (p[t + 2], p[t + 5], p[t + 8])
    x, y, z = qt.matvec(R, x), qt.matvec(R, y), qt.matvec(R, z)
    turn = (x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2])
    return int(p[row + PART_SHAPE]), _three(p, row + PART_DIMS), turn, qt.matvec(R, _three(p, row + PART_PLACE))


@inlined
def triangle_range(i, p, first):
    """Columns at which the triangles of part i begin and end."""
    row = first + FIRST_PART + PART_SIZE * i
    begin = first + int(p[row + PART_TRIANGLE])
    return begin, begin + 9 * int(p[row + PART_TRIANGLES])


@inlined
def triangle(p, k):
    """Corners of the triangle from column k on, counter-clockwise seen from outside, in the axes of its part [m]."""
    return _three(p, k), _three(p, k + 3), _three(p, k + 6)
