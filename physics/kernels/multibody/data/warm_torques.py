"""Torques of rolling and spin friction that stay from stage to stage, behind the contacts in a world's row of `memory`.

They are numbered as the stored contacts. `physics.kernels.multibody.solver.resistance_torques` starts from them. All of
this is left out of kernels whose scene declares neither effect.
"""

from __future__ import annotations

from physics.compiler.decorators import if_given, inlined
from physics.kernels.multibody.data.arrays import TORQUE_SIZE, WARM_CONTACT_SIZE, WARM_HEADER_SIZE


@inlined
def _torque_column(k, many):
    """First column of the torque of stored contact k in a row of `memory`."""
    return WARM_HEADER_SIZE + WARM_CONTACT_SIZE * many.contacts.gap.shape[0] + TORQUE_SIZE * k


@if_given("many.resistance")
def load_warm_torque(k, found, scale, world, memory, many):
    """Read the torque of contact k, `scale` times that of stored contact `found`; 0 if that is below 0."""
    for c in range(TORQUE_SIZE):
        kept = memory[world, _torque_column(found, many) + c] if found >= 0 else 0.0
        many.resistance.torque[k, c] = scale * kept


@if_given("many.resistance")
def store_warm_torque(k, to, world, memory, many):
    """Store the torque of contact k as that of stored contact `to`."""
    for c in range(TORQUE_SIZE):
        memory[world, _torque_column(to, many) + c] = many.resistance.torque[k, c]


@if_given("many.resistance")
def move_warm_torque(k, to, scale, world, memory, many):
    """Move the torque of stored contact k to stored contact `to`, times `scale`."""
    for c in range(TORQUE_SIZE):
        memory[world, _torque_column(to, many) + c] = scale * memory[world, _torque_column(k, many) + c]


@if_given("many.resistance")
def copy_warm_torques(count, source, i, target, j, many):
    """Copy the torques of the first `count` stored contacts from row i of `source` to row j of `target`."""
    for c in range(_torque_column(0, many), _torque_column(count, many)):
        target[j, c] = source[i, c]


@if_given("many.resistance")
def clear_torque(k, many):
    """Set the torque of contact k to 0."""
    for c in range(TORQUE_SIZE):
        many.resistance.torque[k, c] = 0.0
