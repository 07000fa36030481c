"""Make a motion one HTML page that plays offline, as a file or as a frame in a notebook.

The page contains viser's own client, and the messages that a server would have sent to it, with their times. Its player
has play and pause (also the space bar), a time line, the speed, and a tree of the scene in which layers can be hidden.
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
"""Share of the time between two pictures by which a look may come too early and still be used."""

HEIGHT = 480
"""[px] Height of the frame in a notebook."""


def page_of(
    looks: Iterable[Look],
    *,
    scene: Scene | None = None,
    duration: float = 10.0,
    fps: float = 30.0,
    layers: Iterable[str] | None = None,
    title: str = "rigid-env",
) -> str:
    """Make an HTML page of a motion, which plays in a browser without a network.

    Poses are float32, as everywhere in viser, and are not interpolated. The page has viser's client (about 0.8 MB), and
    for each picture 28 bytes per moving body, before compression.

    Parameters
    ----------
    looks : iterable of Look
        Moments of the motion, in order of time. The first one is shown at time 0.
    scene : Scene, optional
        Scene whose wind, fluids and springs are drawn.
    duration : float
        Looks that are later than this after the first are left out [s].
    fps : float
        Most pictures per second [1/s]; looks that come too soon after the last picture are left out.
    layers : iterable of str, optional
        Names of the layers that are shown, of `stage.LAYERS`. None: those that are on by default.
    title : str
        Title of the page.

    Returns
    -------
    str
        Text of the page.

    Raises
    ------
    ValueError
        No looks, times that decrease, an unknown layer, or a number that is not positive.
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
    """Write the text of a page to a file, which is complete or not there at all; returns the path."""
    path = Path(path)
    partial = path.with_name(f".{path.name}.part")
    try:
        partial.write_text(page, encoding="utf-8")
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)
    return path


def taken(looks: Iterable[Look], duration: float, interval: float) -> Iterator[Look]:
    """Choose looks that are at least `interval` [s] apart, up to `duration` [s] after the first.

    Raises
    ------
    ValueError
        If times decrease.
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
    """Show looks on a stage without a browser, and return the recorded messages as an HTML page.

    `scene` has the fields that are drawn; `shown` has the names of the layers that are on.
    """
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
    """Lower and upper corner (3,) [m] of the box that holds all bodies in all looks; None if there are no bodies."""
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
    """True if the program runs in a notebook, local or hosted, whose outputs can be HTML."""
    get_ipython = getattr(sys.modules.get("IPython"), "get_ipython", None)
    shell = get_ipython() if get_ipython is not None else None
    return shell is not None and hasattr(shell, "kernel")


def frame_of_page(page: str, height: int = HEIGHT) -> str:
    """HTML of a frame that contains a whole page, so that nothing is loaded from elsewhere.

    Parameters
    ----------
    page : str
        Text of a self-contained HTML page, such as `page_of` makes.
    height : int
        Height of the frame [px].

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
    """Value of a notebook's cell that the notebook shows as a page, in a frame `height` pixels high."""

    def __init__(self, page: str, height: int = HEIGHT):
        self._frame = frame_of_page(page, height)

    def _repr_html_(self) -> str:
        return self._frame

    def __repr__(self) -> str:
        return f"<page of {len(self._frame) / 1e6:.1f} MB; a notebook shows it>"


def embed(page: str, height: int = HEIGHT) -> None:
    """Show a page in the output of the running cell, in a frame `height` pixels high.

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
