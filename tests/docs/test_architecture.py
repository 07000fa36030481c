"""The map of the folders against the folders, and against the import contracts."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

import rigid_env  # noqa: F401 (registers the environments)
from physics.world.snapshot import KEPT

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
RECIPES = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")


def listed(heading: str) -> list[str]:
    """Folders in the table below a heading, from top to bottom."""
    part = PAGE.split(f"## {heading}", 1)[1].split("\n## ", 1)[0]
    return re.findall(r"^\| `(\w+)` \|", part, re.M)


@pytest.mark.parametrize(
    ("heading", "folder"),
    [("`physics`: ", "physics"), ("`physics/kernels`: ", "physics/kernels"), ("`rigid_env`", "rigid_env")],
)
def test_it_lists_every_folder_in_the_order_of_the_levels(heading, folder):
    folders = {path.parent.name for path in (ROOT / folder).glob("*/__init__.py")}
    assert set(listed(heading)) == folders
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
        "contracts"
    ]
    (levels,) = (each["layers"] for each in contracts if each.get("containers") == [folder.replace("/", ".")])
    assert listed(heading) == [name for name in levels if name in folders]


@pytest.mark.parametrize("page", [PAGE, RECIPES], ids=["map", "recipes"])
def test_files_that_it_names_are_there(page):
    named = re.findall(r"`((?:physics|rigid_env)/[\w/]+\.py)`", page)
    assert len(named) >= 7
    new = re.findall(r"^# new file: (.+)$", page, re.MULTILINE)
    assert [name for name in named if not (ROOT / name).is_file() and name not in new] == []


@pytest.fixture(scope="module")
def drawing():
    """The program `docs/images/architecture.py` as a module."""
    spec = importlib.util.spec_from_file_location("architecture", ROOT / "docs" / "images" / "architecture.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_picture_is_drawn_by_its_program(drawing):
    assert drawing.PICTURE.read_text(encoding="utf-8") == drawing.picture()


def test_the_picture_has_the_folders_in_the_order_of_the_page(drawing):
    drawn = {title.split(",")[0]: re.findall(r"\w+", " ".join(rows)) for title, _, rows in drawing.LAYERS}
    assert drawn["rigid_env"] == listed("`rigid_env`")
    assert [*drawn["physics"], "kernels", "compiler"] == listed("`physics`: ")
    assert drawn["physics/kernels"] == listed("`physics/kernels`: ")


def steps_of_the_page() -> list[tuple[str, str]]:
    """File and function of each numbered step from `Env.step` into the kernel."""
    part = PAGE.split("## From `Env.step`", 1)[1].split("\n## ", 1)[0]
    return re.findall(r"^\d\. `([\w/]+\.py)`, `([\w.]+)`", part, re.MULTILINE)


def test_a_step_goes_through_the_files_that_it_names():
    """Python calls of `Env.step` until it is in machine code, and the functions of that, by their own names."""
    env = gym.make("rigid_env/BlockReach-v0").unwrapped
    env.reset(seed=0)
    env.step(np.zeros(6))  # prepares the call
    events = []

    def note(frame, event, argument):
        path = frame.f_code.co_filename
        if event in ("call", "return") and path.startswith(str(ROOT)):
            events.append((event, Path(path).relative_to(ROOT).as_posix(), frame.f_code.co_name))

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        env.step(np.zeros(6))
    finally:
        sys.setprofile(before)
    steps = steps_of_the_page()
    named = [(path, function.split(".")[-1]) for path, function in steps]
    assert len(named) == 6
    prepared = events.index(("call", *named[2]))
    calls = [call for event, *call in events[: prepared + 1] if event == "call"]
    assert {path for path, _ in calls} <= {path for path, _ in named}
    assert [tuple(call) for call in calls if tuple(call) in named] == named[:3]
    in_machine_code = events[prepared + 1 : events.index(("return", *named[2]))]
    assert {path for _, path, _ in in_machine_code} <= {path for path, _ in named[3:]}
    for path, function in named[3:]:
        assert f"\ndef {function}(" in (ROOT / path).read_text(encoding="utf-8")


def test_it_names_all_that_a_snapshot_keeps():
    part = PAGE.split("## What stays between steps", 1)[1].split("A `Snapshot`", 1)[0]
    assert {f"World.{name}" for name in (*KEPT, "time", "actuation")} == set(re.findall(r"World\.\w+", part))
