"""MuJoCo on our scenes, given as MJCF.

Its contacts are soft, without a coefficient of restitution. For a scene with restitution, the reference acceleration of
a contact, -b v - k r, is set so that one step changes the speed v to -e v: b = (1 + e)/h, with k = 0 or a small
stiffness against penetration (negative `solref`, see "Solver parameters" in MuJoCo's documentation).

By default MuJoCo resets the scene when a state is not finite. This is switched off, so that it shows in the errors, and
so are MuJoCo's warnings about it.
"""

from __future__ import annotations

import numpy as np

import physics
from physics.io.mjcf.capsule_frames import OF_GEOM, WITH_AXIS
from physics.rotations import rotation_matrices
from rigid_env.lab.measure.machine import version
from rigid_env.lab.measure.peers.contender import State, Unsupported, friction, gravity, restitution, walls

HARD = "0.9999 0.9999 0.001 0.5 2"  # solimp: as rigid as MuJoCo allows
KINDS = {
    "block": "box", "sphere": "sphere", "ellipsoid": "ellipsoid", "hull": "mesh", "capsule": "capsule",
    "cylinder": "cylinder",
}  # fmt: skip

FREE = {
    "default": {},
    "RK4": {"integrator": "RK4"},
    "implicitfast": {"integrator": "implicitfast"},
}
RESTING = {
    "default": {},
    "elliptic, impratio 100, noslip 10": {"cone": "elliptic", "impratio": 100, "noslip": 10},
    "stiff": {"contact": "stiff"},
    "stiff, discrete": {"contact": "stiff", "integrator": "discrete"},
    "stiff, elliptic, impratio 100": {"contact": "stiff", "cone": "elliptic", "impratio": 100},
}
BOUNCING = {
    "default": {},  # without restitution
    "one-step": {"contact": "onestep"},
    "one-step, k 0.03/h²": {"contact": "onestep", "share": 0.03},
}


class MuJoCo:
    """MuJoCo as an engine for measurements, see `contender.Engine`."""

    name = "mujoco"

    def __init__(self):
        import mujoco

        self.version = version("mujoco")
        mujoco.set_mju_user_warning(lambda text: None)

    def settings(self, scene: physics.Scene) -> dict[str, dict]:
        """Options of MuJoCo by the name of the setting.

        Without walls the settings differ in the integrator, with walls in the contacts. A scene with restitution has
        settings of its own, whose contacts rebound.
        """
        if not walls(scene):
            return FREE
        return BOUNCING if restitution(scene) else RESTING

    def open(self, scene: physics.Scene, dt: float, **options) -> _Run:
        """Build a scene in MuJoCo, which can express all our scenes but those with compounds; see `Engine.open`."""
        if any(body.kind == "compound" for body in scene.bodies):
            raise Unsupported("compounds are not handed to MuJoCo")
        return _Run(scene, dt, options)


class _Run:
    """Scene in MuJoCo, see `contender.Run`."""

    def __init__(self, scene: physics.Scene, dt: float, options: dict):
        import mujoco

        self.mujoco, self.scene = mujoco, scene
        self.model = mujoco.MjModel.from_xml_string(model_xml(scene, dt, **options))
        self.data = mujoco.MjData(self.model)
        self.count = len(scene.bodies)

    def restart(self) -> None:
        self.mujoco.mj_resetData(self.model, self.data)
        q, v = self._views()
        for b, body in enumerate(self.scene.bodies):
            q[b, :3], q[b, 3:] = body.pos, body.quat
            v[b, :3] = body.linvel
            v[b, 3:] = rotation_matrices(np.array(body.quat)).T @ body.angvel  # a free joint turns in its own frame

    def advance(self, steps: int) -> None:
        self.mujoco.mj_step(self.model, self.data, nstep=steps)

    def state(self) -> State:
        q, v = self._views()
        quat = q[:, 3:] / np.linalg.norm(q[:, 3:], axis=-1, keepdims=True)
        angvel = np.einsum("bij,bj->bi", rotation_matrices(quat), v[:, 3:])
        return q[:, :3].copy(), quat, v[:, :3].copy(), angvel

    def _views(self) -> tuple[np.ndarray, np.ndarray]:
        return self.data.qpos.reshape(self.count, 7), self.data.qvel.reshape(self.count, 6)


