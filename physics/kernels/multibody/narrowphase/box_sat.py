"""Separating axis test of two blocks: three face normals of each, and nine products of their edges.

The separation of two blocks along an axis is the gap between their projections on it; negative if these overlap.

References
----------
S. Gottschalk, M. C. Lin, D. Manocha, *OBBTree*, SIGGRAPH 1996.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.contact_set import pair_slop, subtract

# Squared sine of the angle between two edges below which they count as parallel. Their product is then skipped, since
# face normals cover its direction. The value is far above the rounding of the nine products, 1e-16.
PARALLEL_SINE_SQUARED = 1.0e-12

# Cosine of the angle between two face normals, or between the product of two edges and a face normal, above which the
# faces count as lying flat on each other (11 degrees). One point or one edge would let them tip to and fro. So they
# touch with the clipped face, at the separation along the product of edges.
FLAT_COSINE = 0.98

# Cosine of the angle between two face normals (1e-7) above which the faces are parallel under error control.
PARALLEL_COSINE = 1.0 - 5.0e-15

# Rows of `many.narrowphase.relative_axes` (`write_relative_axes`).
AXES, SIZES, FROM_A, FROM_B = 0, 1, 2, 3


@inlined
def body_axis(R, b, k):
    """Body axis k of body b in the world frame; R (bodies, 9) holds the rotation matrices."""
    return (R[b, k], R[b, 3 + k], R[b, 6 + k])


@inlined
def write_relative_axes(a, b, many):
    """Write `many.narrowphase.relative_axes`: the poses of blocks a and b relative to each other.

    Its rows are `AXES` (axes of b in the frame of a), `SIZES` (their absolute values), `FROM_A` and `FROM_B` (the
    vector from a to b in the frame of each).
    """
    R, mix, place = many.bodies.rotation, many.narrowphase.relative_axes, many.bodies.center
    for i in range(3):
        for j in range(3):
            c = R[a, i] * R[b, j] + R[a, 3 + i] * R[b, 3 + j] + R[a, 6 + i] * R[b, 6 + j]
            mix[AXES, i, j], mix[SIZES, i, j] = c, abs(c)
    d = subtract(row_vector(place, b, 0), row_vector(place, a, 0))
    for i in range(3):
        mix[FROM_A, 0, i] = R[a, i] * d[0] + R[a, 3 + i] * d[1] + R[a, 6 + i] * d[2]
        mix[FROM_B, 0, i] = R[b, i] * d[0] + R[b, 3 + i] * d[1] + R[b, 6 + i] * d[2]


def _never(cosine, many):
    return False


@if_given("many.even", _never)
def are_faces_parallel(cosine, many):
    """True if two faces, with this cosine of the angle between their lines of normals, are parallel.

    Slops are tiny under error control, so that of two faces that lie on each other now one and now the other would
    separate by a slop more. Contacts would change their ids each time, and lose their warm start.
    """
    return cosine >= PARALLEL_COSINE


@inlined
def max_box_face_separation(a, b, margin, many):
    """Find the face normal along which blocks a and b are farthest apart: (separation [m], face).

    Faces 0 to 2 are those across the axes of a, 3 to 5 those of b. A later face is taken only if it separates by a slop
    more, so that ties go to block a, and so do faces that are parallel (`are_faces_parallel`). The search stops at a
    face that separates by more than `margin` [m].
    """
    S, da, db = many.narrowphase.relative_axes[SIZES], many.bodies.body[a].dims, many.bodies.body[b].dims
    way_a, way_b = many.narrowphase.relative_axes[FROM_A, 0], many.narrowphase.relative_axes[FROM_B, 0]
    best, face = -math.inf, 0
    slop = pair_slop(a, b, many)
    for i in range(3):
        s = abs(way_a[i]) - (da[i] + (db[0] * S[i, 0] + db[1] * S[i, 1] + db[2] * S[i, 2]))
        if s > margin:
            return s, i
        if s > best + slop:
            best, face = s, i
    first = face
    for j in range(3):
        s = abs(way_b[j]) - (db[j] + (da[0] * S[0, j] + da[1] * S[1, j] + da[2] * S[2, j]))
        if s > margin:
            return s, 3 + j
        if s > best + slop and not are_faces_parallel(S[first, j], many):
            best, face = s, 3 + j
    return best, face


@inlined
def max_box_edge_separation(a, b, margin, many):
    """Find the edge product along which blocks a and b are farthest apart: (separation [m], 3 i + j).

    The product is that of edge direction i of a and edge direction j of b. Of equal separations the first is taken. The
    search stops at a product that separates by more than `margin` [m].
    """
    C, S, way = (
        many.narrowphase.relative_axes[AXES],
        many.narrowphase.relative_axes[SIZES],
        many.narrowphase.relative_axes[FROM_A, 0],
    )
    da, db = many.bodies.body[a].dims, many.bodies.body[b].dims
    best, edges = -math.inf, 0
    for i in range(3):
        ip, iq = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            square = 1.0 - C[i, j] * C[i, j]
            if square < PARALLEL_SINE_SQUARED:
                continue
            jp, jq = (j + 1) % 3, (j + 2) % 3
            apart = abs(way[iq] * C[ip, j] - way[ip] * C[iq, j])
            size = (da[ip] * S[iq, j] + da[iq] * S[ip, j]) + (db[jp] * S[i, jq] + db[jq] * S[i, jp])
            s = (apart - size) / math.sqrt(square)
            if s > margin:
                return s, 3 * i + j
            if s > best:
                best, edges = s, 3 * i + j
    return best, edges


@inlined
def is_face_flat_on_other(face, many):
    """True if a face of the other block is nearly parallel to `face`: the two lie flat on each other.

    `face` is numbered as in `max_box_face_separation`.
    """
    S, most = many.narrowphase.relative_axes[SIZES], 0.0
    for k in range(3):
        most = max(most, S[face, k] if face < 3 else S[k, face - 3])
    return most >= FLAT_COSINE


@inlined
def is_edge_axis_face_normal(edges, face, many):
    """True if the product of two edges is nearly the normal of `face`: the faces then lie flat on each other.

    `edges` and `face` are numbered as in `max_box_edge_separation` and `max_box_face_separation`. Product and normal
    are both taken towards the other block's centre, and must agree in sign. They do not for slender blocks that cross
    far from their centres, if `face` is opposite to the touching face.
    """
    C, i, j, way = (
        many.narrowphase.relative_axes[AXES],
        edges // 3,
        edges % 3,
        many.narrowphase.relative_axes[FROM_A, 0],
    )
    square, ip, iq = 1.0 - C[i, j] * C[i, j], (i + 1) % 3, (i + 2) % 3
    towards = way[iq] * C[ip, j] - way[ip] * C[iq, j]
    # Component of (edge i of a) x (edge j of b) along the face normal: on axis k of a it is the determinant
    # e_k · (e_i x b_j), one entry of C; on axis k of b likewise, with the transpose.
    if face < 3:
        c = 0.0 if face == i else math.copysign(C[3 - face - i, j], C[3 - face - i, j] * towards * way[face])
        if face == ip:
            c = -c
    else:
        k, towards = face - 3, towards * many.narrowphase.relative_axes[FROM_B, 0, face - 3]
        c = 0.0 if k == j else math.copysign(C[i, 3 - k - j], C[i, 3 - k - j] * towards)
        if k == (j + 2) % 3:
            c = -c
    return c > 0.0 and c * c >= FLAT_COSINE * FLAT_COSINE * square
