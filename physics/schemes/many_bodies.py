"""Time stepping of bodies that touch each other, with one contact problem for all bodies of a world."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from physics.accuracy import EVENTS, INTEGRATORS, Accuracy
from physics.kernels.multibody.data import allocation
from physics.kernels.multibody.data.arrays import Grain
from physics.kernels.multibody.stepping.adaptive_substep import (
    LONE_RELATIVE_SLOP,
    MIN_RELATIVE_SLOP,
    MIN_SOLVER_TOLERANCE,
)
from physics.kernels.multibody.stepping.step import step_many
from physics.kernels.state.contact_law_dispatch import LAW_ANISOTROPY, LAW_ROLLING, LAW_SPIN, LAW_STIFFNESS
from physics.kernels.state.groups import MultibodySwitches
from physics.scene.body_axes import axis_table
from physics.scene.effects import Contact, Friction
from physics.scene.groups import group_table
from physics.scene.needs import Needs
from physics.scene.parts import part_count, part_list
from physics.scene.polyhedra import polyhedra
from physics.scene.scene import Scene
from physics.schemes import objections
from physics.schemes.body_memory import BodyMemory
from physics.schemes.material_tables import pair_materials, wall_materials
from physics.schemes.scheme import Scheme, Switches, Worlds, records, settings

_OF_STAGES = frozenset((LAW_ROLLING, LAW_SPIN, LAW_STIFFNESS))
"""Contact laws that act over a stage, so that bodies at walls need stages under error control at `precise`."""


def _meetings(scene: Scene, switches: Switches) -> int:
    """Code of the setting `meet`: 0 if no bodies touch each other, 1 if all may, 2 if only a moving and a fixed one."""
    contact = scene.effect(Contact)
    if contact is None or not switches.meeting:
        return 0
    return 1 if contact.between_bodies else 2


def _grain(scene: Scene, switches: Switches) -> Grain | None:
    """Axes of friction with two coefficients; None with one coefficient."""
    friction: Any = scene.effect(Friction)
    if LAW_ANISOTROPY not in switches.laws:
        return None
    axis = np.array(friction.axis)
    axis = axis / np.linalg.norm(axis) if axis.ndim == 1 else np.zeros(3)
    return Grain(axis, axis_table(scene, friction.body_axes))


class ManyBodies(Scheme):
    """Scheme for bodies that touch each other or fixed ones; also for hulls, capsules and others at walls.

    Bodies at walls that are tied by springs are stepped here, too.

    Parameters
    ----------
    is_error_controlled : bool
        Whether substeps are cut into parts whose errors meet the tolerance.
    """

    name = "bodies that touch"
    kernel = staticmethod(step_many)
    couples_bodies = True

    def __init__(self, is_error_controlled: bool):
        self.is_error_controlled, self.memory = is_error_controlled, BodyMemory(is_error_controlled)

    def takes(self, needs: Needs, accuracy: Accuracy) -> bool:
        is_precise = INTEGRATORS[accuracy.scheme] == EVENTS
        is_coupled = needs.meeting or needs.linked or needs.hulls or needs.capsules or needs.grouped
        is_coupled = is_coupled or needs.compounds or needs.cylinders
        is_coupled = is_coupled or needs.grained or (is_precise and bool(_OF_STAGES & set(needs.laws)))
        return ((needs.touching and is_coupled) or needs.fixed) and is_precise == self.is_error_controlled

    def objection(self, scene: Scene, needs: Needs, accuracy: Accuracy) -> str:
        return objections.to_tangential(scene, needs) or objections.to_axes_of_walls(scene, needs)

    def make_scratch(self, scene: Scene, switches: Switches, walls: np.ndarray, accuracy: Accuracy) -> Any:
        bodies, accuracy = len(scene.bodies), self.acting(accuracy)
        if self.is_error_controlled and switches.lone:
            accuracy = replace(accuracy, slop=max(accuracy.slop, LONE_RELATIVE_SLOP))
        fixed = np.array([body.fixed for body in scene.bodies], np.int64) if switches.fixed else None
        return allocation.make_bodies_workspace(
            bodies, walls if switches.contact else walls[:0], switches.terms, polyhedra(scene.bodies), fixed,
            groups=group_table(scene) if switches.grouped else None,
            capsules=switches.capsules, cylinders=switches.cylinders,
            parts=part_list(scene.bodies) if switches.compounds else (),
            materials=(wall_materials(scene, switches, True), pair_materials(scene, switches)),
            motion_columns=switches.motion_columns, laws=switches.laws, grain=_grain(scene, switches),
            lone=switches.lone, slip_ends=self._ends_stages_with_slips(switches),
            foretold=self._foretells_twists(switches),
            even=self.is_error_controlled and LAW_STIFFNESS not in switches.laws,
            meet=_meetings(scene, switches),
            is_sequential=accuracy.collisions == "sequential", is_error_controlled=self.is_error_controlled,
            **settings(accuracy, impacts_of=bodies),
        )  # fmt: skip

    def _ends_stages_with_slips(self, switches: Switches) -> bool:
        """Answer whether stages end with slips: on driven bodies, and under error control of several moving bodies."""
        is_controlled = self.is_error_controlled and switches.friction and not switches.lone
        return switches.motion_columns > 0 or bool(is_controlled)

    def _foretells_twists(self, switches: Switches) -> bool:
        """Answer whether stages foretell twists: under error control of several moving bodies with rigid contact."""
        return self.is_error_controlled and not switches.lone and LAW_STIFFNESS not in switches.laws

    def make_motion(self, scene: Scene, switches: Switches, accuracy: Accuracy) -> Any:
        """Make the memory in which error control keeps states of a world while it tries parts; None without it."""
        if not self.is_error_controlled:
            return None
        bodies, parts, walls = len(scene.bodies), part_count(scene.bodies), len(scene.walls)
        memory = allocation.warm_start_size(
            parts, walls, polyhedra(scene.bodies), laws=switches.laws, cylinders=switches.cylinders
        )
        return allocation.make_snapshots(bodies, memory, switches.lone)

    def acting(self, accuracy: Accuracy) -> Accuracy:
        """Accuracy with which the scheme steps: error control raises tolerance and slop to its least values.

        Below these rounding errors would decide whether a part is accepted.
        """
        if not self.is_error_controlled:
            return accuracy
        tolerance, slop = max(accuracy.tolerance, MIN_SOLVER_TOLERANCE), max(accuracy.slop, MIN_RELATIVE_SLOP)
        return replace(accuracy, tolerance=tolerance, slop=slop)

    def arguments(self, worlds: Worlds, k: int) -> tuple:
        plan = worlds.plan
        switches = MultibodySwitches(plan.friction, plan.of_flight, plan.ellipsoids, plan.hulls)
        ours = plan.restitution, worlds.motions[k], worlds.sleep_of_kernel()
        return switches, *ours, records(worlds), worlds.scratch[k]


SCHEMES = (ManyBodies(False), ManyBodies(True))
