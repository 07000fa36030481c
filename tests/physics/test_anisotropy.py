"""Friction with two coefficients along the axes of a wall, against closed forms and DOP853."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

import physics
from tests.tiers.sweep import sweep

pytestmark = pytest.mark.interpreted

G = 9.81
M, R = 2.0, 0.5
FLOOR = physics.HalfSpace((0, 1, 0))
MU = np.array([0.2, 0.5])  # along z and x: the floor's own tangents, in this order
Z = (0, 0, 1)
STEPS = np.array([0.02, 0.01, 0.005, 0.0025])
EXACT = physics.Accuracy(tolerance=1e-12)


def slab(**start) -> physics.Block:
    """Flat, so that it slides without tipping."""
    return physics.Block((1.0, 0.1, 1.0), M, **{"pos": (0, 0.05, 0), **start})


def ball(**start) -> physics.Sphere:
    return physics.Sphere(R, M, **{"pos": (0, R, 0), **start})


def world(body, mu=tuple(MU), axis=Z, *, accuracy="balanced", dt=0.01, gravity=(0, -G, 0), e=None, worlds=1):
    effects = [physics.Gravity(gravity), physics.Contact(e), physics.Friction(mu, axis)]
    return physics.World(physics.Scene([body], [FLOOR], effects), worlds=worlds, dt=dt, accuracy=accuracy)


def flat(v) -> np.ndarray:
    """(z, x) of a vector: along the axis and across it."""
    return np.asarray(v)[[2, 0]]


def drag(u) -> np.ndarray:
    """Friction per normal force on what slides with u: least f·u on the ellipse (f1/μ1)² + (f2/μ2)² = 1.

    Lagrange: u + λ S⁻² f = 0 with S = diag(μ1, μ2), so f = -S² u/|S u|.
    """
    return -(MU**2) * u / np.linalg.norm(MU * u)


@pytest.mark.parametrize("accuracy", ["balanced", "precise"])
@pytest.mark.parametrize(("k", "v"), [(0, (0, 0, 2)), (1, (2, 0, 0))])
def test_a_slide_along_an_axis_stops_after_v_squared_over_two_mu_g(accuracy, k, v):
    """Moreau's step stops within one step, off by at most μ g dt²/8; the event-driven one to its tolerance."""
    dt = 0.01
    built = world(slab(linvel=v), accuracy=accuracy, dt=dt)
    built.step(steps=200)
    allowed = MU[k] * G * dt**2 / 8 if accuracy == "balanced" else 1e-11
    assert flat(built.pos[0, 0])[k] == pytest.approx(4 / (2 * MU[k] * G), abs=allowed)
    assert abs(flat(built.pos[0, 0])[1 - k]) < 1e-12
    assert not built.linvel.any()


def test_the_force_on_a_slide_is_the_one_that_dissipates_most():
    u = np.array([1.5, 0.8])
    built = world(slab(linvel=(u[1], 0, u[0])), accuracy="precise", dt=1e-6)
    built.step()
    _, forces = built.contacts(0)
    total = forces.sum(axis=0)
    assert total[1] == pytest.approx(M * G, rel=1e-9)
    assert flat(total) == pytest.approx(M * G * drag(u), rel=1e-5)  # μ g dt / u: how much it turns in the step


def slide(t, u, rolls=False):
    """(place, velocity) of what slides with u at first, by DOP853; the slip of a ball changes 7/2 times as fast."""
    gain = 3.5 if rolls else 1.0

    def rate(_, y):
        f = G * drag(y[4:])
        return np.concatenate([y[2:4], f, gain * f])

    done = solve_ivp(rate, (0, t), np.concatenate([[0, 0], u, u]), method="DOP853", rtol=1e-12, atol=1e-13)
    return done.y[:2, -1], done.y[2:4, -1]


U = np.array([2.0, 1.2])


@pytest.mark.parametrize(("rolls", "t"), [(False, 0.3), (True, 0.08)])
def test_a_slide_across_the_axes_at_precise(rolls, t):
    """Both slip all the time; section 8 of the theory promises the tolerance."""
    body = (ball if rolls else slab)(linvel=(U[1], 0, U[0]))
    built = world(body, accuracy="precise", dt=t)
    built.step()
    place, velocity = slide(t, U, rolls)
    assert flat(built.pos[0, 0]) == pytest.approx(place, abs=1e-9)
    assert flat(built.linvel[0, 0]) == pytest.approx(velocity, abs=1e-9)


