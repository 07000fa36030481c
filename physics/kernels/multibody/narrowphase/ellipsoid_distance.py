"""Separation of an ellipsoid and another convex body, by Newton's method on the direction between them.

Let a be the ellipsoid and b the other body, an ellipsoid, sphere or block. s_a and s_b are their support functions
about their centres (both symmetric), and d is the vector from the centre of b to that of a. Along a unit vector n the
bodies are apart by σ(n) = n·d - s_a(n) - s_b(n). The largest σ is their distance; if it is negative, it is the shortest
way that moves them apart. The gradient g of σ is the vector from the point of b with normal n to the point of a with
normal -n. At the maximum it is along n.

An ellipsoid with semi-axes rᵢ and rotation matrix R has s = √(nᵀDn) with D = R diag(rᵢ²) Rᵀ. Its point with normal n is
p = Dn/s, and the second derivative of s is H = (D - p pᵀ)/s. So one Newton step δ on the sphere of directions satisfies

    (H_a + H_b + σ) δ = g - (g·n) n,        δ ⟂ n, for H n = 0.

Where the bodies overlap, σ < 0 is left out of the matrix: it is small beside the radii of curvature then, and the
matrix stays positive definite.

A block has s = Σ bᵢ|nᵢ|, with half edges bᵢ. It has a kink where nᵢ = 0, and the largest σ is mostly there: on a face
two of the nᵢ are 0, on an edge one. Such an nᵢ stays 0 while the gradient is at most bᵢ. A step that would pass through
0 ends there.

Vectors are in the frame of b.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.contact_set import add_ordered_contact, add_scaled, row_matrix, subtract
from physics.kernels.state.layout import BLOCK, ELLIPSOID

# Largest number of Newton steps; five are usual if the start is the direction between the centres.
_NEWTON_STEPS = 40

# Turn of a Newton step below which the direction has converged [rad]. The error of σ is of its square.
_DIRECTION_TOLERANCE = 1.0e-10

# Largest number of halvings of a step that does not increase σ.
_STEP_HALVINGS = 12


@inlined
def ellipsoid_matrix(C, dims):
    """Matrix D = C diag(dims²) Cᵀ of an ellipsoid with semi-axes `dims` [m], as (00, 01, 02, 11, 12, 22).

    C is the rotation matrix from the ellipsoid's frame to the frame of the result.
    """
    a, b, c = dims[0] * dims[0], dims[1] * dims[1], dims[2] * dims[2]
    return (
        a * C[0] * C[0] + b * C[1] * C[1] + c * C[2] * C[2],
        a * C[0] * C[3] + b * C[1] * C[4] + c * C[2] * C[5],
        a * C[0] * C[6] + b * C[1] * C[7] + c * C[2] * C[8],
        a * C[3] * C[3] + b * C[4] * C[4] + c * C[5] * C[5],
        a * C[3] * C[6] + b * C[4] * C[7] + c * C[5] * C[8],
        a * C[6] * C[6] + b * C[7] * C[7] + c * C[8] * C[8],
    )


@inlined
def ellipsoid_support_point(D, n):
    """Support function and point of an ellipsoid for the unit vector n: (s(n) [m], point with outward normal n).

    D is the ellipsoid's matrix (`ellipsoid_matrix`). The point is relative to the centre.
    """
    x = D[0] * n[0] + D[1] * n[1] + D[2] * n[2]
    y = D[1] * n[0] + D[3] * n[1] + D[4] * n[2]
    z = D[2] * n[0] + D[4] * n[1] + D[5] * n[2]
    s = math.sqrt(n[0] * x + n[1] * y + n[2] * z)
    return s, (x / s, y / s, z / s)


@inlined
def support_hessian(D, s, p):
    """Second derivative of an ellipsoid's support function, as (00, 01, 02, 11, 12, 22).

    D is the ellipsoid's matrix; (s, p) are the results of `ellipsoid_support_point`.
    """
    return (
        (D[0] - p[0] * p[0]) / s, (D[1] - p[0] * p[1]) / s, (D[2] - p[0] * p[2]) / s,
        (D[3] - p[1] * p[1]) / s, (D[4] - p[1] * p[2]) / s, (D[5] - p[2] * p[2]) / s,
    )  # fmt: skip


@inlined
def support_separation(A, is_block, B, dims, d, n):
    """Separation σ(n) of an ellipsoid with matrix A from body b, along the unit vector n out of b [m].

    If `is_block`, body b is a block with half edges `dims`, else an ellipsoid with matrix B. d is the vector from the
    centre of b to that of the ellipsoid.
    """
    s, _ = ellipsoid_support_point(A, n)
    if is_block:
        return qt.dot(n, d) - s - (dims[0] * abs(n[0]) + dims[1] * abs(n[1]) + dims[2] * abs(n[2]))
    r, _ = ellipsoid_support_point(B, n)
    return qt.dot(n, d) - s - r


@inlined
def _reduced_gradient(free, size):
    """Gradient of σ in a component nᵢ = 0, at a kink of a block with half edge `size` across it.

    `free` is the gradient without the block's term. The result is 0 if n should stay at the kink.
    """
    return free - math.copysign(size, free) if abs(free) > size else 0.0


@inlined
def _step_to_kink(x, dx, t):
    """Share of a Newton step at which component x of the direction reaches 0; t if it does not do so before t.

    The whole step changes the component by dx.
    """
    return min(t, -x / dx) if x * (x + t * dx) < 0.0 else t


@inlined
def _step_component(x, dx, t, at_kink):
    """Component x of the direction after the share t of a step dx; exactly 0 if `at_kink` and the step reaches 0."""
    return 0.0 if at_kink and x * dx < 0.0 and -x / dx <= t else x + t * dx


@inlined
def _unit(x, y, z):
    s = 1.0 / math.sqrt(x * x + y * y + z * z)
    return (s * x, s * y, s * z)


@inlined
def newton_direction(H, g, n, k0, k1, k2):
    """Solve (H + tr(H) n nᵀ) δ = g for δ, in the components i with kᵢ = 1; the others are 0.

    H is symmetric, as (00, 01, 02, 11, 12, 22), and g ⟂ n. The term with n makes the matrix regular.
    """
    t = H[0] + H[3] + H[5]
    a = k0 * (H[0] + t * n[0] * n[0]) + (1.0 - k0)
    b = k0 * k1 * (H[1] + t * n[0] * n[1])
    c = k0 * k2 * (H[2] + t * n[0] * n[2])
    e = k1 * (H[3] + t * n[1] * n[1]) + (1.0 - k1)
    f = k1 * k2 * (H[4] + t * n[1] * n[2])
    h = k2 * (H[5] + t * n[2] * n[2]) + (1.0 - k2)
    c00, c01, c02 = e * h - f * f, c * f - b * h, b * f - c * e
    s = 1.0 / (a * c00 + b * c01 + c * c02)
    c11, c12, c22 = a * h - c * c, b * c - a * f, a * e - b * b
    return (
        s * (c00 * g[0] + c01 * g[1] + c02 * g[2]),
        s * (c01 * g[0] + c11 * g[1] + c12 * g[2]),
        s * (c02 * g[0] + c12 * g[1] + c22 * g[2]),
    )


@inlined
def _search_along(A, is_block, B, dims, d, n, e, best):
    """Search from direction n along the step e for a separation above `best`: (found, direction, its separation).

    The step is halved until it succeeds, `_STEP_HALVINGS` times at most. For A, B, `is_block`, `dims` and d see
    `support_separation`.
    """
    t = 1.0
    if is_block:
        t = _step_to_kink(n[0], e[0], _step_to_kink(n[1], e[1], _step_to_kink(n[2], e[2], t)))
    for trial in range(_STEP_HALVINGS):
        at_kink = is_block and trial == 0
        m = _unit(
            _step_component(n[0], e[0], t, at_kink),
            _step_component(n[1], e[1], t, at_kink),
            _step_component(n[2], e[2], t, at_kink),
        )
        value = support_separation(A, is_block, B, dims, d, m)
        if value > best:
            return True, m, value
        t *= 0.5
    return False, n, best


@kernel
def max_separation_direction(A, is_block, B, dims, d, n):
    """Maximise the separation σ of an ellipsoid a and body b: (unit vector out of b, σ along it [m]).

    Parameters
    ----------
    A : tuple of 6 floats
        `ellipsoid_matrix` of a in the frame of b.
    is_block : bool
        True if b is a block with half edges `dims`, False if it is an ellipsoid.
    B : tuple of 6 floats
        `ellipsoid_matrix` of b in its frame; not read if b is a block.
    dims : tuple of 3 floats
        Half edges of b [m]; read only if b is a block.
    d : tuple of 3 floats
        From the centre of b to that of a, in the frame of b [m].
    n : tuple of 3 floats
        Unit vector to start from, out of b.
    """
    best = support_separation(A, is_block, B, dims, d, n)
    for _ in range(_NEWTON_STEPS):
        s, p = ellipsoid_support_point(A, n)
        H = support_hessian(A, s, p)
        g = (d[0] - p[0], d[1] - p[1], d[2] - p[2])
        k0 = k1 = k2 = 1.0
        if is_block:
            g = (
                g[0] - math.copysign(dims[0], n[0]) if n[0] != 0.0 else _reduced_gradient(g[0], dims[0]),
                g[1] - math.copysign(dims[1], n[1]) if n[1] != 0.0 else _reduced_gradient(g[1], dims[1]),
                g[2] - math.copysign(dims[2], n[2]) if n[2] != 0.0 else _reduced_gradient(g[2], dims[2]),
            )
            k0 = 0.0 if n[0] == 0.0 and g[0] == 0.0 else 1.0
            k1 = 0.0 if n[1] == 0.0 and g[1] == 0.0 else 1.0
            k2 = 0.0 if n[2] == 0.0 and g[2] == 0.0 else 1.0
        else:
            r, q = ellipsoid_support_point(B, n)
            g = (g[0] - q[0], g[1] - q[1], g[2] - q[2])
            K = support_hessian(B, r, q)
            H = (H[0] + K[0], H[1] + K[1], H[2] + K[2], H[3] + K[3], H[4] + K[4], H[5] + K[5])
        apart, along = max(best, 0.0), qt.dot(g, n)
        H = (H[0] + apart, H[1], H[2], H[3] + apart, H[4], H[5] + apart)
        g = (k0 * (g[0] - along * n[0]), k1 * (g[1] - along * n[1]), k2 * (g[2] - along * n[2]))
        e = newton_direction(H, g, n, k0, k1, k2)
        if is_block:  # at a kink the step must go to the side for which the gradient was taken; else n stays there
            k0 = 0.0 if n[0] == 0.0 and e[0] * g[0] < 0.0 else k0
            k1 = 0.0 if n[1] == 0.0 and e[1] * g[1] < 0.0 else k1
            k2 = 0.0 if n[2] == 0.0 and e[2] * g[2] < 0.0 else k2
            g = (k0 * g[0], k1 * g[1], k2 * g[2])
            e = newton_direction(H, g, n, k0, k1, k2)
        if not max(abs(e[0]), abs(e[1]), abs(e[2])) > _DIRECTION_TOLERANCE:
            break
        found, n, best = _search_along(A, is_block, B, dims, d, n, e, best)
        if not found:
            break
    return n, best


@inlined
def center_direction(d):
    """Unit vector along d, which points from the centre of b to the centre of a; (0, 1, 0) if the centres coincide."""
    size = math.sqrt(qt.dot(d, d))
    if size > 0.0:
        return (d[0] / size, d[1] / size, d[2] / size)
    return (0.0, 1.0, 0.0)


@inlined
def block_support_point(dims, n, near):
    """Point with outward normal n of a block with half edges `dims`, in its frame [m].

    If the normal is that of an edge or face, it is the point there that is nearest to the point `near`.
    """
    return (
        math.copysign(dims[0], n[0]) if n[0] != 0.0 else min(max(near[0], -dims[0]), dims[0]),
        math.copysign(dims[1], n[1]) if n[1] != 0.0 else min(max(near[1], -dims[1]), dims[1]),
        math.copysign(dims[2], n[2]) if n[2] != 0.0 else min(max(near[2], -dims[2]), dims[2]),
    )


@inlined
def nearest_on_block(p, d):
    """Find the point of a block's surface nearest to a point p: (point, outward unit normal, distance [m]).

    d are the block's half edges, and all vectors are in its frame. The distance is negative for p inside.
    """
    q = (min(max(p[0], -d[0]), d[0]), min(max(p[1], -d[1]), d[1]), min(max(p[2], -d[2]), d[2]))
    w = subtract(p, q)
    size = math.sqrt(qt.dot(w, w))
    if size > 0.0:
        return q, (w[0] / size, w[1] / size, w[2] / size), size
    depth = (abs(p[0]) - d[0], abs(p[1]) - d[1], abs(p[2]) - d[2])  # inside: out by the nearest face
    if depth[0] >= depth[1] and depth[0] >= depth[2]:
        s = math.copysign(1.0, p[0])
        return (s * d[0], p[1], p[2]), (s, 0.0, 0.0), depth[0]
    if depth[1] >= depth[2]:
        s = math.copysign(1.0, p[1])
        return (p[0], s * d[1], p[2]), (0.0, s, 0.0), depth[1]
    s = math.copysign(1.0, p[2])
    return (p[0], p[1], s * d[2]), (0.0, 0.0, s), depth[2]


@inlined
def relative_rotation(R, S):
    """Rotation matrix Rᵀ S from the frame of S to that of R, for rotation matrices R and S to the world frame."""
    x = qt.transposed_matvec(R, (S[0], S[3], S[6]))
    y = qt.transposed_matvec(R, (S[1], S[4], S[7]))
    z = qt.transposed_matvec(R, (S[2], S[5], S[8]))
    return (x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2])


@kernel
def collide_ellipsoid(a, b, margin, h, many):
    """Add the contact of an ellipsoid and an ellipsoid, sphere or block if their gap is at most `margin` [m].

    a and b are the two bodies in either order; h is the length of the stage [s].
    """
    first, second = a, b
    if many.bodies.body[a].shape != ELLIPSOID:
        first, second = b, a
    R, size, d = (
        row_matrix(many.bodies.rotation, second),
        many.bodies.body[second].dims,
        many.bodies.body[first].dims,
    )
    x, dims = row_vector(many.bodies.center, second, 0), (size[0], size[1], size[2])
    way = qt.transposed_matvec(R, subtract(row_vector(many.bodies.center, first, 0), x))
    A = ellipsoid_matrix(relative_rotation(R, row_matrix(many.bodies.rotation, first)), (d[0], d[1], d[2]))
    B = (size[0] * size[0], 0.0, 0.0, size[1] * size[1], 0.0, size[2] * size[2])
    is_block = many.bodies.body[second].shape == BLOCK
    start = nearest_on_block(way, dims)[1] if is_block else center_direction(way)
    n, gap = max_separation_direction(A, is_block, B, dims, way, start)
    if gap > margin:
        return
    on_first = subtract(way, ellipsoid_support_point(A, n)[1])
    on_second = block_support_point(dims, n, on_first) if is_block else ellipsoid_support_point(B, n)[1]
    n, on_first, on_second = (
        qt.matvec(R, n),
        add_scaled(x, 1.0, qt.matvec(R, on_first)),
        add_scaled(x, 1.0, qt.matvec(R, on_second)),
    )
    add_ordered_contact(a, b, first, n, on_first, on_second, gap, h, many)
