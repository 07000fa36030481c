"""The work that environments are given: random actions, resets included; environment steps per second."""

from __future__ import annotations

import contextlib
import importlib
from dataclasses import replace

import gymnasium

import physics
from rigid_env.measure.timing import Stopwatch
from rigid_env.measure.workloads import STEP

ENV_ID = "rigid_env/BlockReach-v0"
NAMESPACE = "rigid_env/"
UNIT = "env steps/s"
SEED = 5
ACTIONS = 64  # different random actions, or batches of them, used in turns


def environment_ids() -> list[str]:
    """Ids of our registered environments."""
    with contextlib.suppress(ImportError):
        importlib.import_module("rigid_env.registration")
    return sorted(name for name in gymnasium.registry if name.startswith(NAMESPACE))


def environment_accuracy(preset: str) -> physics.Accuracy:
    """A preset with as many substeps of an environment's step as are `STEP` long."""
    return replace(physics.PRESETS[preset], substeps=substeps())


def substeps() -> int:
    """Substeps of `STEP` in one step of our environments; the step is one over their `render_fps`."""
    env = gymnasium.make(ENV_ID)
    step = 1.0 / env.unwrapped.metadata["render_fps"]
    env.close()
    return round(step / STEP)


class Single:
    """One environment, stepped with random actions and reset at the end of each episode."""

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
    """A vector environment, stepped with random actions; it resets its environments by itself."""

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
