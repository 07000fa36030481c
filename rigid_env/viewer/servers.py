"""Servers of viser that print nothing: their banner does not tell how to reach them from elsewhere.

A server can be up before there is anything to show: the browser loads the page meanwhile, which takes as long.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import rich

from rigid_env.extras import require

LOOPBACK = "127.0.0.1"

PORT = 8080
"""Port at which a viewer listens."""

PORTS, LAST_PORT = 1000, 65_535
"""Ports that are tried, one after the other, and the last one that there is."""


def start_server(host: str = LOOPBACK, port: int = 0, label: str | None = None):
    """Start a server of viser.

    Parameters
    ----------
    host : str
        Address to listen at; the default is reached from this machine only.
    port : int
        0 takes any that is free; another one that is taken, the next free one. `get_port` of the server tells.
    label : str, optional
        Head of the panel.

    Returns
    -------
    viser.ViserServer
        To be ended by `stop_server`.

    Raises
    ------
    ValueError
        If `host` is no address of this machine, or no port is free.
    gymnasium.error.DependencyNotInstalled
        If viser is missing.
    """
    require("view", purpose="the viewer")
    port = free_port(host, port)
    import viser

    with _hushed():
        return viser.ViserServer(host=host, port=port, label=label, verbose=False)


def free_port(host: str, port: int) -> int:
    """First port from `port` on that is free; 0 stays 0. viser itself would wait for ever where there is none.

    Raises
    ------
    ValueError
        If `host` is no address of this machine, or no port is free.
    """
    try:
        _bind(host, 0)
    except OSError as error:
        allowed = "allowed are addresses of this machine, such as 127.0.0.1, and 0.0.0.0 for all of them"
        raise ValueError(f"host is {host!r}; {allowed} ({error.strerror})") from error
    for each in range(port, min(port + PORTS, LAST_PORT + 1)):
        with suppress(OSError):  # it is taken, or not for this user
            _bind(host, each)
            return each
    raise ValueError(f"port is {port}, and none from there on is free; allowed is a smaller one")


def _bind(host: str, port: int) -> None:
    """Take a port, and let go of it."""
    family, *_ = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    with socket.socket(family) as taken:
        if os.name == "posix":  # as asyncio does: a port that was let go of a moment ago
            taken.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        taken.bind((host, port))


def start_viewer_server(name: str, host: str = LOOPBACK, port: int = PORT):
    """Start the server of a viewer, whose page says that something is being opened.

    Parameters
    ----------
    name : str
        What is being opened.
    host, port
        As of `start_server`.

    Returns
    -------
    viser.ViserServer
        For `rigid_env.viewer.server.Viewer`.

    Raises
    ------
    ValueError
        If `host` is no address of this machine, or no port is free.
    gymnasium.error.DependencyNotInstalled
        If viser is missing.
    """
    server = start_server(host, port, "rigid-env")
    server.gui.configure_theme(show_logo=False, show_share_button=False)
    server.gui.main_panel.dock_right()
    server.gui.add_markdown(f"opening {name} ...")
    return server


def address_of(server) -> str:
    """Address of a server as it is reached from this machine."""
    host = server.get_host()
    shown = "localhost" if host in (LOOPBACK, "localhost", "::1") else host
    return f"http://{shown}:{server.get_port()}"


def directions(server) -> list[str]:
    """Lines that say where a viewer is, and how to reach it from another machine."""
    lines, port = [f"viewer      {address_of(server)}"], server.get_port()
    if server.get_host() == LOOPBACK:
        lines.append(f"over SSH    ssh -L {port}:localhost:{port} THIS_MACHINE, then open http://localhost:{port}")
    return lines


def stop_server(server) -> None:
    """End a server; connections are closed."""
    with _hushed():
        server.stop()


@contextmanager
def server_for_a_while(host: str = LOOPBACK) -> Iterator:
    """Server that ends with the block, at any free port."""
    server = start_server(host)
    try:
        yield server
    finally:
        stop_server(server)


@contextmanager
def _hushed() -> Iterator[None]:
    """Leave out lines that go to rich's own console, as those of viser do whatever `verbose` is."""
    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before
