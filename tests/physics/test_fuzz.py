"""Random scenes through the public interface: valid ones keep the laws, invalid input leaves everything as it was.

All scenes declare the same effects and have a block and several bodies: one plan, compiled once.
"""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import physics
from physics.world.report import Status

SPACING = 3.0  # of the bodies' places [m]: blocks of edges up to 1.7 m have room to turn
STEPS = 30


def floats(low, high):
    return st.floats(low, high, allow_subnormal=False)


def vectors(size, low, high):
    return st.tuples(*[floats(low, high)] * size)


def units(size):
    return vectors(size, -1, 1).filter(lambda v: np.linalg.norm(v) > 0.1).map(lambda v: v / np.linalg.norm(v))


@st.composite
def bodies(draw, number):
    """A body in its own cell; number 0 is a block that is no cube."""
    start = {
        "pos": (SPACING * number, 0, 0), "quat": draw(units(4)), "linvel": draw(vectors(3, -10, 10)),
        "angvel": draw(vectors(3, -100, 100)),
    }  # fmt: skip
    mass = 10 ** draw(floats(-3, 3))
    if number == 0:
        return physics.Block((0.5, 0.7, draw(floats(0.9, 1.7))), mass, **start)
    if draw(st.booleans()):
        return physics.Sphere(draw(floats(0.05, 1.4)), mass, **start)
    return physics.Block(draw(vectors(3, 0.05, 1.7)), mass, **start)


@st.composite
def scenes(draw):
    """Two to four bodies, up to four walls none of them is in, gravity, any restitution and friction."""
    several = [draw(bodies(k)) for k in range(draw(st.integers(2, 4)))]
    walls = []
    for _ in range(draw(st.integers(0, 4))):
        normal = draw(units(3))
        nearest = min(normal @ np.array(body.pos) for body in several)
        walls.append(physics.HalfSpace(normal, nearest - 1.5 - draw(floats(0, 3))))
    gravity, restitution = draw(vectors(3, -10, 10)), draw(floats(0, 1))
    effects = [physics.Gravity(gravity), physics.Contact(restitution), physics.Friction(draw(floats(0, 2)))]
    return physics.Scene(several, walls, effects)


SLOW = settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large]
)


@SLOW
@given(scene=scenes())
def test_any_valid_scene_stays_finite_inside_its_walls_and_gains_no_energy(scene):
    world = physics.World(scene, dt=0.01)
    about = physics.diagnose(world)
    energy, scale, momentum = about.energy.sum(), about.kinetic_energy.sum(), about.momentum.sum(axis=1)
    masses = np.array([body.mass for body in scene.bodies])
    for k in range(STEPS):
        report = world.step()
        assert report.status[0] not in (Status.FAULT, Status.LEFT_OUT)
        assert np.isfinite(world.state).all()
        for wall in scene.walls:
            assert (world.pos[0] @ np.array(wall.normal) >= wall.offset).all()
        about = physics.diagnose(world)
        now, scale = about.energy.sum(), max(scale, about.kinetic_energy.sum())
        # (8 impacts per body + 1) problems, each off by 4 tolerances of the energy. What overlaps by d is pushed apart,
        # which moves it in gravity and turns a body of radius r by d/r under its angular momentum: its energy by up to
        # d/r times the ratio of its moments, 1200 for edges of 0.05 and 1.7 m.
        depth = report.penetration[0]
        push = 2 * (depth + 2e-6) * np.linalg.norm(scene.effects[0].acceleration) * masses.sum() + 1200 * depth * scale
        assert now <= energy + 4e-6 * 33 * scale + push
        energy = now
        if not scene.walls:  # what acts between bodies acts on both: momentum as by gravity alone, to rounding
            fall = masses.sum() * np.array(scene.effects[0].acceleration) * 0.01 * (k + 1)
            size = np.abs(about.momentum).sum() + np.abs(momentum).sum() + np.abs(fall).sum()
            np.testing.assert_allclose(about.momentum.sum(axis=1), momentum + fall, atol=1e-12 * size)


BAD = st.sampled_from([np.nan, np.inf, -np.inf, "x", None])
FIELDS = {
    "pos": 3, "quat": 4, "linvel": 3, "angvel": 3, "mass": 0, "size": 3, "friction": 0, "restitution": 0, "wrench": 6,
}  # fmt: skip


@pytest.fixture(scope="module")
def world():
    several = [physics.Block((1, 2, 3), 2.0, pos=(0, 2, 0)), physics.Sphere(0.5, 1.0, pos=(4, 1, 0))]
    effects = [physics.Gravity(), physics.Contact(0.2), physics.Friction(0.5)]
    world = physics.World(physics.Scene(several, [physics.HalfSpace((0, 1, 0))], effects), worlds=3, dt=0.01)
    world.step(steps=20)
    return world


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    field=st.sampled_from(sorted(FIELDS)), bad=BAD, place=st.integers(0, 10**6),
    chosen=st.sampled_from([None, [0], [2, 0]]), is_short=st.booleans(),
)  # fmt: skip
def test_invalid_input_is_a_value_error_and_changes_nothing(world, field, bad, place, chosen, is_short):
    """One bad entry, or one entry too few, among good ones for the same call."""
    count, size = 3 if chosen is None else len(chosen), FIELDS[field]
    value = np.full((count, 2, size) if size else (count, 2), 0.5, dtype=object)
    if is_short:
        value = value[:, :, :-1] if size else value[:, [0, 1, 1]]
    else:
        value.flat[place % value.size] = bad
    before, time = world.snapshot(), world.time
    if field == "wrench":
        call = partial(world.step, value if chosen is None else np.full((3, 2, 6), np.nan))
    elif field in ("pos", "quat", "linvel", "angvel"):
        good = {"linvel": np.ones((count, 2, 3)), "angvel": np.ones((count, 2, 3))}
        call = partial(world.set_state, **{**good, field: value}, worlds=chosen)
    else:
        call = partial(world.set_parameters, **{"mass": 3.0, "friction": 0.1, field: value}, worlds=chosen)
    with pytest.raises(ValueError, match=field):
        call()
    assert world.time == time
    for kept, now in zip(before.arrays, world.snapshot().arrays):
        np.testing.assert_array_equal(kept, now)
