"""Error against time: what the numbers say, what is measured, and what an interruption leaves."""

from __future__ import annotations

import json
import math
from types import SimpleNamespace

import numpy as np
import pytest

import physics
from physics import Accuracy, Frontier, FrontierPoint, Truth, scenes
from physics.work_precision import analysis as frontier_analysis
from physics.work_precision import errors as frontier_errors
from physics.work_precision import run as frontier_run
from physics.work_precision.contender import EngineContender, TooSlow, setting_name
from physics.work_precision.truth import ReferenceTruth, rows_at

G = 9.81


def point(setting, dt, error, cost, **more):
    return FrontierPoint(more.pop("engine", "rigid-env"), setting, dt, {"pose": error}, (cost,), **more)


def made(points, own_error=0.0, **more):
    return Frontier(tuple(points), "pose", {"pose": "m", "energy": "J"}, {"pose": own_error}, "a truth", 1.0, **more)


def falling() -> physics.Scene:
    """A sphere in free fall: explicit Euler is behind by g T h/2 after the time T, exactly."""
    return physics.Scene([physics.Sphere(1.0, 2.0, linvel=(1.0, 0.0, 0.0))], effects=[physics.Gravity((0.0, -G, 0.0))])


EULER = Accuracy(scheme="explicit_euler")


# --- what the numbers say ------------------------------------------------------------------------------------------


def test_front_holds_what_nothing_beats():
    errors, costs = [1.0, 0.5, 0.7, 0.1, math.nan, math.inf], [1.0, 2.0, 3.0, 4.0, 0.5, 0.1]
    assert frontier_analysis.front(errors, costs) == [0, 1, 3]


def test_front_takes_the_quickest_of_those_as_good_as_the_truth_is_known():
    assert frontier_analysis.front([1.0, 2e-9, 1e-12, 0.0], [1.0, 2.0, 3.0, 4.0], floor=1e-8) == [0, 1]
    assert frontier_analysis.front([1e-12, 1e-9], [2.0, 1.0], floor=1e-8) == [1]


def test_order_and_plateau_of_a_second_order_error_that_ends_in_rounding():
    steps = [0.16, 0.08, 0.04, 0.02, 0.01, 0.005]
    errors = [h * h for h in steps[:4]] + [5e-4, 4.5e-4]
    # 0.02 is the end of the fall: it belongs to the slope, and its error to the plateau.
    assert frontier_analysis.observed_order(steps, errors) == pytest.approx(2.0, abs=1e-12)
    assert frontier_analysis.plateau(steps, errors) == 4e-4


def test_a_falling_error_has_no_plateau_even_after_a_lucky_value():
    steps, errors = [0.04, 0.02, 0.01, 0.005], [4e-2, 1e-7, 1e-2, 5e-3]
    assert frontier_analysis.plateau(steps, errors) is None
    assert frontier_analysis.plateau([0.01], [1.0]) is None


def test_an_exact_scheme_has_a_plateau_and_no_order():
    steps, errors = [0.04, 0.02, 0.01], [1e-15, 1.2e-15, 2e-15]
    assert frontier_analysis.plateau(steps, errors) == 1e-15
    assert frontier_analysis.observed_order(steps, errors) is None


def test_order_leaves_out_what_the_truth_cannot_show_and_what_is_not_finite():
    steps = [0.16, 0.08, 0.04, 0.02, 0.01]
    errors = [math.inf, 8e-2, 4e-2, 2e-2, 1e-4]
    assert frontier_analysis.observed_order(steps, errors, floor=1e-3) == pytest.approx(1.0, abs=1e-12)


def test_errors_that_no_power_of_the_step_explains_have_no_order():
    assert frontier_analysis.observed_order([0.08, 0.04, 0.02, 0.01], [4e-2, 1e-5, 3e-2, 5e-3]) is None


