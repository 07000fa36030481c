"""The three commands: what they write, and how they refuse."""

from __future__ import annotations

import json

import pytest
import typer
from typer.testing import CliRunner

pytest.importorskip("stable_baselines3")

from agents import evaluate, record, train
from agents.supervisor import Supervisor
from agents.train import INTERRUPTED


def run(module, *arguments):
    """A command's result; its output on one line, without the frame around errors."""
    app = typer.Typer()
    app.command()(module.main)
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    result.text = " ".join(result.output.replace("│", " ").split())
    return result


@pytest.fixture
def small(tmp_path):
    """Options of a run of one rollout."""
    return ("--num-envs", 64, "--max-steps", 2048, "--threads", 1, "--out", tmp_path / "runs")


def test_train_evaluate_record_resume(small, tmp_path, monkeypatch, is_exhaustive):
    if not is_exhaustive:  # a short video
        make = record.make_single_env
        monkeypatch.setattr(record, "make_single_env", lambda env, **kw: make(env, max_episode_steps=20, **kw))
    monkeypatch.setattr("agents.run.EVALUATION_EPISODES", 10)
    monkeypatch.setattr("agents.run.VIDEO_EPISODES", 1)
    result = run(train, *small, "--json", tmp_path / "r.json")
    assert result.exit_code == 0, result.output
    (folder,) = (tmp_path / "runs").iterdir()
    numbers = json.loads((tmp_path / "r.json").read_text(encoding="utf-8"))
    assert numbers == json.loads((folder / "result.json").read_text(encoding="utf-8"))
    assert numbers["steps"] == 2048
    assert numbers["evaluation"]["episodes"] == 10
    expected = {"config.yaml", "model.zip", "checkpoints", "monitor.csv", "curve.csv", "curve.png"}
    expected |= {"evaluation.json", "result.json", "episodes.mp4", ".lock"}
    assert {path.name for path in folder.iterdir()} == expected

    result = run(evaluate, folder, "--episodes", 10, "--json", tmp_path / "e.json")
    assert result.exit_code == 0, result.output
    again = json.loads((tmp_path / "e.json").read_text(encoding="utf-8"))
    assert again["return_mean"] == numbers["evaluation"]["return_mean"]

    result = run(train, "--resume", folder, "--max-steps", 4096, "--no-video")
    assert result.exit_code == 0, result.output
    assert json.loads((folder / "result.json").read_text(encoding="utf-8"))["steps"] == 4096


def test_interrupted_command_says_how_to_go_on(small, tmp_path, monkeypatch):
    def interrupted(supervisor):
        raise KeyboardInterrupt

    monkeypatch.setattr(Supervisor, "_on_step", interrupted)
    result = run(train, *small)
    assert result.exit_code == INTERRUPTED
    (folder,) = (tmp_path / "runs").iterdir()
    assert f"python -m agents.train --resume {folder}" in result.output


def test_folders_are_checked_before_a_run(tmp_path):
    (tmp_path / "file").touch()
    for options, message in (
        (["--out", tmp_path / "file"], "Invalid value for '--out'"),
        (["--folder", tmp_path / "file"], "Invalid value for '--folder'"),
        (["--out", "/proc/none/x"], "--out is '/proc/none/x', which cannot be made"),
        (["--folder", "/proc/none/x"], "--folder is '/proc/none/x', which cannot be made"),
    ):
        result = run(train, *options)
        assert result.exit_code == 2, result.output
        assert message in result.text


def test_evaluate_a_baseline(tmp_path):
    result = run(evaluate, "--baseline", "controller", "--episodes", 20, "--json", tmp_path / "e.json")
    assert result.exit_code == 0, result.output
    numbers = json.loads((tmp_path / "e.json").read_text(encoding="utf-8"))
    assert numbers["policy"] == "baseline controller"
    low, high = numbers["interval"]
    assert low < numbers["success_rate"] <= high
    assert f"{numbers['success_rate']:.1%}" in result.output