def test_a_slide_across_the_axes_to_its_stop_at_precise():
    """The direction turns into the axis of the smaller coefficient as t* - t to the power (μ2/μ1)²; the way is finite.

    With w = |S u| and v = u1 the ratio r = u2/u1 obeys dr/du1 = (k² - 1) r/u1: u2 = c u1^(k²), a path in closed form;
    and dt = -du1 sqrt(1 + (k r)²)/(μ1 g).
    """
    k2 = (MU[1] / MU[0]) ** 2
    v = np.polynomial.legendre.leggauss(60)
    speeds = 0.5 * U[0] * (v[0] + 1)
    r = U[1] / U[0] * (speeds / U[0]) ** (k2 - 1)
    weight = 0.5 * U[0] * v[1] * np.sqrt(1 + k2 * r**2) / (MU[0] * G)
    built = world(slab(linvel=(U[1], 0, U[0])), accuracy="precise", dt=0.5)
    built.step(steps=4)
    assert built.report.status[0] == physics.Status.OK
    assert flat(built.pos[0, 0]) == pytest.approx([(weight * speeds).sum(), (weight * speeds * r).sum()], abs=1e-8)
    assert not built.linvel.any()


def errors(rolls, t):
    found = []
    for dt in STEPS:
        body = (ball if rolls else slab)(linvel=(U[1], 0, U[0]))
        built = world(body, accuracy=EXACT, dt=dt)
        built.step(steps=round(t / dt))
        place, velocity = slide(t, U, rolls)
        found.append([np.abs(flat(built.pos[0, 0]) - place).max(), np.abs(flat(built.linvel[0, 0]) - velocity).max()])
    return np.array(found)


@pytest.mark.parametrize(("rolls", "t", "order"), [(True, 0.08, 2), (False, 0.3, 1)])
def test_a_slide_across_the_axes_is_of_the_order_of_the_scheme(rolls, t, order):
    """Friction of a lone contact opposes the mean slip of a step, that of a face the slip at its end."""
    slopes = np.polyfit(np.log(STEPS), np.log(errors(rolls, t)), 1)[0]
    assert slopes == pytest.approx([order, order], abs=0.1)


def is_short(slope):
    """Answer whether a slope takes no curved slide at `precise`, whose arcs are many."""
    angle, share, accuracy = slope
    return accuracy == "balanced" or share < 1 or angle in (0, math.pi / 2)


SLOPES = itertools.product(np.radians([0, 20, 45, 70, 90]), [0.99, 1.01], ["balanced", "precise"])


@pytest.mark.parametrize(("angle", "share", "accuracy"), sweep(SLOPES, is_short))
def test_a_slope_holds_inside_the_ellipse(angle, share, accuracy):
    """Down the slope tan θ (cos φ, sin φ) of the weight pulls: held iff |(cos φ/μ1, sin φ/μ2)| tan θ <= 1."""
    way = np.array([math.cos(angle), math.sin(angle)])
    slope = math.atan(share / np.linalg.norm(way / MU))
    pull = G * math.sin(slope) * way
    built = world(slab(), gravity=(pull[1], -G * math.cos(slope), pull[0]), accuracy=accuracy)
    built.step(steps=100)
    assert np.abs(built.pos[0, 0, [0, 2]]).max() < 1e-12 if share < 1 else np.abs(built.linvel).max() > 1e-3


def test_equal_coefficients_are_one_coefficient_to_the_last_bit():
    """The floor's own tangents are z and x; stretching by 1 rounds nothing."""
    body = physics.Block((1, 0.6, 0.4), M, pos=(0, 1, 0), linvel=(2, 0, 1), angvel=(3, 1, 2))
    runs = [world(body, 0.4, None, e=0.5), world(body, (0.4, 0.4), e=0.5)]
    for run in runs:
        run.step(steps=300)
    assert np.array_equal(runs[0].state, runs[1].state)
    assert np.array_equal(runs[0].memory, runs[1].memory)
    assert runs[0].plan.laws == ()
    assert runs[1].plan.laws == ("anisotropy",)
    assert runs[0].plan.key != runs[1].plan.key


def test_a_quarter_turn_with_the_coefficients_exchanged_is_the_same_wall():
    """Another frame of the same wall: the same bounces and slides to the solver's tolerance, 1e-12 of 3 m/s, in 60
    steps. (In the next one a face stops; contacts on the verge of stopping multiply differences by 1e5.)
    """
    body = physics.Block((1, 0.6, 0.4), M, pos=(0, 1, 0), linvel=(2, 0, 1), angvel=(3, 1, 2))
    runs = [world(body, (0.2, 0.5), (0, 0, 1), accuracy=EXACT), world(body, (0.5, 0.2), (-1, 3, 0), accuracy=EXACT)]
    for run in runs:
        run.step(steps=60)
    assert len(runs[0].contacts(0)[0]) == 4
    assert runs[0].pos == pytest.approx(runs[1].pos, abs=1e-9)
    assert runs[0].quat == pytest.approx(runs[1].quat, abs=1e-9)


vectors = st.tuples(*[st.floats(-5, 5)] * 3)


