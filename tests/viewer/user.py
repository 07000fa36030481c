"""User of a viewer's page: presses, fills, ticks and chooses in the panel, and asks the session what became of it."""

from __future__ import annotations

import base64
import io
import queue
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from tests.viewer.browser import PATIENCE, Watched, change, open_browser

NOTICED = 5e-5
"""Share of the pixels that a small mark changes; the browser draws the same scene with the same bits."""

KNOWN = "Unable to preventDefault inside passive event listener"
"""Error that viser's page itself makes when the mouse is pressed on a body."""

STILL = 4
"""Pictures in a row that are the same once nothing moves."""

OPEN_PLOTS = """
    [...document.querySelectorAll('.uplot')]
    .filter(plot => !plot.closest('[aria-hidden=true]') && plot.querySelector('canvas').width)
    .map(plot => [plot.querySelector('.u-title').textContent, plot.querySelector('canvas').toDataURL('image/png')])
"""
"""Script: title and picture of each plot of open groups."""


class User:
    """Page of a viewer that runs in a thread.

    Attributes
    ----------
    watched : Watched
    page : playwright.sync_api.Page
    viewer : Viewer
    """

    def __init__(self, viewer, watched: Watched):
        self.viewer, self.watched, self.page = viewer, watched, watched.page

    def ask(self, read: Callable[[Any], Any]) -> Any:
        """Result of a function of the session, called in its thread."""
        answers: queue.SimpleQueue = queue.SimpleQueue()
        self.viewer._inbox.put(lambda: answers.put(read(self.viewer._session)))
        return answers.get(timeout=PATIENCE)

    def until(self, is_so: Callable[[Any], bool]) -> None:
        """Wait until something is true of the session."""
        wait_until(self.page, lambda: self.ask(is_so))

    def until_told(self, *parts: str) -> str:
        """Wait until the first lines of the panel have these parts, and return them."""
        wait_until(self.page, lambda: all(part in self.status for part in parts))
        return self.status

    @property
    def status(self) -> str:
        """First lines of the panel."""
        return self.page.locator("p[data-size=sm]:visible").first.inner_text()

    # --- controls ----------------------------------------------------------------------------------------------

    def toggle_group(self, name: str) -> None:
        """Open or close a group of controls."""
        self.page.get_by_text(name, exact=True).click()

    def press(self, label: str) -> None:
        self.page.get_by_role("button", name=label, exact=True).click()

    def _row(self, label: str):
        return self.page.get_by_text(label, exact=True).locator("xpath=ancestor::p/../..")

    def number(self, label: str):
        """Number field of a control."""
        return self._row(label).locator("input[inputmode=decimal], input[type=number]").first

    def value(self, label: str) -> float:
        return float(self.number(label).input_value())

    def fill(self, label: str, text: str) -> None:
        self.number(label).fill(text)
        self.number(label).press("Enter")

    def nudge(self, label: str, key: str) -> None:
        """Press a key on the knob of a slider."""
        self._row(label).get_by_role("slider").press(key)

    def tick(self, label: str) -> None:
        self._row(label).locator("input[type=checkbox]").click()

    def choose(self, label: str, option: str) -> None:
        self._row(label).get_by_role("combobox").click()
        self.page.get_by_role("option", name=option, exact=True).click()

    def chosen(self, label: str) -> str:
        return self._row(label).get_by_role("combobox").input_value()

    # --- pictures ----------------------------------------------------------------------------------------------

    def sees_change(self, before: np.ndarray, least: float = NOTICED) -> np.ndarray:
        """Wait until the picture differs from another one, and return it once it stays."""
        self.watched.wait_for(lambda picture: change(before, picture) > least)
        return self.settled()

    def sees_again(self, before: np.ndarray) -> None:
        """Wait until the picture is another one, to the last pixel."""
        self.watched.wait_for(lambda picture: change(before, picture) == 0.0)

    def settled(self) -> np.ndarray:
        """Picture that stays: several in a row are the same."""
        self.ask(lambda _: None)
        last, same = self.watched.picture(), 0

        def stays(picture) -> bool:
            nonlocal last, same
            same, last = same + 1 if change(last, picture) == 0.0 else 0, picture
            return same == STILL

        return self.watched.wait_for(stays)

    def check_layer(self, name: str) -> None:
        """Tick the box of a layer twice: the picture changes, and is as before."""
        print("layer", name)  # pytest shows it with a failure
        before = self.settled()
        self.tick(name)
        self.sees_change(before)
        self.tick(name)
        self.sees_again(before)

    def body(self, colour, room: float = 0.45) -> tuple[float, float]:
        """Middle of the pixels of a colour, left of the panel [px]."""
        picture = self.settled()
        left = picture[:, : int(picture.shape[1] * room)].astype(float)
        y, x = np.argwhere(np.abs(left - colour).max(axis=2) < 60).mean(axis=0)
        return float(x), float(y)

    def plots(self) -> dict[str, np.ndarray]:
        """Pixels (height, width, 4) of the plots that are open, by title."""
        from PIL import Image

        found = {}
        for title, url in self.page.evaluate(OPEN_PLOTS):
            with Image.open(io.BytesIO(base64.b64decode(url.split(",", 1)[1]))) as image:
                found[title] = np.asarray(image.convert("RGBA"))
        return found


@contextmanager
def user_of(what, **arguments) -> Iterator[User]:
    """User of a subject in a viewer whose kernels are there; in the end nothing is on the console."""
    import pytest

    pytest.importorskip("viser")
    from rigid_env.viewer.server import Viewer
    from rigid_env.viewer.servers import start_viewer_server
    from tests.viewer.conftest import session_of

    with open_browser() as watched:
        session = session_of(what, **arguments)
        viewer = Viewer(session, start_viewer_server(session.subject.name, port=8500))
        thread = threading.Thread(target=viewer.run, daemon=True)
        thread.start()
        try:
            watched.open(f"http://127.0.0.1:{viewer.address.rsplit(':', 1)[1]}/")
            user = User(viewer, watched)
            user.page.locator(".mantine-Notification-closeButton").click()  # about WebGL in software
            yield user
            watched.errors = [text for text in watched.errors if KNOWN not in text]
            watched.assert_quiet()
        finally:
            viewer.stop()
            thread.join()


def wait_until(page, is_so: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE
    while not is_so():
        assert time.monotonic() < end, "it does not happen"
        page.wait_for_timeout(100)
