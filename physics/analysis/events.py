"""Events of a simulated world, from the log of its steps and from changes of its contacts between samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from physics.html_table import fields_table
from physics.kernels.time_stepping import event_log
from physics.world.contacts import contacts_of_world
from physics.world.world import World

# Index of a body, and that of the other body, or -1 - k for wall k.
Pair = tuple[int, int]


@dataclass(frozen=True)
class Event:
    """Event of a body: at a wall, with another body, or alone.

    An ``impact`` is one event for each pair of bodies, or of a body and a wall; `impulse` is the sum over all their
    contacts. The change of a body's momentum by impacts is the sum of `impulse` over the events in which it is `body`,
    less the sum over the events in which it is `other`.

    Attributes
    ----------
    t : float
        Time of the event [s]. The event-driven scheme finds it to rounding. It leaves out the end of a sequence of ever
        smaller bounces; ``touch`` and ``rest`` then have the time at which that sequence would have ended. Time
        stepping finds the time of an ``impact``; for other kinds only the interval between two samples is known. `t`
        is the end of this interval; for a ``release``, the end of the last interval in which the contact pushed.
    kind : str
        ``impact`` (velocities jumped), ``touch`` (a resting contact began), ``release`` (a resting contact ended) or
        ``fault`` (see `StepReport.faults`). The event-driven scheme also has ``stick`` and ``slip`` (a resting contact
        ceased or began to slide) and ``rest`` (the body came to rest). In time stepping an approach so slow that loads
        could cause it within one step is a ``touch`` without an ``impact``.
    body : int
        Index of the body.
    wall : int
        Index of the wall; -1 where the event has none.
    impulse : (3,) tuple of float
        Impulse of an ``impact`` on `body`, world frame [N s]; zero for other kinds.
    other : int
        Index of the other body, which gets the opposite impulse; -1: none.
    point : (3,) tuple of float
        Point of `body` at which the impulse of an ``impact`` acts, world frame [m]; of several contacts the mean,
        weighted by their normal impulses. On a face the impulse at this point has the moment of all contacts, except
        the moment of friction about the normal. Zero for other kinds.
    normal : (3,) tuple of float
        Unit normal of an ``impact``, out of the wall or of the other body towards `body`, world frame; of several
        contacts the weighted mean. Zero for other kinds.
    name, other_name : str
        Names of `body` and of `other` in the scene; "" for a body without a name.
    """

    t: float
    kind: str
    body: int
    wall: int = -1
    impulse: tuple[float, float, float] = (0.0, 0.0, 0.0)
    other: int = -1
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)
    normal: tuple[float, float, float] = (0.0, 0.0, 0.0)
    name: str = ""
    other_name: str = ""

    _repr_html_ = fields_table


def logged_events(world: World, start: float) -> list[Event]:
    """Read the events of the last kernel call from the log, in the order of time; events without room are missing.

    Parameters
    ----------
    world : World
        Batch of one world, in which `World.make_event_room` has made room.
    start : float
        Time at which that call began [s].
    """
    events = []
    for body, (count, rows) in enumerate(zip(world.event_counts.tolist(), world.event_log)):
        for row in rows[:count].tolist():
            impulse, point, normal = (
                tuple(row[k : k + 3]) for k in (event_log.EVENT_IMPULSE, event_log.EVENT_POINT, event_log.EVENT_NORMAL)
            )
            t, kind, wall, other = row[: event_log.EVENT_IMPULSE]
            events.append(
                Event(start + t, event_log.KIND_NAMES[int(kind)], body, int(wall), impulse, int(other), point, normal)
            )
    return sorted(events, key=lambda event: event.t)


def named(events: list[Event], names: Sequence[str]) -> list[Event]:
    """Add the names of their bodies to events; `names` has a name for each body of the scene, or ""."""
    if not any(names):
        return events
    known = dict(enumerate(names))
    return [replace(each, name=known.get(each.body, ""), other_name=known.get(each.other, "")) for each in events]


def last_pushes(world: World, before: Mapping[Pair, float], t: float) -> dict[Pair, float]:
    """Find the last sample at which each present contact of world 0 pushed.

    Parameters
    ----------
    world : World
        World after a step.
    before : dict
        Result of this function at the sample before; empty at the first sample.
    t : float
        Time of the present sample [s].

    Returns
    -------
    dict
        Time of the last push [s] for each pair (body, other body or -1 - k for wall k). Contacts that have never pushed
        are left out: bodies that leave each other after an impact do not rest.
    """
    found = contacts_of_world(world, 0)
    touching = [(int(body), int(other)) for body, other in found.ends[0]]
    pushing = {pair for pair, is_pushing in zip(touching, found.force[0].any(axis=1)) if is_pushing}
    return {pair: t if pair in pushing else before[pair] for pair in touching if pair in pushing or pair in before}


def contact_events(before: Mapping[Pair, float], now: Mapping[Pair, float], t: float) -> list[Event]:
    """Make ``touch`` and ``release`` events for the contacts that began and ended between two samples.

    `before` and `now` are the results of `last_pushes` at both samples; the later sample is at `t` [s]. A ``release``
    has the time of the contact's last push, although the contact stays in these results until its gap exceeds the slop.
    """
    began = [("touch", pair, t) for pair in now.keys() - before.keys()]
    ended = [("release", pair, before[pair]) for pair in before.keys() - now.keys()]
    events = []
    for found in (began, ended):
        for kind, (body, other), when in sorted(found, key=lambda each: (each[1][0], abs(each[1][1]), each[1][1])):
            events.append(Event(when, kind, body, max(-1, -1 - other), other=max(-1, other)))
    return events


def fault_events(world: World, t: float) -> list[Event]:
    """List with the ``fault`` event of world 0's last step, empty without a fault; `t` is the end of the step [s]."""
    report = world.report
    return [Event(t, "fault", int(report.fault_body[0]))] if report.faults[0] else []
