"""Rolling friction, spin friction and tangential restitution of a ball on a wall, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import physics

pytestmark = pytest.mark.interpreted

EPS = np.finfo(float).eps
G = 9.81
R, M = 0.5, 2.0
STEPS = np.array([0.02, 0.01, 0.005, 0.0025])
FLOOR = physics.HalfSpace((0, 1, 0))


def ball(**start) -> physics.Sphere:
    """On the floor unless `pos` says otherwise."""
    return physics.Sphere(R, M, **{"pos": (0, R, 0), **start})


def world(body, rolling=0.0, spin=0.0, mu=0.8, e=0.6, tangential=0.0, *, dt=0.01, gravity=(0, -G, 0), worlds=1):
    """One plan for all tests here: every law declared, unused ones with strength 0."""
    effects = [
        physics.Gravity(gravity), physics.Contact(e, tangential=tangential), physics.Friction(mu),
        physics.RollingFriction(rolling), physics.SpinFriction(spin),
    ]  # fmt: skip
    return physics.World(physics.Scene([body], [FLOOR], effects), worlds=worlds, dt=dt)


def energy(built: physics.World) -> float:
    return float(physics.diagnose(built).energy[0, 0])


@pytest.mark.parametrize("dt", [0.05, 0.005])
def test_a_rolling_ball_slows_by_five_sevenths_of_g_times_radius_over_radius(dt):
    """m v' = -F, (2/5) m r² ω' = F r - ρ m g, v = r ω: v' = -(5/7) ρ g/r; a parabola, exact at any step."""
    rho, v, t = 0.02, 3.0, 1.0
    built = world(ball(linvel=(v, 0, 0), angvel=(0, 0, -v / R)), rho, dt=dt)
    built.step(steps=round(t / dt))
    slowing = 5 / 7 * rho * G / R
    assert built.linvel[0, 0] == pytest.approx([v - slowing * t, 0, 0], abs=1e-12)
    assert built.angvel[0, 0] == pytest.approx([0, 0, -(v - slowing * t) / R], abs=1e-12)
    assert built.pos[0, 0] == pytest.approx([v * t - slowing * t * t / 2, R, 0], abs=1e-12)


def test_a_rolling_ball_stops_after_its_closed_form_and_stays():
    """v²/(2 a); the step in which it stops holds what is left of v over it, an error of less than a dt²."""
    rho, v, dt = 0.05, 1.0, 0.01
    slowing = 5 / 7 * rho * G / R
    built = world(ball(linvel=(0, 0, v), angvel=(v / R, 0, 0)), rho, dt=dt)
    built.step(steps=round(2 * v / slowing / dt))
    assert built.pos[0, 0, 2] == pytest.approx(v * v / (2 * slowing), abs=slowing * dt * dt)
    assert np.abs(built.linvel).max() < 1e-15
    before = built.pos.copy()
    built.step(steps=1000)
    assert np.abs(built.pos - before).max() < 1e-14


def test_spin_on_the_spot_fades_by_its_torque():
    """(2/5) m r² ω' = -σ m g: linear in time, exact at any step, then still to the last bit."""
    sigma, spin, t = 0.01, 8.0, 3.0
    fading = 2.5 * sigma * G / R**2
    built = world(ball(angvel=(0, spin, 0)), spin=sigma, dt=0.02)
    built.step(steps=round(t / 0.02))
    assert built.angvel[0, 0] == pytest.approx([0, spin - fading * t, 0], abs=1e-12)
    assert np.abs(built.linvel).max() < 1e-15
    built.step(steps=round(spin / fading / 0.02))
    assert np.abs(built.angvel).max() < 1e-15


def slides_then_rolls(dt):
    """(error of place and speed) of a ball that slides at first: v' = -μ g, r ω' = (5/2)(μ - ρ/r) g, up to v = r ω."""
    rho, mu, v, t = 0.05, 0.3, 4.0, 1.0
    first = v / (mu * G + 2.5 * (mu - rho / R) * G)
    speed, slowing = v - mu * G * first, 5 / 7 * rho * G / R
    place = v * first - mu * G * first**2 / 2 + speed * (t - first) - slowing * (t - first) ** 2 / 2
    built = world(ball(linvel=(v, 0, 0)), rho, mu=mu, dt=dt)
    built.step(steps=round(t / dt))
    return abs(built.pos[0, 0, 0] - place), abs(built.linvel[0, 0, 0] - speed + slowing * (t - first))


