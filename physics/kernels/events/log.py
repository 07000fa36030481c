"""The record of what happened: one row per event."""

from __future__ import annotations

from physics.kernels.compiler import kernel

# Kinds of event.
IMPACT, TOUCH, RELEASE, STICK, SLIP, REST, FAULT = range(7)
KINDS = ("impact", "touch", "release", "stick", "slip", "rest", "fault")

# Columns: time since the start of the step [s], kind, wall (-1: none), impulse [N s].
TIME, KIND, WALL, IMPULSE = 0, 1, 2, 3
EVENT_SIZE = 6


@kernel
def note_event(log, counts, i, t, kind, wall, impulse):
    """Add an event of body i; what finds no room is counted."""
    k = counts[i]
    counts[i] = k + 1
    if k < log.shape[1]:
        log[i, k, TIME], log[i, k, KIND], log[i, k, WALL] = t, kind, wall
        for c in range(3):
            log[i, k, IMPULSE + c] = impulse[c]
