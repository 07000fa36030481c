"""BlockStack and BallJuggle as `MujocoEnv`s of Gymnasium: what a user of MuJoCo would write instead.

Observations, actions, rewards, starts, success and failure are those of `rigid_env.suite`; contacts are MuJoCo's.
"""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from typing import ClassVar

import gymnasium
import mujoco
import numpy as np
from gymnasium import spaces
from gymnasium.envs.mujoco import MujocoEnv

from rigid_env.lab.measure.environments import EnvPeer
from rigid_env.suite import ball_juggle as juggle
from rigid_env.suite import block_stack as stack

FRICTION = 0.5  # of BlockStack


class _TaskEnv(MujocoEnv):
    """`MujocoEnv` of a model given as text, with actions from -1 to 1 that are a wrench on body 1."""

    metadata: ClassVar[dict] = {"render_modes": ["human", "rgb_array", "depth_array"]}

    def __init__(self, xml: str, frame_skip: int, observations: int, actions: int, **more):
        box = spaces.Box(-5.0, 5.0, (observations,), np.float32)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "model.xml"
            path.write_text(xml, encoding="utf-8")
            super().__init__(str(path), frame_skip, box, **more)
        self.action_space = spaces.Box(-1.0, 1.0, (actions,), np.float32)

    def _act(self, force, torque):
        """Hold a force and a torque on body 1 for a control step.

        `MujocoEnv.do_simulation` would compute contact forces on each body besides; nothing here needs them.
        """
        self.data.xfrc_applied[1, :3], self.data.xfrc_applied[1, 3:] = force, torque
        mujoco.mj_step(self.model, self.data, nstep=self.frame_skip)


def _within(vector):
    """Vector shortened to length 1 where it is longer."""
    length = math.sqrt(vector @ vector)
    return vector / length if length > 1.0 else vector


# --- BlockStack ------------------------------------------------------------------------------------------------------

STACK_XML = f"""<mujoco>
  <option timestep="0.01" gravity="0 {-stack.G} 0"/>
  <worldbody>
    <geom type="plane" zaxis="0 1 0" size="0 0 1" friction="{FRICTION} 0 0"/>
    <body pos="2.5 0.5 0">
      <freejoint/>
      <geom type="box" size="0.5 0.5 0.5" mass="{stack.MASS}" friction="{FRICTION} 0 0"/>
    </body>
    <body pos="0 0.4 0">
      <freejoint/>
      <geom type="box" size="0.6 0.4 0.6" mass="{stack.MASS}" friction="{FRICTION} 0 0"/>
    </body>
  </worldbody>
</mujoco>
"""


