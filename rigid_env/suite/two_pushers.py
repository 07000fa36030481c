"""TwoPushers: two agents bring one block to a place on the floor."""

from __future__ import annotations

from rigid_env.tasks import BlockReach, Wrench
from rigid_env.tasks.block import FORCE_SHARE, TORQUE_SHARE

AGENTS = ("left", "right")


class TwoPushers(BlockReach):
    """Bring a block to a place on the floor together with another agent, and leave it at rest there.

    ## Description

    The block, the box, the observation and the goal are those of `rigid_env/BlockReach-v0`. Two agents push and turn
    the block, each with half of the strength: their forces and torques add up. Neither can do much alone: friction
    holds against half of the force as long as the weight is on the floor. Both see the same and share the reward.
    `rigid_env.envs.pettingzoo.parallel_env("rigid_env/TwoPushers-v0")` has PettingZoo's parallel interface. Gymnasium
    takes the actions of both in one row, those of `left` first.

    ## Rewards

    Both agents get the reward of BlockReach: the gain of a potential, minus costs of both actions, plus a bonus for
    success.

    ## Starting State

    As of BlockReach: at rest on the floor on a random face, at a random place; the goal is another such place.

    ## Episode End

    Termination: success, which is a distance of at most 0.3 m, a speed of at most 0.1 m/s and a spin of at most 0.1
    rad/s on 10 control steps in a row. Truncation: after 300 control steps (7.5 s).

    ## Version History

    - v0: first version.
    """

    actions = tuple(Wrench(0, FORCE_SHARE / 2, TORQUE_SHARE / 2, agent=agent) for agent in AGENTS)
