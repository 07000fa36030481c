"""Force fields against closed forms: order 2 in time stepping, 1e-8 and better with the event-driven scheme."""

from __future__ import annotations

import math
from dataclasses import replace
from multiprocessing import get_context

import numpy as np
import pytest

import physics
from physics import scenes
from tests.reference import fields as ref
from tests.reference.rigid_body import orientation_error

pytestmark = pytest.mark.interpreted

EPS = np.finfo(float).eps
G = 9.81
GRAVITY = physics.Gravity((0, -G, 0))
STEPS = np.array([0.04, 0.02, 0.01, 0.005])

# Every field, without strength: added to a scene they leave one kernel for many tests, and every number as it is.
NOTHING = (
    physics.Drag(0.0, linear=0.0), physics.AngularDrag(0.0), physics.Magnus(0.0), physics.Wind((0, 0, 0)),
    physics.Buoyancy(0.0), physics.Spring(stiffness=0.0), physics.Push(),
)  # fmt: skip


def scene(body, *effects) -> physics.Scene:
    """A body in fields, with all others at no strength."""
    kinds = {type(effect) for effect in effects}
    return physics.Scene([body], effects=[GRAVITY, *effects, *(e for e in NOTHING if type(e) not in kinds)])


def end(scene: physics.Scene, duration: float, dt: float, accuracy="balanced") -> physics.World:
    world = physics.World(scene, dt=dt, accuracy=accuracy)
    world.step(steps=round(duration / dt))
    return world


@pytest.fixture
def steps(is_exhaustive) -> np.ndarray:
    """Steps of which each is half the one before it [s]."""
    return STEPS if is_exhaustive else STEPS[:3]


@pytest.fixture
def check(steps):
    """Check order 2 at `balanced`, and 1e-8 at `precise`, whose steps are each good to 1e-10 of size and speed."""

    def check(scene: physics.Scene, duration: float, error, steps=steps) -> None:
        errors = [error(end(scene, duration, dt)) for dt in steps]
        slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
        assert slope == pytest.approx(2.0, abs=0.1)
        assert error(end(scene, duration, 0.1, "precise")) < 1e-8

    return check


BODIES = {
    "sphere": (physics.Sphere(0.3, 2.0), math.pi * 0.09),
    "block": (physics.Block((0.5, 0.3, 0.2), 2.0), 0.5 * 0.2),
    "ellipsoid": (physics.Ellipsoid((0.5, 0.3, 0.2), 2.0), math.pi * 0.5 * 0.2),
}


@pytest.mark.parametrize("shape", BODIES)
def test_a_fall_under_quadratic_drag_is_a_tanh(shape, check, is_exhaustive):
    """v = -v_t tanh(g t/v_t), x = -(v_t²/g) ln cosh(g t/v_t), v_t = √(2 m g/(ρ C A)); A: the shadow from above."""
    body, area = BODIES[shape]
    terminal = math.sqrt(2 * 2.0 * G / (1.225 * 0.9 * area))
    t = 4.0
    speed, way = terminal * math.tanh(G * t / terminal), terminal**2 / G * math.log(math.cosh(G * t / terminal))

    def error(world):
        return abs(world.linvel[0, 0, 1] + speed) + abs(world.pos[0, 0, 1] + way)

    check(scene(body, physics.Drag(0.9)), t, error)
    # After 20 v_t/g the tanh is 1 to rounding, and an equilibrium of the scheme is one of the field, at any step.
    late = end(scene(body, physics.Drag(0.9)), round(20 * terminal / G, 2), 0.01 if is_exhaustive else 0.05)
    assert -late.linvel[0, 0, 1] == pytest.approx(terminal, rel=1e-12)