@pytest.mark.parametrize("order", [1.0, 2.0])
@pytest.mark.parametrize("scatter", [1.0, 1.1])
@pytest.mark.parametrize("off", [0.1, 1.0, 10.0])
def test_a_step_too_coarse_for_the_power_is_left_out_of_the_order(order, scatter, off):
    """The known slope of the other four steps, whose errors are scattered to both sides by 10 %.

    Least squares is then off by Σ ±x ln 1.1/Σx² with x = ln h less its mean: 0.061.
    """
    steps = [0.02, 0.01, 0.005, 0.002, 0.001]
    errors = [h**order * scatter ** (-1) ** k for k, h in enumerate(steps)]
    found = frontier_analysis.observed_order(steps, [off * errors[0], *errors[1:]])
    assert found == pytest.approx(order, abs=0.065 if scatter > 1.0 else 1e-12)


def test_at_most_a_quarter_of_the_steps_is_left_out_of_an_order():
    steps = [0.64, 0.32, 0.16, 0.08, 0.04, 0.02, 0.01, 0.005]
    wild = [1e3, 1e2, 1e3]
    assert frontier_analysis.observed_order(steps, wild[:2] + [h * h for h in steps[2:]]) == pytest.approx(2, abs=1e-12)
    assert frontier_analysis.observed_order(steps, wild + [h * h for h in steps[3:]]) is None


def test_an_error_that_grows_with_smaller_steps_has_no_order():
    steps = [0.08, 0.04, 0.02, 0.01, 0.005]
    assert frontier_analysis.observed_order(steps, [1 / h for h in steps]) is None
    assert frontier_analysis.observed_order(steps, [1.0] * 5) is None


def test_noise_has_no_order():
    """Errors between 1 and 100 at random, whatever the step: less than a tenth of the ladders look like a power.

    Three numbers rise, as those of a power would, one time in six.
    """
    rng = np.random.default_rng(0)
    steps = [0.02, 0.01, 0.005, 0.002, 0.001]
    some = [frontier_analysis.observed_order(steps, 10.0 ** rng.uniform(0, 2, 5)) for _ in range(1000)]
    assert sum(found is not None for found in some) <= 100


def test_the_ladder_of_an_event_driven_accuracy_begins_coarser():
    steps = {name: [dt for a, dt in physics.ladder() if a == name] for name in ("fast", "balanced", "precise")}
    assert steps["fast"] == steps["balanced"] == list(frontier_run.STEPS)
    assert steps["precise"] == [*frontier_run.COARSE_STEPS, *frontier_run.STEPS]
    assert physics.ladder(["precise"], (0.01,)) == [("precise", 0.01)]


def test_lost_from_is_the_smallest_step_from_which_all_are():
    assert frontier_analysis.lost_from([0.01, 0.02, 0.04, 0.08], [True, False, True, True]) == 0.04
    assert frontier_analysis.lost_from([0.01, 0.02], [True, False]) is None


# --- what is measured ----------------------------------------------------------------------------------------------


def test_distance_bounds_what_a_turn_moves():
    """Half a turn about z moves the far vertices of the block by 2 (2.5² + 1.5²)½, and 2 r is the bound of all."""
    scene = scenes.tumble()
    pos, quat = np.zeros((1, 1, 3)), np.array([[[1.0, 0.0, 0.0, 0.0]]])
    turned = np.array([[[0.0, 0.0, 0.0, -1.0]]])
    radius = 0.5 * math.sqrt(5**2 + 3**2 + 2**2)
    found = frontier_errors.distances(scene, pos + np.array((0.0, 0.3, 0.4)), turned, pos, quat)
    assert found[0, 0] == pytest.approx(0.5 + 2 * radius, rel=1e-14)


def test_angles_are_accurate_when_small_and_forget_the_sign():
    turned = np.array([[math.cos(5e-13), math.sin(5e-13), 0.0, 0.0]])
    # Accurate because the small components are: cos(5e-13) is 1 in floating point.
    assert frontier_errors.angles_between(-turned, [[1, 0, 0, 0]])[0] == pytest.approx(1e-12, rel=1e-12)
    assert math.isnan(frontier_errors.angles_between([math.nan] * 4, [1, 0, 0, 0]))


