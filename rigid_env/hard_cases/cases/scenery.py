"""Scenes and measured quantities that several hard cases share.

All scenes declare contact, friction and gravity even with coefficients of 0. Then they have the same compiled step as
scenes with other coefficients, and all cases with one body need only a handful of compiled steps.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

import physics
from physics.rotations import rotation_matrices
from physics.scene.canonical_scenes import GRAVITY, MASS, SIZE
from physics.work_precision.errors import angles_between, mechanical_energy
from rigid_env.hard_cases.case import Check, Setting, none_of

EPS = float(np.finfo(float).eps)
FLOOR = physics.HalfSpace((0, 1, 0))
WIDE = 1e3  # half width of a box whose other walls are never met [m]


def block(pos=(0.0, SIZE[1] / 2, 0.0), size=SIZE, mass=MASS, **start) -> physics.Block:
    """Block of 5 x 3 x 2 m and 6 kg, by default face down on the floor; `start` goes to `physics.Block`."""
    return physics.Block(size, mass, pos=pos, **start)


def free(body: physics.Body, gravity=(0.0, 0.0, 0.0)) -> physics.Scene:
    """Scene with a body in empty space."""
    return physics.Scene([body], [], [physics.Gravity(gravity)])


def laws(restitution: float = 0.0, friction: float = 0.0, gravity=(0.0, -GRAVITY, 0.0)) -> list:
    """Effects of a scene: gravity, contact and friction."""
    return [physics.Gravity(gravity), physics.Contact(restitution), physics.Friction(friction)]


def on_floor(body: physics.Body, restitution=0.0, friction=0.0, gravity=(0.0, -GRAVITY, 0.0)) -> physics.Scene:
    """Scene with a body and a floor y = 0."""
    return physics.Scene([body], [FLOOR], laws(restitution, friction, gravity))


def boxed(
    body: physics.Body, halves: Sequence[float] = (WIDE, WIDE, WIDE), restitution=0.0, friction=0.0,
    gravity=(0.0, 0.0, 0.0), origin=(0.0, 0.0, 0.0),
) -> physics.Scene:  # fmt: skip
    """Scene with a body between six walls at `origin` ± `halves` [m]."""
    walls = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            normal = tuple(sign * (k == axis) for k in range(3))
            walls.append(physics.HalfSpace(normal, sign * origin[axis] - halves[axis]))
    return physics.Scene([body], walls, laws(restitution, friction, gravity))


def turned(angle: float, axis=(0.0, 0.0, 1.0)) -> tuple[float, float, float, float]:
    """Quaternion (4,), w first, of a rotation by `angle` [rad] about `axis`, a vector of any length."""
    x, y, z = np.asarray(axis, dtype=float) / np.linalg.norm(axis) * math.sin(0.5 * angle)
    return math.cos(0.5 * angle), float(x), float(y), float(z)


def energy(world, scene: physics.Scene) -> float:
    """Kinetic and potential energy of all bodies [J], from the state alone, for any engine."""
    state = (np.asarray(world.pos), np.asarray(world.quat), np.asarray(world.linvel), np.asarray(world.angvel))
    return float(mechanical_energy(scene, *state).sum())


def kinetic_energy(world, scene: physics.Scene) -> float:
    """Kinetic energy of all bodies [J], from the state alone, for any engine."""
    weightless = physics.Scene(scene.bodies)
    return energy(world, weightless)


def attitude(world) -> np.ndarray:
    """Rotation matrix (3, 3), body to world, of the first body of the first world."""
    return rotation_matrices(np.asarray(world.quat)[0, 0])


def angle_to(world, quat) -> float:
    """Angle between the first body's attitude and `quat` [rad]."""
    return float(angles_between(np.asarray(world.quat)[0, 0], np.asarray(quat)))


def tilt_about_z(world) -> float:
    """Angle of the first body's x axis above the horizon, in the x-y plane [rad]."""
    R = attitude(world)
    return math.atan2(R[1, 0], R[0, 0])


def is_finite(world) -> bool:
    """Return True if every number of the state is finite."""
    return all(np.isfinite(np.asarray(part)).all() for part in (world.pos, world.quat, world.linvel, world.angvel))


def none_of_finite(what: str, world) -> Check:
    """Check that every number of the state of a world is finite."""
    return none_of(what, not is_finite(world))


def wrench(force=(0.0, 0.0, 0.0), torque=(0.0, 0.0, 0.0), bodies: int = 1) -> np.ndarray:
    """Wrench array (1, bodies, 6) with a force [N] and a torque [N m] on the first body."""
    load = np.zeros((1, bodies, 6))
    load[0, 0, :3], load[0, 0, 3:] = force, torque
    return load


def of_last_step(on: Setting, mu: float) -> float:
    """Limit for the position error of the step in which sliding ends [m]: a speed of at most μ g dt, times dt."""
    return 0.0 if on.is_event_driven else mu * GRAVITY * on.dt**2


def early(on: Setting, body: physics.Body) -> float:
    """Bound the way that a body gains by one hit that is treated too early [m]; it flies between walls.

    Time stepping computes the time of a hit at constant speed by one division, so this is 0. The event-driven scheme
    treats contacts that would touch within 1e-10 and ten tolerances of the time R/v as one impact (theory, section 8).
    One of them is reversed too early by this time, at a change of velocity of 2 v.
    """
    radius = float(body.bounding_radius(body.dimensions))
    return 2 * (1e-10 + 10 * on.tolerance) * radius if on.is_event_driven else 0.0


def state_of(world) -> np.ndarray:
    """Copy of the first world's state as one array (bodies * 13,)."""
    parts = (world.pos, world.quat, world.linvel, world.angvel)
    return np.concatenate([np.asarray(part)[0].ravel() for part in parts])
