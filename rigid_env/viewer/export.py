"""One page for a motion, with a time line, that plays offline: a file, or a frame in a notebook.

viser's own client is in the page, with the messages it would have got from a server and their times. Its player has
play and pause (also the space bar), a time line, the speed and a tree of the scene, in which layers can be hidden.
"""

from __future__ import annotations

import html
import os
import sys
from collections.abc import Iterable, Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np

from physics import Scene, validation
from rigid_env.extras import require
from rigid_env.viewer.interface import Look
from rigid_env.viewer.servers import server_for_a_while
from rigid_env.viewer.stage import LAYERS, Stage

TITLE = "<title>Viser</title>"

TIME_SLACK = 1e-9
"""Share of the time between pictures by which a look may come too early."""

HEIGHT = 480
"""[px]. Of the frame in the notebook."""


def page_of(
    looks: Iterable[Look],
    *,
    scene: Scene | None = None,
    duration: float = 10.0,
    fps: float = 30.0,
    layers: Iterable[str] | None = None,
    title: str = "rigid-env",
) -> str:
    """Make a motion an HTML page that plays in a browser without a network.

    Poses are float32, as everywhere in viser; nothing is interpolated. The page has viser's client (about 0.8 MB) and,
    for each picture, 28 bytes for each body that moves, before compression.

    Parameters
    ----------
    looks : iterable of Look
        In order of time. The first one is shown at time 0.
    scene : Scene, optional
        Its fields are drawn.
    duration : float
        Looks later than this after the first are left out [s].
    fps : float
        Pictures a second at most: looks that are nearer to the last one taken are left out [1/s].
    layers : iterable of str, optional
        Names of the layers that are shown, of `stage.LAYERS`. None: those that are shown at first.
    title : str
        Of the page.

    Returns
    -------
    str

    Raises
    ------
    ValueError
        No looks, times that go back, an unknown layer, or a number that is not positive.
    gymnasium.error.DependencyNotInstalled
        If viser is missing.
    """
    require("view", purpose="an HTML file")
    duration = float(validation.positive(duration, (), "duration"))
    fps = float(validation.positive(fps, (), "fps"))
    shown = [name for name, is_on in LAYERS.items() if is_on] if layers is None else list(layers)
    for name in shown:
        validation.one_of(name, LAYERS, "layers")
    chosen = list(taken(looks, duration, 1.0 / fps))
    if not chosen:
        raise ValueError("there are no looks; allowed is at least one")
    page = _record(chosen, scene, shown)
    return page.replace(TITLE, f"<title>{_escaped(title)}</title>", 1)


def write_page(page: str, path: str | Path) -> Path:
    """Write a page as a file, whole or not at all; returns the path."""
    path = Path(path)
    partial = path.with_name(f".{path.name}.part")
    try:
        partial.write_text(page, encoding="utf-8")
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)
    return path


def taken(looks: Iterable[Look], duration: float, interval: float) -> Iterator[Look]:
    """Looks up to `duration` [s] after the first that are at least `interval` [s] apart.

    Raises
    ------
    ValueError
        If times go back.
    """
    start = before = due = None
    for look in looks:
        if start is None:
            start = before = due = look.time
        if look.time < before:
            raise ValueError(f"looks have one at {look.time:g} s after one at {before:g} s; allowed are rising times")
        before = look.time
        slack = TIME_SLACK * interval + 1e-12 * abs(look.time)
        if look.time > start + duration + slack:
            return
        if look.time >= due - slack:
            yield look
            due = max(due + interval, look.time + 0.5 * interval)


def _record(looks: list[Look], scene: Scene | None, shown: list[str]) -> str:
    """Show looks on a stage that nobody sees, and keep its messages."""
    with server_for_a_while() as server:
        stage = Stage(server, fields=scene, bounds=_bounds(looks))
        for name in LAYERS:
            stage.set_layer(name, name in shown)
        stage.show(looks[0])
        recording = server.get_scene_serializer()
        for before, look in pairwise(looks):
            recording.insert_sleep(look.time - before.time)
            stage.show(look)
        return recording.as_html()


def _bounds(looks: list[Look]):
    """Lower and upper corner (3,) [m] of all places where bodies are."""
    boxes = []
    for look in looks:
        pos, radius = look.frame.poses.pos, np.asarray(look.radius)[:, None]
        if len(pos):
            boxes.append(((pos - radius).min(axis=0), (pos + radius).max(axis=0)))
    if not boxes:
        return None
    lower, upper = zip(*boxes)
    return np.min(lower, axis=0), np.max(upper, axis=0)


def _escaped(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;")


# --- notebooks -----------------------------------------------------------------------------------------------------


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
        Text of a self-contained HTML page, such as `page_of` makes.
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
