"""Copies of worlds to look at: with effects declared that sliders change, and carried into another accuracy."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

import physics
from physics import Contact, Friction, Gravity
from physics.accuracy import PRESETS, Accuracy, resolve
from physics.annotations import Preset
from physics.world.snapshot import KEPT

CUSTOM = "custom"
"""Name of an accuracy that is no preset."""

FORGOTTEN = ("memory", "report_table", "sleep")
"""Arrays of a snapshot that another accuracy begins anew: warm starts, reports, sleep."""


def accuracy_name(accuracy: Preset | Accuracy) -> str:
    """Name of the preset that an accuracy is, or `CUSTOM`."""
    settings = resolve(accuracy)
    return next((name for name, preset in PRESETS.items() if preset == settings), CUSTOM)


def declared(scene: physics.Scene) -> physics.Scene:
    """The same scene, with gravity, friction and restitution among its effects, so that each can be changed.

    What is added acts as 0. Friction and restitution belong to contact: a scene without `Contact` does not get them,
    and contact with a stiffness gets no restitution.
    """
    effects = list(scene.effects)
    if scene.effect(Gravity) is None:
        effects.append(Gravity((0.0, 0.0, 0.0)))
    contact = scene.effect(Contact)
    if contact is not None:
        if contact.restitution is None and contact.stiffness is None:
            effects[effects.index(contact)] = replace(contact, restitution=0.0)
        if scene.effect(Friction) is None:
            effects.append(Friction(0.0))
    if effects == list(scene.effects):
        return scene
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", physics.SceneWarning)  # the user has seen it
        return replace(scene, effects=tuple(effects))


def fitted(snapshot: physics.Snapshot, world: physics.World) -> physics.Snapshot:
    """Snapshot for a world of the same scene at another accuracy, or with effects that act as 0 declared.

    States, parameters, gravity, time and actuators are those of `snapshot`; the rest begins anew.
    """
    given, own = (dict(zip(KEPT, each.arrays)) for each in (snapshot, world.snapshot()))
    arrays = [np.zeros_like(own[name]) if name in FORGOTTEN else given[name] for name in own]
    return physics.Snapshot(tuple(arrays), snapshot.time, snapshot.actuation, scene=world.scene_settings)


def copied(world: physics.World, accuracy: Preset | Accuracy | None = None, dt: float | None = None) -> physics.World:
    """World of its own, of one world, in the state of the first world of a batch, in which sliders act.

    It goes on bit by bit as the first world does if the scene, the accuracy and the step are the same.
    """
    scene = declared(world.scene)
    new = physics.World(scene, dt=world.dt if dt is None else dt, accuracy=accuracy or world.accuracy)
    snapshot = world.snapshot(worlds=[0])
    is_same = scene is world.scene and new.accuracy == world.accuracy
    new.restore(snapshot if is_same else fitted(snapshot, new))
    return new


def with_parameters(snapshot: physics.Snapshot, source: physics.World) -> physics.Snapshot:
    """The snapshot with parameters and gravity of another world of the same scene."""
    arrays = dict(zip(KEPT, snapshot.arrays)) | {"params": source.params.copy(), "gravity": source.gravity.copy()}
    return replace(snapshot, arrays=tuple(arrays.values()))


def warm(world: physics.World) -> None:
    """Compile what a viewer calls of a world, by a step that whoever uses the world undoes."""
    world.step()
    physics.diagnose(world)
    world.contacts()
