"""NumPy functions of a task: their order, what they see, and what happens when one gives what it may not."""

from __future__ import annotations

import sys
import warnings

import numpy as np
import pytest

import physics
from benchmarks.numpy_reach import NumpyReach
from physics.kernels.state import layout as at
from physics.world.materials import wall_coefficients
from rigid_env.envs.checks import CheckError, check_task
from rigid_env.envs.env import RigidEnv
from rigid_env.envs.task import TaskEnv, TaskVectorEnv
from rigid_env.envs.vector_env import RigidVectorEnv
from rigid_env.tasks import BlockReach, BlockReorient, Choice, Entry, Push, Task, Uniform, Wrench, observe
from rigid_env.tasks.parameters import LENGTHS
from tests.tasks.conftest import Free, Slide, started

pytestmark = pytest.mark.interpreted


def state_of(task: Task) -> list:
    """All that decides how a task goes on."""
    arrays = [*task.world.kept(), task.action, task.previous_action, task.outcome, task.obs, task.status, task.steps]
    return [array.copy() for array in (*arrays, *task.memory_arrays.values())]


# --- the same as compiled -------------------------------------------------------------------------------------


@pytest.mark.compiled
def test_block_reach_in_numpy_is_block_reach():
    compiled, plain = RigidVectorEnv(BlockReach(8)), RigidVectorEnv(NumpyReach(8))
    ours, theirs = compiled.reset(seed=1)[0], plain.reset(seed=1)[0]
    actions = np.random.default_rng(2).uniform(-1.0, 1.0, (120, 8, 6))
    for k in range(120):
        # Observations are float32 of the same numbers, some rounded twice; rewards differ by a few roundings of terms
        # of up to 10, the potential at a distance of 20 m.
        np.testing.assert_allclose(theirs, ours, rtol=3e-7, atol=3e-7)
        (ours, r, *ends, i), (theirs, s, *other_ends, j) = compiled.step(actions[k]), plain.step(actions[k])
        np.testing.assert_allclose(s, r, rtol=0, atol=1e-13)
        np.testing.assert_array_equal(ends, other_ends)
        assert {key for key in j if not key.startswith("_")} == {key for key in i if not key.startswith("_")}
        for key in ("distance", "reward_progress", "reward_effort"):
            np.testing.assert_allclose(j[key], i[key], rtol=1e-12, atol=1e-13)


# --- what functions see ---------------------------------------------------------------------------------------


def test_functions_are_called_once_a_step_in_their_order():
    calls = []

    def told(name, value=None):
        def function(self, worlds):
            calls.append((name, len(worlds)))
            return value(worlds) if value else None

        return function

    flags = lambda worlds: np.zeros(len(worlds), dtype=bool)  # noqa: E731
    names = {"begin": None, "update": None, "success": flags, "failure": flags}
    numbers = {name: lambda worlds: {"a": worlds.pos[:, 0, 0]} for name in ("measure", "rewards")}
    body = {name: told(name, value) for name, value in {**names, **numbers}.items()}
    entry = Entry("x", "m", -1, 1, lambda worlds: calls.append(("read", len(worlds))) or worlds.pos[:, 0, 0])
    task = type("Told", (Slide,), {**body, "observation": (entry,)})(3)
    calls.clear()
    started(task)
    assert calls == [("measure", 3), ("begin", 3), ("read", 3)]
    calls.clear()
    task.step(np.zeros((3, 1)))
    assert calls == [(name, 3) for name in ("measure", "update", "success", "failure", "rewards", "read")]
    calls.clear()
    task.start(np.array([1]))
    assert calls == [("measure", 1), ("begin", 1), ("read", 1)]


