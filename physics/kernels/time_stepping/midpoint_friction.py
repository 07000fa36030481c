"""Friction of a stage against the mean of the slip velocities before (u⁰) and after it (u¹): of second order.

In Moreau's step friction opposes the slip u¹ at the end of the stage. Where the direction of sliding turns, this is an
error of first order, and the slip of a vertex may turn by 90° within a few steps. Friction against the mean slip
½ (u⁰ + u¹) is the midpoint rule, of second order. Its work -μ p_n |½ (u⁰ + u¹)| is the energy that the body loses,
since any impulse changes the energy by its product with the mean velocity. The solver opposes friction to the velocity
u less its target. So the target -u⁰ makes it oppose the mean.

Such friction cannot stop a contact, it can only reverse its slip. If it does (u¹·u⁰ < 0), the stage is solved once more
with friction against u¹. Stages in which not all contacts slip at first have friction against u¹, too.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined
from physics.kernels.contact_law.anisotropic_friction import friction_ratio
from physics.kernels.contact_solver.solve import solve_contacts
from physics.kernels.half_space.contact_point import contact_arm, wall_of
from physics.kernels.math import quaternion as qt
from physics.kernels.state.body import apply_inv_inertia
from physics.kernels.state.contact_law_dispatch import LAW_STIFFNESS, if_law
from physics.kernels.state.groups import has_friction
from physics.kernels.state.layout import SPHERE, WALL_TANGENT_1

# Largest number of contacts of a stage in which friction opposes the mean slip (`physics.Accuracy.slip`, the setting
# `mean_slip`). The slips of a face's contacts turn slowly, and a second solve takes long there.
MEAN_SLIP_CONTACTS = 2

# A contact that stuck in the last stage slips now by less than this many times the error of its target.
_SLIP_MARGIN = 2.0


@inlined
def _tangential(i, v, w, scratch):
    """Velocity of contact point i along the two tangents of its wall [m/s], from velocity v and angular velocity w."""
    walls, k = scratch.scene.walls, wall_of(scratch.contacts.slot[i], scratch.scene)
    m = qt.cross(w, contact_arm(scratch.contacts, i))
    x, y, z = v[0] + m[0], v[1] + m[1], v[2] + m[2]
    t = WALL_TANGENT_1
    return (
        walls[k, t] * x + walls[k, t + 1] * y + walls[k, t + 2] * z,
        walls[k, t + 3] * x + walls[k, t + 4] * y + walls[k, t + 5] * z,
    )


@inlined
def _least_slip(w, h, scratch):
    """Slip at the start of a stage up to which a contact counts as sticking [m/s].

    The limit is the error that the last stage, of length h, may leave in a sticking contact. This is the tolerance of
    its solve, plus the error h² (ω α + ω³ r) of its target (`target_velocity.set_resting_targets`). The arm of a sphere
    does not turn with the sphere, so it only has the tolerance. w is the angular velocity.
    """
    body = scratch.body
    least = scratch.settings.tolerance * body.acceleration * h
    if body.shape == SPHERE:
        return least
    square = qt.dot(w, w)
    return least + _SLIP_MARGIN * h * math.sqrt(square) * h * (body.acceleration + body.radius * square)


@if_given("contact.friction", False)
def oppose_mean_slip(n, contact, v, w, h, scratch):
    """Set tangential targets so that friction opposes the mean slip of the stage, if all n contacts slip.

    Returns whether all contacts slip; if not, nothing is changed.

    Parameters
    ----------
    v, w : tuples of 3 floats
        Velocity and angular velocity before the impulses, at the attitude of the middle of the stage.
    h : float
        Length of the stage [s].

    Notes
    -----
    The tangential parts of `contacts.target` are replaced. Those before, from `target_velocity.set_resting_targets`,
    are kept in `contacts.held_target`. They are minus the velocity that a contact gains by turning in half a stage, so
    added to the slip in the middle they give the slip at the start.
    """
    contacts = scratch.contacts
    least = _least_slip(w, h, scratch)
    for i in range(n):
        a, b = _tangential(i, v, w, scratch)
        a, b = a + contacts.target[i, 1], b + contacts.target[i, 2]
        if not a * a + b * b > least * least:
            return False
    for i in range(n):
        a, b = _tangential(i, v, w, scratch)
        contacts.held_target[i, 0], contacts.held_target[i, 1] = contacts.target[i, 1], contacts.target[i, 2]
        contacts.target[i, 1], contacts.target[i, 2] = -a, -b
    return True


@inlined
def oppose_end_slip(n, contacts):
    """Let friction oppose the slip at the end of the stage again: restore the tangential targets of n contacts."""
    for i in range(n):
        contacts.target[i, 1], contacts.target[i, 2] = contacts.held_target[i, 0], contacts.held_target[i, 1]


@inlined
def has_slip_reversed(n, v, w, scratch):
    """True if a pushing contact has reversed its slip: the slip after the impulses opposes that before the stage.

    v and w are velocity and angular velocity after the impulses. The slip before is minus the tangential target that
    `oppose_mean_slip` has set.
    """
    contacts = scratch.contacts
    ratio = friction_ratio(scratch.body)
    for i in range(n):
        a, b = _tangential(i, v, w, scratch)
        b *= ratio * ratio  # both slips stretched (`anisotropic_friction`)
        if contacts.impulse[3 * i] > 0.0 and a * contacts.target[i, 1] + b * contacts.target[i, 2] > 0.0:
            return True
    return False


def _as_solved(n, contact, v, w, solved, free, R, h, scratch):
    return solved


@if_law((LAW_STIFFNESS,), _as_solved)
def cap_friction_work(n, contact, v, w, solved, free, R, h, scratch):
    """Solve the contacts of a compliant stage again, with friction against the mean slip, if friction created energy.

    An impulse p adds the energy p·½(u⁰ + u¹). Friction that stops a contact adds ½ p_t·u⁰. In a rigid impact the normal
    impulse takes more energy than that. The push of a spring depends on its depth, and may take less.

    Parameters
    ----------
    v, w : tuples of 3 floats
        Velocity and angular velocity before the stage, at the attitude R of its middle.
    solved : tuple
        Result of `solve_contacts` with the present targets.
    free : tuple
        Velocity and angular momentum with loads and without contact impulses.

    Returns
    -------
    tuple
        Result of `solve_contacts`: `solved`, or the new one.
    """
    body, contacts = scratch.body, scratch.contacts
    if not has_friction(contact):
        return solved
    w_new = apply_inv_inertia(R, solved[1], body.J)
    gift = push = 0.0
    for i in range(n):
        a, b = _tangential(i, v, w, scratch)
        c, d = _tangential(i, solved[0], w_new, scratch)
        gift += 0.5 * (contacts.impulse[3 * i + 1] * (a + c) + contacts.impulse[3 * i + 2] * (b + d))
        push += contacts.impulse[3 * i]
    if not gift > (1.0 + body.mu) * push * scratch.settings.tolerance * body.acceleration * h:
        return solved
    for i in range(n):
        a, b = _tangential(i, v, w, scratch)
        contacts.target[i, 1], contacts.target[i, 2] = -a, -b
    return solve_contacts(n, contact, free[0], free[1], R, scratch)
