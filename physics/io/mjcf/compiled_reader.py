"""Reader of MJCF files by means of MuJoCo: the model that MuJoCo compiles is converted to a scene."""

from __future__ import annotations

from operator import itemgetter
from pathlib import Path
from types import ModuleType

import numpy as np

from physics.io.mjcf import forces
from physics.io.mjcf.compiled_bodies import SHAPES, BodyElements, fixed_bodies, free_bodies
from physics.io.mjcf.contacts import contact_effects, touched
from physics.io.mjcf.left_out import LeftOut
from physics.io.mjcf.model import Model, compile_model
from physics.io.mjcf.text import Element, ModelError
from physics.io.mjcf.touching import Touching
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
    met, contact = _contact(model, touching, free, left)
    planes = [geom for geom in met if _kind(model, geom) == "plane"]
    fixed = fixed_bodies(model, [geom for geom in met if geom not in planes], left)
    fields = forces.damping(model, free, left)
    effects = [*forces.gravity(model, free, left), *contact, *fields]
    bodies = sorted([(each.root, each.body) for each in free] + fixed, key=itemgetter(0))
    return Scene([body for _, body in bodies], [_wall(model, plane) for plane in planes], effects)


def _contact(model: Model, touching: Touching, free: list[BodyElements], left: LeftOut) -> tuple[list[int], list]:
    """Find the numbers of the geoms that are walls or fixed bodies, and the effects `Contact` and `Friction`."""
    bodies = [touching.surface(each.geom) for each in free]
    met = _met_geoms(model, touching, dict.fromkeys(bodies), left)
    effects = contact_effects(bodies, [touching.surface(plane) for plane in met], left, touching.friction_of)
    if not effects:
        return [g for g in _fixed_geoms(model) if _kind(model, g) == "plane"], effects
    for error in touching.faults([*met, *(each.geom for each in free)]):
        left.add(error)
    return met, effects


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


def _wall(model: Model, plane: int) -> HalfSpace:
    """Make the wall of a plane geom; bodies are on its +z side."""
    frame, spec = model.geom_frames[plane], model.spec("geom", plane)
    wall = HalfSpace(frame.R[:, 2])
    stated = np.array(spec.alt.zaxis) if spec is not None else np.full(3, np.nan)
    if np.isfinite(stated).all() and stated.any():
        given = HalfSpace(stated)
        if np.abs(np.subtract(given.normal, wall.normal)).max() <= ROTATED:
            wall = given
    return HalfSpace(wall.normal, float(np.array(wall.normal) @ frame.pos))
