"""Actuator law of a command: limits, and the exact first-order lag while the command is held."""

from __future__ import annotations

import math

from physics.compiler.decorators import entry_kernel, inlined


@inlined
def _shorten(command, i, first, limit):
    """Shorten three numbers of a row to a length."""
    x, y, z = command[i, first], command[i, first + 1], command[i, first + 2]
    size = math.sqrt(x * x + y * y + z * z)
    if size > limit:
        share = limit / size
        command[i, first], command[i, first + 1], command[i, first + 2] = share * x, share * y, share * z


@entry_kernel
def clamp_command(command, limit_force, limit_torque):
    """Shorten forces and torques of `command` (rows, 6) to limits [N, N m], inf where there is none."""
    for i in range(command.shape[0]):
        _shorten(command, i, 0, limit_force)
        _shorten(command, i, 3, limit_torque)


@entry_kernel
def apply_actuator_lag(command, gone, kept, share, is_first, output, applied):
    """Let `output` follow a held `command`, both (rows, 6); add its mean over the time, times `share`, to `applied`.

    The output covers the share `gone` of its distance to the command by the end; the share `kept` of it is missing in
    the mean.
    """
    for i in range(command.shape[0]):
        for c in range(6):
            gap = output[i, c] - command[i, c]
            mean = share * (command[i, c] + kept * gap)
            applied[i, c] = mean if is_first else applied[i, c] + mean
            output[i, c] -= gone * gap
