"""Undo a step that ends in an exception of a user's field."""

from __future__ import annotations

from physics.undo import Undo
from physics.world.batch import Batch


def remember(world: Batch) -> Undo:
    """Copy all that decides how a world goes on, before a step that may end in an exception (`Plan.may_raise`).

    By then the kernel has advanced some worlds of the batch, and not the others.
    """
    time, arrays = world.time, [array.copy() for array in world.kept()]
    actuation = None if world.actuation is None else world.actuation.kept()

    def undo() -> None:
        for array, before in zip(world.kept(), arrays, strict=True):
            array[...] = before
        world.time = time
        world.forget_impacts()
        if world.actuation is not None:
            world.actuation.reinstate(actuation)
        if world.recorder is not None:
            world.recorder.undone()

    return undo