def test_a_throw_under_linear_drag_is_an_exponential(check):
    """v = v_t + (v0 - v_t) e^(-c t/m), v_t = m g/c: along every axis, whatever the shape."""
    body = physics.Block((0.5, 0.3, 0.2), 2.0, linvel=(3.0, 4.0, -2.0), angvel=(1.0, 3.0, 2.0))
    c, t = 1.5, 2.0
    terminal, start, k = np.array([0, -2.0 * G / c, 0]), np.array([3.0, 4.0, -2.0]), 1.5 / 2.0
    fade = math.exp(-k * t)
    place = terminal * t + (start - terminal) * (1 - fade) / k

    def error(world):
        v = terminal + (start - terminal) * fade
        return np.abs(world.linvel[0, 0] - v).max() + np.abs(world.pos[0, 0] - place).max()

    check(scene(body, physics.Drag(0.0, linear=c)), t, error)


@pytest.mark.parametrize("kind", [physics.Block, physics.Ellipsoid])
def test_the_shadow_of_a_turned_body(kind, rng):
    """Drag measures the area of the convex hull's projection; a sphere of 20,000 points is short of it by 3e-4."""
    half = np.array([0.5, 0.3, 0.2])
    if kind is physics.Block:
        points = half * (2 * (np.arange(8)[:, None] >> np.arange(3) & 1) - 1)
    else:
        points = rng.normal(size=(20_000, 3))
        points *= half / np.linalg.norm(points, axis=1, keepdims=True)
    for _ in range(5):
        q, v = rng.normal(size=4), rng.normal(size=3)
        q /= np.linalg.norm(q)
        size = 2 * half if kind is physics.Block else half
        world = physics.World(scene(kind(tuple(size), 2.0, quat=q, linvel=v), physics.Drag(2.0, density=1.0)))
        force = physics.look_at(world)[0][0, :3]
        assert np.cross(force, v) == pytest.approx(np.zeros(3), abs=1e-12)
        area = ref.shadow_of_points(points @ ref.rotation_matrix(q).T, v)
        assert -force @ v / np.linalg.norm(v) ** 3 == pytest.approx(area, rel=1e-12 if kind is physics.Block else 1e-3)


@pytest.mark.parametrize(("linear", "quadratic"), [(0.05, 0.0), (0.0, 0.05)])
def test_the_spin_of_a_sphere_wears_off(linear, quadratic, check):
    """I dω/dt = -c ω: e^(-c t/I). I dω/dt = -d ω²: 1/(1 + d ω0 t/I)."""
    start, t = 7.0, 3.0
    inertia = 0.4 * 2.0 * 0.3**2
    expected = start * math.exp(-linear * t / inertia) / (1 + quadratic * start * t / inertia)
    body = physics.Sphere(0.3, 2.0, angvel=(0.6 * start, 0.0, 0.8 * start))

    def error(world):
        return np.abs(world.angvel[0, 0] - expected * np.array([0.6, 0.0, 0.8])).max()

    check(scene(body, physics.AngularDrag(linear, quadratic)), t, error, STEPS)  # the longest is not yet of order 2


def test_a_ball_with_lift_flies_in_circles(check):
    """F = S ω x v turns v about ω at the rate S ω/m; gravity across it adds the drift of a charge in two fields."""
    spin, speed, t = 40.0, 6.0, 2.0
    rate = 0.5 * 1.225 * 1.0 * math.pi * 0.3**3 * spin / 0.2
    body = physics.Sphere(0.3, 0.2, linvel=(speed, 0, 0), angvel=(0, 0, spin))
    # v' = rate z x v - g y is solved by v = u + rotated (v0 - u) with rate z x u = g y, u = (g/rate, 0, 0).
    u, c, s = G / rate, math.cos(rate * t), math.sin(rate * t)
    v = np.array([u + (speed - u) * c, (speed - u) * s, 0])
    x = np.array([u * t + (speed - u) * s / rate, (speed - u) * (1 - c) / rate, 0])

    def error(world):
        return np.abs(world.linvel[0, 0] - v).max() + np.abs(world.pos[0, 0] - x).max()

    check(scene(body, physics.Magnus(1.0)), t, error)


