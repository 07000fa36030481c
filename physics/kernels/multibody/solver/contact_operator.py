"""Response of a world's bodies to impulses at its contacts, and the residual of the contact problem.

The problem and its natural-map residual are those of `physics.kernels.contact_solver.gauss_seidel`; here u is not kept
per contact through a matrix W, which would be full, but follows from the twists of the bodies,

    u_k = E_k ((v + ω x r)_a - (v + ω x r)_b) - target_k,

which an impulse of contact k changes by M⁻¹ Jᵀ.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.contact_set import add_scaled, contact_velocity, put_vector, row_matrix


@inlined
def apply_body_inv_inertia(b, a, many):
    """I⁻¹ a of body b, world frame."""
    K = many.bodies.inv_inertia
    return qt.symmetric_matvec((K[b, 0], K[b, 1], K[b, 2], K[b, 3], K[b, 4], K[b, 5]), a)


@inlined
def apply_contact_impulse(k, local, t, many):
    """Change the twists t of both bodies by an impulse of contact k, given in its frame [N s]."""
    apply_world_impulse(k, qt.transposed_matvec(row_matrix(many.contacts.frame, k), local), t, many)


@inlined
def apply_world_impulse(k, p, t, many):
    """Change the twists t of both bodies by an impulse of contact k, given in the world frame [N s]."""
    a, b = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1]
    put_vector(t, a, 0, add_scaled(row_vector(t, a, 0), many.bodies.inv_mass[a], p))
    put_vector(
        t,
        a,
        3,
        add_scaled(
            row_vector(t, a, 3), 1.0, apply_body_inv_inertia(a, qt.cross(row_vector(many.contacts.arm, k, 0), p), many)
        ),
    )
    if b >= 0:
        put_vector(t, b, 0, add_scaled(row_vector(t, b, 0), -many.bodies.inv_mass[b], p))
        put_vector(
            t,
            b,
            3,
            add_scaled(
                row_vector(t, b, 3),
                -1.0,
                apply_body_inv_inertia(b, qt.cross(row_vector(many.contacts.arm, k, 3), p), many),
            ),
        )


@inlined
def _add_mobility(k, b, first, W, many):
    """Block W plus the mobility of one end: 1/m + (r x e_i)·I⁻¹ (r x e_j); upper triangle."""
    r, E = row_vector(many.contacts.arm, k, first), many.contacts.frame
    g0, g1, g2 = qt.cross(r, row_vector(E, k, 0)), qt.cross(r, row_vector(E, k, 3)), qt.cross(r, row_vector(E, k, 6))
    h0, h1, h2 = (
        apply_body_inv_inertia(b, g0, many),
        apply_body_inv_inertia(b, g1, many),
        apply_body_inv_inertia(b, g2, many),
    )
    m = many.bodies.inv_mass[b]
    return (
        W[0] + (m + qt.dot(g0, h0)), W[1] + qt.dot(g0, h1), W[2] + qt.dot(g0, h2),
        W[3] + (m + qt.dot(g1, h1)), W[4] + qt.dot(g1, h2), W[5] + (m + qt.dot(g2, h2)),
    )  # fmt: skip


@kernel
def assemble_contact_blocks(n, many):
    """Write every contact's own block; return the scale. The twists then include the warm start's impulses.

    The scale is the largest velocity that a contact would have without any impulse [m/s].
    """
    scale = 0.0
    for k in range(n):
        u, t = contact_velocity(k, many), row_vector(many.contacts.target, k, 0)
        scale = max(scale, max(abs(u[0] - t[0]), max(abs(u[1] - t[1]), abs(u[2] - t[2]))))
        W = _add_mobility(k, many.contacts.bodies[k, 0], 0, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0), many)
        if many.contacts.bodies[k, 1] >= 0:
            W = _add_mobility(k, many.contacts.bodies[k, 1], 3, W, many)
        B = many.contacts.block
        B[k, 0], B[k, 1], B[k, 2] = W[0], W[1], W[2]
        B[k, 3], B[k, 4], B[k, 5] = W[1], W[3], W[4]
        B[k, 6], B[k, 7], B[k, 8] = W[2], W[4], W[5]
        half = 0.5 * (W[3] - W[5])
        many.contacts.step[k] = 1.0 / (0.5 * (W[3] + W[5]) + math.sqrt(half * half + W[4] * W[4]))
        many.islands.contacts[k] = k
    for k in range(n):
        apply_contact_impulse(k, row_vector(many.contacts.impulse, k, 0), many.bodies.twist, many)
    return scale


@inlined
def velocity_error(k, many):
    """Velocity u of contact k minus its target."""
    u, t = contact_velocity(k, many), row_vector(many.contacts.target, k, 0)
    return (u[0] - t[0], u[1] - t[1], u[2] - t[2])


@inlined
def project_on_disk(x, y, limit):
    """Vector (x, y), shortened to `limit` if it is longer."""
    size = math.sqrt(x * x + y * y)
    if size > limit:
        return x * (limit / size), y * (limit / size)
    return x, y


@inlined
def natural_map_residual(p, u, normal, step, mu):
    """Natural-map residual of one contact [m/s] (`contact_solver.gauss_seidel`); `normal` is W_nn, `step` 1/λ_max."""
    x, y = project_on_disk(p[1] - step * u[1], p[2] - step * u[2], mu * max(p[0], 0.0))
    dx, dy = p[1] - x, p[2] - y
    return max(abs(min(u[0], p[0] * normal)), math.sqrt(dx * dx + dy * dy) / step)


@inlined
def _normal_map(p, u, W):
    return abs(min(u, p * W))


@inlined
def contact_residual(k, many):
    """Natural-map residual of contact k at its present impulse [m/s]."""
    return natural_map_residual(
        row_vector(many.contacts.impulse, k, 0),
        velocity_error(k, many),
        many.contacts.block[k, 0],
        many.contacts.step[k],
        many.contacts.mu[k],
    )


@kernel
def max_contact_residual(first, last, friction, many):
    """Largest natural-map residual of the contacts `many.islands.contacts[first:last]` at their impulses [m/s]."""
    worst = 0.0
    for i in range(first, last):
        k = many.islands.contacts[i]
        if friction is None:
            miss = _normal_map(many.contacts.impulse[k, 0], velocity_error(k, many)[0], many.contacts.block[k, 0])
        else:
            miss = contact_residual(k, many)
        if not miss <= worst:  # also what is not a number
            worst = miss
    return worst
