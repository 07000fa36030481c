"""Start of a patch's solve: the impulses of the last stage, or a guess where they belong to other loads."""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined
from physics.compiler.simd import lane_sum, max_of_lanes, select_lanes
from physics.kernels.contact_law.anisotropic_friction import friction_ratio
from physics.kernels.contact_solver.one_contact import is_warm_start_valid
from physics.kernels.contact_solver.patch import patch_coordinates_along
from physics.kernels.math import quaternion as qt
from physics.kernels.math.simd_gather import gather_component, valid_lanes_mask

# Share of its free slip that a face which nearly holds starts with.
_MIN_SLIP_SHARE = 0.01


@inlined
def warm_start_motion(n, patch, on, body, scratch):
    """Planar motion after the warm-start impulses in `scratch`, and whether these belong to the present loads."""
    contacts = scratch.contacts
    c, a, b = patch.points
    u, w, K, inv_mass, ratio = body.u, body.w, body.K, body.inv_mass, friction_ratio(scratch.body)
    p, x = on * gather_component(contacts.impulse, 0, n), on * gather_component(contacts.impulse, 1, n)
    y = on * gather_component(contacts.impulse, 2, n) / ratio
    spin = K[0] * (a * y - b * x) + K[1] * (b * p - c * y) + K[2] * (c * x - a * p)
    motion = u[1] + inv_mass * lane_sum(x), u[2] + ratio * ratio * inv_mass * lane_sum(y), w[0] + lane_sum(spin)
    return motion, is_warm_start_valid(inv_mass * lane_sum(p), -u[0])


@inlined
def warm_start_friction(n, on, scratch):
    """Impulses per normal impulse along the tangents (two lanes) of those in `scratch`; 0 where nothing pushes."""
    contacts = scratch.contacts
    p = on * gather_component(contacts.impulse, 0, n)
    s = select_lanes(p > 0.0, 1.0 / p, 0.0)
    x, y = gather_component(contacts.impulse, 1, n), gather_component(contacts.impulse, 2, n)
    return s * x, s * y / friction_ratio(scratch.body)


@inlined
def _centroid_and_variance(n, a, b, on):
    """Centroid of the contacts along the tangents, and mean square of their distances from it."""
    share = 1.0 / n
    ca, cb = share * lane_sum(on * a), share * lane_sum(on * b)
    a, b = on * (a - ca), on * (b - cb)
    return ca, cb, share * (lane_sum(a * a) + lane_sum(b * b))


@inlined
def may_stick(n, axes, v, L, scratch):
    """True if friction may stop a face with the velocity v and angular momentum L before friction.

    A sticking face stops at its wall. The pushes P remove the normal momentum, and friction, at most μP, the tangential
    one. Its moment about the centroid is at most μ Σ p_i |d_i| <= μP max |d_i|. So the result is True for every face
    that can stick. A face that slips within the tolerance of a solve would be taken for sticking, and creep.
    """
    body = scratch.body
    ratio, friction = friction_ratio(body), body.mu * qt.dot(axes[0], v)
    va, vb, limit = qt.dot(axes[1], v), qt.dot(axes[2], v) / ratio, friction * friction
    spin, slip = qt.dot(axes[0], L) / body.mass, va * va + vb * vb
    if slip > limit or (slip == 0.0 and spin == 0.0):
        return slip <= limit
    a, b = (
        ratio * patch_coordinates_along(axes[1], n, scratch.contacts),
        patch_coordinates_along(axes[2], n, scratch.contacts),
    )
    ca, cb, _ = _centroid_and_variance(n, a, b, valid_lanes_mask(n))
    moment = ca * vb - cb * va - spin
    a, b = a - ca, b - cb
    return moment * moment <= max_of_lanes(a * a + b * b) * limit


@inlined
def cold_start_motion(n, patch, on, mu, body):
    """Planar motion after friction, if planar friction is that of an ellipsoid, from the motion without impulses.

    The forces and moments about the centroid that equal pushes, P in all, can exert while a face slides are nearly an
    ellipsoid, (|f|/μP)² + (T/μPρ)² <= 1, and the slip is along its normal, (v, ρ² ω) (Goyal et al. 1991; Howe and
    Cutkosky 1996). With ρ² = Σ|d_i|²/n, β = μP/m, γ = μPρ²/I and the slip's size s, s² = v² + ρ²ω²,

        v = v₀ s/(s + β),   ω = ω₀ s/(s + γ),   φ(s)² = v₀²/(s + β)² + ρ²ω₀²/(s + γ)² = 1.

    1/φ is nearly a straight line and concave. One Newton step from a point where it is at most 1 is accurate enough. A
    face with φ(0) <= 1 would stick; it keeps a small part of its slip, since directions are needed.
    """
    _, a, b = patch.points
    u, w, inv_mass = body.u, body.w, body.inv_mass
    ca, cb, second = _centroid_and_variance(n, a, b, on)
    va, vb = u[1] - w[0] * cb, u[2] + w[0] * ca
    slip2, turn2, beta = va * va + vb * vb, second * w[0] * w[0], mu * max(-u[0], 0.0)
    free, gamma = math.sqrt(slip2 + turn2), beta * second * body.K[0] / inv_mass
    s = max(free - max(beta, gamma), 0.0)
    p, q = 1.0 / (s + beta), 1.0 / (s + gamma)
    square = slip2 * p * p + turn2 * q * q
    s += (math.sqrt(square) - 1.0) * square / (slip2 * p * p * p + turn2 * q * q * q)
    s = max(s, _MIN_SLIP_SHARE * free)
    p, q = s / (s + beta), s / (s + gamma)
    wn = q * w[0]
    return p * va + wn * cb, p * vb - wn * ca, wn
