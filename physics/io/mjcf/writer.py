"""Writer of scenes as MJCF texts.

The frame of a scene's body has its origin at the centre of mass, so the written bodies have `inertial pos="0 0 0"`.
MuJoCo gives the angular velocity of a free joint in the body frame, a scene in the world frame; it is converted here.
The velocities at the start are in a keyframe `start`.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Container
from itertools import product
from typing import Any

import numpy as np

from physics.io.mjcf.capsule_frames import OF_GEOM, WITH_AXIS
from physics.io.mjcf.inexpressible import inexpressible
from physics.io.mjcf.surfaces import Frictions
from physics.rotations import product as quaternion_product
from physics.rotations import rotation_matrices
from physics.scene.bodies import Body
from physics.scene.compound import Compound, PlacedPart
from physics.scene.effects import Contact, Gravity
from physics.scene.force_fields import Spring
from physics.scene.groups import assign_groups, touching_pairs
from physics.scene.scene import Scene

GEOMS = {
    "block": "box", "sphere": "sphere", "ellipsoid": "ellipsoid", "hull": "mesh", "capsule": "capsule",
    "cylinder": "cylinder",
}  # fmt: skip
KEYFRAME = "start"
MOST_BITS = 2**30  # MuJoCo's masks are integers of 32 bits with a sign


def unnamed(b: int) -> str:
    """Name in MJCF of body number `b` of a scene if it has no name of its own."""
    return f"body{b}"


def unnamed_wall(k: int) -> str:
    """Name in MJCF of wall number `k` of a scene if it has no name of its own, and a pair names it."""
    return f"wall{k}"


def wall_name(k: int, name: str | None, taken: Container[str | None]) -> str | None:
    """Name of wall number `k` of a scene, from the name of its geom in MJCF.

    It is None if the geom has no name, one of those that the writer gives, or one that no wall may have: a name
    `taken` by a body, or with characters that do not print.
    """
    if not name or name == unnamed_wall(k) or name in taken or name != name.strip() or not name.isprintable():
        return None
    return name


def geom_name(b: int) -> str:
    """Name in MJCF of the geom of body number `b` of a scene, if a pair names it."""
    return f"geom{b}"


def own_name(name: str) -> str:
    """Name of a geom in MJCF; "" if it is one that the writer gives, of `geom_names`."""
    return "" if re.fullmatch(r"geom\d+(\.\d+)?", name) else name


def geom_names(b: int, body: Body) -> list[str]:
    """Names in MJCF of the geoms of body number `b` of a scene: one, or one for each part of a compound."""
    parts = body.parts if isinstance(body, Compound) else ()
    return [f"{geom_name(b)}.{k}" for k in range(len(parts))] or [geom_name(b)]


def to_mjcf(scene: Scene, drop: bool = False) -> str:
    """Make the MJCF text of a scene; see `save_mjcf` for its contents and for `drop`."""
    lost = inexpressible(scene)
    if lost and not drop:
        raise ValueError(f"MJCF cannot express {', '.join(lost)}; pass drop=True to leave that out")
    root = ET.Element("mujoco", model="scene")
    if lost:
        root.append(ET.Comment(f" left out: {', '.join(lost)} ".replace("--", "- -")))
    ET.SubElement(root, "compiler", angle="radian")
    gravity = scene.effect(Gravity)
    ET.SubElement(root, "option", gravity=_text(gravity.acceleration if gravity else (0, 0, 0)))
    _add_meshes(root, scene)
    world = ET.SubElement(root, "worldbody")
    frictions, touch = Frictions(scene), _masks(scene)
    pairs = list(frictions.exceptions())
    for k, wall in enumerate(scene.walls):
        name = wall.name or (unnamed_wall(k) if pairs else None)
        named: Any = {} if name is None else {"name": name}
        place: Any = {"pos": _text(wall.offset * np.array(wall.normal)), "zaxis": _text(wall.normal), "size": "0 0 1"}
        surface = _surface(frictions.walls[k], frictions)
        ET.SubElement(world, "geom", **named, type="plane", **place, **touch[len(scene.bodies) + k], **surface)
    springs = [effect for effect in scene.effects if isinstance(effect, Spring)]
    _check_names(scene)
    for b, body in enumerate(scene.bodies):
        surface = _surface(frictions.bodies[b], frictions)
        names = geom_names(b, body) if pairs else []
        _add_body(world, b, body, names, {**touch[b], **surface}, springs)
    if pairs:
        _add_pairs(root, scene, pairs)
    if springs:
        _add_springs(root, world, springs)
    _add_keyframe(root, scene)
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def _check_names(scene: Scene) -> None:
    """Raise a ValueError if the name of a body or wall equals the name that the file gives to an unnamed one."""
    for kind, items, name_of in (("bodies", scene.bodies, unnamed), ("walls", scene.walls, unnamed_wall)):
        taken = {name_of(k): k for k, item in enumerate(items) if item.name is None}
        if kind == "walls":
            taken.update({name: b for b, body in enumerate(scene.bodies) for name in geom_names(b, body)})
        for k, item in enumerate(items):
            if item.name in taken:
                raise ValueError(
                    f"Scene.{kind}[{k}] has the name {item.name!r}, which MJCF gives to Scene.{kind}"
                    f"[{taken[item.name]}]; allowed are other names"
                )


def _add_pairs(root: ET.Element, scene: Scene, pairs: list[tuple[int, int, float]]) -> None:
    """Add the pairs (body, other body or -1 - wall, friction) whose friction is not the larger one of their geoms."""
    element = ET.SubElement(root, "contact")
    for body, other, mu in pairs:
        wall = -1 - other
        if other >= 0:
            seconds = geom_names(other, scene.bodies[other])
        else:
            seconds = [scene.walls[wall].name or unnamed_wall(wall)]
        friction: Any = {"condim": "3", "friction": _text((mu, mu, 0, 0, 0))} if mu > 0 else {"condim": "1"}
        for first, second in product(geom_names(body, scene.bodies[body]), seconds):
            ET.SubElement(element, "pair", geom1=first, geom2=second, **friction)


def _add_meshes(root: ET.Element, scene: Scene) -> None:
    """Add a mesh element for each hull, also in a compound, with its corners relative to its centre of mass."""
    named = [(f"hull{b}{k}", part) for b, body in enumerate(scene.bodies) for k, part in _numbered_parts(body)]
    hulls: dict[str, Any] = {name: part for name, part in named if part.kind == "hull"}
    assets: Any = ET.SubElement(root, "asset") if hulls else None
    for name, body in hulls.items():
        ET.SubElement(assets, "mesh", name=name, vertex=_text(body.polyhedron.vertices))


def _numbered_parts(body: Body) -> list[tuple[str, Body]]:
    """Parts of a compound, each with the end of its name in MJCF; of another body the body alone."""
    return [(f".{k}", part) for k, part in enumerate(body.parts)] if isinstance(body, Compound) else [("", body)]


def _text(numbers) -> str:
    """Write numbers as text with all digits, separated by blanks."""
    return " ".join(repr(float(number)) for number in np.ravel(numbers))


def _surface(mu: float, frictions: Frictions) -> dict[str, str]:
    """Attributes of a geom with the friction mu.

    Without friction it has condim 1, since MuJoCo would raise a coefficient of 0 to 1e-5.
    """
    if frictions.is_none:
        return {"condim": "1"}
    return {"condim": "3" if mu > 0 else "1", "friction": _text((mu, 0, 0))}


def _masks(scene: Scene) -> list[dict[str, str]]:
    """Attributes `contype` and `conaffinity` of the geoms of all bodies, then of all walls.

    In MuJoCo two geoms touch if the one mask of either has a bit of the other mask of the other. With a bit for each
    kind of geom, and both masks symmetric, that says the same as groups.

    Raises
    ------
    ValueError
        There are more kinds than bits.
    """
    contact = scene.effect(Contact)
    if contact is None:
        return [{"contype": "0", "conaffinity": "0"}] * (len(scene.bodies) + len(scene.walls))
    of_still, of_moving = {"contype": "0", "conaffinity": "1"}, {"contype": "1"}
    of_moving["conaffinity"] = str(int(contact.between_bodies))
    touching = touching_pairs(scene, contact.between_bodies)
    if touching is None:
        return [of_still if body.fixed else of_moving for body in scene.bodies] + [of_still] * len(scene.walls)
    count, total = touching.shape
    every = np.zeros((total, total), bool)
    every[:count] = touching
    for b, body in enumerate(scene.bodies):  # as another body of its kind
        every[b, b] = contact.between_bodies and not body.fixed and bool(body.group & body.mask)
    found = assign_groups(every | every.T)
    if found is None or max(group for group, _ in found) > MOST_BITS:
        raise ValueError(
            "Scene has bodies and walls of more than 31 kinds, each of which touches others; allowed in MJCF are 31"
        )
    return [{"contype": str(group), "conaffinity": str(mask)} for group, mask in found]


def _add_body(world: ET.Element, b: int, body, names: list[str], surface: dict, springs: list[Spring]) -> None:
    """Add the element of body number `b` in the frame of the scene's body, and sites for its springs.

    `names` are those of its geoms, if any are named; `surface` holds their properties in contact. A fixed body has no
    joint.
    """
    element = ET.SubElement(world, "body", name=body.name or unnamed(b), pos=_text(body.pos), quat=_text(body.quat))
    if not body.fixed:
        ET.SubElement(element, "freejoint")
        I = body.inertia
        full = _text((I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]))
        ET.SubElement(element, "inertial", pos="0 0 0", mass=_text(body.mass), fullinertia=full)
    if isinstance(body, Compound):
        shapes = [_part(placed, f"hull{b}.{k}") for k, placed in enumerate(body.placed_parts)]
    else:
        shapes = [_shape(body, f"hull{b}", np.array(body.center))]
    for k, shape in enumerate(shapes):
        name: Any = {"name": names[k]} if names else {}
        ET.SubElement(element, "geom", **shape, **surface, **name)
    for k, spring in enumerate(springs):
        if spring.body == b:
            ET.SubElement(element, "site", name=f"point{k}", pos=_text(spring.point))
        if spring.other == b:
            ET.SubElement(element, "site", name=f"anchor{k}", pos=_text(spring.anchor))


def _shape(body, mesh: str, pos: np.ndarray, quat: np.ndarray | None = None) -> dict[str, str]:
    """Attributes of the geom of a body or part at `pos` [m], of attitude `quat` (None: that of the body).

    `mesh` is the name of its mesh, if it is a hull.
    """
    size = body.dimensions[:1] if body.kind == "sphere" else body.dimensions
    extent = {"mesh": mesh} if body.kind == "hull" else {"size": _text(size)}
    if body.kind in WITH_AXIS:
        length = body.length if body.kind == "capsule" else body.height
        extent = {"size": _text((body.radius, 0.5 * length))}
        quat = OF_GEOM if quat is None else quaternion_product(quat, OF_GEOM)
    turn = {} if quat is None else {"quat": _text(quat)}
    return {"type": GEOMS[body.kind], **extent, **turn, "pos": _text(pos)}


def _part(placed: PlacedPart, mesh: str) -> dict[str, str]:
    """Attributes of the geom of a part of a compound, with its mass, from which a reader finds the centre of mass."""
    mass = {} if placed.part.fixed else {"mass": _text(placed.part.mass)}
    return {**_shape(placed.part, mesh, placed.place, np.array(placed.part.quat)), **mass}


def _add_springs(root: ET.Element, world: ET.Element, springs: list[Spring]) -> None:
    """Add springs as straight tendons: each from a site of the world, or of another body, to a site of its body."""
    tendons = ET.SubElement(root, "tendon")
    for k, spring in enumerate(springs):
        if spring.other is None:
            ET.SubElement(world, "site", name=f"anchor{k}", pos=_text(spring.anchor))
        law = {"stiffness": spring.stiffness, "damping": spring.damping, "springlength": spring.length}
        line = ET.SubElement(tendons, "spatial", {name: _text(value) for name, value in law.items()})
        for end in ("anchor", "point"):
            ET.SubElement(line, "site", site=f"{end}{k}")


def _add_keyframe(root: ET.Element, scene: Scene) -> None:
    moving = [body for body in scene.bodies if not body.fixed]
    qpos = [(*body.pos, *body.quat) for body in moving]
    qvel = [(*body.linvel, *(rotation_matrices(np.array(body.quat)).T @ body.angvel)) for body in moving]
    keys = ET.SubElement(root, "keyframe")
    ET.SubElement(keys, "key", name=KEYFRAME, qpos=_text(qpos), qvel=_text(qvel))
