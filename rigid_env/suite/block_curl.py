"""BlockCurl: push a stone for half a second, and let it slide to a mark."""

from __future__ import annotations

import numpy as np

import physics
from rigid_env.tasks import Distribution, Entry, Force, Task

G = 9.81  # [m/s²]
STRENGTH = 1.5  # longest force over the weight
PUSHED = 20  # control steps in which the agent pushes
CONTROL_DT = 0.025  # [s]
NEAREST, FARTHEST = 1.0, 4.0  # distance of the mark at the start [m]
FRICTION = (0.15, 0.4)
TOLERANCE = 0.2  # distance from the mark at rest that is a success [m]
AT_REST = 1e-3  # speed below which the stone has stopped [m/s]
HIT = 1.0  # reward of a hit
EFFORT_PRICE = 0.1  # weight of the integral of (force over weight)² [1/s]
LENGTH, SPEED = 5.0, 5.0  # units of the observation [m], [m/s]
HALVINGS = 50  # bisections of the interval in which the slide's duration is sought: 2^-50 of 10 s
LONGEST_SLIDE = 10.0  # [s]


class Ring(Distribution):
    """Places x, z on a ring about the origin, uniform over its area [m]."""

    length, uniforms = 2, 2

    def at(self, shares, drawn):
        """Convert uniform numbers (n, 2) to places (n, 2) [m]."""
        radius = np.sqrt(NEAREST**2 + (FARTHEST**2 - NEAREST**2) * shares[:, 0])
        angle = 2.0 * np.pi * shares[:, 1]
        return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)

    def describe(self):
        """Description of the distribution for tables."""
        return f"on a ring from {NEAREST:g} to {FARTHEST:g} m about the start"


def best_push(distance, speed, friction, left):
    """Compute the force that brings a stone to rest at a distance with the least effort.

    The solution is a closed form, apart from one root. Pushed for T = `left`, then sliding for a time s, the stone
    stops with v(T) = μ g s. Of all forces f(t) over the weight that stop it there, Lagrange's condition picks f(t) = κ
    ((T - t) + s), which decreases linearly; with

        μ g s = v + g κ T (T/2 + s) - μ g T
        distance = v T + g κ (T³/3 + s T²/2) - μ g T²/2 + μ g s²/2

    the first equation gives κ, and the second, which grows with s, gives s.

    Parameters
    ----------
    distance, speed, friction, left : (n,) float
        Distance to the mark [m], speed towards it [m/s], friction coefficient, and time left to push [s].

    Returns
    -------
    force : (n,) float
        Present force over the weight; negative to brake.
    effort : (n,) float
        Integral of the squared force over the weight until the push ends [s].
    """
    low, high = np.zeros_like(distance), np.full_like(distance, LONGEST_SLIDE)
    for _ in range(HALVINGS):
        slide = 0.5 * (low + high)
        rise = _rise(slide, speed, friction, left)
        way = speed * left + G * rise * left**2 * (left / 3 + slide / 2)
        way += 0.5 * friction * G * (slide**2 - left**2)
        is_short = way < distance
        low, high = np.where(is_short, slide, low), np.where(is_short, high, slide)
    rise = _rise(high, speed, friction, left)
    effort = rise**2 * ((left + high) ** 3 - high**3) / 3
    return rise * (left + high), effort


def _rise(slide, speed, friction, left):
    """κ of `best_push` [1/s]."""
    return (friction * (slide + left) - speed / G) / (left * (left / 2 + slide))


def best_return(goal, friction, duration):
    """Largest return of an episode whose mark is at `goal` (n, 2), with `friction` (n,), pushed for `duration` [s]."""
    distance = np.linalg.norm(goal, axis=1)
    _, effort = best_push(distance, np.zeros_like(distance), friction, np.full_like(distance, duration))
    return distance + HIT - EFFORT_PRICE * effort


def mark_offset(worlds):
    """Vector (n, 2) from the stone's centre to the mark, x and z [m]."""
    return worlds.drawn["goal"] - worlds.pos[:, 0, ::2]


def miss_offset(worlds):
    """Vector (n, 2) from the point where the stone would stop without a push to the mark, x and z [m]."""
    velocity = worlds.linvel[:, 0, ::2]
    speed = np.linalg.norm(velocity, axis=1, keepdims=True)
    return mark_offset(worlds) - velocity * speed / (2.0 * G * worlds.drawn["friction"][:, None])


