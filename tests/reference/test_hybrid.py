"""The event-driven reference against closed forms, and against references that share nothing with it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import physics
from physics import scenes
from tests.reference import hybrid, truths
from tests.reference.hybrid import body, contact, motion
from tests.reference.lcp import coulomb_defect

G = scenes.GRAVITY
EPS = np.finfo(float).eps
SNAP = hybrid.Options().snap  # speed at which sliding is stopped [m/s]


def run(scene, duration, times=(), options=None, **wrench):
    problem, y = hybrid.from_scene(scene, **wrench)
    return problem, hybrid.simulate(problem, y, duration, times, options)


def kinds(result, kind):
    return [event for event in result.events if event.kind == kind]


def test_bounces_end_when_their_sum_says():
    h, e = 1.0, 0.5
    _, result = run(scenes.bounce(h, e), 3.0)
    fall = math.sqrt(2 * h / G)
    # Each of the four contacts adds its own flights left out; 30 flights, each exact to a few roundings of t.
    assert result.events[-1].kind == "rest"
    end = result.events[-1].t + result.left_out / 4
    assert end == pytest.approx(fall * (1 + e) / (1 - e), abs=1e-14)
    first, second = kinds(result, "impact")[0], kinds(result, "impact")[4]
    assert first.t == pytest.approx(fall, abs=4 * EPS)
    assert second.t == pytest.approx(fall * (1 + 2 * e), abs=1e-14)
    assert first.impulse[0] == pytest.approx(scenes.MASS * (1 + e) * math.sqrt(2 * G * h) / 4, rel=1e-14)


def test_sliding_block_stops_where_friction_says():
    v, mu = 3.0, 0.3
    _, result = run(scenes.slide(v, mu), 2.0, [0.5])
    assert result.events[-1].kind == "rest"
    # The last SNAP of speed is taken off at once: SNAP/(μ g) too early, and SNAP²/(2 μ g) too short.
    assert result.events[-1].t == pytest.approx(v / (mu * G), abs=1.01 * SNAP / (mu * G))
    assert result.y[0] == pytest.approx(v * v / (2 * mu * G), abs=1e-13)
    assert result.samples[0, 0] == pytest.approx(0.5 * v - 0.125 * mu * G, abs=1e-14)


def test_sphere_ends_rolling_at_five_sevenths(is_exhaustive):
    v, mu = 5.0, 0.2
    _, result = run(scenes.rolling_sphere(v, mu), 1.5 if is_exhaustive else 0.8)
    (stick,) = result.events
    # It sticks when the contact is slower than SNAP, whose deceleration is 7/2 μ g.
    assert (stick.kind, stick.t) == ("stick", pytest.approx(2 * v / (7 * mu * G), abs=1.01 * SNAP / (3.5 * mu * G)))
    np.testing.assert_allclose(result.y[[7, 12]], [5 * v / 7, -5 * v / 7], rtol=1e-11)


def test_incline_holds_up_to_the_angle_of_friction():
    angle = math.radians(20.0)
    _, result = run(scenes.incline(angle, 1.001 * math.tan(angle)), 1.0)
    assert result.events[-1].kind == "rest"
    assert result.events[-1].t == 0.0


@pytest.mark.exhaustive  # four directions at once begin to be sought: 41 short integrations per Newton step
def test_incline_slides_with_the_rest_of_gravity():
    angle = math.radians(20.0)
    mu = 0.5 * math.tan(angle)
    _, result = run(scenes.incline(angle, mu), 1.0, [0.0])
    a = G * (math.sin(angle) - mu * math.cos(angle))
    assert np.linalg.norm(result.y[7:10]) == pytest.approx(a, rel=1e-14)
    assert np.linalg.norm(result.y[:3] - result.samples[0, :3]) == pytest.approx(a / 2, rel=1e-13)
    assert abs(np.linalg.norm(result.y[10:13])) < 1e-13


def test_one_vertex_impact_without_friction():
    problem, result = run(scenes.vertex_drop(restitution=0.6, friction=0.0), 0.5)
    hit = result.events[0]
    _, y = hybrid.from_scene(scenes.vertex_drop())
    y[7:10] = [0.0, -G * hit.t, 0.0]
    c = hit.contact[0]
    lever = np.cross(body.arms(problem, y)[c], [0, 1, 0])
    inverse = body.inverse_mass(problem, y)
    j = 1.6 * G * hit.t / (1 / problem.mass + lever @ inverse[3:, 3:] @ lever)
    assert hit.t == pytest.approx(math.sqrt(2 / G), abs=4 * EPS)
    np.testing.assert_allclose(hit.impulse, [j, 0, 0], rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize("mu", [0.0, 0.2, 0.5, 1.0])
@pytest.mark.parametrize("edge", [(4,), (4, 5), (0, 4)])
def test_impacts_obey_the_contact_laws(rng, mu, edge):
    problem, y = hybrid.from_scene(scenes.vertex_drop(0.3, mu))
    for _ in range(3):
        y[7:13] = rng.normal(size=6)
        restitution = np.full(len(edge), 0.3)
        A, _, u, _, _ = hybrid.contact_mode.assemble(problem, y, edge)
        u[:, 0] += restitution * np.minimum(u[:, 0], 0.0)
        _, p = motion.collide(problem, y, edge, restitution)
        # The laws once more as a projection on the cone: zero up to the tolerance of the directions, 1e-11.
        defect = coulomb_defect(A, u.ravel(), np.full(len(edge), mu), p.ravel(), 1.0)
        assert np.abs(defect).max() < 1e-10 * max(1.0, np.abs(p).max())


def test_normal_forces_of_a_face_are_the_least():
    # A rectangle pressed outside its kern: max(0, ℓ), with the contact that would pull left out.
    place = np.array([[x, z] for x in (-2.5, 2.5) for z in (-1.0, 1.0)])
    J = np.column_stack([np.ones(4), place])
    rows = np.zeros((12, 6))
    rows[0::3, :3] = J
    rows[1::3, 3], rows[2::3, 4] = 1.0, 1.0
    rows[1::3, 5], rows[2::3, 5] = -place[:, 1], place[:, 0]
    load = np.array([-10.0, -15.0, 6.0])
    b = rows @ np.array([*load, 0, 0, 0])
    answer = contact.solve(contact.Contacts(rows @ rows.T, b, 0.5, (0,) * 4, place, (None,) * 4))
    np.testing.assert_allclose(J.T @ answer.f[:, 0], -load, atol=1e-12)
    pulled = np.flatnonzero(answer.f[:, 0] == 0.0)
    assert len(pulled) == 1
    carry = np.setdiff1d(range(4), pulled)
    assert contact.extrapolated(place[carry], answer.f[carry, 0], place[pulled[0]]) < 0


# A tall block, half width b, half height h, tilted by `tilt` about its bottom edge at x = 0: a pendulum upside down,
# with φ the angle of its centre from the vertical above the edge, r its distance.
B, H, M = 0.1, 1.0, 2.0
R, ALPHA, I_C = math.hypot(B, H), math.atan2(B, H), M * (B * B + H * H) / 3


def tall_block(tilt, mu, e=0.0, rate=0.0):
    phi = tilt - ALPHA
    block = physics.Block(
        (2 * B, 2 * H, 0.5), M, pos=(R * math.sin(phi), R * math.cos(phi), 0.0),
        quat=(math.cos(tilt / 2), 0.0, 0.0, -math.sin(tilt / 2)),
        linvel=(R * math.cos(phi) * rate, -R * math.sin(phi) * rate, 0.0), angvel=(0.0, 0.0, -rate),
    )  # fmt: skip
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(e), physics.Friction(mu)]
    return physics.Scene([block], [physics.HalfSpace((0, 1, 0))], effects)


def pendulum(phi0, duration):
    """φ, φ̇ of the block about a fixed edge: (I_C + M R²) φ̈ = M g R sin φ."""
    rate = M * G * R / (I_C + M * R * R)
    return solve_ivp(
        lambda t, s: [s[1], rate * math.sin(s[0])], (0, duration), [phi0, 0.0], "DOP853", dense_output=True,
        rtol=1e-13, atol=1e-15, max_step=0.02,
    )  # fmt: skip


def test_rocking_block_is_a_pendulum_and_lands_as_housner_says():
    tilt = 0.05
    problem, y = hybrid.from_scene(tall_block(tilt, 1.0))
    begin = body.energy(problem, y)
    result = hybrid.simulate(problem, y, 1.0, [0.3])
    swing = pendulum(tilt - ALPHA, 1.0)
    phi, rate = swing.sol(0.3)
    # Both are integrated to 1e-13, and a tilt grows by at most e^(2.7 x 0.9 s) = 12 until it lands.
    np.testing.assert_allclose(result.samples[0, :2], [R * math.sin(phi), R * math.cos(phi)], atol=1e-12)
    assert result.samples[0, 12] == pytest.approx(-rate, abs=1e-12)
    hits = kinds(result, "impact")
    landing = brentq(lambda t: swing.sol(t)[0] + ALPHA, 0.1, 0.95, xtol=1e-14)
    assert [hit.contact[0] for hit in hits] == [0, 4]
    assert hits[0].t == pytest.approx(landing, abs=1e-11)
    # Energy before and after, both relative to lying still: Housner, ω⁺/ω⁻ = 1 - 3/2 sin²α.
    level = M * G * H
    ratio = (body.energy(problem, result.y) - level) / (begin - level)
    assert ratio == pytest.approx((1 - 1.5 * math.sin(ALPHA) ** 2) ** 2, rel=1e-11)


def _hold_share(phi, rate):
    """F/N at the fixed edge: the acceleration of the centre, and Newton's second law."""
    turn = M * G * R * math.sin(phi) / (I_C + M * R * R)
    along = R * (turn * math.cos(phi) - rate**2 * math.sin(phi))
    up = G - R * (turn * math.sin(phi) + rate**2 * math.cos(phi))
    return along / up


