"""The event-driven scheme against stored truths, closed forms and the laws of impact.

All scenes here are of a few combinations of shape, walls and effects, so that few kernels are compiled.
"""

from __future__ import annotations

import math
import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

import physics
from physics import scenes
from tests.reference import truths
from tests.reference.rigid_body import RigidState, integrate_rigid_body, orientation_error, rotation_matrix

EPS = np.finfo(float).eps
G = scenes.GRAVITY
INERTIA = np.diag([6.5, 14.5, 17.0])
HALF = np.array([2.5, 1.5, 1.0])
FLOOR = [physics.HalfSpace((0, 1, 0))]
RADIUS = float(np.linalg.norm(HALF))
FLOOR_WALL, RIGHT_WALL = 0, 2
TILTED = scenes.vertex_drop().bodies[0].quat


def on_floor(body, e=0.0, mu=0.0, gravity=G):
    """The body above the floor."""
    effects = [physics.Gravity((0, -gravity, 0)), physics.Contact(e), physics.Friction(mu)]
    return physics.Scene([body], FLOOR, effects)


def block(pos=(0, 1.5, 0), **start):
    """The block, face down on the floor if nothing else is said."""
    return physics.Block(scenes.SIZE, scenes.MASS, pos=pos, **start)


def of_kind(run, *kinds):
    """The events of these kinds."""
    return [event for event in run.events if event.kind in kinds]


# --- stored truths -------------------------------------------------------------------------------------------------

# Steps between impacts err by `tolerance` of the radius 3 m and the speed, a step of contact at most some hundred
# times in the run; each following impact and slip hands it on, here by less than a factor of ten in all. What ends
# the motion are bounces too low to be made: HOP slops, 1e-11 m, and a rest taken √(2 HOP g slop) early.
ERRORS = {"precise": 1e-9, "reference": 1e-11}


@pytest.mark.parametrize("sample_dt", [0.05, 0.1])
@pytest.mark.parametrize("accuracy", ["precise", "reference"])
@pytest.mark.parametrize("name", ["vertex_drop", "drop"])
def test_stored_truth_is_met_to_the_tolerance(name, accuracy, sample_dt):
    """Position and attitude at every sample, time and impulse of every impact above 0.01 N s."""
    truth = truths.load(name)
    run = physics.simulate(scenes.by_name(name), truth["t"][-1], accuracy, sample_dt)
    assert run.ok
    every = round(sample_dt / 0.05)
    goal = ERRORS[accuracy] + 10 * truth["error"]["pos"]
    np.testing.assert_allclose(run.pos[:, 0], truth["pos"][::every], rtol=0, atol=goal)
    np.testing.assert_allclose(run.quat[:, 0], truth["quat"][::every], rtol=0, atol=goal)
    size = 0.01
    found = [e for e in of_kind(run, "impact") if np.linalg.norm(e.impulse) > size]
    stored = collected(truth)
    stored = [e for e in stored if np.linalg.norm(e[2]) > size]
    assert [e.wall for e in found] == [e[1] for e in stored]
    np.testing.assert_allclose([e.t for e in found], [e[0] for e in stored], rtol=0, atol=10 * goal)
    # An impulse follows the velocities, which err by the places' error over the last impacts' distance, some 0.1 s.
    np.testing.assert_allclose([e.impulse for e in found], [e[2] for e in stored], rtol=0, atol=100 * goal)


def collected(truth):
    """The truth's impacts as (t, wall, impulse in the world frame), those of one wall at one moment together."""
    normals = [wall.normal for wall in scenes.by_name(truth["scene"]).walls]
    impacts = []
    for t, kind, _, wall, *parts in truth["events"]:
        if kind != "impact":
            continue
        impulse = np.array(parts) @ np.vstack([normals[wall], truth["tangents_of_walls"][wall]])
        if impacts and t - impacts[-1][0] < 1e-10 and impacts[-1][1] == wall:
            impacts[-1] = (impacts[-1][0], wall, impacts[-1][2] + impulse)
        else:
            impacts.append((t, wall, impulse))
    return impacts


LEFT_OUT = pytest.mark.xfail(strict=True, reason="rocking that is left out at the end is not added up: 1e-5 s early")


