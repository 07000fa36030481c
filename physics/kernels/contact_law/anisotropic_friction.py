"""Friction with two coefficients along a wall: Coulomb's circle in stretched tangents.

The tangential forces that a surface with coefficients μ1, μ2 along its tangents can exert fill an ellipse, and of these
it exerts the one that dissipates most:

    (f1/μ1)² + (f2/μ2)² <= f_n²,      f·u least:      f = -(μ1² u1, μ2² u2) f_n / sqrt(μ1² u1² + μ2² u2²).

With k = μ2/μ1, S = diag(1, k), f = S g and u' = S u the power is g·u', and the ellipse the circle |g| <= μ1 f_n. So g
and u' obey the isotropic law with the one coefficient μ1, and a contact problem with the rows S J of the tangents is an
isotropic one: W' = S W S, b' = S b, p = S p'.

A body whose tangent velocities are stretched moves like a rigid one again. By (S a) x (S b) = cof(S) (a x b), now with
S = diag(1, 1, k) in the frame (normal, tangents) of a wall, u' = v' + ω' x r' with

    v' = S v,    ω' = S⁻¹ ω,    r' = cof(S) r = (k c, k a, b),    K' = S⁻¹ K S⁻¹,    M'⁻¹ = S M⁻¹ S,

so that the direct solves (`sliding_patch`) take these for u, ω, r, K; the inverse mass along tangent 2 alone differs,
by k².

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

# k = μ2/μ1 of the body in the workspace; the literal 1 where it is not declared, which the compiler multiplies out.
friction_ratio = law_parameter(LAW_ANISOTROPY, 1.0)


@inlined
def stretched_frame(K, u, w, k):
    """Inverse inertia (00, 01, 02, 11, 12, 22), velocity and angular velocity in the stretched frame of a wall."""
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
    """Stretch the rows of tangent 2 in the contact problem assembled in `scratch`, and its impulses with them."""
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
    """The impulses along the unit tangents again."""
    k = friction_ratio(scratch.body)
    for i in range(n):
        scratch.contacts.impulse[3 * i + 2] *= k


def _as_it_is(vector, axes, body):
    return vector


@if_law((LAW_ANISOTROPY,), _as_it_is)
def unstretch_force(f, axes, body):
    """S⁻¹ f of a force f, whose size along the wall is then compared with μ1 times the push; `axes` are the wall's."""
    k = friction_ratio(body)
    s = (1.0 / k - 1.0) * qt.dot(axes[2], f)
    return f[0] + s * axes[2][0], f[1] + s * axes[2][1], f[2] + s * axes[2][2]


@if_law((LAW_ANISOTROPY,), _as_it_is)
def sliding_direction(d, axes, body):
    """Vector S² d/|S d| for sliding along the unit vector d: friction is -μ1 f_n times it; d on an even wall."""
    k = friction_ratio(body)
    a, b = qt.dot(axes[1], d), k * qt.dot(axes[2], d)
    size = math.sqrt(a * a + b * b)
    if not size > 0.0:
        return d
    a, b = a / size, k * b / size
    return (
        a * axes[1][0] + b * axes[2][0], a * axes[1][1] + b * axes[2][1], a * axes[1][2] + b * axes[2][2]
    )  # fmt: skip
