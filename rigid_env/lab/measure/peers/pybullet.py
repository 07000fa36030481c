"""PyBullet on our scenes, in double precision as its package is built, without a window.

PyBullet damps all motion, and suppresses bounces below a speed. Our scenes do not have these effects, so both are zero
here, at the setting "default", too.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys

import numpy as np

import physics
from rigid_env.lab.measure.machine import version
from rigid_env.lab.measure.peers.contender import (
    State,
    Unsupported,
    friction,
    gravity,
    refuse_meetings,
    restitution,
    walls,
)

FASTEST = 1e6  # PyBullet's limit of speeds, set far above those in our scenes

FREE = {"default": {}, "maximal coordinates": {"maximal": True}}
TOUCHING = {
    "default": {},
    "maximal coordinates": {"maximal": True},
    "500 iterations": {"iterations": 500},
    "breaking 0.1 mm, erp 0": {"breaking": 1e-4, "erp": 0.0},
}


class PyBullet:
    """PyBullet as an engine for measurements, see `contender.Engine`."""

    name = "pybullet"

    def __init__(self):
        self.version = version("pybullet")

    def settings(self, scene: physics.Scene) -> dict[str, dict]:
        """Options of PyBullet by the name of the setting: coordinates, iterations, distance at which contacts end."""
        return TOUCHING if walls(scene) else FREE

    def open(self, scene: physics.Scene, dt: float, **options) -> _Run:
        """Build a scene in PyBullet, which has no ellipsoids and no inertia tensors with off-diagonal entries.

        See `contender.Engine.open`.
        """
        refuse_meetings(scene)
        for body in scene.bodies:
            if body.kind == "ellipsoid":
                raise Unsupported("PyBullet has no ellipsoid")
            if body.kind in ("hull", "capsule", "cylinder", "compound"):
                raise Unsupported(f"{body.kind}s are not handed to PyBullet")
            if (body.inertia - np.diag(np.diag(body.inertia))).any():
                raise Unsupported("PyBullet takes the moments of inertia along the body's axes only")
        return _Run(scene, dt, **options)


class _Run:
    """Scene in PyBullet, see `contender.Run`; a restart builds the scene anew, so that no contact is remembered."""

    def __init__(self, scene, dt, maximal=False, iterations=None, breaking=None, erp=None):
        with _silence():
            import pybullet
        from pybullet_utils.bullet_client import BulletClient

        with _silence():
            self.client = BulletClient(pybullet.DIRECT)
        self.scene, self.is_maximal = scene, maximal
        self.engine = {"fixedTimeStep": dt, "numSubSteps": 0, "restitutionVelocityThreshold": 0.0}
        if iterations is not None:
            self.engine["numSolverIterations"] = iterations
        if breaking is not None:
            self.engine["contactBreakingThreshold"] = breaking
        if erp is not None:
            self.engine.update(erp=erp, contactERP=erp, frictionERP=erp)

    def restart(self) -> None:
        client = self.client
        client.resetSimulation()
        client.setGravity(*gravity(self.scene))
        client.setPhysicsEngineParameter(**self.engine)
        for wall in walls(self.scene):
            self._add_wall(wall)
        self.bodies = [self._add_body(body) for body in self.scene.bodies]
        for k, first in enumerate(self.bodies):
            for second in self.bodies[:k]:
                client.setCollisionFilterPair(first, second, -1, -1, 0)

    def _add_wall(self, wall: physics.HalfSpace) -> None:
        shape = self.client.createCollisionShape(self.client.GEOM_PLANE, planeNormal=wall.normal)
        place = tuple(wall.offset * n for n in wall.normal)
        plane = self.client.createMultiBody(0.0, shape, basePosition=place)
        # PyBullet multiplies the coefficients of both bodies.
        self.client.changeDynamics(plane, -1, lateralFriction=1.0, restitution=1.0)

    def _add_body(self, body: physics.Body) -> int:
        client = self.client
        if body.kind == "sphere":
            shape = client.createCollisionShape(client.GEOM_SPHERE, radius=body.radius)
        else:
            shape = client.createCollisionShape(client.GEOM_BOX, halfExtents=body.dimensions.tolist())
        w, x, y, z = body.quat
        made = client.createMultiBody(
            body.mass, shape, basePosition=body.pos, baseOrientation=(x, y, z, w), useMaximalCoordinates=self.is_maximal
        )
        client.changeDynamics(
            made, -1, mass=body.mass, localInertiaDiagonal=np.diag(body.inertia).tolist(),
            lateralFriction=friction(self.scene), restitution=restitution(self.scene), spinningFriction=0.0,
            rollingFriction=0.0, linearDamping=0.0, angularDamping=0.0, jointDamping=0.0, maxJointVelocity=FASTEST,
        )  # fmt: skip
        client.resetBaseVelocity(made, body.linvel, body.angvel)
        return made

    def advance(self, steps: int) -> None:
        step = self.client.stepSimulation
        for _ in range(steps):
            step()

    def state(self) -> State:
        poses = [self.client.getBasePositionAndOrientation(body) for body in self.bodies]
        speeds = [self.client.getBaseVelocity(body) for body in self.bodies]
        pos, turned = (np.array(column, dtype=float) for column in zip(*poses))
        linvel, angvel = (np.array(column, dtype=float) for column in zip(*speeds))
        return pos, turned[:, [3, 0, 1, 2]], linvel, angvel

    def __del__(self):
        client = getattr(self, "client", None)
        if client is not None and client.isConnected():
            client.disconnect()


@contextlib.contextmanager
def _silence():
    """Context manager that suppresses the output of PyBullet's C code, by redirecting the file descriptors."""
    sys.stdout.flush()
    sys.stderr.flush()
    kept = os.dup(1), os.dup(2)
    with open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), 1)
        os.dup2(nowhere.fileno(), 2)
    try:
        yield
    finally:
        ctypes.CDLL(None).fflush(None)  # write buffered output of C before the descriptors are restored
        for descriptor, copy in zip((1, 2), kept):
            os.dup2(copy, descriptor)
            os.close(copy)
