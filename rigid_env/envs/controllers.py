"""Handwritten controllers of the block's tasks, and the import paths of all controllers.

A controller is a function from observations (n, entries) to actions (n, 6). It gets the same observations as an agent,
and knows only the block's observation table (see `rigid_env.envs.block_reach`).
"""

from __future__ import annotations

import importlib
from collections.abc import Callable

import numpy as np

Policy = Callable[[np.ndarray], np.ndarray]

UP = np.array((0.0, 1.0, 0.0))
AXES = 6  # force x, y, z, torque x, y, z as shares of their limits

# --- units of the observation tables ----------------------------------------------------------------------
LENGTH = 5.0  # [m]
SPEED = 5.0  # [m/s]
SPIN = 5.0  # [rad/s]

# --- BlockReach -------------------------------------------------------------------------------------------
LIFT = 0.75  # share of the force limit that lifts, which reduces friction on the floor
ACCELERATION = 3.0  # deceleration a; the desired speed at distance d is sqrt(2 a d) [m/s²]
APPROACH = 3.0  # largest desired speed per distance, for the approach to the goal [1/s]
TOP_SPEED = 6.0  # [m/s]
SPEED_GAIN = 0.6  # share of the force limit per m/s of error
TILT_GAIN = 2.0  # share of the torque limit per sine of the tilt
SPIN_GAIN = 0.5  # share of the torque limit per rad/s
ARRIVED = 0.15  # distance within which the block is no longer lifted, so that friction stops it [m]

# --- BlockReorient ----------------------------------------------------------------------------------------
TURN_GAIN = 2.0  # share of the torque limit per radian
TURN_DAMPING = 0.9  # share of the torque limit per rad/s
DRIFT_GAIN = 0.3  # share of the force limit per m/s of sideways drift
TURNED = 0.15  # angle within which the block is no longer lifted [rad]
HALF_TURN = 1e-3  # |sine| of the angle below which its axis is not determined


def reach_controller(observations: np.ndarray) -> np.ndarray:
    """Controller for BlockReach: carries most of the weight, and slides the block to the goal, slowly enough to brake.

    A speed controller overcomes the remaining friction. A torque keeps the body axis that is nearest to the vertical
    vertical, so that the block stays on its face.

    Parameters
    ----------
    observations : (n, 24) float32

    Returns
    -------
    (n, 6) float32
    """
    offset = LENGTH * observations[:, (0, 1)]
    velocity = SPEED * observations[:, (5, 7)]
    distance = np.linalg.norm(offset, axis=1, keepdims=True)
    speed = np.minimum(np.sqrt(2.0 * ACCELERATION * distance), TOP_SPEED)
    speed = np.minimum(speed, APPROACH * distance)
    wanted = speed * offset / np.maximum(distance, ARRIVED)
    actions = np.zeros((len(observations), AXES), dtype=np.float32)
    push = SPEED_GAIN * (wanted - velocity)
    room = np.sqrt(1.0 - LIFT**2)
    push *= room / np.maximum(room, np.linalg.norm(push, axis=1, keepdims=True))
    actions[:, (0, 2)] = push
    actions[:, 1] = LIFT
    actions[distance[:, 0] <= ARRIVED, :3] = 0.0
    actions[:, 3:] = TILT_GAIN * _tilt(observations[:, 11:20]) - SPIN_GAIN * SPIN * observations[:, 8:11]
    return actions


def _tilt(rotation: np.ndarray) -> np.ndarray:
    """Axis times sine of the angle (n, 3) of the rotation that makes the nearest body axis vertical.

    `rotation` has the rotation matrices (n, 9), row by row.
    """
    heights = rotation[:, 3:6]
    nearest = np.argmax(np.abs(heights), axis=1)
    rows = np.arange(len(rotation))
    axis = rotation.reshape(-1, 3, 3)[rows, :, nearest] * np.sign(heights[rows, nearest])[:, None]
    return np.cross(axis, UP)


def reorient_controller(observations: np.ndarray) -> np.ndarray:
    """Controller for BlockReorient: carries the weight, turns the target face down the shortest way, sets it down.

    Parameters
    ----------
    observations : (n, 23) float32

    Returns
    -------
    (n, 6) float32
    """
    normal, spare_axis = observations[:, 0:3], observations[:, 3:6]
    velocity, spin = SPEED * observations[:, 13:16], SPIN * observations[:, 16:19]
    axis = np.cross(normal, -UP)
    sine = np.linalg.norm(axis, axis=1, keepdims=True)
    axis = np.where(sine < HALF_TURN, spare_axis, axis / np.maximum(sine, HALF_TURN))
    angle = np.arctan2(sine, -normal @ UP[:, None])
    turn = TURN_GAIN * angle * axis - TURN_DAMPING * spin
    is_turned = angle[:, 0] < TURNED
    actions = np.empty((len(observations), AXES), dtype=np.float32)
    actions[:, :3] = -DRIFT_GAIN * velocity
    actions[:, 1] = np.where(is_turned, 0.0, 1.0)
    actions[:, 3:] = np.where(is_turned[:, None], -TURN_DAMPING * spin, turn)
    return actions


def pushers_controller(observations: np.ndarray) -> np.ndarray:
    """Control both agents of TwoPushers: each of them acts like the single agent of BlockReach.

    Parameters
    ----------
    observations : (n, 24) float32

    Returns
    -------
    (n, 12) float32
    """
    return np.tile(reach_controller(observations), (1, 2))


CONTROLLERS = {
    "rigid_env/BlockReach-v0": "rigid_env.envs.controllers:reach_controller",
    "rigid_env/BlockReorient-v0": "rigid_env.envs.controllers:reorient_controller",
    "rigid_env/BlockCurl-v0": "rigid_env.suite.block_curl:controller",
    "rigid_env/TwoPushers-v0": "rigid_env.envs.controllers:pushers_controller",
    "rigid_env/BlockLand-v0": "rigid_env.suite.block_land:controller",
    "rigid_env/BlockPose-v0": "rigid_env.suite.block_pose:controller",
    "rigid_env/BallKick-v0": "rigid_env.suite.ball_kick:controller",
    "rigid_env/BallJuggle-v0": "rigid_env.suite.ball_juggle:controller",
    "rigid_env/BlockStack-v0": "rigid_env.suite.block_stack:controller",
    "rigid_env/BlockPush-v0": "rigid_env.suite.block_push:controller",
    "rigid_env/BlockBalance-v0": "rigid_env.suite.block_balance:controller",
}
"""Import paths of the controllers, ``module:function``, by the id of their environment."""


def load_controller(env_id: str) -> Policy:
    """Import the controller of an environment of `CONTROLLERS`."""
    module, _, name = CONTROLLERS[env_id].partition(":")
    return getattr(importlib.import_module(module), name)
