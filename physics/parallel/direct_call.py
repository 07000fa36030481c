"""Calls of kernels from Python, one after another."""

from __future__ import annotations

from collections.abc import Callable

from physics.compiler.decorators import backend


def loop_kernel(function: Callable) -> Callable:
    """Leave a loop that makes calls to Python."""
    return function


def perform_all(call: DirectCall, count: int) -> bool:
    """Make all calls, whatever their `count`; False, or the exception that one raised."""
    return call.perform()


class DirectCall:
    """Calls of kernels with all their arguments.

    Parameters
    ----------
    calls : list of (callable, tuple)
        A kernel's machine code (`entry`) and its arguments. Arrays are bound, not copied: a call reads
        their contents at its time.

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
        """Make the calls until one raises an exception, which leaves this function, too. Returns False."""
        for code, arguments in self._calls:
            code(*arguments)
        return False

    __call__ = perform

    def raise_again(self) -> None:
        """Do nothing: `perform` has raised the exception."""

    def forget(self) -> None:
        """Do nothing: no exception is kept."""

    def put(self, argument: int, value: float | tuple) -> None:
        """Replace an argument of the first call."""
        self._calls[0][1][argument] = value

    def then(self, other: DirectCall) -> DirectCall:
        """Join these calls with others after them."""
        return DirectCall([*self._calls, *other._calls])


def entry(kernel: Callable, arguments: tuple) -> Callable:
    """Machine code of a kernel for arguments of these types, compiled where it is not yet; a `loop_kernel` as it is."""
    return backend.machine_code(kernel, arguments) if backend.is_kernel(kernel) else kernel
