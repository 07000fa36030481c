"""The viewer without a browser: its server, its panel with a session, and the command."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

pytest.importorskip("viser")

import rigid_env
from physics import Block, Drag, Gravity, Scene, Wind, World, scenes
from rigid_env.cli import app
from rigid_env.cli.names import CANONICAL
from rigid_env.viewer import session as session_module
from rigid_env.viewer.panel import told
from rigid_env.viewer.server import Viewer
from rigid_env.viewer.servers import LAST_PORT, directions, free_port, server_for_a_while, start_viewer_server
from rigid_env.viewer.session import Session
from rigid_env.viewer.subject import open_subject
from tests.tasks.conftest import Slide
from tests.viewer.conftest import Handle


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
