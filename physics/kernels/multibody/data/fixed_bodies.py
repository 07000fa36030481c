"""Fixed bodies at contacts: to the solver each is a wall, and only the geometry of a contact knows its shape.

The second end of a contact is the index of a moving body, or a negative code. Code -1 - k stands for wall k. Behind the
walls follow the fixed bodies: code -1 - walls - b stands for the fixed body b. So every kernel in which an end below 0
does not move serves fixed bodies, too. The first end of a contact is always a moving body.

All of this is left out of kernels whose scene has no fixed body.
"""

from __future__ import annotations

from physics.compiler.decorators import if_given
from physics.kernels.multibody.data.driven_bodies import is_driven
from physics.kernels.multibody.data.parts import body_of
from physics.kernels.state.fixed_body import is_fixed


def _same_end(end, many):
    return end


def _has_none(many):
    return False


@if_given("many.bodies.fixed", _has_none)
def has_fixed(many):
    """True if the scene has fixed bodies."""
    return True


def _moves(b, many):
    return False


@if_given("many.bodies.fixed", _moves)
def is_still(b, many):
    """True if body b is fixed and has no prescribed motion: nothing moves it during a call of a step."""
    return is_fixed(b, many.bodies) and not is_driven(b, many)


@if_given("many.bodies.fixed", _same_end)
def body_at(end, many):
    """Index of the body at an end of a contact, whether it moves or is fixed; below 0 for a wall."""
    return end if end >= 0 else -1 - many.walls.shape[0] - end


@if_given("many.bodies.fixed", _same_end)
def end_of(b, many):
    """Code of body b, or of wall -1 - b, as the second end of a contact."""
    return -1 - many.walls.shape[0] - b if b >= 0 and is_fixed(b, many.bodies) else b


@if_given("many.bodies.fixed", _same_end)
def shown_end(end, many):
    """End of a contact in the numbering of users: the index of a body, moving or fixed, or -1 - k for wall k."""
    b = body_at(end, many)
    return b if b >= 0 else end


def _same_order(a, b, normal, points, many):
    return a, b, normal, points


@if_given("many.bodies.fixed", _same_order)
def moving_first(a, b, normal, points, many):
    """Order the parts of a contact so that its first body moves: (first, second, normal out of the second, points)."""
    if is_fixed(body_of(a, many), many.bodies):
        return b, a, (-normal[0], -normal[1], -normal[2]), (points[1], points[0])
    return a, b, normal, points


@if_given("many.bodies.fixed", True)
def may_form_pair(a, b, many):
    """True if bodies a and b may touch: never two fixed ones, and two moving ones if the setting `meet` is 1."""
    count = many.bodies.fixed[a] + many.bodies.fixed[b]
    return count == 1 or (count == 0 and many.settings[0].meet == 1)
