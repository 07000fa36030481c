"""Springs between bodies: normal modes, Newton's third law, and the same in every kernel that knows them."""

from __future__ import annotations

import math

import numpy as np
import pytest

import physics
from physics.rotations import rotation_matrices

pytestmark = pytest.mark.interpreted

G = 9.81
STEPS = np.array([0.04, 0.02, 0.01, 0.005])
PAIR = [
    physics.Block((0.5, 0.3, 0.2), 2.0, angvel=(1, 2, 3)),
    physics.Ellipsoid((0.2, 0.3, 0.4), 3.0, pos=(1.3, 0.2, 0), linvel=(0, 1, 0), angvel=(0, 2, 1)),
]


def tied(**changes) -> physics.Spring:
    """From a corner of the first body to a point of the second."""
    given = {"anchor": (0.1, 0.1, 0.2), "point": (0.1, 0.15, -0.1), "stiffness": 40.0, "length": 1.0, "other": 1}
    return physics.Spring(**{**given, **changes})


def end(scene, duration, dt, accuracy="balanced") -> physics.World:
    world = physics.World(scene, dt=dt, accuracy=accuracy)
    world.step(steps=round(duration / dt))
    return world


def orders(scene, duration, error) -> float:
    errors = [error(end(scene, duration, dt)) for dt in STEPS]
    return np.polyfit(np.log(STEPS), np.log(errors), 1)[0]


@pytest.mark.parametrize("mode", [1, -1])
def test_two_masses_between_two_anchors_swing_in_their_normal_modes(mode):
    """Springs k, c, k along a line: ω² = k/m where both go the same way, (k + 2 c)/m where against each other."""
    k, c, m, size, t = 30.0, 12.0, 2.0, 0.2, 2.0
    balls = [physics.Sphere(0.1, m, pos=(x + s * size, 0, 0)) for x, s in ((-1.0, mode), (1.0, 1))]
    springs = [
        physics.Spring((-3, 0, 0), stiffness=k, length=2.0, body=0),
        physics.Spring((3, 0, 0), stiffness=k, length=2.0, body=1),
        physics.Spring(stiffness=c, length=2.0, body=0, other=1),
    ]
    rate = math.sqrt((k + (1 - mode) * c) / m)

    def error(world):
        swing = size * math.cos(rate * t)
        return np.abs(world.pos[0, :, 0] - [-1 + mode * swing, 1 + swing]).max()

    scene = physics.Scene(balls, effects=springs)
    assert orders(scene, t, error) == pytest.approx(2.0, abs=0.1)
    assert error(end(scene, t, 0.1, "precise")) < 1e-8


def test_a_damped_pair_swings_as_its_reduced_mass():
    """μ s'' = -k (s - l) - c s', μ = m1 m2/(m1 + m2); the centre of mass falls."""
    k, c, t = 50.0, 0.8, 2.0
    masses, start = (1.0, 3.0), 1.3
    balls = [physics.Sphere(0.1, m, pos=(0, y, 0)) for m, y in zip(masses, (0.0, start))]
    spring = physics.Spring(stiffness=k, damping=c, length=1.0, body=1, other=0)
    reduced = masses[0] * masses[1] / sum(masses)
    decay = c / (2 * reduced)
    rate = math.sqrt(k / reduced - decay**2)
    stretch = 0.3 * math.exp(-decay * t) * (math.cos(rate * t) + decay / rate * math.sin(rate * t))
    centre = start * masses[1] / sum(masses) - G * t * t / 2

    def error(world):
        y = world.pos[0, :, 1]
        assert y @ masses / sum(masses) == pytest.approx(centre, abs=1e-11)
        return abs(y[1] - y[0] - 1.0 - stretch)

    scene = physics.Scene(balls, effects=[physics.Gravity((0, -G, 0)), spring])
    assert orders(scene, t, error) == pytest.approx(2.0, abs=0.1)
    assert error(end(scene, t, 0.1, "precise")) < 1e-8


