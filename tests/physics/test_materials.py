"""Materials: friction and restitution of bodies, walls and pairs, against closed forms, at every preset."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import physics
from physics import Block, Contact, Friction, Gravity, HalfSpace, Scene, Sphere, World
from physics.kernels.contact_law.materials import RULES
from tests.reference.materials import COMBINED, block_in_corner
from tests.tiers.sweep import sweep

pytestmark = pytest.mark.interpreted  # a rule is compiled into the kernels of its scenes

G = 9.81
PRESETS = sweep(("fast", "balanced", "precise", "reference"), ("balanced", "precise"))

# Distance to the closed form [m]. Time stepping with steps of h stops a block by friction within the step in which it
# would stop: the last step has at most the slip μ g h, over a time h. That is 2.5e-5 μ g m at 5 ms, and 1e-4 m below
# μ = 0.4; the exact law of the stage (`stick_target`) does better. The event-driven scheme stops it at the event.
NEAR = {"fast": 1e-4, "balanced": 1e-4, "precise": 1e-10, "reference": 1e-10}
ICE, RUBBER, STEEL = 0.05, 0.9, 0.3


def slide(accuracy, block, wall, rule="geometric_mean", pairs=(), more=(), speed=0.6, dt=0.005, scene_friction=0.7):
    """Way [m] of a block with friction `block` on a floor with friction `wall`, until it stops; None: none of its own.

    `more` are further walls that the block never meets.
    """
    body = Block((1.0, 0.2, 1.0), 2.0, pos=(0, 0.1, 0), linvel=(speed, 0, 0), friction=block, name="block")
    walls = [HalfSpace((0, 1, 0), friction=wall, name="floor"), *more]
    world = World(
        Scene([body], walls, [Gravity(), Contact(), Friction(scene_friction, rule=rule, pairs=pairs)]),
        dt=dt,
        accuracy=accuracy,
    )
    while np.abs(world.linvel).max() > 0.0:
        world.step(steps=20)
        assert world.time < 100.0
    return world.pos[0, 0, 0]


def way(mu, speed=0.6):
    return speed * speed / (2 * mu * G)


@pytest.mark.parametrize("accuracy", PRESETS)
@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize(
    ("block", "wall"), sweep([(ICE, RUBBER), (STEEL, RUBBER), (STEEL, STEEL)], keep=[(STEEL, RUBBER)])
)
def test_a_block_on_a_wall_stops_where_the_rule_says(accuracy, rule, block, wall):
    mu = COMBINED[rule](block, wall)
    assert slide(accuracy, block, wall, rule) == pytest.approx(way(mu), abs=NEAR[accuracy])


SIDES = [HalfSpace((1, 0, 0), -100.0, friction=0.6), HalfSpace((-1, 0, 0), -100.0)]


@pytest.mark.parametrize("accuracy", PRESETS)
def test_walls_that_differ_act_each_with_its_own_friction(accuracy):
    """The floor's own number, the scene's at a floor without one, and an exception, beside walls that are never met."""
    near = NEAR[accuracy]
    assert slide(accuracy, 0.4, 0.1, more=SIDES) == pytest.approx(way(0.2), abs=near)
    assert slide(accuracy, None, 0.7 / 4, more=SIDES) == pytest.approx(way(0.35), abs=near)
    assert slide(accuracy, 0.4, None, more=SIDES) == pytest.approx(way(0.4), abs=near)
    assert slide(accuracy, None, None, more=SIDES) == pytest.approx(way(0.7), abs=near)
    assert slide(accuracy, 0.4, 0.1, pairs={("floor", "block"): 0.25}, more=SIDES) == pytest.approx(way(0.25), abs=near)
    assert slide(accuracy, 0.4, 0.1, pairs={(0, -2): 0.25}, more=SIDES) == pytest.approx(way(0.2), abs=near)


@pytest.mark.parametrize("accuracy", ["balanced", "precise"])
@pytest.mark.parametrize("more", [(), SIDES])
def test_a_frictionless_wall_among_others_does_not_brake(accuracy, more):
    body = Block((1.0, 0.2, 1.0), 2.0, pos=(0, 0.1, 0), linvel=(2.0, 0, 0), friction=0.5)
    scene = Scene([body], [HalfSpace((0, 1, 0), friction=0.0), *more], [Gravity(), Contact(), Friction(0.5)])
    world = World(scene, dt=0.005, accuracy=accuracy)
    world.step(steps=100)
    assert world.linvel[0, 0] == pytest.approx((2.0, 0.0, 0.0), abs=1e-9)
    assert world.pos[0, 0, 0] == pytest.approx(1.0, abs=1e-9)


# --- a block that touches two walls of different friction ---------------------------------------------------------


@pytest.mark.parametrize("accuracy", PRESETS)
@pytest.mark.parametrize(("floor", "side"), [(0.2, 0.6), (0.6, 0.2), (0.0, 0.5), (0.5, 0.0)])
@pytest.mark.parametrize("slope", [0.3, 1.0])
def test_a_block_in_a_corner_is_braked_by_both_walls(accuracy, floor, side, slope):
    """A block slides along z, pressed onto floor and side wall by gravity, against a slow integration."""
    gravity = (-G * math.sin(slope), -G * math.cos(slope), 0.0)
    cube = Block((1.0, 1.0, 1.0), 2.0, pos=(0.5, 0.5, 0), linvel=(0, 0, 3.0), friction=0.9)
    walls = [HalfSpace((0, 1, 0), friction=floor), HalfSpace((1, 0, 0), friction=side)]
    scene = Scene([cube], walls, [Gravity(gravity), Contact(), Friction(0.5, rule="minimum")])
    world = World(scene, dt=0.005, accuracy=accuracy)
    time = 0.15
    world.step(steps=30)
    z, speed = block_in_corner(time, 3.0, slope, floor, side, G)
    near = NEAR[accuracy] + physics.PRESETS[accuracy].tolerance * G * time  # the residual of every step adds up
    assert world.linvel[0, 0, 2] == pytest.approx(speed, abs=near)
    assert world.pos[0, 0, 2] == pytest.approx(z, abs=time * near)
    assert np.abs(world.pos[0, 0, :2] - 0.5).max() < 1e-4


# --- two bodies ---------------------------------------------------------------------------------------------------


def slide_on_plank(accuracy, block, plank, rule, pairs=(), between=True):
    """Way [m] of a block on a heavy plank until both move alike, on a floor without friction."""
    top = Block((0.5, 0.2, 0.5), 1.0, pos=(0, 0.3, 0), linvel=(0.6, 0, 0), friction=block, name="block")
    under = Block((50.0, 0.2, 2.0), PLANK, friction=plank, name="plank", pos=(0, 0.1, 0))
    scene = Scene(
        [under, top],
        [HalfSpace((0, 1, 0), name="floor")],
        [Gravity(), Contact(), Friction(0.5, rule=rule, pairs={("plank", "floor"): 0.0, **dict(pairs)})],
    )
    world = World(scene, dt=0.005, accuracy=accuracy)
    while abs(world.linvel[0, 1, 0]) > 1e-6:
        world.step(steps=20)
        assert world.time < 100.0
    return world.pos[0, 1, 0] - world.pos[0, 0, 0]


# At `precise` a stage ends with the slip, and forces are constant before it. So only residuals are left: the tolerance
# of the speed, 1e-10 of ways of at most 0.4 m.
NEAR_OF_TWO = {"fast": 1e-4, "balanced": 1e-4, "precise": 1e-10}
OF_TWO = [
    (accuracy, rule, pair)
    for accuracy in NEAR_OF_TWO
    for rule in RULES
    for pair in [(ICE, RUBBER), (STEEL, RUBBER), (STEEL, STEEL)]
]
PLANK = 1e9  # [kg]; the block has 1 kg, so that their relative acceleration is that of a block on a wall and 1e-9 of it


def _is_of_default_tier(one):
    accuracy, rule, pair = one
    return pair == (STEEL, RUBBER) and (accuracy == "balanced" or (accuracy, rule) == ("precise", "minimum"))


@pytest.mark.parametrize(("accuracy", "rule", "pair"), sweep(OF_TWO, _is_of_default_tier))
def test_a_block_on_a_plank_stops_where_the_rule_says(accuracy, rule, pair):
    expected = way(COMBINED[rule](*pair)) / (1 + 1 / PLANK)
    assert slide_on_plank(accuracy, *pair, rule) == pytest.approx(expected, abs=NEAR_OF_TWO[accuracy])


def test_an_exception_for_two_bodies_replaces_the_rule():
    found = slide_on_plank("balanced", STEEL, RUBBER, "maximum", {("block", "plank"): 0.2})
    assert found == pytest.approx(way(0.2), abs=1e-4)


# --- restitution ----------------------------------------------------------------------------------------------------


def rebound(accuracy, ball, wall, rule="maximum", more=(), pairs=(), scene_e=0.1, on_ball=False):
    """Ratio of the speeds after and before a ball's first impact, with a wall or with a ball of 1e12 kg."""
    falling = Sphere(0.1, 1.0, pos=(0, 0.35, 0), linvel=(0, -2.0, 0), restitution=ball, name="ball")
    heavy = [Sphere(0.1, 1e12, pos=(0, 0.1, 0), restitution=wall, name="heavy")] if on_ball else []
    walls = [] if on_ball else [HalfSpace((0, 1, 0), restitution=wall, name="floor"), *more]
    contact = Contact(restitution=scene_e, restitution_rule=rule, restitution_pairs=pairs)
    world = World(Scene([falling, *heavy], walls, [contact]), dt=0.005, accuracy=accuracy)
    world.step(steps=40)  # impacts are at 75 ms and 125 ms
    return world.linvel[0, 0, 1] / 2.0


