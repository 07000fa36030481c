"""Calls of kernels that Python makes, one after another."""

from __future__ import annotations

from collections.abc import Callable

from physics.kernels.compile.decorators import backend


def loop_kernel(function: Callable) -> Callable:
    """Leave a loop that makes calls to Python."""
    return function


def perform_all(work: DirectWork, count: int) -> bool:
    """Make all calls, whatever their `count`; False, or the exception that one raised."""
    return work.perform()


class DirectWork:
    """Calls of kernels with all their arguments.

    Parameters
    ----------
    calls : list of (callable, tuple)
        A kernel's machine code (`entry`) and its arguments. Arrays are bound, not copied: what they hold when a call is
        made counts.

    Attributes
    ----------
    handed : tuple
        Arguments of `perform_all` for these calls.
    """

    def __init__(self, calls: list[tuple[Callable, tuple]]):
        self._calls = [(code, list(arguments)) for code, arguments in calls]

    @property
    def handed(self) -> tuple[DirectWork, int]:
        return self, len(self._calls)

    def perform(self) -> bool:
        """Make the calls; one that raises an exception ends them with it. Returns False."""
        for code, arguments in self._calls:
            code(*arguments)
        return False

    __call__ = perform

    def raise_again(self) -> None:
        """Raise nothing: `perform` has."""

    def forget(self) -> None:
        """Forget nothing."""

    def put(self, argument: int, value: float | tuple) -> None:
        """Give the first of the calls another value for an argument."""
        self._calls[0][1][argument] = value

    def then(self, other: DirectWork) -> DirectWork:
        """These calls, and the other ones after them."""
        return DirectWork([*self._calls, *other._calls])


def entry(kernel: Callable, arguments: tuple) -> Callable:
    """Machine code of a kernel for arguments of these types, compiled where it is not yet; a `loop_kernel` as it is."""
    return backend.machine_code(kernel, arguments) if backend.is_kernel(kernel) else kernel
