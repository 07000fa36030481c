"""The tables in the docstrings hold what the spaces hold."""

from __future__ import annotations

import inspect
import re

import gymnasium as gym
import numpy as np
import pytest

from rigid_env.envs.block_reach import BlockReachEnv
from rigid_env.envs.registration import MAX_EPISODE_STEPS
from rigid_env.tasks import block as base
from rigid_env.tasks import kernels
from rigid_env.tasks.block import BlockTask

SECTIONS = [
    "Description", "Action Space", "Observation Space", "Rewards", "Starting State", "Episode End",
    "Arguments", "Version History",
]  # fmt: skip


def section(doc: str, title: str) -> str:
    return re.search(rf"## {title}\n(.*?)(?=\n *## |\Z)", doc, re.S).group(1)


def table(text: str) -> list[list[str]]:
    """Rows of the Markdown table in `text`, without its head."""
    rows = [line.strip().strip("|").split("|") for line in text.splitlines() if line.strip().startswith("|")]
    return [[cell.strip() for cell in row] for row in rows[2:]]


def check_rows(rows, space):
    assert [int(row[0]) for row in rows] == list(range(space.shape[0]))
    np.testing.assert_array_equal(np.array([float(row[2]) for row in rows], np.float32), space.low)
    np.testing.assert_array_equal(np.array([float(row[3]) for row in rows], np.float32), space.high)


def test_sections_stand_in_gymnasiums_order(env_class):
    assert re.findall(r"^ *## (.+)$", env_class.__doc__, re.M) == SECTIONS


def test_observation_table(env_class):
    env = env_class()
    rows = table(section(env_class.__doc__, "Observation Space"))
    check_rows(rows, env.observation_space)
    assert [(row[1], row[4]) for row in rows] == [(entry.name, entry.unit) for entry in env.task.observation]
    assert f"`Box` of {len(rows)} float32" in env_class.__doc__


def test_action_table(env_class):
    env = env_class()
    rows = table(section(env_class.__doc__, "Action Space"))
    check_rows(rows, env.action_space)
    force, torque = f"{base.FORCE_SHARE:g} m g", f"{base.TORQUE_SHARE:g} m g a"
    assert [row[4] for row in rows] == [force] * 3 + [torque] * 3


def test_numbers_in_rewards_and_episode_end(env_class):
    doc = env_class.__doc__
    rewards, end = " ".join(section(doc, "Rewards").split()), " ".join(section(doc, "Episode End").split())
    reach = env_class is BlockReachEnv
    if reach:
        k = kernels
        assert f"-{k.REACH_VALUE:g} d - {k.BRAKE_VALUE:g} v exp(-d / {k.BRAKE_RANGE:g}) + h" in rewards
        assert f"at most {k.REACH_TOLERANCE:g} m," in end
    else:
        k = kernels
        assert f"-{k.TURN_VALUE:g} a - {k.CALM_VALUE:g} (v + w) exp(-a / {k.CALM_RANGE:g}) + h" in rewards
        assert f"at most {k.REORIENT_TOLERANCE:g} rad," in end
    assert f"costs {kernels.STEP_COST:g} and {kernels.ACTION_COST:g} times" in rewards
    assert f"Success earns {kernels.SUCCESS_BONUS:g}" in rewards
    assert f"speed of at most {kernels.REST_SPEED:g} m/s and a spin of at most {kernels.REST_SPIN:g} rad/s" in end
    assert f"on {kernels.HOLD_STEPS} control steps in a row" in end
    steps = env_class.task_class.max_episode_steps
    assert MAX_EPISODE_STEPS[env_class.task_class.__name__] == steps
    assert f"after {steps} control steps ({steps * env_class().task.control_dt:g} s)" in end
    assert kernels.HOLD_VALUE == 1.0  # the "+ h" above


def test_observation_scales_are_the_documented_units():
    units = {"5 m": kernels.LENGTH_SCALE, "2.5 m": kernels.HEIGHT_SCALE}
    units |= {"5 m/s": kernels.SPEED_SCALE, "5 rad/s": kernels.SPIN_SCALE}
    assert all(float(unit.split()[0]) == scale for unit, scale in units.items())
    assert kernels.GAP_SCALE == kernels.LENGTH_SCALE
    assert kernels.NEAR_SCALE == 1.0


def test_argument_table_holds_the_defaults():
    rows = {row[0].strip("`"): row[1].strip("`") for row in table(section(BlockReachEnv.__doc__, "Arguments"))}
    defaults = {
        name: parameter.default
        for owner in (BlockTask.__init__, BlockReachEnv.__init__)
        for name, parameter in inspect.signature(owner).parameters.items()
        if parameter.default is not inspect.Parameter.empty and name != "worlds"
    }
    assert rows.keys() == defaults.keys()
    assert {name: ast_literal(text) for name, text in rows.items()} == defaults


def ast_literal(text: str):
    import ast

    return ast.literal_eval(text)


@pytest.mark.parametrize("key", ["speed", "spin", "physics_status", "is_success"])
def test_info_holds_what_the_docstring_names(env_class, key):
    env = env_class()
    _, info = env.reset(seed=0)
    assert key in info
    named = set(re.findall(r"`(\w+)`", section(env_class.__doc__, "Episode End").split("`info` holds")[1]))
    assert set(info) <= named
    assert isinstance(env, gym.Env)
