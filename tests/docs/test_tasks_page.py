"""The page on tasks, run from its text: its blocks in their order, what they print, and its tables."""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import inspect
import io
import re
import sys
from dataclasses import dataclass
from types import ModuleType

import numpy as np
import pytest

from rigid_env import TaskEnv, check_task, tasks
from rigid_env.tasks import (
    Choice,
    Drive,
    Force,
    Gust,
    Impulse,
    LogUniform,
    Normal,
    Push,
    Uniform,
    Worlds,
    Wrench,
    observe,
)
from tests.docs.snippets import ROOT, program

PAGE = (ROOT / "docs" / "tasks.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"^```python\n(.*?)^```$(?:\n\n^```text\n(.*?)^```$)?", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Block:
    """A block of Python, and the block of text that says what it prints."""

    line: int
    code: str
    prints: str


BLOCKS = [Block(PAGE.count("\n", 0, m.start(1)) + 1, m[1], m[2] or "") for m in BLOCK.finditer(PAGE)]


@pytest.fixture(scope="module")
def printed(tmp_path_factory):
    """Text that each block printed, by its line, or the error that it ended with; all of them share a namespace."""
    module = ModuleType("tasks_page")  # copies by pickle find the classes in it
    sys.modules[module.__name__] = module
    source = tmp_path_factory.mktemp("page") / "tasks_page.py"  # where compilers of kernels find the source
    source.write_text(program(ROOT / "docs" / "tasks.md"), encoding="utf-8")
    found = {}
    for block in BLOCKS:
        if "stable_baselines3" in block.code and importlib.util.find_spec("stable_baselines3") is None:
            continue
        out = io.StringIO()
        try:
            with contextlib.redirect_stdout(out):
                exec(compile("\n" * (block.line - 1) + block.code, source, "exec"), vars(module))
            found[block.line] = out.getvalue()
        except Exception as error:  # told by the test of this block
            found[block.line] = error
    yield found
    del sys.modules[module.__name__]


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: f"line {block.line}")
def test_a_block_runs_and_prints_what_stands_below_it(block, printed):
    if block.line not in printed:
        pytest.skip("Stable-Baselines3 is not installed")
    if isinstance(printed[block.line], Exception):
        raise printed[block.line]
    assert printed[block.line] == block.prints


# --- tables ---------------------------------------------------------------------------------------------------


def rows(start: str) -> dict[str, str]:
    """First and second cell of the table that follows a line that starts with this text."""
    table = re.search(r"\n((?:\|.*\n)+)", PAGE[PAGE.index(f"\n{start}") :])[1]
    cells = [[cell.strip() for cell in line.strip("|\n").split("|")] for line in table.splitlines()[2:]]
    return {row[0].strip("`"): row[1].strip("`") for row in cells}


def call(thing) -> str:
    """A call as the page writes it: the name, and the parameters with their defaults."""
    parameters = [
        parameter.replace(annotation=inspect.Parameter.empty)
        for parameter in inspect.signature(thing).parameters.values()
    ]
    text = str(inspect.Signature(parameters)).replace(" = ", "=")
    return thing.__name__ + text


def test_the_tables_have_all_there_is():
    entries = [
        thing for thing in vars(observe).values()
        if inspect.isfunction(thing) and thing.__module__ == observe.__name__ and not thing.__name__.startswith("_")
    ]  # fmt: skip
    assert set(rows("**Entries")) == {call(entry) for entry in entries}
    assert set(rows("**Distributions**")) == {call(each) for each in (Uniform, LogUniform, Normal, Choice)}
    assert set(rows("**Ways")) == {call(way) for way in (Wrench, Force, Impulse, Drive)}
    assert set(rows("**Disturbances**")) == {call(each) for each in (Push, Gust)}
    told = {name.partition("(")[0] for start in ("**Distr", "**Ways", "**Disturb") for name in rows(start)}
    assert told == set(tasks.__all__) - {
        "BlockReach",
        "BlockReorient",
        "Distribution",
        "Entry",
        "Task",
        "Worlds",
        "compiled",
        "observe",
    }


def test_entries_have_the_numbers_that_are_told():
    for name, numbers in rows("**Entries").items():
        entry = getattr(observe, name.partition("(")[0])
        needed = {
            "drawn": ("goal",), "offset": (0, 1), "previous_action": (6,), "lidar": (0, ((1, 0, 0), (0, 1, 0)), 5.0),
        }.get(entry.__name__, ())  # fmt: skip
        arguments = inspect.signature(entry).bind(*needed)
        arguments.apply_defaults()
        given = arguments.arguments.get(numbers)
        count = int(numbers) if numbers.isdigit() else given if isinstance(given, int) else len(given)
        assert len(entry(*needed).names) == count


def test_worlds_are_told_in_full():
    told = {name for row in rows("`worlds` holds") for name in re.findall(r"\w+", row)}
    has = {name for name in vars(Worlds(tasks.BlockReach(1))) if not name.startswith("_")} - {"is_all"}
    has |= {name for name, value in vars(Worlds).items() if isinstance(value, property)}
    assert told == has


def test_the_pieces_make_the_whole():
    """The class that grows, section by section, and the one in one piece take the same episode, bit for bit."""
    pieces: dict = {}
    whole: dict = {}
    for block in BLOCKS:
        if "class Crate(Crate)" in block.code or not pieces:
            classes_only = re.split(r"^env|^obs", block.code, maxsplit=1, flags=re.M)[0]
            exec(classes_only, pieces)
        if block.code.startswith("# crate.py"):
            exec(block.code.replace("register_task(", "(lambda *_: None)("), whole)
    envs = [TaskEnv(namespace["Crate"]) for namespace in (pieces, whole)]
    for env in envs:
        env.reset(seed=5)
    for action in np.random.default_rng(5).uniform(-1, 1, (150, 2)):
        ours, theirs = (env.step(action) for env in envs)
        np.testing.assert_array_equal(ours[0], theirs[0])
        assert ours[1:4] == theirs[1:4]
        np.testing.assert_equal(ours[4], theirs[4])


@pytest.fixture
def puck(tmp_path, monkeypatch):
    """The module of the compiled example, as a user has it: a file of its own."""
    (code,) = (block.code for block in BLOCKS if block.code.startswith("# puck.py"))
    (tmp_path / "puck.py").write_text(code, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    yield importlib.import_module("puck")
    sys.modules.pop("puck")


def test_the_compiled_example_is_a_whole_task(puck):
    check_task(puck.Puck, contexts=())


def test_the_compiled_example_needs_public_names_only():
    (code,) = (block.code for block in BLOCKS if block.code.startswith("# puck.py"))
    imported = re.findall(r"^(?:from|import) (\S+)", code, re.MULTILINE)
    assert set(imported) == {"math", "physics", "rigid_env"}


def test_the_compiled_example_gives_what_its_functions_would(puck):
    """The closed form: a force of 0.3 m g for t on ice is a speed of 0.3 g t."""
    env = TaskEnv(puck.Puck)
    obs, info = env.reset(seed=3, options={"goal": 2.0})
    assert (obs[0], info["distance"]) == (np.float32(-0.4), 2.0)
    before = 2.0
    for k in range(1, 6):
        obs, reward, terminated, _, info = env.step([1.0])
        assert obs[1] * 5.0 == pytest.approx(0.3 * 9.81 * 0.025 * k, rel=1e-6)
        assert reward == info["reward_nearer"] == pytest.approx(before - info["distance"], abs=1e-12)
        assert not terminated
        before = info["distance"]
    env.reset(options={"goal": 0.05})
    assert env.step([0.0])[2]
