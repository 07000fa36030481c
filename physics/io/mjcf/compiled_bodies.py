"""Free bodies of a model compiled by MuJoCo: each is a body with a free joint, and all bodies fixed to it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from physics.io.mjcf.capsule_frames import WITH_AXIS, axis_extents, capsule_frame
from physics.io.mjcf.compounds import DENSITY, PlacedGeom, make_compound, make_fixed_compound
from physics.io.mjcf.left_out import LeftOut
from physics.io.mjcf.model import ORIGIN, Model, Pose
from physics.io.mjcf.shapes import Placed, make_body, make_fixed, make_part
from physics.io.mjcf.text import ModelError
from physics.io.mjcf.touching import Touching
from physics.io.mjcf.writer import own_name, unnamed
from physics.mass.inertia import MassProperties, compose
from physics.rotations import product, rotation_matrices
from physics.scene.bodies import Body

SHAPES = ("box", "sphere", "ellipsoid", "capsule", "cylinder", "mesh")
TURNED = ("box", "ellipsoid")  # shapes whose axes become the body axes in a scene

# MuJoCo finds principal axes by an iteration, older versions to 2e-7. If its tensor agrees with that of the file to
# this share, the tensor of the file is used.
DIAGONALISED = 1e-6
# MuJoCo keeps the corners of a mesh in single precision. Points of the file that agree with them to this share of the
# size are used instead.
SINGLE = 1e-6


class BodyElements(NamedTuple):
    """Body of a scene, and the numbers of the elements of the MuJoCo model from which it was made.

    Attributes
    ----------
    body : Body
        Body of the scene.
    root, joint, geom : int
        Numbers of the model's body, of its free joint, and of the geom that is its shape, of a compound the first one.
    geoms : list of int
        Numbers of all geoms of its shape.
    is_centred : bool
        Whether the joint is at the centre of mass.
    """

    body: Body
    root: int
    joint: int
    geom: int
    geoms: list[int]
    is_centred: bool


def free_bodies(model: Model, touching: Touching, left: LeftOut) -> list[BodyElements]:
    """Convert all free bodies of a model that a scene can hold, in their order; other bodies are added to `left`."""
    found = []
    for number, root in enumerate(_free_roots(model, left)):
        try:
            found.append(_free_body(model, touching, root, number))
        except ModelError as error:
            left.add(error)
    return found


class FixedElement(NamedTuple):
    """Fixed body of a scene, with the numbers of its body, its geom (of a compound the first) and all its geoms."""

    root: int
    geom: int
    geoms: list[int]
    body: Body


def fixed_bodies(model: Model, touching: Touching, geoms: list[int], left: LeftOut) -> list[FixedElement]:
    """Convert fixed geoms to fixed bodies; errors go to `left`.

    A fixed body has the name of its geom, or that of the model's body if this has no other geom. Several geoms of a
    model's body, other than the world, are a compound, unless a geom has a name of its own or differs in contact.
    """
    m, found = model.data, []
    together: dict[int, list[int]] = {}
    for geom in geoms:
        together.setdefault(int(m.geom_bodyid[geom]), []).append(geom)
    for root, members in together.items():
        is_alike = all(touching.are_alike(members[0], geom) for geom in members)
        has_names = any(own_name(model.name("geom", geom)) for geom in members)
        if root > 0 and len(members) > 1 and is_alike and not has_names:
            found += _fixed_compound(model, root, members, left)
        else:
            found += _fixed_geoms(model, members, left)
    return found


def _fixed_compound(model: Model, root: int, geoms: list[int], left: LeftOut) -> list[FixedElement]:
    """Convert the fixed geoms of a model's body to a compound, whose frame is that of the body."""
    frame, name = model.frames[root], model.name("body", root)
    inner = [_placed_geom(model, geom, frame.inverse) for geom in geoms]
    pose = np.concatenate((frame.pos, frame.quat))
    try:
        body = make_fixed_compound(inner, pose, None if name in ("", unnamed(root - 1)) else name)
    except ValueError as error:
        left.add(model.error("body", root, f"in a scene: {error}"))
        return []
    return [FixedElement(root, geoms[0], geoms, body)]


