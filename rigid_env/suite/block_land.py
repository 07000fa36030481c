"""BlockLand: bring a thrown, spinning block down softly on a given face, with a limited impulse to spend."""

from __future__ import annotations

import numpy as np

import physics
from rigid_env.suite.faces import AXES, HALF_EDGES, axes_of, order_of
from rigid_env.tasks import Choice, Distribution, Entry, Task, Uniform, Wrench, observe

G = 9.81  # [m/s²]
SIZE = (5.0, 3.0, 2.0)  # edges [m]
HALF = 0.5 * np.array(SIZE)
REACH = float(HALF.max())  # [m]
THRUST = 2.0  # longest force over the weight m g
TWIST = 1.0  # longest torque over m g times the longest half edge
BUDGET = 2.5  # integral of thrust and twist over the episode [m g s]
HEIGHT = (7.0, 10.0)  # range of the centre's height at the start [m]
SLOWEST, FASTEST = (-3.0, 0.0, -3.0), (3.0, 4.0, 3.0)  # least and largest velocity at the start [m/s]
SPIN = 2.0  # largest spin about each axis at the start [rad/s]

# --- success ----------------------------------------------------------------------------------------------
FLAT = 0.03  # angle between the target face's normal and straight down [rad]
TOUCH = 0.03  # largest gap to the floor at rest [m]
REST_SPEED, REST_SPIN = 0.1, 0.1  # [m/s], [rad/s]
HOLD_STEPS = 5  # consecutive control steps

# --- rewards ----------------------------------------------------------------------------------------------
TURN_VALUE = 1.0  # potential lost per radian off the target [1/rad]
CALM_VALUE = 0.1  # potential lost per m/s and rad/s with the face down ...
CALM_RANGE = 0.3  # ... and 1/e of that loss at this angle [rad]
HOLD_VALUE = 1.0  # potential of a completed hold
PEAK_PRICE = 2.0  # weight of the largest impulse of an impact [1/(m g s)]
STEP_COST = 0.02
SUCCESS_BONUS = 5.0


class Attitude(Distribution):
    """Unit quaternions, uniform over all rotations (Shoemake, *Uniform random rotations*, Graphics Gems III, 1992)."""

    length, uniforms = 4, 3

    def at(self, shares, drawn):
        """Convert uniform numbers (n, 3) to quaternions (n, 4)."""
        low, high = np.sqrt(1.0 - shares[:, 0]), np.sqrt(shares[:, 0])
        first, second = 2.0 * np.pi * shares[:, 1], 2.0 * np.pi * shares[:, 2]
        return np.stack([low * np.sin(first), low * np.cos(first), high * np.sin(second), high * np.cos(second)], 1)

    def describe(self):
        """Description of the distribution for tables."""
        return "uniform over all rotations"


def potential(worlds):
    """Potential (n,) of the states, whose gain is rewarded."""
    angle, calm = worlds.measured["angle"], worlds.measured["speed"] + worlds.measured["spin"]
    held = HOLD_VALUE * worlds.memory["held"] / HOLD_STEPS
    return held - TURN_VALUE * angle - CALM_VALUE * calm * np.exp(-angle / CALM_RANGE)


