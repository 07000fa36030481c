"""Whole runs: begun once, gone on with wherever they were ended, kept apart; and settings by dotted names."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor

import pytest
from rich.console import Console

pytest.importorskip("stable_baselines3")

from agents import run as runs
from agents.config import RunFolder, change, make_config, make_folder
from agents.run import run_or_resume
from agents.settings import apply_settings, parse_settings
from agents.supervisor import Supervisor
from agents.training import Interrupted
from tests.agents.conftest import TINY_ALGORITHMS
from tests.tiers.sweep import sweep

QUIET = Console(quiet=True)
TIMES = {"run", "training_seconds", "steps_per_second", "total_seconds", "evaluation_seconds"}

ppo_alone = pytest.mark.parametrize("tiny", sweep(TINY_ALGORITHMS, ("ppo",)), indirect=True)


@pytest.fixture(autouse=True)
def short(monkeypatch):
    monkeypatch.setattr(runs, "EVALUATION_EPISODES", 4)


def without_times(result) -> str:
    kept = {key: value for key, value in result.items() if key not in TIMES}
    kept["evaluation"] = {key: value for key, value in result["evaluation"].items() if "second" not in key}
    return json.dumps(kept)  # nan equals nan there


@ppo_alone
def test_ctrl_c_before_the_first_step_says_so_and_leaves_no_folder(tiny, tmp_path, monkeypatch):
    def interrupted(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr("agents.training.make_training_env", interrupted)
    with pytest.raises(Interrupted, match="before the first checkpoint"):
        run_or_resume(tiny, tmp_path / "run", console=QUIET)
    assert not (tmp_path / "run").exists()


def test_a_run_goes_on_wherever_it_was_ended(tiny, tmp_path, monkeypatch):
    tiny = change(tiny, env_kwargs={"max_episode_steps": 5, **tiny.env_kwargs})
    straight = run_or_resume(tiny, tmp_path / "straight", console=QUIET)
    folder = tmp_path / "ended"
    with monkeypatch.context() as patch:  # in training
        patch.setattr("agents.supervisor.CHECKPOINT_EVERY", 0.0)
        patch.setattr("agents.supervisor.CHECKPOINT_SHARE", float("inf"))
        on_step = Supervisor._on_step

        def stop_late(supervisor):
            if supervisor.num_timesteps >= tiny.max_steps - tiny.num_envs:
                raise KeyboardInterrupt
            return on_step(supervisor)

        patch.setattr(Supervisor, "_on_step", stop_late)
        with pytest.raises(Interrupted):
            run_or_resume(tiny, folder, console=QUIET)

    def killed(*arguments, **options):
        raise SystemExit

    with monkeypatch.context() as patch:  # between training and evaluation
        patch.setattr(runs, "evaluate", killed)
        with pytest.raises(SystemExit):
            run_or_resume(tiny, folder, console=QUIET)
    assert not RunFolder(folder).result.exists()
    with monkeypatch.context() as patch:  # training is over: none is done
        patch.setattr("stable_baselines3.PPO.learn", killed)
        result = run_or_resume(tiny, folder, console=QUIET)
    assert without_times(result) == without_times(straight)
    monkeypatch.setattr(runs, "train", killed)  # complete: read
    assert run_or_resume(tiny, folder, console=QUIET) == json.loads(RunFolder(folder).result.read_text("utf-8"))


@ppo_alone
def test_a_complete_run_trains_on_to_a_larger_limit(tiny, tmp_path):
    run_or_resume(tiny, tmp_path / "run", console=QUIET)
    longer = run_or_resume(change(tiny, max_steps=2 * tiny.max_steps), tmp_path / "run", console=QUIET)
    assert longer["steps"] == 2 * tiny.max_steps


@ppo_alone
def test_checkpoints_are_told_and_may_end_training(tiny, tmp_path):
    seen = []

    class Pruned(Exception):
        pass

    def told(folder, point):
        seen.append((folder.name, point.steps))
        if point.steps > 0:
            raise Pruned

    with pytest.raises(Pruned):
        run_or_resume(tiny, tmp_path / "run", on_checkpoint=told, console=QUIET)
    assert seen[0] == (f"{0:012d}", 0)
    assert int(seen[-1][0]) == seen[-1][1] > 0


@ppo_alone
def test_a_folder_of_other_settings_or_of_another_process_is_refused(tiny, tmp_path, monkeypatch):
    run = RunFolder(tmp_path / "run")
    run_or_resume(tiny, run.path, console=QUIET)
    with pytest.raises(ValueError, match=r"seed is 4, and 3 in .* allowed to change .* target, max_steps, threads"):
        run_or_resume(change(tiny, seed=4), run.path, console=QUIET)
    before = run.config.read_bytes()
    with run.locked(), pytest.raises(ValueError, match="which another process works on"):
        run_or_resume(change(tiny, max_steps=10**6), run.path, console=QUIET)
    assert run.config.read_bytes() == before


def test_runs_started_in_the_same_second_have_folders_of_their_own(tmp_path, monkeypatch):
    monkeypatch.setattr("time.strftime", lambda form: "20260101-000000")
    config = make_config("rigid_env/BlockReach-v0", "ppo", seed=0)
    with ThreadPoolExecutor(8) as pool:
        made = list(pool.map(lambda _: make_folder(tmp_path, config).path, range(16)))
    assert len(set(made)) == 16
    assert sorted(made) == sorted(tmp_path.iterdir())


def test_settings_reach_anything_that_the_configuration_holds():
    config = make_config("rigid_env/BlockReach-v0", "ppo", seed=0)
    texts = ["algorithm.learning_rate=3e-4", "algorithm.policy_kwargs.net_arch=[32, 32]", "max_steps=100",
             "env_kwargs.half_width=4", "accuracy=fast", "algorithm.learning_rates={start: 1e-3, end: 0}"]  # fmt: skip
    changed = apply_settings(config, parse_settings(texts))
    assert changed.algorithm["learning_rate"] == 3e-4
    assert changed.algorithm["policy_kwargs"] == {**config.algorithm["policy_kwargs"], "net_arch": [32, 32]}
    assert changed.algorithm["learning_rates"] == {"start": 1e-3, "end": 0}
    assert (changed.max_steps, changed.env_kwargs["half_width"], changed.accuracy) == (100, 4, "fast")
    assert config == make_config("rigid_env/BlockReach-v0", "ppo", seed=0)  # itself unchanged


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("learning_rate", "--set is 'learning_rate'; allowed is NAME=VALUE"),
        ("max_step=3", "max_step is no setting of a run; allowed are max_steps"),
        ("max_steps=few", "max_steps is 'few'; allowed are integers"),
        ("max_steps.x=1", "max_steps.x is 1; allowed are entries of algorithm, env_kwargs"),
        ("env=other", "--set names env; allowed is to name the environment"),
        ("env_kwargs=3", "env_kwargs is 3; allowed is a dict"),
        ("evaluation_accuracy=quick", "evaluation_accuracy is 'quick'; allowed are fast"),
        ("algorithm.=1", "algorithm. is 1; allowed are entries"),
        ("algorithm.gamma=[1", "algorithm.gamma is .*; allowed is YAML"),
    ],
)
def test_settings_that_are_none_name_what_is_allowed(text, message):
    config = make_config("rigid_env/BlockReach-v0", "ppo", seed=0)
    with pytest.raises(ValueError, match=message.replace("[", r"\[") if "YAML" not in message else message):
        apply_settings(config, parse_settings([text]))


@ppo_alone
@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("algorithm.learning_rat=1", "algorithm.learning_rat is no argument of ppo; allowed are learning_rate,"),
        ("env_kwargs.half_widht=1", "half_widht"),
        ("algorithm.learning_rate=abc", "which ppo refuses: "),
        ("algorithm.policy_kwargs.net_arh=[3]", "which ppo refuses: .*net_arh"),
    ],
)
def test_a_run_that_cannot_begin_leaves_nothing(tiny, tmp_path, text, message):
    config = apply_settings(tiny, parse_settings([text]))
    with pytest.raises(ValueError, match=message):
        run_or_resume(config, tmp_path / "runs" / "run", console=QUIET)
    assert list(tmp_path.iterdir()) == []