def totals(world):
    """Momentum, angular momentum about the origin and energy of all bodies."""
    found = physics.diagnose(world)
    turning = np.cross(world.pos[0], found.momentum[0]) + found.angular_momentum[0]
    return found.momentum[0].sum(0), turning.sum(0), found.energy.sum()


def test_momentum_and_angular_momentum_are_kept_to_rounding_and_energy_without_drift(is_exhaustive):
    """Between tumbling bodies, at their corners. Up to 4000 steps of rounding errors of some 1e-16 each."""
    duration, spreads = 20 if is_exhaustive else 8, []
    for dt in (0.01, 0.005):
        world = physics.World(physics.Scene(PAIR, effects=[tied()]), dt=dt)
        momentum, turning, energy = totals(world)
        energies = []
        for _ in range(round(duration / dt) // 10):
            world.step(steps=10)
            energies.append(totals(world)[2])
        assert totals(world)[0] == pytest.approx(momentum, abs=1e-12)
        assert totals(world)[1] == pytest.approx(turning, abs=1e-12)
        half = len(energies) // 2
        assert np.ptp(energies[half:]) < 1.5 * np.ptp(energies[:half])
        spreads.append(np.abs(np.array(energies) - energy).max())
    assert spreads[0] / spreads[1] == pytest.approx(4.0, abs=0.8)


def test_precise_keeps_every_integral_and_is_what_small_steps_come_to(is_exhaustive):
    """Tumbling bodies tied at their corners. Steps of 0.1 s and of 0.02 s differ by the tolerance, some 1e-10 each."""
    scene, t = physics.Scene(PAIR, effects=[tied()]), 2.0 if is_exhaustive else 1.0
    start = physics.World(scene, accuracy="precise")
    coarse, fine = end(scene, t, 0.1, "precise"), end(scene, t, 0.02, "precise")
    for before, after in zip(totals(start), totals(coarse)):
        assert after == pytest.approx(before, abs=1e-8)
    for name in ("pos", "quat", "linvel", "angvel"):
        assert getattr(coarse, name) == pytest.approx(getattr(fine, name), abs=1e-8)
    assert coarse.report.ok
    errors = [np.abs(end(scene, t, dt).pos - fine.pos).max() for dt in STEPS / 5]
    assert np.polyfit(np.log(STEPS), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.1)


def test_precise_takes_what_may_act_on_tied_bodies_besides(rng):
    """Gravity and a wrench: the centre of mass goes its parabola, whatever the spring."""
    force = rng.normal(size=(1, 2, 6))
    for accuracy in ("balanced", "precise"):
        world = physics.World(physics.Scene(PAIR, effects=[physics.Gravity((0, -G, 0)), tied()]), 1, 0.1, accuracy)
        masses = np.array([2.0, 3.0])
        place, speed = masses @ world.pos[0] / 5, masses @ world.linvel[0] / 5
        world.step(force, steps=5)
        a = force[0, :, :3].sum(0) / 5 + [0, -G, 0]
        assert masses @ world.pos[0] / 5 == pytest.approx(place + 0.5 * speed + 0.125 * a, abs=1e-9)


def test_forces_are_opposite_to_the_last_bit_and_half_the_energy_is_at_each_end(rng):
    spring = tied(damping=0.7)
    world = physics.World(physics.Scene([*PAIR, physics.Sphere(1, 1)], effects=[spring]), worlds=20)
    quat = rng.normal(size=(20, 3, 4))
    world.set_state(
        rng.normal(size=(20, 3, 3)), quat / np.linalg.norm(quat, axis=-1, keepdims=True),
        rng.normal(size=(20, 3, 3)), rng.normal(size=(20, 3, 3)),
    )  # fmt: skip
    wrenches, energies = physics.look_at(world)
    force, energies = wrenches.reshape(20, 3, 6)[..., :3], energies.reshape(20, 3)
    assert np.array_equal(force[:, 0], -force[:, 1])
    assert not force[:, 2].any()
    assert force[:, 0].all()
    R = rotation_matrices(world.quat)
    ends = [world.pos[:, b] + np.einsum("wij,j->wi", R[:, b], p) for b, p in enumerate((spring.point, spring.anchor))]
    stretch = np.linalg.norm(ends[0] - ends[1], axis=-1) - spring.length
    assert energies[:, 0] == pytest.approx(0.25 * spring.stiffness * stretch**2, rel=1e-12)
    assert np.array_equal(energies[:, 0], energies[:, 1])
    assert not energies[:, 2].any()


def test_without_strength_a_spring_between_bodies_leaves_every_bit():
    """Though it has the bodies advanced together, which without it are advanced one by one."""
    ends = []
    for extra in ((), (tied(stiffness=0.0),)):
        world = physics.World(physics.Scene(PAIR, effects=[physics.Gravity(), physics.Drag(), *extra]))
        world.step(steps=200)
        ends.append(world.state.tobytes())
        assert (world.plan.scheme.name == "springs between bodies") == bool(extra)
    assert ends[0] == ends[1]


BALLS = [physics.Sphere(0.3, 2.0, pos=(0, 0.3, 0)), physics.Sphere(0.3, 1.0, pos=(0, 1.5, 0))]


def test_bodies_that_may_touch_each_other_are_tied_as_those_that_may_not():
    """In the kernel of many bodies, out of contact: the same formulas, to rounding of a hundred steps."""
    bodies = [physics.Sphere(0.1, 2.0, pos=(0, 9, 0), angvel=(0, 1, 2)), physics.Sphere(0.1, 1.0, pos=(1.5, 9, 0))]
    effects = [physics.Gravity(), tied(damping=0.3)]
    alone = end(physics.Scene(bodies, effects=effects), 1.0, 0.01)
    both = end(physics.Scene(bodies, effects=[*effects, physics.Contact()]), 1.0, 0.01)
    assert alone.plan.scheme.name == "springs between bodies"
    assert both.plan.scheme.couples_bodies
    for name in ("pos", "quat", "linvel", "angvel"):
        assert getattr(both, name) == pytest.approx(getattr(alone, name), abs=1e-12)


@pytest.mark.parametrize("between", [True, False])
def test_a_mass_stands_on_a_spring_on_a_ball_on_the_floor(between):
    """Length l - m g/k; the floor carries both weights; at that length it stays."""
    k, length = 400.0, 1.0
    upper = 0.3 + length - 1.0 * G / k
    balls = [BALLS[0], physics.Sphere(0.3, 1.0, pos=(0, upper, 0))]
    spring = physics.Spring(stiffness=k, length=length, damping=1.0, body=1, other=0)
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(between_bodies=between), physics.Friction(), spring]
    world = physics.World(physics.Scene(balls, [physics.HalfSpace((0, 1, 0))], effects))
    world.step(steps=300)
    assert world.pos[0, :, 1] == pytest.approx([0.3, upper], abs=1e-9)
    _, forces = world.contacts()
    assert forces[:, 1].sum() == pytest.approx(3.0 * G, rel=1e-9)
    assert (world.plan.scheme.couples_bodies, world.plan.meeting) == (True, between)


