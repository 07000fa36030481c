"""Checks of a user's task: Gymnasium's rules for environments, and further promises of this package."""

from __future__ import annotations

import pickle
import warnings
from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

from physics.world.gusts import reads_time
from rigid_env.envs.making import task_class
from rigid_env.envs.task import TaskEnv, TaskVectorEnv
from rigid_env.envs.vector_infos import keys
from rigid_env.tasks import Task

SEED = 7
ENVS = 3


class CheckError(AssertionError):
    """Error of a task that breaks a promise of environments."""


def check_task(
    task: type[Task] | str, steps: int = 60, contexts: tuple[str, ...] = ("fork", "spawn"), **settings: Any
) -> None:
    """Check a task as an environment.

    It runs Gymnasium's `check_env`. It compares a batch with single environments for the same seeds, also in later
    episodes and in all modes of automatic reset. It checks seeds, copies by `pickle`, and worker processes.

    Parameters
    ----------
    task : class of Task, or str
        Class, or its name ``module:Class``.
    steps : int
        Control steps of each comparison; episodes have a third of them.
    contexts : tuple of str
        Ways to start worker processes, each of which is checked. "spawn" fails for a class in `__main__` without a
        file.
    settings
        Arguments of the task, and ``contacts`` and ``impacts`` of its environments.

    Raises
    ------
    CheckError
        Naming the quantity that differs, the place, and the difference.
    ValueError
        The task cannot be made with these arguments; see `Task`.
    """
    kind = task_class(task)
    check = _Checks(kind, steps, settings)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(TaskEnv(kind, **settings), skip_render_check=True)
    check.alone_as_in_a_batch()
    check.later_episodes()
    check.seeds()
    check.copies()
    for context in contexts:
        check.workers(task, context)


