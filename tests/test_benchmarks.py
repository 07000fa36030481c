"""Measuring: the arithmetic, that both engines are given the same scene, and that every program runs.

No test asserts a time.
"""

import json
import subprocess
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import physics
from benchmarks import machine, memory, start
from physics import scenes
from rigid_env.lab.measure import mujoco_scene, rows, workloads
from rigid_env.lab.measure.machine import describe
from rigid_env.lab.measure.table import cells, make_table, number
from rigid_env.lab.measure.timing import Row, Spread, fastest, interleave

ROOT = Path(__file__).parents[1]
# The peer is an extra (`bench`, part of `dev`): without it the benchmarks run alone, and so do their tests.
needs_mujoco = pytest.mark.skipif(not mujoco_scene.is_installed(), reason="mujoco is not installed")


def row(ours, peer=None, target=None, **more):
    return Row("key", "what", "steps/s", Spread(ours), peer=Spread(peer) if peer else None, target=target, **more)


# arithmetic


def test_ratio_is_taken_turn_by_turn():
    # the machine was twice as slow in the second turn: the ratio does not see it
    ratio = row((100.0, 50.0, 90.0), (10.0, 5.0, 10.0)).ratio
    assert ratio.samples == (10.0, 10.0, 9.0)
    assert (ratio.median, ratio.lowest, ratio.highest) == (10.0, 9.0, 10.0)


@pytest.mark.parametrize(
    ("case", "is_passed"),
    [
        (row((30.0,), (2.0,), 15.0), True),
        (row((30.0,), (2.0,), 15.1), False),
        (row((30.0,), (2.0,), 15.0, is_valid=False), False),
        (row((30.0,), (2.0,)), None),
        (row((30.0,), None, 15.0), None),
        (row((1.0, 2.0, 9.0), None, 2.0, is_ratio=False), True),
        (row((1.0, 2.1, 9.0), None, 2.0, is_ratio=False), False),
    ],
)
def test_targets(case, is_passed):
    assert case.is_passed is is_passed
    assert case.to_dict()["pass"] is is_passed


def contestants(names: str, order: list) -> dict:
    """Contestants that note in `order` that they ran, and measure how many did so far."""

    def run(name):
        order.append(name)
        return float(len(order))

    return {name: partial(run, name) for name in names}


def test_contestants_run_in_turns_and_the_first_turn_is_thrown_away():
    order, told = [], []
    spreads = interleave(contestants("ab", order), 2, told.append)
    assert "".join(order) == "".join(told) == "ababba"  # who begins changes
    assert spreads["a"].samples == (3.0, 6.0)
    assert spreads["b"].samples == (4.0, 5.0)
    assert (spreads["a"] / spreads["b"]).samples == (0.75, 1.2)


def test_contestants_that_are_warm_count_from_their_first_run():
    order = []
    spreads = interleave(contestants("abc", order), 3, is_warm=True)
    assert "".join(order) == "abccbaabc"
    assert spreads["b"].samples == (2.0, 5.0, 8.0)


def test_the_fastest_has_the_highest_median():
    assert fastest({"a": Spread((1.0, 9.0, 2.0)), "b": Spread((3.0, 3.0, 3.0))}, ["a", "b"]) == "b"


def test_table_shows_numbers_in_three_digits():
    assert [number(v) for v in (0.0, 0.6412, 12.34, 4321.0, 16113672.0)] == [
        "0",
        "0.641",
        "12.3",
        "4.32 k",
        "16.1 M",
    ]
    text = [cell.plain for cell in cells(row((26.0, 24.0, 25.0), (1.0, 1.0, 1.0), 25.0, peer_name="peer"))]
    assert "against peer" in text[0]
    assert text[4].startswith("25\n")
    assert text[5] == "≥ 25"
    assert "yes" in text[6]
    assert cells(row((1.0063,), (1.0,)))[4].plain == "1.006"  # a ratio in four
    assert make_table([row((1.0,))], "title").row_count == 1


def test_machine_names_what_a_number_depends_on():
    found = describe()
    assert found["processor"]
    assert found["cores"] >= 1
    assert found["versions"]["numpy"] == np.__version__
    if (ROOT / ".git").exists():
        assert len(found["git"]["commit"]) == 40
        assert found["git"]["is_dirty"] in (True, False)
    json.dumps(found)


# workloads


def test_random_wrenches_are_the_same_for_both_engines_and_within_their_limits():
    wrenches = workloads.random_wrenches(500)
    assert np.array_equal(wrenches, workloads.random_wrenches(500))
    limits = np.array([0.9 * 6.0 * 9.81] * 3 + [60.0] * 3)
    assert (np.abs(wrenches) <= limits).all()
    # of 500 uniform numbers the largest is above 0.95 of the limit but for a chance of 0.95^500 = 7e-12
    assert (np.abs(wrenches).max(axis=(0, 1, 2)) > 0.95 * limits).all()


def test_blocks_of_the_batch_start_clear_of_the_walls():
    pos, quat = workloads.random_poses(200)
    radius = 0.5 * np.linalg.norm(scenes.SIZE)
    assert (pos[:, 0, 1] > radius).all()
    assert (np.abs(pos[:, 0, 0]) < scenes.HALF_WIDTH - radius).all()
    np.testing.assert_allclose(np.linalg.norm(quat, axis=-1), 1.0, rtol=1e-15)


