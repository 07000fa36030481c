"""MuJoCo twins of environments: our observations, rewards, success, starts and draws; MuJoCo computes the motion.

A twin is an environment of `rigid_env` whose task has `MuJoCoSteps` in place of `rigid_env.tasks.steps.Steps`. This
module registers twins with Gymnasium: `twins/BlockReach-v0` is that of `rigid_env/BlockReach-v0`. Arguments are those
of the original, and ``setting``, a key of `SETTINGS`. Masses may be drawn; the other parameters are the scene's.
"""

from __future__ import annotations

import copy
from typing import Any

import gymnasium as gym
import mujoco
import numpy as np

import physics
from physics.kernels.half_space.gap_queries import write_angular_momenta
from physics.kernels.state import layout as at
from physics.parallel.bound_call import bound
from physics.parallel.team import listed
from rigid_env.lab.measure.peers.mujoco import BOUNCING, model_xml
from rigid_env.tasks import Task

ORIGINALS = ("rigid_env/BlockReach-v0", "rigid_env/BlockReorient-v0", "rigid_env/BlockStack-v0")

EFFECTS = (physics.Gravity, physics.Contact, physics.Friction)
"""Effects of scenes that `model_xml` gives to MuJoCo."""

_OF_MASS = {at.INV_MASS, *range(at.INV_INERTIA, at.INV_INERTIA + 3), *range(at.SERIES, at.SERIES + at.SERIES_SIZE)}
OF_MASS = np.isin(np.arange(at.PARAM_SIZE), list(_OF_MASS))
"""(columns,) bool: parameters of a body that change with its mass. Those of its size do not."""

SETTINGS: dict[str, dict[str, Any]] = {"default": {}, "best": BOUNCING["one-step, k 0.03/h²"]}
"""Options of `model_xml` by the name of a setting; `best` is the setting that rebounds and sinks in least."""


def twin_id(env: str) -> str:
    """Id of the twin of an environment.

    Raises
    ------
    ValueError
        The environment has no twin.
    """
    if env not in ORIGINALS:
        raise ValueError(f"env is {env!r}, without a twin; allowed are {', '.join(ORIGINALS)}")
    return env.replace("rigid_env/", "twins/")


def make_env(of: str, setting: str = "default", **arguments: Any) -> gym.Env:
    """Make the single twin of the environment with the id `of`; the other arguments are those of the original."""
    env = gym.make(of, disable_env_checker=True, **arguments).unwrapped
    hand_motion(env.task, setting)
    return env


def make_batch(of: str, num_envs: int, setting: str = "default", **arguments: Any) -> gym.vector.VectorEnv:
    """Make a batch of twins of the environment with the id `of`; the other arguments are those of the original."""
    env = gym.make_vec(of, num_envs=num_envs, vectorization_mode="vector_entry_point", **arguments)
    hand_motion(env.task, setting)
    return env


def hand_motion(task: Task, setting: str = "default") -> None:
    """Let MuJoCo compute the motion of a task from now on.

    Parameters
    ----------
    task : Task
    setting : str
        Key of `SETTINGS`.

    Raises
    ------
    ValueError
        An unknown setting, or a task with parts that MuJoCo does not get.
    """
    if setting not in SETTINGS:
        raise ValueError(f"setting is {setting!r}; allowed are {', '.join(SETTINGS)}")
    _check(task)
    task._advance = steps = MuJoCoSteps(task, SETTINGS[setting])
    task.world.read_contact_sums = steps.read_contact_sums  # type: ignore[method-assign]  # MuJoCo has them


def _check(task: Task) -> None:
    """Raise a ValueError for a task with parts that MuJoCo does not get."""
    name, scene = type(task).__name__, task.world.scene
    odd = [type(effect).__name__ for effect in scene.effects if not isinstance(effect, EFFECTS)]
    if odd:
        allowed = ", ".join(effect.__name__ for effect in EFFECTS)
        raise ValueError(f"effects of {name} contain {', '.join(odd)}; allowed in a twin are {allowed}")
    contact = scene.effect(physics.Contact)
    if contact is not None and (contact.stiffness is not None or contact.tangential is not None):
        raise ValueError(f"effects of {name} contain {contact}; allowed in a twin is rigid contact without tangential")
    if task.has_impulses:
        raise ValueError(f"actions of {name} contain impulses; allowed in a twin are forces and torques")
    if task.disturbed is not None:
        raise ValueError(f"disturbances of {name} are declared; allowed in a twin are none")
    if task.world.actuation is not None:
        raise ValueError(f"effects of {name} contain an actuator; allowed in a twin are none")