class _Checks:
    """Comparisons that `check_task` makes for one task class."""

    def __init__(self, kind: type[Task], steps: int, settings: dict[str, Any]):
        self.kind, self.steps, self.settings = kind, steps, settings
        self.limit = max(1, steps // 3)
        size: Any = TaskEnv(kind, **settings).action_space.shape
        self.actions = np.random.default_rng(SEED).uniform(-1.0, 1.0, (steps, ENVS, *size)).astype(np.float32)

    def batch(self, mode: AutoresetMode = AutoresetMode.DISABLED, limit: int | None = None) -> TaskVectorEnv:
        """Make a batch of `ENVS` worlds of the task, with episodes of at most `limit` steps."""
        return TaskVectorEnv(ENVS, task=self.kind, autoreset_mode=mode, max_episode_steps=limit, **self.settings)

    def alone_as_in_a_batch(self) -> None:
        """Compare each world of a batch with a single environment of the same seed, bit for bit."""
        envs = self.batch()
        together, _ = envs.reset(seed=SEED)
        singles = [TaskEnv(self.kind, **self.settings) for _ in range(ENVS)]
        for i, env in enumerate(singles):
            _same("observation of reset", _of_world(together, i), env.reset(seed=SEED + i)[0], f"world {i}")
        for k in range(self.steps):
            obs, rewards, ends, _, infos = envs.step(self.actions[k])
            for i, env in enumerate(singles):
                alone = env.step(self.actions[k, i])
                where = f"world {i}, step {k}"
                _same("observation", _of_world(obs, i), alone[0], where)
                _same("reward", rewards[i], alone[1], where)
                _same("end of the episode", ends[i], alone[2], where)
                for name in keys(envs.task, envs.contact_infos):
                    _same(f"info {name}", infos[name][i], alone[4][name], where)
            if ends.any():
                return

    def later_episodes(self) -> None:
        """Compare episodes after the first with those of single environments, in all modes of automatic reset."""
        worlds = range(ENVS)
        alone = [_Episodes(TaskEnv(self.kind, **self.settings), i, self.actions[:, i], self.limit) for i in worlds]
        for mode in AutoresetMode:
            self._starts_anew(mode, alone)

    def _starts_anew(self, mode: AutoresetMode, alone: list[_Episodes]) -> None:
        """Check that episodes end at the limit, restart as `mode` says, and then match single environments."""
        is_late = mode is AutoresetMode.NEXT_STEP  # a world starts anew in the step after that in which it ended
        envs = self.batch(mode, self.limit)
        obs, _ = envs.reset(seed=SEED)
        counts, over = np.zeros(ENVS, dtype=np.int64), np.zeros(ENVS, dtype=np.bool_)
        while counts.min() < self.steps:
            is_first = over & is_late
            if is_first.any() and envs.task.disturbed is not None:
                envs.task.disturbed.arrays["disturbance start"][is_first] = 0  # due in the step that starts anew
            obs, rewards, ends, cuts, infos = envs.step(self.actions[counts % self.steps, np.arange(ENVS)])
            over = ends | cuts
            _require(envs.observation_space.contains(obs), f"observation of step {counts.max()} is outside its space")
            _require(bool(np.isfinite(rewards).all()), f"reward of step {counts.max()} is {rewards}")
            for i in np.flatnonzero(~is_first).tolist():
                last = infos["final_obs"][i] if "final_obs" in infos and over[i] else _of_world(obs, i)
                alone[i].steps_as(counts[i], (last, rewards[i], ends[i], cuts[i]), mode)
            if mode is AutoresetMode.SAME_STEP:
                _require(bool((envs.task.steps[over] == 0).all()), f"worlds did not start anew in step {counts.max()}")
            if mode is AutoresetMode.DISABLED and over.any():
                obs, infos = envs.reset(options={"reset_mask": over})
            for i in np.flatnonzero(is_first if is_late else over).tolist():
                alone[i].starts_as(counts[i] - is_late, _of_world(obs, i), infos, mode)
            counts += ~is_first
        envs.close()

    def seeds(self) -> None:
        """Check that the same seed repeats an episode, and that another seed changes it if anything is drawn."""
        env = TaskEnv(self.kind, **self.settings)
        first, second = self._trajectory(env, SEED), self._trajectory(env, SEED)
        _same("trajectory", first, second, f"seed {SEED} twice")
        if any(not each.is_fixed for each in env.task.distributions.values()):
            drawn = [env.reset(seed=seed) and {k: np.copy(v) for k, v in env.task.drawn.items()} for seed in (1, 2)]
            is_same = all(np.array_equal(drawn[0][name], drawn[1][name]) for name in drawn[0])
            _require(not is_same, "the seeds 1 and 2 draw the same values")

    def copies(self) -> None:
        """Check that a pickled copy continues with the same bits."""
        env = TaskEnv(self.kind, **self.settings)
        env.reset(seed=SEED)
        for k in range(self.steps // 4):
            if env.step(self.actions[k, 0])[2]:
                break
        twin = pickle.loads(pickle.dumps(env))
        for k in range(self.steps // 4, self.steps):
            ours, theirs = env.step(self.actions[k, 0]), twin.step(self.actions[k, 0])
            _same("observation of a pickled copy", ours[0], theirs[0], f"step {k}")
            _same("reward of a pickled copy", ours[1], theirs[1], f"step {k}")
            if ours[2]:
                _same("episode of a pickled copy", env.reset()[0], twin.reset()[0], f"step {k}")

    def workers(self, task: type[Task] | str, context: str) -> None:
        """Compare environments in worker processes, started by `context`, with the batch."""
        settings = self.settings
        make: Callable[[], gym.Env] = lambda: TaskEnv(task, **settings)  # noqa: E731 (a closure, which workers are sent)
        workers = gym.vector.AsyncVectorEnv([make] * 2, context=context)
        try:
            theirs, _ = workers.reset(seed=SEED)
            ours, _ = self.batch().reset(seed=SEED)
            for i in range(2):
                _same(f"observation of a worker by {context}", _of_world(ours, i), _of_world(theirs, i), "reset")
            workers.step(self.actions[0, :2])
        finally:
            workers.close()

    def _trajectory(self, env: TaskEnv, seed: int) -> np.ndarray:
        rows = [_flat(env.reset(seed=seed)[0])]
        for k in range(self.steps):
            obs, reward, is_ended, _, _ = env.step(self.actions[k, 0])
            rows.append(np.append(_flat(obs), reward))
            if is_ended:
                break
        return np.concatenate(rows)


class _Episodes:
    """Record of a single environment's steps and starts, for comparison with a world of a batch.

    A force field that depends on time sees the common time of the batch. So later episodes of such a scene are not
    compared.
    """

    def __init__(self, env: TaskEnv, world: int, actions: np.ndarray, limit: int):
        self.world, self.draws = world, env.task.own_draws
        env.reset(seed=SEED + world)
        self.sees_time = reads_time(env.task.world.plan, env.task.world.params)
        self.steps: list[tuple] = []  # observation, reward, end and truncation of each
        self.starts: dict[int, tuple] = {}  # observation and info of each reset, by the step before it
        count = 0
        for k, action in enumerate(actions):
            obs, reward, is_ended, _, _ = env.step(action)
            count += 1
            self.steps.append((obs, reward, is_ended, count >= limit))
            if is_ended or count >= limit:
                self.starts[k], count = env.reset(), 0

    def steps_as(self, k: int, theirs: tuple, mode: AutoresetMode) -> None:
        """Check that step k equals the same step of the batch: observation, reward, end and truncation, in `theirs`."""
        if not self._has(k):
            return
        for what, ours, other in zip(("observation", "reward", "end", "truncation"), self.steps[k], theirs):
            _same(what, ours, other, self._where(k, mode))

    def starts_as(self, k: int, obs, infos: dict[str, Any], mode: AutoresetMode) -> None:
        """Check that the episode after step k starts as in the batch."""
        if not self._has(k):
            return
        ours, told = self.starts[k]
        for name in self.draws:
            _same(f"drawn {name}", infos[name][self.world], told[name], self._where(k, mode))
        _same("first observation", obs, ours, self._where(k, mode))

    def _has(self, k: int) -> bool:
        return not self.sees_time and k < len(self.steps)

    def _where(self, k: int, mode: AutoresetMode) -> str:
        return f"world {self.world}, step {k}, autoreset_mode {mode.value!r}"


def _of_world(obs, world: int):
    """Observation of one world of a batch."""
    return {key: part[world] for key, part in obs.items()} if isinstance(obs, dict) else obs[world]


def _flat(obs) -> np.ndarray:
    """All numbers of an observation in a row."""
    parts = obs.values() if isinstance(obs, dict) else (obs,)
    return np.concatenate([np.ravel(part) for part in parts])


def _same(what: str, ours, theirs, where: str) -> None:
    if isinstance(ours, dict):
        ours, theirs = _flat(ours), _flat(theirs)
    ours, theirs = np.asarray(ours), np.asarray(theirs)
    if ours.shape != theirs.shape:
        raise CheckError(f"{what} has shapes {ours.shape} and {theirs.shape}; allowed is one shape ({where})")
    if not np.array_equal(ours, theirs):
        apart = np.abs(np.subtract(ours, theirs, dtype=np.float64)).max()
        raise CheckError(f"{what} differs by {apart:.3g}; allowed are the same bits ({where})")


def _require(is_met: bool, message: str) -> None:
    if not is_met:
        raise CheckError(message)