def test_velocities_are_compared_in_the_mean_of_the_worst_body():
    difference = np.zeros((4, 2, 3))
    difference[1, 0] = (3.0, 0.0, 4.0)
    difference[1, 1] = (1.0, 0.0, 0.0)
    assert frontier_errors.root_mean_square(difference) == math.sqrt(25.0 / 4.0)


def test_energy_and_penetration_are_those_of_the_engine():
    scene = scenes.corner_drop()
    traj = physics.simulate(scene, 0.2, sample_dt=0.1)
    energy = frontier_errors.mechanical_energy(scene, traj.pos, traj.quat, traj.linvel, traj.angvel)
    # Sums of a dozen products of up to 500 J.
    np.testing.assert_allclose(energy, traj.energy, rtol=0, atol=1e-11)
    down = traj.pos - (0.0, 6.0, 0.0)
    deep = max(-physics.diagnose(_put(scene, down[k], traj.quat[k])).gap.min() for k in range(len(down)))
    assert frontier_errors.deepest_penetration(scene, down, traj.quat) == pytest.approx(deep, rel=1e-13)
    assert frontier_errors.deepest_penetration(scene, traj.pos + 100.0, traj.quat) == 0.0


def _put(scene, pos, quat):
    world = physics.World(scene)
    world.state[:, 0:3], world.state[:, 3:7] = pos, quat
    return world


def test_penetration_of_round_bodies():
    floor = [physics.HalfSpace((0, 1, 0))]
    quat = np.array([[[math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)]]])  # body x points up
    for body, reach in ((physics.Sphere(1.0, 1.0), 1.0), (physics.Ellipsoid((3.0, 2.0, 1.0), 1.0), 3.0)):
        scene = physics.Scene([body], floor, [physics.Contact()])
        found = frontier_errors.deepest_penetration(scene, np.array([[[0.0, 0.4, 0.0]]]), quat)
        assert found == pytest.approx(reach - 0.4, rel=1e-14)


def test_energy_is_conserved_or_never_rises():
    losing = np.array([[5.0], [3.0], [3.5], [1.0]])
    assert frontier_errors.energy_error(scenes.tumble(), losing) == 4.0
    assert frontier_errors.energy_error(scenes.bounce(1.0, 1.0), losing) == 4.0
    assert frontier_errors.energy_error(scenes.drop(), losing) == 0.5
    assert frontier_errors.energy_error(scenes.football(), losing) == 0.5  # drag only takes
    ball = physics.Sphere(1.0, 1.0)
    for effect, error in ((physics.Spring(), 4.0), (physics.Spring(damping=1.0), 0.5), (physics.Push(), np.nan)):
        found = frontier_errors.energy_error(physics.Scene([ball], effects=[effect]), losing)
        assert found == pytest.approx(error, nan_ok=True)


def test_a_driven_body_may_add_energy():
    belt = physics.Block((4, 1, 2), fixed=True, motion=physics.Motion(surface_velocity=(1, 0, 0)))
    crate = physics.Block((1, 1, 1), 1.0, pos=(0, 1, 0))
    scene = physics.Scene([belt, crate], effects=[physics.Contact(), physics.Friction(0.5)])
    assert math.isnan(frontier_errors.energy_error(scene, np.array([[0.0, 0.0], [0.0, 0.5]])))


def test_events_are_paired_where_both_have_as_many():
    def event(t, kind):
        return SimpleNamespace(t=t, kind=kind)

    true = [event(1.0, "impact"), event(2.0, "impact"), event(3.0, "touch"), event(9.0, "fault")]
    seen = [event(2.5, "impact"), event(1.0, "impact"), event(3.1, "touch"), event(4.0, "touch")]
    assert frontier_errors.event_error(seen, true) == 0.5
    assert frontier_errors.event_error(seen[2:], true) is None
    assert frontier_errors.event_error([], true) is None


# --- the truth -----------------------------------------------------------------------------------------------------


