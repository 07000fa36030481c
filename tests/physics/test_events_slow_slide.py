"""A block that friction nearly holds slides slowly: right to the tolerance, and at a cost that does not grow."""

from __future__ import annotations

import cProfile
import pstats

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import physics
from physics.compiler.compiler_choice import COMPILER, PYTHON
from tests.reference.flat_slide import FlatSlide

pytestmark = pytest.mark.interpreted

DT = 0.005
HELD = FlatSlide((5.0, 2.0, 3.0), 6.0, 9.81, 0.5, (-39.85, -29.5, -18.64), (45.1, -32.3, 19.06))
SLIPS = {"steady": (-1e-4, -5e-5, -1e-6), "turned": (1e-4, -1e-4, 0.0), "fast": (-1e-2, 0.0, 0.0)}

# A step of smooth motion is off by the tolerance times its scale of velocity, |u| + a h, at most. Here a is below
# 15 m/s², from gravity and the force, and |u| below 0.03 m/s, so that the scale is below 0.1 m/s. A step of 5 ms takes
# at most 30 smooth steps, and friction damps the errors of those before.
OFF = {accuracy: 30 * 0.1 * physics.PRESETS[accuracy].tolerance for accuracy in ("precise", "reference")}
TRUE = 1e-13  # error of the reference, whose tolerance is 1e-12 of velocities below 0.03 m/s


def world(slide: FlatSlide, slip, accuracy: str) -> physics.World:
    """The block on the floor, in its reference's start."""
    block = physics.Block(
        slide.size, slide.mass, pos=(0, 0.5 * slide.size[1], 0), linvel=(slip[0], 0, slip[1]), angvel=(0, slip[2], 0)
    )
    effects = [physics.Gravity((0, -slide.gravity, 0)), physics.Contact(), physics.Friction(slide.friction)]
    return physics.World(physics.Scene([block], [physics.HalfSpace((0, 1, 0))], effects), dt=DT, accuracy=accuracy)


def check(slide: FlatSlide, slip, accuracy: str) -> None:
    """Compare a step with the reference."""
    there = world(slide, slip, accuracy)
    assert there.step([[*slide.force, *slide.torque]]).ok
    pose, motion = slide.after(DT, slip)
    quat = there.quat.ravel()
    found = [there.pos.flat[0], there.pos.flat[2], 2.0 * np.arctan2(quat[2], quat[0])]
    moving = [there.linvel.flat[0], there.linvel.flat[2], there.angvel.flat[1]]
    assert moving == pytest.approx(motion, abs=OFF[accuracy] + TRUE)
    assert found == pytest.approx(pose, abs=DT * OFF[accuracy] + TRUE)


@pytest.mark.parametrize("accuracy", OFF)
@pytest.mark.parametrize("slip", SLIPS.values(), ids=SLIPS)
def test_a_block_that_friction_nearly_holds_moves_as_its_equations_say(slip, accuracy):
    check(HELD, slip, accuracy)


@settings(max_examples=3, deadline=None)
@given(st.floats(1.001, 1.03), st.floats(0.0, 6.3), st.floats(0.0, 6.3), st.floats(-5.5, -3.5), st.floats(-1.0, 1.0))
def test_so_it_does_in_any_direction_at_any_slow_speed(share, force_angle, slip_angle, decades, turn):
    """The force is a little more than friction holds, so that the slip does not end within the step."""
    most = HELD.friction * HELD.mass * HELD.gravity
    force = (share * most * np.cos(force_angle), 0.0, share * most * np.sin(force_angle))
    speed = 10.0**decades
    slip = (speed * np.cos(slip_angle), speed * np.sin(slip_angle), 0.2 * turn * speed)
    check(HELD._replace(force=force, torque=(0.0, 0.0, 0.0)), slip, "precise")


@pytest.mark.skipif(COMPILER != PYTHON, reason="counts calls, which compiled code does not show")
@pytest.mark.parametrize("slip", SLIPS.values(), ids=SLIPS)
def test_the_cost_of_a_slow_slide_does_not_grow_with_its_stiffness(slip):
    """Friction turns the slip by some hundred radians in a step; the explicit rule needed 20 evaluations for each.

    The implicit rule needs at most 81 for a smooth step. A slip that begins across the force takes some twenty steps.
    """
    profile, there = cProfile.Profile(), world(HELD, slip, "precise")
    profile.runcall(there.step, [[*HELD.force, *HELD.torque]])
    stats = pstats.Stats(profile).stats
    assert sum(calls for (_, _, name), (_, calls, *_) in stats.items() if name == "compute_state_rate") < 2000
