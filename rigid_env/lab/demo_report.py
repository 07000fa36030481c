"""Print the result of a run: events, energy, final state of the bodies, and quality of the contact solutions."""

from __future__ import annotations

import numpy as np
from rich.console import Console
from rich.text import Text

from rigid_env.lab.demo import Demo
from rigid_env.terminal import Column, Table, number_columns, say

SHOWN_EVENTS = 24
LAST_EVENTS = 8  # number of the shown events that are from the end of the run
FEW = 8  # largest number of bodies, or of contact points, that are printed one by one
QUANTITIES = (("pos", "m"), ("quat", ""), ("linvel", "m/s"), ("angvel", "rad/s"))
AXES = "x", "y", "z"


def show(demo: Demo, summary: dict, console: Console) -> None:
    """Print the result of a run, from its `Demo.summary`."""
    title = f", accuracy {demo.accuracy}, {demo.duration:g} s"
    console.print(Text.assemble((demo.name, "bold"), title))
    kinds = [type(body).__name__ for body in demo.scene.bodies]
    names = [body.name or kind for body, kind in zip(demo.scene.bodies, kinds)]
    if summary["events"]:
        console.print(event_table(summary["events"], names))
    else:
        say(console, "events", "none")
    say(console, "energy", _told_energy(summary["energy"]))
    final = summary["final"]
    _show_bodies(final, kinds, names, console)
    say(console, "at rest", "yes" if final["is_at_rest"] else "no")
    _show_contacts(summary["contacts"], console)
    status = summary["status"]
    colour = "green" if status["name"] == "ok" else "yellow"
    say(console, "status", Text.assemble((status["name"], colour), f": {status['message']}"))
    effort = f"{status['solves']} contact problems, {status['iterations']} sweeps, {status['fallbacks']} by pivoting"
    worst = f"worst residual {status['residual']:.2g}, deepest penetration {status['penetration']:.2g} m"
    say(console, "", f"{effort}, {status['unconverged']} above the tolerance; {worst}")


def _told_energy(energy: dict) -> str:
    """Energies at both ends, and the loss; where an effect may give energy, the change and these effects instead."""
    told = f"{energy['start']:.4f} J at the start, {energy['end']:.4f} J at the end"
    if energy["driven_work"] != 0.0:
        told += f", {energy['driven_work']:.4f} J of work by driven bodies"
    if energy["dissipated"] is not None:
        return f"{told}, {energy['dissipated']:.4f} J dissipated"
    change = energy["end"] - energy["start"] - energy["driven_work"]
    more = "gained" if change >= 0 else "lost"
    return f"{told}, {abs(change):.4f} J {more}: work of {', '.join(energy['sources'])} less dissipation"


def event_table(events: list[dict], names: list[str]) -> Table:
    """Table of events, the first and the last ones if there are many.

    `events` are dicts of `Demo.events`; `names` has the name or the class of each body.
    """
    columns = [*number_columns("time [s]"), Column("what"), Column("body"), Column("with")]
    more = len(events) - SHOWN_EVENTS
    caption = f"{more} more are left out; --json has all" if more > 0 else ""
    table = Table([*columns, *number_columns("impulse [N s]")], "events", caption)
    shown = events if more <= 0 else [*events[: SHOWN_EVENTS - LAST_EVENTS], None, *events[-LAST_EVENTS:]]
    for event in shown:
        if event is None:
            table.add_row("...", "", "", "", "")
            continue
        times = f" x {event['count']}" if event["count"] > 1 else ""
        impulse = float(np.linalg.norm(event["impulse"]))
        table.add_row(
            f"{event['t']:.4f}", event["kind"] + times, _name_of(event["body"], names), _partner(event, names),
            f"{impulse:.4g}" if impulse else "-",
        )  # fmt: skip
    return table


def _name_of(body: int, names: list[str]) -> str:
    return f"{body} {names[body]}" if body >= 0 else "-"


def _partner(event: dict, names: list[str]) -> str:
    """Name of the wall or the other body of an event."""
    return f"wall {event['wall']}" if event["wall"] >= 0 else _name_of(event["other"], names)


def _show_bodies(final: dict, kinds: list[str], names: list[str], console: Console) -> None:
    if len(kinds) == 1:
        for name, unit in QUANTITIES:
            say(console, name, f"({_numbers(final[name][0])}) {unit}".rstrip())
    elif len(kinds) <= FEW:
        console.print(_body_table(final, names))
    else:
        _summarise(final, kinds, names, console)


def _body_table(final: dict, names: list[str]) -> Table:
    heads = [f"{name} [{unit}]" if unit else name for name, unit in QUANTITIES]
    columns = [Column("body"), *number_columns(*heads)]
    table = Table(columns, "bodies at the end")
    for body, label in enumerate(names):
        cells = ("\n".join(_numbers([value]) for value in final[name][body]) for name, _ in QUANTITIES)
        table.add_row(f"{body} {label}", *cells)
    return table


def _summarise(final: dict, kinds: list[str], names: list[str], console: Console) -> None:
    """Print ranges of positions and the fastest bodies, instead of a row for each body."""
    counts = {kind: kinds.count(kind) for kind in dict.fromkeys(kinds)}
    say(console, "bodies", ", ".join(f"{count} {kind}" for kind, count in counts.items()))
    pos = np.array(final["pos"])
    ranges = (f"{axis} {low:.4g} .. {high:.4g}" for axis, low, high in zip(AXES, pos.min(axis=0), pos.max(axis=0)))
    say(console, "pos", f"{', '.join(ranges)} m")
    for name, unit in QUANTITIES[2:]:
        speeds = np.linalg.norm(final[name], axis=1)
        fastest = int(speeds.argmax())
        most = f"{speeds.max():.3g} {unit} at most, body {_name_of(fastest, names)}"
        told = f"{most}; median {np.median(speeds):.3g} {unit}"
        say(console, name, told)


def _show_contacts(contacts: dict, console: Console) -> None:
    points, forces = contacts["points"], contacts["forces"]
    if len(points) > FEW:
        say(console, "contacts", f"{len(points)} points")
        return
    for point, force in zip(points, forces):
        say(console, "contact", f"({_numbers(point)}) m, force ({_numbers(force)}) N")


def _numbers(values) -> str:
    """Text of numbers with four decimals and commas, without negative zeros."""
    return ", ".join(f"{round(value, 4) + 0.0:.4f}" for value in values)
