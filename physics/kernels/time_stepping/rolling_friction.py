"""Torques of contact on round bodies: rolling and spin friction.

Rolling and spin friction are torques. With the normal impulse p of a contact, ω its angular velocity, n the normal,

    across the normal   |T| <= a p,    T against ω - (n·ω) n   (rolling)
    along the normal    |T| <= b p,    T against (n·ω) n       (spin)

Each is as large as allowed while there is a rotation to oppose, and at most as large as stops it. The stage knows p
only when its contacts are solved, and friction answers to the torque: it slows a rolling ball as a whole, but not a
sliding one. So the stage is solved again with the whole torque among the loads of the body. If that would reverse the
rotation, the share of the torque that leaves none is used. False position finds it, since between the changes from
sticking to sliding the contact problem is linear.

References
----------
.. [1] C. A. Coulomb, *Théorie des machines simples*, 1785, for rolling friction in proportion to the load.
.. [2] P. Contensou, *Couplage entre frottement de glissement et frottement de pivotement*, 1962, for the torque of a
   spinning contact (3π/16 μ times the radius of Hertz's patch).
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.contact_solver.solve import rows_per_contact, solve_contacts
from physics.kernels.half_space.contact_point import wall_normal, wall_of
from physics.kernels.math import quaternion as qt
from physics.kernels.state.body import apply_inv_inertia
from physics.kernels.state.contact_law_dispatch import LAW_ROLLING, LAW_SPIN, if_law, law_parameter
from physics.kernels.state.layout import BLOCK

# Solutions of the contact problem for one torque at most; two are usual, one where the body goes on turning.
_MAX_TORQUE_TRIALS = 5

# A body stands still when the torque's power is this share of what it was without it: some roundings.
_STOPPED_POWER_SHARE = 1.0e-13

rolling_radius = law_parameter(LAW_ROLLING)
spin_radius = law_parameter(LAW_SPIN)


@inlined
def _added(L, s, T):
    return (L[0] + s * T[0], L[1] + s * T[1], L[2] + s * T[2])


@inlined
def _against(n, width, across, along, w, scratch):
    """Angular impulse against the turning w, from normal impulses in `scratch`, with arms across and along normals."""
    x = y = z = 0.0
    for k in range(n):
        p = max(scratch.contacts.impulse[width * k], 0.0)
        N = wall_normal(scratch.scene.walls, wall_of(scratch.contacts.slot[k], scratch.scene))
        spin = qt.dot(N, w)
        r = (w[0] - spin * N[0], w[1] - spin * N[1], w[2] - spin * N[2])
        size = math.sqrt(qt.dot(r, r))
        a = -across * p / size if size > 0.0 else 0.0
        b = -math.copysign(along * p, spin) if spin != 0.0 else 0.0
        x, y, z = x + (a * r[0] + b * N[0]), y + (a * r[1] + b * N[1]), z + (a * r[2] + b * N[2])
    return (x, y, z)


@kernel
def _resist(n, contact, across, along, v, L, solved, R, scratch):
    """Solve with one torque: result of `solve_contacts`, and L with the torque but without the contacts."""
    width = rows_per_contact(contact)
    w = apply_inv_inertia(R, solved[1], scratch.body.J)
    T = _against(n, width, across, along, w, scratch)
    start = qt.dot(T, w)
    if not start < 0.0:
        return solved, L
    low, high, at_low, at_high, s = 0.0, 1.0, start, 0.0, 1.0
    for trial in range(_MAX_TORQUE_TRIALS):
        solved = solve_contacts(n, contact, v, _added(L, s, T), R, scratch)
        power = qt.dot(T, apply_inv_inertia(R, solved[1], scratch.body.J))
        if (
            (s == 1.0 and not power > 0.0)
            or abs(power) <= -_STOPPED_POWER_SHARE * start
            or trial == _MAX_TORQUE_TRIALS - 1
        ):
            break
        if power > 0.0:
            high, at_high = s, power
        else:
            low, at_low = s, power
        s = low - at_low * (high - low) / (at_high - at_low)
    return solved, _added(L, s, T)


def _as_solved(n, contact, v, L, solved, R, scratch):
    return solved


@if_law((LAW_ROLLING, LAW_SPIN), _as_solved)
def apply_resistance_torques(n, contact, v, L, solved, R, scratch):
    """Result of `solve_contacts` for v and L, with the torques of rolling and spin friction on a round body."""
    body = scratch.body
    if body.shape == BLOCK:
        return solved
    across, along = rolling_radius(body), spin_radius(body)
    if across > 0.0:
        solved, L = _resist(n, contact, across, 0.0, v, L, solved, R, scratch)
    if along > 0.0:
        solved, L = _resist(n, contact, 0.0, along, v, L, solved, R, scratch)
    return solved
