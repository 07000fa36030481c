"""Contact that gives: springs and dampers at contact points, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import physics
from tests.tiers.sweep import sweep

# Marked `compiled` are runs of a ball without friction, whose kernel one of them needs anyway.
pytestmark = pytest.mark.interpreted

G = 9.81
M, R = 2.0, 0.5
FLOOR = physics.HalfSpace((0, 1, 0))
K = 2000.0
SAG = M * G / K
STEPS = np.array([0.004, 0.002, 0.001, 0.0005])


def ball(**start) -> physics.Sphere:
    return physics.Sphere(R, M, **{"pos": (0, R, 0), **start})


def slab(**start) -> physics.Block:
    return physics.Block((1.0, 0.1, 1.0), M, **{"pos": (0, 0.05, 0), **start})


def world(body, k=K, c=0.0, friction=None, *, dt=0.01, gravity=(0, -G, 0), worlds=1, accuracy="balanced"):
    laws = [] if friction is None else [friction]
    effects = [physics.Gravity(gravity), physics.Contact(stiffness=k, damping=c), *laws]
    return physics.World(physics.Scene([body], [FLOOR], effects), worlds=worlds, dt=dt, accuracy=accuracy)


def energy(built: physics.World) -> np.ndarray:
    return physics.diagnose(built).energy[:, 0]


# --- at rest ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("k", [1e3, 1e5, 1e9])
@pytest.mark.parametrize(
    ("body", "springs", "height"), [pytest.param(ball, 1, R, marks=pytest.mark.compiled), (slab, 4, 0.05)]
)
def test_a_body_sinks_in_by_its_weight_over_its_springs(body, springs, height, k, is_exhaustive):
    """m g/(n k), at any step; what is left of the oscillation is damped out, ζ = ½ of n springs and dampers.

    The solver's tolerance is 1e-6 of the speeds of a step: so many g dt² of the place.
    """
    c = math.sqrt(k * M / springs)
    built = world(body(), k, c)
    built.step(steps=3000 if is_exhaustive and k < 1e4 else 500)
    assert height - built.pos[0, 0, 1] == pytest.approx(M * G / (springs * k), rel=1e-9, abs=1e-6 * G * 1e-4)
    assert np.abs(built.linvel).max() < 1e-6 * G * 0.01


@pytest.mark.compiled
def test_at_its_sag_a_ball_stays():
    built = world(ball(pos=(0, R - SAG, 0)))
    built.step(steps=1000)
    assert built.pos[0, 0] == pytest.approx([0, R - SAG, 0], abs=1e-15)


# --- bobbing ---------------------------------------------------------------------------------------------------------


def replay(k, c, h, depth, steps):
    """Heights over the sag of the θ-method on m y'' = -k y - c y', from y = depth at rest, as `compliance` says it.

    y¹ - y⁰ = h v_θ,  m (v¹ - v⁰) = -h (k y_θ + c v_θ): a 2 x 2 system per step.
    """
    rate = max(math.sqrt(k / M), c / M)
    theta = max(0.5, 1 - 1 / (rate * h))
    left = np.array([[1, -theta * h], [theta * h * k, M + theta * h * c]])
    right = np.array([[1, (1 - theta) * h], [-(1 - theta) * h * k, M - (1 - theta) * h * c]])
    step, y = np.linalg.solve(left, right), np.array([depth, 0.0])
    found = []
    for _ in range(steps):
        y = step @ y
        found.append(y[0])
    return np.array(found)


@pytest.mark.compiled
@pytest.mark.parametrize(("k", "c"), [(K, 0), (K, 30), (K, 300), (1e6, 0), (1e6, 1000), (1e12, 0)])
def test_a_bobbing_ball_is_the_discrete_scheme(k, c):
    """Never off the floor: linear, and the same to rounding (of places of size R)."""
    sag = M * G / k
    built, found = world(ball(pos=(0, R - 1.5 * sag, 0)), k, c), []
    for _ in range(100):
        built.step()
        found.append(built.pos[0, 0, 1] - R + sag)
    assert np.array(found) == pytest.approx(replay(k, c, 0.01, -0.5 * sag, 100), abs=1e-13)


@pytest.mark.compiled
@pytest.mark.parametrize("c", [0.0, 30.0])
def test_bobbing_is_of_second_order(c):
    """Against A e^(-ζωt) (cos ω_d t + ζω/ω_d sin ω_d t)."""
    t, amplitude = 0.5, -0.5 * SAG
    decay, errors = c / (2 * M), []
    turn = math.sqrt(K / M - decay**2)
    exact = amplitude * math.exp(-decay * t) * (math.cos(turn * t) + decay / turn * math.sin(turn * t))
    for dt in STEPS:
        built = world(ball(pos=(0, R - SAG + amplitude, 0)), c=c, dt=dt)
        built.step(steps=round(t / dt))
        errors.append(abs(built.pos[0, 0, 1] - R + SAG - exact))
    assert np.polyfit(np.log(STEPS), np.log(errors), 1)[0] == pytest.approx(2, abs=0.1)


@pytest.mark.compiled
def test_without_damping_bobbing_keeps_its_energy():
    """The midpoint rule is symplectic and the spring linear: to rounding, over 2000 steps."""
    built = world(ball(pos=(0, R - 1.9 * SAG, 0)))
    start = energy(built)
    built.step(steps=2000)
    assert energy(built) == pytest.approx(start, rel=1e-12)


# --- bouncing --------------------------------------------------------------------------------------------------------


def bounces(c, dt, count=64):
    """(rebound speed over the first one, time in contact) of balls that hit at different moments of a step."""
    v, t = 1.0, 0.4
    built = world(ball(), c=c, dt=dt, gravity=(0, 0, 0), worlds=count)
    heights = 0.05 + np.arange(count) / count * v * dt
    pos = np.zeros((count, 1, 3))
    pos[:, 0, 1] = R + heights
    built.set_state(pos=pos, linvel=np.broadcast_to([0, -v, 0], pos.shape))
    built.step(steps=round(t / dt))
    out = built.linvel[:, 0, 1]
    return out / v, t - heights / v - (built.pos[:, 0, 1] - R) / out


@pytest.mark.compiled
def test_an_undamped_bounce_loses_what_the_last_step_of_contact_cuts_off():
    """A spring that ends a step with a gap g¹ > 0 has lost ½ k g¹² (or ½ k g⁰², if it did not push): at most u dt/2 of
    way, so that e² >= 1 - (ω dt)²/4; and none is gained."""
    for dt in STEPS:
        e, _ = bounces(0.0, dt)
        assert e.max() <= 1 + 1e-12
        assert e.min() >= math.sqrt(1 - (math.sqrt(K / M) * dt) ** 2 / 4)


@pytest.mark.compiled
@pytest.mark.parametrize("zeta", sweep([0.0, 0.1, 0.4, 0.9], [0.1, 0.9]))
def test_a_bounce_takes_its_time_and_its_energy(zeta):
    """The force of x'' + 2ζω x' + ω² x = 0 from x = 0, x' = -v ends where x'' = 0 (Schwager and Pöschel 2007).

    That is at ω_d t = π - 2 asin ζ, with x' = v e^(-ζωt), and the ball flies the way x = -2ζ x'/ω that is left. The
    time is π/ω undamped, e = 1. Of second order, whatever part of a step the contact begins and ends in: root of the
    mean square of 64 of them.
    """
    omega = math.sqrt(K / M)
    t = (math.pi - 2 * math.asin(zeta)) / (omega * math.sqrt(1 - zeta**2))
    e = math.exp(-zeta * omega * t)
    errors = []
    for dt in STEPS:
        found_e, found_t = bounces(2 * zeta * math.sqrt(K * M), dt)
        errors.append([np.sqrt(np.mean((found_e - e) ** 2)), np.sqrt(np.mean((found_t - t - 2 * zeta / omega) ** 2))])
    slopes = np.polyfit(np.log(STEPS), np.log(errors), 1)[0]
    assert slopes == pytest.approx([2, 2], abs=0.1)
    assert errors[-1][0] < 1e-4


# --- stiffness without bound -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("friction", [None, physics.Friction(0.5)])
@pytest.mark.parametrize("k", sweep([1e3, 1e6, 1e9, 1e12, 1e15], [1e6, 1e15]))
def test_no_stiffness_gives_energy(k, friction, is_exhaustive):
    """Blocks that tumble onto the floor, undamped, steps of 10 ms.

    Without turning there is nothing to gain. A point that turns by φ in a step is off its parabola by φ³ r/12, and the
    energy of its spring by k times that and its depth ρ. For k = 1e3, which a step resolves, with ρ = 0.2 m, φ = 0.1,
    0.01 J a step of either sign, in ten steps of a bounce up to 0.1 % of some 40 J. Depths go with 1/√k, and what a
    step does not resolve loses most of its energy at once.
    """
    rng = np.random.default_rng(7)
    count, steps = (200, 200) if is_exhaustive else (5, 100)
    built = world(physics.Block((1, 0.6, 0.4), M, pos=(0, 1, 0)), k, friction=friction, worlds=count)
    quat = rng.normal(size=(count, 1, 4))
    quat /= np.linalg.norm(quat, axis=-1, keepdims=True)
    built.set_state(quat=quat, linvel=2 * rng.normal(size=(count, 1, 3)), angvel=6 * rng.normal(size=(count, 1, 3)))
    start = energy(built)
    for _ in range(steps):
        built.step()
        assert (energy(built) <= start * (1.001 if k < 1e8 else 1 + 1e-6)).all()
    assert physics.diagnose(built).gap.min() > -1.5 * math.sqrt(2 * start.max() / k) - 1e-6


vectors = st.tuples(*[st.floats(-5, 5)] * 3)


@pytest.mark.compiled
@settings(max_examples=60, deadline=None)
@given(velocity=vectors, k=st.floats(0, 15).map(lambda p: 10**p), c=st.floats(0, 1e6), height=st.floats(0, 0.5))
def test_a_smooth_ball_never_gains_energy(velocity, k, c, height):
    """A θ-method with θ >= ½, and a contact that begins above the wall pays for what it stores: rounding alone."""
    built = world(ball(pos=(0, R + height, 0), linvel=velocity), k, c)
    before = energy(built)
    for _ in range(40):
        built.step()
        now = energy(built)
        assert now <= before * (1 + 1e-12) + 1e-12
        before = now


@pytest.mark.compiled
def test_stiff_contact_tends_to_rigid_contact():
    """A ball that falls: its rebound after one step falls as 1/(λh), λ = √(k/m), and its depth as 1/k; then it lies."""
    rebounds = []
    stiff = np.array([1e8, 1e10, 1e12])
    for k in stiff:
        built = world(ball(pos=(0, R + 0.1, 0)), k)
        built.step(steps=15)
        rebounds.append(built.linvel[0, 0, 1])
        built.step(steps=1000)
        assert R - built.pos[0, 0, 1] == pytest.approx(M * G / k, rel=1e-9, abs=1e-15)
    speed = math.sqrt(2 * G * 0.1)
    assert (np.array(rebounds) <= 10 * speed / (np.sqrt(stiff / M) * 0.01)).all()


@pytest.mark.parametrize("k", [1e8, 1e12])
def test_a_slab_slides_on_stiff_springs_as_far_as_on_rock(k):
    """v²/(2μg), less v dt/2: implicit Euler moves with the velocity at a step's end.

    Up to what is missing to implicit Euler, 1 - θ = 1/(λ dt) of v dt, λ dt > 60 here, and the step in which it stops.
    """
    v, mu, dt = 2.0, 0.4, 0.002
    built = world(slab(pos=(0, 0.05 - M * G / (4 * k), 0), linvel=(v, 0, 0)), k, friction=physics.Friction(mu), dt=dt)
    built.step(steps=400)
    assert built.pos[0, 0, 0] == pytest.approx(v * v / (2 * mu * G) - v * dt / 2, abs=v * dt / 60 + mu * G * dt**2)
    assert np.abs(built.linvel).max() < 1e-6


def test_a_soft_floor_with_a_grain():
    """Both laws at once: each deceleration its own μ g, exact at any step."""
    friction = physics.Friction((0.2, 0.4), axis=(0, 0, 1))
    for way, mu in (((0, 0, 1), 0.2), ((1, 0, 0), 0.4)):
        built = world(slab(pos=(0, 0.05 - SAG / 4, 0), linvel=way), friction=friction)
        built.step(steps=10)
        # The slab tips on its springs by μ 0.05/0.5 of their sag: a share of some percent of the loads, back and forth.
        assert built.linvel[0, 0] @ way == pytest.approx(1 - mu * G * 0.1, rel=0.02)


def test_a_slab_holds_on_a_soft_slope(is_exhaustive):
    """Friction alone holds it: it creeps by at most the tolerance."""
    slope = 0.3
    built = world(slab(), 1e5, 300.0, physics.Friction(0.5), gravity=(G * math.sin(slope), -G * math.cos(slope), 0))
    steps = 300 if is_exhaustive else 150
    built.step(steps=steps)
    at = built.pos.copy()
    built.step(steps=steps)
    assert np.abs(built.pos - at).max() < 1e-6
    _, forces = built.contacts(0)
    assert forces.sum(axis=0) == pytest.approx(
        [-M * G * math.sin(slope), M * G * math.cos(slope), 0], rel=1e-5, abs=1e-4
    )


@pytest.mark.compiled
def test_a_worlds_step_does_not_depend_on_the_batch():
    batch, alone = (world(ball(pos=(0, R + 0.2, 0)), worlds=n) for n in (5, 1))
    for built in (batch, alone):
        built.step(steps=150)
    assert (batch.state == alone.state[0]).all()


# --- what is declared ------------------------------------------------------------------------------------------------


def test_rigid_contact_stores_nothing_of_it():
    rigid = physics.World(physics.Scene([ball()], [FLOOR], [physics.Contact()]))
    soft = world(ball())
    assert rigid.plan.laws == ()
    assert soft.plan.laws == ("stiffness", "damping")
    assert soft.params.shape[1] == rigid.params.shape[1] + 2
    names = [
        {*built.scratch[0]["body"].dtype.names, *built.scratch[0]["contacts"].dtype.names} for built in (rigid, soft)
    ]
    assert names[1] - names[0] == {"laws", "law_stiffness", "law_damping", "give", "end_gap"}
    assert "compliance" in soft.plan.explain()
    assert "declared: 2000.0 N/m, 0.0 N s/m per contact point" in soft.plan.explain()


def test_it_comes_back_from_a_file(tmp_path):
    scene = physics.Scene([ball()], [FLOOR], [physics.Contact(stiffness=1e4, damping=3.0)])
    physics.save_scene(scene, tmp_path / "scene.toml")
    assert physics.load_scene(tmp_path / "scene.toml") == scene
    with pytest.raises(ValueError, match=r"cannot express Contact.stiffness of 10000.0"):
        physics.save_mjcf(scene, tmp_path / "scene.xml")


BAD = [
    (lambda: physics.Contact(stiffness=0), r"Contact.stiffness is 0.0; allowed are numbers greater than 0"),
    (lambda: physics.Contact(stiffness=1, damping=-1), r"Contact.damping is -1.0; allowed are numbers of at least 0"),
    (lambda: physics.Contact(damping=1), "Contact.damping is 1.0; allowed without a stiffness is 0"),
    (lambda: physics.Contact(0.5, stiffness=1), "Contact.restitution is 0.5 with a stiffness; allowed is None"),
    (lambda: physics.Contact(tangential=0, stiffness=1), "Contact.tangential is 0.0 with a stiffness; allowed is None"),
]


@pytest.mark.parametrize(("make", "message"), BAD)
def test_it_says_what_is_wrong(make, message):
    with pytest.raises(ValueError, match=message):
        make()