def _sliding(mu, side):
    """Rate of (φ, φ̇, x, ẋ) while the edge slides towards `side`; N from M ÿ = N - M g with y = R cos φ."""

    def derivative(t, s):
        lever = math.sin(s[0]) + mu * side * math.cos(s[0])
        turn = M * R * lever * (G - R * math.cos(s[0]) * s[1] ** 2) / (I_C + M * R * R * math.sin(s[0]) * lever)
        normal = M * (G - R * (math.sin(s[0]) * turn + math.cos(s[0]) * s[1] ** 2))
        return [s[1], turn, s[3], -mu * side * normal / M]

    return derivative


def test_tipping_block_slips_where_the_cone_ends():
    mu, tilt, end = 0.3, 0.15, 1.25
    _, result = run(tall_block(tilt, mu), end)
    swing = pendulum(tilt - ALPHA, end)
    slip = brentq(lambda t: abs(_hold_share(*swing.sol(t))) - mu, 0.9, 1.1, xtol=1e-15)
    events = kinds(result, "slip")
    assert [event.contact[0] for event in events] == [1, 5]
    # Dense output of the pendulum is good to 1e-12, and the share of friction changes by some 1/s.
    assert events[0].t == pytest.approx(slip, abs=1e-11)
    phi, rate = swing.sol(slip)
    start = [phi, rate, R * math.sin(phi), R * math.cos(phi) * rate]
    side = -math.copysign(1.0, _hold_share(phi, rate))
    moved = solve_ivp(
        _sliding(mu, side), (slip, end), start, "DOP853", rtol=1e-13, atol=1e-15, max_step=0.02
    ).y[:, -1]  # fmt: skip
    # The error of the slip's time moves the whole motion by as much; collocation leaves 1e-12 across.
    np.testing.assert_allclose([-result.y[12], result.y[0], result.y[7]], moved[1:], atol=1e-10)
    assert result.y[1] == pytest.approx(R * math.cos(moved[0]), abs=1e-10)


