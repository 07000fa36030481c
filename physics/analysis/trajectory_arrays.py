"""Conversion of events, contacts and a scene's bodies and walls to plain arrays for trajectory files, and back."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from physics.analysis.contact_samples import NAMES, ContactSamples
from physics.analysis.events import Event
from physics.scene.bodies import Block, Body, Ellipsoid, Hull, Sphere
from physics.scene.body_names import body_names
from physics.scene.capsule import Capsule
from physics.scene.compound import Compound
from physics.scene.cylinder import Cylinder
from physics.scene.effects import Contact
from physics.scene.scene import HalfSpace, Scene

EVENTS, CONTACTS, SCENE, PARTS = "event_", "contact_", "scene_", "part_"


def event_arrays(events: Sequence[Event]) -> dict[str, np.ndarray]:
    """Convert events to arrays by name, with a row for each: time, kind, indices of body, wall and other, vectors."""
    vectors = [(event.impulse, event.point, event.normal) for event in events]
    return {
        f"{EVENTS}t": np.array([event.t for event in events], dtype=np.float64),
        f"{EVENTS}kind": np.array([event.kind for event in events], dtype=np.str_),
        f"{EVENTS}ends": np.array([(e.body, e.wall, e.other) for e in events], dtype=np.int64).reshape(-1, 3),
        f"{EVENTS}vectors": np.array(vectors, dtype=np.float64).reshape(-1, 3, 3),
    }


def events_of(parts: Mapping[str, np.ndarray]) -> tuple[Event, ...]:
    """Make events from the arrays of a file; an empty tuple if the file has none."""
    if f"{EVENTS}t" not in parts:
        return ()
    columns = (parts[f"{EVENTS}{name}"].tolist() for name in ("t", "kind", "ends", "vectors"))
    return tuple(
        Event(t, kind, body, wall, tuple(impulse), other, tuple(point), tuple(normal))
        for t, kind, (body, wall, other), (impulse, point, normal) in zip(*columns, strict=True)
    )


def contact_arrays(contacts: ContactSamples | None) -> dict[str, np.ndarray]:
    """Convert contacts to arrays by name, with a row for each contact at each sample; empty if they are unknown."""
    return {} if contacts is None else {f"{CONTACTS}{name}": getattr(contacts, name) for name in NAMES}


def contacts_of_file(parts: Mapping[str, np.ndarray]) -> ContactSamples | None:
    """Make contacts from the arrays of a file; None if the file has none."""
    if f"{CONTACTS}t" not in parts:
        return None
    arrays = [parts[f"{CONTACTS}{name}"] for name in NAMES]
    shape = arrays[0].shape
    if len(shape) != 1 or any(array.shape != (*shape, 3)[: array.ndim] for array in arrays):
        raise ValueError(f"its contacts have the shapes {[array.shape for array in arrays]}")
    return ContactSamples(*arrays)


def scene_arrays(scene: Scene | None) -> dict[str, np.ndarray]:
    """Convert the bodies of a scene, and the walls that act, to arrays by name; empty if the scene is unknown."""
    if scene is None:
        return {}
    walls = scene.walls if scene.effect(Contact) else ()
    return {
        **_shape_arrays(SCENE, scene.bodies),
        f"{SCENE}name": np.array(body_names(scene), dtype=np.str_),
        f"{SCENE}walls": np.array([(*wall.normal, wall.offset) for wall in walls]).reshape(-1, 4),
        **_part_arrays(scene.bodies),
    }


def _shape_arrays(prefix: str, bodies: Sequence[Body]) -> dict[str, np.ndarray]:
    """Arrays of the shapes and mass properties of bodies or parts, by name."""
    corners = [body.polyhedron.vertices if isinstance(body, Hull) else np.zeros((0, 3)) for body in bodies]
    return {
        f"{prefix}kind": np.array([body.kind for body in bodies], dtype=np.str_),
        f"{prefix}mass": np.array([body.mass for body in bodies]),
        f"{prefix}inertia": np.array([body.inertia for body in bodies]),
        f"{prefix}dimensions": np.array([body.dimensions for body in bodies]),
        f"{prefix}center": np.array([body.center for body in bodies]),
        f"{prefix}corners": np.concatenate(corners),
        f"{prefix}corner_counts": np.array([len(each) for each in corners], dtype=np.int64),
    }


def _part_arrays(bodies: Sequence[Body]) -> dict[str, np.ndarray]:
    """Arrays of the parts of all compounds, by name, with the number of their body; empty without compounds."""
    found = [(b, part) for b, body in enumerate(bodies) if isinstance(body, Compound) for part in body.parts]
    if not found:
        return {}
    return {
        **_shape_arrays(PARTS, [part for _, part in found]),
        f"{PARTS}body": np.array([b for b, _ in found], dtype=np.int64),
        f"{PARTS}pos": np.array([part.pos for _, part in found]),
        f"{PARTS}quat": np.array([part.quat for _, part in found]),
    }


def scene_of(parts: Mapping[str, np.ndarray]) -> Scene | None:
    """Make a scene from the bodies and walls in the arrays of a file; None if the file has none."""
    if f"{SCENE}kind" not in parts:
        return None
    labels = parts.get(f"{SCENE}name", np.full(len(parts[f"{SCENE}kind"]), "")).tolist()
    given: list[dict[str, Any]] = [{"name": label or None} for label in labels]
    for b, part in _parts_of(parts):
        given[b].setdefault("parts", []).append(part)
    bodies = _bodies(SCENE, parts, given)
    walls = [HalfSpace(row[:3], row[3]) for row in parts[f"{SCENE}walls"].tolist()]
    return Scene(bodies, walls, [Contact()] if walls else [])


def _parts_of(parts: Mapping[str, np.ndarray]) -> list[tuple[int, Body]]:
    """Parts of all compounds in the arrays of a file, each with the number of its body."""
    if f"{PARTS}body" not in parts:
        return []
    poses = zip(parts[f"{PARTS}pos"].tolist(), parts[f"{PARTS}quat"].tolist(), strict=True)
    found = _bodies(PARTS, parts, [{"pos": pos, "quat": quat} for pos, quat in poses])
    return list(zip(parts[f"{PARTS}body"].tolist(), found, strict=True))


def _bodies(prefix: str, parts: Mapping[str, np.ndarray], given: Sequence[dict[str, Any]]) -> list[Body]:
    """Make bodies or parts from the arrays of a file, each with further arguments `given`."""
    names = ("kind", "mass", "inertia", "dimensions", "center")
    rows = zip(*(parts[f"{prefix}{name}"].tolist() for name in names), strict=True)
    corners = np.split(parts[f"{prefix}corners"], np.cumsum(parts[f"{prefix}corner_counts"])[:-1])
    return [_body(*row, points.tolist(), more) for row, points, more in zip(rows, corners, given, strict=True)]


def _body(kind, mass, inertia, dimensions, center, corners, more) -> Body:
    own = {"fixed": True} if mass == math.inf else {"mass": mass, "inertia_body": inertia}
    given = {**own, **more}
    if kind == "compound":
        return Compound(**given)
    if kind == "block":
        return Block([2.0 * half for half in dimensions], center=center, **given)
    if kind == "sphere":
        return Sphere(dimensions[0], **given)
    if kind == "ellipsoid":
        return Ellipsoid(dimensions, **given)
    if kind == "capsule":
        radius, half = dimensions[:2]
        return Capsule(radius, 2.0 * (half - radius), **given)
    if kind == "cylinder":
        radius, half = dimensions[:2]
        return Cylinder(radius, 2.0 * half, **given)
    if kind == "hull":
        return Hull(corners, **given)
    raise ValueError(f"its scene has a body of kind {kind!r}")
