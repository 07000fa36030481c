"""Supervisor of training: counts episodes, records the learning curve, writes checkpoints, stops at the target."""

from __future__ import annotations

import csv
import json
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback

from agents.checkpoint import greedy, save_checkpoint
from agents.config import RunConfig, RunFolder
from agents.curve import WINDOW, CurvePoint, History, write_curve
from agents.evaluate import SEED_STRIDE, evaluation_seeds, run_episodes
from agents.progress import ProgressDisplay

POINT_EVERY = 0.5  # time between two points of the curve [s]
CHECKPOINT_EVERY = 10.0  # least time of training between two checkpoints [s]
CHECKPOINT_SHARE = 0.05  # largest share of the time for writing checkpoints; with a large replay buffer they are rarer

CONFIRMATION_EPISODES = 500  # episodes of the deterministic policy on fresh seeds, before training may end
CONFIRMATION_PAUSE = 2000  # least episodes of training after a confirmation that failed
CONFIRMATION_SEEDS = SEED_STRIDE // 2  # index of the first seed, so that none is used in the final evaluation

OnCheckpoint = Callable[[Path, CurvePoint], None]


class Supervisor(BaseCallback):
    """Callback of Stable-Baselines3 that supervises a run.

    The target is reached when two success rates are at least the target: that of the last `WINDOW` episodes of
    training, and that of `CONFIRMATION_EPISODES` episodes of the deterministic policy.

    Parameters
    ----------
    config : RunConfig
    run : RunFolder
    history : History
        Record of the run so far, which is continued.
    display : ProgressDisplay
    on_checkpoint : callable, optional
        Called with the folder of each checkpoint and the last `CurvePoint`; an exception that it raises ends training.

    Attributes
    ----------
    is_target_reached : bool
    """

    def __init__(
        self,
        config: RunConfig,
        run: RunFolder,
        history: History,
        display: ProgressDisplay,
        on_checkpoint: OnCheckpoint | None = None,
    ):
        super().__init__()
        self._on_checkpoint = on_checkpoint
        self.config, self.run_folder, self.history, self.display = config, run, history, display
        self.is_target_reached = False
        self._last_point = self._last_checkpoint = float("-inf")
        self._checkpoint_every = CHECKPOINT_EVERY
        self._open_monitor()

    def close(self) -> None:
        """Close the monitor file after training; buffered rows could otherwise get into a resumed run's file."""
        self._monitor.close()

    # --- calls of Stable-Baselines3 -----------------------------------------------------------------------

    def _on_training_start(self) -> None:
        self._start = time.perf_counter() - self.history.seconds
        if self.history.noise is not None:
            self.model.action_noise = self.history.noise

    def _on_rollout_start(self) -> None:
        """Add a point to the curve and write a checkpoint, if they are due.

        Stable-Baselines3 calls it between two updates of the policy, the only moment at which a run can be saved
        completely.
        """
        self.history.seconds = time.perf_counter() - self._start
        self.is_target_reached = self._is_confirmed()
        if self.is_target_reached:
            self.history.reached = self.config.target
        if self.is_target_reached or self.history.seconds - self._last_point >= POINT_EVERY:
            self._add_point()
        if self.is_target_reached or self.history.seconds - self._last_checkpoint >= self._checkpoint_every:
            self._checkpoint()

    def _on_step(self) -> bool:
        if self.is_target_reached:
            return False
        for world in np.flatnonzero(self.locals["dones"]):
            info = self.locals["infos"][world]
            episode = info["episode"]
            self.history.add(info["is_success"], episode["r"], episode["l"])
            seconds = round(time.perf_counter() - self._start, 3)
            self._rows.writerow((episode["r"], episode["l"], seconds, int(info["is_success"])))
        return True

    def _on_training_end(self) -> None:
        if not self.is_target_reached:
            self.history.seconds = time.perf_counter() - self._start
            self._add_point()
            self._checkpoint()

    # --- parts of the methods above -----------------------------------------------------------------------

    def _add_point(self) -> None:
        point = self.history.point(self.num_timesteps)
        points = self.history.points
        if points and points[-1].steps == point.steps:  # a resumed run starts at the step of its last point
            points.pop()
        points.append(point)
        self.display.update(point)
        self._last_point = self.history.seconds

    def _is_confirmed(self) -> bool:
        """True if the target is reached, first by the last episodes of training and then by an evaluation."""
        history = self.history
        if len(history.window) < WINDOW or history.episodes < history.next_confirmation:
            return False
        if history.point(self.num_timesteps).success_rate < self.config.target:
            return False
        seeds = evaluation_seeds(self.config.seed, SEED_STRIDE)[CONFIRMATION_SEEDS:]
        first = CONFIRMATION_EPISODES * history.confirmations
        episodes = run_episodes(
            self.config.env,
            greedy(self.model),
            seeds[first : first + CONFIRMATION_EPISODES],
            threads=self.config.threads,
            **self.config.evaluation_arguments,
        )
        rate = episodes.success.mean()
        history.confirmations += 1
        history.next_confirmation = history.episodes + CONFIRMATION_PAUSE
        history.seconds = time.perf_counter() - self._start
        self.display.say(
            f"{history.seconds:6.1f} s  {rate:.1%} of {CONFIRMATION_EPISODES} fresh episodes succeed without "
            f"exploration, as it is judged in the end; the target is {self.config.target:.1%}"
        )
        return bool(rate >= self.config.target)

    def _checkpoint(self) -> None:
        start = time.perf_counter()
        self._monitor.flush()
        self.history.monitor_size = self._monitor.tell()
        self.history.noise = getattr(self.model, "action_noise", None)
        place = save_checkpoint(self.run_folder.checkpoints, self.model, self.history)
        write_curve(self.history.points, self.run_folder.curve)
        if self._on_checkpoint is not None:
            self._on_checkpoint(place, self.history.points[-1])
        self._last_checkpoint = self.history.seconds
        self._checkpoint_every = max(CHECKPOINT_EVERY, (time.perf_counter() - start) / CHECKPOINT_SHARE)

    def _open_monitor(self) -> None:
        """Open the monitor file, in the format of SB3's `Monitor`; a resumed run cuts it to its size at that time."""
        is_new = self.history.monitor_size == 0
        self._monitor = self.run_folder.monitor.open("w" if is_new else "r+", newline="", encoding="utf-8")
        self._rows = csv.writer(self._monitor, lineterminator="\n")
        if is_new:
            self._monitor.write("#" + json.dumps({"t_start": 0.0, "env_id": self.config.env}) + "\n")
            self._rows.writerow(("r", "l", "t", "is_success"))
        else:
            self._monitor.seek(self.history.monitor_size)
            self._monitor.truncate()
