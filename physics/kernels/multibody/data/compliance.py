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


@if_given("many.compliance", False)
def is_pressed_in(gap, many):
    """True if a contact gives and has no gap left: its spring then stops the bodies, however deep they are."""
    return gap <= 0.0
