"""Measure the steps per second of environments with random actions, resets included."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import gymnasium

from rigid_env.envs.registration import NAMESPACE
from rigid_env.lab.measure.rows import ACCURACIES, Tick, paired_rows, told
from rigid_env.lab.measure.timing import Row, Stopwatch, interleave
from rigid_env.lab.measure.workloads import STEP

ENV_ID = f"{NAMESPACE}/BlockReach-v0"
SUBSTEPS = 5
PHYSICS = {"dt": STEP, "frame_skip": SUBSTEPS}  # the same in our environments and the compared ones
UNIT = "env steps/s"
SEED = 5
ACTIONS = 64  # different random actions, or batches of them, used in turns
THREADS = (1, 2)  # numbers of threads of the vector environment
VECTOR_TARGET = 25.0
SINGLE_TARGET = 3.0


@dataclass(frozen=True)
class EnvSizes:
    """Size of one run: numbers of environments and steps, for our environments and the compared ones (`peer_...`)."""

    envs: int = 1024
    vector_steps: int = 100
    peer_envs: int = 64
    peer_steps: int = 50
    single_steps: int = 4000


FULL = EnvSizes()
QUICK = EnvSizes(envs=16, vector_steps=3, peer_envs=2, peer_steps=3, single_steps=50)


def environment_ids() -> list[str]:
    """Ids of our registered environments."""
    return sorted(name for name in gymnasium.registry if name.startswith(f"{NAMESPACE}/"))


class Single:
    """Callable that steps one environment with random actions, with resets, and returns steps per second."""

    def __init__(self, env: gymnasium.Env, steps: int):
        self.env, self.steps = env, steps
        env.action_space.seed(SEED)
        self.actions = [env.action_space.sample() for _ in range(ACTIONS)]
        env.reset(seed=SEED)

    def __call__(self) -> float:
        env, actions = self.env, self.actions
        with Stopwatch() as watch:
            for k in range(self.steps):
                _, _, terminated, truncated, _ = env.step(actions[k % ACTIONS])
                if terminated or truncated:
                    env.reset()
        return self.steps / watch.seconds


class Vector:
    """Callable that steps a vector environment with random actions and automatic resets; returns steps per second."""

    def __init__(self, envs: gymnasium.vector.VectorEnv, steps: int):
        self.envs, self.steps = envs, steps
        envs.action_space.seed(SEED)
        self.actions = [envs.action_space.sample() for _ in range(ACTIONS)]
        envs.reset(seed=SEED)

    def __call__(self) -> float:
        with Stopwatch() as watch:
            for k in range(self.steps):
                self.envs.step(self.actions[k % ACTIONS])
        return self.steps * self.envs.num_envs / watch.seconds


@dataclass(frozen=True)
class EnvPeer:
    """Other implementation of the environments, for comparison.

    Attributes
    ----------
    name : str
    make : callable
        () -> one environment, made by `gymnasium.make` as ours is.
    make_vector : callable
        n -> vector environment of n environments.
    """

    name: str
    make: Callable[[], gymnasium.Env]
    make_vector: Callable[[int], gymnasium.vector.VectorEnv]


def environment_rows(
    sizes: EnvSizes, repeats: int, peer: EnvPeer | None = None, tick: Tick | None = None
) -> Iterator[list[Row]]:
    """Measure the vector environment, a single one with Gymnasium's wrappers, and a single one without them.

    Yields the rows of each as soon as they are measured.

    Parameters
    ----------
    sizes : EnvSizes
    repeats : int
        Repeats of every measurement, in turns.
    peer : EnvPeer, optional
        Other implementation that is measured, too.
    tick : callable, optional
        Called before each run with its name.
    """
    for threads in THREADS:
        yield _vector_rows(threads, sizes, repeats, peer, tick)
    yield _single_rows("single_env", "one Env, gym.make", lambda env: env, sizes, repeats, peer, tick)
    yield _single_rows("bare_env", "one Env, unwrapped", lambda env: env.unwrapped, sizes, repeats, peer, tick)


def run_count(repeats: int, with_peer: bool) -> int:
    """Number of calls of `tick` by `environment_rows`."""
    return (len(THREADS) + 2) * (len(ACCURACIES) + with_peer) * (repeats + 1)


def _vector_rows(threads, sizes, repeats, peer, tick) -> list[Row]:
    what = f"{sizes.envs:,} environments, {threads} thread" + "s" * (threads > 1)
    runners = {
        name: Vector(
            gymnasium.make_vec(ENV_ID, sizes.envs, accuracy=name, threads=threads, **PHYSICS),
            sizes.vector_steps,
        )
        for name in ACCURACIES
    }
    peers = {}
    if peer is not None:
        runners["peer"] = Vector(peer.make_vector(sizes.peer_envs), sizes.peer_steps)
        peers["peer"] = f"{sizes.peer_envs} {peer.name} in SyncVectorEnv"
    key = f"vector_env_{threads}_thread"
    return _measured(key, what, VECTOR_TARGET, runners, peers, repeats, tick)


def _single_rows(key, what, strip, sizes, repeats, peer, tick) -> list[Row]:
    runners = {
        name: Single(
            strip(gymnasium.make(ENV_ID, disable_env_checker=True, accuracy=name, **PHYSICS)),
            sizes.single_steps,
        )
        for name in ACCURACIES
    }
    peers = {}
    if peer is not None:
        runners["peer"], peers["peer"] = Single(strip(peer.make()), sizes.single_steps), peer.name
    return _measured(key, what, SINGLE_TARGET if key == "single_env" else None, runners, peers, repeats, tick)


def _measured(key, what, target, runners, peers, repeats, tick) -> list[Row]:
    spreads = interleave(runners, repeats, told(tick, what))
    for runner in runners.values():
        (runner.envs if isinstance(runner, Vector) else runner.env).close()
    return paired_rows(spreads, peers, key=key, what=what, unit=UNIT, target=target)
