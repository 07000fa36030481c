"""Wrong input to what takes a scene: worlds, simulations, recorders, files, measurements of accuracy."""

from __future__ import annotations

import io
import tempfile
from pathlib import Path

import numpy as np

import physics as p
from tests.wrong_input.case import Case
from tests.wrong_input.constructors import ball, rows, scene

BOX = scene(p.Gravity(), p.Contact())
TILTED = p.Scene([p.Block((1, 1, 1), 1, pos=(0, 3, 0))], p.three_walls(), [p.Contact(tangential=0.5), p.Friction()])

BALL_MJCF = "<mujoco><worldbody><body><freejoint/><geom size='1' {}/></body></worldbody></mujoco>"


def world(**more) -> p.World:
    """The ball in the box."""
    return p.World(BOX, **more)


def cut_recording() -> bytes:
    """The first half of a NumPy archive."""
    file = io.BytesIO()
    np.savez(file, head="{}")
    return file.getvalue()[: len(file.getvalue()) // 2]


def loaded(text: str | bytes, load=p.load_scene):
    """Load a file with this content."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.toml"
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        return load(path)


# fmt: off
WORLDS = rows(
    ("scene-none", lambda: p.World(None), ("scene is None", "a physics.Scene")),
    ("scene-list", lambda: p.World([ball()]), ("scene is [Sphere(", "a physics.Scene")),
    ("worlds-zero", lambda: world(worlds=0), ("worlds is 0", "at least 1")),
    ("worlds-float", lambda: world(worlds=2.0), ("worlds is 2.0", "integers of at least 1")),
    ("worlds-huge", lambda: world(worlds=10**30), ("worlds is 1000", "to 2147483647")),
    ("worlds-too-many", lambda: world(worlds=2 * 10**9), ("worlds is 2000000000", "at most", "GiB of memory")),
    ("dt-zero", lambda: world(dt=0), ("dt is 0.0", "greater than 0")),
    ("dt-string", lambda: world(dt="10ms"), ("dt is '10ms'", "one number")),
    ("dt-nan", lambda: world(dt=np.nan), ("dt is nan", "finite")),
    ("accuracy-misspelt", lambda: world(accuracy="balancd"), ("accuracy is 'balancd'", "allowed are balanced, ")),
    ("accuracy-none", lambda: world(accuracy=None), ("accuracy is None", "allowed are fast", "physics.Accuracy")),
    ("accuracy-list", lambda: world(accuracy=["fast"]), ("accuracy is ['fast']", "allowed are fast")),
    ("threads-zero", lambda: world(threads=0), ("threads is 0", "at least 1")),
    ("threads-bool", lambda: world(threads=True), ("threads is True", "integers")),
    ("world-keyword", lambda: world(acuracy="fast"), ("World got an", "'acuracy' (given: 'fast')", "are accuracy,")),
    ("sequential-without-events", lambda: world(accuracy=p.Accuracy(collisions="sequential")),
     ("Accuracy.collisions is 'sequential'", "events")),
    ("tangential-of-a-block", lambda: p.World(TILTED), ("Contact.tangential is 0.5", "bodies[0] is a block", "sphere")),
    ("inside-a-wall", lambda: p.World(p.Scene([ball(pos=(0, 0, 0))], p.three_walls(), [p.Contact()])),
     ("pos [0.0, 0.0, 0.0] of body 0", "inside walls[0]", "at most 0.01 m")),
    ("plan-scene", lambda: p.make_plan(None, "fast"), ("scene is None", "a physics.Scene")),
    ("plan-accuracy", lambda: p.make_plan(BOX, "fats"), ("accuracy is 'fats'", "allowed are fast")),
    ("diagnose-none", lambda: p.diagnose(None), ("world is None", "a physics.World")),
    ("look-at-a-scene", lambda: p.look_at(BOX), ("world is Scene(", "a physics.World")),
    ("wrench-at-none", lambda: p.wrench_at(None, (1, 2, 3)), ("world is None", "a physics.World")),
    ("wrench-at-string", lambda: p.wrench_at(world(), "up"), ("force is 'up'", "numbers in shape (3,)")),
    ("wrench-at-frame", lambda: p.wrench_at(world(), (1, 2, 3), frame="bodi"), ("frame is 'bodi'", "are body, world")),
)

SIMULATIONS = rows(
    ("simulate-a-list", lambda: p.simulate([ball()], 1), ("scene is [Sphere(", "a physics.Scene")),
    ("duration-negative", lambda: p.simulate(BOX, -1), ("duration is -1.0", "at least 0")),
    ("duration-none", lambda: p.simulate(BOX, None), ("duration is None", "one number")),
    ("duration-endless", lambda: p.simulate(BOX, 1e12), ("duration is 1000000000000.0", "at most 100000000 samples")),
    ("sample-dt-zero", lambda: p.simulate(BOX, 1, sample_dt=0), ("sample_dt is 0.0", "greater than 0")),
    ("dt-no-part", lambda: p.simulate(BOX, 1, dt=0.003, sample_dt=0.01), ("sample_dt is 0.01 with dt=0.003", "multi")),
    ("dt-longer", lambda: p.simulate(BOX, 1, sample_dt=0.01, dt=0.02), ("sample_dt is 0.01 with dt=0.02", "multiples")),
    ("dt-negative", lambda: p.simulate(BOX, 1, dt=-0.01), ("dt is -0.01", "greater than 0")),
    ("wrench-of-three", lambda: p.simulate(BOX, 1, wrench=(1, 2, 3)), ("wrench has shape (3,)", "(6,) or (1, 6)")),
    ("wrench-string", lambda: p.simulate(BOX, 1, wrench="push"), ("wrench is 'push'", "shape (6,)")),
    ("wrench-nan", lambda: p.simulate(BOX, 1, wrench=[np.nan] * 6), ("wrench is ", "nan", "finite")),
    ("wrench-gives-none", lambda: p.simulate(BOX, 0.1, wrench=lambda t, w: None), ("wrench(t, world) is None", "(6,)")),
    ("simulate-keyword", lambda: p.simulate(BOX, 1, samle_dt=1), ("'samle_dt' (given: 1)", "allowed are sample_dt,")),
)

KEEPERS = rows(
    ("recorder-world", lambda: p.Recorder(None), ("world is None", "a physics.World")),
    ("recorder-keep", lambda: p.Recorder(world(), keep=0), ("keep is 0", "at least 1")),
    ("recorder-on", lambda: p.Recorder(world(), on=("fault",)), ("on is ('fault',)", "physics.Status")),
    ("recorder-folder", lambda: p.Recorder(world(), folder=3), ("folder is 3", "a path")),
    ("recorder-of-a-lag", lambda: p.Recorder(p.World(scene(p.Actuator(lag=1)))), ("lag=1.0", "without lag and delay")),
    ("recorder-keyword", lambda: p.Recorder(world(), kep=3), ("'kep' (given: 3)", "allowed are keep,")),
    ("recording-path", lambda: p.Recording.load(3), ("path is 3", "the path of a file")),
    ("recording-foreign", lambda: loaded("x = 1", p.Recording.load), ("scene.toml is no recording", "Recorder writes")),
    ("recording-cut", lambda: loaded(cut_recording(), p.Recording.load), ("scene.toml is no recording", "Recorder")),
    ("stepper-world", lambda: p.Stepper(None), ("world is None", "a physics.World")),
    ("stepper-steps", lambda: p.Stepper(world(), steps=0), ("steps is 0", "at least 1")),
    ("stepper-dt", lambda: p.Stepper(world(), dt=-1), ("dt is -1.0", "greater than 0")),
)

FILES = rows(
    ("load-none", lambda: p.load_scene(None), ("path is None", "the path of a file")),
    ("load-keyword", lambda: p.load_scene("x", kind=1), ("'kind' (given: 1)", "allowed are kinds,")),
    ("load-kinds", lambda: p.load_scene(__file__, kinds=[int]), ("kinds holds <class 'int'>", "physics.Field")),
    ("load-binary", lambda: loaded(b"\xff\xfe"), ("scene.toml: byte 0", "text file in TOML")),
    ("load-syntax", lambda: loaded("bodies = ["), ("scene.toml, line 1", "'bodies = ['", "allowed is TOML")),
    ("load-unknown-key", lambda: loaded("[[bodys]]"), ("line 1: bodys is not known", "allowed are bodies,")),
    ("load-unknown-kind", lambda: loaded("[[bodies]]\nkind = 'Bloc'"), ("line 2", "kind is 'Bloc'", "are Block,")),
    ("load-empty", lambda: loaded(""), ("scene.toml: Scene.bodies is empty", "at least one")),
    ("save-a-body", lambda: p.save_scene(ball(), "x.toml"), ("scene is Sphere(", "a physics.Scene")),
    ("save-nowhere", lambda: p.save_scene(BOX, None), ("path is None", "the path of a file")),
    ("mjcf-load-none", lambda: p.load_mjcf(None), ("path is None", "the path of a file")),
    ("mjcf-syntax", lambda: loaded("<mujoco>", p.load_mjcf), ("scene.toml: ", "line 1")),
    ("mjcf-no-counterpart", lambda: loaded("<mujoco><tendon/></mujoco>", p.load_mjcf), ("scene.toml", "allowed")),
    ("mjcf-mass", lambda: loaded(BALL_MJCF.format("mass='heavy'"), p.load_mjcf), ("line 1: ", "mass", "is 'heavy'")),
    ("mjcf-contype", lambda: loaded(BALL_MJCF.format("contype='x'"), p.load_mjcf), ("line 1: ", "contype", "is 'x'")),
    ("mjcf-size", lambda: loaded(BALL_MJCF.format("type='box'"), p.load_mjcf), ("line 1: ", "size")),
    ("mjcf-save-none", lambda: p.save_mjcf(None, "x.xml"), ("scene is None", "a physics.Scene")),
    ("mjcf-save-drag", lambda: p.save_mjcf(scene(p.Drag()), "x.xml"), ("cannot express Drag;", "drop=True")),
)

FRONTIERS = rows(
    ("frontier-scene", lambda: p.frontier(None, 1), ("scene is None", "a physics.Scene")),
    ("frontier-duration", lambda: p.frontier(BOX, 0), ("duration is 0.0", "greater than 0")),
    ("frontier-short", lambda: p.frontier(BOX, 1e-5), ("duration is 1e-05 s", "at least 0.02 s")),
    ("settings-name", lambda: p.frontier(BOX, 1, "fast"), ("settings is 'fast'", "a list of (preset")),
    ("settings-names", lambda: p.frontier(BOX, 1, ["fast"]), ("settings[0] is 'fast'", "(preset or physics.Accuracy")),
    ("settings-misspelt", lambda: p.frontier(BOX, 1, [("fst", 0.01)]), ("settings[0] is 'fst'", "allowed are fast,")),
    ("settings-step", lambda: p.frontier(BOX, 1, [("fast", 0)]), ("settings[0] step is 0.0", "greater than 0")),
    ("settings-empty", lambda: p.frontier(BOX, 1, []), ("settings is empty", "at least one")),
    ("frontier-repeats", lambda: p.frontier(BOX, 1, repeats=0), ("repeats is 0", "at least 1")),
    ("frontier-truth", lambda: p.frontier(BOX, 1, truth="ref"), ("truth is 'ref'", "a physics.Truth")),
    ("frontier-progress", lambda: p.frontier(BOX, 1, progress=True), ("progress is True", "a function")),
    ("ladder-name", lambda: p.ladder("fast"), ("accuracies is 'fast'", "a list of presets")),
    ("ladder-misspelt", lambda: p.ladder(["fats"]), ("accuracies[0] is 'fats'", "allowed are fast,")),
    ("ladder-step", lambda: p.ladder(steps=0.01), ("steps is 0.01", "a list of steps")),
    ("ladder-steps", lambda: p.ladder(steps=[0.01, -1]), ("steps is ", "-1.", "greater than 0")),
    ("truth-number", lambda: p.Truth(3), ("Truth.error is 3", "a function of a Trajectory")),
    ("truth-own-error", lambda: p.Truth(len, own_error=-1), ("Truth.own_error is -1.0", "at least 0")),
    ("truth-scale", lambda: p.Truth(len, scale=0), ("Truth.scale is 0.0", "greater than 0")),
)
# fmt: on

CASES: list[Case] = WORLDS + SIMULATIONS + KEEPERS + FILES + FRONTIERS
