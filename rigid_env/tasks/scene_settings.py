"""Settings of a scene's environment, from the table [environment] of its file or from arguments of the same names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import physics
from physics import validation
from physics.annotations import Frame
from physics.io.toml import SceneFile
from physics.scene.body_names import body_index, told_bodies
from physics.summary import shown
from rigid_env.tasks.actions import FRAMES
from rigid_env.tasks.arguments import ControlArguments, part
from rigid_env.tasks.distribution import read_numbers
from rigid_env.tasks.distributions import Uniform
from rigid_env.tasks.observe import LENGTH, REACH
from rigid_env.tasks.scene_section import Section, body_indices

FORCE, TORQUE = 0.9, 0.5
"""Default limits of a driven body, as in `actions.Wrench`: force over weight, and torque over weight times reach."""

LIMITS = {"force": FORCE, "torque": TORQUE}
"""Default of each key that limits the actions."""

GOAL_SPEED = 0.1
"""[m/s] Default of the largest speed at which a goal counts as reached."""

KEYS = ("driven", "force", "torque", "frame", "length", "goal", "start", "frame_skip", "dt", "max_episode_steps")
GOAL_KEYS = ("body", "pos", "low", "high", "tolerance", "speed")
START_KEYS = ("pos", "linvel", "angvel")

Driven = str | int | Sequence[str | int]
"""Type of the argument `driven`: names or indices of the bodies that the agent acts on, or a single one."""


@dataclass(frozen=True, kw_only=True)
class SceneArguments:
    """Arguments that replace keys of a scene file's table [environment]; see `rigid_env.tasks.scene_task.SceneTask`."""

    driven: Driven | None = None
    force: float | None = None
    torque: float | None = None
    frame: Frame | None = None
    length: float | None = None
    goal: Mapping[str, Any] | None = None
    start: Mapping[str, Any] | None = None
    frame_skip: int | None = None
    dt: float | None = None
    episode_steps: int | None = None


class Place(Uniform):
    """Uniform distribution of goals, which refuses an option of `reset` that an observation could not contain.

    Parameters
    ----------
    low, high : (3,) array_like
        Smallest and largest coordinates [m].
    length : float
        Unit of lengths in observations [m].
    """

    def __init__(self, low, high, length: float):
        super().__init__(low, high)
        self.farthest = REACH * length

    def read(self, field, value, worlds):
        places = read_numbers(field, value, worlds, self.length)
        _check_near(places, field, self.farthest)
        return places


@dataclass(frozen=True)
class Goal:
    """Goal of a scene's environment: one body is to be at a place, and slow.

    Attributes
    ----------
    body : int
        Body whose centre of mass is to be at the place.
    place : Place
        Distribution of the place.
    tolerance : float
        Largest distance from the place at which the goal counts as reached [m].
    speed : float
        Largest speed at which the goal counts as reached [m/s].
    """

    body: int
    place: Place
    tolerance: float
    speed: float


@dataclass(frozen=True)
class Settings:
    """Settings of a scene's environment; `SceneTask` documents them as arguments of the same names.

    `start` has half widths (3,) of the random variation of each body's start, by the keys pos, linvel and angvel.
    """

    driven: tuple[int, ...]
    force: float
    torque: float
    frame: str
    length: float
    goal: Goal | None
    start: dict[str, np.ndarray]
    frame_skip: int
    dt: float
    max_episode_steps: int | None


