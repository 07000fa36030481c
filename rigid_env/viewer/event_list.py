"""List of events beside the picture; a click on one goes to its time."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from physics import Event

ROWS = 8
"""Events that are in sight."""


class EventList:
    """The latest events, newest first, and a slider to earlier ones.

    Parameters
    ----------
    gui : viser.GuiApi
    go_to : callable
        Takes the time of an event [s].
    """

    def __init__(self, gui, go_to: Callable[[float], None]):
        self._times: list[float | None] = [None] * ROWS
        self._events: Sequence[Event] = []
        self._back = gui.add_slider("earlier", 0, 1, 1, 0, visible=False)
        self._back.on_update(lambda _: self._fill())
        self._count = gui.add_markdown("none yet")
        self._rows = [gui.add_button("-", visible=False, color="gray") for _ in range(ROWS)]
        for k, row in enumerate(self._rows):
            row.on_click(lambda _, k=k: self._times[k] is not None and go_to(self._times[k]))

    def show(self, events: Sequence[Event]) -> None:
        """Bring the list up to date."""
        if len(events) == len(self._events) and all(new is old for new, old in zip(events[-1:], self._events[-1:])):
            return
        self._events = list(events)
        earlier = max(0, len(events) - ROWS)
        if earlier:
            self._back.max = earlier
        if self._back.visible != bool(earlier):
            self._back.visible = bool(earlier)
        if self._back.value > earlier:
            self._back.value = earlier
        self._count.content = f"{len(events)} so far" if events else "none yet"
        self._fill()

    def _fill(self) -> None:
        newest = self._events[::-1][int(self._back.value) :][:ROWS]
        for k, row in enumerate(self._rows):
            event = newest[k] if k < len(newest) else None
            self._times[k] = None if event is None else event.t
            text = "-" if event is None else told(event)
            if row.label != text:
                row.label = text
            if row.visible != (event is not None):
                row.visible = event is not None


def told(event: Event) -> str:
    """One line about an event."""
    other = event.other_name or f"body {event.other}"
    where = f", {other}" if event.other >= 0 else f", wall {event.wall}" if event.wall >= 0 else ""
    return f"{event.t:.3f} s  {event.kind}: {event.name or f'body {event.body}'}{where}"
