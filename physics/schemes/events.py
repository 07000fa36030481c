"""Event-driven scheme for bodies at walls: smooth motion from one event (impact or change of a contact) to the next."""

from __future__ import annotations

from typing import Any

import numpy as np

from physics.accuracy import EVENTS, INTEGRATORS, Accuracy
from physics.kernels.event_driven.step import step_events
from physics.kernels.event_driven.workspace import Workspaces, make_motion
from physics.kernels.time_stepping.workspace import make_workspace
from physics.scene.needs import Needs
from physics.scene.scene import Scene
from physics.schemes import objections
from physics.schemes.material_tables import wall_materials
from physics.schemes.scheme import Scheme, Switches, Worlds, records, settings
from physics.schemes.wall_memory import WallMemory


class EventDriven(Scheme):
    """Event-driven scheme: smooth motion is integrated to a tolerance, and every event is located in time."""

    name = "event-driven"
    kernel = staticmethod(step_events)
    memory = WallMemory(holds_forces=True)
    is_event_driven = True
    logs_all_events = True

    def takes(self, needs: Needs, accuracy: Accuracy) -> bool:
        return INTEGRATORS[accuracy.scheme] == EVENTS

    def objection(self, scene: Scene, needs: Needs, accuracy: Accuracy) -> str:
        return objections.to_tangential(scene, needs)

    def make_scratch(self, scene: Scene, switches: Switches, walls: np.ndarray, accuracy: Accuracy) -> Any:
        materials = wall_materials(scene, switches)
        return make_workspace(walls, switches.features, switches.terms, switches.laws, materials, **settings(accuracy))

    def make_motion(self, scene: Scene, switches: Switches, accuracy: Accuracy) -> Any:
        return make_motion(len(scene.walls), switches.features, accuracy.collisions == "sequential")

    def arguments(self, worlds: Worlds, k: int) -> tuple:
        plan = worlds.plan
        switches = plan.of_contact, plan.restitution, plan.of_flight
        workspaces = Workspaces(worlds.scratch[k], worlds.motions[k])
        return *switches, worlds.sleep_of_kernel(), records(worlds), workspaces


SCHEMES = (EventDriven(),)