class MuJoCoSteps:
    """Steps of MuJoCo in place of the physics steps of a control step; a stand-in for `rigid_env.tasks.steps.Steps`.

    A world whose state was written from outside, by the start of an episode or a restored state, first goes to MuJoCo,
    which forgets its warm start then. After the steps MuJoCo's state is written into the world, and a compiled task
    observes it.

    Parameters
    ----------
    task : Task
        Task with forces and torques as actions; its sizes, friction, restitution and gravity stay the scene's.
    options : dict
        Options of `rigid_env.lab.measure.peers.mujoco.model_xml`.

    Attributes
    ----------
    wrench, kick : (worlds, bodies, 6) float64
        Input: force [N] and torque [N m], world frame. They are one array.
    has_first : bool
        False, as of a control step without impulses.
    model : mujoco.MjModel
        Model of the scene. A world with drawn masses has its own copy.
    """

    has_first = False

    def __init__(self, task: Task, options: dict[str, Any]):
        world = task.world
        mujoco.set_mju_user_warning(lambda text: None)  # `advance` raises an error instead
        self.wrench = self.kick = task.wrench
        self.model = mujoco.MjModel.from_xml_string(model_xml(world.scene, world.dt, **options))
        self._world, self._frame_skip = world, task.frame_skip
        self._given = world.params.copy(), world.gravity.copy()
        self._state = world.state.reshape(task.worlds, world.body_count, -1)
        self._written = np.full_like(self._state, np.nan)
        self._places = [_Place(self.model, bodies) for bodies in self._state]
        self._write_momenta = bound(write_angular_momenta, np.arange(len(world.state)), world.state, world.params)
        self._observe = task.observer(listed(np.arange(task.worlds))) if task.compiled else None

    def advance(self) -> None:
        """Take the steps of a control step in all worlds, and observe them.

        Raises
        ------
        ValueError
            An episode has other physical parameters than the scene.
        FloatingPointError
            A state of MuJoCo is no longer finite.
        """
        self._take_starts()
        for place, wrench in zip(self._places, self.wrench):
            place.wrench[...] = wrench
            mujoco.mj_step(place.model, place.data, nstep=self._frame_skip)
            place.read()
        if not np.isfinite(self._state).all():
            raise FloatingPointError("the state of a world is not finite in MuJoCo; take another setting or step")
        self._write_momenta()
        self._written[...] = self._state
        if self._observe is not None:
            self._observe()

    def _take_starts(self) -> None:
        """Give MuJoCo the worlds that were changed from outside."""
        changed = self._changed()
        if not changed.any():
            return
        params, gravity = self._given
        if not np.array_equal(self._world.gravity, gravity) or (self._world.params != params)[:, ~OF_MASS].any():
            told = "size, friction, restitution or gravity of an episode differs from the scene's"
            raise ValueError(f"{told}; allowed in a twin are the scene's")
        ratios = (params[:, at.INV_MASS] / self._world.params[:, at.INV_MASS]).reshape(self._state.shape[:2])
        for world in np.flatnonzero(changed).tolist():
            self._places[world].write(ratios[world])

    def _changed(self) -> np.ndarray:
        """(worlds,) bool: worlds whose state was written from outside since the last step."""
        return (self._state != self._written).any(axis=(1, 2))

    def read_contact_sums(self, worlds: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Read the sums of MuJoCo's contact forces on each body; as `physics.World.read_contact_sums`.

        The constraints of a free joint are contacts, so that its generalised constraint force is their sum.
        """
        indices = np.arange(len(self._places)) if worlds is None else np.asarray(worlds)
        force = np.array([self._places[world].contact_force for world in indices.tolist()])
        force[self._changed()[indices]] = 0.0
        return force, force * self._world.dt


class _Place:
    """One world in MuJoCo, and the rows of its bodies in our state.

    A free joint has its angular velocity in the body's frame, and an unnormalised quaternion.
    """

    def __init__(self, scene_model, bodies: np.ndarray):
        self.model, self._scene_model = scene_model, scene_model
        self.data = data = mujoco.MjData(scene_model)
        self.wrench, self.contact_force = data.xfrc_applied[1:], data.qfrc_constraint.reshape(len(bodies), 6)[:, :3]
        columns = (at.POS, 3), (at.QUAT, 4), (at.LINVEL, 3), (at.ANGVEL, 3)
        ours = [tuple(row[first : first + size] for first, size in columns) for row in bodies]
        theirs = [
            (q[:3], q[3:], v[:3], v[3:])
            for q, v in zip(data.qpos.reshape(len(bodies), 7), data.qvel.reshape(len(bodies), 6))
        ]
        self._pairs = list(zip(ours, theirs))

    def write(self, mass_ratios: np.ndarray) -> None:
        """Write our state into MuJoCo's, which forgets its warm start.

        `mass_ratios` (bodies,) are the masses over those of the scene's model.
        """
        if self.model is not self._scene_model or (mass_ratios != 1.0).any():
            self._set_masses(mass_ratios)
        mujoco.mj_resetData(self.model, self.data)
        inverse = np.empty(4)
        for (pos, quat, linvel, angvel), theirs in self._pairs:
            theirs[0][...], theirs[1][...], theirs[2][...] = pos, quat, linvel
            mujoco.mju_negQuat(inverse, quat)
            mujoco.mju_rotVecQuat(theirs[3], angvel, inverse)

    def _set_masses(self, ratios: np.ndarray) -> None:
        """Scale masses and inertias in a model of this world alone, and renew the constants that follow from them."""
        if self.model is self._scene_model:
            self.model = copy.copy(self._scene_model)
        self.model.body_mass[1:] = ratios * self._scene_model.body_mass[1:]
        self.model.body_inertia[1:] = ratios[:, None] * self._scene_model.body_inertia[1:]
        mujoco.mj_setConst(self.model, self.data)

    def read(self) -> None:
        """Read MuJoCo's state into ours, without angular momenta."""
        for (pos, quat, linvel, angvel), theirs in self._pairs:
            pos[...], quat[...], linvel[...] = theirs[:3]
            mujoco.mju_normalize4(quat)
            mujoco.mju_rotVecQuat(angvel, theirs[3], quat)


def _register() -> None:
    for env in ORIGINALS:
        if twin_id(env) not in gym.registry:
            gym.register(
                twin_id(env), make_env, vector_entry_point=make_batch, kwargs={"of": env},
                max_episode_steps=gym.spec(env).max_episode_steps, disable_env_checker=True,
            )  # fmt: skip


_register()
