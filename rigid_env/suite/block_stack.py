"""BlockStack: put a heavy cube onto a block that may be a thousand times lighter, and let go."""

from __future__ import annotations

import numpy as np

import physics
from rigid_env.tasks import Entry, LogUniform, Task, Wrench, observe

G = 9.81  # [m/s²]
A, B = 0, 1  # bodies
EDGE = 1.0  # edge of cube A [m]
BASE = (1.2, 0.8, 1.2)  # edges of block B [m]
MASS = 20.0  # mass of cube A [kg]
LARGEST_RATIO = 1000.0  # largest ratio of the masses, A to B
LOG_LARGEST = np.log(LARGEST_RATIO)
STRENGTH = 1.5  # longest force over the weight of A
TORQUE = 0.2  # longest torque over the weight of A times half its edge
STACKED = 0.5 * (EDGE + BASE[1])  # height of A's centre over B's when it lies on B [m]
CARRIED = 0.5  # least contact force on A, as a share of its weight, while B carries it
STILL = 0.02  # speed [m/s] and spin [rad/s] below which A is at rest
CREEP = 1e-3  # largest displacement of A during the time of rest [m]
UNMOVED = 0.05  # largest displacement [m] and rotation [rad] of B during the episode
HOLD_TIME = 2.0  # time of rest that is a success [s]
CLEARANCE = 0.3  # height over B's upper face at which A should approach [m]
LENGTH, SPEED, SPIN = 2.0, 2.0, 2.0  # units of the observation [m], [m/s], [rad/s]
HELD_WORTH, SUCCESS_WORTH = 3.0, 5.0


def stack_offset(worlds):
    """Vector (n, 3) from A's place on B to A's centre [m]."""
    return worlds.pos[:, A] - worlds.pos[:, B] - np.array([0.0, STACKED, 0.0])


def route(offset):
    """Length (n,) of a path over B's edge to the place on B: horizontal, plus up or down to a funnel above B [m]."""
    along = np.hypot(offset[:, 0], offset[:, 2])
    return along + np.abs(offset[:, 1] - CLEARANCE * np.minimum(along, 1.0))


