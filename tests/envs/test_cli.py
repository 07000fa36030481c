"""The command line: what it prints and writes, and what it says about mistakes."""

import json
import subprocess
import sys

import numpy as np
import pytest
from typer.testing import CliRunner

import physics
import rigid_env.lab.warmup
from physics import scenes
from physics.kernels.state.sleeping import SLEEP_SIZE
from physics.scene.force_fields import FIELDS
from rigid_env.cli import app
from rigid_env.lab import demo
from rigid_env.lab.measure import effects as costs
from rigid_env.lab.measure.shares import names_of, without
from rigid_env.rendering import Camera
from rigid_env.rendering.picture import stroboscope, without_bodies, world_frame

pytestmark = pytest.mark.interpreted

runner = CliRunner()


def run(*arguments, code=0):
    result = runner.invoke(app, list(map(str, arguments)))
    assert result.exit_code == code, result.output
    return result.output


def loaded(path):
    found = json.loads(path.read_text())
    assert {"date", "processor", "versions", "git"} <= set(found["machine"])
    return found


# all commands


def test_version_and_help():
    assert run("--version").startswith("rigid-env")
    for command in ("demo", "run", "explain", "warmup", "bench", "effects", "accuracy", "hard-cases"):
        assert command in run("--help")
        assert "--json" in run(command, "--help")


def test_module_runs_and_importing_it_is_light():
    done = subprocess.run([sys.executable, "-m", "rigid_env", "--version"], capture_output=True, text=True)
    assert done.stdout.startswith("rigid-env")
    code = "import sys, rigid_env.cli; print([m for m in ('numba', 'physics', 'pygame') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("command", ["demo", "explain"])
def test_mistakes_are_named_with_what_is_allowed(command):
    output = run(command, "dorp", code=2)
    assert "'dorp'" in output
    for name in scenes.SCENES:
        assert name in output
    output = run(command, "drop", "--accuracy", "best", code=2)
    assert "'best'" in output
    for name in physics.PRESETS:
        assert name in output


def test_negative_and_endless_durations_are_refused():
    assert "duration" in run("demo", "rest", "--duration", -1, code=2)
    assert "duration" in run("demo", "rest", "--duration", "inf", code=2)


# demo


def test_demo_at_rest(tmp_path):
    image = pytest.importorskip("PIL.Image")
    pytest.importorskip("pygame")
    out, numbers = tmp_path / "pictures", tmp_path / "numbers.json"
    output = run("demo", "rest", "--duration", 0.2, "--out", out, "--json", numbers)
    assert "at rest     yes" in output
    with image.open(out / "rest.png") as png:
        assert png.size == (960, 600)
    with image.open(out / "rest.gif") as gif:
        assert gif.size == (640, 400)
        assert gif.info["duration"] == 40
        assert gif.info["loop"] == 0
    found = loaded(numbers)
    assert found["scene"] == "rest"
    assert found["duration"] == pytest.approx(0.2)
    # 6 kg on 1.5 m of height
    assert found["energy"]["start"] == pytest.approx(6.0 * 9.81 * 1.5, rel=1e-12)
    assert found["energy"]["dissipated"] == pytest.approx(0.0, abs=1e-9)
    assert len(found["contacts"]["points"]) == 4
    np.testing.assert_allclose(found["contacts"]["total_force"], (0.0, 6.0 * 9.81, 0.0), rtol=1e-6, atol=1e-6)
    assert found["final"]["is_at_rest"] is True
    assert found["status"]["name"] == "ok"
    assert [event["kind"] for event in found["events"]] == ["touch"]
    assert set(found["files"]) == {"png", "gif"}


def test_demo_tells_of_the_fall(tmp_path, monkeypatch, is_exhaustive):
    if not is_exhaustive:
        monkeypatch.setattr(demo, "PICTURE_SIZE", (240, 150))
        monkeypatch.setattr(demo, "GIF_SIZE", (160, 100))
    image = pytest.importorskip("PIL.Image")
    pytest.importorskip("pygame")
    numbers = tmp_path / "numbers.json"
    output = run("demo", "--duration", 1.0, "--out", tmp_path, "--json", numbers)
    assert "impact" in output
    found = loaded(numbers)
    # the lowest corner of the tilted block meets the floor before its centre could fall to half its thickness
    first = found["events"][0]
    assert first["kind"] == "impact"
    assert 0.0 < first["t"] < np.sqrt(2.0 * (6.0 - 1.0) / 9.81)
    energy = found["energy"]
    assert energy["dissipated"] == pytest.approx(energy["start"] - energy["end"], rel=1e-12)
    assert 0.0 < energy["dissipated"] < energy["start"]
    assert found["status"]["impacts"] >= 1
    with image.open(tmp_path / "drop.gif") as gif:
        assert gif.n_frames == 26  # 25 a second, and the start


