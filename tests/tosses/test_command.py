"""``rigid-env tosses``: what it prints and writes, and what it says about mistakes."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from rigid_env.cli import app
from rigid_env.lab.tosses import report as reports
from rigid_env.lab.tosses.fit import QUICK
from rigid_env.lab.tosses.limits import faces_down
from rigid_env.lab.tosses.report import Measurement

runner = CliRunner()


def run(*arguments, code=0):
    result = runner.invoke(app, ["tosses", *map(str, arguments)])
    assert result.exit_code == code, result.output
    return result.output


def test_command_prints_and_writes_everything(npz, tmp_path):
    pytest.importorskip("matplotlib")
    numbers, picture = tmp_path / "numbers.json", tmp_path / "picture.png"
    output = run(npz, "--quick", "--json", numbers, "--plot", picture)
    for text in ("24 tosses, 6 of them", "contact and mass", "lengths corrected", "reference", "noise", "PyBullet"):
        assert text in output
    assert picture.read_bytes().startswith(b"\x89PNG")
    found = json.loads(numbers.read_text())
    assert {"machine", "cases", "ladder", "limits", "flight", "length_scale", "split_seed"} <= set(found)
    assert [rung["accuracy"] for rung in found["ladder"]] == ["fast", "balanced", "precise", "reference"]
    assert [case["rest"]["tosses"] for case in found["cases"]] == [18] * 6
    assert found["is_quick"] is True


def test_one_fit_of_named_parameters(npz):
    output = run(npz, "--quick", "--fit", "friction, heavy_y")  # and another mass: the kernels of the test before
    assert "friction, heavy_y" in output
    assert "lengths corrected" not in output


def test_mistakes_are_named(npz, tmp_path):
    assert "does not exist" in run(tmp_path / "no.npz", code=2)
    assert "'best'" in run(npz, "--accuracy", "best", code=2)
    assert "'mass'" in run(npz, "--fit", "mass", code=2)
    np.savez(tmp_path / "wrong.npz", states=np.zeros((3, 13)))
    told = run(tmp_path / "wrong.npz", code=2)
    assert "no array 'offsets'" in " ".join(told.replace("│", " ").split())


def test_interrupt_reports_what_there_is(made, monkeypatch):
    real, count = reports.Objective.__call__, 0

    def interrupted(self, cube):
        nonlocal count
        count += 1
        if count == 20:
            raise KeyboardInterrupt
        return real(self, cube)

    monkeypatch.setattr(reports.Objective, "__call__", interrupted)
    report = Measurement(made, effort=QUICK).run()
    assert not report.is_complete
    assert [rung.accuracy for rung in report.ladder] == ["balanced"]
    assert report.to_dict()["is_complete"] is False


def test_fit_sees_nothing_of_the_rest(made):
    measurement = Measurement(made, effort=QUICK)
    states = made.states.copy()
    for i in measurement.others:
        rows = slice(made.offsets[i], made.offsets[i + 1])
        states[rows] = states[rows][::-1]
    changed = Measurement(type(made)(states, made.offsets, made.numbers), effort=QUICK)
    for tosses in (measurement, changed):
        tosses.setups = tosses.setups[:1]
    assert measurement.run().cases[0].fit == changed.run().cases[0].fit


def test_faces_down_by_hand():
    turned = np.sqrt(0.5)
    quats = np.array([[1.0, 0, 0, 0], [0, 1.0, 0, 0], [turned, turned, 0, 0], [turned, 0, turned, 0]])
    # body -z; then +z; a quarter turn about x puts body -y down, one about y puts body +x down
    assert faces_down(quats).tolist() == [2, 5, 1, 3]


def test_real_tosses_are_within_reach(measured):
    """With friction and restitution as fitted by hand; MuJoCo, Drake and PyBullet have 0.133 to 0.145 and more."""
    from rigid_env.lab.tosses.replay import Cube, Recording

    measurement = Measurement(measured, effort=QUICK)
    cube = Cube(friction=0.18, restitution=0.2, side=0.098, inertia=0.00122)
    summary = measurement.errors(cube, Recording(), "balanced")[0].summary()
    assert summary.position_mean < 0.14
    assert summary.rotation_mean < 17.0
    assert measurement.report.scale == pytest.approx(1.022, abs=0.002)
    assert measurement.report.flight.gravity == pytest.approx(9.61, abs=0.02)
