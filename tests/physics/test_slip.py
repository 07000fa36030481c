"""Sliding in time stepping: friction against the mean slip of a step, and edges that land with both ends at once."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import physics
from physics import scenes
from physics.work_precision.errors import distances

G = scenes.GRAVITY
TIGHT = physics.Accuracy(tolerance=1e-9)


def scene(body, mu=0.3):
    """The body on a floor; a block's restitution is 0, a sphere has none: so are the kernels of most tests."""
    restitution = None if body.kind == "sphere" else 0.0
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(restitution), physics.Friction(mu)]
    return physics.Scene([body], [physics.HalfSpace((0, 1, 0))], effects)


def tilted(axis, angle, **start):
    """The block turned about `axis`, its lowest points on the floor."""
    axis = np.asarray(axis) / np.linalg.norm(axis)
    quat = np.array([math.cos(angle / 2), *(math.sin(angle / 2) * axis)])
    w, x, y, z = quat
    down = (2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x))  # the floor's normal, body frame
    height = np.abs(down) @ (0.5 * np.array(scenes.SIZE))
    return physics.Block(scenes.SIZE, scenes.MASS, pos=(0, height, 0), quat=quat, **start)


EDGE = tilted((1, 0, 0), 0.5, linvel=(2.0, 0, 0.5), angvel=(0, 3.0, 0))
VERTEX = tilted((1, 1, 0), 0.7, linvel=(0.3, 0, 0.2), angvel=(0, 4.0, 0))


def errors(body, steps, time, **knobs):
    """Worst distance of a point of the body from `precise`, per step length."""
    true = physics.simulate(scene(body), time, "precise", time)
    accuracy = physics.Accuracy(tolerance=1e-9, **knobs)
    runs = [physics.simulate(scene(body), time, accuracy, dt) for dt in steps]
    return np.array(
        [distances(scene(body), run.pos[-1:], run.quat[-1:], true.pos[-1:], true.quat[-1:])[0, 0] for run in runs]
    )


@pytest.mark.parametrize("body", [EDGE, VERTEX], ids=["edge", "vertex"])
def test_points_that_slide_and_turn_are_of_second_order(body):
    """Over 0.1 s, in which the slip turns by 0.3 to 0.4 rad."""
    coarse, middle, fine = errors(body, (0.0025, 0.00125, 0.000625), 0.1)
    assert math.log2(coarse / middle) == pytest.approx(2.0, abs=0.1)
    assert math.log2(middle / fine) == pytest.approx(2.0, abs=0.1)


def test_against_the_slip_at_the_end_it_is_of_first_order():
    coarse, fine = errors(EDGE, (0.00125, 0.000625), 0.1, slip="end")
    assert math.log2(coarse / fine) == pytest.approx(1.0, abs=0.1)
    assert fine > 10 * errors(EDGE, (0.000625,), 0.1)[0]


def sphere_slip(world):
    return world.linvel[0, 0] + np.cross(world.angvel[0, 0], (0, -1, 0))


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(-3, 3), st.floats(0.05, 1.0), st.floats(0.001, 0.05))
@settings(max_examples=40, deadline=None)
def test_friction_takes_what_its_impulse_does_at_the_mean_slip(vx, vz, spin, mu, h):
    """A sphere that goes on slipping has ΔE = -μ m g h |½ (u⁰ + u¹)|; and never does a step add energy."""
    mass = 2.0
    body = physics.Sphere(1.0, mass, pos=(0, 1, 0), linvel=(vx, 0, vz), angvel=(spin, 0, -spin))
    world = physics.World(scene(body, mu), dt=h, accuracy=TIGHT)
    start = physics.diagnose(world).energy[0, 0]
    noise = 1e-13 * (start + mass * G)
    for _ in range(10):
        before, slip = physics.diagnose(world).energy[0, 0], sphere_slip(world)
        world.step()
        lost, after = before - physics.diagnose(world).energy[0, 0], sphere_slip(world)
        # What a solve to 1e-9 of its free speed, at most |u⁰| + g h, leaves of an impulse of μ m g h.
        assert lost >= -noise - 1e-9 * (np.linalg.norm(slip) + G * h) * mass * (1 + mu) * G * h
        if slip @ after > 1e-9 * (slip @ slip):  # it goes on: has not been stopped to the tolerance
            mean = np.linalg.norm(0.5 * (slip + after))
            bound = noise + 1e-9 * (np.linalg.norm(slip) + G * h) * mass * G * h
            assert lost == pytest.approx(mu * mass * G * h * mean, abs=bound)


def test_what_holds_an_edge_goes_on_holding_it():
    """Friction against the mean slip cannot stop a contact, only turn it round: a block that tips keeps its edge."""
    world = physics.World(scene(tilted((1, 0, 0), 0.3), mu=2.0), dt=0.01)
    world.step()
    start, _ = world.contacts()
    for _ in range(30):
        assert world.step().ok
    end, _ = world.contacts()
    assert abs(world.angvel[0, 0, 0]) > 0.1
    # Held points move back and forth by h² ω² r /8 within a step, and by a tolerance of its free speed in each.
    bound = 0.01**2 * 0.5 * 3.1 / 8 + 30 * 1e-6 * G * 0.01**2
    np.testing.assert_allclose(sorted(end.tolist()), sorted(start.tolist()), rtol=0, atol=bound)


def test_an_edge_that_bounces_lands_with_both_its_ends():
    """From a centimetre, level to 1.9 slops: no end is struck alone, so that the block does not turn about z."""
    quat = tilted((1, 0, 0), 0.5).quat
    slop = physics.Accuracy().slop * 0.5 * np.linalg.norm(scenes.SIZE)
    lean = 1.9 * slop / scenes.SIZE[0]
    turned = (quat[0], quat[1], 0.5 * lean * quat[1], 0.5 * lean * quat[0])  # a turn by `lean` about the world's z
    body = tilted((1, 0, 0), 0.5)
    body = physics.Block(body.size, body.mass, pos=(0, body.pos[1] + 0.01, 0), quat=turned / np.linalg.norm(turned))
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(0.5), physics.Friction(0.5)]
    world = physics.World(physics.Scene([body], [physics.HalfSpace((0, 1, 0))], effects), dt=0.01)
    world.step(steps=6)  # the edge lands after 45 ms
    assert world.linvel[0, 0, 1] > 0.0
    # One end alone would make it turn about z as fast as its speed over its length: (1 + e) v/(L/2), some 0.1 rad/s.
    assert abs(world.angvel[0, 0, 2]) < 1e-5


def test_a_block_dropped_on_a_vertex_converges_at_first_order_or_better():
    """`balanced` against `reference`, bouncing, sliding and rocking for two seconds and more impacts than a dozen."""
    some, steps = scenes.vertex_drop(), np.array([0.01, 0.005, 0.002])
    true = physics.simulate(some, 2.0, "reference", 2.0)
    runs = [physics.simulate(some, 2.0, "balanced", dt) for dt in steps]
    found = [distances(some, run.pos[-1:], run.quat[-1:], true.pos[-1:], true.quat[-1:])[0, 0] for run in runs]
    assert np.polyfit(np.log(steps), np.log(found), 1)[0] >= 1.0
    assert found[-1] < 2e-5  # a few slops of 3e-6 m; against the slip at the end it is 1.4e-4
