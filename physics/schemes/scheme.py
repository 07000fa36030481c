"""Scheme: a way to step worlds of some scenes, as one object. `physics.schemes` lists them.

To add one, copy the module that is nearest to it (`springs` is the shortest), and keep to these rules:

1. Write its kernels in a folder of `physics/kernels`. An entry kernel takes a work queue, a time grid and the arrays of
   bodies (`physics.kernels.state.groups`), then arguments of its own, and returns nothing. It goes through the worlds
   by `physics.kernels.parallel.work_stealing.for_each_world`, and adds the wrench of each body to its loads.
2. Write a module in `physics/schemes` with a subclass of `Scheme`, and `SCHEMES`, a tuple of its instances.
3. Add the module's name to `MODULES` in `physics/schemes/__init__.py`. The first scheme there that takes a scene steps
   it: the order matters where two take the same.
4. `takes` says which scenes are this scheme's, by what can act in them (`Needs`) and by the accuracy. It never raises.
5. `objection` names what such a scene declares and this scheme does not know: the field, the value, and what is
   allowed. "" says that it knows everything. A scene that is refused is stepped by no other scheme.
6. `make_scratch` gives the working memory of one thread, `make_motion` a second one if the kernel has it. A step leaves
   nothing in it that the next one reads: worlds move between threads.
7. `memory` is the memory of contacts from one step to the next, and the only reader of it (`ContactMemory`). What
   starts a solve and what users see come from the same rows. `WallMemory` and `BodyMemory` can be shared.
8. `arguments` are those of the kernel after the first three, for thread k. Switches that are None are pruned by the
   compiler; an argument of another type compiles another kernel.
9. A kernel writes states that are finite, or leaves the world as it was and counts a fault in the report.

`tests/schemes` adds a toy scheme by these rules. That results are right is for tests of its own to show: hold it
against `tests/reference`, and run the hard cases (`rigid-env hard-cases`).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np

from physics.accuracy import Accuracy
from physics.kernels.forces.force_field_dispatch import Term
from physics.kernels.state.groups import ContactSwitches, FlightSwitches, Records
from physics.kernels.state.sleeping import Sleep
from physics.kernels.time_stepping.midpoint_friction import MEAN_SLIP_CONTACTS
from physics.scene.force_field import FieldSlot
from physics.scene.needs import Needs
from physics.scene.scene import Scene
from physics.schemes.contact_memory import ContactMemory


@dataclass(frozen=True)
class Switches:
    """Switches that a kernel is compiled for. None is off, True is on.

    `offset_frame` is on where the body frame of a body is not all there is to know of its mass: its principal axes are
    not its body axes, or its geometric centre is not its centre of mass. `pivots` is on where the solver of a body may
    pivot. `integrator` is the code of a textbook integrator of free motion (`physics.accuracy`), None: the exact flow.
    `meeting` says whether bodies touch each other, `ellipsoids` whether there are any among those, `hulls` whether any
    hulls touch anything. `sleeping` is on where bodies may sleep. `laws` are those of
    `physics.kernels.state.contact_law_dispatch`.
    """

    contact: bool | None
    friction: bool | None
    restitution: bool | None
    gravity: bool | None
    gyroscopic: bool | None
    offset_frame: bool | None
    pivots: bool | None
    integrator: int | None
    meeting: bool
    ellipsoids: bool | None
    hulls: bool | None
    sleeping: bool | None
    features: int
    fields: tuple[FieldSlot, ...]
    laws: tuple[str, ...]

    @property
    def terms(self) -> tuple[Term, ...]:
        """The fields' part in the kernel."""
        return tuple(slot.term for slot in self.fields)

    @property
    def of_contact(self) -> ContactSwitches:
        """Those of contact with walls, as a kernel takes them."""
        return ContactSwitches(self.contact, self.friction, self.pivots)

    @property
    def of_flight(self) -> FlightSwitches:
        """Those of free motion, as a kernel takes them."""
        return FlightSwitches(self.gyroscopic, self.offset_frame, self.integrator)


class Worlds(Protocol):
    """A batch of worlds, as far as a scheme sees it: `physics.world.batch.Batch`."""

    @property
    def plan(self) -> Any:
        """Its `Switches`."""

    memory: np.ndarray
    report_table: np.ndarray
    event_log: np.ndarray
    event_counts: np.ndarray
    scratch: list
    motions: list

    def sleep_of_kernel(self) -> Sleep | None:
        """Sleep record for the step; None where no body may sleep."""


class Scheme(ABC):
    """A way to step worlds; see the rules at the head of this module.

    Attributes
    ----------
    name : str
    kernel : Callable
        Entry kernel.
    memory : ContactMemory
    is_event_driven : bool
        It steps from event to event, and so makes no error of its own where motion is smooth in between.
    is_error_controlled : bool
        Its steps are cut into parts that meet an error.
    logs_all_events : bool
        Its log holds all that happens, and not impacts alone.
    couples_bodies : bool
        All bodies of a world are in one contact problem, whose solver does not pivot.
    """

    name: ClassVar[str]
    kernel: ClassVar[Callable]
    memory: ContactMemory
    is_event_driven: ClassVar[bool] = False
    is_error_controlled: bool = False
    logs_all_events: bool = False
    couples_bodies: ClassVar[bool] = False

    @abstractmethod
    def takes(self, needs: Needs, accuracy: Accuracy) -> bool:
        """True if scenes with such needs are this scheme's."""

    def objection(self, scene: Scene, needs: Needs, accuracy: Accuracy) -> str:
        """Name what the scene declares and this scheme does not know; "" where there is nothing."""
        return ""

    @abstractmethod
    def make_scratch(self, scene: Scene, switches: Switches, walls: np.ndarray, accuracy: Accuracy) -> Any:
        """Make the working memory of one thread; `walls` is the table of the batch."""

    def make_motion(self, scene: Scene, switches: Switches, accuracy: Accuracy) -> Any:
        """Make the second working memory of one thread; None where there is none."""
        return None

    def acting(self, accuracy: Accuracy) -> Accuracy:
        """Accuracy that acts, where the scheme has least tolerances."""
        return accuracy

    @abstractmethod
    def arguments(self, worlds: Worlds, k: int) -> tuple:
        """Arguments of the kernel for thread k that it alone has."""

    def __repr__(self) -> str:
        return self.name


def records(worlds: Worlds) -> Records:
    """Arrays that a step keeps and writes besides the state."""
    return Records(worlds.memory, worlds.report_table, worlds.event_log, worlds.event_counts)


def settings(accuracy: Accuracy, impacts_of: int = 1) -> dict[str, Any]:
    """Numbers of an accuracy as the scratch memories take them; one substep has impacts of so many bodies."""
    return {
        "tolerance": accuracy.tolerance, "sweeps": accuracy.iterations, "splits": accuracy.impacts * impacts_of,
        "relative_slop": accuracy.slop, "rest_share": accuracy.rest_share,
        "mean_slip": MEAN_SLIP_CONTACTS if accuracy.slip == "mean" else 0,
    }  # fmt: skip
