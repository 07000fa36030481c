"""Files that others wrote are data: loading one never runs code. `SECURITY.md` says so, and names the exceptions."""

from __future__ import annotations

import ast
import base64
import contextlib
import importlib
import json
import pickle
import re
import zipfile
from pathlib import Path

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

import physics
import rigid_env
from rigid_env.cli import app
from rigid_env.envs.policy_files import Network, load_policy
from rigid_env.lab.tosses import data
from rigid_env.viewer.subject import open_subject

ROOT = Path(__file__).parents[2]


class Bomb:
    """An object whose pickle makes a file when it is loaded."""

    def __init__(self, marker: Path):
        self.marker = str(marker)

    def __reduce__(self):
        return open, (self.marker, "w")


@pytest.fixture
def marker(tmp_path):
    """A file that a bomb makes; it must not be there at the end."""
    path = tmp_path / "bomb-went-off"
    yield path
    assert not path.exists()


def test_the_bomb_works(tmp_path):
    pickle.loads(pickle.dumps(Bomb(tmp_path / "made"))).close()
    assert (tmp_path / "made").exists()


# archives of arrays


def snapshot(path):
    physics.World(physics.scenes.by_name("rest")).snapshot().save(path)


def state(path):
    env = rigid_env.BlockReachEnv()
    env.reset(seed=0)
    env.get_state().save(path)


def recording(path):
    world = physics.World(physics.scenes.by_name("rest"))
    recorder = physics.Recorder(world, keep=5)
    world.step(steps=2)
    recorder.save(path)


def trajectory(path):
    physics.simulate(physics.scenes.by_name("rest"), 0.05).to_npz(path)


def network(path):
    Network([(np.ones((2, 1)), np.ones(1))]).save(path)


def tosses(path):
    states = np.tile(np.eye(13)[3], (4, 1))
    np.savez(path, states=states, offsets=[0, 2, 4], source_index=[0, 1])


def viewed(path):
    return open_subject(str(path), accuracy=None, dt=None, seed=0, policy=None, controller=False)


KINDS = {
    "snapshot": (snapshot, physics.Snapshot.load),
    "state": (state, rigid_env.TaskState.load),
    "recording": (recording, physics.Recording.load),
    "trajectory": (trajectory, physics.Trajectory.from_npz),
    "network": (network, load_policy),
    "tosses": (tosses, data.load),
    "viewed recording": (recording, viewed),
    "viewed trajectory": (trajectory, viewed),
}


@pytest.mark.parametrize("kind", KINDS)
def test_an_archive_with_pickled_objects_is_refused(kind, tmp_path, marker):
    """Each array in turn is a bomb."""
    make, load = KINDS[kind]
    path = tmp_path / "file.npz"
    make(path)
    load(path)
    with np.load(path) as content:
        parts = dict(content)
    for name in parts:
        np.savez(path, **{**parts, name: np.array([Bomb(marker)], dtype=object)})
        with pytest.raises(ValueError, match="file"):
            load(path)


@pytest.mark.parametrize("kind", KINDS)
def test_a_pickle_in_place_of_an_archive_is_refused(kind, tmp_path, marker):
    path = tmp_path / "file.npz"
    path.write_bytes(pickle.dumps(Bomb(marker)))
    with pytest.raises(ValueError, match="file"):
        KINDS[kind][1](path)


JUNK = [None, 7, -1, 1.5, True, "x", [], ["x"], [None], [7], [[1]], {}, {"x": 1}, {"x": ["y"]}, [{"x": "y"}]]


def restored(snapshot):
    physics.World(physics.scenes.by_name("rest")).restore(snapshot)


def set_back(state):
    rigid_env.BlockReachEnv().set_state(state)


USES = {"snapshot": restored, "state": set_back, "recording": physics.Recording.world}


