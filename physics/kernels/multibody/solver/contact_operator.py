"""Response of a world's bodies to impulses at its contacts, and the residual of the contact problem.

The problem and its natural-map residual are those of `physics.kernels.contact_solver.gauss_seidel`; here u is not kept
per contact through a matrix W, which would be full, but follows from the twists of the bodies,

    u_k = E_k ((v + ω x r)_a - (v + ω x r)_b) - target_k,

which an impulse of contact k changes by M⁻¹ Jᵀ.
"""

from __future__ import annotations

import math

from physics.kernels.compile.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.multibody.data.contact_set import local_velocity, matrix, plus, put, vector


@inlined
def turned(b, a, many):
    """I⁻¹ a of body b, world frame."""
    K = many.turning
    return qt.symmetric_matvec((K[b, 0], K[b, 1], K[b, 2], K[b, 3], K[b, 4], K[b, 5]), a)


@inlined
def push(k, local, t, many):
    """Change the twists t of both bodies by an impulse of contact k, given in its frame [N s]."""
    push_along(k, qt.transposed_matvec(matrix(many.frame, k), local), t, many)


@inlined
def push_along(k, p, t, many):
    """The same for an impulse in the world frame."""
    a, b = many.ends[k, 0], many.ends[k, 1]
    put(t, a, 0, plus(vector(t, a, 0), many.lightness[a], p))
    put(t, a, 3, plus(vector(t, a, 3), 1.0, turned(a, qt.cross(vector(many.arm, k, 0), p), many)))
    if b >= 0:
        put(t, b, 0, plus(vector(t, b, 0), -many.lightness[b], p))
        put(t, b, 3, plus(vector(t, b, 3), -1.0, turned(b, qt.cross(vector(many.arm, k, 3), p), many)))


@inlined
def _add_block(k, b, first, W, many):
    """W plus what one end adds to the contact's own block: 1/m + (r x e_i)·I⁻¹ (r x e_j); upper triangle."""
    r, E = vector(many.arm, k, first), many.frame
    g0, g1, g2 = qt.cross(r, vector(E, k, 0)), qt.cross(r, vector(E, k, 3)), qt.cross(r, vector(E, k, 6))
    h0, h1, h2 = turned(b, g0, many), turned(b, g1, many), turned(b, g2, many)
    m = many.lightness[b]
    return (
        W[0] + (m + qt.dot(g0, h0)), W[1] + qt.dot(g0, h1), W[2] + qt.dot(g0, h2),
        W[3] + (m + qt.dot(g1, h1)), W[4] + qt.dot(g1, h2), W[5] + (m + qt.dot(g2, h2)),
    )  # fmt: skip


@kernel
def assemble(n, many):
    """Write every contact's own block; the twists hold the warm start's impulses afterwards. Returns the scale.

    The scale is the largest velocity that a contact would have without any impulse [m/s].
    """
    scale = 0.0
    for k in range(n):
        u, t = local_velocity(k, many), vector(many.target, k, 0)
        scale = max(scale, max(abs(u[0] - t[0]), max(abs(u[1] - t[1]), abs(u[2] - t[2]))))
        W = _add_block(k, many.ends[k, 0], 0, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0), many)
        if many.ends[k, 1] >= 0:
            W = _add_block(k, many.ends[k, 1], 3, W, many)
        B = many.block
        B[k, 0], B[k, 1], B[k, 2] = W[0], W[1], W[2]
        B[k, 3], B[k, 4], B[k, 5] = W[1], W[3], W[4]
        B[k, 6], B[k, 7], B[k, 8] = W[2], W[4], W[5]
        half = 0.5 * (W[3] - W[5])
        many.step[k] = 1.0 / (0.5 * (W[3] + W[5]) + math.sqrt(half * half + W[4] * W[4]))
        many.queue[k] = k
    for k in range(n):
        push(k, vector(many.impulse, k, 0), many.twist, many)
    return scale


@inlined
def velocity_missed(k, many):
    """u of contact k less its target."""
    u, t = local_velocity(k, many), vector(many.target, k, 0)
    return (u[0] - t[0], u[1] - t[1], u[2] - t[2])


@inlined
def on_disk(x, y, limit):
    """(x, y), shortened to `limit` if it is longer."""
    size = math.sqrt(x * x + y * y)
    if size > limit:
        return x * (limit / size), y * (limit / size)
    return x, y


@inlined
def natural_map(p, u, normal, step, mu):
    """Natural-map residual of one contact [m/s] (`contact_solver.gauss_seidel`); `normal` is W_nn, `step` 1/λ_max."""
    x, y = on_disk(p[1] - step * u[1], p[2] - step * u[2], mu * max(p[0], 0.0))
    dx, dy = p[1] - x, p[2] - y
    return max(abs(min(u[0], p[0] * normal)), math.sqrt(dx * dx + dy * dy) / step)


@inlined
def _normal_map(p, u, W):
    return abs(min(u, p * W))


@inlined
def miss_of(k, many):
    """Natural-map residual of contact k, its impulse as it is [m/s]."""
    return natural_map(vector(many.impulse, k, 0), velocity_missed(k, many), many.block[k, 0], many.step[k], many.mu[k])


@kernel
def residual_of(first, last, friction, many):
    """Largest natural-map residual of the contacts `many.queue[first:last]`, their impulses as they are [m/s]."""
    worst = 0.0
    for i in range(first, last):
        k = many.queue[i]
        if friction is None:
            miss = _normal_map(many.impulse[k, 0], velocity_missed(k, many)[0], many.block[k, 0])
        else:
            miss = miss_of(k, many)
        if not miss <= worst:  # also what is not a number
            worst = miss
    return worst