def test_a_run_counts_the_work_of_a_driven_body(tmp_path):
    """A belt drags a crate of 2 kg up to its speed: the crate gains ½ m v², and friction loses as much as heat."""
    belt = physics.Motion(surface_velocity=(0.8, 0, 0))
    bodies = [
        physics.Block((4, 1, 2), fixed=True, pos=(0, -0.5, 0), motion=belt),
        physics.Block((0.3, 0.3, 0.3), 2.0, pos=(0, 0.15, 0)),
    ]
    effects = [physics.Gravity(), physics.Contact(), physics.Friction(0.5)]
    path, numbers = tmp_path / "belt.toml", tmp_path / "numbers.json"
    physics.save_scene(physics.Scene(bodies, effects=effects), path)
    output = run("run", path, "--duration", 0.5, "--json", numbers)
    assert "1.2800 J of work by driven bodies, 0.6400 J dissipated" in " ".join(output.split())
    energy = loaded(numbers)["energy"]
    assert energy["driven_work"] == pytest.approx(2.0 * 0.8**2, abs=1e-6)
    assert energy["dissipated"] == pytest.approx(0.5 * 2.0 * 0.8**2, abs=1e-6)
    assert energy["sources"] == []
    assert energy["end"] - energy["start"] == pytest.approx(0.5 * 2.0 * 0.8**2, abs=1e-6)


def test_energy_may_come_from_pushes_and_wind_but_not_from_springs():
    bodies = [physics.Sphere(0.5, 1.0, pos=(2.0 * k, 0, 0)) for k in range(2)]
    effects = [physics.Spring(other=1), physics.Spring(damping=1.0), physics.Drag()]
    assert demo.energy_sources(physics.Scene(bodies, effects=effects)) == []
    effects += [physics.Push((1, 0, 0)), physics.Push((0, 1, 0)), physics.Wind()]
    assert demo.energy_sources(physics.Scene(bodies, effects=effects)) == ["Push", "Wind"]


def test_demo_far_from_the_walls_travels_with_the_block(tmp_path):
    image = pytest.importorskip("PIL.Image")
    pytest.importorskip("pygame")
    run("demo", "flight", "--duration", 0.1, "--out", tmp_path)
    with image.open(tmp_path / "flight.png") as png:
        pixels = np.asarray(png.convert("RGB")).astype(int)
    middle = pixels[280:320, 460:500].mean(axis=(0, 1))
    assert middle[2] > middle[0] + 60  # the blue block, not the pale background


# explain


def test_explain_says_what_is_on_and_why(tmp_path):
    path = tmp_path / "plan.json"
    output = run("explain", "bounce", "--json", path)
    assert "not declared" in output
    found = loaded(path)
    effects = {entry["effect"]: entry for entry in found["effects"]}
    assert effects["friction"]["is_on"] is False
    assert effects["restitution"]["is_on"] is True
    assert "e = 1.0" in effects["restitution"]["reason"]
    plan = physics.make_plan(scenes.bounce(), physics.PRESETS["balanced"])
    assert found["explanation"] == plan.explain()
    assert found["settings"]["tolerance"] == physics.PRESETS["balanced"].tolerance


FALLING = """
[[bodies]]
kind = "Sphere"
radius = 0.1
mass = 10.0
linvel = [1.0, 0.0, 0.0]

[[effects]]
kind = "Gravity"

[[effects]]
kind = "Drag"

[[effects]]
kind = "Wind"
velocity = [3.0, 0.0, 0.0]

[[effects]]
kind = "Buoyancy"
offset = -0.7
"""


def test_explain_measures_when_effects_act_and_what_time_they_take(tmp_path):
    """A heavy ball falls into water 0.7 m below: the water acts from the step in which the ball reaches it."""
    scene, path = tmp_path / "ball.toml", tmp_path / "shares.json"
    scene.write_text(FALLING)
    output = run("explain", scene, "--duration", 1.0, "--json", path)
    shares = {share["effect"]: share for share in loaded(path)["shares"]}
    assert list(shares) == ["Gravity", "Drag", "Wind", "Buoyancy"]
    assert [shares[name]["acted"] for name in ("Gravity", "Drag", "Wind")] == [1.0, 1.0, 1.0]
    # It has 0.6 m to fall, in the air: √(2 0.6/9.81) = 0.35 s, a little more for the drag, which the step rounds up.
    assert shares["Buoyancy"]["acted"] == pytest.approx(1 - 0.35, abs=0.015)
    for share in shares.values():
        assert -np.inf < share["time"]["min"] <= share["time"]["median"] <= share["time"]["max"] < 1
    assert "of steps" in output
    assert "duration is -1.0" in run("explain", scene, "--duration", -1, code=2)


