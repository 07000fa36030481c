"""The soak: a recording that breaks a law becomes smaller, and the judge of rewards knows what was not earned."""

from __future__ import annotations

import json
import subprocess
import sys

import gymnasium as gym
import numpy as np
import pytest

import physics
from benchmarks import soak_spread
from benchmarks.shrink import law_broken, shrink
from benchmarks.soak_env import Judge, Pusher
from rigid_env.launchers.job import Ended
from tests.physics.test_bodies import heap


def test_a_failure_shrinks_to_its_last_step_and_the_body_that_it_takes():
    world = heap(2)
    recorder = physics.Recorder(world, keep=50)
    load = world.no_wrench()
    for k in range(20):
        load[:] = 0.1
        load[1, 2, 3:] = 1e308 if k == 13 else 0.1  # the third body's spin overflows
        world.step(load)
    recording = recorder.recording(1)
    assert "not finite" in law_broken(recording)
    small = shrink(recording)
    assert "not finite" in law_broken(small)
    assert len(small) < len(recording)
    assert len(small.scene.bodies) == 2
    assert 0.7 in small.scene.bodies[-1].size
    assert small.replay().is_identical


def test_a_recording_that_breaks_no_law_says_so():
    world = heap(1)
    recorder = physics.Recorder(world)
    world.step(steps=10)
    assert law_broken(recorder.recording()) == ""


def test_the_judge_knows_rewards_that_were_not_earned():
    for name in ("rigid_env/BlockReach-v0", "rigid_env/BlockReorient-v0"):
        envs = gym.make_vec(name, num_envs=6, autoreset_mode="Disabled")
        envs.reset(seed=0)
        judge, pusher = Judge(envs.unwrapped.task), Pusher(np.random.default_rng(0), 6)
        for k in range(40):
            action = pusher.action()
            obs, reward, terminated, *_ = envs.step(action)
            wrong = judge.wrongs(envs, obs, reward + (1e-3 if k == 20 else 0.0), terminated ^ (k == 30), action)
            assert wrong == {20: {"reward not earned": 6}, 30: {"success not earned": 6}}.get(k, {})


def test_what_many_processes_found_is_added_up():
    def one(worlds, failures):
        return {
            "mixed": {
                "worlds": worlds,
                "steps": 2 * worlds,
                "failures": failures,
                "largest_gain": worlds / 100,
                "told": 3,
                "left_after_told": 0,
            }
        }

    found, errors = soak_spread.merge(
        [
            Ended("a", ("fast", one(200, {"inside": 1}))),
            Ended("b", ("fast", one(400, {"inside": 2, "energy": 1}))),
            Ended("c", None, "its process ended"),
        ]
    )
    whole = {
        "worlds": 600,
        "steps": 1200,
        "failures": {"inside": 3, "energy": 1},
        "largest_gain": 4.0,
        "told": 6,
        "left_after_told": 0,
    }
    assert found == {"fast": {"mixed": whole}}
    assert errors == ["c: its process ended"]


@pytest.mark.exhaustive
def test_the_soak_runs_in_many_processes(tmp_path):
    command = [sys.executable, "-m", "benchmarks.soak", "--minutes", "0.01", "--launcher", "local", "--seeds", "2"]
    out = tmp_path / "soak.json"
    done = subprocess.run([*command, "--json", str(out)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    content = json.loads(out.read_text())
    assert content["seeds"] == 2
    assert all(family["worlds"] >= 400 for family in content["found"]["balanced"].values())


@pytest.mark.exhaustive
def test_the_soak_runs_and_writes_what_it_found(tmp_path):
    command = [sys.executable, "-m", "benchmarks.soak", "--minutes", "0.02", "--env", "rigid_env/BlockReach-v0"]
    out = tmp_path / "soak.json"
    done = subprocess.run(
        [*command, "--accuracy", "balanced", "--json", str(out), "--keep", str(tmp_path / "keep")],
        capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    content = json.loads(out.read_text())
    found = content["found"]["rigid_env/BlockReach-v0 balanced"]
    assert found["steps"] > 0
    assert found["wrong"] == {}
    assert content["machine"]["git"] is None or content["machine"]["git"]["commit"]
