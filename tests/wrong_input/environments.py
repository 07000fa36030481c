"""Wrong input to environments: made, reset, stepped, read, closed."""

from __future__ import annotations

import gymnasium as gym
import numpy as np

import physics
from rigid_env import BlockReachEnv, BlockReachVectorEnv, BlockReorientVectorEnv
from tests.wrong_input.case import Case

STILL, NAN = np.zeros(6), np.full(6, np.nan)
MIXED = np.zeros((3, 6))
MIXED[2, 1] = np.inf

NOT_READY = (gym.error.ResetNeeded,)
CLOSED = (gym.error.ClosedEnvironmentError,)
NO_NAME = (AttributeError,)


def running_env() -> BlockReachEnv:
    """One that has made a few steps, with parameters drawn."""
    env = BlockReachEnv(mass=(4.0, 8.0))
    env.reset(seed=1)
    for _ in range(3):
        env.step(np.full(6, 0.3))
    return env


def running_batch() -> BlockReorientVectorEnv:
    """Likewise, three worlds."""
    envs = BlockReorientVectorEnv(3, friction=(0.3, 0.7))
    envs.reset(seed=1)
    for _ in range(3):
        envs.step(np.full((3, 6), 0.3))
    return envs


def ended_batch() -> BlockReachVectorEnv:
    """One whose episodes have ended, without autoreset."""
    envs = BlockReachVectorEnv(2, autoreset_mode="Disabled", max_episode_steps=1)
    envs.reset(seed=1)
    envs.step(np.zeros((2, 6)))
    return envs


def closed(thing):
    """The thing, closed."""
    thing.close()
    return thing


SUBJECTS = {
    "env": running_env,
    "batch": running_batch,
    "ended": ended_batch,
    "new-env": BlockReachEnv,
    "new-batch": lambda: BlockReachVectorEnv(2),
    "closed-env": lambda: closed(running_env()),
    "closed-batch": lambda: closed(running_batch()),
}


def state_of(env) -> tuple:
    """Everything that decides how an environment goes on."""
    task = env.task
    own = ("_ended", "_waiting", "_seeds", "_has_reset", "_np_random_seed", "max_episode_steps", "closed")
    return (
        task.world.kept(), task.world.params, task.world.gravity, task.world.time, task.wrench, task.record, task.obs,
        task.outcome, task.status, task.drawn, task.episodes.held, sorted(task.episodes.varying), task.steps,
        [generator and generator.bit_generator.state for generator in task.generators],
        [list(value) if isinstance(value, list) else value for value in (vars(env).get(name) for name in own)],
    )  # fmt: skip


