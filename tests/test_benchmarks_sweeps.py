"""The benchmark of sweeps: what it measures is what it says."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

pytest.importorskip("stable_baselines3")

from benchmarks import sweeps


def test_trials_differ_by_their_seeds_and_never_end_early():
    trials = sweeps.trials_of(3, 5000)
    assert [trial.config.seed for trial in trials] == [0, 1, 2]
    assert all(trial.config.target == 1.0 and trial.config.max_steps == 5000 for trial in trials)


@pytest.mark.exhaustive
def test_it_measures_and_writes(tmp_path):
    out = tmp_path / "sweeps.json"
    command = [sys.executable, "-m", "benchmarks.sweeps", "--trials", "2", "--steps", "1000", "--json", str(out)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = json.loads(out.read_text())
    assert set(found["seconds"]) == {"1", "2"}
    one, two = (found["seconds"][count][0] for count in ("1", "2"))
    assert found["efficiency"] == pytest.approx(one / (2 * two))
    assert found["bytes_per_checkpoint"] > 1000
    assert 0 < found["seconds_per_empty_job"]["local"] < 1
