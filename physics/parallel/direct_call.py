"""Bound calls of kernels that Python makes, for compilers without prepared calls."""

from __future__ import annotations

from collections.abc import Callable

from physics.compiler.decorators import backend


def loop_kernel(function: Callable) -> Callable:
    """Decorator of a loop that makes bound calls: here the loop stays a Python function."""
    return function


def perform_all(call: DirectCall, count: int) -> bool:
    """Make all calls of `call`; `count` is not used. Return False; an exception of a call is passed on."""
    return call.perform()


class DirectCall:
    """Calls of kernels with bound arguments, made one after another from Python.

    Parameters
    ----------
    calls : list of (callable, tuple)
        Machine code of a kernel (`entry`), and its arguments. Arrays are not copied: each call reads their contents at
        that time.

    Attributes
    ----------
    handed : tuple
        Arguments of `perform_all` for these calls.
    """

    def __init__(self, calls: list[tuple[Callable, tuple]]):
        self._calls = [(code, list(arguments)) for code, arguments in calls]

    @property
    def handed(self) -> tuple[DirectCall, int]:
        return self, len(self._calls)

    def perform(self) -> bool:
        """Make the calls; return False. The first exception ends them and is passed on."""
        for code, arguments in self._calls:
            code(*arguments)
        return False

    __call__ = perform

    def raise_again(self) -> None:
        """Do nothing, since `perform` passes exceptions on."""

    def forget(self) -> None:
        """Do nothing, since exceptions are not kept."""

    def put(self, argument: int, value: float | tuple) -> None:
        """Replace argument number `argument` of the first call by `value`."""
        self._calls[0][1][argument] = value

    def then(self, other: DirectCall) -> DirectCall:
        """Join these calls with those of `other`, which are made after them."""
        return DirectCall([*self._calls, *other._calls])


def entry(kernel: Callable, arguments: tuple) -> Callable:
    """Compile a kernel for arguments of these types; return its machine code. A `loop_kernel` is returned unchanged."""
    return backend.machine_code(kernel, arguments) if backend.is_kernel(kernel) else kernel
