"""Rigid-body engine: quaternion state, contacts by impulses and complementarity, kernels compiled by Numba.

Its whole use in five lines::

    scene = physics.Scene(bodies=[physics.Block(size=(5, 3, 2), mass=6.0, pos=(0, 6, 0))],
                          walls=physics.three_walls(half_width=10.0),
                          effects=[physics.Gravity(), physics.Contact(restitution=0.3), physics.Friction(0.5)])
    world = physics.World(scene, worlds=1024, dt=0.01, accuracy="balanced", threads=2)
    report = world.step(wrench)
"""

from typing import TYPE_CHECKING

from physics.accuracy import PRESETS, Accuracy
from physics.analysis.diagnostics import Diagnostics, diagnose, look_at
from physics.analysis.events import Event
from physics.analysis.simulate import simulate
from physics.analysis.trajectory import Trajectory
from physics.io.mjcf.files import load_mjcf, save_mjcf
from physics.io.recorder import Recorder
from physics.io.recording import Recording, Replay
from physics.io.toml import load_scene, save_scene
from physics.keywords import no_attribute as _no_attribute
from physics.plan.plan import make_plan
from physics.scene import canonical_scenes as scenes
from physics.scene.bodies import Block, Body, Ellipsoid, Hull, Sphere
from physics.scene.capsule import Capsule
from physics.scene.compound import Compound
from physics.scene.cylinder import Cylinder
from physics.scene.effects import Actuator, Contact, Friction, Gravity, RollingFriction, Sleeping, SpinFriction
from physics.scene.force_field import Field, field_function
from physics.scene.force_fields import AngularDrag, Buoyancy, Drag, Magnus, Push, Spring, Wind
from physics.scene.motion import Motion
from physics.scene.scene import HalfSpace, Scene, SceneWarning, corner, three_walls
from physics.scene.sensor import Sensor
from physics.schemes.contacts import Contacts
from physics.version import version as _version
from physics.work_precision.result import Frontier, FrontierPoint
from physics.work_precision.run import frontier, ladder
from physics.work_precision.truth import Truth
from physics.world.impacts import Impacts
from physics.world.nearest import Nearest
from physics.world.ray_hits import RayHits
from physics.world.report import Solver, Status, StepReport
from physics.world.rollout import Rollout, rollout
from physics.world.snapshot import Snapshot
from physics.world.stepper import Stepper
from physics.world.world import World
from physics.world.wrench import wrench_at

__version__ = _version()

__all__ = [
    "PRESETS",
    "Accuracy",
    "Actuator",
    "AngularDrag",
    "Block",
    "Body",
    "Buoyancy",
    "Capsule",
    "Compound",
    "Contact",
    "Contacts",
    "Cylinder",
    "Diagnostics",
    "Drag",
    "Ellipsoid",
    "Event",
    "Field",
    "Friction",
    "Frontier",
    "FrontierPoint",
    "Gravity",
    "HalfSpace",
    "Hull",
    "Impacts",
    "Magnus",
    "Motion",
    "Nearest",
    "Push",
    "RayHits",
    "Recorder",
    "Recording",
    "Replay",
    "RollingFriction",
    "Rollout",
    "Scene",
    "SceneWarning",
    "Sensor",
    "Sleeping",
    "Snapshot",
    "Solver",
    "Sphere",
    "SpinFriction",
    "Spring",
    "Status",
    "StepReport",
    "Stepper",
    "Trajectory",
    "Truth",
    "Wind",
    "World",
    "__version__",
    "corner",
    "diagnose",
    "field_function",
    "frontier",
    "ladder",
    "load_mjcf",
    "load_scene",
    "look_at",
    "make_plan",
    "rollout",
    "save_mjcf",
    "save_scene",
    "scenes",
    "simulate",
    "three_walls",
    "wrench_at",
]


if not TYPE_CHECKING:  # else a type checker would accept every name as an attribute of the module

    def __getattr__(name: str) -> object:
        raise _no_attribute(__name__, name, __all__)
