"""All or nothing: a block that ends with an exception has changed nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

Undo = Callable[[], None]
"""Function that puts something back as it was when the function was made."""


@contextmanager
def undo_on_error(*undo: Undo | None) -> Iterator[None]:
    """Put everything back where a block raises an exception, an interrupt among them.

    Parameters
    ----------
    *undo : Undo or None
        Called in this order. None: nothing is to be put back.
    """
    try:
        yield
    except BaseException:
        for put_back in undo:
            if put_back is not None:
                put_back()
        raise
