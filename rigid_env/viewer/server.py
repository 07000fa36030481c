"""Viewer: shows a session in a browser, in real time."""

from __future__ import annotations

import queue
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from physics.kernels.state import layout as at
from rigid_env.viewer.panel import Panel
from rigid_env.viewer.servers import address_of, stop_server
from rigid_env.viewer.session import Session
from rigid_env.viewer.stage import Stage

FPS = 60.0
"""Most pictures per second [1/s]."""

TEXTS = 5.0
"""Updates of numbers, plots and lists per second [1/s]."""


class Viewer:
    """Session in a browser: the server, the picture and the panel of controls.

    Parameters
    ----------
    session : Session
    server : viser.ViserServer
        Server from `rigid_env.viewer.servers.start_viewer_server`; the viewer stops it at the end.

    Attributes
    ----------
    address : str
        Address of the page.
    """

    def __init__(self, session: Session, server):
        self._session, self._server = session, server
        self._inbox: queue.SimpleQueue[Callable[[], Any]] = queue.SimpleQueue()
        self.address = address_of(server)
        self._stage = Stage(server, fields=session.subject.scene)
        self._stage.show(session.look())
        server.gui.reset()
        server.gui.set_panel_label(f"rigid-env: {session.subject.name}")
        self._panel = Panel(server.gui, session, self._stage, self._inbox.put)
        if session.can.drag:
            self._stage.on_drag(self._dragged)
            self._stage.on_click(self._clicked)
        self._is_running = self._is_seen = False
        self._drawn: float | None = None

    def play_once_seen(self) -> None:
        """Start playing when the first browser connects, so that the user sees the start."""
        self._server.on_client_connect(self._see)

    def _see(self, _client) -> None:
        if not self._is_seen:
            self._is_seen = True
            self._inbox.put(self._session.play)

    def run(self) -> None:
        """Serve the page until `stop` or Ctrl-C."""
        self._is_running = True
        before = texts = time.perf_counter()
        try:
            while self._is_running:
                now = time.perf_counter()
                self.turn(now - before)
                if now >= texts and self._server.get_clients():
                    self._panel.show()
                    texts = now + 1.0 / TEXTS
                before = now
                self._rest(now)
        except KeyboardInterrupt:
            pass
        finally:
            self.close()

    def turn(self, seconds: float) -> bool:
        """Carry out the user's inputs, advance by `seconds` of real time, and draw; True if anything has changed."""
        is_new = self._answer()
        is_new = self._session.advance(seconds) > 0 or is_new
        look_time = self._session.time
        if (is_new or look_time != self._drawn) and self._server.get_clients():
            self._drawn = look_time
            self._guarded(lambda: self._stage.show(self._session.look()))
        return is_new

    def stop(self) -> None:
        """End `run`, from any thread."""
        self._is_running = False

    def close(self) -> None:
        """Stop the server."""
        self._is_running = False
        stop_server(self._server)

    def _rest(self, since: float) -> None:
        """Sleep until the next picture is due; `since` is the time of the last one [s]."""
        left = since + 1.0 / FPS - time.perf_counter()
        if left > 0.0:
            time.sleep(left)

    def _answer(self) -> bool:
        """Call the functions that callbacks have posted; returns whether there were any."""
        is_any = False
        while True:
            try:
                act = self._inbox.get_nowait()
            except queue.Empty:
                return is_any
            is_any = True
            self._guarded(act)

    def _guarded(self, act: Callable[[], Any]) -> None:
        """Call a function, and show an error on the page instead of raising it."""
        try:
            act()
        except ValueError as error:
            self._tell(str(error))
        except Exception as error:
            self._session.pause()
            self._tell(f"{type(error).__name__}: {error}")

    def _tell(self, text: str) -> None:
        for client in self._server.get_clients().values():
            client.add_notification(title="rigid-env", body=text)

    # --- the user's hand -------------------------------------------------------------------------------------------

    def _dragged(self, phase: str, body: int, point: np.ndarray, target: np.ndarray) -> None:
        session = self._session
        if phase == "end":
            self._inbox.put(session.release)
        elif not _is_fixed(session, body):
            arm = point + session.subject.world.params[body, at.CENTER : at.CENTER + 3]  # from the centre of mass
            self._inbox.put(lambda: session.drag(body, arm, target))

    def _clicked(self, body: int, _point: np.ndarray, direction: np.ndarray) -> None:
        session, speed = self._session, self._panel.kick_speed
        if speed > 0.0 and not _is_fixed(session, body):
            self._inbox.put(lambda: session.kick(body, speed * _mass(session, body) * direction))


def _is_fixed(session: Session, body: int) -> bool:
    """True if a body is fixed: it can be neither dragged nor kicked."""
    return session.subject.world.scene.bodies[body].fixed


def _mass(session: Session, body: int) -> float:
    """Mass of a body [kg]."""
    return float(1.0 / session.subject.world.params[body, at.INV_MASS])