def test_sliding_into_rolling_is_of_second_order():
    """The step in which it begins to roll mixes two decelerations: v is off by Δa dt at most for it, x by Δa dt²."""
    errors = np.array([slides_then_rolls(dt) for dt in STEPS])
    change = 0.3 * G  # of the deceleration
    assert (errors[:, 0] <= change * STEPS**2).all()
    assert (errors[:, 1] <= change * STEPS).all()
    assert errors[-1].max() < 1e-3 * change


@pytest.mark.parametrize("share", [0.99, 1.01])
def test_a_slope_holds_a_ball_up_to_the_angle_of_rolling_friction(share):
    """It rolls iff tan θ > ρ/r, then with (5/7) g (sin θ - ρ/r cos θ)."""
    rho, t = 0.05, 4.0
    angle = math.atan(share * rho / R)
    gravity = (G * math.sin(angle), -G * math.cos(angle), 0)
    built = world(ball(), rho, gravity=gravity)
    built.step(steps=round(t / 0.01))
    a = max(5 / 7 * G * (math.sin(angle) - rho / R * math.cos(angle)), 0.0)
    assert built.linvel[0, 0, 0] == pytest.approx(a * t, abs=1e-12)
    assert built.pos[0, 0, 0] == pytest.approx(a * t * t / 2, abs=1e-12)


@pytest.mark.parametrize(("tangential", "mu"), [(1.0, 5.0), (0.4, 5.0), (0.0, 5.0), (-1.0, 5.0), (0.7, 0.2)])
def test_an_impact_of_a_superball(tangential, mu):
    """Hard case 11 along both tangents; in the cone of friction: at most μ (1 + e) |v_n| along the wall (Walton)."""
    v, w, fall, e = np.array([3.0, 0.0, 1.0]), np.array([0.5, 0.3, 2.0]), 2.0, 0.6
    built = world(ball(pos=(0, R + 1, 0), linvel=v - [0, fall, 0], angvel=w), mu=mu, e=e, tangential=tangential)
    built.step(steps=50)
    hit = math.sqrt(fall**2 + 2 * G)
    point = v + np.cross(w, [0, -R, 0])  # velocity of the point of contact along the floor
    change = -2 / 7 * (1 + tangential) * point
    limit = mu * (1 + e) * hit
    change *= min(1.0, limit / np.linalg.norm(change)) if change.any() else 1.0
    assert built.linvel[0, 0, [0, 2]] == pytest.approx((v + change)[[0, 2]], abs=1e-12)
    assert built.angvel[0, 0] == pytest.approx(w + 2.5 / R**2 * np.cross([0, -R, 0], change), abs=1e-12)


@pytest.mark.parametrize("tangential", [1.0, 0.4, -0.5])
def test_a_superball_at_precise(tangential):
    """Flight, impact, flight: places and velocities in closed form, to 1e-8 and better."""
    v, w, fall, e, t = np.array([3.0, 0.0, 1.0]), np.array([0.5, 0.3, 2.0]), 2.0, 0.6, 0.5
    body = ball(pos=(0, R + 1, 0), linvel=v - [0, fall, 0], angvel=w)
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(e, tangential=tangential), physics.Friction(5.0)]
    built = physics.World(physics.Scene([body], [FLOOR], effects), dt=0.1, accuracy="precise")
    built.step(steps=round(t / 0.1))
    hit = math.sqrt(fall**2 + 2 * G)
    first = (hit - fall) / G
    change = -2 / 7 * (1 + tangential) * (v + np.cross(w, [0, -R, 0]))
    end = v + change + [0, e * hit - G * (t - first), 0]
    place = v * first + (v + change) * (t - first) + [0, R + e * hit * (t - first) - G * (t - first) ** 2 / 2, 0]
    assert built.linvel[0, 0] == pytest.approx(end, abs=1e-9)
    assert built.pos[0, 0] == pytest.approx(place, abs=1e-9)
    assert built.angvel[0, 0] == pytest.approx(w + 2.5 / R**2 * np.cross([0, -R, 0], change), abs=1e-9)


