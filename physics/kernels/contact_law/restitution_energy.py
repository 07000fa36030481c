"""Limit the rebound of an impact, or the impulses of a stage, so that they create no energy.

Newton's law of restitution relates normal velocities before (u⁻) and after (u⁺) an impact. Where friction turns the
slip round during the impact, the law may require more energy than the body has (Kane's paradox). A plastic impact never
gains energy: with the impulses p, u⁺ = u⁻ + W p and p·u⁺ <= 0,

    ΔE = ½ p·(u⁻ + u⁺) = ½ (2 p·u⁺ - p·W p) <= 0.

Momenta between those of the plastic impact (s = 0) and those of the full rebound (s = 1) come from impulses in the same
friction cones, since cones are convex, and no contact approaches after them. The energy is a parabola in s. This module
takes the largest s at which the energy is at most that before the impact.

References
----------
.. [1] T. R. Kane, D. A. Levinson, *Dynamics: Theory and Applications*, 1985 (the paradox).
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.quaternion import lerp
from physics.kernels.state.body import apply_inv_inertia, kinetic_energy

# Share by which rounding may raise the energy in an impact; a momentum results from about a dozen products and sums.
IMPACT_ENERGY_ROUNDING = 1.0e-14

# Lifts of a body out of a wall by at most this many slops do not cost kinetic energy.
_FREE_LIFT_SLOPS = 10.0


@inlined
def lift_conserving_energy(z, y, offset_frame, body):
    """State y with its position moved to z, out of a wall; the work against the loads is taken from the motion.

    Displacements of a few slops cost nothing.
    """
    x, q, v, L = y
    d, a = (z[0] - x[0], z[1] - x[1], z[2] - x[2]), body.free_acceleration
    lift = -body.mass * (a[0] * d[0] + a[1] * d[1] + a[2] * d[2])
    if qt.dot(d, d) > (_FREE_LIFT_SLOPS * body.slop) ** 2 and lift > 0.0:
        kinetic = kinetic_energy(q, v, L, body, offset_frame)
        s = math.sqrt(1.0 - lift / kinetic) if lift < kinetic else 0.0
        v, L = (s * v[0], s * v[1], s * v[2]), (s * L[0], s * L[1], s * L[2])
    return z, q, v, L


@inlined
def rebound_share(before, plastic, full, middle):
    """Largest share s of an impact's rebound, in [0, 1], at which the energy after it is at most `before` [J].

    `plastic`, `middle` and `full` are the energies at s = 0, 1/2 and 1 [J]. The energy is the parabola
    f(s) = plastic + B s + C s² with C = 2 (full + plastic) - 4 middle >= 0, and f(1) > before >= f(0). Its root is
    computed by the formula without cancellation.
    """
    c = min(plastic - before, 0.0)
    C = max(2.0 * (full + plastic) - 4.0 * middle, 0.0)
    B = full - plastic - C
    below = B + math.sqrt(max(B * B - 4.0 * C * c, 0.0))
    if not below > 0.0:
        return 0.0
    return min(-2.0 * c / below, 1.0)


@inlined
def limit_rebound_energy(q, before, plastic, full, body, offset_frame):
    """Limit an impact to the largest share s of its rebound that creates no energy: (v, L, s).

    `plastic` and `full` are (v, L) after the impact without and with its full rebound. `before` is the energy before
    the impact [J], which the full rebound would raise. q is the attitude of the body.
    """
    (v0, L0), (v1, L1) = plastic, full
    middle = kinetic_energy(q, lerp(v0, v1, 0.5), lerp(L0, L1, 0.5), body, offset_frame)
    ends = kinetic_energy(q, v0, L0, body, offset_frame), kinetic_energy(q, v1, L1, body, offset_frame)
    s = rebound_share(before, ends[0], ends[1], middle)
    return lerp(v0, v1, s), lerp(L0, L1, s), s


@kernel
def scale_impulses_to_dissipate(n, friction, before, w, solved, free, R, scratch):
    """Shorten the impulses of a contact problem that no method has solved, so that they create no energy.

    `solved` is the result of `solve_contacts` for `free`, the (v, L) of the body without impulses; it is returned with
    new velocities, and `contacts.impulse` is shortened. `before` and `w` are velocity and angular velocity before the
    stage or the impact.

    The impulses lie in their friction cones, and so does any share s of them. Let P be their sum and Q their moment.
    Their work is ½ s (A + s B), with A = P·(v + v_free) + Q·(ω + ω_free) and B = P·P/m + Q·I⁻¹ Q >= 0. If A < 0, the
    work is zero at s = -A/B and negative for smaller s.
    """
    body = scratch.body
    v, L = free
    v_new, L_new, residual, sweeps, method = solved
    u, M = (v_new[0] - v[0], v_new[1] - v[1], v_new[2] - v[2]), (L_new[0] - L[0], L_new[1] - L[1], L_new[2] - L[2])
    w0, dw = apply_inv_inertia(R, L, body.J), apply_inv_inertia(R, M, body.J)
    A = body.mass * (qt.dot(u, before) + qt.dot(u, v)) + qt.dot(M, w) + qt.dot(M, w0)
    B = body.mass * qt.dot(u, u) + qt.dot(M, dw)
    if not A + B > 0.0:
        return solved
    s = 0.0
    if A < 0.0:
        s = -A / B
    width = 3
    if friction is None:
        width = 1
    for r in range(width * n):
        scratch.contacts.impulse[r] *= s
    return lerp(v, v_new, s), lerp(L, L_new, s), residual, sweeps, method
