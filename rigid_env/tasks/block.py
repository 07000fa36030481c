"""Base of the block's tasks: one block among three walls, starting at rest on a random face."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

import physics
from physics.annotations import Layout
from rigid_env.tasks import layout as col
from rigid_env.tasks.actions import Wrench
from rigid_env.tasks.area import Area
from rigid_env.tasks.arguments import BatchArguments, ControlArguments, part, takes
from rigid_env.tasks.block_draws import YAW, EdgesInside, Face, OnFloor
from rigid_env.tasks.distribution import LAST, Distribution
from rigid_env.tasks.distributions import Uniform
from rigid_env.tasks.kernels import start_poses
from rigid_env.tasks.parameters import LENGTHS, Edges, Number, middle, parse_range, scene_size
from rigid_env.tasks.task import Task

FORCE_SHARE = 0.9
"""Largest force over the block's weight m g: less than 1, so that the agent cannot fly."""

TORQUE_SHARE = 0.5
"""Largest torque over m g times the longest half edge. To tip the block, a torque alone must exceed m g times the half
edge that its centre has to pass over. The default tips the 5 x 3 x 2 m block over its shortest half edge. It is too
weak for the others without the force's help, momentum, or a wall."""


@dataclass(frozen=True, kw_only=True)
class BlockArguments:
    """Arguments that only the block's tasks have; see `BlockTask`."""

    walls: Layout = "three"
    half_width: float = 10.0
    mass: Number = 6.0
    size: Edges = (5.0, 3.0, 2.0)
    friction: Number = 0.5
    restitution: Number = 0.2
    gravity: Number = 9.81


@dataclass(frozen=True)
class _Arguments(ControlArguments, BlockArguments, BatchArguments):
    pass


class BlockTask(Task):
    """A batch of worlds with one block each, which starts at rest on the floor among three walls.

    Subclasses define the goal, and one compiled function for observations, rewards and success.

    Parameters
    ----------
    worlds, accuracy, effects, frame_skip, dt, dump_faults, threads
        As of `Task`.
    walls : {"three", "corner"}
        Layout, see `Area`.
    half_width : float
        Half the width of the floor that starts and goals are drawn from, and of the three-wall box [m].
    mass, size, friction, restitution, gravity : number, pair or Distribution
        Block's mass [kg] and edges (three numbers) [m], coefficients against the walls, strength of gravity along -y
        [m/s²]. A pair (low, high) is drawn from uniformly in each episode of each world.

    Attributes
    ----------
    area : Area
        Part of the floor for starts and goals, and its walls.
    record : (worlds, RECORD_SIZE) float64
        Numbers of each world's episode, see `rigid_env.tasks.layout`.
    goal_draw : str or None
        Name of the goal among the task's draws; None: the task draws no goal.

    Raises
    ------
    ValueError
        The message names the field, its value and what is allowed.
    """

    actions = Wrench(0, FORCE_SHARE, TORQUE_SHARE)
    max_episode_steps = 300
    explanations: ClassVar = {
        "place": "x and z of the block's centre at the start [m]",
        "yaw": "turn about the vertical at the start [rad]",
        "face": "face that is down at the start: 0 to 5 for -x, +x, -y, +y, -z, +z",
        "speed": "speed of the block's centre [m/s]",
        "spin": "length of the angular velocity [rad/s]",
        "reward_progress": "gain of the potential",
        "reward_effort": "cost of the step and of the squared action",
        "reward_success": "bonus for success",
    }
    record_size = col.RECORD_SIZE
    terms = ("progress", "effort", "success")
    goal_draw: ClassVar[str | None] = None
    error_name: ClassVar[str]

    @takes(_Arguments)
    def __init__(self, given: _Arguments) -> None:
        self.area = Area(given.walls, given.half_width)
        self._parameters = {field: parse_range(field, getattr(given, field)) for field in LENGTHS}
        edges = self._parameters["size"]
        self._largest = (
            edges.high if isinstance(edges, Uniform) else edges.at(np.full((1, edges.uniforms), LAST), {})[0]
        )
        self.area.check_room(self._largest)
        self._parameters["size"] = EdgesInside(edges, self.area)
        super().__init__(given.worlds, **part(given, ControlArguments))

    def declared_draws(self) -> Mapping[str, Any]:
        """Distributions of an episode: place, yaw and face of the start, the goal, and five physical parameters."""
        start = {"place": OnFloor(self.area), "yaw": YAW, "face": Face()}
        goal = {} if self.goal_draw is None else {self.goal_draw: self.goal()}
        return {**start, **goal, **self._parameters}

    def goal(self) -> Distribution:
        """Distribution from which an episode draws its goal; a subclass with a `goal_draw` defines it."""
        raise NotImplementedError

    def make_scene(self, distributions: Mapping[str, Distribution]) -> physics.Scene:
        """Scene with the block at the middle of the area, above the floor, each parameter at the middle of its range.

        `distributions` is not used: the block's parameters are known from the constructor.
        """
        size, centre = scene_size(self._parameters["size"]), self.area.centre
        values = {field: float(middle(each)) for field, each in self._parameters.items() if field != "size"}
        clear = float(np.linalg.norm(self._largest))
        return physics.Scene(
            bodies=[physics.Block(size=tuple(size), mass=values["mass"], pos=(centre, clear, centre))],
            walls=self.area.half_spaces,
            effects=[
                physics.Gravity((0.0, -values["gravity"], 0.0)),
                physics.Contact(restitution=values["restitution"]),
                physics.Friction(values["friction"]),
            ],
        )

    def place(self, drawn: Mapping[str, np.ndarray]) -> Mapping[str, Any]:
        """Poses of the block at rest on the floor, from the drawn place, yaw, face and size."""
        count = len(drawn["yaw"])
        pos, quat = np.empty((count, 1, 3)), np.empty((count, 1, 4))
        start_poses(drawn["place"], drawn["yaw"], drawn["face"], 0.5 * drawn["size"], pos, quat)
        return {"pos": pos, "quat": quat}

    @property
    def place_options(self) -> tuple[str, ...]:
        return ("place", "yaw", "face", "size")

    def _weights(self, rows):
        given = next((effect for effect in self.effects if isinstance(effect, physics.Gravity)), None)
        gravity = self.drawn["gravity"][rows] if given is None else float(np.linalg.norm(given.acceleration))
        return (self.drawn["mass"][rows] * gravity)[:, None]

    def _note_parameters(self, rows):
        super()._note_parameters(rows)
        self.record[rows, col.HALF : col.HALF + 3] = 0.5 * self.drawn["size"][rows]

    def lines(self, world: int) -> tuple[str, ...]:
        if self.compiled is None:
            return super().lines(world)
        error, speed, spin = self.outcome[world, [col.ERROR, col.SPEED, col.SPIN]].tolist()
        unit = "m" if self.error_name == "distance" else "rad"
        return f"{self.error_name} {error:.2f} {unit}", f"speed {speed:.2f} m/s   spin {spin:.2f} rad/s"