@pytest.mark.parametrize("kind", USES)
def test_an_edited_head_is_refused_by_its_field_or_does_no_harm(kind, tmp_path):
    make, load = KINDS[kind]
    path = tmp_path / "file.npz"
    make(path)
    with np.load(path) as content:
        parts = dict(content)
    head = json.loads(str(parts["head"]))
    refused = set()
    for name in head:
        for edited in (*({**head, name: value} for value in JUNK), {key: head[key] for key in head if key != name}):
            np.savez(path, **{**parts, "head": json.dumps(edited)})
            try:
                found = load(path)
            except ValueError as error:
                assert "file.npz" in str(error)  # noqa: PT017
                assert name in str(error) or name in ("kind", "scene"), str(error)  # noqa: PT017
                refused.add(name)
                continue
            with contextlib.suppress(ValueError):  # it may be of another task or scene
                USES[kind](found)
    assert refused == set(head) - {"version"}, "a name of no consequence"
    for text in ("7", "[]", "null", '"x"'):
        np.savez(path, **{**parts, "head": text})
        with pytest.raises(ValueError, match="its head has no"):
            load(path)


def test_arrays_of_a_state_without_a_row_for_each_world_are_refused(tmp_path):
    path = tmp_path / "file.npz"
    state(path)
    with np.load(path) as content:
        parts = dict(content)
    for wrong in (np.float64(1.0), np.zeros(3), np.zeros((0, 2))):
        for name in parts.keys() - {"head", "world"}:
            np.savez(path, **{**parts, name: wrong})
            with pytest.raises(
                ValueError, match=rf"file\.npz is no .*{name.removeprefix('held ')} has shape .*allowed"
            ):
                rigid_env.TaskState.load(path)


def test_the_command_line_refuses_them(tmp_path, marker):
    path = tmp_path / "file.npz"
    recording(path)
    with np.load(path) as content:
        np.savez(path, **{**content, "states": np.array([Bomb(marker)], dtype=object)})
    for words in (["replay", str(path)], ["tosses", str(path)]):
        assert CliRunner().invoke(app, words).exit_code == 2


def test_a_toss_of_torch_is_read_as_numbers_only(tmp_path, marker):
    torch = pytest.importorskip("torch")
    torch.save(Bomb(marker), tmp_path / "0.pt")
    with pytest.raises(ValueError, match=r"0\.pt"):
        data.load(tmp_path)


# scenes

BODY = "[[bodies]]\nkind = {kind}\nradius = 1.0\nmass = 1.0\n"


