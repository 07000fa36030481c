"""Pictures a second, sizes of files, time to the first picture: that they are measured. No test asserts a time."""

import json
import sys

import pytest
import typer
from typer.testing import CliRunner

pytest.importorskip("viser")

from benchmarks import viewer
from tests.viewer.browser import what_is_missing


@pytest.mark.exhaustive
def test_a_quick_run_writes_what_it_found(tmp_path):
    app = typer.Typer()
    app.command()(viewer.main)
    found = CliRunner().invoke(app, ["--quick", "--json", str(tmp_path / "v.json")])
    assert found.exit_code == 0, found.output
    rows = {row["key"]: row for row in json.loads((tmp_path / "v.json").read_text())["rows"]}
    of_browser = [] if what_is_missing() else ["first_picture", "empty_page"]
    assert list(rows) == ["pictures_1", "pictures_100", "file_1", "file_50", *of_browser]
    assert rows["file_1"]["ours"]["median"] > 0.5
    assert rows["pictures_100"]["notes"]["shown"]["median"] > 0.0


def test_every_body_moves_and_turns_in_every_look():
    before, after = list(viewer.motion(7, 0.05))[:2]
    assert before.time < after.time
    for one, other in zip(before.frame.bodies, after.frame.bodies):
        assert (one.pos != other.pos).all()
        assert (one.quat != other.quat).any()


STUBBORN = """
import signal, time
for each in (signal.SIGINT, signal.SIGTERM):
    signal.signal(each, signal.SIG_IGN)
time.sleep(600.0)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_a_viewer_that_does_not_answer_or_end_is_killed(monkeypatch):
    monkeypatch.setattr(viewer, "PATIENCE", 2.0)
    with (
        pytest.raises(RuntimeError, match="the viewer gave no address within 2 s"),
        viewer.running([sys.executable, "-c", STUBBORN], patience=0.5) as process,
    ):
        viewer.address_told(process)
    assert process.returncode == -9