def model_xml(
    scene: physics.Scene,
    dt: float,
    integrator: str = "Euler",
    cone: str = "pyramidal",
    impratio: float = 1.0,
    noslip: int = 0,
    solver: str = "Newton",
    contact: str = "default",
    share: float = 0.0,
) -> str:
    """MJCF text of a scene.

    Parameters
    ----------
    scene : Scene
    dt : float
        Step [s].
    integrator, cone, impratio, noslip, solver
        MuJoCo's options of these names.
    contact : str
        ``default``; ``stiff``: the shortest time constant MuJoCo allows, 2 h; ``onestep``: restitution in one step.
    share : float
        Stiffness of ``onestep``, in 1/h².
    """
    mu = friction(scene)
    surface = f'friction="{mu!r} 0 0" condim="{3 if mu else 1}" {_reference(contact, restitution(scene), dt, share)}'
    planes = "".join(
        f'<geom type="plane" pos="{_text(np.array(wall.normal) * wall.offset)}" zaxis="{_text(wall.normal)}" '
        f'size="0 0 1" contype="1" conaffinity="2" {surface}/>'
        for wall in walls(scene)
    )
    contact_law = scene.effect(physics.Contact)
    affinity = 3 if contact_law is not None and contact_law.between_bodies else 1
    bodies = "".join(_body_xml(b, body, f'conaffinity="{affinity}" {surface}') for b, body in enumerate(scene.bodies))
    meshes = "".join(
        f'<mesh name="hull{b}" vertex="{_text(body.polyhedron.vertices.ravel())}"/>'
        for b, body in enumerate(scene.bodies)
        if body.kind == "hull"
    )
    return f"""<mujoco>
  <compiler balanceinertia="false"/>
  <option timestep="{dt!r}" gravity="{_text(gravity(scene))}" integrator="{integrator}" cone="{cone}"
          impratio="{impratio}" noslip_iterations="{noslip}" solver="{solver}"><flag autoreset="disable"/></option>
  <asset>{meshes}</asset>
  <worldbody>{planes}{bodies}</worldbody>
</mujoco>"""


def _reference(contact: str, e: float, dt: float, share: float) -> str:
    if contact == "stiff":
        return f'solref="{2 * dt!r} 1" solimp="{HARD}"'
    if contact == "onestep":
        # MuJoCo would read two zeros as a time constant, so the stiffness is at least a tiny number.
        return f'solref="{-max(share / dt**2, 1e-12)!r} {-(1 + e) / dt!r}" solimp="{HARD}"'
    return ""


def _body_xml(b: int, body: physics.Body, surface: str) -> str:
    I = body.inertia
    extent = f'mesh="hull{b}"' if body.kind == "hull" else f'size="{_text(body.dimensions)}"'
    if body.kind in WITH_AXIS:
        radius, reach = body.dimensions[:2]
        half = reach - radius if body.kind == "capsule" else reach
        extent = f'size="{_text((radius, half))}" quat="{_text(OF_GEOM)}"'
    shape = f'type="{KINDS[body.kind]}" {extent} contype="2"'
    full = (I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2])
    return (
        f'<body pos="{_text(body.pos)}" quat="{_text(body.quat)}"><freejoint/>'
        f'<inertial pos="0 0 0" mass="{body.mass!r}" fullinertia="{_text(full)}"/>'
        f"<geom {shape} {surface}/></body>"
    )


def _text(values) -> str:
    return " ".join(repr(float(value)) for value in values)
