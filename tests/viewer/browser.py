"""A real browser for tests of the viewer: a system's Chromium without a window or a GPU, driven by Playwright."""

from __future__ import annotations

import base64
import io
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from urllib.parse import urlsplit

import numpy as np
import pytest

PROGRAMS = ("chromium", "chromium-browser", "google-chrome")

ARGUMENTS = (
    "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist", "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--no-first-run",
)  # fmt: skip
"""Arguments of Chromium: WebGL in software, and no requests of its own over the network."""

SIZE = {"width": 640, "height": 400}
"""[px]. Small, as every pixel is drawn in software."""

PATIENCE = 240.0
"""[s]. Time after which a test gives up; a machine that others use draws a picture in seconds."""

CANVAS = "canvas[data-engine]"


class Watched:
    """A page, and what it should not do.

    Attributes
    ----------
    page : playwright.sync_api.Page
    leaving : list of str
        Addresses of requests to other machines.
    errors : list of str
        Errors on the console, and those that nobody caught.
    """

    def __init__(self, page):
        self.page, self.leaving, self.errors = page, [], []
        page.set_default_timeout(1e3 * PATIENCE)
        page.on("request", lambda request: self._note(request.url))
        page.on("websocket", lambda socket: self._note(socket.url))
        page.on("console", lambda message: message.type == "error" and self.errors.append(message.text))
        page.on("pageerror", lambda error: self.errors.append(str(error)))

    def _note(self, url: str) -> None:
        parts = urlsplit(url)
        if parts.scheme in ("http", "https", "ws", "wss") and parts.hostname != "127.0.0.1":
            self.leaving.append(url)

    def open(self, url: str) -> None:
        """Open a page of the viewer and wait until there is a picture to draw on.

        viser draws fewer pixels on a machine that is busy, unless it is told how many.
        """
        self.page.goto(f"{url}{'&' if '?' in url else '?'}fixedDpr=1")
        self.page.wait_for_selector(CANVAS, state="attached")

    def picture(self) -> np.ndarray:
        """(height, width, 3) uint8: the scene without the panels on it."""
        from PIL import Image

        drawn = self.page.evaluate(f"document.querySelector('{CANVAS}').toDataURL('image/png')")
        with Image.open(io.BytesIO(base64.b64decode(drawn.split(",", 1)[1]))) as image:
            return np.asarray(image.convert("RGB"))

    def wait_for(self, is_right: Callable[[np.ndarray], bool]) -> np.ndarray:
        """Wait for a picture for which `is_right` is true, and return it.

        The page is loaded anew once, after a quarter of the time: in one run of many it stayed empty.
        """
        start, is_reloaded = time.monotonic(), False
        while not is_right(picture := self.picture()):
            waited = time.monotonic() - start
            assert waited < PATIENCE, "the picture does not become right"
            if waited > PATIENCE / 4 and not is_reloaded:
                self.page.reload()
                self.page.wait_for_selector(CANVAS, state="attached")
                is_reloaded = True
            self.page.wait_for_timeout(200)
        return picture

    def wait_until_still(self) -> np.ndarray:
        """Wait until a picture stays as it is for half a second, and return it."""
        before = self.picture()
        self.page.wait_for_timeout(500)
        while change(before, self.picture()) > 0.0:
            before = self.picture()
            self.page.wait_for_timeout(500)
        return before

    def assert_quiet(self) -> None:
        """Nothing went to another machine, and no error came."""
        assert self.leaving == [], self.leaving
        assert self.errors == [], self.errors


@contextmanager
def open_browser() -> Iterator[Watched]:
    """Page of a browser; the test skips where there is none."""
    reason = what_is_missing()
    if reason:
        pytest.skip(reason)
    with browser() as opened:
        yield Watched(opened.new_page(viewport=SIZE))


@contextmanager
def browser() -> Iterator:
    """Browser of Playwright, without a page."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=_program(), args=list(ARGUMENTS))
        try:
            yield opened
        finally:
            opened.close()


def what_is_missing() -> str:
    """Reason why there is no browser here; empty where there is one."""
    for module, name in (("viser", "extra `view`"), ("PIL", "extra `render`"), ("playwright", "package `playwright`")):
        if find_spec(module) is None:
            return f"the {name} is not installed"
    if _program() is None:
        return f"no browser is installed: looked for {', '.join(PROGRAMS)}"
    if is_memory_limited():
        return "the address space of processes is limited here, of which a browser needs more than it uses"
    return ""


def _program() -> str | None:
    return next(filter(None, map(shutil.which, PROGRAMS)), None)


def is_memory_limited() -> bool:
    """True if processes may not reserve as many addresses as they like."""
    try:
        import resource
    except ImportError:
        return False
    return resource.getrlimit(resource.RLIMIT_AS)[0] != resource.RLIM_INFINITY


def share_of(picture: np.ndarray, colour, tolerance: float = 60.0) -> float:
    """Share of a picture's pixels that are near a colour (3,) in every channel."""
    return float((np.abs(picture.astype(float) - np.asarray(colour)).max(axis=2) < tolerance).mean())


def change(before: np.ndarray, after: np.ndarray) -> float:
    """Share of pixels that differ visibly."""
    return float((np.abs(before.astype(int) - after).max(axis=2) > 8).mean())
