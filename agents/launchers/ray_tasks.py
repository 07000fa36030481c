"""Trials as tasks of a Ray cluster, whose nodes share the folder of the sweep."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from agents.launchers.asha import AskJudge, Judge, read_stopped, stop_message
from agents.launchers.trial import RETRIES, Outcome, run_trial
from agents.trials import Trial
from rigid_env.extras import require


def launch(
    trials: Sequence[Trial], out: Path, jobs: int, address: str | None = None, scheduler: str | None = None
) -> Iterator[Outcome]:
    """See `trial.Launch`; `address` is that of a cluster, None: one of this machine, of `jobs` processors.

    A task takes one processor. Ray starts one whose worker or node is lost again, which goes on from its checkpoint.
    One task warms the kernels of each node first. The `scheduler` ``asha`` stops trials that fall behind; those that it
    has stopped before are not run.
    """
    if scheduler is None:
        require("ray", "ray", purpose="--launcher ray")
    else:
        require("ray", purpose=f"--scheduler {scheduler}")
    stopped = read_stopped(out) if scheduler else {}
    left = [trial for trial in trials if trial.name not in stopped]
    yield from (Outcome(t.name, None, stopped=stop_message(stopped[t.name])) for t in trials if t.name in stopped)
    if left:
        yield from _run_all(left, trials if scheduler else (), out, jobs, address)


def _run_all(
    left: Sequence[Trial], judged: Sequence[Trial], out: Path, jobs: int, address: str | None
) -> Iterator[Outcome]:
    import ray

    is_ours = not ray.is_initialized()
    if is_ours:  # without an address Ray would look for a cluster that some other program has left
        local = {} if address else {"num_cpus": jobs, "include_dashboard": False}
        ray.init(address=address or "local", log_to_driver=False, **local)
    try:
        _warm_nodes(left[0])
        report = partial(_report, _start_judge(judged, out)) if judged else None
        run = ray.remote(num_cpus=1, max_retries=RETRIES)(run_trial)
        tasks = {}
        for trial in left:
            callback = AskJudge(report, trial.name, trial.config) if report else None
            tasks[run.remote(trial.name, trial.config, str(out), on_checkpoint=callback)] = trial.name
        while tasks:
            (done,), _ = ray.wait(list(tasks), num_returns=1)
            name = tasks.pop(done)
            try:
                yield ray.get(done)
            except ray.exceptions.RayError as error:
                yield Outcome(name, None, str(error).strip().splitlines()[-1])
    finally:
        if is_ours:
            ray.shutdown()


def _warm_nodes(trial: Trial) -> None:
    """Warm the kernels of each node, and wait for it."""
    import ray
    from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

    warm = ray.remote(num_cpus=0)(warm_kernels)
    places = [NodeAffinitySchedulingStrategy(node["NodeID"], soft=True) for node in ray.nodes() if node["Alive"]]
    ray.wait([warm.options(scheduling_strategy=place).remote(trial) for place in places], num_returns=len(places))


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


def warm_kernels(trial: Trial) -> None:
    """Compile or load the kernels of a trial's environment."""
    from agents.algorithms import make_training_env

    env = make_training_env(trial.config)
    env.reset()
    env.close()
