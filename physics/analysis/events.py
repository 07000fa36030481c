"""Events of a run, from a world's log and from changes of its contacts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from physics.html_table import fields_table
from physics.kernels.time_stepping import event_log
from physics.world.contacts import contacts_of_world
from physics.world.world import World

# A body, and the other one or -1 - k for wall k.
Pair = tuple[int, int]


@dataclass(frozen=True)
class Event:
    """Event of a body, at a wall, with another body or alone.

    An ``impact`` is one event for each pair of bodies, or body and wall, however many contacts they have: `impulse` is
    the sum over these. The change of a body's momentum by impacts is the sum of `impulse` over the events of which it
    is the `body`, less that over those of which it is the `other`.

    Attributes
    ----------
    t : float
        When [s]. The event-driven scheme knows it to rounding; where it has left out the end of a sequence of ever
        smaller bounces, the contact's ``touch`` and the body's ``rest`` come when that would have ended. Time
        stepping knows the moment of an ``impact``; of the other kinds the sample interval. `t` is its end, but for a
        ``release``, which comes at the end of the last one in which the contact pushed.
    kind : str
        ``impact`` (velocities jumped), ``touch`` (a resting contact began), ``release`` (one ended), ``fault``; of
        the event-driven scheme also ``stick`` and ``slip`` (a resting contact ceased or began to slide) and
        ``rest`` (the body came to rest). What time stepping meets so slowly that loads could have made it as fast
        within a step is a ``touch`` without an ``impact``.
    body : int
    wall : int
        -1 where the kind has none, and where bodies meet.
    impulse : (3,) tuple of float
        Of an ``impact``, on the `body`, world frame [N s]; zero for the other kinds.
    other : int
        The other body where two meet, which gets the opposite impulse; -1: none.
    point : (3,) tuple of float
        Of an ``impact``: the point of `body` where the impulse acts, of several contacts the mean weighted by their
        normal impulses, world frame [m]. On a face the impulse acts there with the moment of all contacts but for
        what friction exerts about the normal. Zero for the other kinds.
    normal : (3,) tuple of float
        Of an ``impact``: unit normal out of the wall or of the other body towards `body`, of several contacts the
        weighted mean, world frame. Zero for the other kinds.
    name, other_name : str
        Of `body` and of `other` in the scene; "" where they have none.
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
    """Events of the last call of a step that fitted into the log, in the order of time.

    Parameters
    ----------
    world : World
        Of one world; `World.make_event_room` has made room.
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
    """Events with the names of their bodies; `names` has "" for a body without one."""
    if not any(names):
        return events
    known = dict(enumerate(names))
    return [replace(each, name=known.get(each.body, ""), other_name=known.get(each.other, "")) for each in events]


def last_pushes(world: World, before: Mapping[Pair, float], t: float) -> dict[Pair, float]:
    """Time at which each resting contact of world 0 last pushed, as known at the time t.

    Parameters
    ----------
    world : World
    before : dict
        What this function has returned at the sample before; empty at the first one.
    t : float
        Now [s].

    Returns
    -------
    dict
        From body, and other body or -1 - k for wall k, to a time [s]. Contacts that have not pushed yet are left out:
        bodies that leave each other after an impact do not rest.
    """
    found = contacts_of_world(world, 0)
    touching = [(int(body), int(other)) for body, other in found.ends[0]]
    pushing = {pair for pair, is_pushing in zip(touching, found.force[0].any(axis=1)) if is_pushing}
    return {pair: t if pair in pushing else before[pair] for pair in touching if pair in pushing or pair in before}


def contact_events(before: Mapping[Pair, float], now: Mapping[Pair, float], t: float) -> list[Event]:
    """Contacts that began and ended between two samples, from `last_pushes` at both; the later sample is at t [s].

    A contact ends at its last push. It stays in the set after that until its gap exceeds the slop.
    """
    began = [("touch", pair, t) for pair in now.keys() - before.keys()]
    ended = [("release", pair, before[pair]) for pair in before.keys() - now.keys()]
    events = []
    for found in (began, ended):
        for kind, (body, other), when in sorted(found, key=lambda each: (each[1][0], abs(each[1][1]), each[1][1])):
            events.append(Event(when, kind, body, max(-1, -1 - other), other=max(-1, other)))
    return events


def fault_events(world: World, t: float) -> list[Event]:
    """Fault of the last step of world 0, as events: one or none; `t` is the end of that step [s]."""
    report = world.report
    return [Event(t, "fault", int(report.fault_body[0]))] if report.faults[0] else []