class BlockLand(Task):
    """Bring a thrown, spinning block down softly on a given face, with a limited impulse to spend.

    ## Description

    The block of `BlockReach`, 5 x 3 x 2 m and 6 kg, is thrown over an open floor, in any attitude and spinning. A
    control step is 50 ms. The agent has a force of up to 2 m g at its centre and a torque of up to m g a, where a is
    the longest half edge. Both draw on one budget: force over m g plus torque over m g a, integrated over time, may
    reach 2.5 s. Hovering for 2.5 s takes all of it. Once less is left than a control step of full force and torque
    would take, both are gone. The reward depends on the face that is down at the end, and on the hardest impact before.

    ## Rewards

    `progress`: the gain of the potential `-a - 0.1 (v + w) exp(-a / 0.3) + h`. Here a is the angle between the target
    face's normal and straight down [rad], v the speed [m/s], w the spin [rad/s] and h the share of the hold completed.
    `peak`: minus 2 times the growth of the peak, which is the largest impulse that impacts gave the block in one
    control step, over m g [s]. `time`: -0.02 in each step. `success`: 5.

    ## Starting State

    The centre is 7 to 10 m high. The attitude is uniform over all rotations. Horizontal velocities are up to 3 m/s
    along x and z, the upward one 0 to 4 m/s, spins up to 2 rad/s about each axis. Any of the six faces is the target.

    ## Episode End

    Success: on 5 control steps in a row the target face lies on the floor, within 0.03 rad and 0.03 m, and the block
    rests. At rest the speed is at most 0.1 m/s and the spin at most 0.1 rad/s. Failure: the budget is spent, and the
    block rests on another face. Truncation after 120 control steps (6 s). `info` holds `angle` [rad], `speed` [m/s],
    `spin` [rad/s], `peak` [m g s] and `left`, the rest of the budget [m g s].

    A face comes down by chance in one of six throws.

    ## Version History

    - v0: first version.
    """

    scene = physics.Scene(
        bodies=[physics.Block(size=SIZE, mass=6.0, pos=(0.0, 8.0, 0.0))],
        walls=[physics.HalfSpace((0.0, 1.0, 0.0), 0.0)],
        effects=[physics.Gravity((0.0, -G, 0.0)), physics.Contact(restitution=0.2), physics.Friction(0.5)],
    )
    actions = Wrench(0, THRUST, TWIST)
    observation = [
        Entry(AXES, "1", -1, 1, axes_of),
        Entry(HALF_EDGES, "m", 0, 1, lambda w: HALF[order_of(w.drawn["target_face"])], REACH),
        observe.height(scale=5.0),
        observe.linvel(scale=5.0),
        observe.angvel(scale=2.5),
        Entry("gap to the floor", "m", -1, 3, lambda w: w.wall_gaps[:, 0, 0], 5.0),
        Entry("share of the budget that is left", "1", 0, 1, lambda w: 1.0 - w.memory["spent"] / BUDGET),
        Entry("largest impulse of an impact so far", "m g s", 0, 3, lambda w: w.memory["peak"]),
        Entry("share of the hold completed", "1", 0, 1, lambda w: w.memory["held"] / HOLD_STEPS),
    ]
    draws = {
        "height": HEIGHT,
        "attitude": Attitude(),
        "linvel": Uniform(SLOWEST, FASTEST),
        "angvel": Uniform(3 * (-SPIN,), 3 * (SPIN,)),
        "target_face": Choice(range(6)),
    }
    explanations = {
        "height": "height of the centre at the start [m]",
        "attitude": "quaternion w, x, y, z at the start",
        "linvel": "velocity at the start [m/s]",
        "angvel": "angular velocity at the start [rad/s]",
        "target_face": "face to be down: 0 to 5 for -x, +x, -y, +y, -z, +z",
        "angle": "angle between the target face's normal and straight down [rad]",
        "speed": "speed of the block's centre [m/s]",
        "spin": "length of the angular velocity [rad/s]",
        "peak": "largest impulse of impacts in one control step so far, over the weight [s]",
        "left": "rest of the budget [s]",
        "reward_progress": "gain of the potential",
        "reward_peak": "cost of a larger peak",
        "reward_time": "cost of time",
        "reward_success": "bonus for success",
    }
    memory = {"spent": 1, "peak": 1, "held": 1, "still": 1, "potential": 1}
    max_episode_steps = 120

    def __init__(self, worlds: int = 1, *, frame_skip=10, **settings):
        super().__init__(worlds, frame_skip=frame_skip, **settings)

    def place(self, drawn):
        """Start of the thrown block: above the origin, with the drawn attitude and velocities."""
        height = np.asarray(drawn["height"])
        pos = np.stack([np.zeros_like(height), height, np.zeros_like(height)], axis=1)
        return {"pos": pos, "quat": drawn["attitude"], "linvel": drawn["linvel"], "angvel": drawn["angvel"]}

    def measure(self, worlds):
        """Angle of the target face, speed and spin, largest impact so far, and the rest of the budget."""
        blow = np.linalg.norm(worlds.impact_impulse[:, 0], axis=1) / worlds.weight[:, 0]
        down = -axes_of(worlds)[:, 1]
        return {
            "angle": np.arccos(down.clip(-1.0, 1.0)),
            "speed": np.linalg.norm(worlds.linvel[:, 0], axis=1),
            "spin": np.linalg.norm(worlds.angvel[:, 0], axis=1),
            "peak": np.maximum(worlds.memory["peak"], blow),
            "left": BUDGET - worlds.memory["spent"] - self._spending(worlds),
        }

    def begin(self, worlds):
        """Store the potential of the start."""
        worlds.memory["potential"][:] = potential(worlds)

    def update(self, worlds):
        """Add the spent impulse and the steps at rest; set the limits of the actions to 0 once the budget is spent."""
        memory, measured = worlds.memory, worlds.measured
        memory["spent"] += self._spending(worlds)
        self.limits[worlds.indices[self._is_spent(worlds)]] = 0.0
        rests = (measured["speed"] <= REST_SPEED) & (measured["spin"] <= REST_SPIN)
        rests &= worlds.wall_gaps[:, 0, 0] <= TOUCH
        memory["still"][:] = np.where(rests, memory["still"] + 1, 0)
        memory["held"][:] = np.where(rests & (measured["angle"] <= FLAT), memory["held"] + 1, 0)

    def _spending(self, worlds):
        """Part (n,) of the budget that the last action took [m g s]."""
        thrust = np.linalg.norm(worlds.wrench[:, 0, :3], axis=1)
        twist = np.linalg.norm(worlds.wrench[:, 0, 3:], axis=1) / REACH
        return self.control_dt * (thrust + twist) / worlds.weight[:, 0]

    def _is_spent(self, worlds):
        """Flags (n,) bool: less is left of the budget than one control step may take."""
        return worlds.memory["spent"] > BUDGET - self.control_dt * (THRUST + TWIST)

    def success(self, worlds):
        """Success: the block has rested on the target face for a quarter of a second."""
        return worlds.memory["held"] >= HOLD_STEPS

    def failure(self, worlds):
        """Failure: the block has rested on another face for a quarter of a second, and the budget is spent."""
        is_elsewhere = worlds.measured["angle"] > FLAT
        return self._is_spent(worlds) & (worlds.memory["still"] >= HOLD_STEPS) & is_elsewhere

    def rewards(self, worlds):
        """Gain of the potential, cost of a larger impact, cost of time, and bonus for success."""
        memory, value = worlds.memory, potential(worlds)
        terms = {
            "progress": value - memory["potential"],
            "peak": -PEAK_PRICE * (worlds.measured["peak"] - memory["peak"]),
            "time": np.full(len(worlds), -STEP_COST),
            "success": SUCCESS_BONUS * worlds.success,
        }
        memory["potential"][:], memory["peak"][:] = value, worlds.measured["peak"]
        return terms

    def goal_mark(self, world):
        """The target face, as the goal to highlight."""
        return {
            "goal_face": int(self.drawn["target_face"][world]),
            "reached": self.memory_arrays["held"][world] > 0,
        }