CASES = [
    # --- made ---------------------------------------------------------------------------------------------
    Case("accuracy", lambda: BlockReachEnv(accuracy="exact"), ("accuracy", "'exact'", "balanced")),
    Case("acuracy", lambda: BlockReachEnv(acuracy="fast"), ("'acuracy'", "'fast'", "allowed are accuracy,")),
    Case(
        "make-acuracy",
        lambda: gym.make("rigid_env/BlockReach-v0", acuracy="fast"),
        ("'acuracy'", "'fast'", "allowed are accuracy,"),
    ),
    Case("batch-frictoin", lambda: BlockReorientVectorEnv(2, frictoin=0.1), ("'frictoin'", "0.1", "are friction,")),
    Case("threads-of-one", lambda: BlockReachEnv(threads=0), ("threads is 0", "at least 1")),
    Case("walls", lambda: BlockReachEnv(walls="four"), ("walls", "'four'", "'three', 'corner'")),
    Case("half-width", lambda: BlockReachEnv(half_width=2.0), ("half_width", "2.0", "more than 3.3")),
    Case("half-width-text", lambda: BlockReachEnv(half_width="wide"), ("half_width", "'wide'", "one number")),
    Case("mass-negative", lambda: BlockReachEnv(mass=-6), ("mass", "-6", "greater than 0")),
    Case("mass-three", lambda: BlockReachEnv(mass=(1, 2, 3)), ("mass", "(1, 2, 3)", "pair (low, high)")),
    Case("friction-range", lambda: BlockReachEnv(friction=(0.7, 0.3)), ("friction", "(0.7, 0.3)", "low at most high")),
    Case("friction-nan", lambda: BlockReachEnv(friction=np.nan), ("friction", "nan", "finite")),
    Case("restitution", lambda: BlockReachEnv(restitution=1.5), ("restitution", "1.5", "from 0 to 1")),
    Case("size-two", lambda: BlockReachEnv(size=(5, 3)), ("size", "(5, 3)", "3 numbers")),
    Case("gravity-zero", lambda: BlockReachEnv(gravity=0), ("gravity", "0", "greater than 0")),
    Case("frame-skip", lambda: BlockReachEnv(frame_skip=2.5), ("frame_skip", "2.5", "at least 1")),
    Case("dt-zero", lambda: BlockReachEnv(dt=0.0), ("dt", "0", "greater than 0")),
    Case("dt-text", lambda: BlockReachEnv(dt="short"), ("dt", "'short'", "one number")),
    Case("effects-number", lambda: BlockReachEnv(effects=3), ("effects", "3", "sequence of effects")),
    Case("effects-text", lambda: BlockReachEnv(effects=["Drag"]), ("effects", "'Drag'", "allowed")),
    Case(
        "effects-and-range",
        lambda: BlockReachEnv(effects=[physics.Friction(0.2)], friction=(0.1, 0.3)),
        ("effects", "Friction", "one of the two"),
    ),
    Case("render-mode", lambda: BlockReachEnv(render_mode="ansi"), ("render_mode", "'ansi'", "'rgb_array'")),
    Case("width", lambda: BlockReachEnv(width="960"), ("width", "'960'", "at least 1")),
    Case("camera", lambda: BlockReachEnv(camera=(0, 9, 20)), ("camera", "(0, 9, 20)", "a Camera, a dict")),
    Case("arrows", lambda: BlockReachVectorEnv(2, arrows="none"), ("arrows", "'none'", "True and False")),
    Case("num-envs-zero", lambda: BlockReachVectorEnv(0), ("num_envs", "0", "at least 1")),
    Case("num-envs-negative", lambda: BlockReachVectorEnv(-1), ("num_envs", "-1", "at least 1")),
    Case("num-envs-half", lambda: BlockReachVectorEnv(2.5), ("num_envs", "2.5", "at least 1")),
    Case("num-envs-text", lambda: BlockReachVectorEnv("4"), ("num_envs", "'4'", "at least 1")),
    Case(
        "make-vec-zero",
        lambda: gym.make_vec("rigid_env/BlockReach-v0", num_envs=0),
        ("num_envs", "0", "at least 1"),
    ),
    Case(
        "autoreset", lambda: BlockReachVectorEnv(2, autoreset_mode="Later"), ("autoreset_mode", "'Later'", "'NextStep'")
    ),
    Case(
        "episode-steps",
        lambda: BlockReachVectorEnv(2, max_episode_steps="many"),
        ("max_episode_steps", "'many'", "at least 1"),
    ),
    Case("threads-zero", lambda: BlockReachVectorEnv(2, threads=0), ("threads", "0", "at least 1")),
    Case("contacts-negative", lambda: BlockReachEnv(contacts=-1), ("contacts", "-1", "at least 0")),
    Case("contacts-half", lambda: BlockReachVectorEnv(2, contacts=1.5), ("contacts", "1.5", "at least 0")),
    Case("contacts-text", lambda: BlockReachEnv(contacts="a"), ("contacts", "'a'", "at least 0")),
    Case("contacts-many", lambda: BlockReachEnv(contacts=10**9), ("contacts", "1000000000", "0 to 65536")),
    Case("impacts-negative", lambda: BlockReachEnv(impacts=-1), ("impacts", "-1", "at least 0")),
    Case("impacts-text", lambda: BlockReachVectorEnv(2, impacts="a"), ("impacts", "'a'", "at least 0")),
    # --- stepped ------------------------------------------------------------------------------------------
    Case("step-first", lambda env: env.step(STILL), ("reset()", "step()"), "new-env", NOT_READY),
    Case("step-first-batch", lambda envs: envs.step(np.zeros((2, 6))), ("reset()", "step()"), "new-batch", NOT_READY),
    Case("step-ended", lambda envs: envs.step(np.zeros((2, 6))), ("[0, 1]", "reset_mask"), "ended", NOT_READY),
    Case("action-five", lambda env: env.step(np.zeros(5)), ("action", "(5,)", "(6,)"), "env"),
    Case("action-nan", lambda env: env.step(NAN), ("action", "nan", "finite"), "env"),
    Case("action-text", lambda env: env.step(["up"] * 6), ("action", "'up'", "numbers"), "env"),
    Case("action-none", lambda env: env.step(None), ("action", "()", "(6,)"), "env"),
    Case("action-ragged", lambda env: env.step([[1, 2], [3], 1, 2, 3, 4]), ("action", "[3]", "(6,)"), "env"),
    Case("actions-inf", lambda envs: envs.step(MIXED), ("action", "world 2", "inf", "finite"), "batch"),
    Case("actions-one", lambda envs: envs.step(STILL), ("actions", "(6,)", "(3, 6)"), "batch"),
    Case("actions-complex", lambda envs: envs.step(np.full((3, 6), 1j)), ("actions", "j", "numbers"), "batch"),
    # --- reset --------------------------------------------------------------------------------------------
    Case("options-list", lambda env: env.reset(options=["goal"]), ("options", "['goal']", "dict"), "env"),
    Case("option-gaol", lambda env: env.reset(options={"gaol": (1, 1)}), ("'gaol'", "allowed are goal,"), "env"),
    Case(
        "goal-outside",
        lambda env: env.reset(seed=3, options={"goal": (0, 11)}),
        ("goal", "(0, 11)", "-10 to 10"),
        "env",
    ),
    Case("goal-nan", lambda env: env.reset(options={"goal": (0, np.nan)}), ("goal", "nan", "finite"), "env"),
    Case("place-outside", lambda env: env.reset(options={"place": (0, -99)}), ("place", "-99", "-10 to 10"), "env"),
    Case(
        "place-in-wall",
        lambda env: env.reset(seed=3, options={"place": (9.9, 0)}),
        ("place", "9.9", "inside walls[2]"),
        "env",
    ),
    Case("yaw-inf", lambda env: env.reset(options={"yaw": np.inf}), ("yaw", "inf", "finite"), "env"),
    Case("face-seven", lambda env: env.reset(options={"face": 7}), ("face", "7", "from 0 to 5"), "env"),
    Case(
        "target-half", lambda envs: envs.reset(options={"target_face": 0.5}), ("target_face", "0.5", "0 to 5"), "batch"
    ),
    Case("mass-option", lambda env: env.reset(options={"mass": "7"}), ("mass", "'7'", "a number"), "env"),
    Case(
        "friction-option",
        lambda envs: envs.reset(seed=4, options={"friction": [0.1, 0.2, -1]}),
        ("friction", "-1", "at least 0"),
        "batch",
    ),
    Case("size-option", lambda env: env.reset(options={"size": (19, 9, 1)}), ("size", "19.0", "diagonal"), "env"),
    Case("seeds-two", lambda envs: envs.reset(seed=[1, 2]), ("seed", "2 entries", "3"), "batch"),
    Case("seed-text", lambda envs: envs.reset(seed="one"), ("seed", "'one'", "integer"), "batch"),
    Case("seed-negative", lambda envs: envs.reset(seed=[4, -1, 5]), ("seed", "-1", "at least 0"), "batch"),
    Case("seed-of-one", lambda env: env.reset(seed=-3), ("-3", "greater or equal"), "env", (gym.error.Error,)),
    Case(
        "mask-none-true",
        lambda envs: envs.reset(options={"reset_mask": np.zeros(3, bool)}),
        ("reset_mask", "False", "one True"),
        "batch",
    ),
    Case(
        "mask-list",
        lambda envs: envs.reset(options={"reset_mask": [True] * 3}),
        ("reset_mask", "[True", "(3,)"),
        "batch",
    ),
    # --- attributes ---------------------------------------------------------------------------------------
    Case("mass-attribute", lambda env: setattr(env, "mass", -2.0), ("mass", "-2", "greater than 0"), "env"),
    Case(
        "size-attribute",
        lambda envs: envs.set_attr("size", np.array([19.0, 1, 1])),
        ("size", "19.0", "inside walls"),
        "batch",
    ),
    Case("get-gravty", lambda envs: envs.get_attr("gravty"), ("'gravty'", "allowed are gravity,"), "batch", NO_NAME),
    Case("set-walls", lambda envs: envs.set_attr("walls", "corner"), ("'walls'", "allowed are"), "batch", NO_NAME),
    Case("set-two", lambda envs: envs.set_attr("mass", [1.0, 2.0]), ("mass", "2 values", "3"), "batch"),
    Case(
        "set-limits",
        lambda envs: envs.set_attr("max_episode_steps", [5, 6, 7]),
        ("max_episode_steps", "[5, 6, 7]", "the same"),
        "batch",
    ),
    Case("call-reset", lambda envs: envs.call("reset"), ("'reset'", "reset_mask"), "batch", NO_NAME),
    Case("call-mass", lambda envs: envs.call("mass", 3), ("(3,)", "'mass'", "none"), "batch"),
    # --- closed -------------------------------------------------------------------------------------------
    Case("closed-step", lambda env: env.step(STILL), ("step()", "close()", "new environment"), "closed-env", CLOSED),
    Case("closed-render", lambda env: env.render(), ("render()", "close()", "new environment"), "closed-env", CLOSED),
    Case(
        "closed-batch", lambda envs: envs.step(MIXED), ("step()", "close()", "new environment"), "closed-batch", CLOSED
    ),
    Case("closed-batch-reset", lambda envs: envs.reset(), ("reset()", "close()"), "closed-batch", CLOSED),
]
