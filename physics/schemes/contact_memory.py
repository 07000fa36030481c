"""Contact memory of a scheme: contacts of the last stage, with which the next solve starts and which users read."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any

import numpy as np

from physics.parallel.bound_call import compiled
from physics.scene.scene import Scene
from physics.schemes.contacts import Contacts, Strongest


class ContactMemory(ABC):
    """Layout of the contact memory of a scheme, and all reading and writing of it outside a step.

    In the methods `worlds` is a batch (`physics.world.batch.Batch`), and `memory` its array of that name, or the one of
    a snapshot. `indices` (n,) int64 are those of worlds.
    """

    @abstractmethod
    def shape(self, scene: Scene, switches: Any, worlds: int) -> tuple[int, int]:
        """Number of rows and columns of the memory of a batch of `worlds` worlds; `switches` are those of the plan."""

    @abstractmethod
    def rows_per_world(self, bodies: int) -> int:
        """Number of rows of one world with `bodies` bodies."""

    def copy(self, source: np.ndarray, target: np.ndarray) -> None:
        """Copy the memory `source` of a batch or snapshot into `target`, of equal shape."""
        target[...] = source

    @abstractmethod
    def is_valid(self, worlds: Any, memory: np.ndarray) -> bool:
        """True if all counts and indices in `memory`, which kernels use unchecked, are possible for these worlds."""

    @abstractmethod
    def room(self, worlds: Any) -> int:
        """Number of contacts for which one world has room."""

    @abstractmethod
    def count(self, worlds: Any, index: int) -> int:
        """Number of contacts of the world `index` in its last step."""

    @abstractmethod
    def read(self, worlds: Any, indices: np.ndarray, body: int, strongest: Strongest, out: Contacts) -> None:
        """Write the contacts of the worlds `indices`, of one body or of `EVERY_BODY`, into `out`.

        `strongest` is scratch memory with as many rows as `out` has for a world.
        """

    @abstractmethod
    def add_forces(self, worlds: Any, indices: np.ndarray, out: np.ndarray) -> None:
        """Add the contact forces on each body of the worlds `indices` [N], world frame, to `out` (n, bodies, 3)."""

    @abstractmethod
    def durations(self, worlds: Any, indices: np.ndarray) -> Any:
        """Durations of the contact forces [s]: a factor that turns forces (n, bodies, 3) into impulses."""


def are_indices(values: np.ndarray, count: int) -> bool:
    """True if all floats `values` are whole numbers from 0 to `count` - 1."""
    return bool(((values >= 0) & (values < count) & (values == np.floor(values))).all())


def call(read: Callable, *arguments) -> None:
    """Call the kernel `read`, whose arguments have the same types in every call.

    Its machine code is looked up once for these types; a look-up in each call would take ten times as long.
    """
    if read not in _MACHINE_CODE:
        _MACHINE_CODE[read] = compiled(read, arguments)
    _MACHINE_CODE[read](*arguments)


_MACHINE_CODE: dict[Callable, Callable] = {}
