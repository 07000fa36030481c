"""Reader of MJCF texts without MuJoCo, for the part of MJCF that `save_mjcf` writes.

Elements and attributes in `ELEMENTS` are read. Those in `HARMLESS_ELEMENTS` and `HARMLESS_ATTRIBUTES` do not affect
motion and are skipped. All others are refused.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from physics import validation
from physics.io.mjcf.capsule_frames import WITH_AXIS, axis_extents, capsule_frame
from physics.io.mjcf.compounds import DENSITY, PlacedGeom, make_compound, make_fixed_compound
from physics.io.mjcf.contacts import LEAST_FRICTION, Surface, dynamic_friction, find_contact, touched
from physics.io.mjcf.left_out import LeftOut
from physics.io.mjcf.shapes import Placed, make_body, make_fixed, uniform_moments
from physics.io.mjcf.text import Element, ModelError, label
from physics.io.mjcf.writer import unnamed, wall_name
from physics.mass.inertia import MassProperties, compose, rotate
from physics.optional import INSTALLED_BY
from physics.rotations import product, rotation_matrices
from physics.scene.bodies import Body
from physics.scene.effects import Gravity
from physics.scene.scene import HalfSpace, Scene

DEFAULT_GRAVITY = "0 0 -9.81"  # MuJoCo's default [m/s²]
DEFAULT_FRICTION = "1 0.005 0.0001"  # MuJoCo's defaults for sliding, torsion and rolling

SHAPES = ("box", "sphere", "ellipsoid", "capsule", "cylinder", "mesh")

# For each element that is read: its attributes, and the elements within it.
ELEMENTS: dict[str, tuple[str, str]] = {
    "mujoco": ("model", "compiler option worldbody keyframe asset contact"),
    "compiler": ("angle", ""),
    "option": ("gravity", ""),
    "asset": ("", "mesh"),
    "mesh": ("name vertex", ""),
    "worldbody": ("", "geom body"),
    "body": ("name pos quat", "geom freejoint joint inertial"),
    "freejoint": ("name", ""),
    "joint": ("name type", ""),
    "inertial": ("pos quat mass diaginertia fullinertia", ""),
    "geom": ("name type size pos quat zaxis mesh mass density contype conaffinity condim friction", ""),
    "contact": ("", "pair"),
    "pair": ("name geom1 geom2 condim friction", ""),
    "keyframe": ("", "key"),
    "key": ("name qpos qvel", ""),
}
HARMLESS_ELEMENTS = {
    "camera",
    "custom",
    "light",
    "material",
    "sensor",
    "site",
    "size",
    "statistic",
    "texture",
    "visual",
}
HARMLESS_ATTRIBUTES = {"group", "material", "rgba"}
ABSENT = {"actuator", "deformable", "equality", "tendon"}  # elements without a counterpart in a scene
MANY = {"body", "geom", "joint", "key", "mesh", "pair"}  # elements of which another one may hold several


def read_scene(root: Element) -> Scene:
    """Make a scene from the root element of an MJCF text; ModelError about the first element that is not read."""
    if root.tag != "mujoco":
        raise _unread(root, "is not read; allowed is <mujoco>")
    _check(root)
    world = root.find("worldbody")
    if world is None:
        raise ModelError("<worldbody> is missing", root.line)
    planes = world.findall("geom")
    for plane in planes:
        if _type(plane) != "plane":
            raise _unread(plane, f"of the world is a {_type(plane)}; allowed are planes")
    elements, is_free = world.findall("body"), [_has_joint(body) for body in world.findall("body")]
    if elements and not any(is_free):
        raise _unread(elements[0], "is not a free body, nor is any other; allowed is at least one with a freejoint")
    meshes = {mesh.get("name"): mesh for mesh in root.iterfind("asset/mesh")}
    starts = iter(_starts(root, [element for element, free in zip(elements, is_free) if free]))
    bodies = [
        _body(b, element, meshes, *next(starts)) if free else _fixed_body(b, element, meshes)
        for b, (element, free) in enumerate(zip(elements, is_free))
    ]
    option = root.find("option")
    gravity = _numbers(root if option is None else option, "gravity", 3, DEFAULT_GRAVITY)
    effects = [Gravity(gravity)] if gravity.any() else []
    pairs = _listed_pairs(root)
    groups_of_geoms = [*(element.findall("geom") for element in elements), *([plane] for plane in planes)]
    names, told = _names(groups_of_geoms), {name for pair in pairs for name in pair}
    geoms = [geoms[0] for geoms in groups_of_geoms]
    # only a listed geom has a number: surfaces of all others are equal if their properties are
    surfaces = [_common_surface(geoms, k if told & set(names[k]) else -1) for k, geoms in enumerate(groups_of_geoms)]

    def friction_of(a: Surface, b: Surface) -> float | None:
        listed = _listed(pairs, names[a.geom], names[b.geom]) if a.geom >= 0 and b.geom >= 0 else None
        return dynamic_friction(a, b) if listed is None else listed

    free = [b for b, moves in enumerate(is_free) if moves]
    is_met = [touched(surface, [surfaces[b] for b in free], friction_of) for surface in surfaces]
    walls = [k for k in range(len(elements), len(geoms)) if is_met[k]]
    fixed = [b for b, moves in enumerate(is_free) if not moves and is_met[b]]
    kept = sorted(free + fixed)  # a fixed body that no other one can touch is left out
    ends = [*map(kept.index, free), *(-1 - k for k in range(len(walls))), *map(kept.index, fixed)]
    contact = find_contact(
        [surfaces[b] for b in free], [surfaces[k] for k in walls + fixed], LeftOut(), friction_of, ends
    )
    if not contact.effects:
        kept, walls = list(range(len(bodies))), list(range(len(elements), len(geoms)))
    own = dict(zip([*free, *walls, *fixed], [*contact.bodies, *contact.still])) if contact.effects else {}
    groups = [contact.groups.get(surface, {}) for surface in surfaces]
    bodies = [replace(bodies[b], friction=own.get(b), **groups[b]) for b in kept]
    taken = {body.name for body in bodies}
    half_spaces = [replace(_wall(k, geoms[wall], own.get(wall), taken), **groups[wall]) for k, wall in enumerate(walls)]
    return Scene(bodies, half_spaces, effects + contact.effects)


def _names(groups: list[list[Element]]) -> list[list[str | None]]:
    return [[geom.get("name") for geom in geoms] for geoms in groups]


def _listed(pairs: dict[frozenset[str], float], first: list, second: list) -> float | None:
    """Friction that is listed for the geoms of two bodies, given by their names; None: none is listed.

    Raises
    ------
    ModelError
        The list says different things about the geoms of a body.
    """
    found = {pairs.get(frozenset((a, b))) for a in first for b in second}
    if len(found) > 1:
        raise ModelError(f"<pair> elements of the geoms {first} and {second} differ; allowed is the same for a body", 0)
    return found.pop()


def _common_surface(geoms: list[Element], number: int) -> Surface:
    """Contact properties of the geoms of a body, which must be equal."""
    found = [_surface(geom, number) for geom in geoms]
    for geom, surface in zip(geoms, found):
        if surface != found[0]:
            raise _unread(geom, "differs in contact from another geom of its body; allowed are geoms alike")
    return found[0]


def _listed_pairs(root: Element) -> dict[frozenset[str], float]:
    """Friction of the pairs of geoms that the text lists, by the names of both."""
    known, found = {geom.get("name") for geom in root.iterfind("worldbody//geom")} - {None}, {}
    for pair in root.iterfind("contact/pair"):
        for key in ("geom1", "geom2"):
            if pair.get(key) not in known:
                names = ", ".join(sorted(map(str, known))) or "none"
                raise _error(pair, f"has {key}={pair.get(key)!r}; allowed are the names of geoms: {names}")
        needed = ("condim", "friction") if pair.get("condim") != "1" else ("condim",)
        for key in needed:
            if pair.get(key) is None:
                raise _unread(pair, f"has no {key}; allowed is one, since versions of MuJoCo differ in its default")
        mu = 0.0
        if _condim(pair, 0) == 3:
            numbers = _numbers(pair, "friction", 5, least=2)
            mu = max(LEAST_FRICTION, float(numbers[0]))
            if numbers[0] != numbers[1]:
                raise _error(pair, f"has friction={pair.get('friction')!r}; allowed are two equal coefficients")
        found[frozenset((pair.get("geom1"), pair.get("geom2")))] = mu
    return found


def _label(element: Element) -> str:
    return label(element.tag, element.get("name"))


def _error(element: Element, message: str) -> ModelError:
    return ModelError(f"{_label(element)} {message}", element.line)


def _unread(element: Element, message: str) -> ModelError:
    """Make the error about an element that this reader does not read; it advises to install MuJoCo."""
    return _error(element, f"{message}; load_mjcf reads more where MuJoCo is installed: {INSTALLED_BY['mujoco'][1]}")


def _type(geom: Element) -> str:
    return geom.get("type", "sphere")


def _check(element: Element) -> None:
    """Raise an error if an element, or any element within it, is not read here or has an attribute that is not."""
    attributes, children = (text.split() for text in ELEMENTS[element.tag])
    for key, value in element.attrib.items():
        if key not in attributes and key not in HARMLESS_ATTRIBUTES:
            raise _unread(
                element, f"has {key}={value!r}, which is not read; allowed are {', '.join(attributes) or 'none'}"
            )
    found = set()
    for child in element:
        if child.tag in HARMLESS_ELEMENTS:
            continue
        if child.tag in ABSENT:
            raise _error(child, f"in {_label(element)} has no counterpart in a scene; allowed is a model without it")
        if child.tag not in children:
            raise _unread(child, f"in {_label(element)} is not read; allowed are {', '.join(children) or 'none'}")
        if child.tag in found - MANY:
            raise _unread(child, f"stands in {_label(element)} twice; allowed is one")
        found.add(child.tag)
        _check(child)


def _numbers(element: Element, key: str, count: int, default: str | None = None, least: int = 0) -> np.ndarray:
    """Read the attribute `key` of an element as `count` finite numbers, or with `least` as `least` to `count` numbers.

    `default` is the text that a missing attribute stands for. Other contents raise a ModelError.
    """
    text = element.get(key, default)
    several = f"are {least} to {count} finite numbers" if least else f"are {count} finite numbers"
    allowed = "is one finite number" if count == 1 else several
    try:
        found = np.array(text.split(), dtype=np.float64)
    except (AttributeError, ValueError):
        found = np.empty(0)
    if not (least or count) <= len(found) <= count or not np.isfinite(found).all():
        raise ModelError(f"{key} of {_label(element)} is {text!r}; allowed {allowed}", element.line)
    return found


def _integer(element: Element, key: str, default: int) -> int:
    """Read the attribute `key` of an element as an integer; `default` if the element lacks it."""
    text = element.get(key, str(default))
    try:
        return int(text)
    except ValueError:
        raise ModelError(f"{key} of {_label(element)} is {text!r}; allowed is an integer", element.line) from None


def _refuse(element: Element, *keys: str) -> None:
    for key in keys:
        if element.get(key) is not None:
            raise _unread(element, f"has {key}={element.get(key)!r}, which is not read here; allowed is none")


def _wall(k: int, plane: Element, friction: float | None, taken: set) -> HalfSpace:
    """Make wall number `k` of a plane geom; bodies are on its +z side. It gets no name that is `taken` by a body."""
    _refuse(plane, "mesh")
    if plane.get("quat") is not None:
        _refuse(plane, "zaxis")
    normal = rotation_matrices(_unit(plane))[:, 2]
    if plane.get("zaxis") is not None:
        normal = _numbers(plane, "zaxis", 3)
    wall = HalfSpace(normal)
    offset, name = (
        float(np.array(wall.normal) @ _numbers(plane, "pos", 3, "0 0 0")),
        wall_name(k, plane.get("name"), taken),
    )
    return HalfSpace(wall.normal, offset, name=name, friction=friction)


def _unit(element: Element) -> np.ndarray:
    """Read the quaternion (4,) of an element and normalise it; as in MuJoCo it may have any norm but zero."""
    return _normalised(element, _numbers(element, "quat", 4, "1 0 0 0"))


def _normalised(element: Element, q: np.ndarray) -> np.ndarray:
    norm = np.linalg.norm(q)
    if not 0 < norm < np.inf:
        raise _error(element, f"has the quaternion {q.tolist()} of norm {norm:g}; allowed is any norm but 0")
    return validation.unit(q, norm)


def _starts(root: Element, elements: list[Element]) -> list[tuple[np.ndarray, np.ndarray]]:
    """Pose (7,) and velocity (6,) of each body at the start, in the form of MuJoCo's qpos and qvel.

    They come from the first keyframe if there is one, else from the body elements, at rest.
    """
    key = root.find("keyframe/key")
    poses = [np.concatenate((_numbers(e, "pos", 3, "0 0 0"), _unit(e))) for e in elements]
    velocities = np.zeros((len(elements), 6))
    if key is not None and key.get("qpos") is not None:
        rows = _numbers(key, "qpos", 7 * len(elements)).reshape(-1, 7)
        poses = [np.concatenate((row[:3], _normalised(key, row[3:]))) for row in rows]
    if key is not None and key.get("qvel") is not None:
        velocities = _numbers(key, "qvel", 6 * len(elements)).reshape(-1, 6)
    return list(zip(poses, velocities))


def _has_joint(element: Element) -> bool:
    """True if a body element has a joint; else it is fixed."""
    return element.find("freejoint") is not None or element.find("joint") is not None


def _fixed_body(b: int, element: Element, meshes: dict) -> Body:
    """Make a fixed body from body element number `b`, which has no joint."""
    pose, name = np.concatenate((_numbers(element, "pos", 3, "0 0 0"), _unit(element))), _name(b, element)
    if len(element.findall("geom")) > 1:
        try:
            return make_fixed_compound(_placed_geoms(element, meshes), pose, name)
        except ValueError as error:
            raise _error(element, f"in a scene: {error}") from None
    geom, kind, shape = _only_geom(element, meshes)
    arm = _numbers(geom, "pos", 3, "0 0 0")
    pose[:3] += rotation_matrices(pose[3:]) @ arm
    if kind in WITH_AXIS:
        pose[3:] = product(pose[3:], capsule_frame(_unit(geom)))
    try:
        return make_fixed(kind, shape, pose, name)
    except ValueError as error:
        raise _error(element, f"in a scene: {error}") from None


def _name(b: int, element: Element) -> str | None:
    """Name of body element number `b`, None if it has none or one that the writer gives."""
    name = element.get("name")
    return None if name in (None, "", unnamed(b)) else name


def _placed_geoms(element: Element, meshes: dict) -> list[PlacedGeom]:
    """Geoms of a body element that has several, each with its mass."""
    found = []
    for geom in element.findall("geom"):
        kind = _type(geom)
        if kind not in SHAPES:
            raise _unread(geom, f"is a {kind}; allowed are {', '.join(SHAPES)}")
        _refuse(geom, "zaxis", *(("size", "density") if kind == "mesh" else ("mesh",)))
        shape, quat = _points(geom, meshes) if kind == "mesh" else _half_axes(geom), _unit(geom)
        turn = capsule_frame(quat) if kind in WITH_AXIS else quat
        mass = 0.0
        if kind == "mesh" and geom.get("mass") is not None:
            mass = float(_numbers(geom, "mass", 1)[0])
        elif kind != "mesh":
            mass = _mass_of(geom, kind, shape)
        found.append(PlacedGeom(kind, shape, _numbers(geom, "pos", 3, "0 0 0"), turn, mass))
    return found


def _only_geom(element: Element, meshes: dict) -> tuple[Element, str, np.ndarray]:
    """Find the only geom of a body element that has at most one: the geom, its kind, its half axes or points [m]."""
    geoms = element.findall("geom")
    if len(geoms) != 1:
        raise _unread(element, "has 0 geoms; allowed is one or more")
    geom, kind = geoms[0], _type(geoms[0])
    if kind not in SHAPES:
        raise _unread(geom, f"is a {kind}; allowed are {', '.join(SHAPES)}")
    _refuse(geom, "zaxis", *(("size", "density") if kind == "mesh" else ("mesh",)))
    if kind not in WITH_AXIS:
        _refuse(geom, "quat")
    return geom, kind, _points(geom, meshes) if kind == "mesh" else _half_axes(geom)


def _body(b: int, element: Element, meshes: dict, pose: np.ndarray, velocity: np.ndarray) -> Body:
    """Make the scene's body from body element number `b`, its pose (7,) and velocity (6,) at the start.

    The axes stay those of the element; the origin moves to the centre of mass.
    """
    joints = element.findall("freejoint") + [j for j in element.findall("joint") if j.get("type") == "free"]
    if len(joints) != 1 or len(element.findall("joint")) + len(element.findall("freejoint")) != 1:
        raise _unread(element, "is not a free body; allowed is one freejoint and no other")
    name = _name(b, element)
    if len(element.findall("geom")) > 1:
        geoms = _placed_geoms(element, meshes)
        try:
            return make_compound(geoms, _mass_of_several(element, geoms), pose, velocity, name)
        except ValueError as error:
            raise _error(element, f"in a scene: {error}") from None
    geom, kind, shape = _only_geom(element, meshes)
    placed = Placed(kind, shape, _numbers(geom, "pos", 3, "0 0 0"), _mass_properties(element, geom, shape))
    if kind in WITH_AXIS:
        axes = capsule_frame(_unit(geom))
        T = rotation_matrices(axes).T  # from the axes of the element to those of the scene's body
        placed = placed._replace(pos=T @ placed.pos, mass=placed.mass.placed(R=T))
        pose = np.concatenate((pose[:3], product(pose[3:], axes)))
        velocity = np.concatenate((velocity[:3], T @ velocity[3:]))
    try:
        return make_body(placed, pose, velocity, name)
    except ValueError as error:
        raise _error(element, f"in a scene: {error}") from None


def _points(geom: Element, meshes: dict) -> np.ndarray:
    """Points (n, 3) [m] of the mesh of a geom, in the frame of the geom."""
    mesh = meshes.get(geom.get("mesh"))
    if mesh is None:
        known = ", ".join(map(repr, meshes)) or "none"
        raise _error(geom, f"has the mesh {geom.get('mesh')!r}; allowed are those of <asset>: {known}")
    count = len(mesh.get("vertex", "").split())
    return _numbers(mesh, "vertex", max(count - count % 3, 12)).reshape(-1, 3)


def _half_axes(geom: Element) -> np.ndarray:
    """Dimensions (3,) [m] of a geom: half edges, semi-axes, half extents, or three times the radius."""
    if _type(geom) in WITH_AXIS:
        return axis_extents(_type(geom), _numbers(geom, "size", 2))
    return np.resize(_numbers(geom, "size", 1 if _type(geom) == "sphere" else 3), 3)


def _mass_properties(element: Element, geom: Element, shape: np.ndarray) -> MassProperties:
    """Mass, centre of mass and inertia tensor of a body element, in its frame; from its geom if it states none."""
    inertial = element.find("inertial")
    return _of_geom(geom, shape) if inertial is None else _stated(inertial)


def _mass_of_several(element: Element, geoms: list[PlacedGeom]) -> MassProperties:
    """Mass properties of a body element with several geoms, in its frame; those of its geoms if it states none."""
    inertial = element.find("inertial")
    if inertial is not None:
        return _stated(inertial)
    for geom in geoms:
        if geom.kind == "mesh":
            raise _unread(element, "has a mesh, and no <inertial>; allowed is a body with it")
    return compose([
        MassProperties(g.mass, np.zeros(3), np.diag(uniform_moments(g.kind, g.shape, g.mass))).placed(
            g.pos, rotation_matrices(g.quat)
        )
        for g in geoms
    ])  # fmt: skip


def _stated(inertial: Element) -> MassProperties:
    """Mass properties that an element <inertial> states, in the frame of its body."""
    R = rotation_matrices(_unit(inertial))
    if inertial.get("fullinertia") is not None:
        _refuse(inertial, "diaginertia", "quat")
        a, b, c, d, e, f = _numbers(inertial, "fullinertia", 6)
        tensor = np.array([[a, d, e], [d, b, f], [e, f, c]])
    else:
        tensor = R @ np.diag(_numbers(inertial, "diaginertia", 3)) @ R.T
    mass, centre = _numbers(inertial, "mass", 1)[0], _numbers(inertial, "pos", 3)
    return MassProperties(mass, centre, tensor)


def _of_geom(geom: Element, shape: np.ndarray) -> MassProperties:
    """Mass properties of a geom with uniform density, in the frame of its body."""
    if _type(geom) == "mesh":
        raise _unread(geom, "is a mesh of a body without <inertial>; allowed is a body with it")
    kind = _type(geom)
    mass = _mass_of(geom, kind, shape)
    inertia = np.diag(uniform_moments(kind, shape, mass))
    if kind in WITH_AXIS:
        inertia = rotate(inertia, rotation_matrices(capsule_frame(_unit(geom))))
    return MassProperties(mass, _numbers(geom, "pos", 3, "0 0 0"), inertia)


def _mass_of(geom: Element, kind: str, shape: np.ndarray) -> float:
    """Mass of a geom that is no mesh [kg], stated or that of its density."""
    if geom.get("mass") is not None:
        mass = float(_numbers(geom, "mass", 1)[0])
    else:
        volume = float(np.prod(shape)) * (8.0 if kind == "box" else 4 * np.pi / 3)
        if kind == "cylinder":
            volume = float(2 * np.pi * shape[0] ** 2 * shape[1])
        elif kind == "capsule":
            volume = float(np.pi * shape[0] ** 2 * (2 * (shape[1] - shape[0]) + 4 / 3 * shape[0]))
        mass = volume * float(_numbers(geom, "density", 1, str(DENSITY))[0])
    if not mass > 0:
        raise _error(geom, f"has the mass {mass:g}; allowed is more than 0")
    return mass


def _condim(element: Element, default: int) -> int:
    condim = _integer(element, "condim", default)
    if condim not in (1, 3):
        raise _error(element, f"has condim {condim}; allowed are 1 and 3")
    return condim


def _surface(geom: Element, number: int) -> Surface:
    return Surface(
        _label(geom),
        geom.line,
        _integer(geom, "contype", 1),
        _integer(geom, "conaffinity", 1),
        _condim(geom, 3),
        float(_numbers(geom, "friction", 3, DEFAULT_FRICTION, least=1)[0]),
        geom=number,
    )