def test_a_superball_at_precise_keeps_its_energy():
    """Some twenty elastic impacts, each to rounding."""
    body = ball(pos=(0, 1.5, 0), linvel=(2, 0, 1), angvel=(1, 2, 3))
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(1.0, tangential=1.0), physics.Friction(50.0)]
    built = physics.World(physics.Scene([body], [FLOOR], effects), accuracy="precise")
    start = energy(built)
    assert built.step(steps=2000).impacts[0] > 15
    assert energy(built) == pytest.approx(start, rel=1e-11)


def test_a_superball_keeps_its_energy_and_comes_back():
    """e = e_t = 1: every impact is conservative, and after two of them it flies along the floor as before (Garwin)."""
    built = world(ball(pos=(0, 1.5, 0), linvel=(2, 0, 1), angvel=(1, 2, 3)), mu=50.0, e=1.0, tangential=1.0)
    start, impacts, along = energy(built), 0, {}
    for _ in range(20):
        impacts += int(built.step(steps=100).impacts[0])
        along.setdefault(impacts % 2, []).append(built.linvel[0, 0, [0, 2]].copy())
        # Time stepping finds each impact to half a slop, 2.5e-7 m, so that m g times that per bounce may be lost.
        assert energy(built) == pytest.approx(start, abs=50 * M * G * 2.5e-7)
    point = np.array([2 + 3 * R, 1 - 1 * R])  # velocity of the point of contact at first
    assert set(along) == {0, 1}
    assert np.array(along[0]) == pytest.approx(np.array([2, 1] * len(along[0])).reshape(-1, 2), abs=1e-11)
    assert np.array(along[1]) == pytest.approx(np.tile([2, 1] - 4 / 7 * point, (len(along[1]), 1)), abs=1e-11)


vectors = st.tuples(*[st.floats(-5, 5)] * 3)


@example((0.0, 0.0625, 0.0), (0.0, 0.0, 0.0), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)  # leaves, and is back within the step
@settings(max_examples=2 * settings().max_examples, deadline=None)
@given(
    linvel=vectors, angvel=vectors, rolling=st.floats(0, 0.3), spin=st.floats(0, 0.3), mu=st.floats(0, 3),
    tangential=st.floats(-1, 1), e=st.floats(0, 1), height=st.floats(0, 0.3),
)  # fmt: skip
def test_contact_never_gives_energy(linvel, angvel, rolling, spin, mu, tangential, e, height):
    """Whatever the laws' numbers: energy grows by at most rounding and the place of an impact (half a slop)."""
    body = ball(pos=(0, R + height, 0), linvel=linvel, angvel=angvel)
    built = world(body, rolling, spin, mu, e, tangential)
    allowed = 1e-9 * energy(built) + M * G * 1e-6 * R * 10
    before = energy(built)
    for _ in range(30):
        built.step()
        now = energy(built)
        assert now <= before + allowed
        before = now


def test_in_a_corner_no_law_gives_energy(is_exhaustive):
    """A ball that rests on one wall and hits another, and keeps what it has of the laws' energy at most."""
    rng, worlds = np.random.default_rng(3), 500 if is_exhaustive else 30
    for angle in np.radians([20, 45, 90, 120, 150]):
        normal = np.array([math.sin(angle), -math.cos(angle), 0.0])
        centre = np.linalg.solve([[0, 1], normal[:2]], [R, R])
        walls = [FLOOR, physics.HalfSpace(normal)]
        effects = [
            physics.Gravity((0, 0, 0)), physics.Contact(0.5, tangential=0.9), physics.Friction(1.0),
            physics.RollingFriction(0.0), physics.SpinFriction(0.0),
        ]  # fmt: skip
        built = physics.World(physics.Scene([ball(pos=(*centre, 0))], walls, effects), worlds=worlds, dt=0.001)
        linvel, angvel = rng.normal(size=(worlds, 1, 3)), rng.normal(size=(worlds, 1, 3))
        linvel[..., 1] = 0.0
        built.set_state(linvel=linvel, angvel=angvel)
        before = physics.diagnose(built).energy
        built.step()
        assert (physics.diagnose(built).energy <= before * (1 + 1e-9)).all()


