"""Equilibrium of bodies that may fall asleep under error control, whose stages may be as long as a step.

A ball may bounce in a period that divides the step. At its highest point it is back at the same place after each step,
without velocity, but nothing holds it there. So bodies fall asleep only where loads and contact forces balance each
other. `event_driven.falling_asleep` has the same rule for bodies at walls.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.arrays import (
    WARM_BODY_A,
    WARM_BODY_B,
    WARM_CONTACT_COUNT,
    WARM_CONTACT_SIZE,
    WARM_HEADER_SIZE,
    WARM_IMPULSE,
    WARM_STAGE_LENGTH,
)
from physics.kernels.state.fixed_body import is_fixed
from physics.kernels.state.sleeping import is_asleep, wake_body


@if_given("kept")
def keep_unbalanced_awake(world, h, kept, sleep, memory, many):
    """Start anew with the windows of awake bodies that forces would move by more than the threshold in h [s].

    Forces are the loads on a body, and those of the contacts stored in `memory` at the end of the last stage. They are
    added up in `many.islands.group_motion`. `kept` is None without error control.
    """
    force, length = many.islands.group_motion, memory[world, WARM_STAGE_LENGTH]
    for b in range(many.bodies.state.shape[0]):
        for c in range(3):
            force[b, c] = many.bodies.body[b].mass * many.bodies.body[b].free_acceleration[c]
    for k in range(int(memory[world, WARM_CONTACT_COUNT])):
        row = WARM_HEADER_SIZE + WARM_CONTACT_SIZE * k
        a, b = int(memory[world, row + WARM_BODY_A]), int(memory[world, row + WARM_BODY_B])
        for c in range(3):
            push = memory[world, row + WARM_IMPULSE + c] / length
            force[a, c] += push
            if b >= 0:
                force[b, c] -= push
    for b in range(many.bodies.state.shape[0]):
        i, total = world * many.bodies.state.shape[0] + b, row_vector(force, b, 0)
        if is_fixed(b, many.bodies) or is_asleep(i, sleep):
            continue
        way = 0.5 * h * h * many.bodies.inv_mass[b] * math.sqrt(qt.dot(total, total))
        if not way <= sleep.way * many.bodies.body[b].radius:
            wake_body(i, sleep)