@pytest.mark.parametrize(("name", "accuracy"), [
    pytest.param("vertex_drop", "precise", marks=LEFT_OUT),
    ("vertex_drop", "reference"),
    pytest.param("drop", "precise", marks=LEFT_OUT),
])  # fmt: skip
def test_rest_comes_when_the_truth_says(name, accuracy):
    """To the time that a body with `still` speed takes to stop, √(2 HOP slop R / g): 2e-6 s at precise."""
    truth = truths.load(name)
    run = physics.simulate(scenes.by_name(name), 3.0, accuracy, 0.05)
    (rest,) = of_kind(run, "rest")
    assert rest.t == pytest.approx(truth["events"][-1][0], abs=2e-6)


@pytest.mark.xfail(
    strict=True, reason="a stop with two contacts sliding is placed to 1e-6 s only, and chatters at reference"
)
@pytest.mark.parametrize("accuracy", ["precise", "reference"])
def test_stick_comes_when_the_truth_says(accuracy):
    """The slide of `vertex_drop` on an edge ends at 0.957 s, once."""
    stored = next(e for e in truths.load("vertex_drop")["events"] if e[1] == "stick")
    run = physics.simulate(scenes.vertex_drop(), 1.2, accuracy, 0.05)
    assert [e.kind for e in run.events if e.kind != "impact" and 0.9 < e.t < 1.1] == ["stick"]
    assert of_kind(run, "stick")[0].t == pytest.approx(stored[0], abs=10 * ERRORS[accuracy])


@pytest.mark.interpreted
@pytest.mark.parametrize("sample_dt", [0.05, 0.37])
def test_closed_box_hits_twenty_times_in_the_order_of_the_truth(sample_dt):
    """Rounding of the start alone moves the state after the last hit by `sensitivity`: within a hundred of it."""
    truth = truths.load("closed_box")
    times = np.array([float(t) for t, _, _ in truth["hits"]])
    end = times[-1] + truth["after_s"]
    run = physics.simulate(scenes.closed_box(), end, "reference", sample_dt)
    assert run.ok
    hits = of_kind(run, "impact")
    assert [e.wall for e in hits] == [wall for _, _, wall in truth["hits"]]
    found = np.concatenate([run.pos[-1, 0], run.quat[-1, 0], run.linvel[-1, 0], run.angvel[-1, 0]])
    stored = np.array([float(a) for a in truth["state_after"]])
    assert np.abs(found - stored).max() < 100 * truth["sensitivity"]["largest"]
    # Nothing is amplified yet at the first hits: some 20 roundings of a time near 1 s.
    np.testing.assert_allclose([e.t for e in hits[:3]], times[:3], rtol=0, atol=20 * EPS)


# --- impacts -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sample_dt", [0.005, 0.1, 3.0])
@pytest.mark.parametrize("accuracy", ["precise", "reference"])
def test_zeno_bounces_end_when_their_sum_says(accuracy, sample_dt):
    """e = 0.5 from 1 m: √(2h/g)(1+e)/(1-e), of which what is not bounced is added."""
    run = physics.simulate(on_floor(block((0, 2.5, 0)), 0.5, 0.5), 3.0, accuracy, sample_dt)
    end = math.sqrt(2 / G) * 3
    assert run.ok
    (touch,) = of_kind(run, "touch")
    (rest,) = of_kind(run, "rest")
    # Each of some 20 bounces rounds a time of 1 s, and its height to 1e-15 of 1.5 m: the last speeds, 1e-5 m/s, by
    # 1e-15 g / 1e-5; in all below 1e-12 s.
    assert touch.t == pytest.approx(end, abs=1e-12)
    assert rest.t == pytest.approx(end, abs=1e-12)
    assert run.pos[-1, 0] == pytest.approx([0, 1.5, 0], abs=1e-14)
    assert not run.linvel[-1].any()


