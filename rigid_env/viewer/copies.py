"""Copies of worlds for the viewer: with the effects that sliders change, and with another accuracy."""

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
"""Name of an accuracy that equals no preset."""

FORGOTTEN = ("memory", "report_table", "sleep")
"""Arrays of a snapshot that start from zero at another accuracy: warm starts, reports and sleep."""


def accuracy_name(accuracy: Preset | Accuracy) -> str:
    """Name of the preset that an accuracy equals, or `CUSTOM`."""
    settings = resolve(accuracy)
    return next((name for name, preset in PRESETS.items() if preset == settings), CUSTOM)


def declared(scene: physics.Scene) -> physics.Scene:
    """Scene with gravity, friction and restitution among its effects, so that sliders can change each of them.

    Added effects have the value 0. Friction and restitution belong to contact: a scene without `Contact` does not get
    them, and contact with a stiffness gets no restitution.
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
        warnings.simplefilter("ignore", physics.SceneWarning)  # the user's own scene has warned already
        return replace(scene, effects=tuple(effects))


def fitted(snapshot: physics.Snapshot, world: physics.World) -> physics.Snapshot:
    """Convert a snapshot for a world of the same scene that has another accuracy or further effects of value 0.

    States, parameters, gravity, time and actuators are those of `snapshot`; the arrays in `FORGOTTEN` are zero.
    """
    given, own = (dict(zip(KEPT, each.arrays)) for each in (snapshot, world.snapshot()))
    arrays = [np.zeros_like(own[name]) if name in FORGOTTEN else given[name] for name in own]
    return physics.Snapshot(tuple(arrays), snapshot.time, snapshot.actuation, scene=world.scene_settings)


def copied(world: physics.World, accuracy: Preset | Accuracy | None = None, dt: float | None = None) -> physics.World:
    """Copy the first world of a batch into a new batch of one world, whose scene has the effects that sliders change.

    The copy continues bit for bit as the first world does, if accuracy and step stay the same (None) and the scene
    declares these effects already.
    """
    scene = declared(world.scene)
    new = physics.World(scene, dt=world.dt if dt is None else dt, accuracy=accuracy or world.accuracy)
    snapshot = world.snapshot(worlds=[0])
    is_same = scene is world.scene and new.accuracy == world.accuracy
    new.restore(snapshot if is_same else fitted(snapshot, new))
    return new


def with_parameters(snapshot: physics.Snapshot, source: physics.World) -> physics.Snapshot:
    """Copy of a snapshot with the parameters and gravity of the world `source`, which has the same scene."""
    arrays = dict(zip(KEPT, snapshot.arrays)) | {"params": source.params.copy(), "gravity": source.gravity.copy()}
    return replace(snapshot, arrays=tuple(arrays.values()))


def warm(world: physics.World) -> None:
    """Compile everything that a viewer calls of a world by taking one step; the caller restores the state."""
    world.step()
    physics.diagnose(world)
    world.contacts()
