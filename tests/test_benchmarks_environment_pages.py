"""Pages of environments: each is what the program would write."""

from __future__ import annotations

import json

import pytest

pytest.importorskip("stable_baselines3")

from benchmarks import environment_pages as program
from benchmarks.environment_pages import all_ids, index, page, page_of
from tests.tiers.sweep import sweep

CURL = "rigid_env/BlockCurl-v0"


@pytest.mark.parametrize("env_id", sweep(all_ids(), [CURL, "rigid_env/BlockReach-v0"]))
def test_a_page_is_written_by_its_program(env_id):
    assert page_of(env_id).read_text(encoding="utf-8") == page(env_id)


def test_the_list_has_every_environment():
    assert (program.PAGES / "README.md").read_text(encoding="utf-8") == index()
    assert sorted(path.stem for path in program.PAGES.glob("*.md")) == sorted(
        ["README", *(env_id.rpartition("/")[2] for env_id in all_ids())]
    )


def evaluation(rate: float) -> dict:
    return {"success_rate": rate, "interval": [rate - 0.01, rate + 0.01]}


def test_a_page_tells_each_seed_the_floors_and_the_matrix(tmp_path):
    judged = {name: evaluation(0.9) for name in program.PRESETS}
    machine = {
        "processor": "some", "cores": 2, "python": "3.11", "git": None, "date": "today", "versions": {},
    }  # fmt: skip
    for seed, (rate, accuracy) in enumerate([(0.95, {"tolerance": 1e-3}), (0.97, {"tolerance": 1e-3}), (0.5, "fast")]):
        result = {
            "env": CURL, "algo": "ppo", "seed": seed, "evaluation": evaluation(rate), "steps": 10**6,
            "training_seconds": 12.0, "judged": judged, "accuracy": accuracy, "is_default": accuracy != "fast",
            "machine": machine, "curve": [],
        }  # fmt: skip
        (tmp_path / f"BlockCurl-v0-ppo-x{seed}-s{seed}.json").write_text(json.dumps(result), encoding="utf-8")
    floors = {"random": evaluation(0.02), "controller": evaluation(1.0)}
    (tmp_path / "BlockCurl-v0-floors.json").write_text(json.dumps({"floors": floors}), encoding="utf-8")
    text = page(CURL, tmp_path)
    assert "| ppo | 0 | 95.0% (94.0 to 96.0) | 1.00 | 12 |" in text
    assert "| random |  | 2.0% (1.0 to 3.0) |  |  |" in text
    assert "Interquartile mean of 2 seeds of ppo: 96.0%" in text
    assert "| fast | 2 | 90.0% | 90.0% | 90.0% | 90.0% |" in text
    assert "| tolerance 0.001 | 0 |" in text
    assert "## Observation Space" in text


def test_a_page_tells_the_success_in_mujoco(tmp_path):
    file, judged = tmp_path / "twins.json", {"ours": evaluation(0.9), "default": evaluation(0.4)}
    rows = [{"env": CURL, "policy": "some", "judged": judged}]
    file.write_text(json.dumps({"episodes": 50, "settings": {"default": {}}, "rows": rows}), encoding="utf-8")
    text = program._elsewhere(CURL, file)
    assert "Success of 50 episodes" in text
    assert "| policy | ours | MuJoCo, default |" in text
    assert "| some | 90.0% (89.0 to 91.0) | 40.0% (39.0 to 41.0) |" in text
    assert program._elsewhere("rigid_env/BallKick-v0", file) == ""
