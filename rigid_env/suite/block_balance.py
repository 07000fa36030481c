"""BlockBalance: keep a block on an edge, or a cube on a vertex, with a torque alone."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np

import physics
from physics import validation
from rigid_env.tasks import Entry, Gust, Push, Task, Wrench, observe

G = 9.81  # [m/s²]
MASS = 6.0  # [kg]
TORQUE = 0.3  # longest torque over the weight times the longest half edge
FALLEN = 0.5  # tilt beyond which the episode fails [rad]
START_LEAN = 0.05  # largest tilt at the start [rad]
EFFORT_PRICE = 0.1  # weight of the squared action [1/s]
SPEED, SPIN = 1.0, 2.0  # units of the observation [m/s], [rad/s]
STIFFNESS, DAMPING = 10.0, 4.0  # gains of the controller: shares of the torque limit per radian and per rad/s


class Stance(NamedTuple):
    """Shape of the block, and the edge or vertex on which it stands.

    Attributes
    ----------
    size : (3,) tuple
        Edges of the block [m].
    arm : (3,) tuple
        Vector from the contact to the centre, body frame [m].
    """

    size: tuple[float, float, float]
    arm: tuple[float, float, float]

    @property
    def height(self) -> float:
        """Height of the centre over the contact [m]."""
        return float(np.linalg.norm(self.arm))

    @property
    def axis(self) -> np.ndarray:
        """Unit vector (3,) from the contact to the centre, body frame."""
        return np.array(self.arm) / self.height


STANCES = {
    "edge": Stance((1.0, 0.6, 0.4), (0.5, 0.3, 0.0)),
    "vertex": Stance((1.0, 1.0, 1.0), (0.5, 0.5, 0.5)),
}
"""Block on an edge along its z axis, and cube on a vertex."""


class BlockBalance(Task):
    """Keep a block on an edge, or a cube on a vertex, under pushes and gusts.

    ## Description

    A block of 1.0 x 0.6 x 0.4 m stands on one of its shortest edges, its centre above it: it falls to either side. With
    `stance="vertex"` it is a cube of 1 m on a vertex, which falls to all sides. The agent turns it back with a torque
    of up to 0.3 times weight and longest half edge. The torque holds leans of up to 0.26 rad on the edge and 0.17 rad
    on the vertex. Pushes and gusts come at random times. The friction coefficient is 0.8.

    ## Rewards

    `upright`: the time of the control step [s]. `effort`: minus 0.1 times the time and the squared action.

    ## Starting State

    At rest, with a lean of up to 0.05 rad and any heading. The start is a lean about the z axis, then a turn by `yaw`.

    ## Episode End

    Failure: the lean exceeds 0.5 rad. Truncation after 240 control steps (12 s). A block that still stands then is a
    success. `info` holds `lean` [rad] and `upright` [s], the time that it has stood.

    ## Version History

    - v0: first version.

    Parameters
    ----------
    worlds, accuracy, effects, draws, frame_skip, dt, dump_faults, threads
        As of `rigid_env.Task`.
    stance : {"edge", "vertex"}

    Raises
    ------
    ValueError
        Another stance, or as of `rigid_env.Task`.
    """

    actions = Wrench(0, 0.0, TORQUE)
    observation = [
        Entry(("axis x", "axis y", "axis z"), "1", -1, 1, lambda w: w.memory["axis"]),
        Entry(("body z axis x", "body z axis y", "body z axis z"), "1", -1, 1, lambda w: w.rotation[:, 0, :, 2]),
        observe.linvel(0, SPEED, 5),
        observe.angvel(0, SPIN, 5),
    ]
    explanations = {
        "start_lean": "lean about the z axis at the start [rad]",
        "yaw": "turn about the vertical after the lean [rad]",
        "lean": "angle between the vertical and the line from contact to centre [rad]",
        "upright": "time that the block has stood [s]",
        "reward_upright": "time of the control step [s]",
        "reward_effort": "cost of the squared action",
    }
    memory = {"axis": 3}
    draws = {"start_lean": (-START_LEAN, START_LEAN), "yaw": (-np.pi, np.pi)}
    disturbances = [Push(0, speed=(0.1, 0.3), every=2.0), Gust(0, force=(0.0, 0.05), lasts=(0.3, 1.0), every=3.0)]
    max_episode_steps = 240
    ends_on_success = False

    def __init__(
        self, worlds: int = 1, *, stance: Literal["edge", "vertex"] = "edge", frame_skip=5, dt=0.01, **settings
    ) -> None:
        self.stance = STANCES[validation.one_of(stance, tuple(STANCES), "stance")]
        super().__init__(worlds, frame_skip=frame_skip, dt=dt, **settings)

    def make_scene(self, distributions):
        """Scene of the block above a floor."""
        return physics.Scene(
            bodies=[physics.Block(size=self.stance.size, mass=MASS, pos=(0.0, self.stance.height, 0.0))],
            walls=[physics.HalfSpace((0.0, 1.0, 0.0), 0.0)],
            effects=[physics.Gravity((0.0, -G, 0.0)), physics.Contact(), physics.Friction(0.8)],
        )

    def place(self, drawn):
        """Pose of the start: upright, then leaned about z, then turned about the vertical; the contact stays lowest."""
        lean, yaw = drawn["start_lean"], drawn["yaw"]
        zero = np.zeros_like(lean)
        leaned = np.stack([np.cos(lean / 2), zero, zero, np.sin(lean / 2)], axis=-1)
        turned = np.stack([np.cos(yaw / 2), zero, np.sin(yaw / 2), zero], axis=-1)
        quat = product(turned, product(leaned, upright(self.stance.axis)))
        return {"pos": np.stack([zero, self.stance.height * np.cos(lean), zero], axis=-1), "quat": quat}

    def begin(self, worlds):
        """Store the direction (3,) from the contact to the centre, world frame."""
        worlds.memory["axis"][:] = worlds.rotation[:, 0] @ self.stance.axis

    update = begin

    def measure(self, worlds):
        """Angle between the vertical and the line from contact to centre, and the time since the start."""
        height = (worlds.rotation[:, 0] @ self.stance.axis)[:, 1]
        return {"lean": np.arccos(np.clip(height, -1.0, 1.0)), "upright": worlds.time}

    def success(self, worlds):
        """Success: the block has not fallen until the end of the episode."""
        return (worlds.steps >= self.max_episode_steps) & ~self.failure(worlds)

    def failure(self, worlds):
        """Failure: the block has fallen."""
        return worlds.measured["lean"] > FALLEN

    def rewards(self, worlds):
        """Time upright, minus the effort."""
        effort = (worlds.action**2).sum(axis=1)
        return {"upright": self.control_dt * ~worlds.failure, "effort": -EFFORT_PRICE * self.control_dt * effort}


def upright(axis: np.ndarray) -> np.ndarray:
    """Quaternion of the shortest rotation from a unit vector to the vertical."""
    quat = np.array([1.0 + axis[1], -axis[2], 0.0, axis[0]])  # 1 + a·y, a × y
    return quat / np.linalg.norm(quat)


def product(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Product (..., 4) of quaternions w, x, y, z: rotation q, then rotation p."""
    vector = p[..., :1] * q[..., 1:] + q[..., :1] * p[..., 1:] + np.cross(p[..., 1:], q[..., 1:])
    scalar = p[..., 0] * q[..., 0] - (p[..., 1:] * q[..., 1:]).sum(axis=-1)
    return np.concatenate([scalar[..., None], vector], axis=-1)


def controller(observations: np.ndarray) -> np.ndarray:
    """Turn the line from contact to centre towards the vertical by a spring and a damper, in the world frame.

    Parameters
    ----------
    observations : (n, 12) float32

    Returns
    -------
    (n, 3) float32
    """
    axis, spin = observations[:, 0:3], SPIN * observations[:, 9:12]
    turn = np.cross(axis, np.array([0.0, 1.0, 0.0]))
    return (STIFFNESS * turn - DAMPING * spin).clip(-1.0, 1.0).astype(np.float32)
