"""Error against time as a picture: one panel per scene, both axes logarithmic."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import physics
from physics.work_precision.contender import OURS
from rigid_env.lab.measure.accuracy import Found
from rigid_env.lab.measure.plotting import require_matplotlib

COLUMNS = 3
PANEL = (5.0, 3.9)  # [inch]
DPI = 130

# Our settings are circles, one colour each; an engine is one marker and colour.
OUR_COLOURS = ("#56b4e9", "#0072b2", "#009e73", "#003f5c", "#66a182")
OUR_SIZES = (8.5, 6.5, 4.5)  # of circles: where settings coincide, both show [pt]
PEER_STYLES = (("^", "#d55e00"), ("s", "#cc79a7"), ("D", "#e69f00"), ("v", "#8c6bb1"))
PEER_SIZE = 4.0  # [pt]
INK, PALE, GOLD = "#222222", "#8a8a8a", "#f0c000"

# Decades below the smallest error above zero, or goal, at which an error of exactly zero is drawn.
ZERO_GAP = 0.7


def write_plot(results: Sequence[Found], path: str | Path) -> None:
    """Draw the results into a file whose name says the format (png, svg, pdf).

    Raises
    ------
    ValueError
        There is no result, or matplotlib does not know the format.
    gymnasium.error.DependencyNotInstalled
        matplotlib is missing.
    """
    require_matplotlib()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    if not results:
        raise ValueError("results is empty; allowed is at least one scene")
    columns = min(COLUMNS, len(results))
    rows = math.ceil(len(results) / columns)
    figure = Figure(figsize=(PANEL[0] * columns, PANEL[1] * rows + 0.7), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    styles, entries = _styles(results), {}
    for panel, found in zip(axes, results):
        _draw_panel(panel, found, styles)
        for handle, label in zip(*panel.get_legend_handles_labels()):
            entries.setdefault(label, handle)
    for panel in axes[len(results) :]:
        panel.set_axis_off()
    figure.legend(
        entries.values(), entries.keys(), loc="outside lower center", ncols=min(len(entries), 4 * columns // 2 + 1),
        frameon=False, fontsize=9,
    )  # fmt: skip
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DPI)


def _styles(results: Sequence[Found]) -> dict[str, tuple[str, str, float]]:
    """Marker, colour and size by name of a family: our settings, and the other engines."""
    families = dict.fromkeys(f for found in results for f in found.frontier.families())
    ours = [setting for engine, setting in families if engine == OURS]
    theirs = dict.fromkeys(engine for engine, _ in families if engine != OURS)
    sized = {
        name: ("o", OUR_COLOURS[k % len(OUR_COLOURS)], OUR_SIZES[k % len(OUR_SIZES)]) for k, name in enumerate(ours)
    }
    return {**sized, **{name: (*PEER_STYLES[k % len(PEER_STYLES)], PEER_SIZE) for k, name in enumerate(theirs)}}


def _draw_panel(panel, found: Found, styles: dict[str, tuple[str, str, float]]) -> None:
    frontier = found.frontier
    unit = frontier.units[frontier.measure]
    seen = [e for p in frontier.points if math.isfinite(e := frontier.error(p)) and e > 0]
    zero = 10 ** (math.log10(min([*seen, *(error for error, _ in found.job.goals)], default=1e-16)) - ZERO_GAP)
    panel.set(
        xscale="log", yscale="log", xlabel="µs per simulated second", ylabel=f"{_measure_name(frontier)} [{unit}]"
    )
    panel.set_title(found.job.key, loc="left", fontweight="bold", fontsize=11)
    panel.set_title(_wrapped(found.job.what), loc="right", fontsize=7.5, color=PALE)
    panel.grid(True, which="major", color="#e6e6e6", linewidth=0.7)
    panel.set_axisbelow(True)
    panel.spines[["top", "right"]].set_visible(False)
    for engine, setting in frontier.families():
        name = setting if engine == OURS else engine
        _draw_family(panel, frontier, frontier.of(setting, engine), zero, styles[name], engine, name)
    for error, us in found.job.goals:
        panel.plot(us, error, marker="*", ms=13, color=GOLD, mec=INK, mew=0.7, ls="none", zorder=6, label="goal")
    if frontier.own_error() > 0:
        panel.axhline(frontier.own_error(), color="#b00020", ls=":", lw=1.2, zorder=1, label="the truth's own error")
    _draw_regions(panel, found, zero)


def _draw_family(panel, frontier, points, zero, style, engine, name) -> None:
    """One setting over all steps: a thin line, its points, and hollow ones where the error is zero or lost."""
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


def _draw_regions(panel, found: Found, zero: float) -> None:
    """The Pareto front as stairs up to the edges, and where a point must lie to reach a goal; last, as limits stay."""
    (left, right), (bottom, top) = panel.get_xlim(), panel.get_ylim()
    front = found.frontier.front()
    if front:
        xs, ys = [1e6 * p.cost for p in front], [max(found.frontier.error(p), zero) for p in front]
        xs, ys = [xs[0], *xs, right], [top, *ys, ys[-1]]
        panel.step(xs, ys, where="post", color=INK, lw=1.3, alpha=0.7, zorder=2, label="Pareto front")
    for error, us in found.job.goals:
        panel.fill_between([left, us], bottom, error, color=GOLD, alpha=0.10, lw=0, zorder=0)
    panel.set(xlim=(left, right), ylim=(bottom, top))


def _measure_name(frontier: physics.Frontier) -> str:
    return "error" if frontier.measure == "error" else f"{frontier.measure} error"


def _wrapped(text: str, width: int = 46) -> str:
    import textwrap

    return "\n".join(textwrap.wrap(text, width))
