"""Depths of compliant contacts that stay from stage to stage, behind all others in a world's row of `memory`.

They are the depths that the contact problem has foretold for the end of a stage, so that forces have done the work
which their springs store. They are numbered as the stored contacts. All of this is left out of kernels whose scene has
rigid contact.
"""

from __future__ import annotations

from physics.compiler.decorators import if_given, inlined
from physics.kernels.multibody.data.arrays import TORQUE_SIZE, WARM_CONTACT_SIZE, WARM_HEADER_SIZE


def _no_torque(many):
    return 0


@if_given("many.resistance", _no_torque)
def _torque_size(many):
    return TORQUE_SIZE


@inlined
def depth_column(k, many):
    """Column of the depth of stored contact k in a row of `memory`."""
    return WARM_HEADER_SIZE + (WARM_CONTACT_SIZE + _torque_size(many)) * many.contacts.gap.shape[0] + k


@if_given("many.compliance")
def store_warm_depth(k, to, world, memory, many):
    """Store the foretold depth of contact k [m] as that of stored contact `to`."""
    memory[world, depth_column(to, many)] = -min(many.compliance.end_gap[k], 0.0)


@if_given("many.compliance")
def move_warm_depth(k, to, world, memory, many):
    """Move the depth of stored contact k to stored contact `to`."""
    memory[world, depth_column(to, many)] = memory[world, depth_column(k, many)]


@if_given("many.compliance")
def copy_warm_depths(count, source, i, target, j, many):
    """Copy the depths of the first `count` stored contacts from row i of `source` to row j of `target`."""
    for c in range(depth_column(0, many), depth_column(count, many)):
        target[j, c] = source[i, c]
