"""BallJuggle: keep a ball bouncing on a block that hangs on springs, up to a given height."""

from __future__ import annotations

import numpy as np

import physics
from rigid_env.tasks import Entry, Task, Uniform, Wrench

G = 9.81  # [m/s²]
BLOCK, BALL = 0, 1  # bodies
SIDE, THICKNESS, BLOCK_MASS = 0.8, 0.2, 4.0  # [m], [m], [kg]
RADIUS, BALL_MASS = 0.08, 0.2  # [m], [kg]
TOUCHING = THICKNESS / 2 + RADIUS  # height of the ball's centre over that of a level block, when they touch [m]
RESTITUTION, FRICTION = (0.6, 0.9), 0.3
RATE = 5.0  # angular frequency of the block on its springs, vertically and sideways [rad/s]
DAMPING = 3.0  # of each spring [N s/m]
STRENGTH, TURNING = 2.0, 0.3  # longest force over the weight, longest torque over weight times half the side
WANTED = (0.7, 1.3)  # range of the wanted apex: height of the ball's centre over the block's place at rest [m]
TOLERANCE = 0.05  # largest error of an apex that counts [m]
CLEARANCE = 0.3  # least gap between ball and block at an apex that counts [m]
APEXES = 4  # consecutive apexes that make a success
FLYING = 0.02  # gap above which the ball's height and velocity give its apex [m]
RELEASE = (0.6, 1.0)  # range of the ball's height at the start [m]
ASIDE, DRIFT = 0.1, 0.15  # largest offset from the block's centre [m] and speed [m/s] at the start, x and z each
LENGTH, BALL_SPEED, BALL_SPIN = 1.0, 5.0, 10.0  # units of the observation [m], [m/s], [rad/s]
BLOCK_SPEED, BLOCK_SPIN, TILT = 2.0, 5.0, 0.5  # further units of the observation [m/s], [rad/s], [1]
PRICES = {"apex": 1.0, "aside": 0.5, "drift": 0.25, "tilt": 0.5}  # weights of the potential [1/m], [1/m], [s/m], [1]
APEX_BONUS = 0.5  # gain of the potential for each consecutive apex

# --- the controller ---------------------------------------------------------------------------------------
MOST_MIRROR = 0.6  # largest speed of the block over that of the ball
HEIGHT_GAIN, SPEED_GAIN = 200.0, 25.0  # gains of the block's vertical motion [1/s²], [1/s]
FOLLOW_GAIN, FOLLOW_DAMPING = 60.0, 14.0  # gains of the motion that keeps the block under the ball [1/s²], [1/s]
LEAN_BACK, LEAN_AGAINST = 0.06, 0.12  # tilt against an offset [1/m], against a drift [s/m]
TURN_GAIN, TURN_DAMPING = 150.0, 22.0  # [1/s²], [1/s]
# angular acceleration by the springs, per tilt [1/s²]
SPRING_TURN = (RATE * SIDE / 2) ** 2 / ((SIDE**2 + THICKNESS**2) / 12.0)


def springs():
    """Springs at the corners of the block's middle plane, stretched upwards so far that they carry its weight."""
    corners = [(x * SIDE / 2, z * SIDE / 2) for x in (-1, 1) for z in (-1, 1)]
    stiffness, stretch = BLOCK_MASS * RATE**2 / 4, G / RATE**2
    return [
        physics.Spring((x, stretch, z), (x, 0.0, z), stiffness=stiffness, damping=DAMPING, body=BLOCK)
        for x, z in corners
    ]


def gap(worlds):
    """Gap (n,) between the ball and the plane of the block's upper face [m]."""
    up = worlds.rotation[:, BLOCK, :, 1]
    return ((worlds.pos[:, BALL] - worlds.pos[:, BLOCK]) * up).sum(axis=1) - TOUCHING


def apex_ahead(worlds):
    """Height (n,) of the apex of the present flight, past or to come [m]; during contact that of the last flight."""
    height = worlds.pos[:, BALL, 1] + worlds.linvel[:, BALL, 1] ** 2 / (2.0 * G)
    return np.where(gap(worlds) > FLYING, height, worlds.memory["apex"])