def test_rotation_gaps_and_forces_are_what_they_say():
    class Resting(Slide):
        observation = (observe.rotation(), observe.wall_gaps(walls=1), observe.contact_force())

        def rewards(self, worlds):
            self.seen = worlds
            return {}

    task = started(Resting(2))
    for _ in range(20):
        task.step(np.zeros((2, 1)))
    seen = task.seen
    weight = 3.0 * 9.81
    np.testing.assert_array_equal(seen.rotation[:, 0], np.tile(np.eye(3), (2, 1, 1)))
    # The block rests within the slop of `balanced`, and its contacts carry its weight to the solver's tolerance.
    np.testing.assert_allclose(seen.wall_gaps, 0.0, atol=1e-3)
    np.testing.assert_allclose(seen.contact_force[:, 0], [[0.0, weight, 0.0]] * 2, atol=1e-3 * weight)
    np.testing.assert_allclose(seen.weight, weight)
    assert seen.time.tolist() == [20 * task.control_dt] * 2


def test_contact_forces_between_bodies_oppose_each_other():
    class Stack(Task):
        scene = physics.Scene(
            [physics.Block((2, 1, 2), 3.0, pos=(0, 0.5, 0)), physics.Block((2, 1, 2), 5.0, pos=(0, 1.5, 0))],
            [physics.HalfSpace((0, 1, 0), 0.0)], [physics.Gravity(), physics.Contact(), physics.Friction(0.5)],
        )  # fmt: skip
        observation = (observe.contact_force(0), observe.contact_force(1))

        def rewards(self, worlds):
            self.force = worlds.contact_force.copy()
            return {}

    task = started(Stack())
    for _ in range(40):
        task.step(np.zeros((1, 6)))
    # On the lower block: both weights from below, the upper one's from above: its own weight in all.
    np.testing.assert_allclose(task.force[0], [[0, 3.0 * 9.81, 0], [0, 5.0 * 9.81, 0]], atol=1e-2 * 8.0 * 9.81)


def test_drawn_parameters_reach_the_world_and_the_info():
    class Drawn(Slide):
        draws = {"mass": (2.0, 4.0), "restitution": 0.0, "goal": (1.0, 2.0)}  # noqa: RUF012
        scene = physics.Scene(Slide.scene.bodies, Slide.scene.walls, [physics.Gravity(), physics.Contact(0.5)])

    envs = TaskVectorEnv(4, task=Drawn)
    _, infos = envs.reset(seed=3)
    assert ((infos["mass"] >= 2.0) & (infos["mass"] <= 4.0)).all()
    assert len(set(infos["mass"])) == 4
    np.testing.assert_allclose(envs.task.weights[:, 0], infos["mass"] * 9.81, rtol=1e-14)
    goals = infos["goal"]
    _, infos = envs.reset(seed=3, options={"mass": 2.5})
    assert infos["mass"].tolist() == [2.5] * 4
    np.testing.assert_array_equal(infos["goal"], goals)  # the other draws of a seed stay
    envs.set_attr("goal", 1.5)
    assert envs.reset(seed=4)[1]["goal"].tolist() == [1.5] * 4


def test_a_parameter_of_one_body_leaves_the_others():
    class Two(Task):
        scene = physics.Scene([physics.Sphere(0.5, 1.0, pos=(3.0 * b, 0, 0)) for b in range(2)], effects=[])
        actions = Wrench(1)
        observation = (observe.pos(0), observe.pos(1))
        draws = {"mass[1]": (2.0, 4.0)}  # noqa: RUF012

    task = started(Two(3))
    masses = task.weights / 9.81
    np.testing.assert_array_equal(masses[:, 0], 1.0)
    np.testing.assert_allclose(masses[:, 1], task.drawn["mass[1]"], rtol=1e-14)