def _fixed_geoms(model: Model, geoms: list[int], left: LeftOut) -> list[FixedElement]:
    """Convert fixed geoms to fixed bodies, one each."""
    m, found = model.data, []
    for geom in geoms:
        root, frame = int(m.geom_bodyid[geom]), model.geom_frames[geom]
        kind = model.kind("mjtGeom", "mjGEOM_", m.geom_type[geom])
        is_only = root > 0 and m.body_geomnum[root] == 1
        name = own_name(model.name("geom", geom)) or (model.name("body", root) if is_only else "")
        if kind == "mesh":
            frame = model.frames[root]
            shape = (_points(model, geom) - frame.pos) @ frame.R
        else:
            shape = _half_axes(kind, m.geom_size[geom])
        pose = np.concatenate((frame.pos, capsule_frame(frame.quat) if kind in WITH_AXIS else frame.quat))
        try:
            body = make_fixed(kind, shape, pose, None if name in ("", unnamed(root - 1)) else name)
            found.append(FixedElement(root, geom, [geom], body))
        except ValueError as error:
            left.add(model.error("geom", geom, f"in a scene: {error}"))
    return found


def parts_of(model: Model, root: int) -> list[int]:
    """Numbers of the model's body `root`, which has a free joint, and of all bodies fixed to it."""
    return np.flatnonzero(model.data.body_weldid == root).tolist()


def _free_roots(model: Model, left: LeftOut) -> Iterator[int]:
    """Iterate over the numbers of bodies with a free joint and no other joint in their tree; add others to `left`."""
    m = model.data
    kinds = [model.kind("mjtJoint", "mjJNT_", kind) for kind in m.jnt_type]
    trees = m.body_rootid[m.jnt_bodyid].tolist()
    number = Counter(trees)
    for j, kind in enumerate(kinds):
        if kind != "free":
            left.add(model.error("joint", j, f"is a {kind}; allowed is one free joint, and no other in its tree"))
        elif number[trees[j]] == 1:
            yield int(m.jnt_bodyid[j])


def _free_body(model: Model, touching: Touching, root: int, number: int) -> BodyElements:
    m = model.data
    parts = parts_of(model, root)
    geoms, mass = _shape(model, touching, root, parts), _mass_properties(model, parts)
    for geom in geoms:
        kind = model.kind("mjtGeom", "mjGEOM_", m.geom_type[geom])
        if kind not in SHAPES:
            raise model.error("geom", geom, f"is a {kind}; allowed of a free body are {', '.join(SHAPES)}")
    geom, joint = geoms[0], int(m.body_jntadr[root])
    frame, (pose, velocity) = model.geom_frames[geom], _start(model, joint)
    name: str | None = model.name("body", root)
    name = None if name in ("", unnamed(number), unnamed(root - 1)) else name
    if len(geoms) > 1:
        try:
            body: Body = make_compound([_placed_geom(model, each) for each in geoms], mass, pose, velocity, name)
        except ValueError as error:
            raise model.error("body", root, f"in a scene: {error}") from None
        return BodyElements(body, root, joint, geom, geoms, not mass.centre.any())
    axes = frame.quat if kind in TURNED else np.array([1.0, 0.0, 0.0, 0.0])
    if kind in WITH_AXIS:
        axes = capsule_frame(frame.quat)
    T = rotation_matrices(axes).T  # from the axes of the model's body to those of the scene's
    if kind == "mesh":
        placed = Placed(kind, _points(model, geom), np.zeros(3), mass)
    else:
        placed = Placed(kind, _half_axes(kind, m.geom_size[geom]), T @ frame.pos, mass.placed(R=T))
    try:
        body = make_body(
            placed,
            np.concatenate((pose[:3], product(pose[3:], axes))),
            np.concatenate((velocity[:3], T @ velocity[3:])),
            name,
        )
    except ValueError as error:
        raise model.error("body", root, f"in a scene: {error}") from None
    return BodyElements(body, root, joint, geom, geoms, not mass.centre.any())


def _placed_geom(model: Model, geom: int, inner: Pose = ORIGIN) -> PlacedGeom:
    """Geom of a body with several geoms, with the mass that the file states, or that of its density [kg].

    `inner` is the pose of the frame of `model.geom_frames` in the frame of the result.
    """
    m, frame, spec = model.data, inner @ model.geom_frames[geom], model.spec("geom", geom)
    kind, pos = model.kind("mjtGeom", "mjGEOM_", m.geom_type[geom]), frame.pos
    quat = capsule_frame(frame.quat) if kind in WITH_AXIS else frame.quat
    if kind == "mesh":
        shape, pos, quat = _points(model, geom), inner.pos, inner.quat
    else:
        shape = _half_axes(kind, m.geom_size[geom])
    stated = np.nan if spec is None else float(spec.mass)
    density = DENSITY if spec is None else float(spec.density)
    part = make_part(kind, shape, pos, quat, {"mass": 1.0})
    return PlacedGeom(kind, shape, pos, quat, density * part.volume if np.isnan(stated) else stated)


