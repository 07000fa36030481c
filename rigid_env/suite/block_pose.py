"""BlockPose: bring a block to a place, a heading and a face at once, and leave it at rest there."""

from __future__ import annotations

import numpy as np

from rigid_env.suite.faces import AXES, HALF_EDGES, axes_of, order_of
from rigid_env.tasks import Entry, observe
from rigid_env.tasks.block import BlockTask
from rigid_env.tasks.block_draws import YAW, OnFloor, OtherFace
from rigid_env.tasks.block_reach import MARK_RADIUS
from rigid_env.tasks.kernels import start_poses

# --- success ----------------------------------------------------------------------------------------------
NEAR = 0.3  # horizontal distance of the centre from its place [m]
FLAT = 0.1  # angle between the target face's normal and straight down [rad]
AHEAD = 0.1  # error of the heading [rad]
REST_SPEED, REST_SPIN = 0.1, 0.1  # [m/s], [rad/s]
HOLD_STEPS = 10  # consecutive control steps

# --- rewards ----------------------------------------------------------------------------------------------
REACH_VALUE = 0.25  # potential lost per metre of distance [1/m]
TILT_VALUE = 1.0  # potential lost per radian of tilt [1/rad]
TURN_VALUE = 1.0  # potential lost per radian of the whole rotation to the wanted attitude [1/rad]
FINE_VALUE = 0.5  # potential lost, for place and for attitude each, far beyond errors ...
# ... of this size; they reward small corrections, since friction stops weak pushes [m], [rad]
FINE_LENGTH, FINE_TURN = 0.5, 0.3
CALM_VALUE = 0.1  # potential lost per m/s and rad/s in the wanted pose ...
CALM_RANGE = 1.0  # ... and 1/e of that loss at this sum of distance, tilt and rotation [m], [rad]
HOLD_VALUE = 1.0  # potential of a completed hold
STEP_COST = 0.01
SUCCESS_BONUS = 5.0

# --- units and names of the observation ----------------------------------------------------------------------
LENGTH, HALF_LENGTH = 5.0, 2.5  # [m]
CLOSE_NAMES = tuple(f"tanh of (goal {axis} minus centre {axis}) / {FINE_LENGTH} m" for axis in "xz")
TURN_NAMES = tuple(f"turn that is left, {axis}" for axis in "xyz")
FINE_NAMES = tuple(f"tanh of (turn that is left, {axis}) / {FINE_TURN} rad" for axis in "xyz")


def goal_offset(worlds):
    """Vector (n, 2) from the block's centre to the goal, x and z [m]."""
    return worlds.drawn["goal"] - worlds.pos[:, 0, ::2]


def half_edges(worlds):
    """Half edges (n, 3) along the body axes in the order of `faces.order_of` [m]."""
    return 0.5 * np.take_along_axis(worlds.drawn["size"], order_of(worlds.drawn["target_face"]), axis=1)


def turn_left(worlds):
    """Quaternion (n, 4) of the rotation from the present to the wanted attitude, world frame, at most half a turn."""
    drawn, count = worlds.drawn, len(worlds)
    pos, goal = np.empty((count, 1, 3)), np.empty((count, 1, 4))
    start_poses(drawn["goal"], drawn["heading"], drawn["target_face"], 0.5 * drawn["size"], pos, goal)
    (a, b, c, d), (w, x, y, z) = goal[:, 0].T, worlds.quat[:, 0].T
    turn = np.stack(
        [a * w + b * x + c * y + d * z, b * w - a * x + d * y - c * z, c * w - a * y + b * z - d * x,
         d * w - a * z + c * x - b * y], axis=1,
    )  # fmt: skip
    return np.where(turn[:, :1] < 0.0, -turn, turn)


def rotation_vector(worlds):
    """Rotation vectors (n, 3), axis times angle, of `turn_left` [rad]."""
    turn = turn_left(worlds)
    sine = np.linalg.norm(turn[:, 1:], axis=1, keepdims=True)
    return 2.0 * np.arctan2(sine, turn[:, :1]) * turn[:, 1:] / np.maximum(sine, 1e-12)


def potential(worlds):
    """Potential (n,) of the states, whose gain is rewarded."""
    measured = worlds.measured
    far = measured["distance"] + measured["tilt"] + measured["turn"]
    calm = CALM_VALUE * (measured["speed"] + measured["spin"]) * np.exp(-far / CALM_RANGE)
    error = REACH_VALUE * measured["distance"] + TILT_VALUE * measured["tilt"] + TURN_VALUE * measured["turn"]
    error += FINE_VALUE * (np.tanh(measured["distance"] / FINE_LENGTH) + np.tanh(measured["turn"] / FINE_TURN))
    return HOLD_VALUE * worlds.memory["held"] / HOLD_STEPS - error - calm


