"""Effects that a step is too long for: nothing explodes, damping stays right, and what is not resolved is reported."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import physics
from benchmarks import drawn_worlds
from benchmarks.drawn_effects import one
from tests.reference.fields import flight_with_drag
from tests.tiers.sweep import sweep

pytestmark = pytest.mark.interpreted

DECADES = st.floats(-6.0, 6.0).map(lambda e: 10.0**e)
STEPS = st.floats(-3.0, -1.0).map(lambda e: 10.0**e)


def world_of(bodies, effects, dt, **options):
    return physics.World(physics.Scene(bodies, effects=effects), dt=dt, **options)


@pytest.mark.parametrize("dt", [0.001, 0.005, 0.01, 0.02, 0.05, 0.1])
@pytest.mark.parametrize("effects", [(), (physics.Gravity(),)], ids=("level", "falling"))
def test_a_balloon_that_is_thrown(dt, effects):
    """3 g, radius 0.14 m, 40 m/s: h λ = 2 h k v/m is 4.7 at 10 ms.

    The first part of a step has h λ = 1/4. Its way x = h (v + v')/2 errs by (h λ/2)²/12 of h v, and the next parts are
    longer by half each: 3 % in all.
    """
    world = world_of([physics.Sphere(0.14, 0.003, linvel=(40.0, 0.0, 0.0))], [physics.Drag(), *effects], dt)
    report = world.step(steps=round(1.0 / dt))
    truth = flight_with_drag(0.14, 0.003, (40.0, 0.0, 0.0), 9.81 * len(effects), 1.0)
    assert np.linalg.norm(world.pos[0, 0] - truth) <= 0.03 * np.linalg.norm(truth)
    assert report.ok


@pytest.mark.parametrize("ratio", [0.3, 3.0, 30.0, 3e3, 3e6])
def test_a_fall_that_reaches_its_terminal_speed_within_a_step(ratio):
    """v = v_t tanh(g t/v_t), way (v_t²/g) ln cosh(g t/v_t). At the start there is no drag, in the end h g/v_t of it.

    The first part has h λ <= 1/4 of the speed to which the whole step could lead; parts grow as of the balloon: 3 %.
    """
    g, dt, terminal = 1000.0 * ratio, 0.05, 50.0
    strength = 0.5 * 1.225 * math.pi * 0.09 / 0.5
    drag = physics.Drag(g / terminal**2 / strength)
    world = world_of([physics.Sphere(0.3, 0.5)], [physics.Gravity((0.0, -g, 0.0)), drag], dt)
    world.step()
    x = g * dt / terminal
    way = terminal**2 / g * (math.log1p(math.exp(-2 * x)) + x - math.log(2))
    assert world.pos[0, 0, 1] == pytest.approx(-way, rel=0.03)
    assert world.linvel[0, 0, 1] == pytest.approx(-terminal * math.tanh(x), rel=0.03)


@given(c=DECADES, dt=STEPS, quadratic=st.booleans())
def test_drag_never_gives(c, dt, quadratic):
    """A speed falls, step by step, and does not turn round; the closed forms say to what."""
    drag = physics.Drag(0.47 * c) if quadratic else physics.Drag(0.0, linear=c)
    world = world_of([physics.Sphere(0.3, 0.5, linvel=(3.0, 4.0, 0.0))], [drag], dt)
    speed = 5.0
    for k in range(1, 6):
        report = world.step()
        now = world.linvel[0, 0]
        assert now.min() >= -1e-15 * 5.0  # rounding of what is all gone
        assert np.linalg.norm(now) <= speed * (1 + 1e-14)
        speed = np.linalg.norm(now)
        assert report.ok
        if quadratic:
            strength = 0.5 * 1.225 * 0.47 * c * math.pi * 0.09 / 0.5
            assert speed == pytest.approx(5.0 / (1.0 + strength * 5.0 * k * dt), rel=0.06)


@given(c=DECADES, d=DECADES, dt=STEPS)
def test_drag_on_the_spin_never_gives(is_exhaustive, c, d, dt):
    """ω·L, twice the energy of turning, falls from step to step."""
    block = physics.Block((0.5, 0.3, 0.1), 0.5, angvel=(3.0, 4.0, 5.0))
    world = world_of([block], [physics.AngularDrag(0.01 * c, 0.01 * d)], dt)
    energy = physics.diagnose(world).energy[0, 0]
    for _ in range(5 if is_exhaustive else 3):
        assert world.step().ok
        now = physics.diagnose(world).energy[0, 0]
        assert now <= energy * (1 + 1e-13)
        energy = now


@given(k=DECADES, length=st.sampled_from((0.0, 0.5, 3.0)), dt=STEPS, corner=st.booleans())
def test_a_spring_is_bounded_at_any_stiffness(is_exhaustive, k, length, dt, corner):
    """E_n <= 4/3 E_0 where h Ω <= 1 (leapfrog keeps ½ k x² + ½ m v² (1 - (h Ω)²/4)); no gain, and a report, beyond."""
    point = (0.2, 0.1, 0.05) if corner else (0.0, 0.0, 0.0)
    block = physics.Block((0.4, 0.3, 0.2), 2.0, pos=(0.0, 1.0, 0.0), linvel=(1.0, 0.0, 0.5))
    world = world_of([block], [physics.Spring((0.0, 2.0, 0.0), point, 100.0 * k, length=length)], dt)
    start = physics.diagnose(world).energy[0, 0]
    is_told = False
    for _ in range(40 if is_exhaustive else 20):
        is_told |= not world.step().ok
        assert physics.diagnose(world).energy[0, 0] <= start * (4.0 / 3.0 + 1e-9)
    if dt * math.sqrt(100.0 * k / 2.0) > 1.0:
        assert is_told


def test_a_pendulum_on_a_spring_that_no_step_resolves():
    """h Ω = 300: the spring is as good as a rod, and what hangs on it swings: 2π √(l/g) there and back, within 5 %."""
    l, k, m, dt = 1.0, 9e6, 1.0, 0.1
    x = (l * math.sin(0.1), -l * math.cos(0.1), 0.0)
    ball = physics.Sphere(0.05, m, pos=x)
    scene = physics.Scene([ball], effects=[physics.Gravity(), physics.Spring(stiffness=k, length=l)])
    world = physics.World(scene, dt=dt)
    crossings, before = [], x[0]
    for n in range(200):
        report = world.step()
        assert report.status[0] == physics.Status.COARSE
        now = world.pos[0, 0, 0]
        if before > 0.0 >= now:
            crossings.append((n + 1 - now / (now - before)) * dt)
        assert np.linalg.norm(world.pos[0, 0]) == pytest.approx(l, abs=0.01)
        before = now
    period = np.diff(crossings).mean()
    assert period == pytest.approx(2 * math.pi * math.sqrt(l / 9.81), rel=0.05)


@given(k=DECADES, c=DECADES, dt=STEPS, damped=st.booleans())
def test_springs_between_bodies_keep_momentum_at_any_stiffness(k, c, dt, damped):
    """One end gets the momentum that the other loses; the energy is at most 4/3 of what it was."""
    bodies = [
        physics.Block((0.4, 0.3, 0.2), 2.0, linvel=(1.0, 0.0, 0.5)),
        physics.Ellipsoid((0.2, 0.1, 0.3), 0.5, pos=(1.0, 0.5, 0.0), linvel=(0.0, -1.0, 0.0)),
    ]
    spring = physics.Spring((0.1, 0.0, 0.0), (0.2, 0.1, 0.0), 100.0 * k, c * damped, 0.7, other=1)
    world = world_of(bodies, [spring], dt)
    start = physics.diagnose(world)
    for _ in range(20):
        world.step()
    now = physics.diagnose(world)
    scale = np.abs(start.momentum).sum() + np.sqrt(start.energy.sum() * 5.0)
    assert np.abs(now.momentum.sum(axis=1) - start.momentum.sum(axis=1)).max() <= 1e-12 * scale
    assert now.energy.sum() <= start.energy.sum() * (4.0 / 3.0 + 1e-9)


@physics.field_function
def _pull(state, p, t):
    return (-p[0] * state.x[0], -p[0] * state.x[1], -p[0] * state.x[2]), (0.0, 0.0, 0.0)


@physics.field_function
def _brake(state, p, t):
    return (-p[0] * state.v[0], -p[0] * state.v[1], -p[0] * state.v[2]), (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Trough(physics.Field):
    stiffness: float = 1.0  # [N/m]
    function: ClassVar = _pull


@dataclass(frozen=True)
class Brake(physics.Field):
    coefficient: float = 1.0  # [N s/m]
    function: ClassVar = _brake


@pytest.mark.parametrize(
    ("kind", "limit"), [(Trough, 4.0 / 0.01**2), (Brake, 2.0 / 0.01)], ids=("stiff in place", "stiff in velocity")
)
@pytest.mark.parametrize("share", [1e-6, 0.2, 5.0, 1e6])
def test_a_field_of_a_users_own_is_reported_where_it_is_not_resolved(kind, limit, share):
    """(h Ω)² = 4 and h λ = 2 are where the explicit rule begins to grow; 1 kg, 10 ms."""
    ball = physics.Sphere(0.1, 1.0, pos=(1.0, 0.0, 0.0), linvel=(0.0, 1.0, 0.0))
    world = world_of([ball], [kind(share * limit)], 0.01)
    told = [world.step().status[0] == physics.Status.COARSE for _ in range(3)]
    assert any(told) == (share > 1.0)


@physics.field_function
def _deflect(state, p, t):
    return (p[0] * state.v[1], -p[0] * state.v[0], 0.0), (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Deflection(physics.Field):
    rate: float = 1.0  # of turning the velocity, by the mass [N s/m]
    function: ClassVar = _deflect


@pytest.mark.parametrize("turn", [0.01, 0.5, 0.9, 1.1, 3.0, 1e4])
def test_a_field_of_a_users_own_that_turns_the_velocity_by_a_radian_a_step_is_reported(turn):
    """The explicit midpoint rule then gains z⁴/4 of the energy in a step, z the turn; 1 kg, 10 ms."""
    ball = physics.Sphere(0.1, 1.0, linvel=(0.6, 0.8, 0.0))
    report = world_of([ball], [Deflection(turn / 0.01)], 0.01).step()
    assert (report.status[0] == physics.Status.COARSE) == (turn > 1.0)


@pytest.mark.parametrize("turn", [0.5, 0.9, 1.1, 1.5])
@pytest.mark.parametrize("gravity", [9.81, 1e3, 1e6])
@pytest.mark.parametrize("axis", [(0.0, 0.0, -1.0), (0.0, 0.6, -0.8)])
def test_other_loads_do_not_hide_a_field_that_turns_the_velocity(turn, gravity, axis):
    """Along its axis gravity is not turned at all, however strong it is."""
    ball = physics.Sphere(0.1, 1.0, linvel=(0.6, 0.8, 0.0))
    fields = [physics.Gravity(tuple(gravity * c for c in axis)), Deflection(turn / 0.01)]
    report = world_of([ball], fields, 0.01).step()
    assert (report.status[0] == physics.Status.COARSE) == (turn > 1.0)


@pytest.mark.parametrize("scheme", ["explicit_euler", "semi_implicit_euler", "midpoint", "rk4"])
def test_a_textbook_scheme_keeps_its_explicit_loads(scheme):
    """v' = v (1 - z + z²/2) a step, z = h c/m = 4: its loads are those of the middle, and it must gain; it is told."""
    ball = physics.Sphere(0.1, 1.0, linvel=(1.0, 0.0, 0.0))
    world = world_of([ball], [physics.Drag(0.0, linear=400.0)], 0.01, accuracy=physics.Accuracy(scheme=scheme))
    report = world.step(steps=3)
    assert world.linvel[0, 0, 0] == pytest.approx(5.0**3, rel=1e-12)
    assert report.status[0] == physics.Status.COARSE


@pytest.mark.compiled
@pytest.mark.parametrize("accuracy", sweep(["precise", "reference"], ["precise"]))
@pytest.mark.parametrize("has_wall", sweep([False, True], [False]), ids=("in flight", "above a wall"))
@pytest.mark.parametrize("stiffness", sweep([1e6, 1e9, 1e12], [1e6, 1e12]))
def test_events_go_on_as_time_stepping_where_they_cannot_follow_a_spring(accuracy, has_wall, stiffness):
    """1 kg on 10⁶ N/m swings by 100 rad in 0.1 s and is followed; on 10⁹ N/m by 3,000, on 10¹² N/m by 10⁵.

    The energy is kept to the tolerance by the first (2e-10 a radian, 300 of them), by time stepping it does not grow.
    """
    walls = [physics.HalfSpace((0.0, 1.0, 0.0), offset=-5.0)] if has_wall else []
    effects = [physics.Spring(stiffness=stiffness), *([physics.Contact()] if has_wall else [])]
    scene = physics.Scene([physics.Sphere(0.1, 1.0, pos=(1.0, 0.0, 0.0))], walls, effects)
    world = physics.World(scene, dt=0.1, accuracy=accuracy)
    start = physics.diagnose(world).energy[0, 0]
    for _ in range(3):
        report = world.step()
        assert physics.diagnose(world).energy[0, 0] <= start * (1.0 + 1e-7)
        assert (report.status[0] == physics.Status.COARSE) == (stiffness > 1e6)
        assert report.ok == (stiffness == 1e6)


@pytest.mark.parametrize("other", [None, 1], ids=("to an anchor", "to another body"))
def test_a_body_that_a_step_puts_back_is_reported(other):
    """On a stiff spring at an arm no step finds a way that its energy allows: that it does not move is not rest."""
    ball = physics.Sphere(0.1, 1.0, pos=(0.5, 0.0, 0.0))
    anchor = (0.0, 0.0, 0.0)
    spring = physics.Spring(anchor, (0.1, 0.0, 0.0), stiffness=1e9, body=0, other=other)
    bodies = [ball] if other is None else [ball, physics.Sphere(0.1, 1.0, pos=(0.5, 1.0, 0.0))]
    world = world_of(bodies, [spring, physics.Gravity()], 0.1)
    for _ in range(20):
        report = world.step()
        assert report.status[0] == physics.Status.COARSE
        assert not report.ok


def test_what_lies_still_under_a_stiff_spring_is_not_reported():
    """Nothing moves: nothing is missed. The floor carries what the spring pushes with."""
    block = physics.Block((0.4, 0.3, 0.2), 2.0, pos=(0.0, 0.15, 0.0))
    spring = physics.Spring((0, 1, 0), stiffness=1e7, length=1.0)
    effects = [physics.Gravity(), physics.Contact(), physics.Friction(), spring]
    world = physics.World(physics.Scene([block], [physics.HalfSpace((0, 1, 0))], effects), dt=0.01)
    for _ in range(20):
        report = world.step()
    assert report.ok
    np.testing.assert_allclose(world.pos[0, 0], (0.0, 0.15, 0.0), atol=1e-6)
    _, forces = world.contacts()
    assert forces[:, 1].sum() == pytest.approx(1e7 * (1.0 - 0.85) + 2.0 * 9.81, rel=1e-3)


PAIRS = [pair for pair in drawn_worlds.pairs() if len(pair) == 2]
DRAWN = np.random.default_rng(35).choice(len(PAIRS), 10, replace=False).tolist()
SHORT = [index for index in DRAWN if PAIRS[index] != ("wind", "friction")]


# Draws that once broke the law: drag that grows within a step, a fluid left or reached within one, spin that contact
# makes, soft walls that stop a turning corner or lift a body far, a stiff damper in air, a pair put
# back as it falls, friction of 7e4 at a soft wall.
FOUND = [
    (("gravity", "drag"), False, 2),
    (("buoyancy",), False, 32),
    (("buoyancy",), True, 27),
    (("gravity", "angular drag"), True, 0),
    (("gravity", "compliance"), True, 7),
    (("gravity", "compliance"), True, 19),
    (("drag", "spring between bodies"), False, 18),
    (("gravity", "spring between bodies"), False, 28),
    (("compliance", "friction of two coefficients"), True, 36),
]


@pytest.mark.parametrize(
    ("names", "on_floor", "seed"), sweep(FOUND, FOUND[1:-1], lambda draw: "-".join(map(str, draw)))
)
def test_draws_that_once_gave_energy(names, on_floor, seed):
    """The energy of each stays within the law of `benchmarks.drawn_worlds`."""
    outcome = one(names, on_floor, "fast", seed)
    assert outcome.is_finite.all()
    assert (outcome.excess <= 0.0).all()


def test_a_stiff_damper_between_two_bodies_does_not_push_them_through_the_air():
    """Only drag changes the common momentum: by at most k v² t of each body's speed, k < 1e-4 kg/m, in 0.1 s.

    The damper's load at the start is 10⁶ N. A share h λ ~ 1e-5 of it, left to one of the two, would be 10 N.
    """
    bodies = [physics.Sphere(0.1, 1.0, linvel=(5.0, 0.0, 0.0)), physics.Sphere(0.1, 3.0, pos=(2.0, 0.0, 0.0))]
    damper = physics.Spring((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), stiffness=100.0, damping=2e5, length=2.0, body=0, other=1)
    world = world_of(bodies, [damper, physics.Drag(1e-3)], 0.01)
    world.step(steps=10)
    momentum = world.linvel[0, 0] + 3.0 * world.linvel[0, 1]
    strength = 0.5 * 1.225 * 1e-3 * math.pi * 0.01
    assert np.abs(momentum - (5.0, 0.0, 0.0)).max() <= 0.1 * 2 * strength * 25.0 + 1e-11


@pytest.mark.parametrize("index", sweep(DRAWN, SHORT, lambda index: " and ".join(PAIRS[index])))
def test_no_energy_from_nowhere(index, is_exhaustive):
    """Ten pairs of effects with drawn parameters; all pairs: `python -m benchmarks.drawn_effects`."""
    for seed in range(5 if is_exhaustive else 2):
        rng = np.random.default_rng([35, index, seed])
        scene = drawn_worlds.draw_scene(rng, PAIRS[index], on_floor=True)
        outcome = drawn_worlds.run(rng, scene, ("fast", "balanced")[seed % 2], 4)
        assert outcome.is_finite.all()
        assert (outcome.excess <= 0.0).all()
