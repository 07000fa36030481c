"""Start and stop servers of viser without its banner, which does not say how other machines reach the page.

A server can start before there is anything to show, so that the browser loads the page while kernels compile.
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
"""Default port of a viewer."""

PORTS, LAST_PORT = 1000, 65_535
"""Number of ports that are tried one after the other, and the largest port."""


def start_server(host: str = LOOPBACK, port: int = 0, label: str | None = None):
    """Start a server of viser.

    Parameters
    ----------
    host : str
        Address to listen at; the default is reached from this machine only.
    port : int
        First port to try; if it is taken, the next free one is used. 0: any free port. The server's `get_port` returns
        it.
    label : str, optional
        Title of the panel.

    Returns
    -------
    viser.ViserServer
        `stop_server` stops it.

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
    """First free port from `port` on; 0 stays 0. Without a free port, viser itself would wait forever.

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
    """Bind a socket to a port and close it; an OSError if the port is taken."""
    family, *_ = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    with socket.socket(family) as taken:
        if os.name == "posix":  # as asyncio does, so that a port closed a moment ago counts as free
            taken.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        taken.bind((host, port))


def start_viewer_server(name: str, host: str = LOOPBACK, port: int = PORT):
    """Start the server of a viewer, whose page shows at first that something is being opened.

    Parameters
    ----------
    name : str
        Name of the subject that is being opened.
    host, port
        As of `start_server`.

    Returns
    -------
    viser.ViserServer
        Server for `rigid_env.viewer.server.Viewer`.

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
    """Address of a server's page, as a browser on this machine opens it."""
    host = server.get_host()
    shown = "localhost" if host in (LOOPBACK, "localhost", "::1") else host
    return f"http://{shown}:{server.get_port()}"


def directions(server) -> list[str]:
    """Lines of text with the address of a viewer, and how to reach it from another machine."""
    lines, port = [f"viewer      {address_of(server)}"], server.get_port()
    if server.get_host() == LOOPBACK:
        lines.append(f"over SSH    ssh -L {port}:localhost:{port} THIS_MACHINE, then open http://localhost:{port}")
    return lines


def stop_server(server) -> None:
    """Stop a server and close its connections."""
    with _hushed():
        server.stop()


@contextmanager
def server_for_a_while(host: str = LOOPBACK) -> Iterator:
    """Context manager for a server at any free port, which is stopped at the end of the block."""
    server = start_server(host)
    try:
        yield server
    finally:
        stop_server(server)


@contextmanager
def _hushed() -> Iterator[None]:
    """Context manager that suppresses output to rich's console, where viser prints even if `verbose` is False."""
    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before
