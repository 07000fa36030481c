"""Servers of viser that print nothing: their banner does not tell how to reach them from elsewhere."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import rich

from rigid_env.extras import require

LOOPBACK = "127.0.0.1"


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
    gymnasium.error.DependencyNotInstalled
        If viser is missing.
    """
    require("view", purpose="the viewer")
    import viser

    with _hushed():
        return viser.ViserServer(host=host, port=port, label=label, verbose=False)


def stop_server(server) -> None:
    """End a server; connections are closed."""
    with _hushed():
        server.stop()


@contextmanager
def server_for_a_while() -> Iterator:
    """Server on the loopback address that ends with the block."""
    server = start_server()
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