class BlockPose(BlockTask):
    """Bring a block to a place, a heading and a face at once, and leave it at rest there.

    ## Description

    The block, its box, and the force and torque on it are as in `BlockReach`. A control step takes 50 ms. The goal is a
    pose on the floor: the place of the centre, the face that is down, and the heading. This face is not down at the
    start. The heading is the turn about the vertical, as `yaw` of a start. A heading that is half a turn off is wrong,
    although the block looks the same. Tumbling onto the face also moves the block and turns it, so that each of the
    three goals may undo another one.

    ## Rewards

    `progress`: the gain of the potential `h - d/4 - a - b - 0.5 tanh(2 d) - 0.5 tanh(a / 0.3) - 0.1 (v + w) exp(-d - a
    - b)`. Here d is the horizontal distance of the centre from its place [m], and b the tilt of the target face [rad].
    The whole turn that is left has the angle a [rad]. v is the speed [m/s], w the spin [rad/s] and h the share of the
    hold completed. `time`: -0.01 in each step. `success`: 5.

    ## Starting State

    At rest on the floor, on a random face with a random yaw, at a random place clear of the walls. The goal is another
    such pose on another face. `reset(options=...)` fixes `place`, `yaw`, `face`, `goal`, `heading`, `target_face` and
    the parameters.

    ## Episode End

    Success: on 10 control steps in a row the centre is within 0.3 m of its place, the target face's normal within 0.1
    rad of straight down, and the heading within 0.1 rad. The speed is at most 0.1 m/s then, the spin at most 0.1 rad/s.
    Truncation after 300 control steps (15 s). `info` holds `distance` [m], `tilt`, `heading_error` and `turn` [rad],
    `speed` [m/s] and `spin` [rad/s].

    ## Version History

    - v0: first version.
    """

    observation = [
        Entry(("goal x minus centre x", "goal z minus centre z"), "m", -10, 10, goal_offset, LENGTH),
        Entry(CLOSE_NAMES, "1", -1, 1, lambda w: np.tanh(goal_offset(w) / FINE_LENGTH)),
        Entry(TURN_NAMES, "pi rad", -1, 1, lambda w: rotation_vector(w) / np.pi),
        Entry(FINE_NAMES, "1", -1, 1, lambda w: np.tanh(rotation_vector(w) / FINE_TURN)),
        Entry(AXES, "1", -1, 1, axes_of),
        Entry(HALF_EDGES, "m", 0, 10, half_edges, HALF_LENGTH),
        observe.height(scale=HALF_LENGTH),
        observe.linvel(),
        observe.angvel(),
        observe.wall_gaps(),
        Entry("share of the hold completed", "1", 0, 1, lambda w: w.memory["held"] / HOLD_STEPS),
    ]
    explanations = {
        "goal": "x and z of the wanted place [m]",
        "heading": "wanted turn about the vertical [rad]",
        "target_face": "face to be down: 0 to 5 for -x, +x, -y, +y, -z, +z",
        "distance": "horizontal distance of the centre from its place [m]",
        "tilt": "angle between the target face's normal and straight down [rad]",
        "heading_error": "part about the vertical of the turn that is left [rad]",
        "turn": "angle of the whole turn that is left [rad]",
        "reward_time": "cost of time",
    }
    memory = {"held": 1, "potential": 1}
    goal_draw = "goal"
    max_episode_steps = 300

    def __init__(self, worlds: int = 1, *, frame_skip=10, **settings):
        super().__init__(worlds, frame_skip=frame_skip, **settings)

    def goal(self):
        """Distribution of the goal's place on the floor."""
        return OnFloor(self.area)

    def declared_draws(self):
        """Distributions of the block's tasks, with the distributions of the goal's heading and face added."""
        return {**super().declared_draws(), "heading": YAW, "target_face": OtherFace()}

    def measure(self, worlds):
        """Errors of place, face, heading and attitude, and the block's speed and spin."""
        turn = turn_left(worlds)
        return {
            "distance": np.linalg.norm(goal_offset(worlds), axis=1),
            "tilt": np.arccos((-axes_of(worlds)[:, 1]).clip(-1.0, 1.0)),
            "heading_error": 2.0 * np.arctan2(np.abs(turn[:, 2]), turn[:, 0]),  # the twist about the vertical
            "turn": 2.0 * np.arctan2(np.linalg.norm(turn[:, 1:], axis=1), turn[:, 0]),
            "speed": np.linalg.norm(worlds.linvel[:, 0], axis=1),
            "spin": np.linalg.norm(worlds.angvel[:, 0], axis=1),
        }

    def begin(self, worlds):
        """Store the potential of the start."""
        worlds.memory["potential"][:] = potential(worlds)

    def update(self, worlds):
        """Count the consecutive steps in which all conditions of success hold."""
        measured, held = worlds.measured, worlds.memory["held"]
        is_met = (measured["distance"] <= NEAR) & (measured["tilt"] <= FLAT) & (measured["heading_error"] <= AHEAD)
        is_met &= (measured["speed"] <= REST_SPEED) & (measured["spin"] <= REST_SPIN)
        held[:] = np.where(is_met, held + 1, 0)

    def success(self, worlds):
        """Success: the block has held the pose at rest for half a second."""
        return worlds.memory["held"] >= HOLD_STEPS

    def rewards(self, worlds):
        """Gain of the potential, cost of time, and bonus for success."""
        value, before = potential(worlds), worlds.memory["potential"]
        terms = {
            "progress": value - before,
            "time": np.full(len(worlds), -STEP_COST),
            "success": SUCCESS_BONUS * worlds.success,
        }
        before[:] = value
        return terms

    def goal_mark(self, world):
        """Disc at the goal's place, and the target face."""
        x, z = self.drawn["goal"][world]
        return {
            "pos": (x, 0.0, z),
            "radius": MARK_RADIUS,
            "goal_face": int(self.drawn["target_face"][world]),
            "reached": self.memory_arrays["held"][world] > 0,
        }


