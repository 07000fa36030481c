"""Compliance γ of contacts that give, as the solver of bodies that touch each other takes it.

With the compliance γ the normal row of a contact is 0 <= p ⟂ u + γ p - t >= 0 (`contact_law.compliance`): γ is added
to the diagonal of W, and γ p to the velocity. All of this is left out of kernels whose scene has rigid contact.
"""

from __future__ import annotations

from physics.compiler.decorators import if_given


def _same(k, value, many):
    return value


@if_given("many.compliance", _same)
def plus_give(k, value, many):
    """Sum of `value`, the entry W_nn of contact k without its compliance, and γ [1/kg]."""
    return value + many.compliance.give[k]


@if_given("many.compliance", _same)
def plus_give_velocity(k, value, many):
    """Sum of `value`, a normal velocity of contact k, and γ p for its present impulse p [m/s]."""
    return value + many.compliance.give[k] * many.contacts.impulse[k, 0]


def _whole_error(k, error, mobility, many):
    return error


@if_given("many.compliance", _whole_error)
def answer_of_spring(k, error, mobility, many):
    """Speed that contact k has if its spring alone answers the normal error `error` [m/s].

    In short parts under error control targets of springs are far above all speeds. Elsewhere the error itself counts.
    `mobility` is the entry W_nn without γ [1/kg].
    """
    return error * mobility / (mobility + many.settings[0].is_error_controlled * many.compliance.give[k])


def _mobility(k, many):
    return many.contacts.block[k, 0]


@if_given("many.compliance", _mobility)
def rigid_mobility(k, many):
    """Entry W_nn + γ of contact k, under error control its mobility along the plane [1/kg].

    In short parts γ is far above all mobilities.
    """
    if many.settings[0].is_error_controlled == 1:
        return min(many.contacts.block[k, 0], 1.0 / many.contacts.step[k])
    return many.contacts.block[k, 0]


def _unscaled(u, normal, step, many):
    return u, normal


@if_given("many.compliance", _unscaled)
def per_spring(u, normal, step, many):
    """Velocity error u and entry W_nn + γ of a contact, as far as they count for its residual.

    Under error control their normal parts are divided by 1 + γ/w, w being the mobility 1/`step` along the plane: in
    short parts the targets of springs are so large that their rounding is above all speeds.
    """
    share = 1.0
    if many.settings[0].is_error_controlled == 1:
        share = min(1.0, 1.0 / (step * normal))
    return (share * u[0], u[1], u[2]), share * normal


@if_given("many.compliance", False)
def is_pressed_in(gap, many):
    """True if a contact gives and has no gap left: its spring then stops the bodies, however deep they are."""
    return gap <= 0.0