def test_two_balls_pulled_together_collide_and_keep_their_momentum():
    """A strong spring without rest length through both centres: they meet, plastically, and stay together."""
    drift = (0.5, 1.0, 0)
    balls = [physics.Sphere(0.5, m, pos=(x, 0, 0), linvel=drift) for m, x in ((1.0, -1.5), (3.0, 1.5))]
    scene = physics.Scene(balls, effects=[physics.Contact(), physics.Spring(stiffness=50.0, other=1)])
    world = physics.World(scene, dt=0.005)
    momentum, turning, _ = totals(world)
    world.step(steps=400)
    assert totals(world)[0] == pytest.approx(momentum, abs=1e-11)
    assert totals(world)[1] == pytest.approx(turning, abs=1e-11)
    assert world.linvel[0] == pytest.approx(np.array([drift, drift]), abs=1e-5)  # to the tolerance of the contact solve
    assert world.pos[0, 1, 0] - world.pos[0, 0, 0] == pytest.approx(1.0, abs=1e-3)


def test_what_a_spring_between_bodies_costs_is_stored_only_where_there_is_one():
    one_way = physics.World(physics.Scene(PAIR, effects=[physics.Spring()]))
    both = physics.World(physics.Scene(PAIR, effects=[physics.Spring(), tied()]))
    assert both.params.shape[1] == one_way.params.shape[1] + 17
    assert {"middle", "load_linkedspring_1x17"} <= set(both.scratch[0].body.dtype.names)
    assert not {"middle", "load_linkedspring_1x17"} & set(one_way.scratch[0]["body"].dtype.names)
    assert one_way.plan.scheme.name != "springs between bodies"
    assert "all bodies at once" in both.plan.explain()


