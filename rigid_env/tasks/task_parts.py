"""Protocols: the parts of a `Task` that each of its helper classes may use.

A `Task` makes its helpers and passes itself to them. The type of their argument is a protocol of this module, so a
helper can use only the attributes listed here.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

import numpy as np

import physics

if TYPE_CHECKING:
    from rigid_env.tasks.disturbances import Disturbances
    from rigid_env.tasks.draws import Draws
    from rigid_env.tasks.entries import Observation
    from rigid_env.tasks.worlds import Worlds


class Batched(Protocol):
    """Batch of worlds with the bodies' weights and the steps of the running episodes."""

    world: physics.World
    weights: np.ndarray

    @property
    def worlds(self) -> int: ...

    @property
    def control_dt(self) -> float: ...

    @property
    def steps(self) -> np.ndarray: ...


class Disturbed(Batched, Protocol):
    """Part of a task that `Disturbances` use, including the generators from which they draw."""

    generators: list[Any]  # numpy.random.Generator; None before the first episode

    def inv_mass(self, world: int, body: int) -> float: ...


class Watched(Batched, Protocol):
    """Part of a task that `Worlds` show to the task's functions."""

    action: np.ndarray
    previous_action: np.ndarray
    memory_arrays: dict[str, np.ndarray]

    @property
    def drawn(self) -> dict[str, np.ndarray]: ...

    @property
    def wrench(self) -> np.ndarray: ...


class Stepped(Watched, Protocol):
    """Part of a task that a control step changes and that `StepUndo` restores."""

    clock: int
    generators: list[Any]  # numpy.random.Generator; None before the first episode
    disturbed: Disturbances | None
    record: np.ndarray
    outcome: np.ndarray
    obs: np.ndarray
    status: np.ndarray

    @property
    def is_driving(self) -> bool: ...

    def own_arrays(self) -> dict[str, np.ndarray]: ...


class Called(Stepped, Protocol):
    """Part of a task that `Functions` use: the task's NumPy functions, and the arrays for their results."""

    observed: Observation
    episodes: Draws
    given: np.ndarray
    measures: ClassVar[tuple[str, ...]]
    terms: ClassVar[tuple[str, ...]]

    def set_outcome(self, outcome: np.ndarray) -> None: ...

    def move(self, rows: np.ndarray, values: Mapping[str, np.ndarray], chosen: Mapping[str, np.ndarray]) -> None: ...

    def act(self) -> None: ...

    def not_finite(self, world: int) -> ValueError: ...

    def begin(self, worlds: Worlds) -> None: ...

    def update(self, worlds: Worlds) -> None: ...

    def success(self, worlds: Worlds) -> np.ndarray: ...

    def failure(self, worlds: Worlds) -> np.ndarray: ...

    def rewards(self, worlds: Worlds) -> Mapping[str, np.ndarray]: ...

    def measure(self, worlds: Worlds) -> Mapping[str, np.ndarray]: ...