def test_elastic_bounces_keep_their_apex():
    """A hundred impacts at odd multiples of √(2h/g), to rounding; the apex between them where it was."""
    fall = math.sqrt(2 / G)
    run = physics.simulate(on_floor(block((0, 2.5, 0)), 1.0, 0.5), 200 * fall, "precise", sample_dt=2 * fall)
    impacts = of_kind(run, "impact")
    times = fall * (2 * np.arange(100) + 1)
    # Every impact is placed to 1e-15 of 1.5 m at 4.4 m/s and its time rounded: 1e-15 s each, adding up.
    np.testing.assert_allclose([e.t for e in impacts[:100]], times, rtol=0, atol=100 * 20 * EPS)
    np.testing.assert_allclose(run.pos[:, 0, 1], 2.5, rtol=0, atol=100 * 20 * EPS)
    np.testing.assert_allclose([e.impulse[1] for e in impacts], 12 * math.sqrt(2 * G), rtol=1e-12)


@pytest.mark.parametrize("e", [0.0, 0.3, 1.0])
def test_one_vertex_hits_with_newtons_impulse(e):
    """J = -(1+e) v_n / (1/m + n·(I⁻¹(r x n) x r)), as an event and in the momenta, to 1e-12."""
    v, w = np.array([0.4, -3.0, 0.2]), np.array([0.1, 0.0, -0.2])
    R = rotation_matrix(np.array(TILTED))
    r = R @ (-np.sign(R[1]) * HALF)
    run = physics.simulate(
        on_floor(block((0, -r[1], 0), quat=TILTED, linvel=v, angvel=w), e, gravity=0.0), 1e-3, "precise"
    )
    n = np.array([0.0, 1.0, 0.0])
    inverse = np.linalg.inv(R @ INERTIA @ R.T)
    J = -(1 + e) * n @ (v + np.cross(w, r)) / (1 / 6.0 + n @ np.cross(inverse @ np.cross(r, n), r))
    (impact,) = of_kind(run, "impact")
    assert impact.t == pytest.approx(0, abs=1e-15)
    # A handful of rounded terms of size 30.
    assert impact.impulse == pytest.approx(J * n, abs=1e-12)
    assert 6 * (run.linvel[-1, 0] - v) == pytest.approx(J * n, abs=1e-12)


@given(
    st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1),
    st.tuples(*[st.floats(-3, 3)] * 3),
    st.tuples(*[st.floats(-3, 3)] * 3),
    st.floats(0, 1),
    st.booleans(),
)
@settings(max_examples=25)
def test_energy_never_grows_and_impulses_are_jumps_of_momentum(q, v, w, e, rubs):
    """With friction, too, where Newton's law asks for more than there is (`contact_law.restitution_energy`)."""
    quat = tuple(np.array(q) / np.linalg.norm(q))
    mu = 0.5 if rubs else 0.0
    run = physics.simulate(on_floor(block((0, 3.5, 0), quat=quat, linvel=v, angvel=w), e, mu), 2.0, "precise", 0.02)
    assert run.ok
    # A smooth step errs by 1e-10 of its speed, so the energy by that share of the kinetic part, below 400 J.
    assert np.diff(run.energy[:, 0]).max() < 1e-9 * run.energy[0, 0]
    rests = [False, *np.logical_or.accumulate([bool(len(r)) for r in touches(run)])]
    for k in range(len(run.t) - 1):
        if rests[k + 1]:
            break
        jump = 6 * (run.linvel[k + 1, 0] - run.linvel[k, 0]) + [0, 6 * G * (run.t[k + 1] - run.t[k]), 0]
        impulses = [event.impulse for event in of_kind(run, "impact") if run.t[k] < event.t <= run.t[k + 1]]
        # Roundings of a momentum below 100 kg m/s.
        assert jump == pytest.approx(np.sum([*impulses, np.zeros(3)], axis=0), abs=1e-12)


@pytest.mark.parametrize("mu", [0.5, 1.0])
@pytest.mark.parametrize("angle", [30, 50, 60, 70])
def test_a_rebound_that_friction_turns_round_takes_all_the_energy_there_is_and_no_more(angle, mu):
    """Kane's rod, e = 1: Newton's law would gain up to 16 %. What is made is the largest share that gains nothing."""
    theta, length, thin = math.radians(angle), 2.0, 1e-6
    low, across = 0.5 * length * (math.sin(theta) + thin * math.cos(theta)), length**2 / 12
    rod = physics.Block(
        (length, thin * length, thin * length), 1.0, pos=(0, low, 0), linvel=(0.3, -1.0, 0),
        quat=(math.cos(theta / 2), 0, 0, math.sin(theta / 2)), inertia_body=(across / 2, across, across),
    )  # fmt: skip
    run = physics.simulate(on_floor(rod, 1.0, mu, gravity=0.0), 1e-4, "precise")
    # The share is a root of a parabola through energies rounded to 1e-16 of 0.5 J, of slope 1e-2 or more at it.
    assert run.energy[-1, 0] == pytest.approx(run.energy[0, 0], rel=1e-11)
    (impact,) = of_kind(run, "impact")
    assert impact.impulse == pytest.approx(run.linvel[-1, 0] - run.linvel[0, 0], abs=1e-14)
    assert run.linvel[-1, 0, 1] > -1.0


