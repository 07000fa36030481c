"""Start of the solve of a patch: from the impulses of the last stage, or from a guess if these belong to other loads.

A planar motion is (v_a, v_b, ω_n): velocity along the two tangents [m/s], and spin about the normal [rad/s].
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined
from physics.compiler.simd import lane_sum, max_of_lanes, select_lanes
from physics.kernels.contact_law.anisotropic_friction import friction_ratio
from physics.kernels.contact_solver.one_contact import is_warm_start_valid
from physics.kernels.contact_solver.patch import patch_coordinates_along
from physics.kernels.math import quaternion as qt
from physics.kernels.math.simd_gather import gather_component, valid_lanes_mask

# Share of its free slip with which the solve of a face that nearly sticks starts.
_MIN_SLIP_SHARE = 0.01


@inlined
def warm_start_motion(n, patch, on, body, scratch):
    """Planar motion (v_a, v_b, ω_n) after the warm-start impulses, and whether the warm start fits the loads.

    `on` is 1 in the lanes of the n contacts, 0 in a surplus lane.
    """
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
    """Tangential impulses per normal impulse of the warm start of n contacts in `scratch`: lanes x and y.

    They are 0 for a contact without a normal impulse. `on` is 1 in the lanes of the n contacts, 0 in a surplus lane.
    """
    contacts = scratch.contacts
    p = on * gather_component(contacts.impulse, 0, n)
    s = select_lanes(p > 0.0, 1.0 / p, 0.0)
    x, y = gather_component(contacts.impulse, 1, n), gather_component(contacts.impulse, 2, n)
    return s * x, s * y / friction_ratio(scratch.body)


@inlined
def _centroid_and_variance(n, a, b, on):
    """Centroid (two numbers) of n contacts at the tangential coordinates a, b, and their mean squared distance from it.

    `on` is 1 in the lanes of the contacts, 0 in a surplus lane.
    """
    share = 1.0 / n
    ca, cb = share * lane_sum(on * a), share * lane_sum(on * b)
    a, b = on * (a - ca), on * (b - cb)
    return ca, cb, share * (lane_sum(a * a) + lane_sum(b * b))


@inlined
def may_stick(n, mu, axes, v, L, scratch):
    """True if friction may stop a face of n contacts, with velocity v and angular momentum L without impulses.

    The result is true for every face that can stick. A sticking face stops at its wall: normal impulses of the sum P
    remove the normal momentum, and friction, at most μP, removes the tangential momentum. The moment of friction about
    the centroid is at most μ Σ p_i |d_i| <= μP max |d_i|. If all faces were tried as sticking, one that slips within
    the tolerance of a solve would be taken for sticking, and creep. mu is the friction coefficient at the wall, and
    `axes` are its normal and tangents.
    """
    body = scratch.body
    ratio, friction = friction_ratio(body), mu * qt.dot(axes[0], v)
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
    """Estimate the planar motion (v_a, v_b, ω_n) of a body after friction at a face, by an ellipsoidal limit surface.

    `body` is the body without impulses, mu its friction coefficient, and `on` is 1 in the lanes of the n contacts.

    Let equal normal impulses have the sum P. The friction forces f and moments T about the centroid that they can exert
    while the face slides nearly fill an ellipsoid, (|f|/μP)² + (T/μPρ)² <= 1, and the slip is along its normal,
    (v, ρ² ω) (Goyal et al. 1991; Howe and Cutkosky 1996). With ρ² = Σ|d_i|²/n, β = μP/m, γ = μPρ²/I, the velocities v₀
    and ω₀ before, and the size s of the slip after, s² = v² + ρ²ω²,

        v = v₀ s/(s + β),   ω = ω₀ s/(s + γ),   φ(s)² = v₀²/(s + β)² + ρ²ω₀²/(s + γ)² = 1.

    1/φ is concave and nearly a straight line. So one Newton step, from a point where it is at most 1, is accurate
    enough. A face with φ(0) <= 1 would stick; it keeps a small part of its slip, since its direction is needed.
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