def test_a_steady_wind_is_a_change_of_frame():
    """With u = v - wind for v a body in the wind falls as it does in still air, seen from the wind."""
    wind, start = np.array([4.0, -1.0, 2.0]), np.array([1.0, 2.0, 3.0])
    effects = physics.Drag(0.47), physics.Magnus(0.5)
    ball = {"angvel": (1.0, 5.0, -2.0)}
    for accuracy, dt in (("balanced", 0.01), ("precise", 0.1)):
        windy = end(
            scene(physics.Sphere(0.3, 0.5, linvel=start, **ball), *effects, physics.Wind(wind)), 2, dt, accuracy
        )
        still = end(scene(physics.Sphere(0.3, 0.5, linvel=start - wind, **ball), *effects), 2.0, dt, accuracy)
        # The same arithmetic but for the shift, some hundred steps with a few roundings of numbers up to 20 each.
        assert windy.linvel[0, 0] - wind == pytest.approx(still.linvel[0, 0], abs=200 * 4 * EPS * 20)
        assert windy.pos[0, 0] - 2.0 * wind == pytest.approx(still.pos[0, 0], abs=200 * 4 * EPS * 20)


def gust(effect: physics.Wind, t: np.ndarray) -> np.ndarray:
    """Velocity (samples, 3) of the air by the formula of the docs, world 0."""
    phases = effect.columns(0, np.arange(1))[0, 5:].reshape(3, -1)
    count = phases.shape[1]
    rates = np.tan(np.pi * (np.arange(1, count + 1) - 0.5) / (2 * count)) / effect.time_scale
    waves = np.cos(t[:, None, None] * rates + phases)
    return np.array(effect.velocity) + effect.gust * math.sqrt(2 / count) * waves.sum(axis=-1)


def test_gusts_shake_a_body_as_their_waves_do(check):
    """m v' = c (u(t) - v): each wave cos(ω t + φ) drives κ (κ cos + ω sin)/(κ² + ω²) and a transient, κ = c/m."""
    effect = physics.Wind((1.0, 0.0, 0.0), gust=2.0, time_scale=0.5, seed=3)
    k, t = 1.5 / 0.5, 2.0
    phases = effect.columns(0, np.arange(1))[0, 5:].reshape(3, -1)
    count = phases.shape[1]
    rates = np.tan(np.pi * (np.arange(1, count + 1) - 0.5) / (2 * count)) / 0.5

    def response(time):
        at = rates * time + phases
        return (
            2.0 * math.sqrt(2 / count) * (k * (k * np.cos(at) + rates * np.sin(at)) / (k * k + rates**2)).sum(axis=-1)
        )

    base = np.array([1.0, -G / k, 0.0])
    v = base + response(t) - (base + response(0.0)) * math.exp(-k * t)

    def error(world):
        return np.abs(world.linvel[0, 0] - v).max()

    check(scene(physics.Sphere(0.3, 0.5), physics.Drag(0.0, linear=1.5), effect), t, error)


def test_gusts_have_their_mean_spread_and_memory(is_exhaustive):
    """Over a time long against all beats: mean, σ², and the correlation (1/N) Σ cos(ω_k s), near exp(-s/τ)."""
    effect = physics.Wind((3.0, -1.0, 0.0), gust=2.0, time_scale=0.7, seed=1)
    t = np.arange(0.0, 20_000.0 if is_exhaustive else 5_000.0, 0.05)
    u = gust(effect, t)
    # Each wave averages to at most 1/(ω T): with the slowest ω = 0.14 a share of 4e-4 of its amplitude, or 1.4e-3.
    assert u.mean(axis=0) == pytest.approx([3.0, -1.0, 0.0], abs=0.01)
    assert u.std(axis=0) == pytest.approx([2.0, 2.0, 2.0], rel=0.01)
    lag = 14  # 0.7 s: one time scale
    waves = u - u.mean(axis=0)
    correlation = (waves[lag:] * waves[:-lag]).mean(axis=0) / waves.var(axis=0)
    rates = np.tan(np.pi * (np.arange(8) + 0.5) / 16)
    assert correlation == pytest.approx(np.full(3, np.cos(rates).mean()), abs=0.01)
    assert np.cos(rates).mean() == pytest.approx(math.exp(-1), abs=0.15)  # eight waves are a coarse spectrum


