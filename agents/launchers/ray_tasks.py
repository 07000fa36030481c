"""Launcher that runs trials as tasks of a Ray cluster, whose nodes share the folder of the sweep."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from agents.launchers.trial import RETRIES, Outcome, run_trial
from agents.trials import Trial
from rigid_env.extras import require


def launch(trials: Sequence[Trial], out: Path, jobs: int, address: str | None = None) -> Iterator[Outcome]:
    """Run trials as Ray tasks, see `trial.Launch`.

    `address` is that of a cluster; None starts one on this machine, with `jobs` processors. A task takes one processor.
    If a worker or node is lost, Ray starts its task again, which continues from its checkpoint. A first task on each
    node compiles or loads the kernels.
    """
    require("ray", purpose="--launcher ray")
    import ray
    from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

    is_ours = not ray.is_initialized()
    if is_ours:  # without an address Ray would look for a cluster that some other program has left
        local = {} if address else {"num_cpus": jobs, "include_dashboard": False}
        ray.init(address=address or "local", log_to_driver=False, **local)
    try:
        warm = ray.remote(num_cpus=0)(warm_kernels)
        nodes = [node["NodeID"] for node in ray.nodes() if node["Alive"]]
        ray.wait(
            [
                warm.options(scheduling_strategy=NodeAffinitySchedulingStrategy(node, soft=True)).remote(trials[0])
                for node in nodes
            ],
            num_returns=len(nodes),
        )
        run = ray.remote(num_cpus=1, max_retries=RETRIES)(run_trial)
        tasks = {run.remote(trial.name, trial.config, str(out)): trial.name for trial in trials}
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


def warm_kernels(trial: Trial) -> None:
    """Compile or load the kernels of a trial's environment."""
    from agents.algorithms import make_training_env

    env = make_training_env(trial.config)
    env.reset()
    env.close()