def test_fast_tipping_block_leaves_the_floor_where_it_would_pull():
    # Without friction N is positive while R cos φ φ̇² < g; from φ < 0 on it grows past that.
    tilt, end = 0.005, 0.05
    phi = tilt - ALPHA
    spin = math.sqrt(0.998 * G / (R * math.cos(phi)))
    _, result = run(tall_block(tilt, 0.0, rate=spin), end)
    start = [phi, spin, R * math.sin(phi), R * math.cos(phi) * spin]
    tip = solve_ivp(_sliding(0.0, 1.0), (0, end), start, "DOP853", rtol=1e-13, atol=1e-15, max_step=1e-3,
                    dense_output=True).sol  # fmt: skip
    leave = brentq(lambda t: R * math.cos(tip(t)[0]) * tip(t)[1] ** 2 - G, 0.0, 0.03, xtol=1e-15)
    assert [(event.kind, event.contact[0]) for event in result.events] == [("release", 1), ("release", 5)]
    # 1e-13 of g, against the 0.3 g/s at which it is passed.
    assert result.events[0].t == pytest.approx(leave, abs=1e-11)
    # Free from then on: the spin stays, the centre falls.
    phi, rate = tip(leave)[:2]
    assert result.y[12] == pytest.approx(-rate, abs=1e-11)
    assert result.y[8] == pytest.approx(-R * math.sin(phi) * rate - G * (end - leave), abs=1e-11)


def test_elastic_block_against_multiple_precision():
    truth = truths.load("closed_box")
    problem, y = hybrid.from_scene(scenes.closed_box())
    result = hybrid.simulate(problem, y, float(truth["hits"][-1][0]) + truth["after_s"])
    assert [event.contact for event in result.events] == [hit[1:] for hit in truth["hits"]]
    off = [abs(event.t - float(hit[0])) for event, hit in zip(result.events, truth["hits"])]
    # A rounding grows by some 1e10 over 20 hits, as stored; some tens of roundings are made on the way.
    assert max(off[:5]) < 1e-13
    end = np.array(truth["state_after"], float)
    assert np.abs(result.y[:13] - end).max() < 10 * truth["sensitivity"]["largest"]


def test_two_tolerances_agree():
    times = np.linspace(0.0, 0.9, 10)
    fine, coarse = (run(scenes.vertex_drop(), 0.9, times, options)[1] for options in (truths.FINE, truths.COARSE))
    # Impacts amplify what the integrator's 1e-12 leaves, and the flights left out are some 1e-8 s at 1e-8 m/s.
    assert np.abs(fine.samples - coarse.samples).max() < 1e-11
    assert fine.left_out > 0