def test_worlds_have_gusts_of_their_own_and_the_same_ones_in_any_batch():
    effects = [physics.Drag(0.47), physics.Wind(gust=3.0, seed=5)]
    batch = physics.World(physics.Scene([physics.Sphere(0.3, 0.5)], effects=effects), worlds=5, dt=0.01, threads=2)
    small = physics.World(physics.Scene([physics.Sphere(0.3, 0.5)], effects=effects), worlds=2, dt=0.01)
    for world in (batch, small):
        world.step(steps=50)
    assert np.array_equal(batch.state[:2], small.state)
    assert len(np.unique(batch.state[:, 0])) == 5
    snap = small.snapshot()
    small.step(steps=20)
    after = small.state.copy()
    small.restore(snap)
    for _ in range(20):
        small.step()
    # Time in one call is call_start + k h, in many time += h: rounding of t, and nothing else.
    assert small.state == pytest.approx(after, abs=1e-12)


def test_a_world_in_fields_travels_to_another_process():
    """Pickled there and back by a process that is spawned: it goes on as the one that stayed."""
    effects = [physics.Drag(0.47), physics.Wind(gust=3.0, seed=5)]
    world = physics.World(physics.Scene([physics.Sphere(0.3, 0.5)], effects=effects), worlds=2, dt=0.01)
    world.step(steps=10)
    with get_context("spawn").Pool(1) as pool:  # ends its process with the block, whatever that does
        there = pool.apply(advanced, (world,))
    world.step(steps=10)
    assert np.array_equal(there.state, world.state)
    assert there.time == world.time


def advanced(world: physics.World) -> physics.World:
    """The world ten steps later."""
    world.step(steps=10)
    return world


def test_a_block_bobs_with_the_frequency_of_its_waterplane(check):
    """m y'' = -ρ g A (y - y_0) as long as the surface cuts the block's sides: exactly harmonic."""
    size, mass = (0.5, 0.2, 0.3), 20.0  # wide enough to float upright
    area, t = 0.5 * 0.3, 1.2
    rate = math.sqrt(1000 * G * area / mass)
    rest = 0.5 * 0.2 - mass / (1000 * area)  # height of the centre where the displaced water weighs as much
    body = physics.Block(size, mass, pos=(0.3, rest + 0.02, -0.2))

    def error(world):
        return abs(world.pos[0, 0, 1] - rest - 0.02 * math.cos(rate * t))

    check(scene(body, physics.Buoyancy()), t, error)
    still = end(scene(physics.Block(size, mass, pos=(0, rest, 0)), physics.Buoyancy()), 5.0, 0.01)
    assert still.pos[0, 0, 1] == pytest.approx(rest, abs=1e-12)


def test_a_ball_under_water_rises_along_a_parabola():
    """Fully submerged: y'' = g (ρ V/m - 1), at any step."""
    mass, r, t = 20.0, 0.3, 1.0
    up = G * (1000 * 4 / 3 * math.pi * r**3 / mass - 1)
    body = physics.Sphere(r, mass, pos=(0, -50, 0))
    for accuracy, dt in (("balanced", 0.5), ("precise", 0.5)):
        world = end(scene(body, physics.Buoyancy()), t, dt, accuracy)
        assert world.pos[0, 0, 1] == pytest.approx(-50 + up * t * t / 2, abs=1e-11)


