"""Progress of a training run: a bar in a terminal, or else a line of text every few seconds."""

from __future__ import annotations

import math
import time

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from agents.curve import CurvePoint

LINE_EVERY = 10.0  # time between two lines without a terminal [s]
BAR_WIDTH = 12  # width of the bar, so that the whole line fits into 80 columns [characters]
RATE_OVER = 5.0  # time over which the speed is averaged [s]


class ProgressDisplay:
    """Display of steps, success rate, return and speed of a run.

    Parameters
    ----------
    console : rich.console.Console
    max_steps : int
        Steps at which the bar is full.
    """

    def __init__(self, console: Console, max_steps: int):
        self.console = console
        self._max_steps = max_steps
        self._bar = Progress(
            TextColumn("{task.fields[numbers]}"),
            BarColumn(bar_width=BAR_WIDTH),
            TimeElapsedColumn(),
            console=console,
            disable=not console.is_terminal,
        )
        self._task = self._bar.add_task("", total=max_steps, numbers="first steps ...")
        self._last_line = self._mark_time = time.perf_counter()
        self._mark_steps: int | None = None
        self._rate = math.nan

    def __enter__(self) -> ProgressDisplay:
        self._bar.start()
        return self

    def __exit__(self, *error) -> None:
        self._bar.stop()

    def update(self, point: CurvePoint) -> None:
        """Show the numbers of a point of the learning curve."""
        now = time.perf_counter()
        self._measure_rate(point.steps, now)
        rate = "   ..." if math.isnan(self._rate) else f"{self._rate:6,.0f}"
        success = "  ..." if math.isnan(point.success_rate) else f"{point.success_rate:5.1%}"
        mean_return = "  ..." if math.isnan(point.mean_return) else f"{point.mean_return:6.2f}"
        steps = f"{point.steps / 1e6:5.2f} M steps"
        numbers = f"exploring: success {success}  return {mean_return}  {steps}  {rate} steps/s"
        self._bar.update(self._task, completed=min(point.steps, self._max_steps), numbers=numbers)
        if not self.console.is_terminal and now - self._last_line >= LINE_EVERY:
            self._last_line = now
            self.say(f"{point.seconds:6.1f} s  {numbers}")

    def say(self, text: str) -> None:
        """Print a line above the bar."""
        self._bar.console.print(text, highlight=False, soft_wrap=True)

    def _measure_rate(self, steps: int, now: float) -> None:
        elapsed = now - self._mark_time
        if self._mark_steps is not None and elapsed < RATE_OVER:
            return
        if self._mark_steps is not None:
            self._rate = (steps - self._mark_steps) / elapsed
        self._mark_time, self._mark_steps = now, steps
