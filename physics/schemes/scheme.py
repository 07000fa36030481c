"""Scheme: an object that steps the worlds of some kind of scene. `physics.schemes` lists all schemes.

To add one, copy the module that is nearest to it (`springs` is the shortest), and keep to these rules:

1. Write its kernels in a folder of `physics/kernels`. An entry kernel takes a work queue, a time grid and the arrays of
   bodies (`physics.kernels.state.groups`), then arguments of its own, and returns nothing. It visits the worlds with
   `physics.kernels.parallel.work_stealing.for_each_world`, and adds the wrench of each body to its loads.
2. Write a module in `physics/schemes` with a subclass of `Scheme`, and `SCHEMES`, a tuple of its instances.
3. Add the module's name to `MODULES` in `physics/schemes/__init__.py`. The first scheme there that takes a scene steps
   it; so the order matters where two schemes take the same scene.
4. `takes` decides whether the scheme takes a scene, from the effects that can act in it (`Needs`) and the accuracy. It
   never raises an exception.
5. `objection` names an effect that the scene declares and this scheme does not support: the field, the value, and what
   is allowed. It returns "" if there is none. No other scheme steps a scene that was refused so.
6. `make_scratch` makes the workspace of one thread, `make_motion` a second one if the kernel needs it. No step may read
   there what an earlier step wrote, since worlds move between threads.
7. `memory` (`ContactMemory`) describes the contacts that are kept from one step to the next, and is their only reader.
   The start of a solve and the contacts that users see come from the same rows. Schemes may share `WallMemory` and
   `BodyMemory`.
8. `arguments` gives the arguments of the kernel after the first three, for thread k. The compiler removes code behind
   switches that are None; an argument of another type compiles another kernel.
9. A kernel writes finite states only. If it cannot, it leaves the world as it was and counts a fault in the report.

`tests/schemes` adds a toy scheme by these rules. A new scheme needs tests of its own that its results are right:
compare it with `tests/reference`, and run the hard cases (`rigid-env hard-cases`).
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
    """Effect switches for which a kernel is compiled: True is on, None is off.

    Attributes
    ----------
    contact, friction, restitution, gravity : True or None
        Whether the effect can act in the scene.
    gyroscopic : True or None
        Whether some body has unequal moments of inertia.
    offset_frame : True or None
        Whether some body's principal axes are not its body axes, or its geometric centre is not its centre of mass.
    pivots : True or None
        Whether pivoting methods may solve the contact problem of a body at walls.
    integrator : int or None
        Code of a textbook integrator of free motion (`physics.accuracy.INTEGRATORS`); None: the exact flow.
    meeting : bool
        Whether bodies can touch each other.
    fixed : True or None
        Whether some bodies are fixed.
    lone : True or None
        Whether exactly one body moves, and it can touch fixed bodies.
    grouped : True or None
        Whether collision groups keep some pairs apart that would touch otherwise.
    ellipsoids : True or None
        Whether ellipsoids are among bodies that can touch each other.
    hulls : True or None
        Whether hulls can touch walls or bodies.
    capsules : True or None
        Whether capsules can touch walls or bodies.
    cylinders : True or None
        Whether cylinders can touch walls or bodies.
    compounds : True or None
        Whether compounds can touch walls or bodies.
    sleeping : True or None
        Whether bodies may sleep.
    features : int
        Features with which a body may touch a wall, as in `Needs`.
    fields : tuple of FieldSlot
        Force fields of the scene.
    laws : tuple of str
        Contact laws at walls, names from `physics.kernels.state.contact_law_dispatch.LAWS`.
    material_columns : int
        Columns of `params` for coefficients at walls; 0 if no wall has one of its own, and no exception names a wall.
    walls_differ : True or None
        Whether a body may have different coefficients at two walls.
    motion_columns : int
        Columns of `params` for prescribed motions; 0 if no body has one.
    pair_materials : True or None
        Whether two bodies in contact have other coefficients than those of the default rules.
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
    fixed: bool | None
    lone: bool | None
    grouped: bool | None
    ellipsoids: bool | None
    hulls: bool | None
    capsules: bool | None
    cylinders: bool | None
    compounds: bool | None
    sleeping: bool | None
    features: int
    fields: tuple[FieldSlot, ...]
    laws: tuple[str, ...]
    material_columns: int
    walls_differ: bool | None
    pair_materials: bool | None
    motion_columns: int

    @property
    def field_columns(self) -> int:
        """Number of columns of the force fields in the parameter table."""
        return sum(term.count * term.size for term in self.terms)

    @property
    def columns(self) -> int:
        """Number of columns of the parameter table for fields, wall coefficients, contact laws and motions."""
        return self.field_columns + self.material_columns + len(self.laws) + self.motion_columns

    @property
    def terms(self) -> tuple[Term, ...]:
        """Terms of the scene's force fields: their functions and columns, as the compiler needs them."""
        return tuple(slot.term for slot in self.fields)

    @property
    def of_contact(self) -> ContactSwitches:
        """Switches of contact with walls, grouped as kernels take them."""
        return ContactSwitches(self.contact, self.friction, self.pivots)

    @property
    def of_flight(self) -> FlightSwitches:
        """Switches of free motion, grouped as kernels take them."""
        return FlightSwitches(self.gyroscopic, self.offset_frame, self.integrator)


