"""Trained policies that come with the package: small, of NumPy alone, and as good as their pages say."""

from __future__ import annotations

import json
import math
import subprocess
import sys

import numpy as np
import pytest
from typer.testing import CliRunner

import rigid_env
from rigid_env.cli import app
from rigid_env.envs.pretrained import FOLDER, is_id, pretrained_ids, pretrained_path
from tests.tiers.sweep import sweep

LARGEST = 100_000  # of a file [bytes]
EPISODES = 200
REACH = "rigid_env/BlockReach-v0"


@pytest.mark.parametrize("env_id", pretrained_ids())
def test_a_policy_is_small_and_acts_within_bounds(env_id):
    path = pretrained_path(env_id)
    assert path.stat().st_size <= LARGEST
    policy = rigid_env.load_policy(env_id)
    actions = policy(np.random.default_rng(0).normal(size=(5, policy.inputs)))
    assert actions.dtype == np.float32
    assert np.abs(actions).max() <= 1.0


def quick(env_id: str) -> bool:
    """Answer whether the default tier runs episodes: balls need kernels of their own, pushes take long."""
    return not any(name in env_id for name in ("Ball", "Push-"))


@pytest.mark.parametrize("env_id", sweep(pretrained_ids(), quick))
def test_a_policy_is_as_good_as_its_page_says(env_id):
    """200 episodes have a deviation of sqrt(p (1 - p) / 200); four of them, and those of the rate itself."""
    pytest.importorskip("stable_baselines3")
    from agents.evaluate import evaluation_seeds, run_episodes
    from agents.suite import RESULTS, read_results

    found, _ = read_results(RESULTS, env_id)
    told = max(each["evaluation"]["success_rate"] for each in found if each["is_default"])
    done = run_episodes(env_id, rigid_env.load_policy(env_id), evaluation_seeds(7, EPISODES), accuracy="balanced")
    spread = math.sqrt(max(told * (1 - told), 0.01) * (1 / EPISODES + 1 / 1000))
    assert done.success.mean() >= told - 4 * spread


def test_a_policy_needs_no_library_of_agents():
    code = (
        "import sys; sys.modules['torch'] = sys.modules['stable_baselines3'] = None; import gymnasium, rigid_env;"
        f"env = gymnasium.make({REACH!r}); obs, _ = env.reset(seed=0);"
        f"print(env.step(rigid_env.load_policy({REACH!r})(obs[None])[0])[0].shape)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "(24,)"


def test_an_environment_without_a_policy_is_refused_with_those_that_have_one():
    with pytest.raises(
        ValueError, match=r"env is 'rigid_env/BlockFly-v0', for which there is no trained policy; allowed are .*Reach"
    ):
        rigid_env.load_policy("rigid_env/BlockFly-v0")
    done = CliRunner().invoke(app, ["play", "rigid_env/BlockFly-v0"])
    assert done.exit_code == 2
    assert "no trained policy" in " ".join(done.output.split())


def test_an_id_without_its_namespace_is_answered_with_the_id():
    with pytest.raises(ValueError, match=r"'BlockReach-v0', which is no file; .* as rigid_env/BlockReach-v0, "):
        rigid_env.load_policy("BlockReach-v0")


def test_what_is_an_id():
    assert is_id(REACH)
    assert is_id(f"rigid_env:{REACH}")
    assert not is_id("policies/BlockReach-v0.npz")
    assert not is_id("BlockReach-v0")
    assert pretrained_path(f"rigid_env:{REACH}") == FOLDER / "BlockReach-v0.npz"


@pytest.mark.interpreted
def test_play_writes_a_video(tmp_path):
    pytest.importorskip("PIL")
    from PIL import Image

    path = tmp_path / "reach.gif"
    done = CliRunner().invoke(app, ["play", REACH, "--episodes", "1", "--seed", "3", "--video", str(path)])
    assert done.exit_code == 0, done.output
    assert "success after" in done.output
    with Image.open(path) as film:
        assert film.n_frames > 20


def test_every_policy_has_its_results():
    from agents.suite import RESULTS

    names = {path.stem for path in FOLDER.glob("*.npz")}
    assert names <= {json.loads(path.read_text())["env"].rpartition("/")[2] for path in RESULTS.glob("*.json")}
