"""Response of a world's bodies to impulses at its contacts, and the residual of the contact problem.

The problem and its natural-map residual are those of `physics.kernels.contact_solver.gauss_seidel`. The velocity error
u of contact k follows from the twists of its bodies a and b, without a Delassus matrix, which would be full:

    u_k = E_k ((v + ω x r)_a - (v + ω x r)_b) - target_k.

E_k is the contact frame and r are the arms. At compliant contacts γ p_n is added to the normal part
(`stepping.compliant_stage`). An impulse p of a contact changes the twists by M⁻¹ Jᵀ p.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.compliance import answer_of_spring, per_spring, plus_give, plus_give_velocity
from physics.kernels.multibody.data.contact_set import add_scaled, contact_velocity, put_vector, row_matrix
from physics.kernels.multibody.data.grain import stretched_inv_mass


@inlined
def apply_body_inv_inertia(b, a, many):
    """Product I⁻¹ a of the inverse inertia of body b and a vector a, world frame."""
    K = many.bodies.inv_inertia
    return qt.symmetric_matvec((K[b, 0], K[b, 1], K[b, 2], K[b, 3], K[b, 4], K[b, 5]), a)


@inlined
def apply_contact_impulse(k, local, t, many):
    """Change the twists t of both bodies of contact k by an impulse `local`, given in the contact frame [N s]."""
    apply_world_impulse(k, qt.transposed_matvec(row_matrix(many.contacts.frame, k), local), t, many)


@inlined
def apply_world_impulse(k, p, t, many):
    """Change the twists t of both bodies of contact k by an impulse p, given in the world frame [N s]."""
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
    """Sum of W and the mobility of body b at contact k: 1/m δ_ij + (r x e_i)·I⁻¹ (r x e_j) [1/kg].

    r is the arm of b (its first column is `first`), e_i are the axes of the contact frame, of which the last one may be
    longer than 1 (`grain`); 1/m is multiplied by its square then. W and the result are the
    upper triangle (00, 01, 02, 11, 12, 22) of a symmetric matrix.
    """
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
        W[3] + (m + qt.dot(g1, h1)), W[4] + qt.dot(g1, h2), W[5] + (stretched_inv_mass(k, m, many) + qt.dot(g2, h2)),
    )  # fmt: skip


@kernel
def assemble_contact_blocks(n, many):
    """Write the diagonal Delassus block of each of the n contacts, and apply the warm start; return the scale [m/s].

    The scale is the largest velocity error of a contact without any impulse; of a compliant one under error control, it
    is the speed with which its spring answers. The impulses of the warm start are then added to the twists.
    """
    scale = 0.0
    for k in range(n):
        u, t = contact_velocity(k, many), row_vector(many.contacts.target, k, 0)
        W = _add_mobility(k, many.contacts.bodies[k, 0], 0, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0), many)
        if many.contacts.bodies[k, 1] >= 0:
            W = _add_mobility(k, many.contacts.bodies[k, 1], 3, W, many)
        normal = answer_of_spring(k, u[0] - t[0], W[0], many)
        scale = max(scale, max(abs(normal), max(abs(u[1] - t[1]), abs(u[2] - t[2]))))
        B = many.contacts.block
        B[k, 0], B[k, 1], B[k, 2] = plus_give(k, W[0], many), W[1], W[2]
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
    """Velocity of contact k minus its target, in the contact frame: (normal, two tangents) [m/s]."""
    u, t = contact_velocity(k, many), row_vector(many.contacts.target, k, 0)
    return (plus_give_velocity(k, u[0] - t[0], many), u[1] - t[1], u[2] - t[2])


@inlined
def project_on_disk(x, y, limit):
    """Vector (x, y), shortened to the length `limit` if it is longer."""
    size = math.sqrt(x * x + y * y)
    if size > limit:
        return x * (limit / size), y * (limit / size)
    return x, y


@inlined
def natural_map_residual(p, u, normal, step, mu):
    """Natural-map residual of one contact with impulse p and velocity error u, in the contact frame [m/s].

    `normal` is the entry W_nn of the contact's Delassus block, `step` is 1/λ_max of the block's tangential part, and
    `mu` the friction coefficient. See `contact_solver.gauss_seidel`.
    """
    x, y = project_on_disk(p[1] - step * u[1], p[2] - step * u[2], mu * max(p[0], 0.0))
    dx, dy = p[1] - x, p[2] - y
    return max(abs(min(u[0], p[0] * normal)), math.sqrt(dx * dx + dy * dy) / step)


@inlined
def _normal_map(p, u, W):
    return abs(min(u, p * W))


@inlined
def contact_residual(k, many):
    """Natural-map residual of contact k at its present impulse [m/s]."""
    step = many.contacts.step[k]
    u, normal = per_spring(velocity_error(k, many), many.contacts.block[k, 0], step, many)
    return natural_map_residual(row_vector(many.contacts.impulse, k, 0), u, normal, step, many.contacts.mu[k])


@kernel
def max_contact_residual(first, last, friction, many):
    """Largest natural-map residual of the contacts `many.islands.contacts[first:last]` at their impulses [m/s].

    `friction` is None if the scene has no friction; only normal impulses count then.
    """
    worst = 0.0
    for i in range(first, last):
        k = many.islands.contacts[i]
        if friction is None:
            u, normal = per_spring(velocity_error(k, many), many.contacts.block[k, 0], many.contacts.step[k], many)
            miss = _normal_map(many.contacts.impulse[k, 0], u[0], normal)
        else:
            miss = contact_residual(k, many)
        if not miss <= worst:  # also true for NaN
            worst = miss
    return worst
