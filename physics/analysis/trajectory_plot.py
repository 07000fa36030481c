"""Pictures of a trajectory: motion and energy over time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from physics.optional import load_optional

if TYPE_CHECKING:
    from physics.analysis.trajectory import BodyTrajectory, Trajectory

FIGURE_SIZE = (7.5, 8.0)  # [inch]
DPI = 130
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c6bb1", "#444444")
MOST_LABELS = 12  # bodies that a legend names

# Title, unit and vector of each panel in the picture of one body.
OF_ONE = (("position", "m", "pos"), ("velocity", "m/s", "linvel"), ("angular velocity", "rad/s", "angvel"))


def plot_body(track: BodyTrajectory, path: str | Path | None) -> Any:
    """Draw position, velocity, angular velocity and energy of one body over time, with its impacts as grey lines.

    `path` is the picture to write, or None. Returns the figure.
    """
    figure, panels = _panels()
    for panel, (title, unit, name) in zip(panels, OF_ONE):
        for k, axis in enumerate("xyz"):
            panel.plot(track.t, getattr(track, name)[:, k], color=COLOURS[k], lw=1.3, label=axis)
        panel.set_ylabel(f"{title} [{unit}]")
    panels[3].plot(track.t, track.energy, color=COLOURS[-1], lw=1.3)
    panels[3].set_ylabel("energy [J]")
    _finish(figure, panels, track.label, [event.t for event in track.events if event.kind == "impact"], 3)
    return _written(figure, path)


def plot_bodies(trajectory: Trajectory, path: str | Path | None) -> Any:
    """Draw height, speed and spin of each body over time, and the energy of all, with impacts as grey lines.

    `path` is the picture to write, or None. Returns the figure.
    """
    figure, panels = _panels()
    numbers = (
        ("height y [m]", trajectory.pos[:, :, 1]),
        ("speed [m/s]", np.linalg.norm(trajectory.linvel, axis=2)),
        ("spin [rad/s]", np.linalg.norm(trajectory.angvel, axis=2)),
    )
    labels = [trajectory.label(body) for body in range(trajectory.pos.shape[1])]
    for panel, (label, values) in zip(panels, numbers):
        for body, name in enumerate(labels):
            panel.plot(trajectory.t, values[:, body], color=COLOURS[body % len(COLOURS)], lw=1.1, label=name)
        panel.set_ylabel(label)
    panels[3].plot(trajectory.t, trajectory.energy.sum(axis=1), color=COLOURS[-1], lw=1.3)
    panels[3].set_ylabel("energy of all [J]")
    impacts = [event.t for event in trajectory.events if event.kind == "impact"]
    title = f"{len(labels)} bodies"
    _finish(figure, panels, title, impacts, min(len(labels), 4) if len(labels) <= MOST_LABELS else 0)
    return _written(figure, path)


def _panels():
    figure = load_optional("matplotlib.figure", "a plot").Figure(figsize=FIGURE_SIZE, dpi=DPI, layout="constrained")
    return figure, figure.subplots(4, 1, sharex=True)


def _finish(figure, panels, title: str, impacts: list[float], columns: int) -> None:
    """Add impacts (times [s]), grid and title to all panels, and a legend of `columns` columns above; 0: no legend."""
    for panel in panels:
        panel.vlines(np.unique(impacts), 0, 1, transform=panel.get_xaxis_transform(), color="#cccccc", lw=0.6, zorder=0)
        panel.grid(True, color="#e6e6e6", linewidth=0.7)
        panel.set_axisbelow(True)
        panel.spines[["top", "right"]].set_visible(False)
    panels[-1].set_xlabel("t [s]")
    figure.suptitle(title, x=0.01, ha="left", fontsize=11, fontweight="bold")
    if columns:
        figure.legend(
            *panels[0].get_legend_handles_labels(), loc="outside upper right", ncols=columns, frameon=False, fontsize=9
        )
    figure.align_ylabels(panels)


def _written(figure, path: str | Path | None):
    if path is not None:
        figure.savefig(path)
    return figure
