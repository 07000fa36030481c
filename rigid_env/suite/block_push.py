"""BlockPush: push a crate with another block to a place and a heading, and leave it at rest there."""

from __future__ import annotations

import numpy as np

import physics
from rigid_env.tasks import Entry, Task, Wrench

G = 9.81  # [m/s²]
PUSHER, CRATE = 0, 1  # bodies
PUSHER_SIZE, PUSHER_MASS = (0.5, 0.5, 1.0), 20.0  # its wide faces look along its x axis [m], [kg]
EDGE = 1.0  # edge of the crate [m]
FORCE, TORQUE = 0.9, 0.8  # longest force over the weight, longest torque over weight times half the longest edge
TOUCHING = 0.5 * (EDGE + PUSHER_SIZE[0])  # distance of the centres when faces touch [m]

# --- success ----------------------------------------------------------------------------------------------
NEAR, AHEAD = 0.15, 0.1  # errors of place [m] and heading [rad]
REST = 0.05  # speed [m/s] and spin [rad/s] of the crate
HOLD_STEPS = 10  # consecutive control steps
LOST = 6.0  # distance from the goal beyond which the episode fails [m]
TIPPED = 0.8  # cosine of the crate's tilt below which the episode fails

# --- rewards ----------------------------------------------------------------------------------------------
PLACE_VALUE, HEADING_VALUE = 0.5, 0.5  # potential lost per metre and per radian
FINE_VALUE, FINE_LENGTH, FINE_TURN = 0.4, 0.3, 0.2  # potential lost beyond these small errors [m], [rad]
REACH_VALUE = 0.2  # potential lost per metre between pusher and crate
HOLD_VALUE, STEP_COST, SUCCESS_BONUS = 1.0, 0.01, 5.0

# --- units of the observation -----------------------------------------------------------------------------
LENGTH, SPEED, SPIN, MASS = 2.0, 1.0, 2.0, 10.0  # [m], [m/s], [rad/s], [kg]


def place_of(vectors):
    """Horizontal parts of vectors (n, 3) as complex numbers (n,): real axis along x, imaginary axis along -z."""
    return vectors[:, 0] - 1j * vectors[:, 2]


def heading_of(worlds, body):
    """Direction of a body's x axis, exp(i yaw), (n,) complex."""
    axis = place_of(worlds.rotation[:, body, :, 0])
    return axis / np.maximum(np.abs(axis), 1e-12)


def seen(worlds, vectors):
    """Components (n, 2) of horizontal vectors (n,) complex in the pusher's frame: ahead and to the left."""
    turned = vectors * heading_of(worlds, PUSHER).conj()
    return np.stack([turned.real, turned.imag], axis=1)


def way_left(worlds):
    """Vector (n,) complex from the crate's centre to the goal, which is the origin [m]."""
    return -place_of(worlds.pos[:, CRATE])


def turn_left(worlds):
    """Rotation (n,) of the crate to the goal's heading, which is 0, in (-pi, pi] [rad]."""
    return np.angle(heading_of(worlds, CRATE).conj())


def side_angle(worlds):
    """Cosine and sine (n, 2) of four times the angle between crate and pusher, the same for all sides of the crate."""
    turn = (heading_of(worlds, CRATE) * heading_of(worlds, PUSHER).conj()) ** 4
    return np.stack([turn.real, turn.imag], axis=1)


def potential(worlds):
    """Potential (n,) of the states, whose gain is rewarded."""
    distance, turn = worlds.measured["distance"], worlds.measured["heading_error"]
    apart = np.abs(place_of(worlds.pos[:, CRATE]) - place_of(worlds.pos[:, PUSHER])) - TOUCHING
    error = PLACE_VALUE * distance + HEADING_VALUE * turn + REACH_VALUE * np.maximum(apart, 0.0)
    error += FINE_VALUE * (np.tanh(distance / FINE_LENGTH) + np.tanh(turn / FINE_TURN))
    return HOLD_VALUE * worlds.memory["held"] / HOLD_STEPS - error


