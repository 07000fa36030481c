"""Time stepping of bodies at walls that do not touch each other, so that each body is stepped alone."""

from __future__ import annotations

from typing import Any

import numpy as np

from physics.accuracy import EVENTS, INTEGRATORS, Accuracy
from physics.kernels.time_stepping.step import step_worlds
from physics.kernels.time_stepping.workspace import make_workspace
from physics.scene.needs import Needs
from physics.scene.scene import Scene
from physics.schemes import objections
from physics.schemes.material_tables import wall_materials
from physics.schemes.scheme import Scheme, Switches, Worlds, records, settings
from physics.schemes.wall_memory import WallMemory


class BodiesAtWalls(Scheme):
    """Time-stepping scheme for bodies at walls, each stepped alone, with Moreau's midpoint step in contact."""

    name = "bodies at walls"
    kernel = staticmethod(step_worlds)
    memory = WallMemory()

    def takes(self, needs: Needs, accuracy: Accuracy) -> bool:
        return INTEGRATORS[accuracy.scheme] != EVENTS

    def objection(self, scene: Scene, needs: Needs, accuracy: Accuracy) -> str:
        return objections.to_turns(needs, accuracy) or objections.to_tangential(scene, needs)

    def make_scratch(self, scene: Scene, switches: Switches, walls: np.ndarray, accuracy: Accuracy) -> Any:
        materials = wall_materials(scene, switches)
        return make_workspace(walls, switches.features, switches.terms, switches.laws, materials, **settings(accuracy))

    def arguments(self, worlds: Worlds, k: int) -> tuple:
        plan = worlds.plan
        switches = plan.of_contact, plan.restitution, plan.of_flight
        return *switches, worlds.sleep_of_kernel(), records(worlds), worlds.scratch[k]


SCHEMES = (BodiesAtWalls(),)
