"""SceneTask: a task made from any scene, in which an agent drives some bodies and one body may have a goal."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from physics import validation
from physics.kernels.state import layout as at
from physics.world.setters import check_depth
from rigid_env.tasks import layout as col
from rigid_env.tasks import observe
from rigid_env.tasks.actions import Wrench
from rigid_env.tasks.arguments import BatchArguments, EngineArguments, part, takes
from rigid_env.tasks.distributions import Uniform
from rigid_env.tasks.scene_settings import SceneArguments, SettingsReader
from rigid_env.tasks.scene_source import SceneSource, find_scene
from rigid_env.tasks.task import Task

BONUS = 5.0
"""Reward of success."""

START = "a start as far off as it may be"
"""Subject of the error for starts inside a wall."""


START_MEANINGS = {
    "pos": "the starting position [m]",
    "linvel": "the starting velocity [m/s]",
    "angvel": "the starting angular velocity [rad/s]",
}
"""Explanations of the draws of a start, by key of the table [environment.start]."""

GOAL_MEANINGS = {
    "goal": "place of the goal [m]",
    "distance": "distance of the body from the goal [m]",
    "speed": "speed of the body [m/s]",
    "reward_progress": "gain of closeness to the goal",
    "reward_success": "bonus for success",
}
"""Explanations of draws, measures and terms of a scene with a goal."""


@dataclass(frozen=True)
class SceneArgument:
    """Argument for the scene of an environment; see `SceneTask`."""

    scene: SceneSource | None = None


@dataclass(frozen=True)
class _Arguments(EngineArguments, SceneArguments, SceneArgument, BatchArguments):
    draws: Mapping[str, Any] | None = field(default=None, kw_only=True)


class SceneTask(Task):
    """Task of `rigid_env.envs.scene.SceneEnv` over a batch of worlds; the environment's docstring describes it.

    Parameters
    ----------
    worlds : int
    scene : physics.Scene, str, Path or mapping
        A scene, the name of a canonical one, or a scene file, whose table [environment] has the settings below. A
        mapping is the content of such a file as plain data.
    driven, force, torque, frame, length, goal, start, frame_skip, dt
        Replace the keys of that table; None: the file's value, or the default. `goal` and `start` are dicts.
    episode_steps : int, optional
        Replaces the key `max_episode_steps`, a name that `gymnasium.make` takes for itself.
    accuracy, effects, draws, dump_faults, threads
        As of `Task`.

    Attributes
    ----------
    settings : Settings
    name : str
        Name of the scene, for titles.

    Raises
    ------
    ValueError
        Naming file, line and key or the argument, the value, and what is allowed.
    """

    @takes(_Arguments)
    def __init__(self, given: _Arguments) -> None:
        self.name, self.scene, file = find_scene(given.scene)
        reader = SettingsReader(self.scene, file, given)
        self.settings = settings = reader.settings()
        self.max_episode_steps = settings.max_episode_steps
        if given.episode_steps is not None:
            self.max_episode_steps = validation.count(given.episode_steps, "episode_steps")
        limits = {"force": settings.force, "torque": settings.torque, "frame": settings.frame}
        self.actions = [Wrench(body, **limits) for body in settings.driven]
        self.draws = self._declared()
        self._reader = reader  # for errors, as long as the task is made
        self.explanations = {f"start_{key}": f"change of {START_MEANINGS[key]} of each body" for key in settings.start}
        self.explanations |= {} if settings.goal is None else GOAL_MEANINGS
        self.memory = {} if settings.goal is None else {"closeness": 1, "gain": 1}
        super().__init__(
            given.worlds, draws=given.draws, frame_skip=settings.frame_skip, dt=settings.dt,
            **part(given, EngineArguments),
        )  # fmt: skip
        del self._reader

    def _declared(self) -> dict[str, Uniform]:
        bodies, goal = len(self.scene.bodies), self.settings.goal
        draws = {f"start_{key}": np.tile(width, bodies) for key, width in self.settings.start.items()}
        draws = {name: Uniform(-width, width) for name, width in draws.items()}
        return draws if goal is None else {**draws, "goal": goal.place}

    def _check_starts(self) -> None:
        """Refuse starts that may lie deep inside a wall: for each wall the start that is nearest to it is checked."""
        if "pos" not in self.settings.start:
            return
        bodies, chosen = self.world.body_count, np.zeros(1, dtype=np.int64)
        for wall in self.scene.walls:
            state = self.world.state[:bodies].copy()
            state[:, at.POS : at.POS + 3] -= np.sign(wall.normal) * self.settings.start["pos"]
            try:
                check_depth(self.world, state, self.world.params[:bodies], chosen, START)
            except ValueError as error:
                raise self._reader.start_error("pos", str(error)) from None

    @property
    def observation(self):
        """Entries of the observation: position, velocity, rotation, angular velocity of every body, then the goal."""
        length, entries = self.settings.length, []
        for body in range(len(self.scene.bodies)):
            entries += [observe.pos(body, length), observe.linvel(body, length)]
            entries += [observe.rotation(body), observe.angvel(body)]
        return entries if self.settings.goal is None else [*entries, observe.drawn("goal", 3, "m", length)]

    def place(self, drawn):
        """Poses and velocities of the scene, plus the random variation of the episode."""
        shape = (-1, self.world.body_count, 3)
        return {key: self._own_starts[key] + drawn[f"start_{key}"].reshape(shape) for key in self.settings.start}

    def measure(self, worlds):
        """Distance from the goal [m], and speed [m/s], of the body that has the goal."""
        goal = self.settings.goal
        if goal is None:
            return {}
        apart, velocity = worlds.pos[:, goal.body] - worlds.drawn["goal"], worlds.linvel[:, goal.body]
        return {"distance": np.linalg.norm(apart, axis=1), "speed": np.linalg.norm(velocity, axis=1)}

    def begin(self, worlds):
        """Store the closeness to the goal at the start of the episode."""
        if self.settings.goal is not None:
            worlds.memory["closeness"][...] = self._closeness(worlds)

    def update(self, worlds):
        """Store the gain of closeness to the goal in this control step."""
        if self.settings.goal is not None:
            closeness = self._closeness(worlds)
            worlds.memory["gain"][...] = closeness - worlds.memory["closeness"]
            worlds.memory["closeness"][...] = closeness

    def success(self, worlds):
        """Success (n,) bool: the body is within the tolerance of the goal, and at most as fast as the goal allows."""
        goal, measured = self.settings.goal, worlds.measured
        if goal is None:
            return super().success(worlds)
        return (measured["distance"] <= goal.tolerance) & (measured["speed"] <= goal.speed)

    def rewards(self, worlds):
        """Gain of closeness to the goal in this control step, and a bonus for success."""
        if self.settings.goal is None:
            return {}
        return {"progress": worlds.memory["gain"], "success": BONUS * worlds.success}

    def own_settings(self):
        """Unit of lengths and tolerances of the goal, as settings that must agree where a state is restored."""
        goal, length = self.settings.goal, {"length": self.settings.length}
        if goal is None:
            return length
        return {**length, "goal": f"body {goal.body} within {goal.tolerance!r} m at {goal.speed!r} m/s"}

    def goal_mark(self, world):
        """Disc around the goal with the bounding radius of the body plus the tolerance."""
        goal = self.settings.goal
        if goal is None:
            return None
        row = world * self.world.body_count + goal.body
        radius = goal.tolerance + float(self.world.params[row, at.RADIUS])
        reached = bool(self.outcome[world, col.SUCCESS])
        return {"pos": self.drawn["goal"][world], "radius": radius, "reached": reached}

    def _closeness(self, worlds) -> np.ndarray:
        """Closeness to the goal (n,): -log(1 + distance / tolerance), which is 0 at the goal and has no unit."""
        return -np.log1p(worlds.measured["distance"] / self.settings.goal.tolerance)
