"""Locks that let one thread at a time use a world or an environment.

A world lends its arrays to machine code, which runs without the interpreter's lock: two steps at once would write to
the same memory. A thread that comes while another one is at it gets an error.

Both are `Exclusive`. A method that `exclusive` decorates begins and ends with the lines that are written there. Where
the call of a decorator is too slow they stand in the method: `Stepper.__call__`, `World.step`, `RigidEnv.step`.
"""

from __future__ import annotations

import os
import sys
import threading
import weakref
from functools import wraps
from typing import TYPE_CHECKING, Any, cast

from physics.annotations import Function


class _Flag:
    """Thing for one thread at a time, where the interpreter has a lock.

    CPython (3.10 to 3.13) never switches threads between the two bytecodes that test and set `is_free`, nor does it
    handle a signal there: the branch that is not taken has neither a call nor a jump. A lock of `threading` takes a
    tenth of a step.
    """

    is_free = True

    @property
    def is_in_use(self) -> bool:
        """True while a thread is at it."""
        return not self.is_free


class _Entry:
    """Thing for one thread at a time, where the interpreter has no lock: who asks `is_free`, and is told so, has it.

    `dict.setdefault` is one operation, of which one thread is the first.
    """

    @property
    def is_free(self) -> bool:
        """True for the one thread that has the thing from now on, until it sets this to True again."""
        mine = object()
        return vars(self).setdefault("_user", mine) is mine

    @is_free.setter
    def is_free(self, value: bool) -> None:
        if value:
            vars(self).pop("_user", None)

    @property
    def is_in_use(self) -> bool:
        """True while a thread is at it."""
        return "_user" in vars(self)


HAS_LOCK = getattr(sys, "_is_gil_enabled", lambda: True)()
if TYPE_CHECKING or HAS_LOCK:
    Exclusive = _Flag
else:
    Exclusive = _Entry


def exclusive(method: Function) -> Function:
    """Make a method or function that raises an error while another thread uses the same object.

    Parameters
    ----------
    method : Callable
        Its first argument is `Exclusive`, and may have `telling` (`World`).

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
        world.is_torn = world.is_in_use and world.telling != threading.get_ident()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)