def test_an_effect_is_left_out_with_what_needs_it():
    effects = [
        physics.Gravity(), physics.Contact(0.5, tangential=0.2), physics.Friction(), physics.RollingFriction(),
        physics.Drag(), physics.Wind(), physics.Spring(other=1), physics.Spring(), physics.Sleeping(),
    ]  # fmt: skip
    bodies = [physics.Sphere(1, 1), physics.Sphere(1, 1, pos=(5, 0, 0))]
    scene = physics.Scene(bodies, effects=effects)
    assert names_of(scene)[-4:] == ["Wind", "Spring 1", "Spring 2", "Sleeping"]
    assert [type(e).__name__ for e in without(scene, effects[1]).effects] == [
        "Gravity", "Drag", "Wind", "Spring", "Spring",
    ]  # fmt: skip
    assert without(scene, effects[2]).effect(physics.Contact) == physics.Contact(0.5)
    assert without(scene, effects[6]).effects == (*effects[:6], *effects[7:])
    airy = physics.Scene(bodies, effects=[physics.Drag(), physics.Wind()])
    assert without(airy, airy.effects[0]).effects == ()


# warmup and bench


def test_warmup_covers_environments_and_scenes_once():
    found = rigid_env.lab.warmup.jobs()
    names = [(job.name, job.accuracy) for job in found]
    assert len(set(names)) == len(names)
    for name in ("rigid_env/BlockReach-v0", "rigid_env/BlockReorient-v0"):
        for accuracy in ("fast", "balanced"):
            assert (f"environment {name}", accuracy) in names
    plans = {physics.make_plan(make(), physics.PRESETS["balanced"]).key for make in scenes.SCENES.values()}
    in_scenes = [name for name in names if name[0].startswith("scene ") and name[1] == "balanced"]
    assert len(in_scenes) == len(plans)


def test_warmup_takes_environments_scenes_and_files(tmp_path):
    file = tmp_path / "mine.toml"
    physics.save_scene(scenes.by_name("drop"), file)
    path = tmp_path / "warmup.json"
    names = ("drop", str(file), "rigid_env/BlockReach-v0")
    run("warmup", *names, "--accuracy", "balanced,fast", "--json", str(path))
    plans = json.loads(path.read_text(encoding="utf-8"))["plans"]
    assert [(plan["name"].split(" ", 1)[1], plan["accuracy"]) for plan in plans] == [
        (name, accuracy) for name in names for accuracy in ("balanced", "fast")
    ]
    assert [plan["compiled"] for plan in plans[2:4]] == [0, 0]  # the file is the scene before
    assert "'Nothing-v7'" in run("warmup", "Nothing-v7", code=2)


def test_second_warmup_compiles_nothing(tmp_path, monkeypatch):
    few = [job for job in rigid_env.lab.warmup.jobs() if "scene drop" in job.name and job.accuracy == "balanced"]
    assert len(few) == 1
    monkeypatch.setattr(rigid_env.lab.warmup, "jobs", lambda: few)
    run("warmup")
    path = tmp_path / "warmup.json"
    output = run("warmup", "--json", path)
    assert output.count("from the cache") == 1
    found = loaded(path)
    assert [plan["compiled"] for plan in found["plans"]] == [0]
    assert found["seconds"] == pytest.approx(sum(plan["seconds"] for plan in found["plans"]))


@pytest.mark.compiled
def test_bench_measures(tmp_path):
    path = tmp_path / "bench.json"
    output = run("bench", "--quick", "--json", path)
    assert "free flight" in output
    found = loaded(path)
    assert found["is_quick"] is True
    keys = {entry["key"] for entry in found["rows"]}
    assert keys >= {"flight", "rest", "shove", "batch", "single_env", "vector_env_1_thread"}
    assert all(entry["ours"]["median"] > 0 for entry in found["rows"])


# pictures


def test_frame_shows_the_world_as_it_is():
    world = physics.World(scenes.rest(), worlds=2)
    world.set_state(pos=[[[3.0, 1.5, -1.0]]], worlds=[1])
    world.step()
    frame = world_frame(world, 1, text=["text"], applied=np.arange(6.0))
    np.testing.assert_allclose(frame.bodies[0].dimensions, scenes.SIZE)
    np.testing.assert_allclose(frame.bodies[0].pos, world.pos[1, 0])
    assert len(frame.walls) == 3
    assert len(frame.contact_points) == 4
    assert frame.applied_torque.tolist() == [[3.0, 4.0, 5.0]]
    assert frame.text == ("text",)


