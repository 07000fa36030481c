"""Friction with two coefficients μ1, μ2 along the tangents of a wall: isotropic friction in stretched tangents.

The tangential forces f that such a wall can exert on a contact, with the normal force f_n, fill an ellipse. Of these
forces it exerts the one that dissipates most at the tangential velocity u:

    (f1/μ1)² + (f2/μ2)² <= f_n²,      f·u least:      f = -(μ1² u1, μ2² u2) f_n / sqrt(μ1² u1² + μ2² u2²).

Let k = μ2/μ1, S = diag(1, k), f = S g and u' = S u. Then the power is g·u', and the ellipse is the circle
|g| <= μ1 f_n. So g and u' obey the isotropic law with the coefficient μ1. A contact problem u = W p + b whose Jacobian
J has the tangent rows S J is an isotropic one: W' = S W S, b' = S b, p = S p'.

The direct solvers (`sliding_patch`) have no rows. They use velocity v, angular velocity ω, arm r = (c, a, b) and
inverse inertia K in the frame (normal, tangents) of the wall. A body whose tangent velocities are stretched is again a
rigid body: with S = diag(1, 1, k) and (S a) x (S b) = cof(S) (a x b), u' = v' + ω' x r' for

    v' = S v,    ω' = S⁻¹ ω,    r' = cof(S) r = (k c, k a, b),    K' = S⁻¹ K S⁻¹,    M'⁻¹ = S M⁻¹ S.

So the direct solvers take these numbers instead. Only the inverse mass along tangent 2 differs, by the factor k².

References
----------
S. Goyal, A. Ruina, J. Papadopoulos, *Planar sliding with dry friction, part 1*, Wear 143, 1991, for forces of greatest
dissipation.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined
from physics.kernels.math import quaternion as qt
from physics.kernels.state.contact_law_dispatch import LAW_ANISOTROPY, if_law, law_parameter

# Kernel (body) that returns k = μ2/μ1; it is the literal 1 where the law is not declared, which the compiler drops.
friction_ratio = law_parameter(LAW_ANISOTROPY, 1.0)


@inlined
def stretched_frame(K, u, w, k):
    """Stretch the motion of a body along tangent 2 of a wall by the factor k: return stretched (K, u, w).

    K is the inverse inertia (00, 01, 02, 11, 12, 22), u the velocity and w the angular velocity, all in the frame
    (normal, tangent 1, tangent 2) of the wall.
    """
    s = 1.0 / k
    return (
        (K[0], K[1], s * K[2], K[3], s * K[4], s * (s * K[5])),
        (u[0], u[1], k * u[2]),
        (w[0], w[1], s * w[2]),
    )


def _as_assembled(n, scratch):
    return None


@if_law((LAW_ANISOTROPY,), _as_assembled)
def stretch_tangents(n, scratch):
    """Stretch tangent 2 of all n contacts in the contact problem assembled in `scratch.contacts`, with its impulses."""
    contacts = scratch.contacts
    k = friction_ratio(scratch.body)
    for i in range(n):
        r = 3 * i + 2
        for c in range(3):
            contacts.frame[r, c] *= k
            contacts.angular[r, c] *= k
            contacts.response[r, c] *= k
        contacts.bias[r] *= k
        contacts.impulse[r] /= k
        for s in range(3 * n):
            contacts.delassus[r, s] *= k
            contacts.delassus[s, r] *= k


@if_law((LAW_ANISOTROPY,), _as_assembled)
def unstretch_tangents(n, scratch):
    """Convert the impulses of n contacts in `scratch.contacts` from stretched tangents back to unit tangents."""
    k = friction_ratio(scratch.body)
    for i in range(n):
        scratch.contacts.impulse[3 * i + 2] *= k


def _as_it_is(vector, axes, body):
    return vector


@if_law((LAW_ANISOTROPY,), _as_it_is)
def unstretch_force(f, axes, body):
    """Divide the component of a contact force f along tangent 2 by μ2/μ1, so that friction is isotropic, with μ1.

    `axes` are normal and tangents of the wall; f and the result are in the world frame.
    """
    k = friction_ratio(body)
    s = (1.0 / k - 1.0) * qt.dot(axes[2], f)
    return f[0] + s * axes[2][0], f[1] + s * axes[2][1], f[2] + s * axes[2][2]


@if_law((LAW_ANISOTROPY,), _as_it_is)
def sliding_direction(d, axes, body):
    """Vector e that gives the friction force -μ1 f_n e of a contact that slides along the unit vector d.

    e = S² d/|S d|, where S multiplies the component along tangent 2 by μ2/μ1. `axes` are normal and tangents of the
    wall; d and e are in the world frame. If both coefficients are equal, e = d.
    """
    k = friction_ratio(body)
    a, b = qt.dot(axes[1], d), k * qt.dot(axes[2], d)
    size = math.sqrt(a * a + b * b)
    if not size > 0.0:
        return d
    a, b = a / size, k * b / size
    return (
        a * axes[1][0] + b * axes[2][0], a * axes[1][1] + b * axes[2][1], a * axes[1][2] + b * axes[2][2]
    )  # fmt: skip