class MujocoBlockStack(_TaskEnv):
    """Put a cube onto a block that may be 1,000 times lighter, and let go."""

    weight = stack.MASS * stack.G
    rest = np.array([0.0, 0.5 * stack.BASE[1], 0.0])  # place of B

    def __init__(self, frame_skip: int = 5, **more):
        super().__init__(STACK_XML, frame_skip, 15, 6, **more)
        self.inertia = self.model.body_inertia[2].copy()

    def step(self, action):
        action = np.clip(action, -1.0, 1.0)
        limit = self.weight * stack.TORQUE * stack.EDGE / 2
        self._act(stack.STRENGTH * self.weight * _within(action[:3]), limit * _within(action[3:]))
        a, b = self.data.qpos[:3], self.data.qpos[7:10]
        self.held = self.held + self.dt if self._goes_on(a, b) else 0.0
        if self.held == 0.0:
            self.place = a.copy()
        moved = math.dist(b, self.rest)
        turned = 2.0 * math.acos(min(abs(self.data.qpos[10]), 1.0))
        is_success = self.held > stack.HOLD_TIME - 0.5 * self.dt
        is_failure = moved > stack.UNMOVED or turned > stack.UNMOVED
        return self._observation(), self._reward(is_success), is_success or is_failure, False, {
            "is_success": is_success
        }  # fmt: skip

    def _goes_on(self, a, b):
        """B carries A, which is still, and where its rest began."""
        velocity = self.data.qvel
        return (
            math.sqrt(velocity[:3] @ velocity[:3]) < stack.STILL
            and math.sqrt(velocity[3:6] @ velocity[3:6]) < stack.STILL
            and a[1] > b[1] + stack.STACKED - stack.UNMOVED
            and self.data.qfrc_constraint[1] > stack.CARRIED * self.weight
            and math.dist(a, self.place) < stack.CREEP
        )

    def _to_go(self):
        x, y, z = self.data.qpos[:3] - self.data.qpos[7:10]
        along = math.hypot(x, z)
        way = along + abs(y - stack.STACKED - stack.CLEARANCE * min(along, 1.0))
        return way + 1.0 - self.data.xmat[1, 4]

    def _reward(self, is_success):
        before, self.to_go = self.to_go, self._to_go()
        gain = max(self.held - self.longest, 0.0)
        self.longest += gain
        held = stack.HELD_WORTH * gain / stack.HOLD_TIME
        return before - self.to_go + held + stack.SUCCESS_WORTH * is_success

    def reset_model(self):
        """Stand A on a ring about B, whose mass is drawn."""
        draw = self.np_random.uniform
        apart, bearing, yaw = draw(1.8, 3.0), draw(-math.pi, math.pi), draw(-math.pi / 4, math.pi / 4)
        self.logarithm = draw(0.0, 1.0)
        ratio = stack.LARGEST_RATIO**-self.logarithm
        self.model.body_mass[2], self.model.body_inertia[2] = stack.MASS * ratio, self.inertia * ratio
        mujoco.mj_setConst(self.model, self.data)
        qpos = self.init_qpos.copy()
        qpos[0], qpos[2] = apart * math.cos(bearing), apart * math.sin(bearing)
        qpos[3], qpos[5] = math.cos(yaw / 2), math.sin(yaw / 2)
        self.set_state(qpos, self.init_qvel)
        self.held, self.longest, self.place, self.to_go = 0.0, 0.0, qpos[:3].copy(), self._to_go()
        return self._observation()

    def _observation(self):
        data = self.data
        turn = data.xmat[1].reshape(3, 3)
        offset = data.qpos[:3] - data.qpos[7:10]
        offset[1] -= stack.STACKED
        rest = data.qfrc_constraint[1] / self.weight, self.held / stack.HOLD_TIME, self.logarithm
        parts = offset / stack.LENGTH, data.qvel[:3] / stack.SPEED, turn @ data.qvel[3:6] / stack.SPIN, turn[:, 1], rest
        return np.concatenate(parts, dtype=np.float32).clip(-5.0, 5.0)


# --- BallJuggle ------------------------------------------------------------------------------------------------------

_CORNERS = [(x * juggle.SIDE / 2, z * juggle.SIDE / 2) for x in (-1, 1) for z in (-1, 1)]
_STRETCH, _STEP = juggle.G / juggle.RATE**2, 0.005
_ANCHORS = "".join(f'<site name="anchor{k}" pos="{x} {_STRETCH} {z}"/>' for k, (x, z) in enumerate(_CORNERS))
_ENDS = "".join(f'<site name="end{k}" pos="{x} 0 {z}"/>' for k, (x, z) in enumerate(_CORNERS))
_TENDONS = "".join(
    f'<spatial stiffness="{juggle.BLOCK_MASS * juggle.RATE**2 / 4}" damping="{juggle.DAMPING}" springlength="0">'
    f'<site site="anchor{k}"/><site site="end{k}"/></spatial>'
    for k in range(4)
)
_SURFACE = f'friction="{juggle.FRICTION} 0 0" solimp="0.9999 0.9999 0.001 0.5 2"'
JUGGLE_XML = f"""<mujoco>
  <option timestep="{_STEP}" gravity="0 {-juggle.G} 0"/>
  <worldbody>
    {_ANCHORS}
    <body>
      <freejoint/>
      {_ENDS}
      <geom type="box" size="{juggle.SIDE / 2} {juggle.THICKNESS / 2} {juggle.SIDE / 2}" mass="{juggle.BLOCK_MASS}"
            {_SURFACE}/>
    </body>
    <body pos="0 1 0">
      <freejoint/>
      <geom type="sphere" size="{juggle.RADIUS}" mass="{juggle.BALL_MASS}" {_SURFACE}/>
    </body>
  </worldbody>
  <tendon>{_TENDONS}</tendon>
</mujoco>
"""