class BlockStack(Task):
    """Put a cube onto a block without moving it, and let go.

    ## Description

    Cube A of 1 m and 20 kg stands on a floor beside block B, 1.2 m wide and 0.8 m high. The agent drives A with a force
    of up to 1.5 times its weight, which lifts it, and a torque. It has to set A down on B and to let go. B is as heavy
    as A or up to 1,000 times lighter. The heavy body is on top: B then yields to the slightest touch, and the contact
    problem of the pile is badly conditioned.

    ## Rewards

    `progress`: decrease of the way [m] that A has to go, over the edge of B, and of its tilt, 1 less the height of its
    y axis. `held`: 3 times the gain of the longest time of rest so far over 2 s. `success`: 5. The start fixes the sum
    of all that can be earned: no cycle pays.

    ## Starting State

    Both at rest on the floor. B is at the origin, and A at a drawn distance and bearing, with a drawn yaw.

    ## Episode End

    Success: A has been at rest on B for 2 s. In all of this time B carries at least half of its weight. The speed of A
    is below 0.02 m/s, its spin below 0.02 rad/s, and its centre within 1 mm of its place when the rest began. Failure:
    B has moved by more than 0.05 m, or turned by more than 0.05 rad. Truncation after 240 control steps (12 s). `info`
    holds `distance` of A from its place on B [m], `moved` of B [m] and `held` [s].

    ## Version History

    - v0: first version.
    """

    scene = physics.Scene(
        bodies=[
            physics.Block(size=(EDGE, EDGE, EDGE), mass=MASS, pos=(2.5, 0.5 * EDGE, 0.0)),
            physics.Block(size=BASE, mass=MASS, pos=(0.0, 0.5 * BASE[1], 0.0)),
        ],
        walls=[physics.HalfSpace((0.0, 1.0, 0.0), 0.0)],
        effects=[physics.Gravity((0.0, -G, 0.0)), physics.Contact(), physics.Friction(0.5)],
    )
    actions = Wrench(A, STRENGTH, TORQUE)
    observation = [
        Entry(("A above B x", "A above B y", "A above B z"), "m", -5, 5, stack_offset, LENGTH),
        observe.linvel(A, SPEED, 5),
        observe.angvel(A, SPIN, 5),
        Entry(("A's y axis x", "A's y axis y", "A's y axis z"), "1", -1, 1, lambda w: w.rotation[:, A, :, 1]),
        Entry("contact force on A along y", "m g", 0, 5, lambda w: w.contact_force[:, A, 1] / w.weight[:, A]),
        Entry("share of the rest that is over", "1", 0, 1, lambda w: w.measured["held"] / HOLD_TIME),
        Entry("logarithm of the mass ratio", "1", 0, 1, lambda w: np.log(MASS / w.drawn["mass[1]"]) / LOG_LARGEST),
    ]
    draws = {
        "apart": (1.8, 3.0),
        "bearing": (-np.pi, np.pi),
        "yaw": (-np.pi / 4, np.pi / 4),
        "mass[1]": LogUniform(MASS / LARGEST_RATIO, MASS),
    }
    explanations = {
        "apart": "distance of the centres at the start [m]",
        "bearing": "direction from B to A at the start [rad]",
        "yaw": "turn of A about the vertical at the start [rad]",
        "distance": "distance of A from its place on B [m]",
        "moved": "distance of B from its place at the start [m]",
        "held": "time that A has been at rest on B [s]",
        "reward_progress": "decrease of A's way [m] and tilt",
        "reward_held": "gain of the longest time of rest",
        "reward_success": "bonus for success",
    }
    memory = {"held": 1, "longest": 1, "place": 3, "to_go": 1}
    max_episode_steps = 240

    def __init__(self, worlds=1, *, frame_skip=5, dt=0.01, **settings):
        super().__init__(worlds, frame_skip=frame_skip, dt=dt, **settings)

    def place(self, drawn):
        """Place A on the floor, on a ring about B."""
        count = len(drawn["apart"])
        pos = np.zeros((count, 2, 3))
        pos[:, A, 0] = drawn["apart"] * np.cos(drawn["bearing"])
        pos[:, A, 2] = drawn["apart"] * np.sin(drawn["bearing"])
        pos[:, :, 1] = 0.5 * EDGE, 0.5 * BASE[1]
        quat = np.zeros((count, 2, 4))
        quat[:, A, 0], quat[:, A, 2] = np.cos(0.5 * drawn["yaw"]), np.sin(0.5 * drawn["yaw"])
        quat[:, B, 0] = 1.0
        return {"pos": pos, "quat": quat}

    def measure(self, worlds):
        """Distance of A from its place, displacement of B, and time of rest including this step."""
        return {
            "distance": np.linalg.norm(stack_offset(worlds), axis=1),
            "moved": np.linalg.norm(worlds.pos[:, B] - np.array([0.0, 0.5 * BASE[1], 0.0]), axis=1),
            "held": np.where(self._goes_on(worlds), worlds.memory["held"] + self.control_dt, 0.0),
        }

    def begin(self, worlds):
        """Store A's position, and the length of its path to B."""
        worlds.memory["place"][:] = worlds.pos[:, A]
        worlds.memory["to_go"][:] = self._to_go(worlds)

    def update(self, worlds):
        """Store the time of rest, and A's position at its start."""
        held = worlds.measured["held"]
        has_ended = held == 0.0
        worlds.memory["held"][:] = held
        worlds.memory["place"][has_ended] = worlds.pos[has_ended, A]

    def success(self, worlds):
        """Success: A has rested for `HOLD_TIME`; half a control step is allowed for rounding."""
        return worlds.measured["held"] > HOLD_TIME - 0.5 * self.control_dt

    def failure(self, worlds):
        """Failure: B has been moved or rotated."""
        turned = 2.0 * np.arccos(np.minimum(np.abs(worlds.quat[:, B, 0]), 1.0))
        return (worlds.measured["moved"] > UNMOVED) | (turned > UNMOVED)

    def rewards(self, worlds):
        """Decrease of the path, gain of the longest time of rest, and bonus for success."""
        before, now = worlds.memory["to_go"], self._to_go(worlds)
        longest, held = worlds.memory["longest"], worlds.measured["held"]
        progress, gain = before - now, np.maximum(held - longest, 0.0)
        before[:], longest[:] = now, np.maximum(held, longest)
        return {
            "progress": progress,
            "held": HELD_WORTH * gain / HOLD_TIME,
            "success": SUCCESS_WORTH * worlds.success,
        }

    def _goes_on(self, worlds):
        """Flags (n,) bool: B carries A, and A is still and near the position at which its rest began."""
        is_still = np.maximum(_lengths(worlds.linvel[:, A]), _lengths(worlds.angvel[:, A])) < STILL
        is_above = worlds.pos[:, A, 1] > worlds.pos[:, B, 1] + STACKED - UNMOVED
        is_carried = worlds.contact_force[:, A, 1] > CARRIED * worlds.weight[:, A]
        is_there = _lengths(worlds.pos[:, A] - worlds.memory["place"]) < CREEP
        return is_still & is_above & is_carried & is_there

    def _to_go(self, worlds):
        """Length (n,) of A's path to its place on B [m], plus one minus the cosine of A's tilt."""
        return route(stack_offset(worlds)) + (1.0 - worlds.rotation[:, A, 1, 1])

    def goal_mark(self, world):
        """Disc below B."""
        return {"pos": (0.0, 0.0, 0.0), "radius": 1.0, "reached": bool(self.memory_arrays["held"][world] > 0.0)}


def _lengths(vectors):
    """Lengths (n,) of vectors (n, 3)."""
    return np.sqrt(np.einsum("ij,ij->i", vectors, vectors))


def controller(observations: np.ndarray) -> np.ndarray:
    """Lift A, carry it over B, lower it, and let go as soon as B carries part of its weight.

    Parameters
    ----------
    observations : (n, 15) float32

    Returns
    -------
    (n, 6) float32
    """
    offset, velocity = LENGTH * observations[:, 0:3], SPEED * observations[:, 3:6]
    spin, axis = SPIN * observations[:, 6:9], observations[:, 9:12]
    is_carried = (observations[:, 12] > 0.1) & (offset[:, 1] > -UNMOVED)
    along = np.hypot(offset[:, 0], offset[:, 2])
    is_over = along < 0.05
    is_free = is_over | (offset[:, 1] > 0.5 * CLEARANCE) | (along > 1.8)
    wanted = -2.0 * offset
    wanted[:, ::2] *= (is_free * np.minimum(1.0, 1.0 / np.maximum(2.0 * along, 1e-6)))[:, None]
    wanted[:, 1] = np.where(is_over, -0.2, np.clip(2.0 * (CLEARANCE - offset[:, 1]), -1.0, 1.0))
    acceleration = 5.0 * (wanted - velocity)
    acceleration[:, 1] += G
    actions = np.zeros((len(observations), 6), dtype=np.float32)
    actions[:, :3] = acceleration / (STRENGTH * G)
    upright = np.cross(axis, np.array([0.0, 1.0, 0.0]))
    actions[:, 3:] = 4.0 * upright - 2.0 * spin
    actions[is_carried] = 0.0
    return actions.clip(-1.0, 1.0)