@needs_mujoco
def test_mujoco_has_the_same_scene():
    model, _ = mujoco_scene.make_model()
    block = mujoco_scene.BLOCK
    assert model.opt.timestep == workloads.STEP
    assert model.opt.integrator == 0  # Euler
    np.testing.assert_allclose(model.opt.gravity, (0.0, -9.81, 0.0))
    np.testing.assert_allclose(model.body_mass[block], 6.0)
    np.testing.assert_allclose(sorted(model.body_inertia[block]), (6.5, 14.5, 17.0), rtol=1e-12)
    np.testing.assert_allclose(model.geom_friction[:, 0], 0.5)
    friction = scenes.shove().effect(physics.Friction).coefficient
    assert friction == mujoco_scene.FRICTION


@needs_mujoco
def test_mujoco_rests_on_four_contacts_at_the_same_height():
    with mujoco_scene.elsewhere():
        peer = mujoco_scene.Rest(workloads.QUICK)
        peer()
    ours = workloads.Rest("balanced", workloads.QUICK)
    ours()
    assert peer.data.ncon == ours.notes()["contacts"] == 4
    assert ours.notes()["force_over_weight"] == pytest.approx(1.0, rel=rows.LARGEST_RESIDUAL)
    # MuJoCo's contacts are soft: it sinks a few millimetres
    assert peer.data.qpos[1] == pytest.approx(ours.world.pos[0, 0, 1], abs=0.01)


@needs_mujoco
def test_wrenches_act_alike_in_both_engines_in_the_air():
    wrench, steps = np.array([10.0, 80.0, -20.0, 3.0, -2.0, 1.0]), 40
    model, data = mujoco_scene.make_model(height=1e3)
    import mujoco

    data.xfrc_applied[mujoco_scene.BLOCK] = wrench
    mujoco.mj_step(model, data, nstep=steps)
    scene = scenes.block_in_box((0.0, 1e3, 0.0))
    world = physics.World(scene, dt=workloads.STEP)
    world.step(wrench[None, None], steps=steps)
    time = steps * workloads.STEP
    # MuJoCo's Euler is off by a dt t / 2 in place; |a| <= 5 m/s²
    np.testing.assert_allclose(data.qpos[:3], world.pos[0, 0], rtol=0, atol=0.5 * 5.0 * workloads.STEP * time * 1.01)
    np.testing.assert_allclose(data.qvel[:3], world.linvel[0, 0], rtol=1e-9)


@needs_mujoco
def test_mujoco_leaves_no_log_where_it_is_called():
    before = Path.cwd()
    with mujoco_scene.elsewhere():
        assert Path.cwd() != before
    assert Path.cwd() == before


def test_kernels_allocate_nothing():
    world = physics.World(scenes.shove(), dt=workloads.STEP)
    assert memory.kernel_allocations(world, workloads.random_wrenches(8)) == 0.0


def test_results_are_kept_with_machine_and_commit(tmp_path):
    path = machine.keep("some", [row((2.0,), (1.0,), 1.5)], tmp_path / "deep" / "some.json", repeats=1)
    found = json.loads(path.read_text())
    assert set(found) == {"name", "settings", "rows", "machine"}
    assert found["settings"] == {"repeats": 1}
    assert found["rows"][0]["ratio"]["median"] == 2.0
    assert {"date", "processor", "cores", "python", "versions", "git"} <= set(found["machine"])
    assert machine.headline().count(",") >= 4


# programs

ROW_KEYS = {
    "key", "what", "accuracy", "unit", "ours", "peer_name", "peer", "ratio", "target", "is_ratio", "pass",
    "notes",
}  # fmt: skip
KEYS = {
    "flight", "rest", "shove", "batch", "vector_env_1_thread", "vector_env_2_thread", "single_env",
    "bare_env", "kernel_bytes", "python_bytes", "start_world", "start_env", "threads_beside_0", "threads_beside_1",
    "threads_beside_2",
}  # fmt: skip
ALONE = ("kernel_bytes", "python_bytes", "process_bytes", *start.PROGRAMS)


def log_stamp():
    """When MuJoCo last wrote its log into the repository; None if it never did."""
    log = ROOT / "MUJOCO_LOG.TXT"
    return log.stat().st_mtime if log.exists() else None


@pytest.mark.exhaustive
def test_throughput_runs_and_writes_every_row(tmp_path):
    path = tmp_path / "throughput.json"
    command = [sys.executable, "-m", "benchmarks.throughput", "--quick", "--json", str(path)]
    log_before = log_stamp()
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "free flight" in done.stdout
    assert str(path) in done.stdout.replace("\n", "")
    found = json.loads(path.read_text())
    assert found["settings"]["is_quick"] is True
    assert {entry["key"] for entry in found["rows"]} >= KEYS
    for entry in found["rows"]:
        assert set(entry) == ROW_KEYS
        assert entry["ours"]["min"] <= entry["ours"]["median"] <= entry["ours"]["max"]
        has_peer = entry["key"] not in ALONE and mujoco_scene.is_installed()
        assert (entry["ratio"] is not None) == (has_peer or entry["key"].startswith("threads_"))
    accuracies = {(entry["key"], entry["accuracy"]) for entry in found["rows"]}
    assert {("flight", "fast"), ("flight", "balanced"), ("start_env", "fast")} <= accuracies
    assert log_stamp() == log_before


def test_an_unknown_part_is_named():
    command = [sys.executable, "-m", "benchmarks.throughput", "--part", "engines"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 2
    assert "engines" in done.stderr
    assert "environments" in done.stderr
