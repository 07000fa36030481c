"""Locks that let one thread at a time use a world or an environment.

A world lends its arrays to machine code, which runs without the interpreter's lock: two steps at once would write to
the same memory. A thread that comes while another one is at it gets an error.

The flag `is_free` is tested and set in two bytecodes between which CPython (3.10 to 3.13) never switches threads: the
branch that is not taken has neither a call nor a jump. It is written out where it is used, since a signal that arrives
while a function of ours is called or has returned would leave it set. A lock of `threading` takes a tenth of a step.
"""

from __future__ import annotations

import os
import threading
import weakref
from functools import wraps
from typing import Any, cast

from physics.annotations import Function


def exclusive(method: Function) -> Function:
    """Make a method or function that raises an error while another thread uses the same object.

    Parameters
    ----------
    method : Callable
        Its first argument has an attribute `is_free`, True at first, and may have `telling` (`World`).

    Returns
    -------
    Callable
        Raises RuntimeError, with nothing changed.
    """

    @wraps(method)
    def call(self, *arguments, **named):
        if self.is_free:
            self.is_free = False
        elif getattr(self, "telling", None) == threading.get_ident():  # a recorder of this world, from within its step
            return method(self, *arguments, **named)
        else:
            raise in_use(self)
        try:
            return method(self, *arguments, **named)
        finally:
            self.is_free = True

    return cast("Function", call)


def in_use(thing: Any) -> RuntimeError:
    """Error for a call while another thread uses the object."""
    name = type(thing).__name__
    if getattr(thing, "is_torn", False):
        return RuntimeError(
            f"{name} was being stepped by another thread when this process was forked, and holds half a step; allowed "
            "is to restore a snapshot first, or a world of this process's own"
        )
    return RuntimeError(
        f"{name} is being used by another thread; allowed is one thread at a time: give each thread a {name} of its "
        "own, or hold a lock around every call"
    )


_WORLDS: weakref.WeakSet = weakref.WeakSet()


def watch(world: Any) -> None:
    """Register a world, to unlock it after a fork of the process."""
    _WORLDS.add(world)


def _after_fork() -> None:
    """Unlock all worlds in a child process: the parent's threads inside a step do not exist there."""
    for world in list(_WORLDS):
        world.is_torn = not world.is_free and world.telling != threading.get_ident()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)
