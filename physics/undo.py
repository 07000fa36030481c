"""All or nothing: a block that ends with an exception has changed nothing."""

from __future__ import annotations

from collections.abc import Callable

Undo = Callable[[], None]
"""Function that puts something back as it was when the function was made."""


class undo_on_error:
    """Put everything back where a block raises an exception, an interrupt among them.

    A class and no generator, which would take four times as long: a control step of a batch goes through it.

    Parameters
    ----------
    *undo : Undo or None
        Called in this order. None: nothing is to be put back.
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
