"""Second process that compiles the kernels of a run."""

import json
import subprocess
import sys
from dataclasses import asdict, replace

import pytest

from agents.compile_ahead import SWITCH, compile_ahead
from agents.config import make_config

CONFIG = replace(make_config("rigid_env/BlockReach-v0", "ppo", 0), num_envs=4)
STEP = """
import json, sys
from agents.config import RunConfig
from agents.environments import warm_kernels
warm_kernels(RunConfig(**json.loads(sys.argv[1])))
"""


@pytest.mark.exhaustive  # compiles: 12 s
def test_what_the_second_process_compiles_the_first_one_only_loads(monkeypatch, tmp_path):
    monkeypatch.setenv(SWITCH, "1")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert compile_ahead(CONFIG).wait(timeout=200.0) == 0
    run = [sys.executable, "-c", STEP, json.dumps(asdict(CONFIG))]
    assert subprocess.run(run, capture_output=True, text=True, check=True).stderr == ""


def test_it_fails_without_a_word(monkeypatch, capfd):
    """The first process tells the error."""
    monkeypatch.setenv(SWITCH, "1")
    assert compile_ahead(replace(CONFIG, env="rigid_env/Nothing-v0")).wait(timeout=60.0) == 1
    assert capfd.readouterr() == ("", "")


def test_the_switch_turns_it_off(monkeypatch):
    monkeypatch.setenv(SWITCH, "0")
    assert compile_ahead(CONFIG) is None
    monkeypatch.setenv(SWITCH, "no")
    with pytest.raises(ValueError, match="RIGID_ENV_COMPILE_AHEAD is 'no'; allowed are 0, 1"):
        compile_ahead(CONFIG)
