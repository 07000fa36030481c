"""Jobs as tasks of a Ray cluster."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from rigid_env.extras import require
from rigid_env.launchers.job import RETRIES, Ended, Job, run_job


def launch(jobs: Sequence[Job], folder: Path, at_once: int, address: str | None = None) -> Iterator[Ended]:
    """See `job.Launch`; `address` is that of a cluster, None: one of this machine, of `at_once` processors.

    A task takes one processor. Ray starts one whose worker or node is lost again. One task warms the kernels of each
    node first. `folder` is not used.
    """
    require("ray", "ray", purpose="--launcher ray")
    with connected(at_once, address):
        yield from run(jobs)


@contextmanager
def connected(at_once: int, address: str | None) -> Iterator[None]:
    """Connect to a cluster while the block runs; to that of the program where it has one already."""
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
    """Run jobs as tasks of the cluster that this program is connected to, and yield the end of each as it comes."""
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
    """Warm the kernels of the first job that says how, on every node that is alive."""
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