class BlockCurl(Task):
    """Push a stone for half a second, so that it then slides to a mark and stops there.

    ## Description

    A flat block of 20 kg lies on a floor. For 20 control steps (0.5 s) the agent pushes it with a horizontal force of
    up to 1.5 times its weight, at the centre. Then it slides alone. Friction differs from episode to episode, and the
    agent is told it. The best push is known in closed form, so that every episode tells how far from it the agent was.

    ## Rewards

    `nearer`: the gain of minus the miss [m], the distance from the mark at which the stone would stop if the agent let
    it go now. `effort`: minus 0.1 times the integral of the squared force over the weight. `success`: 1 for a hit. The
    largest return is that of `best_return`: a hit with the least effort, for a force that changes freely in time.

    ## Starting State

    At rest at the origin. The mark is on a ring of 1 to 4 m, friction is 0.15 to 0.4.

    ## Episode End

    Once the stone has stopped after the push: success within 0.2 m of the mark, else failure. Truncation after 200
    control steps (5 s). `info` holds `distance` and `miss` [m], and `regret`: the largest return less the return so
    far; it is complete when the episode ends.

    ## Version History

    - v0: first version.
    """

    scene = physics.Scene(
        bodies=[physics.Block(size=(1.0, 0.4, 1.0), mass=20.0, pos=(0.0, 0.2, 0.0))],
        walls=[physics.HalfSpace((0.0, 1.0, 0.0), 0.0)],
        effects=[physics.Gravity((0.0, -G, 0.0)), physics.Contact(), physics.Friction(FRICTION[1])],
    )
    actions = Force(0, STRENGTH, axes="xz")
    observation = [
        Entry(("mark x minus centre x", "mark z minus centre z"), "m", -5, 5, mark_offset, LENGTH),
        Entry(("linear velocity x", "linear velocity z"), "m/s", -5, 5, lambda w: w.linvel[:, 0, ::2], SPEED),
        Entry("friction", "1", 0, 1, lambda w: w.drawn["friction"]),
        Entry("share of the push that is left", "1", 0, 1, lambda w: np.maximum(1.0 - w.steps / PUSHED, 0.0)),
    ]
    draws = {"goal": Ring(), "friction": FRICTION}
    explanations = {
        "goal": "x and z of the mark [m]",
        "distance": "distance from the mark [m]",
        "miss": "distance from the mark at which the stone would stop without a further push [m]",
        "regret": "largest return less the return so far",
        "reward_nearer": "decrease of the miss [m]",
        "reward_effort": "cost of the squared force",
        "reward_success": "bonus for success",
    }
    memory = {"effort": 1, "miss": 1}
    max_episode_steps = 200

    def measure(self, worlds):
        """Distance and miss [m], and the regret: largest possible return minus the return so far."""
        goal, friction = worlds.drawn["goal"], worlds.drawn["friction"]
        distance, miss = (np.linalg.norm(part, axis=1) for part in (mark_offset(worlds), miss_offset(worlds)))
        hit = np.where(self._has_stopped(worlds) & (distance < TOLERANCE), HIT, 0.0)
        gained = np.linalg.norm(goal, axis=1) - miss + hit - EFFORT_PRICE * worlds.memory["effort"]
        return {
            "distance": distance, "miss": miss,
            "regret": best_return(goal, friction, PUSHED * self.control_dt) - gained,
        }  # fmt: skip

    def begin(self, worlds):
        """Store the miss of a stone that is not pushed."""
        worlds.memory["miss"][:] = worlds.measured["miss"]

    def update(self, worlds):
        """Add the effort of this step, and set the limits of the actions to 0 after the push."""
        worlds.memory["effort"] += self._effort(worlds)
        self.limits[worlds.indices[worlds.steps >= PUSHED]] = 0.0

    def _effort(self, worlds):
        """Integral of the squared force over the weight in the last control step (n,) [s]."""
        return self.control_dt * ((worlds.wrench[:, 0, :3] / worlds.weight[:, :1]) ** 2).sum(axis=1)

    def _has_stopped(self, worlds):
        """Flags (n,) bool of stones that are at rest after the push."""
        return (worlds.steps >= PUSHED) & (np.linalg.norm(worlds.linvel[:, 0], axis=1) < AT_REST)

    def success(self, worlds):
        """Success: the stone has stopped on the mark."""
        return self._has_stopped(worlds) & (worlds.measured["distance"] < TOLERANCE)

    def failure(self, worlds):
        """Failure: the stone has stopped elsewhere."""
        return self._has_stopped(worlds) & (worlds.measured["distance"] >= TOLERANCE)

    def rewards(self, worlds):
        """Decrease of the miss, cost of the effort, and bonus for a hit."""
        before, now = worlds.memory["miss"], worlds.measured["miss"]
        nearer = before - now
        before[:] = now
        return {"nearer": nearer, "effort": -EFFORT_PRICE * self._effort(worlds), "success": HIT * worlds.success}

    def goal_mark(self, world):
        """Disc of the tolerance at the mark."""
        x, z = self.drawn["goal"][world]
        return {"pos": (x, 0.0, z), "radius": TOLERANCE, "reached": False}


def controller(observations: np.ndarray) -> np.ndarray:
    """Apply the best push, computed anew in each control step from the present state of the stone.

    Parameters
    ----------
    observations : (n, 6) float32

    Returns
    -------
    (n, 2) float32
    """
    offset, velocity = LENGTH * observations[:, 0:2], SPEED * observations[:, 2:4]
    left = observations[:, 5] * PUSHED * CONTROL_DT
    distance = np.maximum(np.linalg.norm(offset, axis=1), 1e-6)
    forward = offset / distance[:, None]
    speed = (velocity * forward).sum(axis=1)
    force, _ = best_push(distance, speed, observations[:, 4], np.maximum(left, CONTROL_DT))
    across = velocity - speed[:, None] * forward
    push = force[:, None] * forward - across / (G * CONTROL_DT)
    return (push / STRENGTH).clip(-1.0, 1.0).astype(np.float32)
