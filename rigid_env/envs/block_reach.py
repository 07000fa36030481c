"""The environment `rigid_env/BlockReach-v0` and its documentation; `rigid_env.tasks.block_reach` is its task."""

from __future__ import annotations

from physics.keywords import known_keywords
from rigid_env.envs.block import BlockEnv, BlockVectorEnv
from rigid_env.tasks import BlockReach


@known_keywords
class BlockReachEnv(BlockEnv):
    """Bring a block to a place on the floor, and leave it at rest there.

    ## Description

    A block of 5 x 3 x 2 m and 6 kg lies on the floor of a box with three walls. The agent pushes and
    turns it with a force at its centre and a torque. The force is limited to 0.9 of the weight, so that
    the block cannot fly: it slides, tips and tumbles, with the walls to lean on. World axes: x right, y
    up, z towards the viewer.

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

    m is the mass of the block, g gravity, a its longest half edge. World frame; the torque is about the
    centre. Each number is clipped to ±1, then force and torque vector are shortened to length 1 where
    they are longer: their norms never exceed the units of the table.

    ## Observation Space

    `Box` of 24 float32, world frame. Each number is told in its unit and clipped to its bounds. R is the rotation
    matrix from body to world, by rows. Walls: the floor, then left and right (`three`), or x = 0 and z = 0 (`corner`).

    | Num | Observation | Min | Max | Unit |
    | --- | --- | --- | --- | --- |
    | 0 | goal x minus centre x | -10 | 10 | 5 m |
    | 1 | goal z minus centre z | -10 | 10 | 5 m |
    | 2 | tanh of (goal x minus centre x) / 1 m | -1 | 1 | 1 |
    | 3 | tanh of (goal z minus centre z) / 1 m | -1 | 1 | 1 |
    | 4 | height of the centre over the floor | 0 | 10 | 2.5 m |
    | 5 | linear velocity x | -5 | 5 | 5 m/s |
    | 6 | linear velocity y | -5 | 5 | 5 m/s |
    | 7 | linear velocity z | -5 | 5 | 5 m/s |
    | 8 | angular velocity x | -5 | 5 | 5 rad/s |
    | 9 | angular velocity y | -5 | 5 | 5 rad/s |
    | 10 | angular velocity z | -5 | 5 | 5 rad/s |
    | 11 | R[0, 0] | -1 | 1 | 1 |
    | 12 | R[0, 1] | -1 | 1 | 1 |
    | 13 | R[0, 2] | -1 | 1 | 1 |
    | 14 | R[1, 0] | -1 | 1 | 1 |
    | 15 | R[1, 1] | -1 | 1 | 1 |
    | 16 | R[1, 2] | -1 | 1 | 1 |
    | 17 | R[2, 0] | -1 | 1 | 1 |
    | 18 | R[2, 1] | -1 | 1 | 1 |
    | 19 | R[2, 2] | -1 | 1 | 1 |
    | 20 | gap between block and wall 0 | -1 | 10 | 5 m |
    | 21 | gap between block and wall 1 | -1 | 10 | 5 m |
    | 22 | gap between block and wall 2 | -1 | 10 | 5 m |
    | 23 | share of the hold completed | 0 | 1 | 1 |

    ## Rewards

    The gain of a potential, minus costs, plus a bonus. With d the horizontal distance of the centre from
    the goal [m], v its speed [m/s], and h the share of the hold completed, the potential is `-0.5 d - 0.2
    v exp(-d / 2) + h`. Each step costs 0.01 and 0.0005 times the sum of the squared action (after clipping
    to ±1). Success earns 5.

    ## Starting State

    At rest on the floor on a random face, with a random yaw, at a random place clear of the walls; the
    goal is another such place. All are drawn uniformly from the square `|x|, |z| <= half_width`
    (`corner`: `0 <= x, z <= 2 half_width`), less 0.25 m and half the block's diagonal on each side.
    `reset(options=...)` fixes draws for this episode: `place` (x, z) [m], `yaw` [rad], `face` (the face that is down, 0
    to 5 for -x, +x, -y, +y, -z, +z) and `goal` (x, z) [m]. Both places are inside the square. The parameters `mass`,
    `size`, `friction`, `restitution` and `gravity` can be fixed as well, randomised or not. The other draws of a seed
    stay the same.

    ## Episode End

    Termination: success, which is a distance of at most 0.3 m, a speed of at most 0.1 m/s and a spin of
    at most 0.1 rad/s on 10 control steps in a row. Truncation: after 300 control steps (7.5 s), by
    `gymnasium.make`.

    `info` holds `is_success`, `distance` [m], `speed` [m/s], `spin` [rad/s], and `physics_status`, a
    `physics.Status`: 0 when nothing went wrong in the step, contact problems above their tolerance included. The terms
    of the reward are in it, too: `reward_progress` is the gain of the potential, `reward_effort` the costs,
    `reward_success` the bonus. So are the draws of the episode: `place` [m], `yaw` [rad],
    `face`, `goal` [m], and the parameters `mass` [kg], `size` [m], `friction`, `restitution` and `gravity` [m/s²],
    except parameters that `effects` fix.

    ## Arguments

    | Argument | Default | Meaning |
    | --- | --- | --- |
    | `walls` | `"three"` | layout: `"three"` or `"corner"` |
    | `half_width` | 10.0 | half the width of the floor [m] |
    | `mass` | 6.0 | of the block [kg] |
    | `size` | (5.0, 3.0, 2.0) | edges of the block [m] |
    | `friction` | 0.5 | Coulomb coefficient against the walls |
    | `restitution` | 0.2 | of the block against the walls |
    | `gravity` | 9.81 | along -y [m/s²] |
    | `accuracy` | `"balanced"` | preset of the engine, a `physics.Accuracy`, or a dict of its settings |
    | `effects` | () | `physics` effects besides (`physics.Drag()`, ...), or instead of the task's of that class |
    | `dump_faults` | None | folder for what led to a state that was not finite (`rigid-env replay`) |
    | `threads` | 1 | threads that share a step of a batch; a single environment has one world, and one thread |
    | `frame_skip` | 5 | physics steps per control step |
    | `dt` | 0.005 | physics step [s] |
    | `render_mode` | None | `"rgb_array"`, `"human"` or None |
    | `width` | 960 | of pictures [px] |
    | `height` | 600 | of pictures [px] |
    | `obs` | `"state"` | observations: `"state"`, the table above, or `"pixels"`, pictures (uint8) |
    | `obs_size` | (84, 84) | height and width of these [px] |
    | `obs_stack` | 1 | of the last so many control steps, along the last axis, the newest last |
    | `contacts` | 0 | contacts told in `info`, those with the largest forces |
    | `impacts` | 0 | pairs that collided told in `info`: the largest impulses |
    | `camera` | None | of pictures: a `rigid_env.rendering.Camera`, or a dict of its parameters; None sees the room |
    | `arrows` | True | whether pictures show contacts, forces and torques |

    `mass`, `size`, `friction`, `restitution` and `gravity` take a pair (low, high) as well: each episode
    then draws its own value. Drawn parameters are not observed; only the edges show, in the gaps to the walls. The
    parameters are also attributes of the environment: a value set there holds in all later episodes.

    ## Version History

    - v0: first version.
    """

    task_class = BlockReach


@known_keywords
class BlockReachVectorEnv(BlockVectorEnv):
    """Many worlds of `BlockReachEnv`, which documents the task."""

    task_class = BlockReach
