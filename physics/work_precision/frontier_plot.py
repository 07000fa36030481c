"""Work-precision diagram as a picture: error over computing time, both logarithmic, with a line for each setting."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from physics.optional import load_optional
from physics.work_precision.contender import OURS

if TYPE_CHECKING:
    from physics.work_precision.result import Frontier

PANEL = (5.0, 3.9)  # [inch]
DPI = 130

# Settings of this engine are circles with a colour for each; every other engine has one marker and one colour.
OUR_COLOURS = ("#56b4e9", "#0072b2", "#009e73", "#003f5c", "#66a182")
OUR_SIZES = (8.5, 6.5, 4.5)  # of circles [pt]; different, so that settings which coincide can both be seen
PEER_STYLES = (("^", "#d55e00"), ("s", "#cc79a7"), ("D", "#e69f00"), ("v", "#8c6bb1"))
PEER_SIZE = 4.0  # [pt]
INK, PALE, GOLD = "#222222", "#8a8a8a", "#f0c000"

# An error of exactly zero is drawn so many decades below the smallest error above zero, or goal.
ZERO_GAP = 0.7

Style = tuple[str, str, float]
Goals = Sequence[tuple[float, float]]


def plot_frontier(frontier: Frontier, path: str | Path | None = None) -> Any:
    """Draw one frontier into a new figure, write it to `path` if that is given, and return the figure."""
    load_optional("matplotlib", "a plot")
    figure, (panel,) = make_figure(1, 1)
    draw_panel(panel, frontier, styles_of([frontier]), f"{frontier.measure} error", f"truth: {frontier.truth}")
    add_legend(figure, [panel])
    if path is not None:
        figure.savefig(path)
    return figure


def make_figure(rows: int, columns: int) -> tuple[Any, list[Any]]:
    """Make a figure with rows and columns of panels, for files; return it and the list of its panels."""
    figure = load_optional("matplotlib.figure", "a plot").Figure(
        figsize=(PANEL[0] * columns, PANEL[1] * rows), dpi=DPI, layout="constrained"
    )
    load_optional("matplotlib.backends.backend_agg", "a plot").FigureCanvasAgg(figure)
    return figure, list(figure.subplots(rows, columns, squeeze=False).ravel())


def add_legend(figure, panels: Sequence) -> None:
    """Add one legend below all panels, with each entry once; the figure becomes higher to make room for it."""
    entries: dict[str, Any] = {}
    for panel in panels:
        for handle, label in zip(*panel.get_legend_handles_labels()):
            entries.setdefault(label, handle)
    width, height = figure.get_size_inches()
    for columns in range(max(1, len(entries)), 0, -1):
        legend = figure.legend(
            entries.values(), entries.keys(), loc="outside lower center", ncols=columns, frameon=False, fontsize=9
        )
        extent = legend.get_window_extent(figure.canvas.get_renderer())
        if extent.width <= width * figure.dpi or columns == 1:
            break
        legend.remove()
    figure.set_size_inches(width, height + extent.height / figure.dpi)


def styles_of(frontiers: Sequence[Frontier]) -> dict[str, Style]:
    """Choose marker, colour and size for each line of some frontiers: a setting of this engine, or another engine."""
    families = dict.fromkeys(family for frontier in frontiers for family in frontier.families())
    ours = [setting for engine, setting in families if engine == OURS]
    theirs = dict.fromkeys(engine for engine, _ in families if engine != OURS)
    sized = {
        name: ("o", OUR_COLOURS[k % len(OUR_COLOURS)], OUR_SIZES[k % len(OUR_SIZES)]) for k, name in enumerate(ours)
    }
    return {**sized, **{name: (*PEER_STYLES[k % len(PEER_STYLES)], PEER_SIZE) for k, name in enumerate(theirs)}}


def draw_panel(
    panel, frontier: Frontier, styles: Mapping[str, Style], title: str, about: str = "", goals: Goals = ()
) -> None:
    """Draw the points of a frontier into a panel.

    Parameters
    ----------
    panel : matplotlib.axes.Axes
        Panel to draw into.
    frontier : Frontier
        Measured points.
    styles : mapping
        Styles by name, from `styles_of`.
    title, about : str
        Texts above the panel, at the left and at the right.
    goals : sequence of (float, float)
        Goals to mark: an error, and a time in µs per simulated second.
    """
    unit = frontier.units[frontier.measure]
    seen = [e for p in frontier.points if math.isfinite(e := frontier.error(p)) and e > 0]
    zero = 10 ** (math.log10(min([*seen, *(error for error, _ in goals)], default=1e-16)) - ZERO_GAP)
    panel.set(
        xscale="log", yscale="log", xlabel="µs per simulated second", ylabel=f"{_measure_name(frontier)} [{unit}]"
    )
    panel.set_title(title, loc="left", fontweight="bold", fontsize=11)
    panel.set_title(_wrapped(about), loc="right", fontsize=7.5, color=PALE)
    panel.grid(True, which="major", color="#e6e6e6", linewidth=0.7)
    panel.set_axisbelow(True)
    panel.spines[["top", "right"]].set_visible(False)
    for engine, setting in frontier.families():
        name = setting if engine == OURS else engine
        _draw_family(panel, frontier, frontier.of(setting, engine), zero, styles[name], engine, name)
    for error, us in goals:
        panel.plot(us, error, marker="*", ms=13, color=GOLD, mec=INK, mew=0.7, ls="none", zorder=6, label="goal")
    if frontier.own_error() > 0:
        panel.axhline(frontier.own_error(), color="#b00020", ls=":", lw=1.2, zorder=1, label="the truth's own error")
    _draw_regions(panel, frontier, goals, zero)


def _draw_family(panel, frontier, points, zero, style, engine, name) -> None:
    """Draw one setting over all steps: a thin line and its points, hollow if the error is 0 or the point is lost."""
    shown = [(1e6 * p.cost, frontier.error(p), p.is_lost) for p in points if math.isfinite(frontier.error(p))]
    if not shown:
        return
    marker, colour, size = style
    label = f"{OURS} {name}" if engine == OURS else name
    is_ours = engine == OURS
    xs, ys = [us for us, _, _ in shown], [max(error, zero) for _, error, _ in shown]
    panel.plot(xs, ys, color=colour, lw=1.1 if is_ours else 0.6, alpha=0.8 if is_ours else 0.35, zorder=3)
    look = {"marker": marker, "ms": size, "color": colour, "ls": "none", "zorder": 4 if is_ours else 3}
    solid = [(x, y) for x, y, (_, error, lost) in zip(xs, ys, shown) if error > 0 and not lost]
    hollow = [(x, y) for x, y, (_, error, lost) in zip(xs, ys, shown) if error == 0 or lost]
    panel.plot(*(zip(*solid) if solid else ((), ())), alpha=1.0 if is_ours else 0.75, label=label, **look)
    if hollow:
        panel.plot(*zip(*hollow), mfc="white", label="_hollow", **look)
        panel.plot([], [], marker="o", ms=PEER_SIZE, color=PALE, mfc="white", ls="none", label="lost, or exactly 0")
    if any(error == 0 for _, error, _ in shown) and not panel.texts:
        panel.annotate("exactly 0", (xs[0], zero), (6, -9), textcoords="offset points", fontsize=7, color=PALE)


def _draw_regions(panel, frontier: Frontier, goals: Goals, zero: float) -> None:
    """Draw the Pareto front as stairs, and shade the region that reaches a goal.

    It must be called after all points are drawn, since it keeps the limits of the axes.
    """
    (left, right), (bottom, top) = panel.get_xlim(), panel.get_ylim()
    front = frontier.front()
    if front:
        xs, ys = [1e6 * p.cost for p in front], [max(frontier.error(p), zero) for p in front]
        xs, ys = [xs[0], *xs, right], [top, *ys, ys[-1]]
        panel.step(xs, ys, where="post", color=INK, lw=1.3, alpha=0.7, zorder=2, label="Pareto front")
    for error, us in goals:
        panel.fill_between([left, us], bottom, error, color=GOLD, alpha=0.10, lw=0, zorder=0)
    panel.set(xlim=(left, right), ylim=(bottom, top))


def _measure_name(frontier: Frontier) -> str:
    return "error" if frontier.measure == "error" else f"{frontier.measure} error"


def _wrapped(text: str, width: int = 46) -> str:
    return "\n".join(textwrap.wrap(text, width))
