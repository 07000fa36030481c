"""Friction of a stage against the mean of the slip velocities before and after it: of second order.

In Moreau's step the friction of the whole stage opposes the slip velocity u¹ at its end: an error of first order
wherever the direction of sliding turns, and that of a vertex may turn by 90° within a few steps. Against the mean
½ (u⁰ + u¹) it is the midpoint rule, of second order, and its work, -μ p_n |½ (u⁰ + u¹)|, is what the energy loses:
that of any impulse is its product with the mean velocity. To the solver, which asks for friction against u less its
target, that is the target -u⁰.

Such friction cannot stop a contact, only turn it round. Where it does, u¹·u⁰ < 0, the stage is solved once more with
friction against u¹. So are stages in which nothing slips at first.
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

# Contacts of a stage at most, `mean_slip` of the settings, for `physics.Accuracy.slip`. The slips of a face turn
# slowly, as a whole, and a solve more is dear there.
MEAN_SLIP_CONTACTS = 2

# A contact that held slips by less than this many times the error of its target.
_SLIP_MARGIN = 2.0


@inlined
def _tangential(i, v, w, scratch):
    """Tangential velocity of the body at contact i [m/s]."""
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
    """Slip at the start of a stage up to which a contact holds [m/s].

    The limit is the error of a sticking contact's target (`target_velocity.set_resting_targets`) in the stage before.
    It is the tolerance of its solve plus h² (ω α + ω³ r); for a sphere, whose arm does not turn with it, the tolerance
    alone.
    """
    body = scratch.body
    least = scratch.settings.tolerance * body.acceleration * h
    if body.shape == SPHERE:
        return least
    square = qt.dot(w, w)
    return least + _SLIP_MARGIN * h * math.sqrt(square) * h * (body.acceleration + body.radius * square)


@if_given("contact.friction", False)
def oppose_mean_slip(n, contact, v, w, h, scratch):
    """Let friction oppose the mean slip of the stage; return whether all contacts slip.

    Parameters
    ----------
    v, w : tuples of 3 floats
        Velocity and angular velocity before the impulses, at the attitude of the middle of the stage.
    h : float
        Length of the stage [s].

    Notes
    -----
    Changes the tangents of `contacts.target`, which `target_velocity.set_resting_targets` has set: what the turning of
    its arm takes from a contact in half a stage (kept in `contacts.held_target`). Added to the velocity at the middle
    it gives the one at the start.
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
    """Undo `oppose_mean_slip`."""
    for i in range(n):
        contacts.target[i, 1], contacts.target[i, 2] = contacts.held_target[i, 0], contacts.held_target[i, 1]


@inlined
def has_slip_reversed(n, v, w, scratch):
    """True if the slip of a pushing contact opposes the earlier slip, -`contacts.target`, after impulses."""
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
    """Result of `solve_contacts` for `free` (v, L), with friction against the mean slip if it created energy.

    An impulse p adds the energy p·½(u⁰ + u¹). Friction that stops a contact adds ½ p_t·u⁰. In a rigid impact the normal
    impulse outweighs this. The push of a spring depends on its depth, and may not.

    Parameters
    ----------
    v, w : tuples of 3 floats
        Velocity and angular velocity before the stage, at the attitude R of its middle.
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
