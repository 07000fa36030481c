"""The environment `rigid_env/BlockReorient-v0` and its documentation; `rigid_env.tasks.block_reorient` is its task."""

from __future__ import annotations

from physics.keywords import known_keywords
from rigid_env.envs.block import BlockEnv, BlockVectorEnv
from rigid_env.tasks import BlockReorient


@known_keywords
class BlockReorientEnv(BlockEnv):
    """Turn a block so that a given face is down, and leave it at rest.

    ## Description

    The block and the box are those of `BlockReachEnv`. One of the block's faces is to be turned down, at any place on
    the floor. The torque alone tips the block over its shortest half edge only. Tipping it over the other half edges
    takes the force's help, momentum, or a wall.

    ## Action Space

    `Box(-1, 1, (6,), float32)`, held for one control step (25 ms).

    | Num | Action | Min | Max | Unit |
    | --- | --- | --- | --- | --- |
    | 0 | force along x | -1 | 1 | 0.9 m g |
    | 1 | force along y | -1 | 1 | 0.9 m g |
    | 2 | force along z | -1 | 1 | 0.9 m g |
    | 3 | torque about x | -1 | 1 | 0.5 m g a |
    | 4 | torque about y | -1 | 1 | 0.5 m g a |
    | 5 | torque about z | -1 | 1 | 0.5 m g a |

    As in `BlockReachEnv`: m mass, g gravity, a longest half edge; vectors longer than 1 are shortened to
    1.

    ## Observation Space

    `Box` of 23 float32, world frame. Each number is told in its unit and clipped to its bounds. The body axes are
    ordered from the target face. The outward normal of the target face comes first, then the next two body axes in
    cyclic order (x, y, z, x, ...). The half edges along the three follow.

    | Num | Observation | Min | Max | Unit |
    | --- | --- | --- | --- | --- |
    | 0 | outward normal of the target face, x | -1 | 1 | 1 |
    | 1 | outward normal of the target face, y | -1 | 1 | 1 |
    | 2 | outward normal of the target face, z | -1 | 1 | 1 |
    | 3 | next body axis, x | -1 | 1 | 1 |
    | 4 | next body axis, y | -1 | 1 | 1 |
    | 5 | next body axis, z | -1 | 1 | 1 |
    | 6 | body axis after that, x | -1 | 1 | 1 |
    | 7 | body axis after that, y | -1 | 1 | 1 |
    | 8 | body axis after that, z | -1 | 1 | 1 |
    | 9 | half edge along normal | 0 | 10 | 2.5 m |
    | 10 | half edge along next | 0 | 10 | 2.5 m |
    | 11 | half edge along last | 0 | 10 | 2.5 m |
    | 12 | height of the centre over the floor | 0 | 10 | 2.5 m |
    | 13 | linear velocity x | -5 | 5 | 5 m/s |
    | 14 | linear velocity y | -5 | 5 | 5 m/s |
    | 15 | linear velocity z | -5 | 5 | 5 m/s |
    | 16 | angular velocity x | -5 | 5 | 5 rad/s |
    | 17 | angular velocity y | -5 | 5 | 5 rad/s |
    | 18 | angular velocity z | -5 | 5 | 5 rad/s |
    | 19 | gap between block and wall 0 | -1 | 10 | 5 m |
    | 20 | gap between block and wall 1 | -1 | 10 | 5 m |
    | 21 | gap between block and wall 2 | -1 | 10 | 5 m |
    | 22 | share of the hold completed | 0 | 1 | 1 |

    ## Rewards

    The gain of a potential, minus costs, plus a bonus. The potential is `-2 a - 0.1 (v + w) exp(-a / 0.3) + h`.
    Here a is the angle between the target face's normal and straight down [rad], v the speed [m/s], w the
    spin [rad/s] and h the share of the hold completed. Each step costs 0.01 and 0.0005 times the sum
    of the squared action (after clipping to ±1). Success earns 5.

    ## Starting State

    As in `BlockReachEnv`; the target is one of the five faces that are not down. `reset(options=...)`
    takes `place`, `yaw`, `face`, the parameters, and `target_face`.

    ## Episode End

    Termination: success, which is an angle of at most 0.1 rad, a speed of at most 0.1 m/s and a spin of
    at most 0.1 rad/s on 10 control steps in a row. Truncation: after 300 control steps (7.5 s), by
    `gymnasium.make`.

    `info` holds `is_success`, `angle` [rad], `speed` [m/s], `spin` [rad/s], and `physics_status`, a
    `physics.Status`: 0 when nothing went wrong in the step, contact problems above their tolerance included. The terms
    of the reward are in it, too: `reward_progress` is the gain of the potential, `reward_effort` the costs,
    `reward_success` the bonus. So are the draws of the episode: `place` [m], `yaw` [rad],
    `face`, `target_face`, and the parameters `mass` [kg], `size` [m], `friction`, `restitution` and `gravity` [m/s²],
    except parameters that `effects` fix.

    ## Arguments

    Those of `BlockReachEnv`, with the same defaults.

    ## Version History

    - v0: first version.
    """

    task_class = BlockReorient


@known_keywords
class BlockReorientVectorEnv(BlockVectorEnv):
    """Many worlds of `BlockReorientEnv`, which documents the task."""

    task_class = BlockReorient
