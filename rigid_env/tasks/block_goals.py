"""Goal-conditioned tasks of the block: bring it to a place, or turn a face down; for hindsight experience replay."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from rigid_env.tasks import observe
from rigid_env.tasks.block import BlockTask
from rigid_env.tasks.block_draws import OnFloor, OtherFace
from rigid_env.tasks.block_reach import MARK_RADIUS
from rigid_env.tasks.entries import Entry
from rigid_env.tasks.goal import GoalTask
from rigid_env.tasks.kernels import REACH_TOLERANCE, REORIENT_TOLERANCE, REST_SPEED, REST_SPIN

LENGTH = 5.0  # unit of places in observations [m]
BOUND = 10.0  # largest number in an observation, in its unit


def _length(vectors: np.ndarray) -> np.ndarray:
    """Lengths (n,) of vectors (n, 3)."""
    return np.sqrt(np.einsum("ij,ij->i", vectors, vectors))


REST = (
    Entry("speed", "m/s", 0.0, BOUND, lambda worlds: _length(worlds.linvel[:, 0])),
    Entry("spin", "rad/s", 0.0, BOUND, lambda worlds: _length(worlds.angvel[:, 0])),
)
"""Speed and spin of the block: the last two numbers of a goal, 0 in a desired one."""

MOTION = (
    observe.height(scale=2.5),
    observe.linvel(),
    observe.angvel(),
    observe.rotation(),
    observe.wall_gaps(),
)


class BlockGoal(GoalTask, BlockTask):
    """Base of the goal-conditioned tasks of the block; the last two numbers of a goal are speed and spin."""

    def __init__(self, worlds: int = 1, *, reward="sparse", frame_skip=20, **settings):
        super().__init__(worlds, reward=reward, frame_skip=frame_skip, **settings)

    def shortfall(self, achieved, desired):
        """Largest of three ratios of an error to its tolerance: error of the goal, of the speed, and of the spin."""
        speed, spin = (np.abs(achieved[..., k] - desired[..., k]) for k in (-2, -1))
        miss = self.miss(achieved[..., :-2], desired[..., :-2])
        return np.maximum(miss, np.maximum(speed / REST_SPEED, spin / REST_SPIN))

    def miss(self, achieved, desired) -> np.ndarray:
        """Error of the achieved goal over its tolerance, shape (...,); the error is a distance or an angle.

        `achieved` and `desired` are goals (..., numbers) without their last two numbers, speed and spin.
        """
        raise NotImplementedError


class BlockReachGoal(BlockGoal):
    """Bring a block to a place on the floor, and keep it at rest there: a task with goals.

    The block, the box and the actions are those of `rigid_env.BlockReachEnv`, at 100 ms for a control step. An
    observation is a dict. A goal has four numbers: x and z of the block's centre [5 m], its speed [m/s] and its spin
    [rad/s]. The desired goal has speed and spin 0. It is reached within 0.3 m, 0.1 m/s and 0.1 rad/s.

    ## Rewards

    Both rewards follow from the shortfall `s = max(d / 0.3, v / 0.1, w / 0.1)`. Here d is the distance of the centre
    from the desired place [m], v the speed [m/s] and w the spin [rad/s], all of the observed goals.
    `reward="sparse"`: 0 if `s <= 1`, else -1. `reward="dense"`: `-s`.

    ## Episode End

    Termination: never. Success is `s <= 1`, in every control step anew: the goal has to be kept. An evaluation counts
    the last control step of the episode. `info` holds `shortfall`, the s of the rewards.
    """

    max_episode_steps = 75
    explanations: ClassVar = {"goal": "x and z of the desired place [m]"}
    observation = (Entry(("position x", "position z"), "m", -BOUND, BOUND, lambda w: w.pos[:, 0, ::2], LENGTH), *MOTION)
    goal_entries = (Entry(("place x", "place z"), "m", -BOUND, BOUND, lambda w: w.pos[:, 0, ::2], LENGTH), *REST)
    goal_draw = "goal"

    def goal(self):
        """Distribution of the desired place: uniform over the floor."""
        return OnFloor(self.area)

    def desired(self, worlds):
        """Desired goals (n, 4): the drawn place [m], speed 0 and spin 0."""
        return np.pad(worlds.drawn["goal"], ((0, 0), (0, 2)))

    def miss(self, achieved, desired):
        """Distance between the achieved and the desired place over its tolerance."""
        return LENGTH * np.linalg.norm(achieved - desired, axis=-1) / REACH_TOLERANCE

    def goal_mark(self, world):
        x, z = self.drawn["goal"][world]
        is_reached = self.is_reached(self.achieved_goal[world], self.desired_goal[world])
        return {"pos": (x, 0.0, z), "radius": MARK_RADIUS, "reached": bool(is_reached)}


class BlockReorientGoal(BlockGoal):
    """Turn a block so that a face is down, and keep it at rest: a task with goals.

    The block, the box and the actions are those of `rigid_env.BlockReorientEnv`, at 100 ms for a control step. An
    observation is a dict. A goal has five numbers: the direction straight down in the body frame (x, y, z), speed [m/s]
    and spin [rad/s]. In the desired goal the direction is the outward normal of a face, and speed and spin are 0. It is
    reached within 0.1 rad, 0.1 m/s and 0.1 rad/s.

    ## Rewards

    Both rewards follow from the shortfall `s = max(a / 0.1, v / 0.1, w / 0.1)`. Here a is the angle between the desired
    face's normal and straight down [rad], v the speed [m/s] and w the spin [rad/s], all of the observed goals.
    `reward="sparse"`: 0 if `s <= 1`, else -1. `reward="dense"`: `-s`.

    ## Episode End

    Termination: never. Success is `s <= 1`, in every control step anew: the goal has to be kept. An evaluation counts
    the last control step of the episode. `info` holds `shortfall`, the s of the rewards.
    """

    max_episode_steps = 75
    explanations: ClassVar = {"target_face": "face to be turned down: 0 to 5 for -x, +x, -y, +y, -z, +z"}
    observation = (*MOTION, Entry(("edge x", "edge y", "edge z"), "m", 0.0, BOUND, lambda w: w.drawn["size"], LENGTH))
    goal_entries = (
        Entry(("down x", "down y", "down z"), "1", -1.0, 1.0, lambda worlds: -worlds.rotation[:, 0, 1]),
        *REST,
    )
    goal_draw = "target_face"

    def goal(self):
        """Distribution of the desired face: any face that is not on the floor at the start."""
        return OtherFace()

    def desired(self, worlds):
        """Desired goals (n, 5): outward normal of the drawn face in the body frame, speed 0 and spin 0."""
        faces = worlds.drawn["target_face"].astype(np.int64)
        wanted = np.zeros((len(worlds), 5))
        wanted[np.arange(len(worlds)), faces // 2] = np.where(faces % 2 == 1, 1.0, -1.0)
        return wanted

    def miss(self, achieved, desired):
        """Angle between the achieved and the desired direction over its tolerance."""
        # Unit vectors, rounded to float32: a small angle keeps its digits if it is computed from the chord.
        chord = np.linalg.norm(achieved - desired, axis=-1)
        return 2.0 * np.arcsin(np.minimum(0.5 * chord, 1.0)) / REORIENT_TOLERANCE

    def goal_mark(self, world):
        is_reached = self.is_reached(self.achieved_goal[world], self.desired_goal[world])
        return {"goal_face": int(self.drawn["target_face"][world]), "reached": bool(is_reached)}
