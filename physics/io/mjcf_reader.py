"""From the elements of an MJCF file to a scene; see `physics.io.mjcf`."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np

from physics import validation
from physics.mass.inertia import block_moments, ellipsoid_moments
from physics.rotations import rotation_matrices
from physics.scene.bodies import Block, Body, Ellipsoid, Sphere
from physics.scene.effects import Contact, Friction, Gravity
from physics.scene.scene import HalfSpace, Scene

DENSITY = 1000.0  # MuJoCo's default [kg/m³]
GRAVITY = "0 0 -9.81"  # likewise
FRICTION = "1 0.005 0.0001"  # likewise: sliding, torsion, rolling

# Inertia that is the uniform body's to rounding of its text and of a rotation there and back.
UNIFORM = 1e-12

SHAPES = ("box", "sphere", "ellipsoid")

KNOWN = {
    "mujoco": {"compiler", "option", "worldbody", "keyframe", "visual", "asset", "statistic", "size"},
    "worldbody": {"geom", "body", "light", "camera"},
    "body": {"geom", "freejoint", "joint", "inertial", "site"},
}


def unnamed(b: int) -> str:
    """Name in MJCF of body `b` of a scene if it has none there."""
    return f"body{b}"


def read_scene(root: ET.Element) -> Scene:
    """The scene of a model's root element."""
    _check_children(root, "mujoco")
    world = root.find("worldbody")
    if world is None:
        raise ValueError("<worldbody> is missing")
    _check_children(world, "worldbody")
    planes = world.findall("geom")
    for plane in planes:
        if _type(plane) != "plane":
            raise ValueError(f"{_name(plane)} of the world is a {_type(plane)}; allowed are planes")
    elements = world.findall("body")
    velocities = _velocities(root, len(elements))
    bodies = [_body(b, element, velocity) for b, (element, velocity) in enumerate(zip(elements, velocities))]
    option = root.find("option")
    gravity = _numbers(root if option is None else option, "gravity", GRAVITY, 3)
    effects = [Gravity(gravity)] if gravity.any() else []
    return Scene(bodies, [_wall(plane) for plane in planes], effects + _contact_effects(elements, planes))


def _name(element: ET.Element) -> str:
    return f"<{element.tag}{' ' + repr(element.get('name')) if element.get('name') else ''}>"


def _type(geom: ET.Element) -> str:
    return geom.get("type", "sphere")


def _check_children(element: ET.Element, kind: str) -> None:
    for child in element:
        if child.tag not in KNOWN[kind]:
            raise ValueError(
                f"{_name(child)} in {_name(element)} has no counterpart; allowed are {sorted(KNOWN[kind])}"
            )


def _numbers(element: ET.Element, key: str, default: str | None, count: int) -> np.ndarray:
    """`count` numbers of an attribute, or the first `count` of more."""
    text = element.get(key, default)
    try:
        found = np.array(text.split(), dtype=np.float64)
    except (AttributeError, ValueError):
        raise ValueError(f"{key} of {_name(element)} is {text!r}; allowed are {count} numbers") from None
    if len(found) < count or not np.isfinite(found).all():
        raise ValueError(f"{key} of {_name(element)} is {text!r}; allowed are {count} finite numbers")
    return found[:count]


def _integer(element: ET.Element, key: str, default: int) -> int:
    """An integer of an attribute."""
    text = element.get(key, str(default))
    try:
        return int(text)
    except ValueError:
        raise ValueError(f"{key} of {_name(element)} is {text!r}; allowed is an integer") from None


def _refuse(element: ET.Element, *keys: str) -> None:
    for key in keys:
        if element.get(key) is not None:
            raise ValueError(f"{key} of {_name(element)} is not read; allowed are pos, quat, and zaxis of a plane")


def _wall(plane: ET.Element) -> HalfSpace:
    """A plane's free side is its +z."""
    _refuse(plane, "euler", "axisangle", "xyaxes", "fromto")
    normal = rotation_matrices(_unit(plane))[:, 2]
    if plane.get("zaxis") is not None:
        normal = _numbers(plane, "zaxis", None, 3)
    wall = HalfSpace(normal)
    return HalfSpace(wall.normal, float(np.array(wall.normal) @ _numbers(plane, "pos", "0 0 0", 3)))


def _unit(element: ET.Element) -> np.ndarray:
    """The quaternion of an element, normalised: as in MuJoCo it may have any norm but zero."""
    q = _numbers(element, "quat", "1 0 0 0", 4)
    norm = np.linalg.norm(q)
    if not 0 < norm < np.inf:
        raise ValueError(f"quat of {_name(element)} is {element.get('quat')!r} of norm {norm:g}; allowed is any but 0")
    return validation.unit(q, norm)