@pytest.mark.parametrize(("suffix", "start"), [(".mp4", b"ftyp"), (".gif", b"GIF89a")])
def test_record_a_baseline(tmp_path, monkeypatch, suffix, start):
    make = record.make_single_env
    monkeypatch.setattr(record, "make_single_env", lambda env, **kw: make(env, max_episode_steps=5, **kw))
    path = tmp_path / f"video{suffix}"
    result = run(record, "--baseline", "random", "--episodes", 1, "--out", path)
    assert result.exit_code == 0, result.output
    assert start in path.read_bytes()[:12]


def test_record_from_an_eye_without_arrows(tmp_path, monkeypatch):
    make, made = record.make_single_env, {}

    def kept(env, **arguments):
        made.update(arguments)
        return make(env, max_episode_steps=2, **arguments)

    monkeypatch.setattr(record, "make_single_env", kept)
    options = ("--baseline", "random", "--episodes", 1, "--out", tmp_path / "video.gif")
    result = run(record, *options, "--eye", 0, 12, 20, "--no-arrows")
    assert result.exit_code == 0, result.output
    assert made["camera"].eye == (0.0, 12.0, 20.0)
    assert made["arrows"] is False
    result = run(record, *options, "--target", 0, 1, 0)
    assert result.exit_code == 2
    assert "--target is (0.0, 1.0, 0.0) without --eye" in result.output


def test_video_without_ffmpeg_is_a_gif(tmp_path, monkeypatch):
    make = record.make_single_env
    monkeypatch.setattr(record, "make_single_env", lambda env, **kw: make(env, max_episode_steps=5, **kw))
    monkeypatch.setattr(record, "_has_ffmpeg", lambda: False)
    result = run(record, "--baseline", "random", "--episodes", 1, "--out", tmp_path / "video.mp4")
    assert result.exit_code == 0, result.output
    assert [path.name for path in tmp_path.iterdir()] == ["video.gif"]


@pytest.mark.parametrize(
    ("module", "arguments", "message"),
    [
        (train, ("--env", "CartPole-v1"), "env is 'CartPole-v1'; allowed are"),
        (train, ("--algo", "dqn"), "algo is 'dqn'; allowed"),
        (train, ("--target", "1.5"), "target is 1.5; allowed"),
        (train, ("--num-envs", "0"), "num_envs is 0; allowed"),
        (train, ("--seed", "-1"), "'--seed': -1; allowed are numbers from 0 on"),
        (train, ("--accuracy", "sloppy"), "'--accuracy': 'sloppy'; allowed are fast"),
        (train, ("--resume", "nowhere"), "run is 'nowhere'; allowed is the folder of a run"),
        (train, ("--resume", "nowhere", "--seed", "1"), "seed cannot change with --resume; allowed are target"),
        (train, ("--max-steps", "many"), "-max-steps"),
        (evaluate, (), "either the folder of a run or --baseline"),
        (evaluate, ("somewhere", "--baseline", "random"), "either the folder of a run or --baseline"),
        (evaluate, ("nowhere",), "run is 'nowhere'; allowed is the folder of a run"),
        (evaluate, ("--baseline", "clever"), "baseline is 'clever'; allowed are"),
        (evaluate, ("--baseline", "random", "--env", "Nothing-v7"), "'Nothing-v7', which is not there; allowed are"),
        (evaluate, ("--baseline", "random", "--episodes", "0"), "episodes is 0; allowed"),
        (record, ("--baseline", "random", "--out", "video.avi"), "video.avi'; allowed are files named"),
        (evaluate, ("--baseline", "random", "--json", "x.txt"), "'x.txt' ends in '.txt'; allowed is .json"),
    ],
)
def test_errors_name_the_field(module, arguments, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = run(module, *arguments)
    assert result.exit_code == 2
    assert message in result.text
    assert list(tmp_path.iterdir()) == []
