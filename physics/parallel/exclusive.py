"""Locks that let one thread at a time use a world or an environment.

Machine code uses the arrays of a world without the interpreter's lock, so two steps at once would write to the same
memory. A thread that uses a world while another thread does gets an error.

Worlds and environments are subclasses of `Exclusive`. Their methods are decorated with `exclusive`. Where the cost of a
decorator matters, a method contains its lines instead: `Stepper.__call__`, `World.step`, `RigidEnv.step`.
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
    """Base of objects for one thread at a time, for interpreters with a global lock.

    A thread may use the object if it finds `is_free` True, and sets it to False; afterwards it sets it to True. CPython
    (3.10 to 3.13) neither switches threads nor handles a signal between the bytecodes that test and set `is_free`,
    since there is no call or jump between them. A lock of `threading` would take a tenth of a step.
    """

    is_free = True

    @property
    def is_in_use(self) -> bool:
        """True while a thread uses the object."""
        return not self.is_free


class _Entry:
    """Base of objects for one thread at a time, for interpreters without a global lock.

    A thread that reads `is_free` and gets True has thereby taken the object, until it sets `is_free` to True. Taking is
    one atomic operation, `dict.setdefault`, in which only one thread is the first.
    """

    @property
    def is_free(self) -> bool:
        """Take the object: True if no other thread has it; this thread then has it until it sets `is_free` to True."""
        mine = object()
        return vars(self).setdefault("_user", mine) is mine

    @is_free.setter
    def is_free(self, value: bool) -> None:
        if value:
            vars(self).pop("_user", None)

    @property
    def is_in_use(self) -> bool:
        """True while a thread uses the object."""
        return "_user" in vars(self)


HAS_LOCK = getattr(sys, "_is_gil_enabled", lambda: True)()
if TYPE_CHECKING or HAS_LOCK:
    Exclusive = _Flag
else:
    Exclusive = _Entry


def exclusive(method: Function) -> Function:
    """Decorate a method or function: it raises an error while another thread uses the same object.

    Parameters
    ----------
    method : Callable
        Method or function whose first argument is an `Exclusive`. If that has an attribute `telling`, the thread with
        this identifier may call the method although the object is in use (see `World`).

    Returns
    -------
    Callable
        Function that raises a RuntimeError if another thread uses the object, and otherwise calls `method`.
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
    """Make the error for a call while another thread uses the object `thing`."""
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
    """Register a world, so that a fork of the process can mark it as torn, in the middle of another thread's step."""
    _WORLDS.add(world)


def _after_fork() -> None:
    """Mark worlds in a forked child process as torn if another thread was using them.

    That thread does not exist in the child and cannot finish its step.
    """
    for world in list(_WORLDS):
        world.is_torn = world.is_in_use and world.telling != threading.get_ident()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)