def test_samples_are_found_or_missed():
    np.testing.assert_array_equal(rows_at(0.1 * np.arange(11), 0.5 * np.arange(3)), [0, 5, 10])
    with pytest.raises(ValueError, match=r"no sample at 0.5 s"):
        rows_at(0.2 * np.arange(11), 0.5 * np.arange(3))


def test_the_reference_of_a_free_fall_knows_itself_to_rounding():
    truth = ReferenceTruth(falling(), 1.0, 0.1, 0.1)
    # Positions of 5 m after up to 2,000 substeps, each rounded: 2e3 * 5 * 1.1e-16, and twice that for two runs.
    assert truth.floors["position"] <= 2.2e-12
    assert truth.scale == pytest.approx(math.hypot(1.0, 0.5 * G), rel=1e-12)
    assert "reference at 50 ms" in truth.text


@pytest.mark.parametrize(
    ("values", "names"), [({"error": 3}, "Truth.error"), ({"own_error": -1.0}, "own_error"), ({"scale": 0.0}, "scale")]
)
def test_a_truth_is_checked(values, names):
    with pytest.raises(ValueError, match=names):
        Truth(**{"error": lambda seen: 0.0, **values})


# --- answers -------------------------------------------------------------------------------------------------------


def test_cheapest_is_the_quickest_that_is_shown_to_be_good_enough():
    found = made([point("a", 0.01, 1e-3, 1.0), point("a", 0.005, 1e-5, 2.0), point("b", 0.01, 1e-6, 3.0)], 1e-7)
    assert found.cheapest(1e-4) is found.points[1]
    assert found.cheapest(1e-8) is None
    assert "truth itself is known to 1e-07" in found.advice(1e-8)
    assert found.advice(1e-4) == "below 0.0001 m: a at 5 ms, error 1e-05, 2000000 µs per s"
    assert "the best is b at 10 ms, error 1e-06" in found.advice(5e-7)


# A crate dropped on a ramp at `balanced`, as measured: at 10 ms its last bounce ends by luck where the truth has it.
LUCKY = [(0.02, 7.4e-3), (0.01, 1.3e-7), (0.005, 4.8e-4), (0.002, 4.6e-4), (0.001, 3e-7)]


def test_a_step_is_advised_only_if_all_finer_steps_of_its_setting_are_good_too():
    found = made([point("balanced", dt, error, 1e-3 / dt) for dt, error in LUCKY])
    assert found.cheapest(1e-4).dt == 0.001
    assert found.cheapest(1e-3).dt == 0.01
    told = found.advice(1e-4)
    assert told.startswith("below 0.0001 m: balanced at 1 ms, error 3e-07")
    assert told.endswith("; not balanced at 10 ms, error 1.3e-07 by luck: the finer step of 5 ms has 0.00048")
    assert found.advice(1e-3) == "below 0.001 m: balanced at 10 ms, error 1.3e-07, 100000 µs per s"


def test_a_lucky_step_is_named_where_no_step_can_be_advised():
    found = made([point("balanced", dt, error, 1e-3 / dt) for dt, error in LUCKY[:-1]])
    assert found.cheapest(1e-4) is None
    assert "no setting that was measured at all its finer steps; not balanced at 10 ms" in found.advice(1e-4)


def test_a_finer_step_that_is_lost_is_not_good():
    found = made([point("a", 0.01, 1e-6, 1.0), point("a", 0.005, 1e-6, 2.0, is_lost=True), point("b", 0.01, 1e-5, 9.0)])
    assert found.cheapest(1e-4).setting == "b"
    assert "the finer step of 5 ms is lost" in found.advice(1e-4)


def test_cheapest_takes_nothing_that_is_lost_and_says_when_all_are():
    found = made([point("a", 0.01, 1e-3, 1.0, is_lost=True)])
    assert found.cheapest(1.0) is None
    assert "all of them are lost" in found.advice(1.0)
    assert found.lost_from("a") == 0.01


def test_points_at_the_floor_are_known():
    found = made([point("a", 0.01, 1e-9, 1.0), point("a", 0.005, 1e-7, 2.0)], 1e-8)
    assert [found.is_at_floor(p) for p in found.points] == [True, False]


