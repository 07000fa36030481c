"""A step that ends in an exception of a user's field has changed nothing."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from physics.field_errors import raised

if TYPE_CHECKING:
    from physics.world import World


@contextmanager
def all_or_nothing(world: World) -> Iterator[None]:
    """Put a world back as it was when an exception leaves the block; that of an index then names the field's class.

    The kernel has advanced some worlds of the batch by then, and not the others. It costs a copy of all that decides
    how the world goes on; it is for plans of which a step may raise an exception (`Plan.may_raise`).
    """
    kept, time = [array.copy() for array in world.kept()], world.time
    actuation = None if world.actuation is None else world.actuation.kept()
    try:
        yield
    except Exception as error:
        for array, before in zip(world.kept(), kept, strict=True):
            array[...] = before
        world.time = time
        if world.actuation is not None:
            world.actuation.put_back(actuation)
        if world.recorder is not None:
            world.recorder.undone()
        told = raised(error, world.plan.fields)
        if told is error:
            raise
        raise told from error