def test_batches_and_parameters_per_world():
    """Each world as alone, whatever the batch; its own stiffness where it has one."""
    scene = physics.Scene(PAIR, effects=[tied()])
    batch = physics.World(scene, worlds=3, threads=2)
    batch.set_parameters(effects=[tied(stiffness=10.0)], worlds=[1])
    batch.step(steps=50)
    for k, stiffness in enumerate((40.0, 10.0, 40.0)):
        alone = physics.World(physics.Scene(PAIR, effects=[tied(stiffness=stiffness)]))
        alone.step(steps=50)
        assert np.array_equal(batch.pos[k], alone.pos[0])
        assert np.array_equal(batch.quat[k], alone.quat[0])
    with pytest.raises(ValueError, match=r"Spring was given, but the scene does not declare it"):
        batch.set_parameters(effects=[physics.Spring()])


def named(*effects):
    pair = [physics.Sphere(0.1, 1.0, name="crate"), physics.Sphere(0.1, 1.0, pos=(2, 0, 0), name="ball")]
    return physics.Scene(pair, effects=effects)


def test_springs_and_pushes_name_their_bodies(tmp_path):
    """A scene replaces names by indices, so that it equals the scene with indices, in files and texts, too."""
    by_name = named(physics.Spring(body="ball", other="crate"), physics.Push((1, 0, 0), body="ball"))
    by_index = named(physics.Spring(body=1, other=0), physics.Push((1, 0, 0), body=1))
    assert by_name == by_index
    assert repr(by_name) == repr(by_index)
    physics.save_scene(by_name, tmp_path / "pair.toml")
    text = (tmp_path / "pair.toml").read_text()
    assert physics.load_scene(tmp_path / "pair.toml") == by_name
    (tmp_path / "pair.toml").write_text(text.replace("body = 1", 'body = "ball"'))
    assert '"ball"\n' in (tmp_path / "pair.toml").read_text()
    assert physics.load_scene(tmp_path / "pair.toml") == by_name
    world = physics.World(by_name)
    world.set_parameters(effects=[physics.Push((0, 3, 0), body="ball")])
    world.step()
    assert world.linvel[0, 1, 1] > 0.0
    assert world.linvel[0, 0, 1] == 0.0


BAD = [
    (lambda: named(physics.Push(body="bal")), "Push.body is 'bal'; allowed are ball, crate, or indices from 0 to 1"),
    (lambda: named(physics.Spring(other="bal")), "Spring.other is 'bal'; allowed are ball, crate, or indices"),
    (lambda: named(physics.Spring(body="ball", other=1)), "Spring.other is 1, as Spring.body"),
    (lambda: physics.Spring(body="a", other="a"), "Spring.other is 'a', as Spring.body"),
    (lambda: physics.Spring(other=0), "Spring.other is 0, as Spring.body; allowed are other bodies and None"),
    (lambda: physics.Spring(other=-1), "Spring.other is -1"),
    (lambda: physics.Scene([physics.Sphere(1, 1)], effects=[physics.Spring(other=1)]), "Spring.other is 1; .* below 1"),
]  # fmt: skip


@pytest.mark.parametrize(("make", "message"), BAD)
def test_a_spring_says_what_is_wrong(make, message):
    with pytest.raises(ValueError, match=message):
        make()
