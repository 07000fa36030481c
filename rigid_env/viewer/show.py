"""Show anything that the viewer can play: in a notebook as a page within it, elsewhere in a browser."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from physics import validation
from rigid_env.viewer.interface import Look
from rigid_env.viewer.session import Session
from rigid_env.viewer.subject import open_subject

DURATION, FRAMES = 10.0, 30.0
"""Duration of an exported run [s], and its pictures per second [1/s]."""


def looks(session: Session, duration: float) -> Iterator[Look]:
    """Play a session from now on, and yield a `Look` after each step, up to `duration` [s] later or to its end."""
    session.wait()
    start = session.time
    yield session.look()
    while session.time < start + duration and session.step():
        yield session.look()


def to_html(x: Any, path: str | Path, *, duration: float = DURATION, fps: float = FRAMES, **settings: Any) -> Path:
    """Play something, and write it as one HTML file with a time line, which opens without a network.

    Parameters
    ----------
    x : object
        A `physics.Scene`, `World`, `Trajectory` or `Recording`, an environment, the name of a canonical scene, an
        environment's id, or the path of a file; see `rigid_env.viewer.subject.open_subject`.
    path : str or Path
        Path of the HTML file.
    duration : float
        Longest simulated time [s].
    fps : float
        Most pictures per second [1/s].
    **settings
        ``accuracy``, ``dt``, ``seed``, ``policy``, ``controller`` of `open_subject`; ``layers`` and ``title`` of
        `rigid_env.viewer.export.page_of`.

    Returns
    -------
    Path
        Path of the file.

    Raises
    ------
    ValueError
        Something that cannot be played, or an argument out of range.
    gymnasium.error.DependencyNotInstalled
        If viser is missing.
    """
    from rigid_env.viewer import export

    validation.path(path)
    duration = float(validation.positive(duration, (), "duration"))
    of_page = {name: settings.pop(name) for name in ("layers", "title") if name in settings}
    page = _page(Session(open_subject(x, **settings)), duration, fps=fps, **of_page)
    return export.write_page(page, path)


def _page(session: Session, duration: float, **of_page: Any) -> str:
    """HTML page of a session from now on, up to `duration` [s]; `of_page` are arguments of `export.page_of`."""
    from rigid_env.viewer import export

    subject = session.subject
    of_page.setdefault("title", subject.name)
    return export.page_of(looks(session, duration), scene=subject.scene, duration=duration, **of_page)


def show(
    x: Any, *, host: str = "127.0.0.1", port: int = 8080, block: bool = True, duration: float = DURATION, **settings
) -> Any:
    """Show something: in a notebook as a page with a time line, elsewhere in a viewer whose page a browser opens.

    Parameters
    ----------
    x : object
        As of `to_html`. A world or an environment is copied, and stays unchanged.
    host, port : str, int
        Address and port of the viewer's server; ignored in a notebook.
    block : bool
        True: serve until Ctrl-C. False: serve in a thread and return the viewer; its `stop` ends it.
    duration : float
        Longest simulated time in a notebook [s].
    **settings
        ``accuracy``, ``dt``, ``seed``, ``policy``, ``controller`` of `rigid_env.viewer.subject.open_subject`.

    Returns
    -------
    object
        In a notebook an object that displays the page; else the `Viewer`.

    Raises
    ------
    ValueError
        Something that cannot be played, or an argument out of range.
    gymnasium.error.DependencyNotInstalled
        If viser is missing.
    """
    from rigid_env.viewer import export
    from rigid_env.viewer.server import Viewer
    from rigid_env.viewer.servers import directions, start_viewer_server

    port = validation.count(port, "port", most=65_535)
    session = Session(open_subject(x, **settings))
    if export.in_notebook():
        return export.Embedded(_page(session, duration))
    server = start_viewer_server(session.subject.name, host, port)
    viewer = Viewer(session, server)
    viewer.play_once_seen()
    print("\n".join(directions(server)), flush=True)
    if block:
        viewer.run()
    else:
        threading.Thread(target=viewer.run, name="viewer", daemon=True).start()
    return viewer
