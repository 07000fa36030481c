"""Log the events of a step, such as impacts: one row per event, for each body in order of time.

`log` (rows, room, EVENT_SIZE) has the events of each body, `counts` (rows,) their number. A step without room for
events (`World.make_event_room`), room = 0, logs none.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from physics.compiler.decorators import inlined, kernel
from physics.kernels.half_space.contact_point import wall_of
from physics.kernels.math import quaternion as qt

# Kinds of event.
KIND_IMPACT, KIND_TOUCH, KIND_RELEASE, KIND_STICK, KIND_SLIP, KIND_REST, KIND_FAULT = range(7)
KIND_NAMES = ("impact", "touch", "release", "stick", "slip", "rest", "fault")

# Columns of an event: time since the start of the call [s], kind, wall and other body (-1: none); for an impact also
# the impulse on the body [N s], the point where it acts [m] and the unit normal towards the body, in the world frame.
EVENT_TIME, EVENT_KIND, EVENT_WALL, EVENT_OTHER, EVENT_IMPULSE, EVENT_POINT, EVENT_NORMAL = 0, 1, 2, 3, 4, 7, 10
EVENT_SIZE = 13

NOBODY = -1

# An impulse below this share of the largest impulse of the same impact is rounding.
EVENT_IMPULSE_ROUNDING = 1.0e-14


class EventRow(NamedTuple):
    """One event of a body; vectors are in the world frame, and zero for kinds of events without them."""

    kind: int  # KIND_IMPACT and so on
    wall: int  # wall, or NOBODY
    other: int  # body, or NOBODY
    impulse: tuple  # 3 scalars, on the body [N s]
    point: tuple  # 3 scalars [m]
    normal: tuple  # 3 scalars, towards the body


@kernel
def note_event(log, counts, i, t, event):
    """Add an event (`EventRow`) of body i at the time t [s] to the log; an event without room is only counted."""
    k = counts[i]
    counts[i] = k + 1
    if k < log.shape[1]:
        log[i, k, EVENT_TIME], log[i, k, EVENT_KIND] = t, event.kind
        log[i, k, EVENT_WALL], log[i, k, EVENT_OTHER] = event.wall, event.other
        for c in range(3):
            log[i, k, EVENT_IMPULSE + c] = event.impulse[c]
            log[i, k, EVENT_POINT + c] = event.point[c]
            log[i, k, EVENT_NORMAL + c] = event.normal[c]


@inlined
def clear_events(world, bodies, log, counts):
    """Set the event counts of all bodies of a world to zero, if the log has room for events.

    `bodies` is the number of bodies in a world.
    """
    if log.shape[1] > 0:
        for i in range(world * bodies, (world + 1) * bodies):
            counts[i] = 0


@kernel
def drop_events(world, bodies, t, log, counts):
    """Remove the events of a world at times from t [s] on, for a state that was put back to the time t.

    `bodies` is the number of bodies in a world.
    """
    for i in range(world * bodies, (world + 1) * bodies):
        while 0 < counts[i] <= log.shape[1] and log[i, counts[i] - 1, EVENT_TIME] >= t:
            counts[i] -= 1


@inlined
def note_mode_change(log, counts, i, t, kind, wall):
    """Add an event of body i at a wall, without an impulse, to the log: time t [s], `kind` KIND_TOUCH and so on."""
    zero = (0.0, 0.0, 0.0)
    note_event(log, counts, i, t, EventRow(kind, wall, NOBODY, zero, zero, zero))


@inlined
def add_weighted_contact(sums, normal, pushed, point):
    """Add a contact to the sums (normals, points, weights) of the contacts of one pair; return the new sums.

    Normals and points are weighted by the normal impulse `pushed` [N s]. If all normals are the same, the normal
    impulses have no moment about the mean point.
    """
    n, r, weight = sums
    s = max(pushed, 0.0)
    return (
        (n[0] + s * normal[0], n[1] + s * normal[1], n[2] + s * normal[2]),
        (r[0] + s * point[0], r[1] + s * point[1], r[2] + s * point[2]),
        weight + s,
    )


@inlined
def note_impact(log, counts, i, t, wall, other, impulse, sums):
    """Add the impact of body i with a wall or another body to the log, if it has pushed.

    t is its time [s], `impulse` the sum over its contacts [N s]. Point and normal are the means of the weighted sums
    of `add_weighted_contact`.
    """
    n, r, weight = sums
    size = math.sqrt(qt.dot(n, n))
    if not (weight > 0.0 and size > 0.0):
        return
    normal, point = (n[0] / size, n[1] / size, n[2] / size), (r[0] / weight, r[1] / weight, r[2] / weight)
    note_event(log, counts, i, t, EventRow(KIND_IMPACT, wall, other, impulse, point, normal))


@kernel
def log_wall_impacts(n, width, x, least, t, scratch, log, counts):
    """Log one impact for each wall whose contacts in `scratch` have a total impulse of more than `least` [N s].

    n is the number of contacts, `width` the number of impulses of each, 1 without friction and 3 with it. x is the
    position of the body [m], t the time of the impacts [s].
    """
    contacts = scratch.contacts
    walls = scratch.scene.walls
    for wall in range(walls.shape[0]):
        px = py = pz = 0.0
        sums = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0)
        for i in range(n):
            if wall_of(contacts.slot[i], scratch.scene) == wall:
                for c in range(width):
                    s = contacts.impulse[width * i + c]
                    px += s * walls[wall, 3 * c]
                    py += s * walls[wall, 3 * c + 1]
                    pz += s * walls[wall, 3 * c + 2]
                point = (x[0] + contacts.arm[i, 0], x[1] + contacts.arm[i, 1], x[2] + contacts.arm[i, 2])
                normal = (walls[wall, 0], walls[wall, 1], walls[wall, 2])
                sums = add_weighted_contact(sums, normal, contacts.impulse[width * i], point)
        if px * px + py * py + pz * pz > least * least:
            note_impact(log, counts, scratch.body.i, t, wall, NOBODY, (px, py, pz), sums)