class SettingsReader:
    """Reader of a scene's settings: an argument replaces the key of the same name in the file.

    Parameters
    ----------
    scene : physics.Scene
    file : SceneFile or None
        File of the scene; None: there is none, so that only arguments count.
    given : SceneArguments
        Arguments of the user; fields that are None are left to the file or the default.
    """

    def __init__(self, scene: physics.Scene, file: SceneFile | None, given: SceneArguments):
        self._scene = scene
        table = file.others.get("environment", {}) if file is not None else {}
        self._lacks_table = file.places if file is not None and "environment" not in file.others else None
        self._file = Section(table, "environment", file.places) if file is not None else Section({})
        self._given = Section({key: value for key, value in part(given, SceneArguments).items() if value is not None})

    def section(self, key: str) -> Section:
        """Table that gives the value of a key: the arguments if they have the key, else the file's table."""
        return self._given if key in self._given else self._file

    def start_error(self, key: str, message: str) -> ValueError:
        """Make an error with a message about a key of the table `start`."""
        return self.section("start").part("start", START_KEYS).error(key, f"{key}: {message}")

    def settings(self) -> Settings:
        """Read and check all settings.

        Raises
        ------
        ValueError
            Naming file, line and key, the value, and what is allowed.
        """
        self._file.require_known(KEYS)
        driven, length = self._driven(), self._value("length", _positive, LENGTH)
        force, torque = (self._value(key, _non_negative, default) for key, default in LIMITS.items())
        if force == torque == 0.0:
            raise self.section("force").error("force", "force and torque are 0; allowed is at least one above 0")
        return Settings(
            driven, force, torque, self._value("frame", _frame, FRAMES[0]), length,
            goal=self._goal(driven[0], length), start=self._start(),
            frame_skip=self._value("frame_skip", validation.count, ControlArguments.frame_skip),
            dt=self._value("dt", _positive, ControlArguments.dt),
            max_episode_steps=self._value("max_episode_steps", validation.count, None),
        )  # fmt: skip

    def _value(self, key: str, check, default):
        section = self.section(key)
        return section.read(key, check) if key in section else default

    def _driven(self) -> tuple[int, ...]:
        section, scene = self.section("driven"), self._scene
        if "driven" in section:
            return section.read("driven", lambda value, key: body_indices(value, key, scene))
        if len(scene.bodies) == 1:
            return (0,)
        if self._lacks_table is not None:
            told = (
                f"there is no table [environment]; allowed is one with driven, a list of bodies: {told_bodies(scene)}"
            )
            raise self._lacks_table.error(None, 0, None, told)
        raise section.error(None, f"driven is missing; allowed is a list of bodies: {told_bodies(scene)}")

    def _goal(self, driven: int, length: float) -> Goal | None:
        if "goal" not in self.section("goal"):
            return None
        part = self.section("goal").part("goal", GOAL_KEYS)
        scene, body = self._scene, driven
        if "body" in part:
            body = part.read("body", lambda value, key: body_index(value, key, scene))
        tolerance = part.require("tolerance", _positive, "the farthest from the goal [m] at which it counts as reached")
        speed = part.read("speed", _positive) if "speed" in part else GOAL_SPEED
        return Goal(body, _place(part, length), tolerance, speed)

    def _start(self) -> dict[str, np.ndarray]:
        if "start" not in self.section("start"):
            return {}
        part = self.section("start").part("start", START_KEYS)
        return {key: part.read(key, _half_widths) for key in START_KEYS if key in part}


def _place(part: Section, length: float) -> Place:
    """Distribution of a goal's place from the table `goal`: fixed at `pos`, or uniform from `low` to `high`."""
    if "pos" in part:
        for key in ("low", "high"):
            if key in part:
                raise part.error("pos", f"pos and {key} are given; allowed is pos, or low and high")
        low = high = part.read("pos", _point(length))
    else:
        low, high = (part.require(key, _point(length), "pos [x, y, z], or low and high") for key in ("low", "high"))
    if not (low <= high).all():
        raise part.error("high", f"low is {low.tolist()} and high is {high.tolist()}; allowed is low at most high")
    return Place(low, high, length)


def _point(length: float):
    def check(value, field: str) -> np.ndarray:
        point = validation.finite(value, (3,), field)
        _check_near(point, field, REACH * length)
        return point

    return check


def _check_near(points: np.ndarray, field: str, farthest: float) -> None:
    """Raise a ValueError for points that observations would clip: a coordinate above `farthest` [m]."""
    if np.abs(points).max(initial=0.0) > farthest:
        raise ValueError(
            f"{field} is {shown(points.tolist())}; allowed are coordinates from {-farthest:g} to {farthest:g} m, "
            f"{REACH:g} times length: what is farther is not observed"
        )


def _half_widths(value, field: str) -> np.ndarray:
    return validation.non_negative(value, (3,), field)


def _positive(value, field: str) -> float:
    return float(validation.positive(value, (), field))


def _non_negative(value, field: str) -> float:
    return float(validation.non_negative(value, (), field))


def _frame(value, field: str) -> str:
    return validation.one_of(value, FRAMES, field)
