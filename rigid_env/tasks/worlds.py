"""Read access to the worlds of a task for its NumPy functions: arrays with one row for each world."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from physics import Contacts, Impacts, RayHits
from rigid_env.tasks.named import Named
from rigid_env.tasks.reading import write_rotations, write_wall_gaps
from rigid_env.tasks.task_parts import Watched


def read_only(array: np.ndarray) -> np.ndarray:
    """Read-only view of an array."""
    view = array.view()
    view.flags.writeable = False
    return view


class Worlds:
    """Worlds that a task's functions read: all worlds in a control step, or those in which an episode begins.

    Arrays for all worlds are views of the running simulation: copy them to keep them. Quantities that take long to
    compute are computed when they are first read, once in a step.

    Attributes
    ----------
    indices : (n,) int64
        Indices of these worlds in their batch.
    pos, quat, linvel, angvel : (n, bodies, 3|4|3|3) float64
        World frame; [m], unit quaternions, [m/s], [rad/s].
    drawn : dict of str to (n,) or (n, k) float64
        Drawn values of the episodes, by their names in the task's `draws`.
    memory : dict of str to (n,) or (n, k) float64
        Numbers that the task keeps from step to step, by their names in its `memory`; functions may write them.
    action, previous_action : (n, entries) float64
        The last action and the one before it, clipped to ±1; zeros at the start of an episode.
    measured : dict of str to (n,) array
        Numbers that the task's `measure` returned, which is called before the other functions.
    success, failure : (n,) bool
        Flags that the task's functions `success` and `failure` returned; False before they are called.
    """

    def __init__(self, task: Watched, indices: np.ndarray | None = None):
        self._task, world = task, task.world
        self.is_all = indices is None
        self.indices: Any = np.arange(task.worlds) if indices is None else indices
        self._read = indices
        take = (lambda array: array) if self.is_all else (lambda array: array[indices])
        moving = world.pos, world.quat, world.linvel, world.angvel
        self.pos, self.quat, self.linvel, self.angvel = (read_only(take(array)) for array in moving)
        self.drawn = Named({name: read_only(take(values)) for name, values in task.drawn.items()}, "drawn")
        memory = {name: take(values) for name, values in task.memory_arrays.items()}
        self.memory = Named(memory, "memory", is_written=True)
        self.action, self.previous_action = read_only(take(task.action)), read_only(take(task.previous_action))
        self._take = take
        self.renew()

    def renew(self) -> None:
        """Discard cached values after the worlds have moved."""
        self.success = self.failure = np.zeros(len(self.indices), dtype=np.bool_)
        self.measured: Mapping[str, np.ndarray] = {}
        self._found: dict[str, np.ndarray] = {}
        self._contacts: dict[tuple[int, ...], Contacts] = {}
        self._impacts: dict[tuple[int, ...], Impacts] = {}
        self._sums: tuple[np.ndarray, np.ndarray] | None = None

    def __len__(self) -> int:
        return len(self.indices)

    @property
    def steps(self) -> np.ndarray:
        """Control steps (n,) int64 since the episode began."""
        return self._take(self._task.steps)

    @property
    def time(self) -> np.ndarray:
        """Time (n,) float64 since the episode began [s]."""
        return self.steps * self._task.control_dt

    @property
    def rotation(self) -> np.ndarray:
        """Rotation matrices (n, bodies, 3, 3) float64, body to world."""
        return self._worked_out("rotation", write_rotations, (self._task.world.body_count, 3, 3))

    @property
    def wall_gaps(self) -> np.ndarray:
        """Gaps (n, bodies, walls) float64 between each body and each wall [m]; negative where they overlap."""
        world = self._task.world
        return self._worked_out("wall_gaps", write_wall_gaps, (world.body_count, len(world.walls)))

    @property
    def contact_force(self) -> np.ndarray:
        """Sums (n, bodies, 3) float64 of the contact forces on each body in the last physics step, world frame [N]."""
        return self._contact_sums()[0]

    @property
    def contact_impulse(self) -> np.ndarray:
        """Sums (n, bodies, 3) float64 of the contact impulses on each body in the last resting stage [N s].

        World frame.
        """
        return self._contact_sums()[1]

    def _contact_sums(self) -> tuple[np.ndarray, np.ndarray]:
        if self._sums is None:
            self._sums = self._task.world.read_contact_sums(self._read)
        return self._sums

    def cast_rays(self, origins, directions, max_distance: float = math.inf, carrier: int | None = None) -> RayHits:
        """Cast rays into these worlds; `physics.World.cast_rays` has the arguments."""
        return self._task.world.cast_rays(origins, directions, max_distance, carrier, worlds=self._read)

    @property
    def sensors(self) -> np.ndarray:
        """Flags (n, sensors, bodies) bool, True for a body in a sensor; see `physics.World.read_sensors`."""
        if "sensors" not in self._found:
            self._found["sensors"] = self._task.world.read_sensors(self._read)
        return self._found["sensors"]

    @property
    def contacts(self) -> Contacts:
        """Contacts of the last physics step, at most 12 rows for each body; see `physics.Contacts`."""
        return self._contacts_of()

    def contacts_of(self, body: int, count: int) -> Contacts:
        """Contacts of one body, the `count` with the largest forces; this body is the first of each pair."""
        return self._contacts_of(count, body)

    def _contacts_of(self, *chosen: int) -> Contacts:
        if chosen not in self._contacts:
            self._contacts[chosen] = self._task.world.read_contacts(self._read, *chosen)
        return self._contacts[chosen]

    @property
    def impact_impulse(self) -> np.ndarray:
        """Sums (n, bodies, 3) float64 of the impulses of impacts on each body in the control step, world frame.

        The unit is N s.
        """
        return self._impacts_of(0).total

    @property
    def impacts(self) -> Impacts:
        """Impacts of the last control step, a row for each pair that collided; see `physics.Impacts`."""
        return self._impacts_of()

    def impacts_of(self, body: int, count: int) -> Impacts:
        """Impacts of one body, the `count` pairs with the largest impulses; this body is the first of each pair."""
        return self._impacts_of(count, body)

    def _impacts_of(self, *chosen: int) -> Impacts:
        if chosen not in self._impacts:
            world = self._task.world
            if world.impacts is None:
                world.keep_impacts()  # at the rehearsal, before the first step
            self._impacts[chosen] = world.read_impacts(self._read, *chosen)
        return self._impacts[chosen]

    @property
    def wrench(self) -> np.ndarray:
        """Wrenches (n, bodies, 6) float64 of the last action alone: force [N] and torque [N m], world frame."""
        return self._take(self._task.wrench)

    @property
    def weight(self) -> np.ndarray:
        """Weights (n, bodies) float64: mass times gravity (9.81 m/s² where there is none) [N]."""
        return self._take(self._task.weights)

    def _worked_out(self, name: str, write, shape: tuple[int, ...]) -> np.ndarray:
        if name not in self._found:
            out = np.empty((len(self.indices), *shape))
            write(self._task.world, self.indices, out)
            self._found[name] = out
        return self._found[name]