def plain(body, dt=0.01):
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(0.6), physics.Friction(0.8)]
    return physics.World(physics.Scene([body], [FLOOR], effects), dt=dt)


def test_laws_without_strength_leave_every_bit_and_undeclared_ones_are_not_stored():
    body = ball(pos=(0, 1.0, 0), linvel=(3, 0, 1), angvel=(1, 5, 3))
    runs = [plain(body), world(body)]
    for run in runs:
        run.step(steps=300)
    assert np.array_equal(runs[0].state, runs[1].state)
    assert np.array_equal(runs[0].memory, runs[1].memory)
    assert np.array_equal(runs[0].report_table, runs[1].report_table)
    assert runs[1].params.shape[1] == runs[0].params.shape[1] + 3
    names = [set(run.scratch[0]["body"].dtype.names) for run in runs]
    assert names[1] - names[0] == {"laws", "law_tangential", "law_rolling", "law_spin"}
    assert runs[0].plan.laws == ()


def test_laws_may_differ_from_world_to_world():
    built = world(ball(linvel=(3, 0, 0), angvel=(0, 4, -6)), worlds=2)
    changed = [physics.RollingFriction(0.02), physics.SpinFriction(0.01)]
    built.set_parameters(effects=changed, worlds=[1])
    built.step(steps=100)
    assert built.linvel[:, 0, 0] == pytest.approx([3, 3 - 5 / 7 * 0.02 * G / R], abs=1e-12)
    assert built.angvel[:, 0, 1] == pytest.approx([4, 4 - 2.5 * 0.01 * G / R**2], abs=1e-12)
    with pytest.raises(ValueError, match=r"RollingFriction was given.*add physics.RollingFriction"):
        plain(ball()).set_parameters(effects=physics.RollingFriction())


def test_a_block_beside_a_ball_does_not_feel_rolling_friction():
    """It has faces: the same bits with and without."""
    block = physics.Block((1, 1, 1), 2.0, pos=(5, 1.2, 0), linvel=(1, 0, 0), angvel=(1, 2, 0))
    ends = []
    for extra in ((), (physics.RollingFriction(0.3), physics.SpinFriction(0.3))):
        effects = [physics.Gravity(), physics.Contact(between_bodies=False), physics.Friction(), *extra]
        built = physics.World(physics.Scene([block, ball()], [FLOOR], effects))
        built.step(steps=100)
        ends.append(built.state[0].tobytes())
    assert ends[0] == ends[1]


BAD = [
    (lambda: physics.RollingFriction(-1), "RollingFriction.radius is -1"),
    (lambda: physics.SpinFriction(math.nan), "SpinFriction.radius is nan"),
    (lambda: physics.Contact(tangential=2), "Contact.tangential is 2.0; allowed are numbers from -1 to 1"),
    (lambda: physics.Scene([ball()], effects=[physics.RollingFriction()]), "RollingFriction without Contact"),
    (lambda: physics.Scene([ball()], effects=[physics.Contact(tangential=1)]), "tangential is 1.0 without Friction"),
    (
        lambda: physics.World(physics.Scene([physics.Block((1, 1, 1), 1, pos=(0, 2, 0))], [FLOOR],
                                            [physics.Contact(tangential=0.5), physics.Friction()])),
        r"Contact.tangential is 0.5, but Scene.bodies\[0\] is a block",
    ),
]  # fmt: skip


@pytest.mark.parametrize(("make", "message"), BAD)
def test_a_law_says_what_is_wrong(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_the_plan_says_which_laws_are_on():
    text = world(ball(), 0.02, 0.01).plan.explain()
    for line in ("tangential restitution  on   declared: e_t = 0.0", "rolling friction        on   declared: 0.02 m"):
        assert line in text
    cube = physics.Block((1, 1, 1), 1, pos=(0, 2, 0))
    scene = physics.Scene([cube], [FLOOR], [physics.Contact(), physics.RollingFriction()])
    built = physics.make_plan(scene, physics.PRESETS["balanced"])
    assert built.laws == ()
    assert "off  declared, but only round bodies roll and spin, and none can touch anything" in built.explain()