def test_frame_of_a_sphere_has_its_radius_and_of_empty_space_no_walls():
    sphere = world_frame(physics.World(scenes.rolling_sphere())).bodies[0]
    assert (sphere.kind, sphere.dimensions.tolist()) == ("sphere", [1.0, 1.0, 1.0])
    frame = world_frame(physics.World(scenes.tumble()))
    assert frame.walls == ()
    assert np.isfinite(frame.force_scale)


def test_without_bodies_they_are_behind_the_camera():
    camera = Camera(eye=(0.0, 5.0, 20.0), target=(0.0, 2.0, 0.0))
    frame = without_bodies(world_frame(physics.World(scenes.rest())), camera)
    _, depth = camera.project(frame.bodies[0].pos[None], (320, 200))
    assert depth[0] < 0.0


def test_stroboscope_keeps_what_does_not_move_and_ends_solid():
    empty = np.full((1, 3, 3), 200, np.uint8)
    first, last = empty.copy(), empty.copy()
    first[0, 0], last[0, 2] = 0, 0
    picture = stroboscope([first, last], empty)[0, :, 0]
    # opacities 0.25 + 0.75 k / 2
    assert picture.tolist() == [round(200 * (1 - 0.625)), 200, 0]


# run


def test_run_simulates_a_scene_file(tmp_path):
    scene, samples, numbers = (tmp_path / f"ball.{kind}" for kind in ("toml", "npz", "json"))
    ball = physics.Sphere(0.5, 2.0, linvel=(1.0, 0.0, 0.0))
    physics.save_scene(physics.Scene([ball], effects=[physics.Gravity()]), scene)
    output = run("run", scene, "--duration", 1, "--npz", samples, "--json", numbers)
    assert "ball, accuracy balanced, 1 s" in output
    with np.load(samples) as found:
        assert found["t"][-1] == pytest.approx(1.0)
        assert found["pos"][-1, 0] == pytest.approx([1.0, -9.81 / 2, 0.0], abs=1e-12)
    assert loaded(numbers)["final"]["pos"][0] == pytest.approx([1.0, -9.81 / 2, 0.0], abs=1e-12)


def test_run_tells_what_is_wrong_with_a_file(tmp_path):
    path = tmp_path / "ball.toml"
    path.write_text('[[bodies]]\nkind = "Sphere"\nradius = -1\nmass = 2\n')
    output = " ".join(run("run", path, code=2).replace("│", " ").split())
    assert "line 3" in output
    assert "radius is -1" in output
    assert "does not exist" in run("run", tmp_path / "none.toml", code=2)


# effects


def test_every_effect_has_a_case_that_stores_what_its_plan_says():
    """Nothing for what is in every kernel."""
    kinds = {kind.__name__.lower() for kind in (physics.Gravity, physics.Contact, physics.Friction, *FIELDS)}
    kinds |= {"rollingfriction", "spinfriction", "actuator", "sleeping", "tangentialrestitution", "compliance"}
    kinds |= {"frictionoftwocoefficients"}
    kinds |= {"springbetweenbodies"}
    assert {name.replace(" ", "") for name in costs.CASES} == kinds | {"gusts"}
    stored = {}
    for name, scenes_of in costs.CASES.items():
        on, off = (costs.bytes_per_body(physics.World(scene)) for scene in scenes_of())
        stored[name] = on - off
    assert (stored["gravity"], stored["contact"], stored["drag"], stored["spring"]) == (0, 0, 16, 72)
    names = "spring between bodies", "tangential restitution", "rolling friction", "spin friction", "actuator"
    assert [stored[name] for name in names] == [136, 8, 8, 8, 0]
    assert stored["sleeping"] == 8 * SLEEP_SIZE


def test_effects_measures_a_scene_with_an_effect_and_without(tmp_path, monkeypatch, is_exhaustive):
    if not is_exhaustive:
        monkeypatch.setattr(costs, "QUICK_STEPS", 100)
    path = tmp_path / "effects.json"
    run("effects", "gravity", "friction", "--quick", "--json", path)
    rows = {row["key"]: row for row in loaded(path)["rows"]}
    assert list(rows) == ["gravity", "friction"]
    for row in rows.values():
        assert row["ours"]["min"] > 0
        assert row["peer"]["min"] > 0
        added = 1e9 / row["ours"]["median"] - 1e9 / row["peer"]["median"]
        assert row["notes"]["added_ns_per_step"] == pytest.approx(added)
        assert row["notes"]["added_bytes_per_body"] == 0


def test_effects_says_what_it_cannot_do_before_it_measures():
    assert "'best'" in run("effects", "--accuracy", "best", code=2)
    assert "spin friction" in run("effects", "levitation", "--quick", code=2)
