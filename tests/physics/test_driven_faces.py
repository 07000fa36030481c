"""Round bodies that slide over the face of a driven body while it turns, against the exact motion."""

from __future__ import annotations

import math

import numpy as np
import pytest

import physics

pytestmark = pytest.mark.interpreted

TURN, SPEED, START, TIME = 3.0, 2.0, 0.5, 0.12  # of the plate [rad/s]; of the body along it [m/s]; place [m]; [s]
RADIUS, TOP = 0.05, 0.5  # of the body; of the face, above the axis of the turn [m]
SIZE = (8, 2 * TOP, 2)
CORNERS = [(x, y, z) for x in (-4, 4) for y in (-TOP, TOP) for z in (-1, 1)]
ACROSS = (0.5**0.5, 0.5**0.5, 0, 0)  # body y along the axis of the turn

PLATES = {
    "block": lambda motion: physics.Block(SIZE, fixed=True, motion=motion),
    "hull": lambda motion: physics.Hull(CORNERS, fixed=True, motion=motion),
    "compound": lambda motion: physics.Compound([physics.Block(SIZE, fixed=True)], fixed=True, motion=motion),
}
BODIES = {
    "sphere": lambda given: physics.Sphere(RADIUS, 1.0, **given),
    "capsule": lambda given: physics.Capsule(RADIUS, 0.2, 1.0, quat=ACROSS, **given),
    "ellipsoid": lambda given: physics.Ellipsoid((0.1, RADIUS, RADIUS), 1.0, **given),
}


def slide(plate: str, body: str, spin: float, dt: float, preset: str = "balanced") -> tuple[np.ndarray, float]:
    """Place (along the plate, above its axis) [m] of a body after TIME, and the deepest contact [slops].

    The plate turns about world z, towards the body. Without friction and load it slides outwards.
    """
    height = TOP + RADIUS
    given = {
        "pos": (START, height, 0),
        "linvel": (SPEED - TURN * height, TURN * START, 0),
        "angvel": (0, 0, spin),
    }
    bodies = [PLATES[plate](physics.Motion(spin=(0, 0, TURN))), BODIES[body](given)]
    world = physics.World(physics.Scene(bodies, [], [physics.Contact()]), dt=dt, accuracy=preset)
    deepest = max(float(world.step().penetration[0]) for _ in range(round(TIME / dt)))
    c, s = math.cos(TURN * TIME), math.sin(TURN * TIME)
    slop = physics.accuracy.resolve(preset).slop * bodies[1].bounding_radius(bodies[1].dimensions)
    return np.array(((c, s), (-s, c))) @ world.pos[0, 1, :2], deepest / slop


def error(plate: str, body: str, spin: float, dt: float, preset: str = "balanced") -> float:
    """Error of the place along the plate [m], with x'' = Ω² x for the exact one."""
    exact = START * math.cosh(TURN * TIME) + SPEED / TURN * math.sinh(TURN * TIME)
    return float(slide(plate, body, spin, dt, preset)[0][0]) - exact


@pytest.mark.parametrize(
    ("plate", "body", "spin"),
    [("block", "sphere", 0.0), ("hull", "sphere", 40.0), ("compound", "sphere", 0.0), ("block", "capsule", 0.0)],
)
def test_the_error_is_of_second_order(plate, body, spin):
    """With a normal that stays while the plate turns, the error is of first order, 8e-3 m at 0.02 s.

    It is c h² (1 + O(h)), so that a halved step leaves a quarter of it, up to a few hundredths.
    """
    coarse, fine = (error(plate, body, spin, dt) for dt in (0.02, 0.01))
    assert math.log2(coarse / fine) == pytest.approx(2.0, abs=0.1)
    assert abs(fine) < 1e-3 * RADIUS * 2


@pytest.mark.parametrize(("body", "spin"), [("sphere", 0.0), ("sphere", 40.0), ("capsule", 0.0), ("ellipsoid", 0.0)])
def test_bodies_do_not_sink_in(body, spin):
    """A stage leaves a depth of third order, and the correction at most 100 slops of it.

    The second derivative 2 Ω u of the gap would make it u Ω h² = 2.4e-3 m, 5e4 slops, if the normal did not turn.
    """
    place, deepest = slide("block", body, spin, 0.02)
    assert deepest < 100.0
    if body != "ellipsoid":  # which tips over
        assert place[1] == pytest.approx(TOP + RADIUS, abs=100e-6 * RADIUS)


@pytest.mark.exhaustive
def test_precise_is_exact():
    """Error control finds the place to its tolerance; 2e-11 m were seen."""
    assert abs(error("block", "sphere", 0.0, 0.01, "precise")) < 1e-9