def _body(b: int, element: ET.Element, velocity: np.ndarray) -> Body:
    """A free body; the scene's frame has its axes, and its origin at the centre of mass."""
    _check_children(element, "body")
    _refuse(element, "euler", "axisangle", "xyaxes", "zaxis")
    joints = element.findall("joint")
    if len(element.findall("freejoint")) + sum(joint.get("type") == "free" for joint in joints) != 1 or any(
        joint.get("type") != "free" for joint in joints
    ):
        raise ValueError(f"{_name(element)} is not a free body; allowed is one freejoint and no other")
    geoms = element.findall("geom")
    if len(geoms) != 1:
        raise ValueError(f"{_name(element)} has {len(geoms)} geoms; allowed is one")
    if _type(geoms[0]) not in SHAPES:
        raise ValueError(f"{_name(geoms[0])} is a {_type(geoms[0])}; allowed are {', '.join(SHAPES)}")
    quat = _unit(element)
    R = rotation_matrices(quat)
    mass, inertia, centre = _mass_properties(element, geoms[0])
    arm = _numbers(geoms[0], "pos", "0 0 0", 3) - centre
    start = {
        "pos": _numbers(element, "pos", "0 0 0", 3) + R @ centre, "quat": quat,
        # MuJoCo's velocity is that of the frame's origin.
        "linvel": velocity[:3] + R @ np.cross(velocity[3:], centre), "angvel": R @ velocity[3:],
        "name": None if element.get("name") in (None, "", unnamed(b)) else element.get("name"),
    }  # fmt: skip
    return _shape(geoms[0], mass, inertia, arm, start)


def _shape(geom: ET.Element, mass: float, inertia: np.ndarray | None, arm: np.ndarray, start: dict) -> Body:
    """The body of a geom; its inertia is stated where it is not that of uniform density."""
    half = _half_axes(geom)
    moments = block_moments(2 * half, mass) if _type(geom) == "box" else ellipsoid_moments(half, mass)
    if inertia is not None and (arm.any() or np.abs(inertia - np.diag(moments)).max() > UNIFORM * moments.max()):
        start = {**start, "inertia_body": inertia}
    if _type(geom) == "box":
        return Block(tuple(2 * half), mass, center=arm, **start)
    if arm.any():
        raise ValueError(f"{_name(geom)} is not at the centre of mass; allowed is that only of a box")
    if _type(geom) == "sphere":
        return Sphere(float(half[0]), mass, **start)
    return Ellipsoid(tuple(half), mass, **start)


def _half_axes(geom: ET.Element) -> np.ndarray:
    """Half edges, semi-axes, or the radius three times [m]."""
    return np.resize(_numbers(geom, "size", None, 1 if _type(geom) == "sphere" else 3), 3)


def _mass_properties(element: ET.Element, geom: ET.Element) -> tuple[float, np.ndarray | None, np.ndarray]:
    """(mass, inertia in the body's axes or None for uniform density, centre of mass in the body's frame)."""
    _refuse(geom, "quat", "euler", "axisangle", "xyaxes", "zaxis", "fromto", "fitscale")
    inertial = element.find("inertial")
    if inertial is None:
        volume = float(np.prod(_half_axes(geom))) * (8.0 if _type(geom) == "box" else 4 * np.pi / 3)
        if geom.get("mass") is not None:
            mass = float(_numbers(geom, "mass", None, 1)[0])
        else:
            mass = volume * float(_numbers(geom, "density", str(DENSITY), 1)[0])
        return mass, None, _numbers(geom, "pos", "0 0 0", 3)
    _refuse(inertial, "euler", "axisangle", "xyaxes", "zaxis")
    R = rotation_matrices(_unit(inertial))
    if inertial.get("fullinertia") is not None:
        a, b, c, d, e, f = _numbers(inertial, "fullinertia", None, 6)
        tensor = np.array([[a, d, e], [d, b, f], [e, f, c]])
    else:
        tensor = np.diag(_numbers(inertial, "diaginertia", None, 3))
    return _numbers(inertial, "mass", None, 1)[0], R @ tensor @ R.T, _numbers(inertial, "pos", None, 3)


def _velocities(root: ET.Element, count: int) -> np.ndarray:
    """(count, 6) velocities of the first keyframe: of the frame's origin in the world, angular in the body."""
    key = root.find("keyframe/key")
    if key is None or key.get("qvel") is None:
        return np.zeros((count, 6))
    return _numbers(key, "qvel", None, 6 * count).reshape(count, 6)


def _contact_effects(elements: list[ET.Element], planes: list[ET.Element]) -> list:
    """Contact and friction of all bodies; MuJoCo takes the larger friction of two."""
    geoms = [element.find("geom") for element in elements]
    with_planes = {_pair(geom, plane) for geom in geoms for plane in planes}
    with_bodies = {_pair(a, b) for a in geoms for b in geoms}
    for found, what in ((with_planes, "planes"), (with_bodies, "bodies")):
        if len(found) > 1:
            told = f"pairs of bodies and {what} differ in contact or friction: {sorted(found)}"
            raise ValueError(f"{told}; allowed is one")
    between, mu_between = with_bodies.pop() if with_bodies else (False, 0.0)
    meets, mu = with_planes.pop() if with_planes else (False, 0.0)
    if not meets:
        mu = mu_between
    elif between and mu_between != mu:
        raise ValueError(f"friction is {mu} with planes, {mu_between} between bodies; allowed is one")
    if not meets and not (between and len(geoms) > 1):
        return []
    return [Contact(between_bodies=between)] + ([Friction(mu)] if mu > 0 else [])


def _pair(a: ET.Element, b: ET.Element) -> tuple[bool, float]:
    """(whether two geoms touch each other, their friction)."""
    (own, mine), (other, its) = ((_integer(g, "contype", 1), _integer(g, "conaffinity", 1)) for g in (a, b))
    if not (own & its or other & mine):
        return False, 0.0
    if max(_integer(g, "condim", 3) for g in (a, b)) == 1:
        return True, 0.0
    return True, float(max(_numbers(g, "friction", FRICTION, 1)[0] for g in (a, b)))
