"""End of a stage where a slip ends: there friction begins to hold, or turns round.

Friction of a stage opposes the slip at its end (`midpoint_step`). If a slip ends within the stage, this is an error of
first order in the velocity. On a body that stands it happens once, and the block stays. On a driven body it may happen
in every period of the motion, and the errors add up. Under error control, parts must be short there. So the stage is
then made again, up to the end of the slip: on driven bodies, and under error control of several moving bodies. (Those
of a lone body are met by `lone_part`.)

Let s₀ > 0 be the slip of a pair before the stage of length h, along its own direction e, and s₁ that after it. Without
impulses it would be s. All contacts of the pair together use the share r = Σ p_t·e / Σ μ p_n of their friction. So
full friction against the slip would change it by -F, with F = (s₁ - s)/r. While it slips, the rate of the slip is
nearly constant. So the slip ends at the time

    h s₀ / (s₀ - s + F).

All of this is left out of other kernels.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, row_vector, times
from physics.kernels.multibody.data.contact_set import end_of_pair, relative_velocity, slip_velocity
from physics.kernels.multibody.data.driven_bodies import bind_driven_twists, driven_velocity, is_driven
from physics.kernels.multibody.data.kinematics import update_poses_and_twists
from physics.kernels.multibody.data.warm_start import load_warm_impulses
from physics.kernels.multibody.stepping.foretold_twists import is_slip_foretold
from physics.kernels.multibody.stepping.midpoint_step import midpoint_step

# Largest number of trials to meet the end of a slip in a stage.
_MAX_TRIALS = 4

# Share r from which contacts count as slipping on, and below which it does not tell what friction can do. From the
# third share on they have been slipping in the stage before; its direction may have turned by 25 degrees since.
_FULL_SHARE = 1.0 - 1.0e-6
_LEAST_SHARE = 0.05
_SLIPPING_SHARE = 0.9

# The end of a slip needs no cut within this share of a stage from its end, nor within so many tolerances from its
# start: residuals leave slips of that size.
_LAST_SHARE = 1.0 - 1.0e-6
_FIRST_TOLERANCES = 100.0


def _never(k, many):
    return False


@if_given("many.driven", _never)
def _is_on_driven(k, many):
    b = -1 - many.walls.shape[0] - many.contacts.bodies[k, 1]
    return b >= 0 and is_driven(b, many)


def _is_controlled(k, many):
    return many.settings[0].is_error_controlled == 1 or _is_on_driven(k, many)


@if_given("many.lone", _is_controlled)
def _is_followed(k, many):
    """True if a stage ends where the slip of contact k's pair ends."""
    return _is_on_driven(k, many)


@inlined
def _share_of_friction(first, last, e, many):
    """Share of their friction that the contacts [first, last) use along the unit vector e; -2 if none pushes."""
    along = most = 0.0
    for k in range(first, last):
        E, p = many.contacts.frame, row_vector(many.contacts.impulse, k, 0)
        along += p[1] * qt.dot(row_vector(E, k, 3), e) + p[2] * qt.dot(row_vector(E, k, 6), e)
        most += many.contacts.mu[k] * p[0]
    return along / most if most > 0.0 else -2.0


@inlined
def _was_slipping(first, last, e, many):
    """True if the contacts [first, last) were slipping along e in the stage before, whose impulses they have now.

    It is also true if none was pushing.
    """
    return _share_of_friction(first, last, e, many) <= -_SLIPPING_SHARE


@inlined
def _save_start(n, world, h, friction, memory, many):
    """Save states, targets and slips of the n contacts before a stage; load the impulses of the stage before."""
    kept = many.stage_start
    load_warm_impulses(n, world, h, friction, memory, many)
    for b in range(many.bodies.state.shape[0]):
        for c in range(many.bodies.state.shape[1]):
            kept.state[b, c] = many.bodies.state[b, c]
    for k in range(n):
        u, normal = slip_velocity(k, many), row_vector(many.contacts.frame, k, 0)
        speed = qt.dot(u, normal)
        for c in range(3):
            kept.slip[k, c], kept.target[k, c] = u[c] - speed * normal[c], many.contacts.target[k, c]
    k = 0
    while k < n:
        last = end_of_pair(k, n, many)
        slip = row_vector(kept.slip, k, 0)
        size = math.sqrt(qt.dot(slip, slip))
        if not (_is_followed(k, many) and size > 0.0 and _was_slipping(k, last, times(1.0 / size, slip), many)):
            for c in range(3):
                kept.slip[k, c] = 0.0  # of the first contact, which stands for its pair
        k = last


@inlined
def _restore_start(n, start, h, offset_frame, many):
    """Restore what `_save_start` has saved, for a stage of length h [s] that begins `start` [s] into the call."""
    kept = many.stage_start
    for b in range(many.bodies.state.shape[0]):
        for c in range(many.bodies.state.shape[1]):
            many.bodies.state[b, c] = kept.state[b, c]
    for k in range(n):
        for c in range(3):
            many.contacts.target[k, c] = kept.target[k, c]
    update_poses_and_twists(offset_frame, many)
    bind_driven_twists(start, h, many)


@inlined
def _end_of_slip(first, last, h, many):
    """Time at which the pair of the contacts [first, last) stops slipping in the stage of length h, else h [s].

    A saved slip of 0 is that of a pair that holds, or of one that is not followed.
    """
    slip = row_vector(many.stage_start.slip, first, 0)
    before = math.sqrt(qt.dot(slip, slip))
    if not before > 0.0 or is_slip_foretold(first, before, many):
        return h
    e = (slip[0] / before, slip[1] / before, slip[2] / before)
    share = _share_of_friction(first, last, e, many)
    if share <= -_FULL_SHARE:
        return h
    w = driven_velocity(first, many)
    after = qt.dot(e, minus(relative_velocity(first, many.bodies.twist, many), w))
    free = qt.dot(e, minus(relative_velocity(first, many.bodies.free_twist, many), w))
    if abs(share) < _LEAST_SHARE:
        return 0.5 * h
    loss = before - free + (after - free) / share
    return h * before / loss if loss > before else h


@kernel
def _first_end_of_slip(n, h, many):
    """Time at which the first pair that is followed stops slipping in the stage of length h, else h [s]."""
    first, k, least = h, 0, _FIRST_TOLERANCES * many.settings[0].tolerance
    while k < n:
        last = end_of_pair(k, n, many)
        t = _end_of_slip(k, last, h, many)
        if least * h < t < _LAST_SHARE * h:
            first = min(first, t)
        k = last
    return first


def _whole_stage(n, world, start, h, is_last, switches, sleep, records, many):
    midpoint_step(n, world, h, switches, sleep, records, many)
    return h


@if_given("many.stage_start", _whole_stage)
def step_to_slip_end(n, world, start, h, is_last, switches, sleep, records, many):
    """Advance every body by h [s], or to the end of a slip that is followed; return the length of the stage [s].

    `start` is the time since the start of the call [s]. The last stage of a substep (`is_last`) is not cut. The other
    arguments are those of `midpoint_step`.
    """
    _save_start(n, world, h, switches.friction, records.memory, many)
    for trial in range(_MAX_TRIALS):
        midpoint_step(n, world, h, switches, sleep, records, many)
        t = _first_end_of_slip(n, h, many)
        if is_last or not t < h or trial == _MAX_TRIALS - 1:
            break
        h = t
        _restore_start(n, start, h, switches.flight.offset_frame, many)
    return h
