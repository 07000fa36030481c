"""Rollback of a step that ended in an exception of a user's field."""

from __future__ import annotations

from physics.undo import Undo
from physics.world.batch import Batch


def remember(world: Batch) -> Undo:
    """Copy the state of a batch before a step that may raise an exception; return a function that restores it.

    An exception stops the kernel after it has advanced some worlds of the batch, and not the others. `Plan.may_raise`
    tells whether a step may raise one.
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