class Named(Task):
    """Two balls over a floor: coefficients of one of them and of the floor, by their names."""

    scene = physics.Scene(
        [physics.Sphere(0.5, 1.0, pos=(3.0 * b, 0.5, 0), name=name) for b, name in enumerate(("die", "other"))],
        [physics.HalfSpace((0, 1, 0), name="floor", friction=0.3), physics.HalfSpace((1, 0, 0), -9.0)],
        [physics.Gravity(), physics.Contact(0.5), physics.Friction(0.5)],
    )
    actions = Wrench(1)
    observation = (observe.pos(0), observe.pos(1))
    draws = {"friction[die]": (0.2, 0.4), "wall_friction[floor]": (0.5, 0.9), "restitution[1]": (0.1, 0.2)}  # noqa: RUF012


def test_coefficients_of_a_named_body_and_wall_are_drawn():
    task = started(Named(3))
    params = task.world.params.reshape(3, 2, -1)
    np.testing.assert_array_equal(params[:, 0, at.FRICTION], task.drawn["friction[die]"])
    np.testing.assert_array_equal(params[:, 1, at.FRICTION], 0.5)
    np.testing.assert_array_equal(params[:, 1, at.RESTITUTION], task.drawn["restitution[1]"])
    walls = wall_coefficients(params[:, 1], task.world.plan)["friction"]
    np.testing.assert_array_equal(walls[:, 0], task.drawn["wall_friction[floor]"])
    assert np.isnan(walls[:, 1]).all()
    assert len(set(walls[:, 0])) == 3
    task.hold("wall_friction[floor]", 0.7)
    np.testing.assert_array_equal(walls[:, 0], 0.7)
    text = TaskEnv(Named).describe()
    assert "Coulomb coefficient of wall floor" in text
    assert "Coulomb coefficient of body die" in text


@pytest.mark.parametrize(
    ("draws", "words"),
    [
        (
            {"friction[dei]": 0.1},
            r"draws of Wrong: 'dei' in 'friction\[dei\]' is none of the bodies; allowed are die, ",
        ),
        ({"mass[2]": 1.0}, r"'2' in 'mass\[2\]' is none of the bodies; allowed are die, other, and 0 to 1"),
        ({"wall_friction[2]": 1.0}, r"'2' in 'wall_friction\[2\]' is none of the walls; allowed are floor, and 0"),
        ({"friction[die]": 0.1, "friction[0]": 0.2}, r"has 'friction\[die\]' and 'friction\[0\]'; allowed is one"),
        ({"wall_friction[floor]": (-1.0, 0.2)}, r"draws wall_friction\[floor\] of Wrong is \[-1. *, 0.2\]; allowed"),
    ],
)
def test_wrong_names_of_bodies_and_walls_are_refused(draws, words):
    kind = type("Wrong", (Named,), {"draws": draws})
    with pytest.raises(ValueError, match=words):
        kind(1)


class Mixed(Free):
    """A block and a ball."""

    scene = physics.Scene([physics.Block((2, 1, 1), 3.0), physics.Sphere(0.5, 2.0, pos=(9, 0, 0))])
    draws = {"radius[1]": (0.2, 0.4), "goal": (-1.0, 1.0)}  # noqa: RUF012


def test_the_radius_of_a_sphere_is_drawn_by_a_pair():
    """It is told, goes to the world with the inertia that follows from it, and can be fixed and held."""
    envs = TaskVectorEnv(3, task=Mixed)
    _, infos = envs.reset(seed=0)
    radius = infos["radius[1]"]
    assert ((radius > 0.2) & (radius < 0.4)).all()
    assert len(set(radius)) == 3
    params = envs.task.world.params.reshape(3, 2, -1)
    np.testing.assert_allclose(params[:, 1, at.DIMENSIONS : at.DIMENSIONS + 3], radius[:, None] * np.ones(3))
    np.testing.assert_allclose(1.0 / params[:, 1, at.INV_INERTIA], 0.4 * 2.0 * radius**2)
    np.testing.assert_allclose(params[:, 0, at.DIMENSIONS : at.DIMENSIONS + 3], [[1.0, 0.5, 0.5]] * 3)
    _, again = envs.reset(seed=0, options={"radius[1]": [0.3, 0.7, 1.0]})
    np.testing.assert_allclose(params[:, 1, at.DIMENSIONS], [0.3, 0.7, 1.0])
    np.testing.assert_array_equal(again["goal"], infos["goal"])
    envs.set_attr("radius[1]", [0.6] * 3)
    np.testing.assert_allclose(params[:, 1, at.DIMENSIONS], 0.6)
    assert "radius of a sphere [m] of body 1" in TaskEnv(Mixed).describe()


