"""The viewer without a browser: its server, its panel, plots and lists, and the command."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

pytest.importorskip("viser")

import rigid_env
from physics import Block, Drag, Event, Gravity, Scene, Wind, World, scenes
from rigid_env.cli import app
from rigid_env.cli.names import CANONICAL
from rigid_env.viewer import session as session_module
from rigid_env.viewer.history import Samples
from rigid_env.viewer.panel import ROWS, EventList, told
from rigid_env.viewer.plots import SMALLEST, Plot, drawn, line, thinned
from rigid_env.viewer.server import Viewer
from rigid_env.viewer.servers import LAST_PORT, directions, free_port, server_for_a_while, start_viewer_server
from rigid_env.viewer.session import Session
from rigid_env.viewer.subject import open_subject
from tests.tasks.conftest import Slide

NO_WALL = -1


def event(t: float, kind: str = "impact", wall: int = 0, other: int = -1) -> Event:
    return Event(t, kind, 0, wall, (0.0, 0.0, 0.0), other, (0.0, 0.0, 0.0), (0.0, 1.0, 0.0))


@pytest.fixture(scope="module")
def viewer():
    session = Session(open_subject("drop", accuracy="fast"))
    viewer = Viewer(session, start_viewer_server("drop", port=8450))
    session.wait()
    yield viewer
    viewer.close()


@pytest.fixture(autouse=True)
def patience(monkeypatch):
    """No step is left out where other programs have the processors."""
    monkeypatch.setattr(session_module, "BUDGET", 1e6)


def turns(viewer: Viewer, count: int) -> None:
    for _ in range(count):
        viewer.turn(0.02)


def test_time_goes_on_as_real_time_does_and_no_step_is_late(viewer):
    session = viewer._session
    session.reset()
    session.play()
    turns(viewer, 50)
    # Each turn owes 20 ms, two steps of 10 ms; after the last one less than a step is owed.
    assert session.time == pytest.approx(1.0, abs=0.01 + 1e-9)
    session.pause()
    turns(viewer, 5)
    assert session.time == pytest.approx(1.0, abs=0.01 + 1e-9)


def test_time_begins_with_the_first_browser(viewer):
    session = viewer._session
    session.reset()
    session.pause()
    viewer.play_once_seen()
    turns(viewer, 3)
    assert session.time == 0.0
    viewer._see(None)
    turns(viewer, 3)
    assert session.time > 0.0
    session.pause()
    viewer._see(None)  # another one
    turns(viewer, 1)
    assert not session.is_playing


def test_what_is_posted_is_done_in_the_next_turn_and_a_mistake_changes_nothing(viewer):
    session = viewer._session
    session.reset()
    viewer._inbox.put(lambda: session.set_friction(0.9))
    viewer._inbox.put(lambda: session.set_friction(-1.0))  # a ValueError: told in the panel
    viewer.turn(0.0)
    assert session.settings["friction"] == 0.9


class NextFails(Slide):
    """A task whose episodes take three steps, and begin while `is_right`."""

    is_right = True

    def place(self, drawn):
        if not self.is_right:
            raise KeyError("mass")
        return {}

    def failure(self, worlds):
        return worlds.steps >= 3


def test_an_error_of_a_users_function_pauses_the_run_and_the_viewer_goes_on(monkeypatch):
    """At a reset, in the next episode and in a picture."""
    session = Session(open_subject(rigid_env.TaskEnv(NextFails)))
    with server_for_a_while() as server:
        viewer = Viewer(session, server)
        session.wait()
        assert session.step()
        before, seed = session.subject.world.state.copy(), session.seed
        monkeypatch.setattr(NextFails, "is_right", False)
        session.play()
        viewer._inbox.put(lambda: session.reset(seed + 1))
        viewer.turn(0.0)
        assert (session.is_playing, session.message) == (False, "KeyError: 'mass'")
        assert np.array_equal(session.subject.world.state, before)
        assert session.seed == seed
        assert session.step()
        assert session.step()
        assert not session.step()  # the next episode
        assert session.message == "KeyError: 'mass'"
        told = []
        client = SimpleNamespace(add_notification=lambda title, body: told.append(body))
        monkeypatch.setattr(server, "get_clients", lambda: {0: client})
        monkeypatch.setattr(viewer._stage, "show", {}.__getitem__)
        viewer._drawn = None
        turns(viewer, 2)
        assert len(told) == 1
        assert told[0].startswith("KeyError")


def test_the_panel_follows_the_session(viewer):
    session, panel = viewer._session, viewer._panel
    session.reset()
    session.play()
    turns(viewer, 120)
    panel.show()
    assert panel._play.label == "Pause"
    assert panel._slider.value == pytest.approx(session.time)
    assert "fast" in panel._status.content
    assert "µs per simulated second" in panel._status.content
    assert panel._events._rows[0].label == told(session.events[-1])
    session.seek(0.5)
    panel.show()
    assert panel._slider.value == pytest.approx(session.time) == pytest.approx(0.5)


def test_a_slider_does_not_jump_back_before_the_session_has_its_value(viewer):
    session, panel, slider = viewer._session, viewer._panel, Handle(value=0.9)
    panel._when(slider, session.set_friction)
    slider.value = 0.5
    panel._put(slider, "value", 0.5)
    slider.value = 0.9  # of the user: its callback comes a moment later
    panel._put(slider, "value", 0.5)
    assert slider.value == 0.9
    slider.acts[0](SimpleNamespace(client="a browser"))
    panel._put(slider, "value", 0.5)  # of the session, still
    assert slider.value == 0.9
    viewer.turn(0.0)
    assert session.settings["friction"] == 0.9
    panel._put(slider, "value", 0.5)
    assert slider.value == 0.5


def test_it_says_where_it_is_and_how_to_reach_it(viewer):
    where, ssh = directions(viewer._server)
    port = viewer.address.rsplit(":", 1)[1]
    assert where.endswith(f"http://localhost:{port}")
    assert f"ssh -L {port}:localhost:{port}" in ssh
    with server_for_a_while("0.0.0.0") as open_to_all:
        assert len(directions(open_to_all)) == 1


def test_a_port_that_is_none_is_refused():
    with pytest.raises(ValueError, match="port is 0; allowed are integers of at least 1"):
        rigid_env.show("drop", accuracy="fast", port=0)


def test_a_port_that_is_taken_gives_the_next_one_and_a_host_that_is_none_an_error():
    with server_for_a_while() as server:
        taken = server.get_port()
        assert free_port("127.0.0.1", taken) > taken
    with pytest.raises(ValueError, match=r"host is '203.0.113.7'; allowed are addresses of this machine"):
        start_viewer_server("drop", "203.0.113.7")
    with pytest.raises(ValueError, match=r"host is 'no such host'; allowed are addresses of this machine"):
        start_viewer_server("drop", "no such host")
    with socket.socket() as last:
        last.bind(("127.0.0.1", LAST_PORT))
        last.listen()
        with pytest.raises(ValueError, match=r"port is 65535, and none from there on is free"):
            free_port("127.0.0.1", LAST_PORT)


def test_fields_of_the_scene_are_drawn():
    scene = Scene([Block((1, 1, 1), 1.0, pos=(0, 2, 0))], effects=[Gravity(), Drag(), Wind((3.0, 0.0, 0.0))])
    with server_for_a_while() as server:
        viewer = Viewer(Session(open_subject(scene, accuracy="fast")), server)
        (label,) = viewer._stage._layers["fields"]._nodes
    assert label.text == "wind 3 m/s"


# --- plots and events ---------------------------------------------------------------------------------------------


@given(count=st.integers(1, 5000), most=st.integers(2, 500))
def test_a_line_is_thinned_evenly_from_its_first_to_its_last_sample(count, most):
    chosen = thinned(count, most)
    assert len(chosen) <= most
    assert chosen[0] == 0
    assert chosen[-1] == count - 1
    gaps = np.diff(chosen)
    assert (gaps > 0).all()
    assert gaps.size == 0 or gaps.max() - gaps.min() <= 1  # rounding of equal parts


def test_a_line_has_the_unit_of_its_plot_and_powers_of_ten_a_bottom():
    values = np.array([0.0, 1e-3, np.nan])
    power, micro = Plot("a", ("residual",), is_power=True), Plot("b", ("penetration",), factor=1e6)
    assert line(values, power) == pytest.approx([np.log10(SMALLEST), -3.0, np.nan], nan_ok=True)
    assert line(values, micro) == pytest.approx([0.0, 1e3, np.nan], nan_ok=True)


def test_a_plot_has_the_columns_that_are_known_from_when_the_first_is():
    samples, plot = Samples(), Plot("distance", ("error", "error_of_reference"))
    for k in range(6):
        samples.append(time=0.1 * k, error=float(k) if k >= 2 else np.nan)
    columns, data = drawn(plot, samples, np.arange(6))
    assert columns == ("error",)
    assert [part.tolist() for part in data] == [pytest.approx([0.2, 0.3, 0.4, 0.5]), [2.0, 3.0, 4.0, 5.0]]
    samples.truncate(3)
    assert drawn(plot, samples, np.arange(3)) == ((), ())  # a single point is no line


def test_an_event_is_told_in_a_line():
    assert told(event(1.25)) == "1.250 s  impact: body 0, wall 0"
    assert told(event(0.5, other=3)) == "0.500 s  impact: body 0, body 3"
    assert told(event(0.5, "rest", NO_WALL)) == "0.500 s  rest: body 0"
    assert told(replace(event(0.5, other=3), name="cart", other_name="crate")) == "0.500 s  impact: cart, crate"


class Handle:
    """A control that nobody sees."""

    def __init__(self, **values):
        vars(self).update(values)
        self.acts = []

    def on_click(self, act):
        self.acts.append(act)

    on_update = on_click


class Gui:
    """Controls that nobody sees."""

    def add_slider(self, label, low, high, step, value, visible=True):
        return Handle(max=high, value=value, visible=visible)

    def add_markdown(self, content):
        return Handle(content=content)

    def add_button(self, label, visible=True, color=None):
        return Handle(label=label, visible=visible)


def test_the_newest_events_are_in_sight_and_a_click_goes_to_their_time():
    went = []
    events = EventList(Gui(), went.append)
    events.show([event(0.1 * k) for k in range(20)])
    assert [row.label for row in events._rows] == [told(event(0.1 * k)) for k in range(19, 19 - ROWS, -1)]
    events._rows[2].acts[0](None)
    assert went == [pytest.approx(1.7)]
    events._back.value = 12  # the earliest
    events._back.acts[0](None)
    assert events._rows[-1].label == told(event(0.0))
    events.show([event(0.3)])  # after going back in time
    events.show([event(0.4)])  # and on, to as many
    assert events._rows[0].label == told(event(0.4))
    assert [row.visible for row in events._rows] == [True] + [False] * (ROWS - 1)
    events.show([])
    assert not any(row.visible for row in events._rows)


# --- from Python and from the command line ---------------------------------------------------------------------------


def test_a_run_is_written_as_one_page(tmp_path):
    world = World(scenes.drop(), accuracy="fast")
    path = rigid_env.to_html(world, tmp_path / "drop.html", duration=0.5, fps=10)
    page = path.read_text(encoding="utf-8")
    assert page.lstrip().lower().startswith("<!doctype html>")
    assert path.stat().st_size < 2e6
    assert world.time == 0.0  # a copy was played
    with pytest.raises(ValueError, match="duration is -1"):
        rigid_env.to_html(world, tmp_path / "none.html", duration=-1.0)
    with pytest.raises(ValueError, match="what is 7; allowed are a canonical scene"):
        rigid_env.to_html(7, tmp_path / "none.html")
    assert not (tmp_path / "none.html").exists()


def test_the_command_exports_and_says_what_is_wrong(tmp_path):
    runner = CliRunner()
    path = tmp_path / "a.html"
    done = runner.invoke(app, ["view", "drop", "--accuracy", "fast", "--export", str(path), "--duration", "0.2"])
    assert done.exit_code == 0, done.output
    assert path.is_file()
    assert "MB" in done.output
    wrong = runner.invoke(app, ["view", "dropp", "--export", str(path)])
    assert wrong.exit_code != 0
    assert "what is 'dropp'; allowed are" in " ".join(wrong.output.split())


ENDING = """
import os, signal
from rigid_env.cli import app
from rigid_env.viewer.server import Viewer