@pytest.mark.parametrize("shape", ["block", "ellipsoid", "sphere"])
def test_buoyancy_is_the_slope_of_its_energy(shape, rng):
    """F = -∂U/∂x and the torque along every axis, by central differences: errors h² U''' and ε U/h."""
    half = np.array([0.5, 0.3, 0.2])
    kinds = {
        "block": lambda **start: physics.Block(
            tuple(2 * half), 2.0, center=(0.1, 0, 0.05), inertia_body=(1, 1, 1), **start
        ),
        "ellipsoid": lambda **start: physics.Ellipsoid(tuple(half), 2.0, **start),
        "sphere": lambda **start: physics.Sphere(0.3, 2.0, **start),
    }  # fmt: skip
    effects = [physics.Buoyancy(1000.0, (0.3, 1.0, -0.2), 0.1)]
    h = 1e-5

    def look(pos, quat):
        world = physics.World(physics.Scene([kinds[shape](pos=pos, quat=quat)], effects=effects))
        wrenches, energies = physics.look_at(world)
        return wrenches[0], energies[0]

    for _ in range(5):
        q = rng.normal(size=4)
        q /= np.linalg.norm(q)
        pos = rng.uniform(-0.1, 0.1, 3)
        wrench, _ = look(pos, q)
        for k, axis in enumerate(np.eye(3)):
            slope = (look(pos + h * axis, q)[1] - look(pos - h * axis, q)[1]) / (2 * h)
            assert wrench[k] == pytest.approx(-slope, abs=1e-3)
            turned = []
            for sign in (1.0, -1.0):
                turn = np.array([math.cos(h / 2), *(sign * math.sin(h / 2) * axis)])
                w, r = turn[0] * q[0] - turn[1:] @ q[1:], turn[0] * q[1:] + q[0] * turn[1:] + np.cross(turn[1:], q[1:])
                turned.append(look(pos, np.array([w, *r]))[1])
            assert wrench[3 + k] == pytest.approx(-(turned[0] - turned[1]) / (2 * h), abs=1e-3)


def test_a_damped_spring_swings_as_the_textbook_says(check):
    """m y'' = -k (y - y_0) - c y': e^(-γt) cos(ω t + φ), γ = c/2m, ω² = k/m - γ²; y_0 where gravity stretches it."""
    k, c, mass, t = 50.0, 0.8, 2.0, 3.0
    spring = physics.Spring(anchor=(1.0, 2.0, 3.0), stiffness=k, damping=c, length=0.4)
    lowest = 2.0 - 0.4 - mass * G / k
    decay = c / (2 * mass)
    rate = math.sqrt(k / mass - decay**2)
    body = physics.Sphere(0.1, mass, pos=(1.0, lowest - 0.3, 3.0))
    y = lowest - 0.3 * math.exp(-decay * t) * (math.cos(rate * t) + decay / rate * math.sin(rate * t))

    def error(world):
        return abs(world.pos[0, 0, 1] - y)

    check(scene(body, spring), t, error)


def test_springs_hold_the_energy_of_a_block_that_turns(is_exhaustive):
    """Two springs at two corners: at `precise` to its tolerance, at `balanced` bounded, without drift (leapfrog)."""
    springs = [
        physics.Spring((0, 2, 0), (0.25, 0.15, 0.1), 80.0, length=0.5),
        physics.Spring((0.5, -2, 0), (-0.25, -0.15, 0.1), 60.0),
    ]
    body = physics.Block((0.5, 0.3, 0.2), 2.0, angvel=(1.0, 2.0, 3.0))
    built = physics.Scene([body], effects=[GRAVITY, *springs])
    short, long = (5.0, 20.0) if is_exhaustive else (1.5, 6.0)
    precise = physics.simulate(built, short, "precise", sample_dt=0.1)
    energy = precise.energy[:, 0]
    assert np.abs(energy - energy[0]).max() < 1e-7
    spread = []
    for dt in (0.01, 0.005):
        energy = physics.simulate(built, long, "balanced", sample_dt=dt).energy[:, 0]
        spread.append(np.ptp(energy))
        half = len(energy) // 2
        assert np.ptp(energy[half:]) < 1.5 * np.ptp(energy[:half])
    assert spread[0] / spread[1] == pytest.approx(4.0, abs=0.6)


