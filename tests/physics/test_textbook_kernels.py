"""The kernels against `physics/textbook.py`: free flight, one impact, resting contact, and the exercise as a whole."""

from __future__ import annotations

import numpy as np
import pytest

import physics
from physics import scenes
from physics import textbook as tb
from physics.analysis.resting_contact import resting_contact
from tests.reference import truths
from tests.reference.rigid_body import orientation_error
from tests.tiers.sweep import sweep

pytestmark = pytest.mark.interpreted

MASS = 6.0


def page_of(scene):
    """Scene of the page and its state Y, of a canonical scene with one block."""
    (body,) = scene.bodies
    effects = {type(effect): effect for effect in scene.effects}
    walls = tuple(tb.HalfSpace(wall.normal, wall.offset) for wall in scene.walls)
    page = tb.Scene(
        body.size,
        body.mass,
        walls,
        effects[physics.Gravity].acceleration if physics.Gravity in effects else (0.0, 0.0, 0.0),
        effects[physics.Contact].restitution if physics.Contact in effects else 0.0,
        effects[physics.Friction].coefficient if physics.Friction in effects else 0.0,
    )
    return page, tb.make_state(page, body.pos, body.quat, body.linvel, body.angvel)


def off(page, Y, pos, quat, linvel, angvel):
    """Differences of a state Y from a state of the engine: place [m], attitude [rad], velocities [m/s, rad/s]."""
    _, _, v, omega = tb.auxiliary(page, Y)
    return np.array(
        [
            np.abs(Y[:3] - pos).max(),
            orientation_error(Y[3:7], quat),
            np.abs(v - linvel).max(),
            np.abs(omega - angvel).max(),
        ]
    )


def sample(run, i):
    return run.pos[i, 0], run.quat[i, 0], run.linvel[i, 0], run.angvel[i, 0]


def advance(page, Y, duration, steps):
    for _ in range(steps):
        Y = tb.step(page, Y, duration / steps)
    return Y


# --- free flight ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("accuracy", ["fast", "balanced", "precise"])
def test_free_flight(accuracy):
    """The kernels are exact. The page is off by a step's (ω h)⁵/120 times 100 steps, and e³ of the unstable axis."""
    scene = scenes.flight()
    page, Y = page_of(scene)
    run = physics.simulate(scene, 1.0, accuracy, sample_dt=0.5)
    Y = advance(page, Y, 1.0, 200)
    bound = 200 * (5.0 * 0.005) ** 5 / 120 * np.exp(3.0)
    assert (off(page, Y, *sample(run, -1))[[0, 2]] < 1e-9).all()  # rounding of 1e6 m
    assert (off(page, Y, *sample(run, -1))[[1, 3]] < [bound, 5.0 * bound]).all()


# --- one impact -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("friction", [None, 0.4])
def test_one_impact(friction, rng):
    """A vertex, 1 mm above the floor, comes in at some 3 m/s; RK4 of 10 ms is good to (ω h)⁵/120 = 3e-9.

    The page bisects the time of impact to 1e-12 s, and solves the impact to 1e-12 of its impulse.
    """
    for _ in range(10):
        quat = rng.standard_normal(4)
        quat /= np.linalg.norm(quat)
        motion = {"linvel": rng.normal([0, -4, 0], 0.5), "angvel": rng.normal(0.0, 0.5, 3)}
        scene = scenes.block_in_box((0.0, 0.0, 0.0), 0.5, friction, quat=quat, **motion)
        page, Y = page_of(scene)
        height = 1e-3 - tb.gaps(page, Y)[:, 0].min()
        scene = scenes.block_in_box((0.0, height, 0.0), 0.5, friction, quat=quat, **motion)
        page, Y = page_of(scene)
        run = physics.simulate(scene, 0.01, "precise", sample_dt=0.01)
        assert [event.kind for event in run.events] == ["impact"]
        end = advance(page, Y, 0.01, 10)
        assert (off(page, end, *sample(run, -1)) < 1e-10).all()
        change = end[7:10] - Y[7:10] - MASS * 0.01 * np.array(page.gravity)
        np.testing.assert_allclose(change, run.events[0].impulse, rtol=0, atol=1e-9)


