"""Limit the rebound of an impact, or the impulses of a stage, so that they create no energy.

Newton's restitution is a law of normal velocities before and after; where friction turns the slip round meanwhile, it
can ask for more than the body has (Kane's paradox). A plastic impact never does: with u⁺ = u⁻ + W p, p·u⁺ <= 0,

    ΔE = ½ p·(u⁻ + u⁺) = ½ (2 p·u⁺ - p·W p) <= 0.

The momenta between it (s = 0) and the full rebound (s = 1) are those of impulses in the same cones, which are convex,
and leave no contact approaching. The energy is a parabola in s. The kernel takes the largest s at which it equals the
energy before.

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

# Share of the energy by which rounding of an impact may raise it: of the dozen products and sums behind a momentum.
IMPACT_ENERGY_ROUNDING = 1.0e-14

# Slops that a body is lifted out of a wall for nothing.
_FREE_LIFT_SLOPS = 10.0


@inlined
def lift_conserving_energy(z, y, offset_frame, body):
    """State y moved to the place z out of a wall. The work of the lift against the loads is taken from the motion."""
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
    """Largest s in [0, 1] at which the energy is at most `before`.

    `plastic`, `middle` and `full` are the energies at s = 0, 1/2 and 1 [J]: f(s) = plastic + B s + C s² with
    C = 2 (full + plastic) - 4 middle >= 0 and f(1) > before >= f(0). The root in the form that does not cancel.
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
    """Motion (v, L) with the largest share s of the full rebound that creates no energy, and s.

    `before` is the energy before the impact [J], which the full rebound would raise.
    """
    (v0, L0), (v1, L1) = plastic, full
    middle = kinetic_energy(q, lerp(v0, v1, 0.5), lerp(L0, L1, 0.5), body, offset_frame)
    ends = kinetic_energy(q, v0, L0, body, offset_frame), kinetic_energy(q, v1, L1, body, offset_frame)
    s = rebound_share(before, ends[0], ends[1], middle)
    return lerp(v0, v1, s), lerp(L0, L1, s), s


@kernel
def scale_impulses_to_dissipate(n, friction, before, w, solved, free, R, scratch):
    """Result of `solve_contacts` for `free` (v, L), with impulses shortened until they create no energy.

    For a problem that no method solved. Its impulses lie in their cones, and so does any share s of them, whose work is
    ½ s (A + s B), A = P·(v + v_free) + Q·(ω + ω_free), B = P·P/m + Q·I⁻¹ Q >= 0, with v and ω (`before`, `w`) before
    the stage. That is none at s = -A/B if A < 0, and less for any shorter.
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