def touches(run):
    """The events other than impacts of every sample interval."""
    others = of_kind(run, "touch", "rest", "stick", "slip", "release")
    return [[e for e in others if run.t[k] <= e.t <= run.t[k + 1]] for k in range(len(run.t) - 1)]


# --- friction ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sample_dt", [0.01, 0.3, 5.0])
def test_slide_stops_at_v2_over_2mug(sample_dt):
    """Stops v/(μg) after the start; distance v²/(2μg); then not one bit of motion."""
    v, mu = 3.0, 0.3
    run = physics.simulate(on_floor(block(linvel=(v, 0, 0)), 0.3, mu), 5.0, "precise", sample_dt)
    assert run.ok
    # Constant deceleration: the extrapolated rules are exact but for rounding, as is the place where speed ends.
    assert run.pos[-1, 0] == pytest.approx([v * v / (2 * mu * G), 1.5, 0], abs=1e-12)
    stops = of_kind(run, "stick", "rest")
    # A stop under a constant force is a step of its own: nothing is given up before it.
    assert stops[0].t == pytest.approx(v / (mu * G), abs=1e-12)
    assert not run.linvel[-1].any()
    assert not run.angvel[-1].any()


@pytest.mark.interpreted
def test_sphere_starts_to_roll_at_5_7_of_its_speed():
    """Sticks at 2v/(7μg), then rolls at 5v/7 with neither gain nor loss."""
    v, mu = 5.0, 0.2
    sphere = physics.Sphere(1.0, 1.0, pos=(0, 1, 0), linvel=(v, 0, 0))
    run = physics.simulate(on_floor(sphere, 0.3, mu), 4.0, "precise", 0.1)
    assert run.ok
    (stick,) = of_kind(run, "stick")
    t = 2 * v / (7 * mu * G)
    assert stick.t == pytest.approx(t, abs=1e-12)
    assert run.linvel[-1, 0] == pytest.approx([5 * v / 7, 0, 0], abs=1e-12)
    assert run.angvel[-1, 0] == pytest.approx([0, 0, -5 * v / 7], abs=1e-12)
    assert run.pos[-1, 0, 0] == pytest.approx(v * t - mu * G * t * t / 2 + 5 * v / 7 * (4 - t), abs=1e-11)


def straight(body):
    """The body with its quaternion of length 1 to the last bit, if that can be."""
    q = np.array(body.quat)
    return replace(body, quat=tuple(q / np.linalg.norm(q)))


def test_incline_slips_alike_from_a_start_one_rounding_unit_off():
    angle = 0.5
    mu = 0.99 * math.tan(angle)
    plain = scenes.incline(angle, mu)
    assert physics.diagnose(physics.World(plain)).gap[0, 0] == 2**-52
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(0.3), physics.Friction(mu)]
    run = physics.simulate(physics.Scene(plain.bodies, plain.walls, effects), 2.0, "precise", 0.25)
    a = G * (math.sin(angle) - mu * math.cos(angle))
    expected = 2 * a * np.array([math.cos(angle), -math.sin(angle), 0])
    # What steps add up to errs by the tolerance of the free speed g t: in the place by that share of g t²/2.
    assert run.pos[-1, 0] - run.pos[0, 0] == pytest.approx(expected, abs=1e-10 * G * 2)