@pytest.mark.parametrize(
    ("draws", "words"),
    [
        ({"radius[1]": -1.0}, "draws radius.1. of Mixed is"),
        ({"radius": (0.2, 0.4)}, "'radius', and body 0 is a Block; allowed is 'radius.b.' for a sphere b"),
        ({"radius[0]": 0.3}, "'radius.0.', and body 0 is a Block"),
        ({"radius[1]": 0.3, "size[1]": (1.0, 1.0, 1.0)}, "'size.1.' and 'radius.1.' of body 1; allowed is one"),
        ({"size[1]": ((1.0,) * 3, (2.0,) * 3)}, "body 1 is a Sphere, of one diameter; allowed is 'radius.1.' with"),
    ],
)
def test_sizes_that_a_body_cannot_have_are_refused(draws, words):
    with pytest.raises(ValueError, match=words):
        type("Mixed", (Mixed,), {"draws": draws})()


def test_sizes_of_a_capsule_are_whole_sizes():
    """Two of three numbers are equal: they cannot be drawn one by one, but whole sizes can."""

    class Rod(Free):
        scene = physics.Scene([physics.Capsule(0.5, 1.0, 3.0)])
        draws = {"size": Choice([(1.0, 2.0, 1.0), (0.6, 3.0, 0.6)]), "goal": (-1.0, 1.0)}  # noqa: RUF012

    envs = TaskVectorEnv(8, task=Rod)
    envs.reset(seed=0)
    sizes = 2.0 * envs.task.world.params[:, at.DIMENSIONS : at.DIMENSIONS + 3]
    assert {tuple(size) for size in sizes.round(9).tolist()} == {(1.0, 2.0, 1.0), (0.6, 3.0, 0.6)}
    rods = [physics.Capsule(0.5 * d, whole - d, 3.0) for d, whole, _ in sizes.tolist()]
    np.testing.assert_allclose(1.0 / envs.task.world.params[:, at.INV_INERTIA], [rod.inertia[0, 0] for rod in rods])
    drawn = {"size": ((1.0, 2.0, 1.0), (1.2, 3.0, 1.2))}
    with pytest.raises(ValueError, match="body 0 is a Capsule, of two equal diameters; allowed is Choice"):
        type("Rod", (Rod,), {"draws": drawn})()
    with pytest.raises(ValueError, match="'radius', and body 0 is a Capsule"):
        type("Rod", (Rod,), {"draws": {"radius": (0.2, 0.4)}})()


def test_sizes_of_a_cylinder_are_whole_sizes():
    class Coin(Free):
        scene = physics.Scene([physics.Cylinder(0.5, 0.1, 3.0)])
        draws = {"size": ((1.0, 2.0, 1.0), (1.2, 3.0, 1.2)), "goal": (-1.0, 1.0)}  # noqa: RUF012

    with pytest.raises(ValueError, match="body 0 is a Cylinder, of two equal diameters; allowed is Choice"):
        Coin()


def test_memory_starts_at_zero_and_is_kept_from_step_to_step():
    class Counting(Slide):
        memory = {"count": 1, "last": 3}  # noqa: RUF012

        def begin(self, worlds):
            assert not worlds.memory["count"].any()
            worlds.memory["last"][:] = worlds.pos[:, 0]

        def update(self, worlds):
            worlds.memory["count"] += 1.0

    task = started(Counting(3))
    for _ in range(4):
        task.step(np.zeros((3, 1)))
    task.start(np.array([1]))
    assert task.memory_arrays["count"].tolist() == [4.0, 0.0, 4.0]
    assert task.memory_arrays["last"].shape == (3, 3)


