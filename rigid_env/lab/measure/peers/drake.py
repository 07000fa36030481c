"""Drake on our scenes: a MultibodyPlant, continuous with the RK3 integrator or discrete with TAMSI or SAP.

Drake has no coefficient of restitution. In the Hunt-Crossley model of its TAMSI and continuous contacts, f = k x (1 + d
ẋ), a body that arrives at speed v leaves at e v if d v (1 + e) = ln((1 + d v)/(1 - d e v)). So `d` is set for the speed
of the first impact of a body that falls without rotation, and fits only that speed. SAP has no such model.

Its point contact makes one point between two shapes, on which a block cannot rest. So a block is given as its eight
vertices, as users of Drake do; against half-spaces this is the same shape.
"""

from __future__ import annotations

import logging
import math
from importlib import import_module
from itertools import product

import numpy as np
from scipy.optimize import brentq

import physics
from physics.rotations import rotation_matrices
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

LOOSE, TIGHT = 1e-6, 1e-10  # target accuracies of the integrator

FREE = {
    "default": {},
    "RK3, 1e-6": {"accuracy": LOOSE},
    "RK3, 1e-10": {"accuracy": TIGHT},
}
RESTING = {
    "default": {},
    "TAMSI": {"approximation": "tamsi"},
    "SAP, stiction 1 µm/s": {"approximation": "sap", "stiction": 1e-6},
    "RK3, 1e-4": {"accuracy": 1e-4},
}
BOUNCING = {
    "default": {},
    "TAMSI": {"approximation": "tamsi", "is_fitted": True},
    "RK3, 1e-4": {"accuracy": 1e-4, "is_fitted": True},
}


class Drake:
    """Drake as an engine for measurements, see `contender.Engine`."""

    name = "drake"

    def __init__(self):
        import_module("pydrake.common")  # it sets up the logging that is turned down below
        self.version = version("drake")
        # Drake warns for every half-space that deformable bodies would not collide with it.
        logging.getLogger("drake").setLevel(logging.ERROR)

    def settings(self, scene: physics.Scene) -> dict[str, dict]:
        """Options of Drake by the name of the setting: contact approximations, and RK3 with error control."""
        if not walls(scene):
            return FREE
        return BOUNCING if restitution(scene) else RESTING

    def open(self, scene: physics.Scene, dt: float, **options) -> _Run:
        """Build a scene in Drake, see `contender.Engine.open`."""
        refuse_meetings(scene)
        for body in scene.bodies:
            if body.kind in ("hull", "capsule", "cylinder", "compound"):
                raise Unsupported(f"{body.kind}s are not handed to Drake")
        if options.pop("is_fitted", False):
            options["dissipation"] = dissipation(scene)
        return _Run(scene, dt, **options)


def dissipation(scene: physics.Scene) -> float:
    """Hunt-Crossley dissipation [s/m] that gives the scene's restitution at the speed of its first impact.

    Raises
    ------
    Unsupported
        There is no single impact speed: several bodies, a rotating body, or a body that does not fly towards one wall.
    """
    e = restitution(scene)
    if e == 1.0:
        return 0.0
    body = scene.bodies[0]
    if len(scene.bodies) > 1 or any(body.angvel):
        raise Unsupported("Drake has no restitution: its dissipation fits one speed, and the scene has several")
    speeds = [speed for wall in walls(scene) if (speed := _arrival(scene, body, wall)) > 0.0]
    if len(speeds) != 1:
        raise Unsupported("Drake has no restitution: its dissipation fits one speed, and the scene has not one impact")
    share = brentq(lambda s: s * (1 + e) - math.log((1 + s) / (1 - e * s)), 1e-6, (1 - 1e-12) / e)
    return share / speeds[0]


def _arrival(scene: physics.Scene, body: physics.Body, wall: physics.HalfSpace) -> float:
    """Speed at which a body that does not rotate hits a wall [m/s]; 0 if it does not reach it."""
    normal, R = np.array(wall.normal), rotation_matrices(np.array(body.quat))
    reach = body.dimensions * (R.T @ normal)
    extent = np.abs(reach).sum() if body.kind == "block" else np.linalg.norm(reach)
    gap = normal @ body.pos - wall.offset - extent
    speed, pull = normal @ body.linvel, normal @ gravity(scene)
    squared = speed * speed - 2 * pull * gap
    return math.sqrt(squared) if squared > 0 and (pull < 0 or (pull == 0 and speed < 0)) else 0.0


