"""Tables of error against computing time for a terminal."""

from __future__ import annotations

import physics
from physics.work_precision.contender import OURS
from rigid_env.lab.measure.accuracy import Found
from rigid_env.terminal import Column, Table, number_columns

MARKS = "* nothing is better in less time   = as good as the truth is known   ! lost: no likeness of the truth"


def make_table(found: Found, is_full: bool = False) -> Table:
    """Table of the points of one scene, quickest first.

    Parameters
    ----------
    found : Found
    is_full : bool
        True: every point. False, with other engines: the front of each engine, and the best point of each setting.
    """
    frontier = found.frontier
    shown = frontier.points if is_full or not _has_peers(found) else _own_fronts(frontier)
    front = frontier.front()
    names = "dt, ms", f"error, {frontier.units[frontier.measure]}", "µs per s"
    columns = [Column("engine", is_whole=True), Column("setting"), *number_columns(*names), Column("", is_whole=True)]
    table = Table(columns, _title(found, len(shown)))
    for p in sorted(shown, key=lambda p: p.cost):
        marks = ("*" if p in front else "") + ("!" if p.is_lost else "=" if frontier.is_at_floor(p) else "")
        style = "bold" if p.engine == OURS else "" if p in front else "dim"
        numbers = (f"{1e3 * p.dt:g}", f"{frontier.error(p):.2g}", f"{1e6 * p.cost:.0f}")
        table.add_row(p.engine, p.setting, *numbers, marks, style=style)
    return table


def goals(found: Found) -> list[str]:
    """Lines below a table: the goals of this project for the scene, and the setting that reaches each."""
    unit, lines = found.frontier.units[found.frontier.measure], []
    for error, us, point in found.goals_met():
        how = f"reached by {point} in {1e6 * point.cost:.0f} µs" if point else "not reached"
        lines.append(f"goal ≤ {error:g} {unit} at ≤ {us:g} µs: {how}")
    return lines


def summary(found: Found) -> list[str]:
    """Lines below a table: how the error of each of our settings depends on the step, and skipped engines."""
    frontier, lines = found.frontier, []
    for engine, setting in frontier.families():
        if engine == OURS:
            lines.append(f"{setting}: {_behaviour(frontier, setting)}")
    lines += [f"skipped: {reason}" for reason in (*found.job.skipped, *frontier.skipped)]
    notes = dict.fromkeys(f"{p}: {p.note}" for p in frontier.points if p.note)
    lines += [f"not all well: {note}" for note in notes]
    if not frontier.is_complete:
        lines.append("interrupted: not all was measured")
    return lines


def answers(found: Found, error: float) -> list[str]:
    """Lines with the cheapest setting below an error: of our engine, and of all engines if there are others."""
    lines = [f"{found.job.key}, ours: {found.frontier.advice(error, engine=OURS)}"]
    if _has_peers(found):
        lines.append(f"{found.job.key}, all: {found.frontier.advice(error)}")
    return lines


def _behaviour(frontier: physics.Frontier, setting: str) -> str:
    order, plateau, lost = (getattr(frontier, name)(setting) for name in ("order", "plateau", "lost_from"))
    parts = [f"observed order {order:.2g}" if order is not None else "no order to be seen"]
    if plateau is not None:
        parts.append(f"no smaller than {plateau:.2g} with smaller steps" if plateau else "no error")
    if lost is not None:
        parts.append(f"lost from {1e3 * lost:g} ms")
    return ", ".join(parts)


def _title(found: Found, shown: int) -> str:
    frontier = found.frontier
    unit = frontier.units[frontier.measure]
    known = f", known to {frontier.own_error():.1e} {unit}" if frontier.own_error() else ""
    hidden = len(frontier.points) - shown
    more = f"\n{hidden} more points are beaten by their own engine: --all shows them" if hidden else ""
    return f"{found.job.key}: {found.job.what}\ntruth: {frontier.truth}{known}{more}"


def _has_peers(found: Found) -> bool:
    return any(p.engine != OURS for p in found.frontier.points)


def _own_fronts(frontier: physics.Frontier) -> list[physics.FrontierPoint]:
    """Points on the front of each engine, and the best point of each setting, so that every setting is shown."""
    shown = [p for engine in dict.fromkeys(p.engine for p in frontier.points) for p in frontier.front(engine=engine)]
    for engine, setting in frontier.families():
        best = min(frontier.of(setting, engine), key=lambda p: (frontier.error(p), p.cost))
        if best not in shown:
            shown.append(best)
    return shown