@pytest.mark.parametrize(("share", "degrees"), [(0.999, 20), (0.999, 40), (0.99, 5)])
def test_a_trial_that_was_too_long_does_not_turn_the_slip_that_begins(share, degrees):
    """μ just below tanθ: the first trials of the first step fail, and after it the speed is a t all the same.

    Friction straightens a slip some 1/(1 - share) times as fast as the slip grows, which no long step can follow.
    What steps add up to errs by the tolerance of the free speed g t.
    """
    angle, t = math.radians(degrees), 0.01
    mu = share * math.tan(angle)
    pull = physics.Gravity((G * math.sin(angle), -G * math.cos(angle), 0))
    scene = physics.Scene([block()], FLOOR, [pull, physics.Contact(0.0), physics.Friction(mu)])
    run = physics.simulate(scene, t, "precise", t)
    assert run.ok
    assert of_kind(run, "impact") == []
    a = G * (math.sin(angle) - mu * math.cos(angle))
    assert run.linvel[-1, 0, 0] == pytest.approx(a * t, abs=1e-10 * G * t)


@pytest.mark.parametrize("angle", [0.1, 0.5, 1.0])
def test_incline_holds_above_and_slips_below_the_angle_of_friction(angle):
    """μ 1 % above tanθ: not one bit of motion; 1 % below: a t²/2 with a = g (sinθ - μ cosθ)."""
    for share in (1.01, 0.99):
        mu = share * math.tan(angle)
        plain = scenes.incline(angle, mu)
        effects = [physics.Gravity((0, -G, 0)), physics.Contact(0.3), physics.Friction(mu)]
        body = straight(plain.bodies[0])
        run = physics.simulate(physics.Scene([body], plain.walls, effects), 2.0, "precise", 0.25)
        assert run.ok
        moved = run.pos[-1, 0] - run.pos[0, 0]
        if share > 1:
            assert not run.linvel[1:].any()
            assert np.abs(moved).max() < 1e-15 * RADIUS
        else:
            down = np.array([math.cos(angle), -math.sin(angle), 0])
            a = G * (math.sin(angle) - mu * math.cos(angle))
            # The direction in which sliding begins is found to SAME_WAY = 1e-9, and kept until the speed shows it.
            assert moved == pytest.approx(a * 2 * down, abs=1e-9 * a * 2 + 1e-12)


def test_block_without_gravity_slides_along_a_wall_for_ever():
    """Nothing presses it: no friction, and the wall it touches does nothing."""
    run = physics.simulate(on_floor(block(linvel=(1, 0, 2)), 0.3, 0.5, gravity=0.0), 3.0, "precise", 0.1)
    assert run.ok
    assert run.pos[-1, 0] == pytest.approx([3, 1.5, 6], abs=1e-13)
    assert run.linvel[-1, 0] == pytest.approx([1, 0, 2], abs=1e-15)


# --- edges, corners, flight ----------------------------------------------------------------------------------------


def test_block_tips_over_an_edge_and_hits_the_right_wall():
    """Upright with ω at which it gets over its edge: energy kept, and the right wall is hit when the energy says.

    About the edge, at R from the centre, Θ = 17 + m R², Θ ω²/2 + m g R cos φ is constant; φ from -atan(1.5/2.5) on.
    """
    R, first, spin, edge = math.hypot(2.5, 1.5), -math.atan2(1.5, 2.5), 0.9, 6.0
    body = block(
        (edge - 1.5, 2.5, 0), quat=(math.sqrt(0.5), 0, 0, math.sqrt(0.5)),
        linvel=(2.5 * spin, 1.5 * spin, 0), angvel=(0, 0, -spin),
    )  # fmt: skip
    scene = physics.Scene(
        [body], physics.three_walls(10.0),
        [physics.Gravity((0, -G, 0)), physics.Contact(0.3), physics.Friction(1.0)],
    )  # fmt: skip
    # The upper right corner, 5 m above the edge, turns by asin(4/5) until it is at the wall.
    turn, inertia = math.asin((10 - edge) / 5), 17 + 6 * R * R

    def slowness(phi):
        return 1 / math.sqrt(spin**2 + 2 * 6 * G * R * (math.cos(first) - math.cos(phi)) / inertia)

    t, _ = quad(slowness, first, first + turn, epsabs=1e-14, epsrel=1e-13)
    run = physics.simulate(scene, t + 0.05, "precise", 0.05)
    assert run.ok
    impact = next(e for e in of_kind(run, "impact") if e.wall == RIGHT_WALL)
    assert impact.t == of_kind(run, "impact")[0].t
    # The steps err by 1e-10 of the body's size and speed at most; so do time and energy.
    assert impact.t == pytest.approx(t, abs=1e-10 * t)
    rolling = run.energy[run.t < t, 0]
    np.testing.assert_allclose(rolling, rolling[0], rtol=1e-10)
    assert [(e.kind, e.wall) for e in run.events if e.t < t - 1e-9] == [("touch", FLOOR_WALL)]
    # The wall pushes the corner back.
    corner = np.array([2.5, -1.5])
    assert impact.impulse[0] < 0
    at = np.searchsorted(run.t, t)
    after = run.linvel[at, 0, 0] - run.angvel[at, 0, 2] * (rotation_matrix(run.quat[at, 0])[1, :2] @ corner)
    assert after < 0