# --- controller -------------------------------------------------------------------------------------------
SPEED, SPIN = 5.0, 5.0  # units of the observation [m/s], [rad/s]
FACE_DOWN = 0.15  # tilt below which the block slides instead of tumbling [rad]
TURN_GAIN, TURN_DAMPING = 3.0, 1.2  # share of the torque limit per radian and per rad/s, while it tumbles
HEADING_GAIN, LEVEL_GAIN, SPIN_GAIN = 4.0, 2.0, 0.5  # the same per radian about the vertical, of tilt, per rad/s
DRIFT_GAIN, PUSH_GAIN = 0.3, 0.6  # share of the force limit per m/s of drift, and of error of the speed
LIFT = 0.75  # share of the force limit that takes weight off the floor while the block slides
ACCELERATION, TOP_SPEED, APPROACH = 3.0, 6.0, 3.0  # [m/s²], [m/s], speed over distance close to the goal [1/s]
ARRIVED, AIMED = 0.2, 0.05  # distance [m] and heading [rad] within which the block is no longer lifted
UP = np.array((0.0, 1.0, 0.0))


def controller(observations: np.ndarray) -> np.ndarray:
    """Tumble the face down under a lift of 0.9 of the weight, then slide and turn to the pose, and set down.

    Parameters
    ----------
    observations : (n, 33) float32

    Returns
    -------
    (n, 6) float32
    """
    seen = observations.astype(np.float64)
    offset, heading, axes = LENGTH * seen[:, :2], np.pi * seen[:, 5], seen[:, 10:19].reshape(-1, 3, 3)
    velocity, spin = SPEED * seen[:, 23:26:2], SPIN * seen[:, 26:29]
    axis = np.cross(axes[:, 0], -UP)
    sine = np.linalg.norm(axis, axis=1, keepdims=True)
    axis = np.where(sine < 1e-3, axes[:, 1], axis / np.maximum(sine, 1e-3))  # any axis, if the face points up
    tilt = np.arctan2(sine, -axes[:, 0, 1:2])
    tumble = np.concatenate([_over(-DRIFT_GAIN * velocity, 1.0), TURN_GAIN * tilt * axis - TURN_DAMPING * spin], axis=1)
    level = LEVEL_GAIN * sine * axis - SPIN_GAIN * spin
    level[:, 1] += HEADING_GAIN * heading
    slide = np.concatenate([_slide(offset, velocity), level], axis=1)
    slide[(np.linalg.norm(offset, axis=1) < ARRIVED) & (np.abs(heading) < AIMED), :3] = 0.0
    return np.where(tilt < FACE_DOWN, slide, tumble).clip(-1.0, 1.0).astype(np.float32)


def _slide(offset, velocity):
    """Share (n, 3) of the force limit that moves the block to its goal, at a speed from which it can still brake."""
    distance = np.linalg.norm(offset, axis=1, keepdims=True)
    speed = np.minimum(np.sqrt(2.0 * ACCELERATION * distance), np.minimum(APPROACH * distance, TOP_SPEED))
    push = PUSH_GAIN * (speed * offset / np.maximum(distance, ARRIVED) - velocity)
    room = np.sqrt(1.0 - LIFT**2)
    return _over(push * room / np.maximum(room, np.linalg.norm(push, axis=1, keepdims=True)), LIFT)


def _over(push, lift):
    """Vectors (n, 3) from the horizontal push (n, 2) along x and z, and the lift along y."""
    return np.stack([push[:, 0], np.full(len(push), lift), push[:, 1]], axis=1)