def test_engines_are_told_apart():
    found = made([point("default", 0.01, 1e-3, 1.0, engine="other"), point("fast", 0.01, 1e-4, 2.0)])
    assert found.cheapest(1e-2).engine == "other"
    assert found.cheapest(1e-2, engine="rigid-env").setting == "fast"
    assert str(found.points[0]) == "other default at 10 ms"
    assert found.families() == (("other", "default"), ("rigid-env", "fast"))


def test_a_measure_or_setting_that_is_not_there_is_named():
    found = made([point("a", 0.01, 1e-9, 1.0)])
    with pytest.raises(ValueError, match=r"measure is 'speed'; allowed are pose, energy"):
        found.cheapest(1.0, "speed")
    with pytest.raises(ValueError, match=r"'b'.*allowed are those measured: rigid-env a"):
        found.order("b")
    with pytest.raises(ValueError, match="error is 0"):
        found.cheapest(0.0)
    assert found.error(found.points[0], "energy") == math.inf  # not taken


def test_a_result_can_be_written_and_read_by_people():
    found = made([point("a", 0.01, math.nan, 1.0, is_lost=True), point("a", 0.005, 0.1, 2.0)], is_complete=False)
    rows = json.loads(json.dumps(found.to_dict(), allow_nan=False))["points"]
    assert [row["errors"]["pose"] for row in rows] == [None, 0.1]
    assert [row["is_front"] for row in rows] == [False, True]
    assert "interrupted" in str(found)


def test_settings_have_names():
    assert setting_name("fast") == "fast"
    assert setting_name(Accuracy()) == "balanced"
    assert setting_name(Accuracy(scheme="rk4")) == "balanced(scheme='rk4')"


# --- a run ---------------------------------------------------------------------------------------------------------


def test_explicit_euler_in_free_fall_is_measured_for_what_it_is():
    steps = (0.1, 0.05, 0.02)
    found = physics.frontier(falling(), 1.05, physics.ladder([EULER, "balanced"], steps), repeats=2)
    assert found.duration == pytest.approx(1.0)  # the steps have 0.1 s in common
    euler = found.of(EULER)
    for p in euler:
        # Rounding of a hundred sums of up to 5 m.
        assert found.error(p, "position") == pytest.approx(0.5 * G * p.dt, abs=1e-13 * 100)
        assert p.errors["penetration"] == 0.0
        assert len(p.costs) == 2
        assert p.cost > 0.0
    assert found.order(EULER) == pytest.approx(1.0, abs=1e-9)
    assert found.plateau(EULER) is None
    assert found.lost_from(EULER) is None
    # Energy that explicit Euler makes of nothing: ½ m g² T h.
    assert euler[0].errors["energy"] == pytest.approx(0.5 * 2.0 * G * G * 0.1, rel=1e-10)
    assert all(found.is_at_floor(p) or found.error(p) < 1e-12 for p in found.of("balanced"))
    assert found.cheapest(1e-9).setting == "balanced"


def test_a_truth_of_ones_own():
    truth = Truth(lambda seen: abs(seen.pos[-1, 0, 1] + 0.5 * G * seen.t[-1] ** 2), "m", own_error=1e-12, scale=0.5 * G)
    found = physics.frontier(falling(), 1.0, [(EULER, 0.1), (EULER, 0.05)], truth, repeats=1)
    assert found.measure == "error"
    assert [found.error(p) for p in found.points] == pytest.approx([0.05 * G, 0.025 * G], rel=1e-12)
    assert found.own_error() == 1e-12
    bare = physics.frontier(falling(), 1.0, [("balanced", 0.1)], lambda seen: 100.0, repeats=1)
    assert not bare.points[0].is_lost  # nothing says how large what happens is
    lost = physics.frontier(falling(), 1.0, [("balanced", 0.1)], lambda seen: math.nan, repeats=1)
    assert lost.points[0].is_lost
    assert lost.front() == ()