def test_frictionless_block_dropped_into_a_corner_stays_there():
    """Pushed into two walls it falls along them, which do nothing, to rest on the floor."""
    scene = scenes.block_in_box((2.5, 3.0, 1.0), restitution=0.0, friction=0.0, walls="corner", linvel=(-2.0, 0, -1.0))
    run = physics.simulate(scene, 2.0, "precise", 0.1)
    assert run.ok
    impacts = of_kind(run, "impact")
    # At once against both side walls, with all of m v; at √(2h/g) on the floor. Such a contact problem is solved
    # to 1e-10 of its speeds.
    np.testing.assert_allclose([e.impulse for e in impacts[:2]], [[12, 0, 0], [0, 0, 6]], rtol=0, atol=1e-9)
    assert impacts[2].t == pytest.approx(math.sqrt(3 / G), abs=1e-12)
    assert impacts[2].impulse == pytest.approx([0, 6 * math.sqrt(3 * G), 0], abs=1e-9)
    assert run.pos[-1, 0] == pytest.approx([2.5, 1.5, 1.0], abs=1e-14)
    assert orientation_error(run.quat[-1, 0], np.array([1.0, 0, 0, 0])) < 1e-14


def test_not_one_bit_changes_at_rest():
    """A block at rest on an incline, step after step."""
    plain = scenes.incline(0.5, 1.0)
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(0.3), physics.Friction(1.0)]
    run = physics.simulate(physics.Scene(plain.bodies, plain.walls, effects), 1.0, "precise", 0.1)
    assert (run.pos[1:] == run.pos[1]).all()
    assert (run.quat[1:] == run.quat[1]).all()


@pytest.mark.xfail(
    strict=True,
    raises=AssertionError,
    reason="the impact of two edges at once with μ = 10 is left with a residual of 0.3",
)
def test_impact_of_two_walls_with_high_friction_is_solved():
    """The block lies with an edge on the floor and hits the right wall with another."""
    turn = math.asin(0.8)
    angle = math.pi / 2 - turn
    up = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    centre = np.array([6.0, 0.0]) - up @ [-2.5, -1.5]
    body = block(
        (*centre, 0), quat=(math.cos(angle / 2), 0, 0, math.sin(angle / 2)),
        linvel=(centre[1], 6.0 - centre[0], 0), angvel=(0, 0, -1.0),
    )  # fmt: skip
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(0.3), physics.Friction(10.0)]
    assert physics.simulate(physics.Scene([body], physics.three_walls(10.0), effects), 0.01, "precise").ok


@pytest.mark.parametrize(("accuracy", "error"), [("precise", 1e-9), ("reference", 1e-11)])
def test_flight_under_a_constant_torque_is_that_of_dop853(accuracy, error):
    """One second in one step; steps err by `tolerance` of the body's speed, and there are some ten of them."""
    scene = scenes.block_in_box((0, 100.0, 0), angvel=(1.0, 3.0, 0.5), quat=TILTED)
    load = np.array([3.0, 5.0, -2.0, 10.0, -6.0, 4.0])
    run = physics.simulate(scene, 1.0, accuracy, 1.0, wrench=lambda t, world: load[None])
    R = rotation_matrix(np.array(TILTED))
    start = RigidState(np.array([0, 100.0, 0]), np.array(TILTED), np.zeros(3), R @ INERTIA @ R.T @ [1.0, 3.0, 0.5])
    truth = integrate_rigid_body(6.0, INERTIA, start, 1.0, (0, -G, 0), lambda t, y: (load[:3], load[3:]))
    # DOP853 at 1e-13 per step adds some 1e-12.
    assert orientation_error(run.quat[-1, 0], truth.quat) < error
    assert run.pos[-1, 0] == pytest.approx(truth.pos, abs=1e-11)
    assert run.linvel[-1, 0] == pytest.approx(truth.momentum / 6, abs=1e-11)
    R = rotation_matrix(truth.quat)
    assert run.angvel[-1, 0] == pytest.approx(R @ np.linalg.inv(INERTIA) @ R.T @ truth.angular_momentum, abs=error)