Viewer.turn = lambda viewer, seconds: os.kill(os.getpid(), signal.SIGTERM)
app(["view", "drop", "--port", "8460", *{options}])
"""


def told_at_the_end(*options: str) -> tuple[int, str]:
    """Exit status and output of a viewer that gets SIGTERM; it ignores SIGINT, as if started in the background."""
    done = subprocess.run(
        [sys.executable, "-c", ENDING.format(options=list(options))], capture_output=True, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN),
    )  # fmt: skip
    return done.returncode, done.stdout + done.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_sigterm_ends_the_viewer():
    status, output = told_at_the_end("--accuracy", "fast")
    assert status == 0, output
    assert output.count("http://localhost:") == 2  # and over SSH
    assert output.count("ended") == 1


def test_an_address_is_told_only_where_there_is_something_to_look_at(tmp_path):
    path = tmp_path / "wrong.toml"
    path.write_text("[[bodies]]\nkind = 'block'\nmass = -1.0\n")
    runner = CliRunner()
    for wrong in (
        ["dropp"],
        [str(path)],
        ["drop", "--accuracy", "exact"],
        ["rigid_env/BlockReach-v0", "--policy", "x"],
    ):
        done = runner.invoke(app, ["view", *wrong, "--port", "8470"])
        assert done.exit_code == 2
        assert "http" not in done.output
    assert set(CANONICAL) == set(scenes.SCENES)  # of these it is told at once