class BlockPush(Task):
    """Push a crate with another block to a place and a heading, and leave it at rest there.

    ## Description

    A crate of 1 m stands on a floor, and beside it a low block of 1.0 x 0.5 x 0.5 m and 20 kg, the pusher. The agent
    drives the pusher alone, with a horizontal force of up to 0.9 times its weight and a torque about the vertical. Both
    act in the pusher's frame. The crate moves only where the pusher presses against it: it cannot be pulled. A push
    beside its centre turns it. What went too far is pushed back from another side. The goal is the origin and heading
    0. A heading that is a quarter turn off is wrong, although the crate looks the same.

    ## Rewards

    `progress`: the gain of the potential `h - d/2 - a/2 - 0.4 tanh(d / 0.3) - 0.4 tanh(a / 0.2) - 0.2 b`. Here d is the
    distance of the crate from its place [m], a its error of heading [rad] and h the share of the hold completed. b is
    the distance of the centres beyond 0.75 m, at which the two touch. `time`: -0.01 in each step. `success`: 5.

    ## Starting State

    Both are at rest on the floor. The crate is at a drawn distance and bearing from its place, with a drawn heading of
    up to 0.8 rad. The pusher stands behind it, as seen from the goal, up to 0.5 rad astray, and faces it up to 0.5 rad
    askew. Mass of the crate and friction are drawn, too, and the agent is told both. `draws` widens the starts:
    `draws={"astray": (-3.1, 3.1), "heading": (-3.1, 3.1)}` puts the pusher anywhere and turns the crate at will.

    ## Episode End

    Success: on 10 control steps in a row the crate is within 0.15 m of its place and 0.1 rad of its heading. Its speed
    is at most 0.05 m/s then, its spin at most 0.05 rad/s. Failure: the crate has tipped by more than 0.64 rad, or is
    more than 6 m from its place. Truncation after 300 control steps (15 s). `info` holds `distance` [m],
    `heading_error` [rad], `speed` [m/s] and `spin` [rad/s] of the crate.

    ## Version History

    - v0: first version.
    """

    scene = physics.Scene(
        bodies=[
            physics.Block(size=PUSHER_SIZE, mass=PUSHER_MASS, pos=(-2.0, 0.5 * PUSHER_SIZE[1], 0.0)),
            physics.Block(size=(EDGE, EDGE, EDGE), mass=MASS, pos=(0.0, 0.5 * EDGE, 0.0)),
        ],
        walls=[physics.HalfSpace((0.0, 1.0, 0.0), 0.0)],
        effects=[physics.Gravity((0.0, -G, 0.0)), physics.Contact(), physics.Friction(0.5)],
    )
    actions = Wrench(PUSHER, FORCE, TORQUE, force_axes="xz", torque_axes="y", frame="body")
    observation = [
        Entry(("crate ahead of the pusher", "crate to the left of the pusher"), "m", -5, 5,
              lambda w: seen(w, place_of(w.pos[:, CRATE] - w.pos[:, PUSHER])), LENGTH),
        Entry(("goal ahead of the crate", "goal to the left of the crate"), "m", -5, 5,
              lambda w: seen(w, way_left(w)), LENGTH),
        Entry(("tanh of (goal ahead of the crate / 0.3 m)", "tanh of (goal to the left / 0.3 m)"), "1", -1, 1,
              lambda w: np.tanh(seen(w, way_left(w)) / FINE_LENGTH)),
        Entry("turn that is left", "rad", -1, 1, turn_left, np.pi),
        Entry("tanh of (turn that is left / 0.2 rad)", "1", -1, 1, lambda w: np.tanh(turn_left(w) / FINE_TURN)),
        Entry(("cosine of four times the angle between crate and pusher", "sine of it"), "1", -1, 1, side_angle),
        Entry(("pusher's velocity ahead", "pusher's velocity to the left"), "m/s", -5, 5,
              lambda w: seen(w, place_of(w.linvel[:, PUSHER])), SPEED),
        Entry(("crate's velocity ahead", "crate's velocity to the left"), "m/s", -5, 5,
              lambda w: seen(w, place_of(w.linvel[:, CRATE])), SPEED),
        Entry(("pusher's spin", "crate's spin"), "rad/s", -5, 5, lambda w: w.angvel[:, :, 1], SPIN),
        Entry("share of the hold completed", "1", 0, 1, lambda w: w.memory["held"] / HOLD_STEPS),
        Entry("mass of the crate", "kg", 0, 5, lambda w: w.drawn["mass[1]"], MASS),
        Entry("friction", "1", 0, 1, lambda w: w.drawn["friction"]),
    ]  # fmt: skip
    draws = {
        "mass[1]": (4.0, 10.0),
        "friction": (0.3, 0.5),
        "away": (0.5, 2.5),
        "bearing": (-np.pi, np.pi),
        "heading": (-0.8, 0.8),
        "apart": (1.3, 2.0),
        "astray": (-0.5, 0.5),
        "yaw": (-0.5, 0.5),
    }
    explanations = {
        "away": "distance from the goal to the crate at the start [m]",
        "bearing": "direction from the crate to the goal at the start [rad]",
        "heading": "heading of the crate at the start [rad]",
        "apart": "distance from the crate to the pusher at the start [m]",
        "astray": "angle of the pusher off the line from goal to crate, at the crate [rad]",
        "yaw": "angle of the pusher's heading off the direction to the crate [rad]",
        "distance": "distance of the crate from its place [m]",
        "heading_error": "error of the crate's heading [rad]",
        "speed": "speed of the crate [m/s]",
        "spin": "length of the crate's angular velocity [rad/s]",
        "reward_progress": "gain of the potential",
        "reward_time": "cost of time",
        "reward_success": "bonus for success",
    }
    memory = {"held": 1, "potential": 1}
    max_episode_steps = 300

    def __init__(self, worlds: int = 1, *, frame_skip=5, dt=0.01, **settings):
        super().__init__(worlds, frame_skip=frame_skip, dt=dt, **settings)

    def place(self, drawn):
        """Place the crate at the drawn distance from the goal, and the pusher behind it."""
        count = len(drawn["away"])
        crate = -drawn["away"] * np.exp(1j * drawn["bearing"])
        ahead = drawn["bearing"] + drawn["astray"]
        pusher = crate - drawn["apart"] * np.exp(1j * ahead)
        pos, quat = np.zeros((count, 2, 3)), np.zeros((count, 2, 4))
        halves = 0.5 * np.stack([ahead + drawn["yaw"], drawn["heading"]], axis=1)
        quat[:, :, 0], quat[:, :, 2] = np.cos(halves), np.sin(halves)
        for body, at in ((PUSHER, pusher), (CRATE, crate)):
            pos[:, body, 0], pos[:, body, 2] = at.real, -at.imag
        pos[:, :, 1] = 0.5 * PUSHER_SIZE[1], 0.5 * EDGE
        return {"pos": pos, "quat": quat}

    def measure(self, worlds):
        """Errors of the crate's place and heading, and its speed and spin."""
        return {
            "distance": np.abs(way_left(worlds)),
            "heading_error": np.abs(turn_left(worlds)),
            "speed": np.linalg.norm(worlds.linvel[:, CRATE], axis=1),
            "spin": np.linalg.norm(worlds.angvel[:, CRATE], axis=1),
        }

    def begin(self, worlds):
        """Store the potential of the start."""
        worlds.memory["potential"][:] = potential(worlds)

    def update(self, worlds):
        """Count the consecutive steps in which all conditions of success hold."""
        measured, held = worlds.measured, worlds.memory["held"]
        is_met = (measured["distance"] <= NEAR) & (measured["heading_error"] <= AHEAD)
        is_met &= (measured["speed"] <= REST) & (measured["spin"] <= REST)
        held[:] = np.where(is_met, held + 1, 0)

    def success(self, worlds):
        """Success: the crate has held the pose at rest for half a second."""
        return worlds.memory["held"] >= HOLD_STEPS

    def failure(self, worlds):
        """Failure: the crate has tipped or is far away."""
        return (worlds.rotation[:, CRATE, 1, 1] < TIPPED) | (worlds.measured["distance"] > LOST)

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
        """Disc at the goal."""
        return {"pos": (0.0, 0.0, 0.0), "radius": 0.5, "reached": bool(self.memory_arrays["held"][world] > 0)}


