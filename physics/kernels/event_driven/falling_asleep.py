"""Falling asleep in the event-driven scheme, whose steps may be long: the acceleration at the end of a step counts.

A body may swing or bounce in a period that divides the step. At its turning point it is back at the same place after
each step, without velocity, but not without acceleration. So a body falls asleep only if its acceleration, too, moves
it by less than the threshold of `state.sleeping` in a step. Where place, velocity and acceleration stay the same, loads
and contact forces do, and the body is in equilibrium.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.event_driven.extrapolated_midpoint import compute_state_rate, put_state_row
from physics.kernels.event_driven.workspace import ROW_START, Y_ANGULAR_MOMENTUM, Y_VELOCITY
from physics.kernels.math import quaternion as qt
from physics.kernels.state.sleeping import falls_asleep, wake_body


@kernel
def acceleration_bound(y, offset_frame, scratch, motion):
    """Upper bound of the acceleration of any point of a body at rest in the state y [m/s²], in its contact mode.

    It is |a| + r |dL/dt|/J, with the bounding radius r and the smallest moment of inertia J. A body that the scheme
    holds at rest has none.
    """
    body, rate = scratch.body, motion.smooth.rate
    if motion.smooth.is_resting:
        return 0.0
    put_state_row(motion.smooth, ROW_START, y)
    compute_state_rate(ROW_START, 0.0, offset_frame, scratch, motion)
    a = (rate[Y_VELOCITY], rate[Y_VELOCITY + 1], rate[Y_VELOCITY + 2])
    torque = (rate[Y_ANGULAR_MOMENTUM], rate[Y_ANGULAR_MOMENTUM + 1], rate[Y_ANGULAR_MOMENTUM + 2])
    turning = max(body.J[0], body.J[1], body.J[2]) * math.sqrt(qt.dot(torque, torque))
    return math.sqrt(qt.dot(a, a)) + body.radius * turning


@inlined
def settles_down(i, y, h, sleep, offset_frame, scratch, motion):
    """Put body i to sleep if it has moved little for two windows of time, and does not gather speed.

    y is the state after a step of h [s]. Returns whether the body has fallen asleep.
    """
    body = scratch.body
    if not falls_asleep(i, y, h, body, sleep):
        return False
    if 0.5 * h * h * acceleration_bound(y, offset_frame, scratch, motion) <= sleep.way * body.radius:
        return True
    wake_body(i, sleep)
    return False