@pytest.mark.interpreted
def test_sphere_at_500_metres_per_second_does_not_tunnel():
    """Through 500 m in one step of a second: it turns at the floor, at the time the parabola says."""
    sphere = physics.Sphere(0.01, 1.0, pos=(0, 100, 0), linvel=(0, -500, 0))
    run = physics.simulate(on_floor(sphere, 1.0, 0.2), 1.0, "precise", 1.0)
    t = 2 * 99.99 / (500 + math.sqrt(500**2 + 2 * G * 99.99))
    (impact,) = of_kind(run, "impact")
    # 1e-15 of 100 m, at 500 m/s.
    assert impact.t == pytest.approx(t, abs=1e-15)
    assert run.ok
    speed = math.sqrt(500**2 + 2 * G * 99.99)
    assert run.pos[-1, 0, 1] == pytest.approx(0.01 + speed * (1 - t) - G * (1 - t) ** 2 / 2, abs=1e-11)


# --- the scheme as a whole -----------------------------------------------------------------------------------------


def test_samples_do_not_change_the_motion():
    """The end of `drop` at three sample intervals: steps are cut elsewhere, each good to the tolerance."""
    ends = [physics.simulate(scenes.drop(), 2.0, "precise", dt) for dt in (0.005, 0.02, 0.1)]
    for run in ends[1:]:
        np.testing.assert_allclose(run.pos[-1], ends[0].pos[-1], rtol=0, atol=1e-9)
        np.testing.assert_allclose(run.quat[-1], ends[0].quat[-1], rtol=0, atol=1e-9)


def advanced(world, steps):
    """State and report after this many steps."""
    for _ in range(steps):
        world.step()
    return world.state.copy(), world.report_table.copy()


def test_same_bits_in_a_batch_with_threads_after_a_snapshot_and_after_pickling():
    """In the middle of contact: after 1.71 s the three blocks slide and rock on the floor."""

    def made(worlds, threads=1):
        world = physics.World(scenes.drop(), worlds, dt=0.03, accuracy="precise", threads=threads)
        world.set_state(linvel=np.array([[[1.0, 0, 0]]]) * np.arange(worlds)[:, None, None])
        return world

    batch, threaded = made(3), made(3, threads=2)
    single = made(1)
    first, _ = advanced(batch, 57)
    assert np.array_equal(first, advanced(threaded, 57)[0])
    assert np.array_equal(first[:1], advanced(single, 57)[0])
    assert all(batch.touching(world) and batch.linvel[world].any() for world in range(3))
    snapshot, copy = batch.snapshot(), pickle.loads(pickle.dumps(batch))
    then, report = advanced(batch, 10)
    again, same_report = advanced(copy, 10)
    assert np.array_equal(then, again)
    assert np.array_equal(report, same_report)
    assert not np.array_equal(then, first)
    batch.restore(snapshot)
    back, _ = advanced(batch, 10)
    assert np.array_equal(then, back)


def test_a_log_without_room_is_made_room_for():
    """All of 3 s in one sample: the same impacts as sampled often."""
    scene = scenes.vertex_drop()
    one, many = (physics.simulate(scene, 3.0, "precise", sample_dt) for sample_dt in (3.0, 0.01))
    assert [e.kind for e in one.events[:20]] == [e.kind for e in many.events[:20]]
    impacts = [[e for e in of_kind(run, "impact") if e.impulse[1] > 0.01] for run in (one, many)]
    np.testing.assert_allclose([e.t for e in impacts[0]], [e.t for e in impacts[1]], rtol=0, atol=1e-8)
    assert len(of_kind(one, "rest")) == 1