class Worlds(Protocol):
    """Interface of a batch of worlds (`physics.world.batch.Batch`), reduced to the attributes that schemes use."""

    @property
    def plan(self) -> Any:
        """Plan of the batch, a subclass of `Switches`."""

    memory: np.ndarray
    report_table: np.ndarray
    event_log: np.ndarray
    event_counts: np.ndarray
    scratch: list
    motions: list

    def sleep_of_kernel(self) -> Sleep | None:
        """Record with the array and settings of sleep, as kernels take it; None if bodies do not sleep."""


class Scheme(ABC):
    """Base of schemes, which step the worlds of some kind of scene; the head of this module has the rules for them.

    Attributes
    ----------
    name : str
        Name for messages.
    kernel : Callable
        Entry kernel, which steps worlds.
    memory : ContactMemory
        Layout and readers of the scheme's contact memory.
    is_event_driven : bool
        Whether it steps from event to event, so that the length of a step does not decide the error.
    is_error_controlled : bool
        Whether it cuts substeps into parts whose errors meet a tolerance.
    logs_all_events : bool
        Whether its log holds all events; else only impacts.
    couples_bodies : bool
        Whether all bodies of a world share one contact problem, whose solver does not pivot.
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
        """True if this scheme takes scenes with these needs at this accuracy."""

    def objection(self, scene: Scene, needs: Needs, accuracy: Accuracy) -> str:
        """Message about an effect of the scene that this scheme does not support; "" if it supports all."""
        return ""

    @abstractmethod
    def make_scratch(self, scene: Scene, switches: Switches, walls: np.ndarray, accuracy: Accuracy) -> Any:
        """Make the workspace of one thread; `walls` is the table of walls of the batch (walls, WALL_SIZE)."""

    def make_motion(self, scene: Scene, switches: Switches, accuracy: Accuracy) -> Any:
        """Make the second workspace of one thread; None if the kernel needs none."""
        return None

    def acting(self, accuracy: Accuracy) -> Accuracy:
        """Accuracy with which the scheme steps; some schemes raise tolerances to least values of their own."""
        return accuracy

    @abstractmethod
    def arguments(self, worlds: Worlds, k: int) -> tuple:
        """Arguments of this scheme's kernel for thread `k`, after the first three, which all kernels have."""

    def __repr__(self) -> str:
        return self.name


def records(worlds: Worlds) -> Records:
    """Group the arrays of a batch that a step keeps and writes besides the state: contacts, report and events."""
    return Records(worlds.memory, worlds.report_table, worlds.event_log, worlds.event_counts)


def settings(accuracy: Accuracy, impacts_of: int = 1) -> dict[str, Any]:
    """Numbers of an accuracy, as the functions that make workspaces take them.

    The limit of impacts of a substep is multiplied by `impacts_of`, the number of bodies that share the limit.
    """
    return {
        "tolerance": accuracy.tolerance, "sweeps": accuracy.iterations, "splits": accuracy.impacts * impacts_of,
        "relative_slop": accuracy.slop, "rest_share": accuracy.rest_share,
        "mean_slip": MEAN_SLIP_CONTACTS if accuracy.slip == "mean" else 0,
    }  # fmt: skip
