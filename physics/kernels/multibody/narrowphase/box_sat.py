"""The fifteen axes that can separate two blocks: three face normals of each and nine products of edges.

References
----------
S. Gottschalk, M. C. Lin, D. Manocha, *OBBTree*, SIGGRAPH 1996.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.contact_set import pair_slop, subtract

# Squared sine of the angle between two edges below which they are parallel: their product says nothing that a face
# does not. Rounding of the nine products is 1e-16; its square root would still be noise.
PARALLEL_SINE_SQUARED = 1.0e-12

# Cosine of the angle between two face normals, or between the product of two edges and a face normal, above which the
# faces count as lying flat on each other (11 degrees). One point or one edge would let them tip to and fro; the clipped
# face holds them, at the distance that the edges say.
FLAT_COSINE = 0.98

AXES, SIZES, FROM_A, FROM_B = 0, 1, 2, 3


@inlined
def body_axis(R, b, k):
    """Axis k of body b, world frame."""
    return (R[b, k], R[b, 3 + k], R[b, 6 + k])


@inlined
def write_relative_axes(a, b, many):
    """Write `many.narrowphase.relative_axes`: axes of b in a, their absolute values, vector from a to b in both."""
    R, mix, place = many.bodies.rotation, many.narrowphase.relative_axes, many.bodies.center
    for i in range(3):
        for j in range(3):
            c = R[a, i] * R[b, j] + R[a, 3 + i] * R[b, 3 + j] + R[a, 6 + i] * R[b, 6 + j]
            mix[AXES, i, j], mix[SIZES, i, j] = c, abs(c)
    d = subtract(row_vector(place, b, 0), row_vector(place, a, 0))
    for i in range(3):
        mix[FROM_A, 0, i] = R[a, i] * d[0] + R[a, 3 + i] * d[1] + R[a, 6 + i] * d[2]
        mix[FROM_B, 0, i] = R[b, i] * d[0] + R[b, 3 + i] * d[1] + R[b, 6 + i] * d[2]


@inlined
def max_box_face_separation(a, b, margin, many):
    """(separation, face) of the most separating face normal; a tie goes to the first block.

    The search stops at a face that separates by more than `margin` [m].
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
    for j in range(3):
        s = abs(way_b[j]) - (db[j] + (da[0] * S[0, j] + da[1] * S[1, j] + da[2] * S[2, j]))
        if s > margin:
            return s, 3 + j
        if s > best + slop:
            best, face = s, 3 + j
    return best, face


@inlined
def max_box_edge_separation(a, b, margin, many):
    """(separation, 3 i + j) of edges i of a and j of b that separate most; ties as `max_box_face_separation`."""
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
    """True if a face of the other block is nearly parallel to this one: the two lie flat on each other."""
    S, most = many.narrowphase.relative_axes[SIZES], 0.0
    for k in range(3):
        most = max(most, S[face, k] if face < 3 else S[k, face - 3])
    return most >= FLAT_COSINE


@inlined
def is_edge_axis_face_normal(edges, face, many):
    """True if the product of two edges is nearly a face normal: the faces then lie flat on each other.

    Both normals point towards the other block's centre. For slender blocks that cross far from their centres, the face
    that looks there may be on the far side of the touching one.
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
