"""The lone body of a world, the only one that moves among fixed ones or with an axis of friction; its slowness."""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.state.fixed_body import is_fixed

# Speed up to which a body counts as slow, as a share of what loads give in a stage. Where it slips, turns and passes
# rims only that slowly, none of these needs a look.
_SLOW_SHARE = 0.1


@inlined
def lone_body(many):
    """Index of the first body that moves."""
    b = 0
    while is_fixed(b, many.bodies):
        b += 1
    return b


def _has_slow_motion(h, many):
    b = lone_body(many)
    v, w, body = row_vector(many.bodies.twist, b, 0), row_vector(many.bodies.twist, b, 3), many.bodies.body[b]
    speed = math.sqrt(qt.dot(v, v)) + body.radius * math.sqrt(qt.dot(w, w))
    return many.settings[0].is_error_controlled == 0 and speed <= _SLOW_SHARE * body.acceleration * h


@if_given("many.driven", _has_slow_motion)
def _may_be_slow(h, many):
    """False: on a body that moves, a body at rest may slip."""
    return False


@if_given("many.lone")
def note_slowness(h, many):
    """Note whether the lone body is slow at the start of a stage of up to h [s]; under error control it never is."""
    many.lone.slow[0] = 1 if _may_be_slow(h, many) else 0
