"""Scenes of `workloads` in MuJoCo, with its default integrator (Euler) and solver settings.

MuJoCo is imported when a scene is made. It appends warnings to ``MUJOCO_LOG.TXT`` in the working folder; use
`elsewhere` to keep that file out of the user's folder.

The model differs from that of `peers.mujoco`: MuJoCo steps a body about 5 % faster if its inertia is computed from its
box instead of given, although both move alike to the last printed digit.
"""

from __future__ import annotations

import contextlib
import importlib.util
import os
import tempfile

import numpy as np

from physics import scenes
from rigid_env.lab.measure.timing import Stopwatch
from rigid_env.lab.measure.workloads import (
    FLIGHT_STEPS,
    FULL,
    HOLD,
    LANDING_STEPS,
    STEP,
    Sizes,
    random_poses,
    random_wrenches,
)

FRICTION = 0.5
BLOCK = 1  # index of the block among MuJoCo's bodies; 0 is the world


def is_installed() -> bool:
    """True if MuJoCo can be imported."""
    return importlib.util.find_spec("mujoco") is not None


@contextlib.contextmanager
def elsewhere():
    """Context manager that changes to a temporary working folder, in which MuJoCo may write its log."""
    before = os.getcwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            yield
        finally:
            os.chdir(before)


def model_xml(height: float = scenes.SIZE[1] / 2) -> str:
    """MJCF text of the block in the three-wall box, with its centre at `height` [m] above the floor."""
    half = " ".join(str(edge / 2) for edge in scenes.SIZE)
    friction, width = f'friction="{FRICTION} 0 0"', scenes.HALF_WIDTH
    return f"""<mujoco>
  <option timestep="{STEP}" gravity="0 {-scenes.GRAVITY} 0"/>
  <worldbody>
    <geom type="plane" zaxis="0 1 0" size="0 0 1" {friction}/>
    <geom type="plane" pos="{-width} 0 0" zaxis="1 0 0" size="0 0 1" {friction}/>
    <geom type="plane" pos="{width} 0 0" zaxis="-1 0 0" size="0 0 1" {friction}/>
    <body pos="0 {height} 0">
      <freejoint/>
      <geom type="box" size="{half}" mass="{scenes.MASS}" {friction}/>
    </body>
  </worldbody>
</mujoco>
"""


def make_model(height: float = scenes.SIZE[1] / 2):
    """Make `mujoco.MjModel` and `mujoco.MjData` from `model_xml`."""
    import mujoco

    model = mujoco.MjModel.from_xml_string(model_xml(height))
    return model, mujoco.MjData(model)


class Flight:
    """Work of `workloads.Flight` in MuJoCo."""

    def __init__(self, sizes: Sizes = FULL):
        import mujoco

        self.mujoco, self.flights = mujoco, sizes.flights
        body = scenes.flight().bodies[0]
        self.spin = body.angvel
        self.model, self.data = make_model(body.pos[1])

    def __call__(self) -> float:
        watch = Stopwatch()
        for _ in range(self.flights):
            self.mujoco.mj_resetData(self.model, self.data)
            self.data.qvel[3:] = self.spin
            with watch:
                self.mujoco.mj_step(self.model, self.data, nstep=FLIGHT_STEPS)
        return self.flights * FLIGHT_STEPS / watch.seconds


class Rest:
    """Work of `workloads.Rest` in MuJoCo; before each run the block settles for `LANDING_STEPS` steps."""

    def __init__(self, sizes: Sizes = FULL):
        import mujoco

        self.mujoco, self.steps = mujoco, sizes.rest_steps
        self.model, self.data = make_model()

    def __call__(self) -> float:
        self.mujoco.mj_resetData(self.model, self.data)
        self.mujoco.mj_step(self.model, self.data, nstep=LANDING_STEPS)
        with Stopwatch() as watch:
            self.mujoco.mj_step(self.model, self.data, nstep=self.steps)
        return self.steps / watch.seconds


