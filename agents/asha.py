"""Asynchronous successive halving: stop trials that fall behind others at the same step.

A trial is compared when it passes 1/64, 1/16 and 1/4 of `max_steps`, with all trials of its environment that were
there before. It goes on if its success rate in training is among the best quarter of them. Source: Li et al., A System
for Massively Parallel Hyperparameter Tuning (2020), algorithm 2, as Ray's Tune has it.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from agents.config import RunConfig
from agents.curve import CurvePoint
from agents.trials import Trial
from agents.worker import make_job
from rigid_env.extras import require
from rigid_env.launchers import ray_tasks
from rigid_env.launchers.job import Ended, Job, Stopped

LOG = "asha.jsonl"  # in the folder of a sweep: every report, in order, with the decision

REDUCTION = 4  # share of trials that goes on, and distance of two comparisons: one to four
COMPARISONS = 3  # of a trial


def make_scheduler(max_steps: int) -> Any:
    """Tune's scheduler of the trials of one environment."""
    from ray.tune.schedulers import ASHAScheduler

    first = max(1, max_steps // REDUCTION**COMPARISONS)
    return ASHAScheduler("steps", "success_rate", "max", max_t=max_steps, grace_period=first,
                         reduction_factor=REDUCTION, stop_last_trials=False)  # fmt: skip


def read_stopped(out: Path) -> dict[str, int]:
    """Steps of each trial of a sweep that was stopped, by name."""
    return {row["trial"]: row["steps"] for row in _read(out / LOG) if row["is_stopped"]}


def stop_message(steps: int) -> str:
    """Say where a trial was stopped."""
    return f"stopped by asha at {steps:,} steps"


def _read(path: Path) -> list[dict[str, Any]]:
    """Rows of a log; one that was not written to its end is left out."""
    text = path.read_text(encoding="utf-8") if path.is_file() else ""
    return [json.loads(line) for line in text.splitlines(keepends=True) if line.endswith("\n")]


class Judge:
    """Decide, at each checkpoint of a trial, whether it goes on.

    All reports are kept in `out`: a judge that is made anew has seen those before it.

    Parameters
    ----------
    trials : sequence of Trial
    out : Path
        Of the sweep.
    make : callable
        The scheduler of an environment, of the largest `max_steps` of its trials.
    """

    def __init__(self, trials: Sequence[Trial], out: Path, make: Callable[[int], Any] = make_scheduler):
        self._log, self.stopped = out / LOG, read_stopped(out)
        self._scheduler_of, self._asked = {}, {trial.name: SimpleNamespace(trial_id=trial.name) for trial in trials}
        for env in {trial.config.env for trial in trials}:
            members = [trial for trial in trials if trial.config.env == env]
            scheduler = make(max(trial.config.max_steps for trial in members))
            for trial in members:
                self._scheduler_of[trial.name] = scheduler
                scheduler.on_trial_add(None, self._asked[trial.name])
        rows = _read(self._log)
        self._log.write_text("".join(json.dumps(row) + "\n" for row in rows), encoding="utf-8")
        for row in rows:
            if row["trial"] in self._asked:
                self._is_behind(row["trial"], row["steps"], row["success_rate"])

    def _is_behind(self, name: str, steps: int, success_rate: float) -> bool:
        seen = {"steps": steps, "success_rate": success_rate}
        scheduler = self._scheduler_of[name]
        return scheduler.on_trial_result(None, self._asked[name], seen) == scheduler.STOP

    def report(self, name: str, steps: int, success_rate: float, is_over: bool) -> bool:
        """Take note of a checkpoint; True if the trial is to stop there. One that is over is left to end."""
        if name in self.stopped:
            return True
        is_stopped = self._is_behind(name, steps, success_rate) and not is_over
        row = {"trial": name, "steps": steps, "success_rate": success_rate, "is_stopped": is_stopped}
        with self._log.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
        if is_stopped:
            self.stopped[name] = steps
        return is_stopped


@dataclass(frozen=True)
class AskJudge:
    """Callback of the checkpoints of a trial; it is sent to workers, so it holds nothing that cannot be pickled.

    Parameters
    ----------
    report : callable
        `Judge.report`, wherever the judge is.
    name : str
    config : RunConfig
    """

    report: Callable[[str, int, float, bool], bool]
    name: str
    config: RunConfig

    def __call__(self, place: Path, point: CurvePoint) -> None:
        """Report the checkpoint at `place`.

        Raises
        ------
        Stopped
        """
        if point.episodes == 0:
            return
        is_over = point.steps >= self.config.max_steps or point.success_rate >= self.config.target
        if self.report(self.name, point.steps, point.success_rate, is_over):
            raise Stopped(stop_message(point.steps))


def launch(
    trials: Sequence[Trial], jobs: Sequence[Job], folder: Path, at_once: int, address: str | None = None
) -> Iterator[Ended]:
    """Run jobs of trials as `ray_tasks.launch` does, and stop those that fall behind; `trials` are all of the sweep.

    Trials that were stopped before are not run.
    """
    require("ray", purpose="--scheduler asha")
    stopped, by_name = read_stopped(folder), {trial.name: trial for trial in trials}
    judged = [by_name[job.name] for job in jobs]
    yield from (Ended(t.name, None, stopped=stop_message(stopped[t.name])) for t in judged if t.name in stopped)
    left = [trial for trial in judged if trial.name not in stopped]
    if left:
        with ray_tasks.connected(at_once, address):
            report = partial(_report, _start_judge(judged, folder))
            yield from ray_tasks.run([make_job(t, folder, AskJudge(report, t.name, t.config)) for t in left])


def _start_judge(trials: Sequence[Trial], out: Path) -> Any:
    """Start the actor that compares trials: on the node of this program, whose loss ends the sweep anyway."""
    import ray
    from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

    here = NodeAffinitySchedulingStrategy(ray.get_runtime_context().get_node_id(), soft=True)
    judge = ray.remote(num_cpus=0, max_restarts=-1, max_task_retries=-1)(Judge)
    return judge.options(scheduling_strategy=here).remote(trials, out)


def _report(judge: Any, *row: Any) -> bool:
    """Call `Judge.report` of an actor."""
    import ray

    return ray.get(judge.report.remote(*row))