@pytest.mark.parametrize("accuracy", PRESETS)
@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("more", [(), SIDES[:1]], ids=["one wall", "walls that differ"])
def test_a_ball_leaves_a_wall_with_the_restitution_of_the_rule(accuracy, rule, more):
    more = [replace(wall, friction=None, restitution=0.9) for wall in more]
    expected = COMBINED[rule](0.4, 0.8)
    assert rebound(accuracy, 0.4, 0.8, rule, more) == pytest.approx(expected, abs=1e-12)
    assert rebound(accuracy, 0.4, None, rule, more) == pytest.approx(0.4, abs=1e-12)
    assert rebound(accuracy, 0.4, 0.8, rule, more, {("ball", "floor"): 0.25}) == pytest.approx(0.25, abs=1e-12)


@pytest.mark.parametrize("accuracy", PRESETS)
@pytest.mark.parametrize("rule", RULES)
def test_a_ball_leaves_a_ball_with_the_restitution_of_the_rule(accuracy, rule):
    expected = COMBINED[rule](0.4, 0.8)
    near = 1e-11  # the heavy ball takes a share of 1e-12
    assert rebound(accuracy, 0.4, 0.8, rule, on_ball=True) == pytest.approx(expected, abs=near)
    assert rebound(accuracy, 0.4, 0.8, rule, (), {(1, 0): 0.25}, on_ball=True) == pytest.approx(0.25, abs=near)


