"""Contact memory of a scheme: contacts of the last stage, which start the next solve and which users are shown."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any

import numpy as np

from physics.parallel.bound_call import compiled
from physics.scene.scene import Scene
from physics.schemes.contacts import Contacts, Strongest


class ContactMemory(ABC):
    """Layout of a memory, and all that reads or writes it outside a step.

    `worlds` is a batch (`physics.world.batch.Batch`); `memory` its array, or one of a snapshot.
    """

    @abstractmethod
    def shape(self, scene: Scene, switches: Any, worlds: int) -> tuple[int, int]:
        """Rows and columns for so many worlds."""

    @abstractmethod
    def rows_per_world(self, bodies: int) -> int:
        """Rows of one world of so many bodies."""

    def copy(self, source: np.ndarray, target: np.ndarray) -> None:
        """Copy all rows."""
        target[...] = source

    @abstractmethod
    def is_valid(self, worlds: Any, memory: np.ndarray) -> bool:
        """True if a step could have written these numbers: kernels take counts and indices from them."""

    @abstractmethod
    def room(self, worlds: Any) -> int:
        """Contacts of one world that there is room for."""

    @abstractmethod
    def count(self, worlds: Any, index: int) -> int:
        """Contacts that one world has."""

    @abstractmethod
    def read(self, worlds: Any, indices: np.ndarray, body: int, strongest: Strongest, out: Contacts) -> None:
        """Write the contacts of some worlds, of one body or of `EVERY_BODY`, into `out`."""

    @abstractmethod
    def add_forces(self, worlds: Any, indices: np.ndarray, out: np.ndarray) -> None:
        """Add the contact forces on each body [N], world frame, to `out` (n, bodies, 3)."""

    @abstractmethod
    def durations(self, worlds: Any, indices: np.ndarray) -> Any:
        """Times that the forces acted for [s], as they multiply (n, bodies, 3)."""


def are_indices(values: np.ndarray, count: int) -> bool:
    """True if all are whole numbers from 0 to below `count`."""
    return bool(((values >= 0) & (values < count) & (values == np.floor(values))).all())


def call(read: Callable, *arguments) -> None:
    """Call a kernel whose arguments have the same types each time: to find them out would take ten times as long."""
    if read not in _MACHINE_CODE:
        _MACHINE_CODE[read] = compiled(read, arguments)
    _MACHINE_CODE[read](*arguments)


_MACHINE_CODE: dict[Callable, Callable] = {}