# --- controller -------------------------------------------------------------------------------------------
UP = np.array((0.0, 1.0, 0.0))
TURN_RATE = 4.0  # of the critically damped turn to the target [rad/s]
HALF_TURN = 1e-3  # sine of the rotation angle below which the rotation's axis is not determined
LATEST = 0.8  # mean deceleration over g at which braking begins; full thrust gives 1
TOUCHDOWN = 0.15  # desired speed at the floor [m/s]
MARGIN, CLOSEST = 0.05, 0.03  # gap at which the block should have that speed, and least distance for braking [m]
SIDEWAYS = 0.7  # time constant for braking horizontal motion [s]
TURNED = 0.25  # angle to the target below which the block descends [rad]
NEAR, LANDED = 0.3, 0.05  # gap below which a block that is not yet turned needs lift, and below which thrust ends [m]


def controller(observations: np.ndarray) -> np.ndarray:
    """Rotate the target face down during the fall, brake as late as thrust allows, and let go after the landing.

    Late braking spends least of the budget, since each second of thrust also carries the weight. The torque is that of
    a critically damped rotation, with the inertia of the block and the gyroscopic torque.

    Parameters
    ----------
    observations : (n, 23) float32

    Returns
    -------
    (n, 6) float32
    """
    seen = observations.astype(np.float64)
    velocity, spin, gap = 5.0 * seen[:, 13:16], 2.5 * seen[:, 16:19], 5.0 * seen[:, 19]
    angle, torque = _turn(seen[:, :9].reshape(-1, 3, 3), REACH * seen[:, 9:12], spin)
    is_turned = angle < TURNED
    falling = np.maximum(-velocity[:, 1], 0.0)
    brake = np.maximum(falling**2 - TOUCHDOWN**2, 0.0) / (2.0 * G * np.maximum(gap - MARGIN, CLOSEST))
    lift = np.where(brake > LATEST, np.minimum(1.0 + brake, THRUST), 0.0)
    lift = np.where((gap < NEAR) & ~is_turned, np.maximum(lift, 1.0), lift)
    aside = np.where(lift[:, None] > 0.0, -velocity[:, ::2] / (G * SIDEWAYS), 0.0)
    room = np.sqrt(np.maximum(THRUST**2 - lift**2, 0.05))  # a little even at full lift
    aside *= np.minimum(1.0, room / np.maximum(np.linalg.norm(aside, axis=1), 1e-9))[:, None]
    force = np.stack([aside[:, 0], lift, aside[:, 1]], axis=1)
    actions = np.concatenate([force / THRUST, torque / (TWIST * G * REACH)], axis=1)
    actions[is_turned & (gap < LANDED)] = 0.0
    return actions.clip(-1.0, 1.0).astype(np.float32)


def _turn(axes, half, spin):
    """Angle (n,) [rad] of the target face, and torque (n, 3) over the mass that turns it down [m²/s²].

    Parameters
    ----------
    axes : (n, 3, 3)
        Axes of the block, a row for each, the target face's normal first.
    half : (n, 3)
        Half edges along them [m].
    spin : (n, 3)
        [rad/s].
    """
    axis = np.cross(axes[:, 0], -UP)
    sine = np.linalg.norm(axis, axis=1, keepdims=True)
    axis = np.where(sine < HALF_TURN, axes[:, 1], axis / np.maximum(sine, HALF_TURN))
    angle = np.arctan2(sine, -axes[:, 0, 1:2])
    wanted = TURN_RATE**2 * angle * axis - 2.0 * TURN_RATE * spin
    square = half**2
    inertia = (square.sum(axis=1, keepdims=True) - square) / 3.0  # about the axes, over the mass [m²]

    def momentum(rate):
        return np.einsum("nij,ni->nj", axes, inertia * np.einsum("nij,nj->ni", axes, rate))

    return angle[:, 0], momentum(wanted) + np.cross(spin, momentum(spin))