# --- controller -------------------------------------------------------------------------------------------
FACES = np.exp(0.5j * np.pi * np.arange(4))  # directions in which the four sides are pushed, crate's frame
# distance to the goal below which its direction counts less [m], preference for the present side
NEAREST, KEEP = 0.15, 0.5
# error of the heading that is not corrected [rad], errors at which the controller stops [m], [rad]
TURNED, ARRIVED, AIMED = 0.05, 0.1, 0.07
RING, ROUND = 1.45, 0.9  # radius of the path around the crate [m], bearing beyond which the pusher takes it [rad]
# gap in which the pusher lines up [m], largest errors of place [m] and heading [rad] before it pushes
STANDOFF, LINED, LEVELLED = 0.2, 0.12, 0.15
ASIDE, ASIDE_GAIN = 0.5, 2.5  # largest offset of a push that rotates the crate [m], offset per rotation [m/rad]
# largest rotation of the pusher beyond the crate's side [rad], and its ratio to the crate's remaining rotation
LEAD, LEAD_GAIN = 0.35, 0.5
# distance [m] and speed [m/s] of a push that rotates the crate, deceleration [m/s²]
PUSH_LENGTH, PUSH_SPEED, BRAKING = 0.3, 0.8, 2.0
FORCE_GAIN, TORQUE_GAIN, SPIN_ARM = 0.4, 0.15, 0.3  # [m g s/m], [m g s], mean arm of the floor's friction [m]