@settings(max_examples=settings().max_examples * 6 // 5, deadline=None)
@given(
    linvel=vectors, angvel=vectors, mu=st.tuples(st.floats(0.01, 3), st.floats(0.01, 3)), e=st.floats(0, 1),
    axis=st.tuples(st.floats(-1, 1), st.just(0.0), st.floats(0.1, 1)), height=st.floats(0.9, 1.5),
)  # fmt: skip
def test_contact_never_gives_energy(linvel, angvel, mu, e, axis, height):
    """Whatever the axes: energy grows by at most rounding and the place of an impact (half a slop) in each of a
    few impacts a step."""
    body = physics.Block((1, 0.6, 0.4), M, pos=(0, height, 0), linvel=linvel, angvel=angvel)
    built = world(body, mu, axis, e=e)
    allowed = 1e-9 * physics.diagnose(built).energy[0, 0] + 10 * M * G * 1e-6
    before = math.inf
    for _ in range(40):
        built.step()
        now = physics.diagnose(built).energy[0, 0]
        assert now <= before + allowed
        before = now


def test_three_walls_with_an_axis_each():
    """The grain of the side walls is vertical, that of the floor runs along z: the block slides down along it."""
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(), physics.Friction((0.2, 0.5), (Z, (0, 1, 0), (0, 1, 0)))]
    scene = physics.Scene([physics.Block((1, 1, 1), M, pos=(-1.5, 3, 0))], physics.three_walls(2.0), effects)
    built = physics.World(scene, dt=0.01)
    push = np.zeros((1, 1, 6))
    push[..., 0] = -50.0  # against the wall at -x
    built.step(push, steps=10)
    assert built.linvel[0, 0, 1] == pytest.approx(-0.1 * (G - 0.2 * 50 / M), abs=1e-9)


def test_coefficients_may_differ_from_world_to_world():
    built = world(slab(linvel=(2, 0, 0)), worlds=3)
    built.set_parameters(friction=0.1, worlds=[1])
    built.set_parameters(effects=[physics.Friction((0.2, 0.4), Z)], worlds=[2])
    built.step(steps=20)
    assert built.linvel[:, 0, 0] == pytest.approx(2 - 0.2 * G * np.array([0.5, 0.25, 0.4]), abs=1e-9)
    with pytest.raises(ValueError, match=r"Friction.axis is \(1.0, 0.0, 0.0\); allowed is the scene's"):
        built.set_parameters(effects=[physics.Friction((0.2, 0.4), (1, 0, 0))])
    with pytest.raises(ValueError, match=r"Friction.axis is None; allowed is the scene's"):
        built.set_parameters(effects=[physics.Friction(0.2)])


def test_it_comes_back_from_a_file(tmp_path):
    for axis in (Z, (Z, (0, 1, 0), (0, 1, 0))):
        scene = physics.Scene([slab()], physics.three_walls(), [physics.Contact(), physics.Friction((0.1, 0.2), axis)])
        physics.save_scene(scene, tmp_path / "scene.toml")
        assert physics.load_scene(tmp_path / "scene.toml") == scene


def on(walls, friction, bodies=None, **contact):
    return physics.World(physics.Scene(bodies or [slab()], walls, [physics.Contact(**contact), friction]))


BAD = [
    (lambda: physics.Friction((0.1, 0.2)), "Friction.axis is None; allowed is a direction with two coefficients"),
    (lambda: physics.Friction(0.1, Z), r"Friction.axis is \(0, 0, 1\); allowed is None with one coefficient"),
    (lambda: physics.Friction((0.1, 0.0), Z), "Friction.coefficient is .*; allowed are numbers greater than 0"),
    (lambda: physics.Friction((0.1, 0.2, 0.3), Z), r"Friction.coefficient has shape \(3,\); allowed is shape \(2,\)"),
    (lambda: physics.Friction("rough", None), "Friction.coefficient is 'rough'; allowed is one number"),
    (lambda: physics.Friction((0.1, 0.2), (0, 0, 0)), "Friction.axis is .*; allowed are directions"),
    (lambda: physics.Friction((0.1, 0.2), (1, [2])), "Friction.axis is .*; allowed are numbers"),
    (lambda: on([FLOOR], physics.Friction((0.1, 0.2), (0, -2, 0))), r"Friction.axis is .* the normal of walls\[0\]"),
    (lambda: on([FLOOR], physics.Friction((0.1, 0.2), (Z, Z))), "Friction.axis has 2 directions; allowed are one"),
]


@pytest.mark.parametrize(("make", "message"), BAD)
def test_it_says_what_is_wrong(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_the_plan_names_the_cone():
    assert "declared: μ = (0.2, 0.5) [three rows per contact, elliptic cone]" in world(slab()).plan.explain()
    assert "circular cone" in world(slab(), 0.5, None).plan.explain()
