"""Undo of the changes that a ``with`` block made before it raised an exception."""

from __future__ import annotations

from collections.abc import Callable

Undo = Callable[[], None]
"""Function that restores an object to its state of the moment at which the function was made."""


class undo_on_error:
    """Context manager that undoes changes where its block raises an exception, `KeyboardInterrupt` included.

    It is a class, since a generator would take four times as long, and every control step of a batch enters it.

    Parameters
    ----------
    *undo : Undo or None
        Functions to call, in this order, after an exception. None is skipped.
    """

    __slots__ = ("_undo",)

    def __init__(self, *undo: Undo | None):
        self._undo = undo

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: type[BaseException] | None, *_) -> None:
        if kind is not None:
            for undo in self._undo:
                if undo is not None:
                    undo()