def test_previous_actions_are_those_of_the_step_before():
    class Looking(Slide):
        observation = (observe.previous_action(1),)

    env = TaskEnv(Looking)
    env.reset(seed=0)
    seen = [env.step(np.array([action]))[0].item() for action in (0.5, -0.25, 2.0, 0.0)]
    assert seen == [0.0, 0.5, -0.25, 1.0]  # clipped


def test_failure_and_success_end_an_episode_and_success_alone_is_success():
    class Ending(Slide):
        draws = {"fails": 0.0}  # noqa: RUF012

        def success(self, worlds):
            return (worlds.steps >= 3) & (worlds.drawn["fails"] == 0.0)

        def failure(self, worlds):
            return (worlds.steps >= 2) & (worlds.drawn["fails"] == 1.0)

    envs = TaskVectorEnv(2, task=Ending, autoreset_mode="Disabled")
    envs.reset(seed=0, options={"fails": np.array([0.0, 1.0])})
    for _ in range(2):
        _, _, ends, _, infos = envs.step(np.zeros((2, 1)))
    assert ends.tolist() == [False, True]
    assert infos["is_success"].tolist() == [False, False]
    envs.reset(options={"reset_mask": ends})
    _, _, ends, _, infos = envs.step(np.zeros((2, 1)))
    assert ends.tolist() == infos["is_success"].tolist() == [True, False]


# --- what may not be ------------------------------------------------------------------------------------------


def wrong(**body) -> type[Task]:
    return type("Wrong", (Slide,), body)


MADE = {
    "two-entries": (wrong(observation=(observe.pos(), observe.pos())), ("two entries", "'position x'")),
    "no-entry": (wrong(observation=("pos",)), ("observation", "'pos'", "Entry")),
    "no-read": (wrong(observation=(Entry("x", "m", -1, 1),)), ("read", "'x'", "None")),
    "shape": (wrong(observation=(Entry("x", "m", -1, 1, lambda w: np.ones((1, 2))),)), ("'x'", "(1, 2)", "number")),
    "no-body": (wrong(actions=Wrench(2)), ("body", "2", "0 to 0")),
    "place": (wrong(place=lambda self, drawn: {"position": 0}), ("place of Wrong", "'position'", "pos, quat")),
    "wall": (wrong(place=lambda self, drawn: {"pos": (0, -3, 0)}), ("place of Wrong", "inside walls[0]")),
    "flags": (wrong(success=lambda self, w: w.pos[:, 0, 0]), ("success of Wrong", "float64", "bools")),
    "rewards": (wrong(rewards=lambda self, w: w.pos[:, 0, 0]), ("rewards of Wrong", "dict")),
    "draw": (wrong(draws={"friction": (0.1, 0.5)}), ("friction", "physics.Friction")),
    "ends": (wrong(draws={"goal": (2.0, 1.0)}), ("draws goal", "(2.0, 1.0)")),
    "memory": (wrong(memory={"a": 0}), ("memory a", "0")),
    "scene": (wrong(scene="box"), ("scene of Wrong", "'box'")),
}  # fmt: skip


@pytest.mark.parametrize("name", MADE)
def test_a_wrong_declaration_is_refused_when_it_is_made(name):
    task, words = MADE[name]
    with pytest.raises(ValueError, match=r"allowed|add") as error:
        started(task())
    assert all(word in str(error.value) for word in words), str(error.value)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"low": 1, "high": -1}, ("'x'", "low 1", "high -1")),
        ({"scale": 0.0}, ("scale", "'x'", "0")),
        ({"low": "a"}, ("low", "'x'", "'a'")),
        ({"read": 3}, ("read", "'x'", "3")),
        ({"name": ""}, ("name", "''")),
    ],
)
def test_a_wrong_entry_is_refused(arguments, words):
    with pytest.raises(ValueError, match="allowed") as error:
        Entry(**{"name": "x", "unit": "m", "low": -1, "high": 1, **arguments})
    assert all(word in str(error.value) for word in words), str(error.value)


