"""History of a run: statistics of its last episodes, and the learning curve as CSV and as a picture."""

from __future__ import annotations

import csv
import math
import os
from collections import deque
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

from physics.work_precision.frontier_plot import add_legend

WINDOW = 500  # number of last episodes whose mean is shown and compared with the target


@dataclass(frozen=True)
class CurvePoint:
    """Point of the learning curve.

    Parameters
    ----------
    steps : int
        Environment steps of all worlds together.
    seconds : float
        Time of training, without interruptions [s].
    episodes : int
        Episodes that have ended.
    success_rate, mean_return, mean_length : float
        Means over the last `WINDOW` episodes, with exploration; NaN before the first episode has ended.
    """

    steps: int
    seconds: float
    episodes: int
    success_rate: float
    mean_return: float
    mean_length: float


@dataclass
class History:
    """Record of a run's episodes, which is part of every checkpoint.

    Parameters
    ----------
    seconds : float
        Time of training so far [s].
    episodes : int
        Episodes that have ended.
    monitor_size : int
        Bytes of the monitor file at the checkpoint.
    next_confirmation : int
        Number of ended episodes from which on the target may be confirmed.
    confirmations : int
        Confirmations that have been tried.
    points : list of CurvePoint
        Learning curve.
    window : deque of (success, return, length)
        Last `WINDOW` episodes.
    noise : ActionNoise, optional
        Exploration noise at the checkpoint, since Stable-Baselines3 resets it when learning continues.
    reached : float
        Largest target that was reached; 0 if none was.
    """

    seconds: float = 0.0
    episodes: int = 0
    monitor_size: int = 0
    next_confirmation: int = WINDOW
    confirmations: int = 0
    points: list[CurvePoint] = field(default_factory=list)
    window: deque[tuple[bool, float, int]] = field(default_factory=lambda: deque(maxlen=WINDOW))
    noise: Any = None
    reached: float = 0.0

    def add(self, success: bool, episode_return: float, length: int) -> None:
        """Add an episode that has ended."""
        self.episodes += 1
        self.window.append((success, episode_return, length))

    def point(self, steps: int) -> CurvePoint:
        """Return the point of the learning curve after `steps` environment steps."""
        columns = zip(*self.window) if self.window else ((float("nan"),),) * 3
        means = [sum(column) / len(column) for column in columns]
        return CurvePoint(steps, round(self.seconds, 3), self.episodes, *means)


def write_curve(points: list[CurvePoint], path: Path) -> None:
    """Write the learning curve as CSV; an older file is replaced in one operation."""
    partial = path.with_suffix(".partial")
    with partial.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [f.name for f in fields(CurvePoint)], lineterminator="\n")
        writer.writeheader()
        writer.writerows(asdict(point) for point in points)
    os.replace(partial, path)


def read_curve(path: Path) -> list[dict[str, float | None]]:
    """Read a learning curve as `write_curve` wrote it, a dict for each point; what is nan becomes None."""
    with path.open(newline="", encoding="utf-8") as file:
        rows = [{name: float(text) for name, text in row.items()} for row in csv.DictReader(file)]
    return [{name: value if math.isfinite(value) else None for name, value in row.items()} for row in rows]


def plot_curve(points: list[CurvePoint], target: float, title: str, path: Path) -> None:
    """Draw success rate and mean return over steps and over time, as PNG.

    Parameters
    ----------
    points : list of CurvePoint
    target : float
        Success rate at which a line is drawn.
    title : str
    path : Path
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 5.5), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(2, 2, sharex="col", sharey="row")
    xs = [point.steps / 1e6 for point in points], [point.seconds for point in points]
    for column, (x, label) in enumerate(zip(xs, ("million steps", "seconds"))):
        axes[0, column].plot(x, [point.success_rate for point in points], color="tab:green")
        axes[0, column].axhline(target, color="grey", linestyle="--", linewidth=1.0, label="target of the success rate")
        axes[1, column].plot(x, [point.mean_return for point in points], color="tab:blue")
        axes[1, column].set_xlabel(label)
    for axis in axes.flat:
        axis.grid(alpha=0.3)
    axes[0, 0].set_ylabel("success rate")
    axes[0, 0].set_ylim(-0.02, 1.02)
    axes[1, 0].set_ylabel("mean return")
    add_legend(figure, [axes[0, 0]])
    figure.suptitle(f"{title}, mean of the last {WINDOW} episodes")
    figure.savefig(path, dpi=110)


def plot_transfer(rows: list, title: str, path: Path) -> None:
    """Draw success at `reference` against training time as PNG, with 95 % intervals, one mark per accuracy.

    Parameters
    ----------
    rows : list of agents.accuracy_transfer.Transfer
    title : str
    path : Path
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.5, 4.5), layout="constrained")
    FigureCanvasAgg(figure)
    axis = figure.subplots()
    for row in rows:
        rate, (low, high) = row.truth["success_rate"], row.truth["interval"]
        bars = [[rate - low], [high - rate]]
        axis.errorbar(row.training_seconds, rate, bars, marker="o", capsize=4, label=row.accuracy)
        axis.plot(row.training_seconds, row.own["success_rate"], marker="x", color="grey")
    axis.plot([], [], marker="x", color="grey", linestyle="none", label="where it was trained")
    axis.set_xscale("log")
    axis.set_xlabel("training [s]")
    axis.set_ylabel("success at reference")
    axis.grid(alpha=0.3, which="both")
    axis.set_title(title)
    add_legend(figure, [axis])
    figure.savefig(path, dpi=110)