class BallJuggle(Task):
    """Keep a ball bouncing on a block, up to a given height.

    ## Description

    A flat block of 4 kg hangs level on four springs at its corners, and a ball of 0.2 kg falls on it. The agent drives
    the block with a force of up to twice its weight, and tilts it with torques about x and z. The ball's restitution
    and the height that it is to reach differ from episode to episode, and the agent is told both. Heights are those of
    the ball's centre over the block's place at rest. A ball that meets the block at rest loses at least a third of its
    rise. A ball that drifts aside comes back only if the block tilts.

    ## Rewards

    `progress`: the gain of a potential, whose sum over an episode depends on its start and end alone. The potential is
    0.5 for each apex of the present run. It loses 1 per metre between the apex of the present flight and the wanted
    one. Sideways it loses 0.5 per metre between ball and block, and 0.25 per m/s of the ball. A tilt of the block
    costs 0.5 times one minus its cosine. `lost`: minus 1 for a lost ball. `success`: 2.

    ## Starting State

    The block is at rest at the origin. The ball is 0.6 to 1.0 m above and up to 0.1 m aside, along x and z each; it
    drifts at up to 0.15 m/s along each. Its restitution is 0.6 to 0.9. The wanted apex is at 0.7 to 1.3 m.

    ## Episode End

    Success once four apexes in a row were within 0.05 m of the wanted height. An apex breaks the row if it is farther
    away, or if the gap between ball and block is below 0.3 m: a ball that the block carries up and down does not count.
    Failure when the ball's centre is below that of the block. Truncation after 300 control steps (7.5 s). `info` holds
    `apex`, the height of the apex of the present flight [m].

    ## Version History

    - v0: first version.
    """

    scene = physics.Scene(
        bodies=[
            physics.Block(size=(SIDE, THICKNESS, SIDE), mass=BLOCK_MASS),
            physics.Sphere(radius=RADIUS, mass=BALL_MASS, pos=(0.0, 1.0, 0.0)),
        ],
        effects=[
            physics.Gravity((0.0, -G, 0.0)),
            physics.Contact(RESTITUTION[1]),
            physics.Friction(FRICTION),
            *springs(),
        ],
    )
    actions = Wrench(BLOCK, force=STRENGTH, torque=TURNING, torque_axes="xz")
    observation = [
        Entry(
            ("ball x minus block x", "ball y minus block y", "ball z minus block z"), "m", -3, 3,
            lambda w: w.pos[:, BALL] - w.pos[:, BLOCK], LENGTH,
        ),
        Entry(("ball velocity x", "ball velocity y", "ball velocity z"), "m/s", -5, 5,
              lambda w: w.linvel[:, BALL], BALL_SPEED),
        Entry(("ball spin x", "ball spin z"), "rad/s", -5, 5, lambda w: w.angvel[:, BALL, ::2], BALL_SPIN),
        Entry(("block x", "block y", "block z"), "m", -3, 3, lambda w: w.pos[:, BLOCK], LENGTH),
        Entry(("block velocity x", "block velocity y", "block velocity z"), "m/s", -5, 5,
              lambda w: w.linvel[:, BLOCK], BLOCK_SPEED),
        Entry(("block's upward axis x", "block's upward axis z"), "1", -2, 2,
              lambda w: w.rotation[:, BLOCK, ::2, 1], TILT),
        Entry(("block spin x", "block spin z"), "rad/s", -5, 5, lambda w: w.angvel[:, BLOCK, ::2], BLOCK_SPIN),
        Entry("apex minus wanted apex", "m", -3, 3, lambda w: w.memory["apex"] - w.drawn["wanted"], LENGTH),
        Entry("wanted apex", "m", 0, 3, lambda w: w.drawn["wanted"], LENGTH),
        Entry("restitution", "1", 0, 1, lambda w: w.drawn["restitution"]),
        Entry("share of the apexes in a row", "1", 0, 1, lambda w: w.memory["row"] / APEXES),
    ]  # fmt: skip
    draws = {
        "wanted": WANTED,
        "restitution": RESTITUTION,
        "release": RELEASE,
        "aside": Uniform((-ASIDE, -ASIDE), (ASIDE, ASIDE)),
        "drift": Uniform((-DRIFT, -DRIFT), (DRIFT, DRIFT)),
    }
    explanations = {
        "wanted": "wanted apex, a height over the block's place at rest [m]",
        "restitution": "restitution of ball and block",
        "release": "height of the ball's centre at the start [m]",
        "aside": "x and z of the ball at the start [m]",
        "drift": "velocity of the ball along x and z at the start [m/s]",
        "apex": "height of the apex of the present flight [m]",
        "reward_progress": "gain of the potential",
        "reward_lost": "-1 for a lost ball",
        "reward_success": "bonus for success",
    }
    memory = {"apex": 1, "rise": 1, "row": 1, "potential": 1}
    max_episode_steps = 300

    def place(self, drawn):
        """Start with the block at rest and the ball above it."""
        pos, linvel = np.zeros((2, len(drawn["release"]), 2, 3))
        pos[:, BALL, 1] = drawn["release"]
        pos[:, BALL, ::2], linvel[:, BALL, ::2] = drawn["aside"], drawn["drift"]
        return {"pos": pos, "linvel": linvel}

    def measure(self, worlds):
        """Height of the apex of the present flight."""
        return {"apex": apex_ahead(worlds)}

    def begin(self, worlds):
        """Store the apex of the first flight, and the potential of the start."""
        worlds.memory["apex"][:] = worlds.measured["apex"]
        worlds.memory["potential"][:] = self._potential(worlds)

    def update(self, worlds):
        """Count consecutive good apexes; an apex is a step at which the ball begins to fall."""
        memory, apex, speed = worlds.memory, worlds.measured["apex"], worlds.linvel[:, BALL, 1]
        memory["apex"][:] = apex
        is_apex = (memory["rise"] > 0.0) & (speed <= 0.0)
        is_good = (np.abs(apex - worlds.drawn["wanted"]) < TOLERANCE) & (gap(worlds) > CLEARANCE)
        memory["row"][:] = np.where(is_apex, np.where(is_good, memory["row"] + 1.0, 0.0), memory["row"])
        memory["rise"][:] = speed

    def success(self, worlds):
        """Success: enough consecutive apexes were near the wanted height."""
        return worlds.memory["row"] >= APEXES

    def failure(self, worlds):
        """Failure: the ball is below the block."""
        return worlds.pos[:, BALL, 1] < worlds.pos[:, BLOCK, 1]

    def _potential(self, worlds):
        """Potential (n,) whose gain is rewarded: bonus for consecutive apexes, minus costs."""
        aside = np.linalg.norm(worlds.pos[:, BALL, ::2] - worlds.pos[:, BLOCK, ::2], axis=1)
        drift = np.linalg.norm(worlds.linvel[:, BALL, ::2], axis=1)
        miss = np.abs(worlds.memory["apex"] - worlds.drawn["wanted"])
        lean = 1.0 - worlds.rotation[:, BLOCK, 1, 1]
        costs = PRICES["apex"] * miss + PRICES["aside"] * aside + PRICES["drift"] * drift + PRICES["tilt"] * lean
        return APEX_BONUS * worlds.memory["row"] - costs

    def rewards(self, worlds):
        """Gain of the potential, penalty for a lost ball, and bonus for success."""
        before, now = worlds.memory["potential"], self._potential(worlds)
        progress = now - before
        before[:] = now
        return {"progress": progress, "lost": -1.0 * worlds.failure, "success": 2.0 * worlds.success}

    def goal_mark(self, world):
        """Disc at the wanted apex, above the block."""
        x, _, z = self.world.pos[world, BLOCK]
        reached = abs(self.memory_arrays["apex"][world] - self.drawn["wanted"][world]) < TOLERANCE
        return {"pos": (x, self.drawn["wanted"][world], z), "radius": TOLERANCE, "reached": bool(reached)}