def _start(model: Model, joint: int) -> tuple[np.ndarray, np.ndarray]:
    """Pose (7,) and velocity (6,) of a free joint in the model's first keyframe, or in its initial state at rest."""
    m = model.data
    q, v = int(m.jnt_qposadr[joint]), int(m.jnt_dofadr[joint])
    if m.nkey:
        return np.array(m.key_qpos[0, q : q + 7]), np.array(m.key_qvel[0, v : v + 6])
    return np.array(m.qpos0[q : q + 7]), np.zeros(6)


def _shape(model: Model, touching: Touching, root: int, parts: list[int]) -> list[int]:
    """Numbers of the geoms that are the shape of a body: those of its `parts` that can touch, or all of them."""
    m = model.data
    geoms = np.flatnonzero(np.isin(m.geom_bodyid, parts)).tolist()
    able = [g for g in geoms if touching.may_touch(g)]
    if not geoms:
        raise model.error("body", root, "has 0 geoms, with all that is fixed to it; allowed is 1 or more")
    for geom in able:
        if not touching.are_alike(able[0], geom):
            raise model.error("geom", geom, "differs in contact from another geom of its body; allowed are geoms alike")
    return able or geoms


def _mass_properties(model: Model, parts: list[int]) -> MassProperties:
    """Mass, centre of mass and inertia of bodies `parts` that are fixed to each other, in the frame of their joint."""
    m = model.data
    found = [
        MassProperties(m.body_mass[b], m.body_ipos[b], _tensor(model, b)).placed(*_placing(model, b))
        for b in parts
        if m.body_mass[b] > 0
    ]
    return found[0] if len(found) == 1 else compose(found)


def _placing(model: Model, b: int) -> tuple[np.ndarray, np.ndarray]:
    return model.frames[b].pos, model.frames[b].R


def _tensor(model: Model, b: int) -> np.ndarray:
    """Inertia tensor (3, 3) [kg m²] of body `b` about its centre of mass, along the axes of the model's body.

    If the file states a tensor, it is returned with the digits of the file.
    """
    m, spec = model.data, model.spec("body", b)
    R = rotation_matrices(m.body_iquat[b])
    compiled = R @ np.diag(m.body_inertia[b]) @ R.T
    if spec is not None and spec.explicitinertial and np.isfinite(spec.fullinertia).all():
        xx, yy, zz, xy, xz, yz = spec.fullinertia
        stated = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        if np.abs(stated - compiled).max() <= DIAGONALISED * np.abs(compiled).max():
            return stated
    return compiled


def _half_axes(kind: str, size: np.ndarray) -> np.ndarray:
    """Dimensions (3,) [m] of a geom of MuJoCo's `size`: half edges, semi-axes, half extents, or thrice the radius."""
    if kind in WITH_AXIS:
        return axis_extents(kind, size)
    return np.full(3, size[0]) if kind == "sphere" else np.array(size)


def _points(model: Model, geom: int) -> np.ndarray:
    """Corners (n, 3) [m] of the convex hull of a mesh geom, in the frame of the model's body.

    If the file lists the points of the mesh, they are returned with the digits of the file.
    """
    m, mesh, frame = model.data, int(model.data.geom_dataid[geom]), model.geom_frames[geom]
    corners, stated = _corners(model, mesh), model.stated_points(mesh)
    if stated is not None:
        # MuJoCo turns a mesh to its principal axes, in single precision.
        turned = Pose(m.mesh_pos[mesh], m.mesh_quat[mesh])
        distances = np.linalg.norm(stated[:, None] - (turned.pos + corners @ turned.R.T), axis=2)
        if distances.min(axis=0).max() <= SINGLE * np.abs(stated).max():
            frame, corners = frame @ turned.inverse, stated[distances.argmin(axis=0)]
    return frame.pos + corners @ frame.R.T


def _corners(model: Model, mesh: int) -> np.ndarray:
    """Corners (n, 3) [m] of the convex hull of a mesh, in MuJoCo's frame of the mesh; all points if it has no hull."""
    m, start, graph = model.data, int(model.data.mesh_vertadr[mesh]), int(model.data.mesh_graphadr[mesh])
    points = m.mesh_vert[start : start + int(m.mesh_vertnum[mesh])].astype(float)
    if graph < 0:
        return points
    # The graph of a hull: numbers of corners and of faces, an address for each corner, and the corners themselves.
    number = int(m.mesh_graph[graph])
    return points[m.mesh_graph[graph + 2 + number : graph + 2 + 2 * number]]