def test_a_push_off_centre_turns_and_a_rocket_goes_where_it_points():
    """World frame: torque arm x force. Body frame, along the spin axis: constant acceleration along it."""
    arm, force = np.array([0.2, 0.1, -0.1]), np.array([1.0, -2.0, 3.0])
    q = np.array([0.5, 0.5, 0.5, 0.5])  # cyclic: x to y, y to z, z to x
    world = physics.World(scene(physics.Block((0.5, 0.3, 0.2), 2.0, quat=q), physics.Push(force, arm)))
    wrench = physics.look_at(world)[0][0]
    assert wrench[:3] == pytest.approx(force, abs=4 * EPS)
    assert wrench[3:] == pytest.approx(np.cross(arm[[2, 0, 1]], force), abs=8 * EPS)
    rocket = physics.Push((0, 0, 6.0), frame="body")
    body = physics.Block((0.5, 0.3, 0.2), 2.0, quat=q, angvel=(4.0, 0, 0))
    for accuracy in ("balanced", "precise"):
        flown = end(scene(body, rocket), 2.0, 0.1, accuracy)
        assert flown.pos[0, 0] == pytest.approx([0.5 * 3.0 * 4.0, -0.5 * G * 4.0, 0], abs=1e-8)


def football_force(t, x, R, v, w):
    """Drag on the ellipsoid's shadow, lift and drag on the spin, as the docs state them."""
    a, b, c = 0.14, 0.085, 0.085
    u = R.T @ v
    swept = math.pi * math.sqrt((b * c * u[0]) ** 2 + (c * a * u[1]) ** 2 + (a * b * u[2]) ** 2)
    force = -0.5 * 1.225 * 0.2 * swept * v + 0.5 * 1.225 * math.pi * a * b * c * np.cross(w, v)
    return force, -1e-6 * w


def test_the_football_flies_as_an_independent_integrator_says(is_exhaustive):
    """DOP853 with NumPy formulas, itself good to about 1e-12 here."""
    football, t = scenes.football(), 2.0 if is_exhaustive else 1.0
    truth = ref.integrate_in_field(football.bodies[0], football_force, t, (0, -G, 0))

    def error(world):
        return np.abs(world.pos[0, 0] - truth.pos).max() + orientation_error(world.quat[0, 0], truth.quat)

    errors = [error(end(football, t, dt)) for dt in (0.02, 0.01, 0.005)]
    assert np.polyfit(np.log([0.02, 0.01, 0.005]), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.1)
    assert error(end(football, t, 0.1, "precise")) < 1e-8


BALL_ON_BLOCK = physics.Scene(
    [physics.Sphere(0.5, 1.0, pos=(0, 2, 0)), physics.Block((1, 1, 1), 2.0, pos=(0.2, 0.5, 0))],
    [physics.HalfSpace((0, 1, 0))], [GRAVITY, physics.Contact(0.3), physics.Friction(0.4)],
)  # fmt: skip


@pytest.mark.parametrize(
    ("built", "accuracy"),
    [
        (scenes.tumble(), "balanced"), (scenes.tumble(), "precise"), (scenes.drop(), "balanced"),
        (scenes.drop(), "precise"), (BALL_ON_BLOCK, "balanced"),
    ],
    ids=["tumble", "tumble, precise", "drop", "drop, precise", "ball on block"],
)  # fmt: skip
def test_fields_without_strength_leave_every_bit(built, accuracy, is_exhaustive):
    """A tumbling flight without walls; the block in its box, to its rest; a ball that falls on a block."""
    # The cheap ones go on to their rest, the others to 1.5 s.
    steps = 300 if is_exhaustive or (accuracy == "balanced" and len(built.bodies) == 1) else 150
    runs = []
    for extra in ((), NOTHING):
        effects = (*built.effects, *extra)
        world = physics.World(physics.Scene(built.bodies, built.walls, effects), dt=0.01, accuracy=accuracy)
        world.step(steps=steps)
        runs.append((world.state.tobytes(), world.memory.tobytes(), world.report_table.tobytes()))
    assert runs[0] == runs[1]