def mirror_ratio(apex, wanted, restitution):
    """Compute the ratio of the block's speed to the ball's for an impact that sends the ball to the wanted apex.

    A free block of mass M that rises at v strikes a ball of mass m that falls at u. Newton's restitution and the
    momentum give the ball's speed after it,

        w = (1 + e) M / (M + m) (u + v) - u,

    and w² = 2 g (wanted - h), u² = 2 g (apex - h), with h the height of the ball at impacts. A positive ratio means
    that the block rises.

    Parameters
    ----------
    apex, wanted, restitution : (n,) float
        Apex of the present flight [m], that of the next one [m], and e.

    Returns
    -------
    (n,) float
        Clipped to ±0.6.
    """
    fall, rise = (np.sqrt(np.maximum(height - TOUCHING, 0.05)) for height in (apex, wanted))
    ratio = (rise / fall + 1.0) * (1.0 + BALL_MASS / BLOCK_MASS) / (1.0 + restitution) - 1.0
    return ratio.clip(-MOST_MIRROR, MOST_MIRROR)


def controller(observations: np.ndarray) -> np.ndarray:
    """Move the block as the scaled mirror image of the ball, about the height at which they collide.

    The mirror law is that of M. Buehler, D. E. Koditschek and P. J. Kindlmann, "Planning and control of robotic
    juggling and catching tasks", International Journal of Robotics Research 13 (1994). The block stays under the ball,
    and leans against its drift.

    Parameters
    ----------
    observations : (n, 22) float32

    Returns
    -------
    (n, 5) float32
    """
    offset, velocity = LENGTH * observations[:, 0:3], BALL_SPEED * observations[:, 3:6]
    pos, speed = LENGTH * observations[:, 8:11], BLOCK_SPEED * observations[:, 11:14]
    up, spin = TILT * observations[:, 14:16], BLOCK_SPIN * observations[:, 16:18]
    wanted, restitution = LENGTH * observations[:, 19], observations[:, 20]
    ratio = mirror_ratio(LENGTH * observations[:, 18] + wanted, wanted, restitution)
    place = -ratio * (pos[:, 1] + offset[:, 1] - TOUCHING)
    lift = HEIGHT_GAIN * (place - pos[:, 1]) + SPEED_GAIN * (-ratio * velocity[:, 1] - speed[:, 1]) + ratio * G
    aside, drift = offset[:, ::2], velocity[:, ::2]
    follow = FOLLOW_GAIN * aside + FOLLOW_DAMPING * (drift - speed[:, ::2])
    force = np.stack([follow[:, 0], lift, follow[:, 1]], axis=1) + RATE**2 * pos  # cancels the springs' acceleration
    lean = -LEAN_BACK * aside - LEAN_AGAINST * drift
    turn = (TURN_GAIN * (lean - up) + SPRING_TURN * up)[:, ::-1] * (1.0, -1.0) - TURN_DAMPING * spin
    inertia = (SIDE**2 + THICKNESS**2) / 12.0
    actions = np.concatenate([force / (STRENGTH * G), inertia * turn / (TURNING * G * SIDE / 2)], axis=1)
    return actions.clip(-1.0, 1.0).astype(np.float32)