@pytest.mark.parametrize("kind", ["builtins.open", "physics.io.toml:Path", "__import__('os').getcwd()", "Field"])
def test_a_scene_names_known_kinds_only(kind, tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(BODY.format(kind=json.dumps(kind)), encoding="utf-8")
    with pytest.raises(ValueError, match="kind is "):
        physics.load_scene(path)


@pytest.mark.parametrize(("name", "load"), [("s.toml", physics.load_scene), ("s.xml", physics.load_mjcf)])
def test_a_pickle_in_place_of_a_scene_is_refused(name, load, tmp_path, marker):
    (tmp_path / name).write_bytes(pickle.dumps(Bomb(marker)))
    with pytest.raises(ValueError, match=name):
        load(tmp_path / name)


LAUGHS = "".join(f'<!ENTITY l{k} "{f"&l{k - 1};" * 10}">' for k in range(1, 20))
MODELS = {
    "grows": f'<!DOCTYPE m [<!ENTITY l0 "ha">{LAUGHS}]><mujoco model="&l19;"><worldbody/></mujoco>',
    "a file": '<!DOCTYPE m [<!ENTITY f SYSTEM "file:///etc/passwd">]><mujoco><worldbody>&f;</worldbody></mujoco>',
    "elsewhere": '<!DOCTYPE m SYSTEM "http://localhost:9/m.dtd"><mujoco><worldbody/></mujoco>',
}


@pytest.mark.parametrize("model", MODELS)
def test_a_model_declares_no_entities(model, tmp_path):
    path = tmp_path / "model.xml"
    path.write_text(MODELS[model], encoding="utf-8")
    with pytest.raises(ValueError, match=r"model\.xml: <!DOCTYPE m> is not read"):
        physics.load_mjcf(path)


# policies: the exception


def model_with(bomb: Bomb, path: Path) -> None:
    """A file of Stable-Baselines3 whose settings hold a pickle."""
    settings = {
        "clip_range": {":type:": "bomb", ":serialized:": base64.b64encode(pickle.dumps(bomb)).decode()},
    }
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("data", json.dumps(settings))


@pytest.mark.parametrize("name", ["policy.npz", "policy.NPZ"])
@pytest.mark.parametrize("has_arrays", [False, True])
def test_a_model_under_the_ending_of_arrays_is_read_as_arrays(name, has_arrays, tmp_path, marker):
    """The ending decides, whatever is in the file."""
    path = tmp_path / name
    model_with(Bomb(marker), path)
    if not has_arrays:
        with pytest.raises(ValueError, match=rf"{name}.*holds no network"):
            load_policy(path)
        return
    with zipfile.ZipFile(path, "a") as file, zipfile.ZipFile(Network([(np.ones((2, 1)), np.ones(1))]).save(
        tmp_path / "network.npz"
    )) as network:  # fmt: skip
        for part in network.namelist():
            file.writestr(part, network.read(part))
    assert load_policy(path)(np.zeros((1, 2))) == 1.0


@pytest.mark.parametrize("name", ["policy", "policy.pkl", "policy.npz.bak"])
def test_a_policy_of_another_ending_is_refused(name, tmp_path, marker):
    model_with(Bomb(marker), tmp_path / name)
    with pytest.raises(ValueError, match=rf"{name}.*allowed are .*\.zip.*\.npz"):
        load_policy(tmp_path / name)


def test_a_model_of_stable_baselines3_runs_its_code(tmp_path, capsys):
    """`SECURITY.md` warns of it, and so does a line before it is read; once this no longer holds, both can go."""
    pytest.importorskip("stable_baselines3")
    model_with(Bomb(tmp_path / "made"), tmp_path / "policy.zip")
    with pytest.raises(Exception):  # noqa: B017, PT011 - whatever Stable-Baselines3 makes of the rest
        load_policy(tmp_path / "policy.zip")
    assert (tmp_path / "made").exists()
    assert "policy.zip is a model of Stable-Baselines3: code in it runs" in capsys.readouterr().err


@pytest.mark.parametrize("command", [["view"], ["agents.evaluate"], ["agents.record"], ["agents.train"]])
def test_help_says_that_a_model_runs_code(command):
    """Each command that reads a model says so."""
    if command == ["view"]:
        result = CliRunner().invoke(app, ["view", "--help"], env={"COLUMNS": "200"})
        told = result.output
    else:
        pytest.importorskip("stable_baselines3")
        module = importlib.import_module(command[0])
        program = typer.Typer(rich_markup_mode=None)
        program.command()(module.main)
        told = CliRunner().invoke(program, ["--help"], env={"COLUMNS": "200"}).output
    assert re.search(r"code\s+(in\s+its\s+\S+\s+)?runs\s+while\s+it\s+is\s+read", told), told


# readers

# The first two read files that the program itself wrote, in folders of the user: SECURITY.md names them.
ALLOWED = {
    "agents/checkpoint.py": "checkpoints of training runs",
    "physics/compiler/fused/cache_files.py": "the kernel cache",
    "rigid_env/envs/checks.py": "a pickle that it has just made",
    "rigid_env/envs/infos.py": "a program of quoted names that it has just written",
}
SAFE_ARGUMENT = {"np.load": ("allow_pickle", False), "torch.load": ("weights_only", True)}
RUNNING = {"pickle.load", "pickle.loads", "eval", "exec", "yaml.load", "marshal.loads", "cloudpickle.loads"}


def unsafe_readers(source: str) -> list[str]:
    """Calls in a module that can run code of a file."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call):
            called = ast.unparse(node.func)
            given = {word.arg: getattr(word.value, "value", None) for word in node.keywords}
            name, value = SAFE_ARGUMENT.get(called, ("", None))
            if called in RUNNING or (name and given.get(name) is not value):
                found.append(called)
    return found


def test_unsafe_readers_are_found():
    assert unsafe_readers("np.load(p)\ntorch.load(p, weights_only=False)\npickle.loads(b)\neval(t)") == [
        "np.load",
        "torch.load",
        "pickle.loads",
        "eval",
    ]
    assert not unsafe_readers("np.load(p, allow_pickle=False)\njson.loads(t)\nyaml.safe_load(t)")


def test_no_reader_can_run_code_of_a_file():
    paths = [path for package in ("physics", "rigid_env", "agents") for path in (ROOT / package).rglob("*.py")]
    unsafe = {path.relative_to(ROOT).as_posix() for path in paths if unsafe_readers(path.read_text(encoding="utf-8"))}
    assert unsafe == set(ALLOWED)