# --- resting contact ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("angle", [0.0, 0.2, 1.2])
def test_resting_accelerations(angle):
    """Forces on a face are not unique: accelerations, the sum of the forces and their moment are.

    Turned by `angle` about z the block stands on an edge and falls over, turning about it.
    """
    s, c = np.sin(angle / 2), np.cos(angle / 2)
    scene = scenes.block_in_box((0.0, 0.0, 0.0), 0.0, None, quat=(c, 0.0, 0.0, s), angvel=(0.0, 0.0, -0.3))
    page, Y = page_of(scene)
    height = -tb.gaps(page, Y)[:, 0].min()
    vertex = tb.auxiliary(page, Y)[0][tb.gaps(page, Y)[:, 0].argmin()]
    motion = {"angvel": (0.0, 0.0, -0.3), "linvel": np.cross(vertex, (0.0, 0.0, -0.3))} if angle else {}
    scene = scenes.block_in_box((0.0, height, 0.0), 0.0, None, quat=(c, 0.0, 0.0, s), **motion)
    page, Y = page_of(scene)
    contacts, _ = tb.find_contacts(page, Y)
    load, f, a = tb.resting_contact(page, Y, contacts)
    kernel = resting_contact(physics.World(scene, dt=0.01))
    assert len(contacts) == len(kernel.forces) == (2 if angle else 4)
    np.testing.assert_allclose(kernel.accelerations, a[:, 0], rtol=0, atol=1e-10)
    pushes = kernel.forces[:, None] * kernel.normals
    moments = np.cross(kernel.points - Y[:3], pushes).sum(axis=0)
    np.testing.assert_allclose(np.concatenate([pushes.sum(axis=0), moments]), load, rtol=0, atol=1e-9)
    assert f[:, 0].min() >= 0.0


# --- the exercise ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("until", sweep([1.75, 3.0], [1.75]))
def test_exercise(until):
    """`drop`: impacts, rocking on a vertex and two edges, sliding, sticking, hundreds of bounces, rest.

    It is not chaotic: a start that spins by 1e-7/s faster about x is off by 1.4e-6 m at most, and by 6e-7 m at rest.
    Steps of 12.5 ms are off by 1e-7 m and 2e-6 m/s at most, by what counts as slow. The bounds are tenfold.
    """
    scene = scenes.drop()
    page, Y = page_of(scene)
    run = physics.simulate(scene, until, "precise", sample_dt=0.05)
    worst = np.zeros(4)
    for i in range(1, len(run.t)):
        Y = advance(page, Y, 0.05, 4)
        worst = np.maximum(worst, off(page, Y, *sample(run, i)))
    assert (worst < [1e-6, 1e-7, 1e-5, 1e-5]).all()


# --- until chaos sets in --------------------------------------------------------------------------------------------


def hits_of_the_closed_box(count, start, h):
    """Velocities (count, 3) after each of the first hits of the elastic block in six walls, by the page."""
    truth = truths.load("closed_box")
    page, Y = page_of(scenes.closed_box())
    Y = Y + start
    times = np.array([float(t) for t, *_ in truth["hits"]])
    now, found = 0.0, []
    for i in range(count):
        end = 0.5 * (times[i] + times[i + 1])  # between two hits the velocity stays
        Y = advance(page, Y, end - now, int(np.ceil((end - now) / h)))
        now = end
        found.append(Y[7:10] / MASS)
    return np.array(found)


def test_closed_box_until_chaos_sets_in():
    """Elastic, without friction: each hit multiplies an error.

    A start moved by 1e-9 m is off by 2e-5 m/s after ten hits (2.5 s), by 2e-2 m/s after seventeen (5.6 s). So grows the
    error of RK4, 7e-9 m/s at the first hit with steps of 10 ms: 2e-5 m/s after ten. Until then the page, the truth
    and the kernels agree to what its first error grows to.
    """
    count, h = 10, 0.01
    truth = truths.load("closed_box")
    stored = np.array([[float(a) for a in state[7:10]] for state in truth["states"][:count]])
    nudge = np.zeros(13)
    nudge[0] = 1e-9
    found, moved = (hits_of_the_closed_box(17, start, h) for start in (0.0, nudge))
    change = np.abs(moved - found).max(axis=1)
    error = np.abs(found[:count] - stored).max(axis=1)
    assert change[count - 1] > 1e-5
    assert change[-1] > 1e-2
    assert error[0] < 1e-8
    assert error[-1] < 1e-4
    assert (error <= error[0] * np.maximum(1.0, np.maximum.accumulate(change[:count]) / 1e-9)).all()
    end = float(truth["hits"][count - 1][0]) + 1e-3
    run = physics.simulate(scenes.closed_box(), end, "precise", sample_dt=end)
    assert np.abs(run.linvel[-1, 0] - found[count - 1]).max() < 2 * error[-1]