class Exploding(Slide):
    """Gives what it may not after the third step."""

    memory = {"count": 1}  # noqa: RUF012
    fault = "nan"

    def update(self, worlds):
        worlds.memory["count"] += 1.0

    def rewards(self, worlds):
        late = worlds.steps > 3
        if self.fault == "error" and late.any():
            raise RuntimeError("a fault of the user's own")
        if self.fault == "name" and late.any():
            return {"other": worlds.pos[:, 0, 0]}
        if self.fault == "shape" and late.any():
            return {"bonus": np.zeros(7)}
        return {"bonus": np.where(late & (worlds.indices == 1), np.nan if self.fault == "nan" else 0.0, 1.0)}


@pytest.mark.parametrize(
    ("fault", "kind", "words"),
    [
        ("nan", ValueError, ("reward term 'bonus'", "nan", "world 1", "finite")),
        ("name", ValueError, ("rewards of Exploding", "other", "bonus")),
        ("shape", ValueError, ("'bonus'", "rewards of Exploding", "(2,)")),
        ("error", RuntimeError, ("a fault of the user's own",)),
    ],
)
def test_after_a_wrong_reward_nothing_has_changed(fault, kind, words):
    task = started(type("Exploding", (Exploding,), {"fault": fault})(2))
    twin = started(type("Twin", (Exploding,), {"fault": "none"})(2))
    push = np.ones((2, 1))
    for _ in range(3):
        task.step(push)
        twin.step(push)
    before, time = state_of(task), task.world.time
    with pytest.raises(kind) as error:
        task.step(0.5 * push)
    assert all(word in str(error.value) for word in words), str(error.value)
    assert task.world.time == time
    for ours, kept in zip(state_of(task), before):
        np.testing.assert_array_equal(ours, kept)
    task.fault = "none"
    task.step(push)
    twin.step(push)
    np.testing.assert_array_equal(task.world.state, twin.world.state)


@pytest.mark.parametrize("value", [np.inf, -np.inf, np.nan])
@pytest.mark.parametrize("is_late", [False, True])
def test_an_entry_that_is_not_finite_is_refused_though_clipping_would_hide_it(value, is_late):
    """At the start of an episode, and in a step; nothing has changed then."""

    class Far(Slide):
        observation = (
            observe.pos(),
            Entry("way", "m", -9, 9, lambda worlds: np.where(worlds.steps > (2 if is_late else -1), value, 0.0)),
        )

    task, still = Far(2), np.zeros((2, 1))
    if is_late:
        started(task)
        task.step(still)
        task.step(still)
    before = state_of(task)
    with pytest.raises(ValueError, match=rf"observation 'way' of Far is {value} in world 0; allowed are finite"):
        task.step(still) if is_late else started(task)
    for ours, kept in zip(state_of(task), before):
        np.testing.assert_array_equal(ours, kept)


class Tumbled(Free):
    """A block in any attitude: four numbers, normalised. Those in the middle of their range are 0."""

    draws = {"attitude": Uniform((-1,) * 4, (1,) * 4), "mass": (2.0, 4.0)}  # noqa: RUF012

    def place(self, drawn):
        return {"quat": drawn["attitude"] / np.linalg.norm(drawn["attitude"], axis=1, keepdims=True)}


