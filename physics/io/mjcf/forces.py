"""Forces of a model compiled by MuJoCo: gravity and damping for the scene, and errors for other forces."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from physics.io.mjcf.compiled_bodies import BodyElements, parts_of
from physics.io.mjcf.left_out import LeftOut
from physics.io.mjcf.model import Model
from physics.io.mjcf.text import Element, ModelError
from physics.scene.effects import Gravity
from physics.scene.force_fields import AngularDrag, Drag

ABSENT = {"tendon": "tendons", "actuator": "actuators", "flex": "deformable bodies"}


def absent(model: Model) -> Iterator[ModelError]:
    """Iterate over errors for the elements and options of a model that have no counterpart in a scene."""
    m = model.data
    numbers = {"tendon": m.ntendon, "actuator": model.value("nactuator", m.nu), "flex": m.nflex}
    for kind, number in numbers.items():
        for k in range(number):
            yield model.error(kind, k, f"has no counterpart; a scene has no {ABSENT[kind]}")
    for k in range(m.neq):
        if m.eq_active0[k] and not model.disables("EQUALITY", "CONSTRAINT"):
            yield model.error("equality", k, "has no counterpart; a scene has no equality constraints")
    for b in range(m.nbody):
        if m.body_plugin[b] >= 0:
            yield model.error("body", b, "has a plugin; a scene has none")
    if model.enables("SLEEP"):
        yield _option_error(model, "flag", "sleep", "lets bodies sleep; add physics.Sleeping() to the scene instead")
    if (m.opt.density > 0 or m.opt.viscosity > 0) and not _is_passive_off(model):
        name = "density" if m.opt.density > 0 else "viscosity"
        value = getattr(m.opt, name)
        yield _option_error(model, "option", name, f"has a medium of {name} {value:g}, whose forces a scene has not")


def _is_passive_off(model: Model) -> bool:
    """True if a model disables all passive forces, by a flag of older versions or by disabled springs and dampers."""
    return model.disables("PASSIVE") or (model.disables("SPRING") and model.disables("DAMPER"))


def _option_error(model: Model, tag: str, key: str, message: str) -> ModelError:
    """Make the error about the attribute `key` of an element `tag`, such as <option>, with its line."""
    found: list[Element] = [element for element in model.root.iter(tag) if element.get(key) is not None]
    return ModelError(f"<{tag}> {message}", found[-1].line if found else 0)


def gravity(model: Model, free: list[BodyElements], left: LeftOut) -> list[Gravity]:
    """Make the effect `Gravity`, less the share of gravity that the model compensates; an empty list if none is left.

    If bodies compensate different shares, errors go to `left` and gravity acts in full.
    """
    m = model.data
    if model.disables("GRAVITY"):
        return []
    parts = {each.root: [b for b in parts_of(model, each.root) if m.body_mass[b] > 0] for each in free}
    shares = {float(m.body_gravcomp[b]) for bodies in parts.values() for b in bodies}
    if _is_passive_off(model):
        shares = {0.0}
    if len(shares) > 1:
        for root, bodies in parts.items():
            told = [m.body_gravcomp[b] for b in bodies if m.body_gravcomp[b]]
            if told:
                left.add(model.error("body", root, f"has gravcomp {told[0]:g}, and others differ; allowed is the same"))
        shares = {0.0}
    acceleration = (1.0 - shares.pop()) * m.opt.gravity
    return [Gravity(acceleration)] if acceleration.any() else []


def damping(model: Model, free: list[BodyElements], left: LeftOut) -> list[Any]:
    """Make the effects `Drag` and `AngularDrag` from the damping of the free joints; an empty list if there is none.

    If the damping is not the same for all bodies, errors go to `left` and there is no drag.
    """
    m = model.data
    found = {each.joint: _damping(model, each.joint) for each in free}
    if model.disables("DAMPER", "PASSIVE") or not any(map(np.any, found.values())):
        return []
    first = next(iter(found.values()))
    is_same = all(np.array_equal(each, first) for each in found.values())
    are_centred = all(each.is_centred and not any(each.body.center) for each in free)
    without_axes = "hull", "capsule", "cylinder", "compound"
    are_centred = are_centred and all(each.body.kind not in without_axes for each in free)
    if is_same and are_centred and not first[1:].any():
        return [Drag(0.0, linear=first[0]), AngularDrag(first[0])]
    for joint, value in found.items():
        if value.any():
            allowed = (
                "allowed is one number for all bodies, whose joints are at their centres of mass, without meshes, "
                "capsules, cylinders and bodies of several geoms"
            )
            left.add(model.error("joint", joint, f"has damping {m.dof_damping[m.jnt_dofadr[joint]]:g}; {allowed}"))
    return []


def _damping(model: Model, joint: int) -> np.ndarray:
    """Damping coefficients of a free joint: the linear one, then those of higher order."""
    m = model.data
    dof = int(m.jnt_dofadr[joint])
    return np.append(m.dof_damping[dof], model.value("dof_dampingpoly", np.zeros((m.nv, 0)))[dof])


def joint_faults(model: Model, free: list[BodyElements]) -> Iterator[ModelError]:
    """Iterate over errors for the properties of free joints that a scene cannot hold, such as armature."""
    m = model.data
    tables = {
        "armature": m.dof_armature,
        "frictionloss": None if model.disables("FRICTIONLOSS", "CONSTRAINT") else m.dof_frictionloss,
        "stiffness": None if model.disables("SPRING", "PASSIVE") else m.jnt_stiffness,
        "stiffness of higher order": None
        if model.disables("SPRING", "PASSIVE")
        else model.value("jnt_stiffnesspoly", None),
    }
    for each in free:
        for name, table in tables.items():
            if table is None:
                continue
            k = int(m.jnt_dofadr[each.joint]) if len(table) == m.nv else each.joint
            values = np.ravel(table[k])
            if values.any():
                yield model.error("joint", each.joint, f"has {name} {values[values != 0][0]:g}; allowed is none")
