"""Pages of environments: each is what the program would write."""

from __future__ import annotations

import json

import pytest

pytest.importorskip("stable_baselines3")

from benchmarks import environment_pages as program
from benchmarks import page_results
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
    judged = {name: evaluation(0.9) for name in page_results.PRESETS}
    machine = {
        "processor": "some", "cores": 2, "python": "3.11", "git": None, "date": "today", "versions": {},
        "load_average": 3.0,
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
    assert "| fast | 2 | 90.0 ± 1.0 | 90.0 ± 1.0 | 90.0 ± 1.0 | 90.0 ± 1.0 |" in text
    assert "| balanced, tolerance 0.001 | 0 |" in text
    assert "No agent was trained at `precise`." in text
    assert "load average of 3.0 to 3.0 on 2 cores" in text
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


def test_a_policy_of_the_package_is_named_so(tmp_path):
    file, judged = tmp_path / "twins.json", {"ours": evaluation(0.9), "default": evaluation(0.4)}
    rows = [{"env": CURL, "policy": "BlockCurl-v0", "judged": judged}]
    file.write_text(json.dumps({"episodes": 50, "settings": {"default": {}}, "rows": rows}), encoding="utf-8")
    assert "| that of the package | 90.0%" in program._elsewhere(CURL, file)


def test_a_page_gives_a_reason_only_for_what_is_missing(monkeypatch):
    monkeypatch.setitem(page_results.WHY_MISSING, CURL, "Because.")
    monkeypatch.setitem(page_results.ABOUT_ACCURACIES, CURL, "A note.")
    judged = {name: evaluation(0.9) for name in page_results.PRESETS}
    base = {"accuracy": {"tolerance": 1e-3}, "seed": 0, "is_default": True}
    others = [{"accuracy": name, "seed": 0, "is_default": False, "judged": judged} for name in ("fast", "precise")]
    *_, reason, note = page_results._accuracies(CURL, [{**base, "judged": judged}, *others])
    assert (reason, note) == ("", "A note.")
    *_, reason, note = page_results._accuracies(CURL, [{**base, "judged": judged}, others[0]])
    assert (reason, note) == ("No agent was trained at `precise`. Because.", "A note.")
    *_, reason, note = page_results._accuracies(CURL, [{**base, "judged": {}}, *others])
    assert reason == "Not judged at other presets: seed 0. Because."
    assert page_results._accuracies(CURL, [{**base, "judged": {}}]) == [
        "No agent has been judged at other presets. Because.", "",
    ]  # fmt: skip


def test_a_page_tells_the_policy_of_the_package(tmp_path, monkeypatch):
    row = {"env": CURL, "algo": "ppo", "seed": 3, "evaluation": {**evaluation(0.9), "episodes": 1000}}
    monkeypatch.setattr(page_results, "read_shipped", lambda: {CURL: row})
    told = page_results._policy(CURL)
    assert "It is that of ppo, seed 3. It solves 90.0% (89.0 to 91.0) of 1,000 further episodes" in told
    monkeypatch.setattr(page_results, "read_shipped", lambda: {CURL: {**row, "seed": None}})
    assert "It comes from another run" in page_results._policy(CURL)
    monkeypatch.setattr(page_results, "read_shipped", dict)
    assert (
        page_results._policy(CURL)
        == "A trained policy comes with the package: `rigid-env play rigid_env/BlockCurl-v0`."
    )
    assert page_results._policy("rigid_env/Scene-v0") == ""
