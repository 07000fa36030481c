"""The stage and its files in a real browser: pixels, picks and what leaves the machine."""

from __future__ import annotations

import time

import numpy as np
import pytest

from tests.viewer.browser import PATIENCE, change, open_browser, share_of
from tests.viewer.looks import BLOCK, busy_look, look_of, motion

BLUE = (45, 95, 170)
"""Colour of the first body, between its lit and its dark faces."""

SEEN = 0.002
"""Share of the pixels of a body, or of a change, that counts."""


def shows_block(picture) -> bool:
    return share_of(picture, BLUE) > SEEN


@pytest.fixture
def stage():
    pytest.importorskip("viser")
    from rigid_env.viewer.servers import server_for_a_while
    from rigid_env.viewer.stage import Stage

    with server_for_a_while() as server:
        yield Stage(server)


def address(stage) -> str:
    return f"http://127.0.0.1:{stage._server.get_port()}"


def test_the_stage_shows_a_block_and_its_layers(stage, is_exhaustive):
    look = look_of()
    stage.show(look)
    with open_browser() as watched:
        watched.open(address(stage))
        plain = watched.wait_for(shows_block)
        assert len(np.unique(plain.reshape(-1, 3), axis=0)) > 50
        for name in ("bounds", "axes") if is_exhaustive else ("axes",):
            stage.set_layer(name, True)
            watched.wait_for(lambda picture: change(plain, picture) > SEEN)
            stage.set_layer(name, False)
            watched.wait_for(lambda picture: change(plain, picture) < SEEN)
        stage.show(busy_look())
        watched.wait_for(lambda picture: change(plain, picture) > SEEN)
        watched.assert_quiet()


def test_a_body_is_dragged_and_clicked(stage):
    drags, clicks = [], []
    stage.on_drag(lambda *found: drags.append(found))
    stage.on_click(lambda *found: clicks.append(found))
    look = look_of()
    stage.show(look)
    with open_browser() as watched:
        watched.open(address(stage))
        picture = watched.wait_for(shows_block)
        beside_panel = picture[:, : picture.shape[1] * 45 // 100].astype(float)
        y, x = np.argwhere(np.abs(beside_panel - BLUE).max(axis=2) < 60).mean(axis=0)
        mouse = watched.page.mouse
        mouse.move(x, y)
        mouse.down()
        for k in range(1, 9):
            mouse.move(x + 5 * k, y - 3 * k)
            watched.page.wait_for_timeout(60)
        mouse.up()
        until(watched, lambda: drags and drags[-1][0] == "end")
        mouse.click(x, y)
        until(watched, lambda: clicks)
    phases = [phase for phase, *_ in drags]
    assert phases[0] == "start"
    assert phases[-1] == "end"
    assert all(body == 0 for _, body, _, _ in drags)
    grips = np.array([grip for _, _, grip, _ in drags])
    assert (grips == grips[0]).all()
    assert (np.abs(grips[0]) <= 0.51 * BLOCK.dimensions).all()
    first, last = drags[0][3], drags[-1][3]
    assert last[1] > first[1]
    body, point, direction = clicks[0]
    assert body == 0
    assert np.linalg.norm(direction) == pytest.approx(1.0)
    from rigid_env.viewer.shapes import body_point

    assert np.abs(body_point(BLOCK, point) / (0.5 * BLOCK.dimensions)).max() == pytest.approx(1.0, abs=1e-6)


def until(watched, is_done) -> None:
    end = time.monotonic() + PATIENCE
    while not is_done():
        assert time.monotonic() < end, "it does not happen"
        watched.page.wait_for_timeout(100)


def test_a_file_plays_offline(tmp_path, rng):
    pytest.importorskip("viser")
    from rigid_env.viewer.export import page_of, write_page

    page = page_of(motion((BLOCK,), 4.0, 10.0, rng), fps=10.0, title="a block & more")
    path = write_page(page, tmp_path / "run.html")
    with open_browser() as watched:
        watched.open(path.as_uri())
        assert watched.page.title() == "a block & more"
        watched.wait_for(shows_block)
        shown = watched.page.locator("input").first
        begun = float(shown.input_value())
        until(watched, lambda: float(shown.input_value()) != begun)
        watched.page.keyboard.press("Space")
        held = watched.page.evaluate("document.querySelector('input').value")
        watched.page.wait_for_timeout(500)
        assert shown.input_value() == held
        go_to(watched, shown, "0.2")
        early = watched.wait_until_still()
        go_to(watched, shown, "3.5")
        watched.wait_for(lambda picture: change(early, picture) > SEEN)
        watched.assert_quiet()


def go_to(watched, shown, moment: str) -> None:
    shown.fill(moment)
    shown.press("Enter")
    until(watched, lambda: float(shown.input_value()) == float(moment))