def test_an_error_of_half_of_what_happens_is_lost():
    """Explicit Euler is behind by ½ g T h: with T = 2 h that is half of the fall ½ g T² itself."""
    found = physics.frontier(falling(), 1.0, [(EULER, 1.0), (EULER, 0.1)], repeats=1)
    assert [p.is_lost for p in found.points] == [True, False]
    assert found.lost_from(EULER) == 1.0


def test_an_interruption_keeps_what_is_done():
    told = []

    def stop(done, total, what):
        told.append((done, total, what))
        if len(told) == 4:
            raise KeyboardInterrupt

    settings = [("balanced", 0.1), ("balanced", 0.05), ("balanced", 0.025)]
    found = physics.frontier(falling(), 1.0, settings, repeats=2, progress=stop)
    assert not found.is_complete
    assert [p.dt for p in found.points] == [0.1, 0.05]
    assert all(p.cost > 0 for p in found.points)
    assert told[0][:2] == (0, 1 + 3 * 3)
    assert "truth" in told[0][2]


def test_progress_counts_every_run():
    told = []
    physics.frontier(falling(), 0.1, [("balanced", 0.1)], repeats=3, progress=lambda *now: told.append(now))
    assert [done for done, _, _ in told] == list(range(5))
    assert {total for _, total, _ in told} == {5}


@pytest.mark.parametrize(
    ("change", "names"),
    [
        ({"scene": 3}, "scene is 3"),
        ({"duration": -1.0}, "duration"),
        ({"duration": 0.05}, r"duration is 0.05 s; allowed are at least 0.1 s"),
        ({"settings": []}, "settings is empty"),
        ({"settings": [("balanced", 0.0)]}, r"settings\[0\] step"),
        ({"settings": [("balanced", 1e-9)]}, "allowed are steps from 1e-6"),
        ({"settings": ["balanced"]}, r"settings\[0\] is 'balanced'"),
        ({"settings": [("best", 0.1)]}, r"settings\[0\] is 'best'; allowed are fast"),
        ({"truth": 5}, "truth is 5"),
        ({"repeats": 0}, "repeats is 0"),
    ],
)
def test_mistakes_are_named_with_what_is_allowed(change, names):
    arguments = {"scene": falling(), "duration": 1.0, "settings": [("balanced", 0.1)], "repeats": 1, **change}
    with pytest.raises(ValueError, match=names):
        physics.frontier(**arguments)


def test_steps_have_a_time_in_common():
    assert frontier_run.common_times(1.0, [0.02, 0.01, 0.005]) == (1.0, 0.02)
    assert frontier_run.common_times(1.0, [0.03, 0.02]) == pytest.approx((0.96, 0.06))
    assert frontier_run.common_times(1.0, [1 / 240, 1 / 60]) == pytest.approx((1.0, 1 / 60))


def test_a_run_that_reports_trouble_says_so():
    """One sweep and no last resort: the corner's contact problems stay above the tolerance, and the point tells."""
    poor = Accuracy(solver="sweeps", iterations=1, tolerance=1e-12)
    contender = EngineContender(scenes.corner_drop(), poor, 0.02)
    traj = contender.watch(100)
    assert not traj.ok
    assert "samples: a contact problem kept a residual" in frontier_run._note(traj)


class Slow(EngineContender):
    """A contender that gives up."""

    engine = "snail"

    def watch(self, steps):
        raise TooSlow("a yard an hour")


def test_who_is_too_slow_is_left_out_and_named():
    ours, slow = (kind(falling(), Accuracy(), 0.1) for kind in (EngineContender, Slow))
    found = frontier_run.measure([slow, ours], falling(), 1.0, repeats=1)
    assert [p.engine for p in found.points] == ["rigid-env"]
    assert found.skipped == ("snail balanced, 100 ms: a yard an hour",)
    assert found.is_complete
    assert found.to_dict()["skipped"] == list(found.skipped)


def test_without_a_contender_of_ours_a_truth_is_needed():
    with pytest.raises(ValueError, match="truth is None, and no contender is of our engine"):
        frontier_run.measure([Slow(falling(), Accuracy(), 0.1)], falling(), 1.0, repeats=1)
