"""Offline files in notebooks: the page of `export` inside an output cell, without a server."""

from __future__ import annotations

import html
import sys

HEIGHT = 480
"""[px]. Of the frame in the notebook."""


def in_notebook() -> bool:
    """True in a notebook, local or hosted: where outputs are pages, not text."""
    get_ipython = getattr(sys.modules.get("IPython"), "get_ipython", None)
    shell = get_ipython() if get_ipython is not None else None
    return shell is not None and hasattr(shell, "kernel")


def frame_of_page(page: str, height: int = HEIGHT) -> str:
    """HTML of a frame that holds a whole page: nothing is loaded from elsewhere.

    Parameters
    ----------
    page : str
        Text of a self-contained HTML page, such as `export.page_of` makes.
    height : int
        [px].

    Raises
    ------
    ValueError
        If the height is not positive.
    """
    if isinstance(height, bool) or not isinstance(height, int) or height < 1:
        raise ValueError(f"height is {height!r}; allowed are integers of at least 1")
    return (
        f'<iframe srcdoc="{html.escape(page, quote=True)}" width="100%" height="{height}" '
        'style="border:none;display:block"></iframe>'
    )


class Embedded:
    """Page that a notebook shows as the value of a cell."""

    def __init__(self, page: str, height: int = HEIGHT):
        self._frame = frame_of_page(page, height)

    def _repr_html_(self) -> str:
        return self._frame

    def __repr__(self) -> str:
        return f"<page of {len(self._frame) / 1e6:.1f} MB; a notebook shows it>"


def embed(page: str, height: int = HEIGHT) -> None:
    """Show a page in the output of the running cell.

    Raises
    ------
    ValueError
        If the height is not positive.
    RuntimeError
        Outside of a notebook.
    """
    shown = Embedded(page, height)
    if not in_notebook():
        raise RuntimeError("there is no notebook here; write the page with rigid_env.to_html")
    from IPython.display import display

    display(shown)
