"""Laws of fixed and driven bodies in random scenes: their places, and the frame in which they do no work.

If everything that can be touched moves at one constant velocity V, it is at rest in the frame that moves with it.
Gravity is the same there, so contact only takes energy. With P the momentum and M the mass of the other bodies the
energies in this frame at the time t are

    K' = K - V·P + ½ M V²,    U' = U + M g·V t.
"""

from __future__ import annotations

import numpy as np

import physics
from physics.kernels.flight.prescribed_motion import KIND, SPIN, STEADY, STILL, SURFACE, VELOCITY
from physics.rotations import rotation_matrices
from physics.scene.groups import group_table, may_touch
from physics.world.motions import motion_columns
from physics.world.parameters import masses_of

# Name of a body that is a closed box about the others; its parts are placed about the middle of the box.
ROOM = "room"

# Rounding of a place that is added up over the substeps of a step, as a share of the numbers.
PLACE_ROUNDING = 1e-12


def free_masses(world: physics.World) -> np.ndarray:
    """Masses (worlds, bodies) [kg], 0 of fixed bodies."""
    is_fixed = np.array([body.fixed for body in world.scene.bodies])
    return np.where(is_fixed, 0.0, masses_of(world.params).reshape(world.worlds, -1))


def fixed_bodies(scene: physics.Scene) -> list[int]:
    """Indices of the fixed bodies of a scene, driven ones included."""
    return [b for b, body in enumerate(scene.bodies) if body.fixed]


def motions(world: physics.World) -> np.ndarray:
    """Motions (worlds, fixed bodies, columns) of the fixed bodies, in the columns of `prescribed_motion`."""
    chosen = fixed_bodies(world.scene)
    if not world.plan.motion_columns:
        return np.zeros((world.worlds, len(chosen), SURFACE + 3))
    return motion_columns(world.params, world.plan).reshape(world.worlds, world.body_count, -1)[:, chosen]


def frame_velocity(world: physics.World) -> np.ndarray:
    """Common constant velocity (worlds, 3) of everything that can be touched [m/s]; nan where there is none."""
    found = motions(world)
    moves = (found[..., KIND] != STILL)[..., None]
    velocity, turning = moves * found[..., VELOCITY : VELOCITY + 3], moves * found[..., SPIN : SURFACE + 3]
    steady = ((found[..., KIND] == STILL) | (found[..., KIND] == STEADY)) & ~turning.any(axis=-1)
    if _can_touch_walls(world.scene) or not velocity.shape[1]:
        velocity = np.concatenate((velocity, np.zeros((world.worlds, 1, 3))), axis=1)
    is_common = steady.all(axis=1) & (velocity == velocity[:, :1]).all(axis=(1, 2))
    return np.where(is_common[:, None], velocity[:, 0], np.nan)


def _can_touch_walls(scene: physics.Scene) -> bool:
    table, count = group_table(scene), len(scene.bodies)
    moving = [b for b in range(count) if not scene.bodies[b].fixed]
    return bool(scene.walls) and (table is None or bool(may_touch(table, count)[moving, count:].any()))


def places_in_room(world: physics.World) -> np.ndarray:
    """Places (worlds, bodies, 3) of the centres of mass from the middle of the `ROOM`, or of the world [m]."""
    if ROOM not in world.names:
        return world.pos
    room = world.names.index(ROOM)
    R, away = rotation_matrices(world.quat[:, room]), world.pos - world.pos[:, room, None]
    return np.einsum("wji,wbj->wbi", R, away) + world.scene.bodies[room].centroid


def poses(world: physics.World) -> np.ndarray:
    """Places and attitudes (worlds, fixed bodies, 7) of the fixed bodies; a copy."""
    chosen = fixed_bodies(world.scene)
    return np.concatenate((world.pos[:, chosen], world.quat[:, chosen]), axis=-1)


def has_strayed(world: physics.World, before: np.ndarray, dt: float) -> np.ndarray:
    """True (worlds,) where a fixed body is not where it must be, `dt` [s] after its `poses` were `before`.

    One without a motion keeps every bit. One that moves steadily keeps its line, to rounding.
    """
    found, now = motions(world), poses(world)
    moved = (found[..., KIND] == STILL) & (now != before).any(axis=-1)
    line = before[..., :3] + dt * found[..., VELOCITY : VELOCITY + 3]
    off = np.abs(now[..., :3] - line).max(axis=-1, initial=0.0) > PLACE_ROUNDING * (
        1.0 + np.abs(line).max(axis=-1, initial=0.0)
    )
    return (moved | ((found[..., KIND] == STEADY) & off)).any(axis=1)
