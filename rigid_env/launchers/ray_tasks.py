"""Launcher of jobs as tasks of a Ray cluster."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from rigid_env.extras import require
from rigid_env.launchers.job import RETRIES, Ended, Job, run_job


def launch(jobs: Sequence[Job], folder: Path, at_once: int, address: str | None = None) -> Iterator[Ended]:
    """Run jobs as tasks of a Ray cluster, as `job.Launch` describes; `folder` is not used.

    `address` is the address of a cluster; None starts a cluster on this machine with `at_once` processors. A task takes
    one processor. Ray restarts a task whose worker or node is lost. Before the first job, one task per node warms its
    kernels.
    """
    require("ray", "ray", purpose="--launcher ray")
    with connected(at_once, address):
        yield from run(jobs)


@contextmanager
def connected(at_once: int, address: str | None) -> Iterator[None]:
    """Context manager that connects to a cluster; a connection that this program already has is used and kept."""
    import ray

    is_ours = not ray.is_initialized()
    if is_ours:  # without an address Ray would look for a cluster that some other program has left
        local = {} if address else {"num_cpus": at_once, "include_dashboard": False}
        ray.init(address=address or "local", log_to_driver=False, **local)
    try:
        yield
    finally:
        if is_ours:
            ray.shutdown()


def run(jobs: Sequence[Job]) -> Iterator[Ended]:
    """Run jobs as tasks of the connected cluster, and yield the end of each as soon as it ends."""
    import ray

    _warm_nodes(jobs)
    task = ray.remote(num_cpus=1, max_retries=RETRIES)(run_job)
    tasks = {task.remote(job): job.name for job in jobs}
    while tasks:
        (done,), _ = ray.wait(list(tasks), num_returns=1)
        name = tasks.pop(done)
        try:
            yield ray.get(done)
        except ray.exceptions.RayError as error:
            yield Ended(name, None, str(error).strip().splitlines()[-1])


def _warm_nodes(jobs: Sequence[Job]) -> None:
    """Warm kernels on every living node, by the first job that has a `warm` function."""
    import ray
    from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

    warm = next((job.warm for job in jobs if job.warm is not None), None)
    if warm is None:
        return
    task = ray.remote(num_cpus=0)(_call)
    nodes = [node["NodeID"] for node in ray.nodes() if node["Alive"]]
    affinities = [NodeAffinitySchedulingStrategy(node, soft=True) for node in nodes]
    ray.wait([task.options(scheduling_strategy=each).remote(warm) for each in affinities], num_returns=len(nodes))


def _call(function) -> None:
    function()