def slide_in_water(accuracy, dt, duration):
    """A block sliding with friction through something viscous: the world at the end, its speed and way in theory."""
    mass, mu, c, start = 6.0, 0.1, 2.0, 5.0
    body = physics.Block((5, 3, 2), mass, pos=(0, 1.5, 0), linvel=(start, 0, 0))
    effects = [GRAVITY, physics.Contact(), physics.Friction(mu), physics.Drag(0.0, linear=c)]
    world = end(physics.Scene([body], [physics.HalfSpace((0, 1, 0))], effects), duration, dt, accuracy)
    k, bias = c / mass, mu * G * mass / c  # v' = -k (v + bias)
    speed = (start + bias) * math.exp(-k * duration) - bias
    return world, speed, (start - speed) / k - bias * duration


def test_sliding_in_a_field_is_of_second_order_and_precise_to_its_tolerance(steps):
    errors = []
    for dt in steps:
        world, speed, way = slide_in_water("balanced", dt, 1.0)
        errors.append(abs(world.linvel[0, 0, 0] - speed) + abs(world.pos[0, 0, 0] - way))
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.1)
    world, speed, way = slide_in_water("precise", 0.1, 1.0)
    assert abs(world.linvel[0, 0, 0] - speed) + abs(world.pos[0, 0, 0] - way) < 1e-8
    world, _, _ = slide_in_water("precise", 0.1, 4.0)
    assert world.linvel[0, 0].tolist() == [0, 0, 0]  # it has stopped, and rests


def test_bodies_that_may_touch_each_other_feel_fields_as_each_alone_does():
    """Far apart, in the kernel of many bodies: the same formulas, to rounding of some hundred steps."""
    ball = physics.Sphere(0.3, 2.0, pos=(-50, 0, 0), linvel=(3, 0, 1), angvel=(0, 5, 0))
    brick = physics.Block((0.5, 0.3, 0.2), 2.0, pos=(50, 0, 0), angvel=(1, 2, 3))
    springs = physics.Spring((-50, 1, 0), (0.1, 0, 0), 40.0), physics.Spring((50, 1, 0), (0.1, 0, 0), 40.0, body=1)
    effects = [GRAVITY, physics.Drag(0.9), physics.Magnus(), physics.Contact(), *springs]
    # Compiled before, without fields: a record may stand for one that it begins with, but these kernels must not.
    physics.World(physics.Scene([ball, brick], effects=[GRAVITY, physics.Contact()]), dt=0.01).step()
    both = physics.World(physics.Scene([ball, brick], effects=effects), dt=0.01)
    assert both.plan.scheme.couples_bodies
    both.step(steps=100)
    for b, body in enumerate((ball, brick)):
        alone = replace(springs[b], body=0)
        single = physics.World(physics.Scene([body], effects=[*effects[:3], alone]), dt=0.01)
        single.step(steps=100)
        for name in ("pos", "quat", "linvel", "angvel"):
            # In the kernel of both the sphere has a gyroscopic flow: the same motion to rounding, not to the bit.
            assert getattr(both, name)[0, b] == pytest.approx(getattr(single, name)[0, 0], abs=1e-11)


def test_two_balls_on_springs_meet_with_the_speed_that_the_springs_gave_them():
    """Each swings about its anchor as a cosine; they touch where x = r, and a plastic impact stops both."""
    balls = [physics.Sphere(0.5, 1.0, pos=(side * 2.0, 0, 0)) for side in (-1.0, 1.0)]
    springs = [physics.Spring((0, 0, 0), stiffness=9.0, body=b) for b in range(2)]
    built = physics.Scene(balls, effects=[physics.Contact(), *springs])
    free, hit = (physics.World(built, dt=0.005) for _ in range(2))
    time = math.acos(0.25) / 3.0  # 2 cos(3 t) = 1/2
    free.step(steps=round(0.4 / 0.005))
    # Leapfrog: the phase is off by (ω h)²/24 of itself, the place by 2 ω times that at most: 3e-5.
    assert free.pos[0, 1, 0] == pytest.approx(2.0 * math.cos(3.0 * 0.4), abs=5e-5)
    hit.step(steps=math.ceil(time / 0.005) + 1)
    assert hit.linvel[0, :, 0] == pytest.approx([0, 0], abs=1e-9)
    # The springs press them together from then on: x stays at the radius, to the slop and the place of the impact.
    hit.step(steps=200)
    assert hit.pos[0, :, 0] == pytest.approx([-0.5, 0.5], abs=0.01)


