"""Controls of the panel in a real browser: time, plots, events, physics, the ghost and the hand."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from rigid_env.viewer.panel import ROWS, told
from tests.viewer.browser import change
from tests.viewer.user import user_of, wait_until

pytestmark = pytest.mark.exhaustive

DT = 0.05
"""Step of the drop [s]: long, so that its accuracy is seen beside the reference."""

MARKS = 0.005
"""Share of the pixels that the marks of contacts are at most."""

BLUE = (45, 95, 170)
"""Colour of the body, between its lit and its dark faces."""


def speed_of(session) -> float:
    """Speed of body 0 [m/s]."""
    return float(np.linalg.norm(session.subject.world.linvel[0, 0]))


def coloured(pixels: np.ndarray) -> int:
    """Pixels of lines: not transparent, and not grey as axes are."""
    colours = pixels[..., :3].astype(int)
    return int(((np.ptp(colours, axis=2) > 60) & (pixels[..., 3] > 128)).sum())


def shown_rows(user) -> list[str]:
    """Labels of the events in sight; of several spaces the page shows one."""
    return [row.inner_text() for row in user.page.get_by_role("button", name="body").all() if row.is_visible()]


def plain(event) -> str:
    return " ".join(told(event).split())


def test_time_plots_and_events():
    with user_of("drop", accuracy="fast", dt=DT) as user:
        first = user.settled()
        user.press("Step")
        user.until(lambda session: session.time == DT)
        user.sees_change(first)
        wait_until(user.page, lambda: user.value("time [s]") == DT)

        user.choose("speed", "2")
        user.until(lambda session: session.speed == 2.0)
        user.press("Play")
        user.page.get_by_role("button", name="Pause", exact=True).wait_for()
        user.until(lambda session: session.is_playing and session.time > 3.0)
        user.press("Pause")
        user.page.get_by_role("button", name="Play", exact=True).wait_for()
        end, paused = user.ask(lambda session: session.time), user.settled()
        user.page.wait_for_timeout(500)
        assert user.ask(lambda session: session.time) == end
        assert change(paused, user.watched.picture()) == 0.0

        user.fill("time [s]", "0.5")
        user.until(lambda session: session.time == pytest.approx(0.5))
        user.sees_change(paused)
        user.fill("time [s]", "0")
        user.sees_again(first)
        user.nudge("time [s]", "End")
        user.until(lambda session: session.time == end)
        user.sees_again(paused)

        user.choose("follow", "body 0")
        user.sees_change(paused)
        assert user.chosen("follow") == "body 0"
        user.choose("follow", "the room")
        user.sees_again(paused)

        check_plots(user, ["energy [J]", "momentum [kg m/s]", "penetration [µm]", "log₁₀ residual", "cost [µs/s]"])
        check_events(user)

        user.press("Reset")
        user.until(lambda session: session.time == 0.0 and len(session.samples) == 1)
        user.sees_again(first)


def check_plots(user, titles: list[str]) -> None:
    """All plots have a line; the group is closed, open, and closed again."""
    assert user.plots() == {}
    user.toggle_group("Plots")
    wait_until(user.page, lambda: list(user.plots()) == titles and all(map(coloured, user.plots().values())))
    user.toggle_group("Plots")
    wait_until(user.page, lambda: user.plots() == {})


def check_events(user) -> None:
    events = user.ask(lambda session: session.events)
    assert len(events) > ROWS
    user.toggle_group("Events")
    user.page.get_by_text(f"{len(events)} so far").wait_for()
    wait_until(user.page, lambda: shown_rows(user) == [plain(event) for event in events[::-1][:ROWS]])
    user.fill("earlier", "3")
    wait_until(user.page, lambda: shown_rows(user) == [plain(event) for event in events[::-1][3 : 3 + ROWS]])
    before, chosen = user.settled(), events[-1 - 3 - 5]
    user.page.get_by_role("button", name=plain(chosen)).last.click()
    user.until(lambda session: chosen.t - DT < session.time <= chosen.t)
    user.sees_change(before)
    known = user.ask(lambda session: len(session.events))
    assert known < len(events)
    user.page.get_by_text(f"{known} so far").wait_for()
    user.toggle_group("Events")


def test_physics_and_the_ghost():
    with user_of("drop", accuracy="fast", dt=DT) as user:
        first = user.settled()
        user.fill("gravity [m/s²]", "0")
        user.until(lambda session: session.settings["gravity"] == 0.0)
        user.press("Step")
        user.until(lambda session: session.time == DT and speed_of(session) == 0.0)
        weightless = user.sees_change(first)  # it turns, and does not fall
        user.fill("gravity [m/s²]", "20")
        user.nudge("gravity [m/s²]", "ArrowRight")
        user.until(lambda session: session.settings["gravity"] == pytest.approx(20.01))
        user.press("Step")
        user.until(lambda session: speed_of(session) == pytest.approx(20.01 * DT))
        user.sees_change(weightless)
        user.fill("gravity [m/s²]", "9.81")
        values = ("friction", 0.9), ("restitution", 0.6), ("friction", 0.5), ("restitution", 0.3)  # as they were
        for label, value in values:
            user.fill(label, str(value))
            user.until(lambda session, label=label, value=value: session.settings[label] == value)
            assert user.value(label) == value

        user.press("Reset")
        user.until(lambda session: session.time == 0.0)
        user.tick("ghost at reference")
        user.until(lambda session: session.ghost_label == "reference")
        user.ask(lambda session: [session.step() for _ in range(80)])
        wait_until(user.page, lambda: user.status.count("µs per simulated second") == 2)
        text = user.until_told("fast: ", "reference: ", "distance ")
        apart = float(text.split("distance ")[1].split(" m")[0])
        assert apart == pytest.approx(user.ask(lambda session: session.samples.error[-1]), rel=0.06)
        assert apart > 1e-3
        titles = ["energy [J]", "momentum [kg m/s]", "penetration [µm]", "log₁₀ residual"]
        check_plots(user, [*titles, "log₁₀ distance to reference [m]", "cost [µs/s]"])
        with_ghost = user.settled()
        user.toggle_group("Show")
        user.check_layer("ghost")
        user.toggle_group("Show")
        user.tick("ghost at reference")
        user.sees_change(with_ghost)
        user.until(lambda session: session.ghost_label == "")
        wait_until(user.page, lambda: "distance" not in user.status)
        check_accuracy(user)


def check_accuracy(user) -> None:
    """The panel says that another preset compiles, and names it once it acts; the body stays, contacts come later."""
    subject, may_go_on, before = user.viewer._session.subject, threading.Event(), user.settled()
    prepare = subject.prepare

    def held(name):
        work = prepare(name)
        return lambda: (work(), may_go_on.wait())

    subject.prepare = held
    user.choose("accuracy", "balanced")
    user.until_told("compiling balanced", "fast: ")
    may_go_on.set()
    user.until(lambda session: session.accuracy == "balanced")
    assert "compiling" not in user.until_told("balanced: ")
    assert user.chosen("accuracy") == "balanced"
    assert change(before, user.settled()) < MARKS


def test_the_hand():
    with user_of("drop", accuracy="fast", dt=DT) as user:
        first, mouse = user.settled(), user.page.mouse
        at = user.body(BLUE)
        user.fill("gravity [m/s²]", "0")
        user.fill("kick [m/s]", "5")
        user.page.wait_for_timeout(300)  # a kick of another strength cannot be told from a late one
        mouse.click(*at)
        user.ask(lambda session: session.step())
        user.until(lambda session: bool(session._run.history.inputs))
        wait_until(user.page, lambda: kicked(user) == pytest.approx(5.0, abs=1e-6))
        user.sees_change(first)

        user.tick("a click kicks")
        user.press("Reset")
        user.sees_again(first)
        mouse.click(*at)
        user.page.wait_for_timeout(1000)  # for something that does not come
        assert kicked(user) == 0.0

        mouse.move(*at)
        mouse.down()
        for k in range(1, 9):
            mouse.move(at[0] - 8 * k, at[1] - 5 * k)
            user.page.wait_for_timeout(60)
        user.until(lambda session: session.look().drag is not None)
        low = user.ask(lambda session: session.subject.world.pos[0, 0, 1])
        held = user.ask(lambda session: session.look().drag)
        user.ask(lambda session: [session.step() for _ in range(10)])
        assert user.ask(lambda session: session.subject.world.pos[0, 0, 1]) > low + 0.1
        assert np.linalg.norm(held[1] - held[0]) > 0.5
        mouse.up()
        user.until(lambda session: session.look().drag is None)

        user.ask(lambda session: session.drag(0, (2.5, 1.5, 1.0), (3.0, 6.0, 1.0)))
        user.toggle_group("Show")
        user.check_layer("drag")


def kicked(user) -> float:
    """Speed of the body after a step [m/s]."""
    return user.ask(lambda session: (session.step(), speed_of(session))[1])