class Shove:
    """Work of `workloads.Shove` in MuJoCo."""

    def __init__(self, sizes: Sizes = FULL):
        import mujoco

        self.mujoco = mujoco
        self.model, self.data = make_model()
        self.wrenches = random_wrenches(sizes.shoves)[:, 0, 0]

    def __call__(self) -> float:
        self.mujoco.mj_resetData(self.model, self.data)
        with Stopwatch() as watch:
            for wrench in self.wrenches:
                self.data.xfrc_applied[BLOCK] = wrench
                self.mujoco.mj_step(self.model, self.data, nstep=HOLD)
        return len(self.wrenches) * HOLD / watch.seconds

    def notes(self) -> dict:
        """Share of the wrenches after which the block touches a wall, from one more run."""
        self.mujoco.mj_resetData(self.model, self.data)
        touching = 0
        for wrench in self.wrenches:
            self.data.xfrc_applied[BLOCK] = wrench
            self.mujoco.mj_step(self.model, self.data, nstep=HOLD)
            touching += self.data.ncon > 0
        return {"share_in_contact": touching / len(self.wrenches)}


def landed_states(sizes: Sizes) -> tuple[np.ndarray, np.ndarray]:
    """State of the batch's blocks after their fall: qpos (worlds, 7) and qvel (worlds, 6)."""
    import mujoco

    model, data = make_model()
    pos, quat = random_poses(sizes.worlds)
    qpos, qvel = np.empty((sizes.worlds, model.nq)), np.empty((sizes.worlds, model.nv))
    for k in range(sizes.worlds):
        mujoco.mj_resetData(model, data)
        data.qpos[:] = np.concatenate((pos[k, 0], quat[k, 0]))
        mujoco.mj_step(model, data, nstep=LANDING_STEPS)
        qpos[k], qvel[k] = data.qpos, data.qvel
    return qpos, qvel


class Batch:
    """Work of `workloads.Batch` by `mujoco.batch` (MuJoCo 4)."""

    def __init__(self, sizes: Sizes, landed: tuple[np.ndarray, np.ndarray]):
        from mujoco import batch

        model, _ = make_model()
        self.landed = landed
        self.batch = batch.Batch(model, sizes.worlds, sizes.threads)
        self.qpos, self.qvel, self.xfrc, self.warm = (
            self.batch.bind(name) for name in ("qpos", "qvel", "xfrc_applied", "qacc_warmstart")
        )
        self.wrenches = random_wrenches(sizes.batch_steps, sizes.worlds)[:, :, 0]

    def __call__(self) -> float:
        self.qpos[:], self.qvel[:] = self.landed
        self.warm[:] = 0.0
        with Stopwatch() as watch:
            for wrench in self.wrenches:
                self.xfrc[:, BLOCK] = wrench
                self.batch.step()
        return self.wrenches.shape[0] * self.wrenches.shape[1] / watch.seconds


class Rollout:
    """Work of `workloads.Batch` by `mujoco.rollout`, MuJoCo's quickest way, which gets all wrenches at once."""

    def __init__(self, sizes: Sizes, landed: tuple[np.ndarray, np.ndarray]):
        import mujoco
        from mujoco import rollout

        self.model, data = make_model()
        self.data = [data, *(mujoco.MjData(self.model) for _ in range(sizes.threads - 1))]
        self.start = np.concatenate((np.zeros((sizes.worlds, 1)), *landed), axis=1)
        self.wrenches = np.zeros((sizes.worlds, sizes.batch_steps, self.model.nbody, 6))
        self.wrenches[:, :, BLOCK] = random_wrenches(sizes.batch_steps, sizes.worlds)[:, :, 0].swapaxes(0, 1)
        self.wrenches = self.wrenches.reshape(sizes.worlds, sizes.batch_steps, -1)
        self.states = np.empty((sizes.worlds, sizes.batch_steps, self.start.shape[1]))
        self.spec = int(mujoco.mjtState.mjSTATE_XFRC_APPLIED)
        self.rollout = rollout.Rollout(nthread=sizes.threads)

    def __call__(self) -> float:
        with Stopwatch() as watch:
            self.rollout.rollout(
                self.model, self.data, self.start, self.wrenches, control_spec=self.spec, state=self.states
            )
        return self.wrenches.shape[0] * self.wrenches.shape[1] / watch.seconds


def has_batch() -> bool:
    """True if this MuJoCo has `mujoco.batch` (since 4.0)."""
    return is_installed() and importlib.util.find_spec("mujoco.batch") is not None