class MujocoBallJuggle(_TaskEnv):
    """Keep a ball bouncing on a block that hangs on springs.

    The contact reverses the speed of an impact in one step: its reference acceleration is -(1 + e)/h times the speed, a
    negative `solref`.
    """

    weight = juggle.BLOCK_MASS * juggle.G

    def __init__(self, frame_skip: int = 5, **more):
        super().__init__(JUGGLE_XML, frame_skip, 22, 5, **more)

    def step(self, action):
        action = np.clip(action, -1.0, 1.0)
        x, z = juggle.TURNING * self.weight * juggle.SIDE / 2 * _within(action[3:])
        self._act(juggle.STRENGTH * self.weight * _within(action[:3]), (x, 0.0, z))
        data, gap = self.data, self._gap()
        speed = data.qvel[7]
        if gap > juggle.FLYING:
            self.apex = data.qpos[8] + speed**2 / (2.0 * juggle.G)
        if self.rise > 0.0 >= speed:
            is_good = abs(self.apex - self.wanted) < juggle.TOLERANCE and gap > juggle.CLEARANCE
            self.row = self.row + 1 if is_good else 0
        self.rise = speed
        is_success, is_lost = self.row >= juggle.APEXES, data.qpos[8] < data.qpos[1]
        before, self.potential = self.potential, self._potential()
        reward = self.potential - before - is_lost + 2.0 * is_success
        return self._observation(), reward, bool(is_success or is_lost), False, {"is_success": is_success}

    def _gap(self):
        """Gap between the ball and the plane of the block's top."""
        return float((self.data.qpos[7:10] - self.data.qpos[:3]) @ self.data.xmat[1, 1::3]) - juggle.TOUCHING

    def _potential(self):
        data, prices = self.data, juggle.PRICES
        aside = math.hypot(data.qpos[7] - data.qpos[0], data.qpos[9] - data.qpos[2])
        costs = prices["apex"] * abs(self.apex - self.wanted) + prices["aside"] * aside
        costs += prices["drift"] * math.hypot(data.qvel[6], data.qvel[8]) + prices["tilt"] * (1.0 - data.xmat[1, 4])
        return juggle.APEX_BONUS * self.row - costs

    def reset_model(self):
        """Hold the ball above the block; restitution and wanted apex are drawn."""
        draw = self.np_random.uniform
        self.wanted, self.restitution = draw(*juggle.WANTED), draw(*juggle.RESTITUTION)
        self.model.geom_solref[:] = -0.03 / _STEP**2, -(1.0 + self.restitution) / _STEP
        qpos, qvel = self.init_qpos.copy(), self.init_qvel.copy()
        qpos[7], qpos[9] = draw(-juggle.ASIDE, juggle.ASIDE, 2)
        qpos[8] = draw(*juggle.RELEASE)
        qvel[6], qvel[8] = draw(-juggle.DRIFT, juggle.DRIFT, 2)
        self.set_state(qpos, qvel)
        self.apex, self.rise, self.row = qpos[8], 0.0, 0
        self.potential = self._potential()
        return self._observation()

    def _observation(self):
        data = self.data
        turns = data.xmat[1].reshape(3, 3), data.xmat[2].reshape(3, 3)
        block_spin, ball_spin = turns[0] @ data.qvel[3:6], turns[1] @ data.qvel[9:12]
        parts = (
            (data.qpos[7:10] - data.qpos[:3]) / juggle.LENGTH, data.qvel[6:9] / juggle.BALL_SPEED,
            ball_spin[::2] / juggle.BALL_SPIN, data.qpos[:3] / juggle.LENGTH, data.qvel[:3] / juggle.BLOCK_SPEED,
            turns[0][::2, 1] / juggle.TILT, block_spin[::2] / juggle.BLOCK_SPIN,
            (self.apex - self.wanted, self.wanted, self.restitution, self.row / juggle.APEXES),
        )  # fmt: skip
        return np.concatenate(parts, dtype=np.float32).clip(-5.0, 5.0)


KINDS: dict[str, type[MujocoEnv]] = {"BlockStack": MujocoBlockStack, "BallJuggle": MujocoBallJuggle}


def make_peer(name: str) -> EnvPeer:
    """Environment of `KINDS`, registered, with the wrappers and the length of episodes that ours has."""
    peer_id = f"Mujoco{name}-v0"
    if peer_id not in gymnasium.registry:
        steps = gymnasium.spec(f"rigid_env/{name}-v0").max_episode_steps
        gymnasium.register(peer_id, KINDS[name], max_episode_steps=steps)

    def make():
        return gymnasium.make(peer_id, disable_env_checker=True)

    return EnvPeer("MujocoEnv", make, lambda number: gymnasium.vector.SyncVectorEnv([make] * number))
