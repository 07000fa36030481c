"""Undo a step that ends in an exception of a user's field."""

from __future__ import annotations

from typing import NoReturn

from physics.scene.field_errors import raised
from physics.world.batch import Batch


class Before:
    """All that decides how a world goes on, copied before a step that may end in an exception (`Plan.may_raise`).

    By then the kernel has advanced some worlds of the batch, and not the others.

    Parameters
    ----------
    world : Batch
    """

    def __init__(self, world: Batch):
        self._world, self._time = world, world.time
        self._kept = [array.copy() for array in world.kept()]
        self._actuation = None if world.actuation is None else world.actuation.kept()

    def put_back(self, error: Exception) -> NoReturn:
        """Put the world back as it was and raise the exception; that of an index then names the field's class."""
        world = self._world
        for array, before in zip(world.kept(), self._kept, strict=True):
            array[...] = before
        world.time = self._time
        if world.actuation is not None:
            world.actuation.put_back(self._actuation)
        if world.recorder is not None:
            world.recorder.undone()
        raise raised(error, world.plan.fields)
