"""Reader of MJCF files by means of MuJoCo: the model that MuJoCo compiles is converted to a scene."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np

from physics.io.mjcf import forces
from physics.io.mjcf.compiled_bodies import BodyElements, free_bodies
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
    planes, contact = _contact(model, touching, free, left)
    fields = forces.damping(model, free, left)
    effects = [*forces.gravity(model, free, left), *contact.effects, *fields]
    bodies = [replace(each.body, friction=mu) for each, mu in zip(free, contact.bodies)]
    names = {body.name for body in bodies}
    walls = [_wall(model, k, plane, mu, names) for k, (plane, mu) in enumerate(zip(planes, contact.planes))]
    return Scene(bodies, walls, effects)


def _contact(
    model: Model, touching: Touching, free: list[BodyElements], left: LeftOut
) -> tuple[list[int], FoundContact]:
    """Find the numbers of the plane geoms that are walls, and the contact of bodies with them and each other."""
    bodies = [touching.surface(each.geom) for each in free]
    met = _met_planes(model, touching, dict.fromkeys(bodies), left)
    found = find_contact(bodies, [touching.surface(plane) for plane in met], left, touching.friction_of)
    if not found.effects:
        planes = [g for g in _fixed_geoms(model) if _kind(model, g) == "plane"]
        return planes, found._replace(planes=[None] * len(planes))
    for error in touching.faults([*met, *(each.geom for each in free)]):
        left.add(error)
    return met, found


def _kind(model: Model, geom: int) -> str:
    return model.kind("mjtGeom", "mjGEOM_", model.data.geom_type[geom])


def _fixed_geoms(model: Model) -> list[int]:
    m = model.data
    return [g for g in range(m.ngeom) if not model.moves(int(m.geom_bodyid[g]))]


def _met_planes(model: Model, touching: Touching, bodies: dict, left: LeftOut) -> list[int]:
    """Numbers of the fixed plane geoms that a body can touch; other fixed geoms that touch bodies go to `left`."""
    met = []
    for geom in _fixed_geoms(model):
        if not touched(touching.surface(geom), bodies, touching.friction_of):
            continue
        body, kind = int(model.data.geom_bodyid[geom]), _kind(model, geom)
        if kind != "plane":
            left.add(model.error("geom", geom, f"is a fixed {kind}; allowed of the world are planes"))
        elif model.data.body_mocapid[body] >= 0:
            left.add(model.error("geom", geom, "is a plane that is moved by mocap; allowed are planes that stay"))
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
