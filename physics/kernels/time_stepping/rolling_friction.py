"""Rolling and spin friction of round bodies: torques of contact against their rotation.

Let p be the normal impulse of a contact, n its normal, and ω the angular velocity of the body. The angular impulse T is

    across the normal   |T| <= a p,    T against ω - (n·ω) n   (rolling friction, coefficient a [m])
    along the normal    |T| <= b p,    T against (n·ω) n       (spin friction, coefficient b [m])

Each part has its largest size while there is a rotation to oppose, and at most the size that stops the rotation. p is
known only when the contacts of the stage are solved, and their friction responds to T. So the stage is solved again,
with T added to the angular momentum of the body. If T would reverse the rotation, the share of T that stops it is used.
False position finds this share, since the contact problem is linear between changes from sticking to sliding.

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

# Largest number of solves of the contact problem for one torque. Two are usual, one if the body goes on turning.
_MAX_TORQUE_TRIALS = 5

# The rotation has stopped when the power of the torque is below this share of its power without the torque.
_STOPPED_POWER_SHARE = 1.0e-13

rolling_radius = law_parameter(LAW_ROLLING)
spin_radius = law_parameter(LAW_SPIN)


@inlined
def _added(L, s, T):
    return (L[0] + s * T[0], L[1] + s * T[1], L[2] + s * T[2])


@inlined
def _against(n, width, across, along, w, scratch):
    """Angular impulse [kg m²/s] of n contacts against the angular velocity w, from normal impulses in `scratch`.

    `across` and `along` are the coefficients [m] of rolling and of spin friction; `width` is the number of impulses per
    contact.
    """
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
    """Solve the contacts with the friction torque of one kind: (new result of `solve_contacts`, L with the torque).

    v and L are velocity and angular momentum without contact impulses, and `solved` is the result of `solve_contacts`
    without the torque. `across` and `along` are the coefficients [m] of rolling and of spin friction, one of them 0.
    """
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
    """Apply the torques of rolling and spin friction to a round body, and return the new result of `solve_contacts`.

    v and L are velocity and angular momentum without contact impulses, and `solved` is the result of `solve_contacts`
    for them. It is returned as it is for blocks, and in scenes without these laws.
    """
    body = scratch.body
    if body.shape == BLOCK:
        return solved
    across, along = rolling_radius(body), spin_radius(body)
    if across > 0.0:
        solved, L = _resist(n, contact, across, 0.0, v, L, solved, R, scratch)
    if along > 0.0:
        solved, L = _resist(n, contact, 0.0, along, v, L, solved, R, scratch)
    return solved
