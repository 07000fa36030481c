"""The environment `rigid_env/Scene-v0` and its documentation; `rigid_env.tasks.scene_task` is its task."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from numpy.typing import ArrayLike, NDArray

from physics import validation
from physics.keywords import known_keywords
from rigid_env.envs.arguments import CommonArguments, CountArgument, VectorArguments
from rigid_env.envs.env import RigidEnv
from rigid_env.envs.vector_arguments import episode_limit
from rigid_env.envs.vector_env import RigidVectorEnv
from rigid_env.tasks.arguments import EngineArguments, part, takes
from rigid_env.tasks.scene_settings import SceneArguments
from rigid_env.tasks.scene_task import SceneArgument, SceneTask


@dataclass(frozen=True)
class _SingleArguments(EngineArguments, SceneArguments, CommonArguments, SceneArgument):
    pass


@dataclass(frozen=True)
class _BatchArguments(EngineArguments, SceneArguments, VectorArguments, SceneArgument, CountArgument):
    pass


@known_keywords
class SceneEnv(RigidEnv[NDArray[Any]]):
    """Drive bodies of any scene, and bring one of them to a place.

    ## Description

    The scene comes from a file, by the name of a canonical scene, or as a `physics.Scene`. A force at the
    centre of mass and a torque act on each driven body. The table `[environment]` of the file has the
    settings; docs/scene-files.md lists its keys. World axes: x right, y up, z towards the viewer.

    ## Action Space

    `Box(-1, 1, (6 driven,), float32)`, held for one control step. Six numbers for each driven body, in
    their order in `driven`:

    | Num | Action | Min | Max | Unit |
    | --- | --- | --- | --- | --- |
    | 0 | force along x | -1 | 1 | 0.9 m g |
    | 1 | force along y | -1 | 1 | 0.9 m g |
    | 2 | force along z | -1 | 1 | 0.9 m g |
    | 3 | torque about x | -1 | 1 | 0.5 m g a |
    | 4 | torque about y | -1 | 1 | 0.5 m g a |
    | 5 | torque about z | -1 | 1 | 0.5 m g a |

    m is the mass of the body, g gravity (9.81 m/s² where there is none), a its reach: the longest half
    extent, of a hull the farthest along a body axis from the centre of mass. `force` and `torque` stand in
    place of 0.9 and 0.5; a limit of 0 takes its three numbers away. World frame, or the body's with
    `frame = "body"`. Each number is clipped to ±1, then force and torque vector are shortened to length 1
    where they are longer.

    ## Observation Space

    `Box` of 18 float32 for each body of the scene, in their order, and 3 of the goal if there is one. World
    frame. Each number is told in its unit and clipped to its bounds. R is the rotation matrix from body to world, by
    rows. With one body and a goal:

    | Num | Observation | Min | Max | Unit |
    | --- | --- | --- | --- | --- |
    | 0 | position x | -10 | 10 | 5 m |
    | 1 | position y | -10 | 10 | 5 m |
    | 2 | position z | -10 | 10 | 5 m |
    | 3 | linear velocity x | -10 | 10 | 5 m/s |
    | 4 | linear velocity y | -10 | 10 | 5 m/s |
    | 5 | linear velocity z | -10 | 10 | 5 m/s |
    | 6 | R[0, 0] | -1 | 1 | 1 |
    | 7 | R[0, 1] | -1 | 1 | 1 |
    | 8 | R[0, 2] | -1 | 1 | 1 |
    | 9 | R[1, 0] | -1 | 1 | 1 |
    | 10 | R[1, 1] | -1 | 1 | 1 |
    | 11 | R[1, 2] | -1 | 1 | 1 |
    | 12 | R[2, 0] | -1 | 1 | 1 |
    | 13 | R[2, 1] | -1 | 1 | 1 |
    | 14 | R[2, 2] | -1 | 1 | 1 |
    | 15 | angular velocity x | -10 | 10 | 5 rad/s |
    | 16 | angular velocity y | -10 | 10 | 5 rad/s |
    | 17 | angular velocity z | -10 | 10 | 5 rad/s |
    | 18 | goal 0 | -10 | 10 | 5 m |
    | 19 | goal 1 | -10 | 10 | 5 m |
    | 20 | goal 2 | -10 | 10 | 5 m |

    Positions are those of centres of mass. `length` [m] stands in place of 5 in `5 m` and `5 m/s`: choose it
    so that the scene is a few lengths wide.

    ## Rewards

    0 without a goal. With one, the gain of closeness in the step, plus a bonus. With d the distance of the
    goal's body from the goal [m] and t the tolerance [m], closeness is `-log(1 + d / t)`, so that a scene
    rewards the same at every scale. Success earns 5.

    ## Starting State

    Poses and velocities of the scene. `[environment.start]` has half widths of random variations, three numbers each.
    For every body, variations drawn uniformly within them are added to `pos` [m], `linvel` [m/s] and `angvel` [rad/s].
    A goal with `low` and `high` is drawn uniformly between them. `reset(options=...)` fixes draws for this episode:
    `goal` (three numbers), `start_pos`, `start_linvel`, `start_angvel` (three for each body). The other draws of a seed
    stay the same.

    ## Episode End

    Termination: success, which is a distance of at most `tolerance` and a speed of at most `speed`. Without a
    goal no episode terminates. Truncation: after `episode_steps`, by default `max_episode_steps` of the file.
    The argument `max_episode_steps` of `gymnasium.make` and `make_vec` can only make episodes shorter.

    `info` holds `is_success` and `physics_status`, a `physics.Status`: 0 when nothing went wrong in the step,
    contact problems above their tolerance included. With a goal also `distance` [m], `speed` [m/s], and the
    terms of the reward, `reward_progress` and `reward_success`, are in it. So are the draws of the episode:
    `goal`, `start_pos`, `start_linvel`, `start_angvel`.

    ## Arguments

    | Argument | Default | Meaning |
    | --- | --- | --- |
    | `scene` | None | scene file (.toml, .xml, .urdf) or its content, canonical scene, or `physics.Scene`; needed |
    | `driven` | None | names or indices of driven bodies; with one body in the scene that one |
    | `force` | None | longest force over the body's weight (0.9) |
    | `torque` | None | longest torque over weight times reach (0.5) |
    | `frame` | None | `"world"` (default) or `"body"`: frame of force and torque |
    | `length` | None | unit of lengths in observations (5) [m] |
    | `goal` | None | dict of `body`, `pos` (or `low` and `high`), `tolerance`, `speed` |
    | `start` | None | dict of `pos`, `linvel`, `angvel` |
    | `frame_skip` | None | physics steps per control step (5) |
    | `dt` | None | physics step (0.005) [s] |
    | `episode_steps` | None | control steps after which an episode is truncated, for the file's `max_episode_steps` |
    | `accuracy` | `"balanced"` | preset of the engine, a `physics.Accuracy`, or a dict of its settings |
    | `effects` | () | `physics` effects besides, or instead of the scene's of that class |
    | `dump_faults` | None | folder for what led to a state that was not finite (`rigid-env replay`) |
    | `threads` | 1 | threads that share a step of a batch; a single environment has one world, and one thread |
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

    From `driven` to `episode_steps` an argument takes the place of that key in the file; None leaves the file's, or the
    default in brackets.

    ## Version History

    - v0: first version.
    """

    @takes(_SingleArguments)
    def __init__(self, given: _SingleArguments) -> None:
        task = SceneTask(1, given.scene, **part(given, SceneArguments, EngineArguments))
        super().__init__(task, **part(given, CommonArguments))

    def _documented(self) -> type:
        return type(self)

    def step(self, action: ArrayLike) -> tuple[NDArray[Any], float, bool, bool, dict[str, Any]]:
        """Hold an action for one control step; as `RigidEnv.step`, but truncated at the limit of the task."""
        obs, reward, is_terminated, is_truncated, info = super().step(action)
        limit = self.task.max_episode_steps
        if limit is not None and self.task.steps[0] >= limit:
            is_truncated = True
        return obs, reward, is_terminated, is_truncated, info


@known_keywords
class SceneVectorEnv(RigidVectorEnv[NDArray[Any]]):
    """Many worlds of `SceneEnv`, which documents the task.

    Parameters
    ----------
    num_envs : int
    scene : physics.Scene, str, Path or mapping
    autoreset_mode, max_episode_steps, render_mode, width, height, camera, arrows, obs, obs_size, obs_stack,
    contacts, impacts
        As of `RigidVectorEnv`; `max_episode_steps` is `episode_steps` by default, and at most that.
    driven, force, torque, frame, length, goal, start, frame_skip, dt, episode_steps, accuracy, effects, dump_faults
        As of `SceneEnv`.
    threads : int
        Threads that share a step.

    Raises
    ------
    TypeError
        An unknown argument, with the known ones, the nearest first.
    ValueError
        Naming file, line and key or the argument, the value, and what is allowed.
    """

    @takes(_BatchArguments)
    def __init__(self, given: _BatchArguments) -> None:
        worlds = validation.count(given.num_envs, "num_envs")
        task = SceneTask(worlds, given.scene, **part(given, SceneArguments, EngineArguments))
        check_limit(given.max_episode_steps, task.max_episode_steps)
        super().__init__(task, **part(given, VectorArguments))

    def _one_limit(self, values: Any) -> int | None:
        limit = super()._one_limit(values)
        check_limit(limit, self.task.max_episode_steps)
        return limit


def check_limit(value: int | str | None, limit: int | None) -> None:
    """Refuse a time limit of a batch above that of its scene; Gymnasium cannot raise a single environment's, either."""
    if limit is None or isinstance(value, str):
        return
    steps = episode_limit(value)
    if steps is None or steps > limit:
        raise ValueError(
            f"max_episode_steps is {value}, and the scene's {limit}; allowed are at most {limit}, or another "
            "episode_steps, which takes the place of the file's"
        )
