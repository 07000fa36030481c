"""Actuators: limit a commanded wrench, and let the actual wrench follow it with a first-order lag."""

from __future__ import annotations

import math

from physics.compiler.decorators import entry_kernel, inlined


@inlined
def _shorten(command, i, first, limit):
    """Shorten a vector, three numbers of row i of `command` from column `first`, to the length `limit` at most."""
    x, y, z = command[i, first], command[i, first + 1], command[i, first + 2]
    size = math.sqrt(x * x + y * y + z * z)
    if size > limit:
        share = limit / size
        command[i, first], command[i, first + 1], command[i, first + 2] = share * x, share * y, share * z


@entry_kernel
def clamp_command(command, limit_force, limit_torque):
    """Shorten the forces and torques in `command` (rows, 6) [N, N m] to limits, in place.

    The force keeps its direction, and so does the torque. A limit of inf has no effect.
    """
    for i in range(command.shape[0]):
        _shorten(command, i, 0, limit_force)
        _shorten(command, i, 3, limit_torque)


@entry_kernel
def apply_actuator_lag(command, gone, kept, share, is_first, output, applied):
    """Let the wrench `output` follow the constant wrench `command` for some time, both (rows, 6) [N, N m].

    At the end of the time, the share `gone` of the initial difference between `command` and `output` has vanished. On
    average over the time, the share `kept` of this difference remains. The mean of `output`, times `share`, is added to
    `applied` (rows, 6), or written to it if `is_first`.
    """
    for i in range(command.shape[0]):
        for c in range(6):
            gap = output[i, c] - command[i, c]
            mean = share * (command[i, c] + kept * gap)
            applied[i, c] = mean if is_first else applied[i, c] + mean
            output[i, c] -= gone * gap