def controller(observations: np.ndarray) -> np.ndarray:
    """Move to the side of the crate that must be pushed, line up, and push, off the centre to rotate the crate.

    The known friction forces of floor and crate are added to the force of the action.

    Parameters
    ----------
    observations : (n, 19) float32

    Returns
    -------
    (n, 3) float32
    """
    numbers = observations.astype(np.float64)
    crate, way = LENGTH * _plane(numbers, 0), LENGTH * _plane(numbers, 2)
    turn, velocity, spin = np.pi * numbers[:, 6], SPEED * _plane(numbers, 10), SPIN * numbers[:, 14]
    mass, friction = MASS * numbers[:, 17], numbers[:, 18]
    ahead, left = _side(crate, way, np.angle(_plane(numbers, 8)) / 4)
    turn_error = np.angle(ahead**2) / 2  # the pusher's two wide faces are alike
    wanted, is_pushing, is_touching = _motion(-crate / ahead, left, turn, turn_error)
    wanted, is_done = wanted * ahead, (np.abs(way) < ARRIVED) & (np.abs(turn) < AIMED)
    load = friction * (1.0 + is_pushing * mass / PUSHER_MASS)
    force = FORCE_GAIN * (wanted - velocity) + load * wanted / np.maximum(np.abs(wanted), 0.05)
    lead = is_touching * np.clip(LEAD_GAIN * turn, -LEAD, LEAD)
    turning = np.clip(4.0 * (turn_error + lead), -2.5, 2.5)
    torque = TORQUE_GAIN * (turning - spin) + friction * SPIN_ARM * np.clip(turning / 0.2, -1.0, 1.0)
    force, torque = np.where(is_done, -FORCE_GAIN * velocity, force), np.where(is_done, 0.0, torque)
    actions = np.stack([force.real / FORCE, -force.imag / FORCE, 2.0 * torque / TORQUE], axis=1)
    return actions.clip(-1.0, 1.0).astype(np.float32)


def _plane(numbers, k):
    """Observed numbers k and k + 1 as complex numbers (n,)."""
    return numbers[:, k] + 1j * numbers[:, k + 1]


def _side(crate, way, angle):
    """Direction (n,) complex in which the best side is pushed, and the distance (n,) still to go along it [m]."""
    sides = np.exp(1j * angle)[:, None] * FACES
    left, behind = ((vector[:, None] * sides.conj()).real for vector in (way, crate / np.abs(crate)))
    worth = left / np.maximum(np.abs(way), NEAREST)[:, None] + KEEP * behind
    best = np.arange(len(way)), worth.argmax(axis=1)
    return sides[best], left[best]


def _motion(place, left, turn, turn_error):
    """Velocity (n,) complex of the pusher [m/s], and flags (n,): it may push, and it touches the right side.

    Parameters
    ----------
    place : (n,) complex
        Pusher relative to the crate; the real axis is the direction of the push [m].
    left, turn, turn_error : (n,) float
        Distance still to push [m], remaining rotation of the crate, and the pusher's rotation to face the side [rad].
    """
    is_turning = np.abs(turn) > TURNED
    aside = np.where(is_turning, -np.clip(ASIDE_GAIN * turn, -ASIDE, ASIDE), 0.0) - place.imag
    bearing, radius = np.angle(-place), np.abs(place)
    is_round = (np.abs(bearing) > ROUND) | (place.real > -0.8 * TOUCHING)
    along = -1j * np.sign(bearing) * np.minimum(1.0, 2.0 * np.abs(bearing))
    around = (2.0 * along + 3.0 * (RING - radius)) * place / radius
    is_touching = ~is_round & (place.real > -TOUCHING - 0.06)
    is_ready = is_touching | ((np.abs(aside) < LINED) & (np.abs(turn_error) < LEVELLED))
    gap = -TOUCHING - place.real - np.where(is_ready, 0.0, STANDOFF)
    length = np.maximum(left, PUSH_LENGTH * is_turning)
    push = np.minimum(1.5 * length + 0.1, np.sqrt(2.0 * BRAKING * np.maximum(length, 0.0)))
    push = np.clip(push, 0.0, np.where(is_turning, PUSH_SPEED, 1.2))
    push = np.where(gap > 0.03, np.clip(3.0 * gap, 0.2, 1.5), push)
    line = np.where(is_ready, push, np.clip(3.0 * gap, -1.5, 1.5)) + 1j * np.clip(3.0 * aside, -1.0, 1.0)
    return np.where(is_round, around, line), ~is_round & (gap < 0.05), is_touching
