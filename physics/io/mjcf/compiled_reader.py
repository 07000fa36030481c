"""Reader of MJCF files by means of MuJoCo: the model that MuJoCo compiles is converted to a scene."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np

from physics.io.mjcf import forces
from physics.io.mjcf.compiled_bodies import SHAPES, fixed_bodies, free_bodies
from physics.io.mjcf.contacts import FoundContact, find_contact, touched
from physics.io.mjcf.left_out import LeftOut
from physics.io.mjcf.model import Model, compile_model
from physics.io.mjcf.text import Element, ModelError
from physics.io.mjcf.touching import Touching
from physics.io.mjcf.writer import wall_name
from physics.scene.scene import HalfSpace, Scene

# MuJoCo keeps a plane as a rotation. If its normal agrees with that of the file to this share, the latter is used.
ROTATED = 1e-9


def read_scene(mujoco: ModuleType, text: str, root: Element, path: Path | None, left: LeftOut) -> Scene:
    """Compile an MJCF text with MuJoCo, and convert the model to a scene.

    Parameters
    ----------
    mujoco : module
        The package `mujoco`.
    text, root, path
        Arguments of `physics.io.mjcf.model.compile_model`.
    left : LeftOut
        Collects the elements that a scene cannot hold, or raises an error about the first.
    """
    model = compile_model(mujoco, text, root, path)
    for error in forces.absent(model):
        left.add(error)
    touching = Touching(model)
    free = free_bodies(model, touching, left)
    if not free:
        told = f"; of {len(left.messages)} parts left out the first is {left.messages[0]}" if left.messages else ""
        raise ModelError(f"there is no free body that a scene can hold; allowed is at least one{told}")
    for error in forces.joint_faults(model, free):
        left.add(error)
    surfaces = [touching.surface(each.geom) for each in free]
    met = _met_geoms(model, touching, dict.fromkeys(surfaces), left)
    planes = [geom for geom in met if _kind(model, geom) == "plane"]
    fixed = fixed_bodies(model, touching, [geom for geom in met if geom not in planes], left)
    order = sorted(range(len(free) + len(fixed)), key=[each.root for each in (*free, *fixed)].__getitem__)
    ends = [order.index(k) for k in range(len(order))]
    ends[len(free) : len(free)] = [-1 - k for k in range(len(planes))]
    still = [touching.surface(geom) for geom in (*planes, *(each.geom for each in fixed))]
    contact = find_contact(surfaces, still, left, touching.friction_of, ends)
    fields = forces.damping(model, free, left)
    effects = [*forces.gravity(model, free, left), *contact.effects, *fields]
    own = [*contact.bodies, *contact.still[len(planes) :]]
    groups = [contact.groups.get(surface, {}) for surface in (*surfaces, *still[len(planes) :])]
    bodies = [replace((*free, *fixed)[k].body, friction=own[k], **groups[k]) for k in order]
    if contact.effects:
        for error in touching.faults([*planes, *(geom for each in (*free, *fixed) for geom in each.geoms)]):
            left.add(error)
    walls = _walls(model, planes, contact, {body.name for body in bodies})
    if contact.groups:
        walls = [replace(wall, **contact.groups[surface]) for wall, surface in zip(walls, still)]
    return Scene(bodies, walls, effects)


def _walls(model: Model, met: list[int], contact: FoundContact, taken: set) -> list[HalfSpace]:
    """Make the walls of the planes that a body can touch; without contact of all planes."""
    planes = met if contact.effects else [g for g in _fixed_geoms(model) if _kind(model, g) == "plane"]
    frictions = contact.still[: len(met)] if contact.effects else [None] * len(planes)
    return [_wall(model, k, plane, mu, taken) for k, (plane, mu) in enumerate(zip(planes, frictions))]


def _kind(model: Model, geom: int) -> str:
    return model.kind("mjtGeom", "mjGEOM_", model.data.geom_type[geom])


def _fixed_geoms(model: Model) -> list[int]:
    m = model.data
    return [g for g in range(m.ngeom) if not model.moves(int(m.geom_bodyid[g]))]


def _met_geoms(model: Model, touching: Touching, bodies: dict, left: LeftOut) -> list[int]:
    """Numbers of the fixed geoms that a body can touch; those that a scene cannot hold go to `left`."""
    met = []
    for geom in _fixed_geoms(model):
        if not touched(touching.surface(geom), bodies, touching.friction_of):
            continue
        body, kind = int(model.data.geom_bodyid[geom]), _kind(model, geom)
        if kind not in ("plane", *SHAPES):
            allowed = ", ".join(("plane", *SHAPES))
            left.add(model.error("geom", geom, f"is a fixed {kind}; allowed of the world are {allowed}"))
        elif model.data.body_mocapid[body] >= 0:
            left.add(model.error("geom", geom, f"is a {kind} that is moved by mocap; allowed are geoms that stay"))
        else:
            met.append(geom)
    return met


def _wall(model: Model, k: int, plane: int, friction: float | None, taken: set) -> HalfSpace:
    """Make wall number `k` of a plane geom; bodies are on its +z side. It gets no name that is `taken` by a body."""
    frame, spec = model.geom_frames[plane], model.spec("geom", plane)
    wall = HalfSpace(frame.R[:, 2])
    stated = np.array(spec.alt.zaxis) if spec is not None else np.full(3, np.nan)
    if np.isfinite(stated).all() and stated.any():
        given = HalfSpace(stated)
        if np.abs(np.subtract(given.normal, wall.normal)).max() <= ROTATED:
            wall = given
    name = wall_name(k, model.name("geom", plane), taken)
    return HalfSpace(wall.normal, float(np.array(wall.normal) @ frame.pos), name=name, friction=friction)