def test_the_rebound_height_follows_from_the_speed():
    """A ball that falls from h rises to e² h."""
    ball = Sphere(0.1, 1.0, pos=(0, 1.1, 0))
    scene = Scene([ball], [HalfSpace((0, 1, 0), restitution=0.8)], [Gravity(), Contact(restitution=0.4)])
    world = World(scene, dt=0.01, accuracy="precise")
    fall = math.sqrt(2 / G)
    world.step(steps=math.floor((fall + 0.8 * fall) / 0.01))
    top = world.pos[0, 0, 1] - 0.1 + world.linvel[0, 0, 1] ** 2 / (2 * G)
    assert top == pytest.approx(0.64, abs=1e-12)


def test_restitution_of_a_wall_needs_no_number_of_the_scene():
    assert rebound("balanced", None, 0.5, scene_e=None) == 0.5


def test_impacts_at_walls_of_different_restitution_gain_no_energy(is_exhaustive):
    """Without friction, too: several coefficients at once may give energy by Newton's law alone."""
    rng = np.random.default_rng(1)
    worlds, steps = (200, 100) if is_exhaustive else (12, 40)
    walls = [HalfSpace(n, -1.0, restitution=e) for n, e in [((0, 1, 0), 0.95), ((1, 1, 0), 0.0), ((-1, 1, 1), 0.5)]]
    for accuracy in ("balanced", "precise"):
        quats = rng.normal(size=(worlds, 1, 4))
        quats /= np.linalg.norm(quats, axis=2, keepdims=True)
        scene = Scene([Block((0.5, 0.4, 0.3), 1.0)], walls, [Contact(restitution=0.3)])
        world = World(scene, worlds=worlds, dt=0.01, accuracy=accuracy)
        world.set_state(
            quat=quats,
            linvel=rng.normal(size=(worlds, 1, 3)) - (0, 3, 0),
            angvel=3 * rng.normal(size=(worlds, 1, 3)),
        )
        before = physics.diagnose(world).energy[:, 0]
        for _ in range(steps):
            world.step()
            after = physics.diagnose(world).energy[:, 0]
            assert (after <= before * (1 + 1e-9)).all()
            before = after


