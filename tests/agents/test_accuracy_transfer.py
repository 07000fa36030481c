"""Training at one accuracy, judged at another: what is trained, what is not trained again, what is refused."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from rich.console import Console

pytest.importorskip("stable_baselines3")

from agents import accuracy_transfer as module
from agents.config import RunFolder
from agents.curve import plot_transfer


@pytest.fixture
def tiny_ppo(tiny):
    """The small PPO run, at `fast`."""
    if tiny.algo != "ppo":
        pytest.skip("one algorithm is enough")
    return replace(tiny, accuracy="fast", evaluation_accuracy="fast")


@pytest.mark.train
def test_policies_are_judged_at_their_own_accuracy_and_at_the_truth(tiny_ppo, tmp_path, monkeypatch):
    judged = []

    def evaluate(env, policy, episodes, seed, **arguments):
        judged.append((arguments["accuracy"], episodes, seed))
        return {"success_rate": 0.5, "interval": [0.4, 0.6]}

    monkeypatch.setattr(module, "evaluate", evaluate)
    run = RunFolder(tmp_path / "run")
    first = module.transfer(tiny_ppo, run, 7, Console(quiet=True))
    assert judged == [("fast", 7, tiny_ppo.seed), (module.TRUTH, 7, tiny_ppo.seed)]
    assert first.steps == tiny_ppo.max_steps
    assert not first.is_target_reached
    seconds = json.loads(run.result.read_text())["training_seconds"]
    monkeypatch.setattr(module, "train", None)  # a second call must not train
    assert module.transfer(tiny_ppo, run, 7, Console(quiet=True)).training_seconds == seconds


@pytest.mark.train
def test_a_folder_of_another_run_is_refused(tiny_ppo, tmp_path):
    run = RunFolder(tmp_path / "run")
    module.trained(tiny_ppo, run, Console(quiet=True))
    with pytest.raises(ValueError, match="another configuration"):
        module.trained(replace(tiny_ppo, seed=99), run, Console(quiet=True))


def test_unknown_accuracies_are_named():
    with pytest.raises(ValueError, match="accuracies has 'sloppy'; allowed are fast, balanced, precise, reference"):
        module.parse_accuracies("fast, sloppy")


def test_table_has_a_row_per_accuracy():
    seen = {"success_rate": 0.9, "interval": [0.88, 0.92]}
    rows = [module.Transfer(name, 10.0, 1_000_000, True, seen, seen) for name in ("fast", "balanced")]
    assert module.make_table("rigid_env/BlockReach-v0", rows).row_count == 2


def test_picture_has_a_mark_per_accuracy(tmp_path):
    pytest.importorskip("matplotlib")
    seen = {"success_rate": 0.9, "interval": [0.88, 0.92]}
    few = [module.Transfer("fast", 10.0, 1_000_000, True, seen, seen)]
    more = [*few, module.Transfer("precise", 100.0, 1_000_000, True, seen, seen)]
    for name, rows in (("few", few), ("more", more)):
        plot_transfer(rows, "a title", tmp_path / f"{name}.png")
    assert (tmp_path / "few.png").read_bytes() != (tmp_path / "more.png").read_bytes()