def test_a_rehearsal_takes_drawn_values_and_leaves_nothing():
    """Not the middles of ranges, which an episode may never meet."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        task = Tumbled(2)
    assert task.drawn["attitude"].tolist() == [[0.0] * 4] * 2  # before the first episode
    assert task.drawn["mass"].tolist() == [3.0] * 2
    np.testing.assert_allclose(1.0 / task.world.params[:, at.INV_MASS], 6.0, rtol=1e-12)  # of the scene
    started(task)
    np.testing.assert_allclose(np.linalg.norm(task.world.quat[:, 0], axis=1), 1.0)


@pytest.mark.parametrize("kind", [ValueError, ZeroDivisionError])
def test_an_error_of_a_rehearsal_says_that_it_is_one_and_what_was_drawn(kind):
    class Rehearsed(Tumbled):
        def rewards(self, worlds):
            raise kind("a mistake")

    with pytest.raises(kind) as error:
        Rehearsed()
    told = "".join((str(error.value), *getattr(error.value, "__notes__", ())))
    assert "a mistake" in told
    if kind is ValueError or sys.version_info >= (3, 11):
        assert "in the rehearsal of Rehearsed, when it is made, with mass = " in told
        assert "attitude = [" in told


def test_numbers_of_a_wrong_shape_are_told_before_another_function_reads_them():
    """Not as the error of NumPy's that the other function ends with."""

    class Crooked(Slide):
        def measure(self, worlds):
            return {"way": np.zeros((len(worlds), 3))}

        def success(self, worlds):
            return worlds.measured["way"] < worlds.pos[:, 0, 0]

    with pytest.raises(ValueError, match=r"'way' of measure of Crooked is of float64 in shape \(2, 3\); allowed are"):
        Crooked()


def test_an_unknown_setting_is_refused_with_the_nearest_name():
    with pytest.raises(TypeError, match=r"'acuracy'.*allowed are accuracy"):
        TaskEnv(Free, acuracy="fast")
    with pytest.raises(ValueError, match=r"'nowhere:Task'.*module:Class"):
        TaskEnv("nowhere:Task")
    with pytest.raises(ValueError, match="draws has the key 'gaol'"):
        TaskEnv(wrong(draws={"goal": 1.0}), draws={"gaol": 2.0})


# --- checks ---------------------------------------------------------------------------------------------------


@pytest.mark.compiled
@pytest.mark.parametrize("task", [BlockReach, BlockReorient, NumpyReach, Slide, "tests.tasks.conftest:Free"])
def test_tasks_pass_their_checks(task):
    check_task(task, contexts=("fork",))


def test_a_check_finds_numbers_that_depend_on_the_batch():
    class Crowd(Slide):
        def rewards(self, worlds):
            return {"crowd": np.full(len(worlds), float(len(worlds)))}

    with pytest.raises(CheckError, match=r"reward differs by 2.*world 0, step 0"):
        check_task(Crowd, contexts=())


def test_a_check_finds_random_numbers_that_no_seed_fixes():
    class Noisy(Slide):
        def rewards(self, worlds):
            return {"noise": np.random.default_rng().random(len(worlds))}

    with pytest.raises((CheckError, AssertionError)):
        check_task(Noisy, contexts=())


class Pushed(Slide):
    draws = {"goal": (-1.0, 1.0)}  # noqa: RUF012
    disturbances = (Push(0, 0.5, 100.0),)  # none would be due in the steps of the check, if it did not see to it


def test_a_check_finds_later_episodes_that_depend_on_the_mode_of_starting_anew(monkeypatch):
    """As they do where an ended world draws a push in the step that starts it anew."""
    check_task(Pushed, steps=6, contexts=())
    monkeypatch.setattr(RigidVectorEnv, "_generators_of_ended", lambda envs: [])
    with pytest.raises(CheckError, match=r"drawn goal differs by .*world 0, step 1, autoreset_mode 'NextStep'"):
        check_task(Pushed, steps=6, contexts=())


def test_the_parameters_keep_their_order():
    assert list(RigidEnv(BlockReach(1)).task.drawn) == [*LENGTHS, "place", "yaw", "face", "goal"]
