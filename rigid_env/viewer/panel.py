"""Panel of controls beside the picture: it passes the user's changes to the session, and shows the session's state."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from physics import PRESETS, Event
from physics.scene.body_names import body_label, body_names
from rigid_env.viewer.plots import Plots
from rigid_env.viewer.session import Session
from rigid_env.viewer.stage import LAYERS, Stage

SPEEDS = ("0.1", "0.25", "0.5", "1", "2", "4")
SLIDERS = {"gravity": ("gravity [m/s²]", 0.0, 30.0, 0.01), "friction": ("friction", 0.0, 2.0, 0.01),
           "restitution": ("restitution", 0.0, 1.0, 0.01)}  # fmt: skip
ROOM = "the room"
"""Entry of the camera's menu for a camera that follows no body."""

KICK = 1.0
"""Change of a body's speed by a click, before the user changes it [m/s]."""

ROWS = 8
"""Events that the list shows at once."""


class Panel:
    """Controls of a viewer, as elements of viser's page.

    Parameters
    ----------
    gui : viser.GuiApi
    session : Session
    stage : Stage
    post : callable
        Takes a function and runs it in the session's thread. Callbacks need it, since they run in threads of the
        server.
    """

    def __init__(self, gui, session: Session, stage: Stage, post: Callable[[Callable[[], Any]], None]):
        self._gui, self._session, self._stage, self._post = gui, session, stage, post
        self._pending: list[Any] = []  # controls whose new value has not reached the session yet
        self._told: dict[tuple[int, str], Any] = {}  # properties of controls as the page shows them
        self._status = gui.add_markdown("")
        self._sliders: dict[str, Any] = {}
        self._accuracy = None
        with gui.add_folder("Time"):
            self._time_controls()
        if any((session.can.gravity, session.can.friction, session.can.restitution, session.can.accuracy)):
            with gui.add_folder("Physics"):
                self._physics_controls()
        if session.can.drag:
            with gui.add_folder("Hand"):
                self._hand_controls()
        with gui.add_folder("Show", expand_by_default=False):
            self._layer_controls()
        self._plots = Plots(gui, gui.add_folder("Plots", expand_by_default=False))
        with gui.add_folder("Events", expand_by_default=False):
            self._events = EventList(gui, lambda time: post(lambda: session.seek(time)))

    @property
    def kick_speed(self) -> float:
        """Change of a body's speed by a click on it [m/s]; 0: a click has no effect."""
        return self._kick.value if self._session.can.drag and self._kicks.value else 0.0

    def show(self) -> None:
        """Update all controls, plots and texts from the state of the session."""
        session = self._session
        text = self._cost_text()
        self._put(self._status, "content", "  \n".join(filter(None, (session.message, text))) or "ready")
        first, last = session.span
        self._put(self._slider, "max", max(last, first + 1e-3))
        self._put(self._slider, "min", first)
        self._put(self._slider, "value", min(max(session.time, first), last))
        self._put(self._play, "label", "Pause" if session.is_playing else "Play")
        for name, slider in self._sliders.items():
            self._put(slider, "value", session.settings[name])
        if self._accuracy is not None and not session.is_compiling:
            self._put(self._accuracy, "value", session.accuracy)
        self._plots.show(session.samples)
        self._events.show(session.events)

    def _put(self, handle, name: str, value) -> None:
        """Set property `name` of a control if the session has changed its value; the user's latest input stays."""
        key = id(handle), name
        if self._told.get(key) == value or any(handle is each for each in self._pending):
            return
        self._told[key] = value
        if getattr(handle, name) != value:
            setattr(handle, name, value)

    # --- groups of controls --------------------------------------------------------------------------------------

    def _time_controls(self) -> None:
        gui, session = self._gui, self._session
        self._play = self._button("Play", lambda: session.pause() if session.is_playing else session.play())
        self._button("Step", self._step)
        self._slider = gui.add_slider("time [s]", 0.0, 1e-3, 1e-3, 0.0)
        self._when(self._slider, session.seek)
        speed = gui.add_dropdown("speed", SPEEDS, initial_value="1")
        self._when(speed, lambda value: setattr(session, "speed", float(value)))
        seed = None
        if session.can.seed:
            seed = gui.add_number("seed", session.seed, min=0, max=2**32 - 1, step=1)
        self._button("Reset", lambda: session.reset(None if seed is None else int(seed.value)))
        names = body_names(session.subject.scene)
        bodies = [f"body {body_label(k, names)}" for k in range(len(session.look().frame.bodies))]
        follow = gui.add_dropdown("follow", (ROOM, *bodies), initial_value=ROOM)
        self._when(follow, lambda value: self._stage.follow(None if value == ROOM else bodies.index(value)))

    def _step(self) -> None:
        self._session.pause()
        self._session.step()

    def _physics_controls(self) -> None:
        gui, session = self._gui, self._session
        for name, value in session.settings.items():
            label, low, high, step = SLIDERS[name]
            self._sliders[name] = gui.add_slider(label, low, max(high, value), step, value)
            self._when(self._sliders[name], getattr(session, f"set_{name}"))
        if session.can.accuracy:
            options = list(dict.fromkeys((*PRESETS, session.accuracy)))
            self._accuracy = gui.add_dropdown("accuracy", options, initial_value=session.accuracy)
            self._when(self._accuracy, session.set_accuracy)
        if session.can.ghost:
            self._when(gui.add_checkbox("ghost at reference", False), session.set_ghost)

    def _hand_controls(self) -> None:
        self._kicks = self._gui.add_checkbox("a click kicks", True, hint="A body, along the line of sight")
        self._kick = self._gui.add_slider("kick [m/s]", 0.1, 10.0, 0.1, KICK)
        self._gui.add_markdown("Drag a body with the left button: a spring pulls it.")

    def _layer_controls(self) -> None:
        for name in LAYERS:
            box = self._gui.add_checkbox(name, self._stage.has_layer(name))
            self._when(box, lambda value, name=name: self._stage.set_layer(name, value))

    # --- callbacks -------------------------------------------------------------------------------------------------

    def _button(self, label: str, act: Callable[[], Any]):
        button = self._gui.add_button(label)
        button.on_click(lambda _: self._post(act))
        return button

    def _when(self, handle, act: Callable[[Any], Any]) -> None:
        """Call `act` with the new value of a control whenever the user has changed it."""

        @handle.on_update
        def _(event) -> None:
            if event.client is not None:  # not the panel itself
                value = handle.value
                self._pending.append(handle)
                self._post(lambda: self._do(handle, act, value))

    def _do(self, handle, act: Callable[[Any], Any], value: Any) -> None:
        self._pending.remove(handle)
        self._told[id(handle), "value"] = value
        act(value)

    def _cost_text(self) -> str:
        """Text of one to three lines with the computing time at this accuracy, and at the ghost's."""
        samples, session = self._session.samples, self._session
        if not len(samples) or not session.accuracy:
            return ""
        lines = [f"{session.accuracy}: {_microseconds(samples.cost[-1])}"]
        if session.ghost_label:
            lines.append(f"{session.ghost_label}: {_microseconds(samples.cost_of_reference[-1])}")
            lines.append(f"distance {_number(samples.error[-1])} m")
        return "  \n".join(lines)


def _microseconds(cost: float) -> str:
    return f"{cost:,.0f} µs per simulated second" if cost == cost else "not measured yet"


def _number(value: float) -> str:
    return f"{value:.2g}" if value == value else "-"


# --- events --------------------------------------------------------------------------------------------------------


class EventList:
    """The latest events, newest first, with a slider to earlier ones.

    Parameters
    ----------
    gui : viser.GuiApi
    go_to : callable
        Called with the time of an event that was clicked [s].
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
        """Update the list from all events so far."""
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
    """Text of one line about an event: time, kind, body, and the other body or the wall."""
    other = event.other_name or f"body {event.other}"
    where = f", {other}" if event.other >= 0 else f", wall {event.wall}" if event.wall >= 0 else ""
    return f"{event.t:.3f} s  {event.kind}: {event.name or f'body {event.body}'}{where}"
