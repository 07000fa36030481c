"""Snapshots of a world, to which error control of a substep returns (`adaptive_substep`)."""

from __future__ import annotations

from physics.compiler.decorators import inlined
from physics.kernels.multibody.data.arrays import WARM_CONTACT_COUNT, WARM_CONTACT_SIZE, WARM_HEADER_SIZE
from physics.kernels.multibody.data.warm_depths import copy_warm_depths
from physics.kernels.multibody.data.warm_torques import copy_warm_torques
from physics.kernels.state import layout as at

# Index of a snapshot: at the start of a part, after its single step, after the first of its two half steps, after both
# (only for a lone body, `lone_part`).
SNAPSHOT_START, SNAPSHOT_COARSE, SNAPSHOT_MIDDLE, SNAPSHOT_END = range(4)


@inlined
def save_snapshot(slot, world, kept, memory, report, many, counts):
    """Save the present state of the world in `kept`, at index `slot` (`SNAPSHOT_START` ...).

    A snapshot has the states of the bodies, the world's rows of `memory` and `report`, and its counts of events.
    """
    for b in range(many.bodies.state.shape[0]):
        for c in range(many.bodies.state.shape[1]):
            kept.state[slot, b, c] = many.bodies.state[b, c]
    for c in range(WARM_HEADER_SIZE + WARM_CONTACT_SIZE * int(memory[world, WARM_CONTACT_COUNT])):
        kept.memory[slot, c] = memory[world, c]
    copy_warm_torques(int(memory[world, WARM_CONTACT_COUNT]), memory, world, kept.memory, slot, many)
    copy_warm_depths(int(memory[world, WARM_CONTACT_COUNT]), memory, world, kept.memory, slot, many)
    for c in range(at.REPORT_SIZE):
        kept.report[slot, c] = report[world, c]
    for b in range(many.bodies.state.shape[0]):
        kept.counts[slot, b] = counts[world * many.bodies.state.shape[0] + b]


@inlined
def restore_snapshot(slot, world, kept, memory, report, many, counts):
    """Restore the state of the world from `kept`, at index `slot`, except solves and iterations in the report.

    Events logged since the snapshot are dropped: later events overwrite their rows.
    """
    for b in range(many.bodies.state.shape[0]):
        for c in range(many.bodies.state.shape[1]):
            many.bodies.state[b, c] = kept.state[slot, b, c]
    for c in range(WARM_HEADER_SIZE + WARM_CONTACT_SIZE * int(kept.memory[slot, WARM_CONTACT_COUNT])):
        memory[world, c] = kept.memory[slot, c]
    copy_warm_torques(int(kept.memory[slot, WARM_CONTACT_COUNT]), kept.memory, slot, memory, world, many)
    copy_warm_depths(int(kept.memory[slot, WARM_CONTACT_COUNT]), kept.memory, slot, memory, world, many)
    for c in range(at.REPORT_SIZE):
        if c != at.SOLVES and c != at.ITERATIONS:
            report[world, c] = kept.report[slot, c]
    for b in range(many.bodies.state.shape[0]):
        counts[world * many.bodies.state.shape[0] + b] = kept.counts[slot, b]