# --- laws that hold for all inputs ----------------------------------------------------------------------------------

COEFFICIENTS = st.floats(0.0, 2.0)


@given(a=COEFFICIENTS, b=COEFFICIENTS, rule=st.sampled_from(RULES))
def test_rules_are_symmetric_and_lie_between_except_the_product(a, b, rule):
    from physics.kernels.contact_law.materials import combine

    code = RULES.index(rule)
    found = combine.py_func(code, a, b) if hasattr(combine, "py_func") else combine(code, a, b)
    other = combine.py_func(code, b, a) if hasattr(combine, "py_func") else combine(code, b, a)
    assert found == other == pytest.approx(COMBINED[rule](a, b), rel=1e-15)


def _trajectory(scene, accuracy):
    world = World(scene, dt=0.01, accuracy=accuracy)
    world.step(steps=100)
    return world.state.tobytes()


@pytest.mark.compiled
@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    mu=st.floats(0.0, 1.5),
    e=st.floats(0.0, 1.0),
    rule=st.sampled_from(["minimum", "average", "geometric_mean", "maximum"]),
)
@pytest.mark.parametrize("accuracy", sweep(["balanced", "precise"], ["balanced"]))
def test_explicit_equal_coefficients_have_the_bits_of_one_for_the_scene(accuracy, mu, e, rule):
    effects = [Gravity(), Contact(restitution=e), Friction(mu)]
    body = Block((0.5, 0.3, 0.2), 1.0, pos=(0, 0.5, 0), quat=(0.8, 0.36, 0.48, 0), linvel=(1, 0, 0.5), angvel=(1, 2, 3))
    plain = Scene([body], physics.three_walls(1.0), effects)
    own = [replace(wall, friction=mu, restitution=e) for wall in plain.walls]
    told = [Gravity(), Contact(restitution=0.9, restitution_rule=rule), Friction(0.9, rule=rule)]
    given_all = Scene([replace(body, friction=mu, restitution=e)], own, told)
    assert _trajectory(plain, accuracy) == _trajectory(given_all, accuracy)