def test_precise_finds_the_impact_of_a_ball_that_falls_through_air():
    """The tanh's height reaches the radius at t = (v_t/g) arcosh(exp(g h/v_t²)); the bounce reverses e times it."""
    _, area = BODIES["sphere"]
    height, e = 5.0, 0.5
    terminal = math.sqrt(2 * 2.0 * G / (1.225 * 0.9 * area))
    hit = terminal / G * math.acosh(math.exp(G * height / terminal**2))
    ball = physics.Sphere(0.3, 2.0, pos=(0, 0.3 + height, 0))
    effects = [GRAVITY, physics.Contact(e), physics.Drag(0.9)]
    built = physics.Scene([ball], [physics.HalfSpace((0, 1, 0))], effects)
    flown = physics.simulate(built, 2.0, "precise", sample_dt=0.5)
    impact = next(event for event in flown.events if event.kind == "impact")
    assert impact.t == pytest.approx(hit, abs=1e-9)
    assert impact.impulse[1] == pytest.approx(2.0 * (1 + e) * terminal * math.tanh(G * hit / terminal), abs=1e-8)
    coarse = physics.simulate(built, 2.0, "balanced", sample_dt=0.01)
    assert coarse.pos[-1, 0, 1] == pytest.approx(flown.pos[-1, 0, 1], abs=2e-3)


def test_parameters_of_fields_may_differ_from_world_to_world():
    world = physics.World(scene(physics.Sphere(0.3, 2.0), physics.Drag(0.5)), worlds=3, dt=0.1)
    world.set_parameters(effects=[physics.Drag(0.9)], worlds=[1])
    world.step(steps=20)
    for k, coefficient in enumerate((0.5, 0.9, 0.5)):
        alone = end(scene(physics.Sphere(0.3, 2.0), physics.Drag(coefficient)), 2.0, 0.1)
        assert np.array_equal(world.state[k], alone.state[0])
    before = world.params.copy()
    for bad, message in (
        ([physics.Spring(), physics.Spring()], "2 Spring; allowed are 1"),
        ([physics.Spring(body=1)], "Spring.body is 1"),
        ([physics.Friction()], "Friction was given, but the scene does not declare it"),
    ):
        with pytest.raises(ValueError, match=message):
            world.set_parameters(mass=1.0, effects=bad)
    assert np.array_equal(world.params, before)
    still = physics.World(scenes.tumble())
    with pytest.raises(ValueError, match=r"Drag was given.*add physics.Drag\(...\)"):
        still.set_parameters(effects=physics.Drag())


BAD = [
    (lambda: physics.Drag(-1), "Drag.coefficient is -1"),
    (lambda: physics.Wind((1, 2)), r"Wind.velocity has shape \(2,\)"),
    (lambda: physics.Wind(seed=-1), "Wind.seed is -1"),
    (lambda: physics.Buoyancy(normal=(0, 0, 0)), "Buoyancy.normal is .*any vector but zero"),
    (lambda: physics.Spring(stiffness=np.nan), "Spring.stiffness is nan"),
    (lambda: physics.Push(frame="air"), "Push.frame is 'air'; allowed are world, body"),
    (lambda: physics.Scene([physics.Sphere(1, 1)], effects=[physics.Spring(body=1)]), "Spring.body is 1; .* below 1"),
    (lambda: physics.Scene([physics.Sphere(1, 1)], effects=[physics.Wind()]), "Wind without what it acts through"),
    (lambda: physics.Scene([physics.Sphere(1, 1)], effects=[physics.Drag(), physics.Drag()]), "2 Drag"),
]


@pytest.mark.parametrize(("make", "message"), BAD)
def test_a_field_says_what_is_wrong(make, message):
    with pytest.raises(ValueError, match=message):
        make()
