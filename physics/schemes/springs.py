"""Schemes for bodies that springs tie together and that touch nothing: by extrapolation, or by time stepping."""

from __future__ import annotations

from typing import Any

import numpy as np

from physics.accuracy import EVENTS, INTEGRATORS, Accuracy
from physics.kernels.time_stepping.spring_coupled_step import make_linked_world, step_linked
from physics.scene.needs import Needs
from physics.scene.scene import Scene
from physics.schemes.scheme import Scheme, Switches, Worlds, records
from physics.schemes.wall_memory import WallMemory


class LinkedBodies(Scheme):
    """Scheme for bodies that springs tie together and that touch nothing; all bodies of a world are stepped together.

    Parameters
    ----------
    is_error_controlled : bool
        True: steps are extrapolated to a tolerance. False: time stepping.
    """

    name = "springs between bodies"
    kernel = staticmethod(step_linked)
    memory = WallMemory()

    def __init__(self, is_error_controlled: bool):
        self.is_error_controlled = self.logs_all_events = is_error_controlled

    def takes(self, needs: Needs, accuracy: Accuracy) -> bool:
        is_precise = INTEGRATORS[accuracy.scheme] == EVENTS
        return needs.linked and not needs.touching and is_precise == self.is_error_controlled

    def make_scratch(self, scene: Scene, switches: Switches, walls: np.ndarray, accuracy: Accuracy) -> Any:
        return make_linked_world(
            len(scene.bodies), switches.terms, relative_slop=accuracy.slop, tolerance=accuracy.tolerance,
            splits=accuracy.impacts,
        )  # fmt: skip

    def arguments(self, worlds: Worlds, k: int) -> tuple:
        held, extrapolates = (None, True) if self.is_error_controlled else (True, None)
        return worlds.plan.of_flight, held, extrapolates, records(worlds), worlds.scratch[k]


SCHEMES = (LinkedBodies(False), LinkedBodies(True))