class _Run:
    """Scene in Drake, see `contender.Run`."""

    def __init__(self, scene, dt, approximation=None, accuracy=None, stiction=None, dissipation=None):
        from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
        from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
        from pydrake.systems.framework import DiagramBuilder

        self.scene, self.dt = scene, dt
        builder = DiagramBuilder()
        self.plant, graph = AddMultibodyPlantSceneGraph(builder, 0.0 if accuracy else dt)
        self._fill(approximation, stiction, dissipation)
        self.diagram = builder.Build()
        self._separate_bodies(graph)
        self.simulator = Simulator(self.diagram)
        if accuracy:
            ResetIntegratorFromFlags(self.simulator, "runge_kutta3", dt).set_target_accuracy(accuracy)

    def _fill(self, approximation, stiction, dissipation) -> None:
        from pydrake.geometry import AddContactMaterial, HalfSpace, ProximityProperties
        from pydrake.multibody.plant import CoulombFriction, DiscreteContactApproximation

        plant, mu = self.plant, friction(self.scene)
        surface = ProximityProperties()
        AddContactMaterial(friction=CoulombFriction(mu, mu), dissipation=dissipation, properties=surface)
        plant.mutable_gravity_field().set_gravity_vector(gravity(self.scene))
        if approximation is not None:
            kind = {"tamsi": DiscreteContactApproximation.kTamsi, "sap": DiscreteContactApproximation.kSap}
            plant.set_discrete_contact_approximation(kind[approximation])
        for k, wall in enumerate(walls(self.scene)):
            pose = HalfSpace.MakePose(np.array(wall.normal), np.array(wall.normal) * wall.offset)
            plant.RegisterCollisionGeometry(plant.world_body(), pose, HalfSpace(), f"wall{k}", surface)
        self.bodies = [self._add_body(b, body, surface) for b, body in enumerate(self.scene.bodies)]
        if stiction is not None:
            plant.set_stiction_tolerance(stiction)
        plant.Finalize()

    def _add_body(self, b: int, body: physics.Body, surface):
        from pydrake.geometry import Ellipsoid, Sphere
        from pydrake.math import RigidTransform
        from pydrake.multibody.tree import RotationalInertia, SpatialInertia, UnitInertia

        I = body.inertia
        tensor = RotationalInertia(I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2])
        unit = UnitInertia()
        unit.SetFromRotationalInertia(tensor, body.mass)
        made = self.plant.AddRigidBody(f"body{b}", SpatialInertia(body.mass, np.zeros(3), unit))
        half = body.dimensions
        if not walls(self.scene):
            return made
        if body.kind == "block":
            shapes = [(Sphere(0.0), RigidTransform(half * corner)) for corner in product((-1, 1), repeat=3)]
        else:
            shape = Sphere(half[0]) if body.kind == "sphere" else Ellipsoid(*half)
            shapes = [(shape, RigidTransform())]
        for k, (shape, pose) in enumerate(shapes):
            self.plant.RegisterCollisionGeometry(made, pose, shape, f"body{b}, shape{k}", surface)
        return made

    def _separate_bodies(self, graph) -> None:
        from pydrake.geometry import CollisionFilterDeclaration

        shapes = self.plant.CollectRegisteredGeometries(self.bodies)
        graph.collision_filter_manager().Apply(CollisionFilterDeclaration().ExcludeWithin(shapes))

    def restart(self) -> None:
        from pydrake.common.eigen_geometry import Quaternion
        from pydrake.math import RigidTransform
        from pydrake.multibody.math import SpatialVelocity

        context = self.simulator.get_mutable_context()
        self.diagram.SetDefaultContext(context)
        self.inner = self.plant.GetMyMutableContextFromRoot(context)
        for made, body in zip(self.bodies, self.scene.bodies):
            attitude = np.array(body.quat) / np.linalg.norm(body.quat)
            pose = RigidTransform(Quaternion(attitude), np.array(body.pos))
            self.plant.SetFloatingBaseBodyPoseInWorldFrame(self.inner, made, pose)
            speed = SpatialVelocity(w=np.array(body.angvel), v=np.array(body.linvel))
            self.plant.SetFreeBodySpatialVelocity(self.inner, made, speed)
        context.SetTime(0.0)
        self.taken = 0
        self.simulator.Initialize()

    def advance(self, steps: int) -> None:
        self.taken += steps
        self.simulator.AdvanceTo(self.taken * self.dt)

    def state(self) -> State:
        rows = []
        for made in self.bodies:
            pose = self.plant.EvalBodyPoseInWorld(self.inner, made)
            speed = self.plant.EvalBodySpatialVelocityInWorld(self.inner, made)
            q = pose.rotation().ToQuaternion()
            rows.append((pose.translation(), (q.w(), q.x(), q.y(), q.z()), speed.translational(), speed.rotational()))
        return tuple(np.array(column) for column in zip(*rows))
