"""Hold a scene against MuJoCo's own account of the file that it was read from.

MuJoCo computes masses, inertia, poses, velocities and accelerations of its bodies, and says which geoms touch with what
friction: bodies are put where they must touch, pair by pair. None of it goes through the reader.
"""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import mujoco
import numpy as np

import physics
from physics.rotations import rotation_matrices
from tests.reference.materials import COMBINED

FAR = 1e4  # from all planes and other bodies [m]
MOST_BODIES = 6  # of which pairs are put in touch


def load(text_or_path: str | Path) -> mujoco.MjModel:
    """The compiled model of a text, or of a file."""
    if isinstance(text_or_path, Path):
        return mujoco.MjModel.from_xml_path(str(text_or_path))
    return mujoco.MjModel.from_xml_string(text_or_path)


def free_bodies(model: mujoco.MjModel) -> list[int]:
    """Bodies with a free joint, in their order."""
    return [b for b in range(1, model.nbody) if model.body_dofnum[b] == 6 and model.jnt_type[model.body_jntadr[b]] == 0]


def differences(model: mujoco.MjModel, scene: physics.Scene) -> dict[str, float]:
    """Largest difference of each quantity, relative to its size; of contact: pairs that differ.

    Lengths are relative to 1 m or the size of the body's place, angular velocities to 1 rad/s or their own.
    """
    bodies, found = free_bodies(model), []
    assert len(bodies) == len(scene.bodies)
    data = _started(model)
    for b, body in zip(bodies, scene.bodies):
        found.append(_of_body(model, data, b, body, scene))
    worst = {name: max(row[name] for row in found) for name in found[0]}
    return {**worst, "walls": _of_walls(model, scene), "friction": _of_contact(model, scene)}


def _started(model: mujoco.MjModel) -> mujoco.MjData:
    """The first keyframe, or the model's own start; accelerations without contacts."""
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    flags = int(model.opt.disableflags)
    model.opt.disableflags = flags | int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    mujoco.mj_forward(model, data)
    mujoco.mj_subtreeVel(model, data)
    model.opt.disableflags = flags
    return data


def _of_body(model, data, b: int, body: physics.Block, scene: physics.Scene) -> dict[str, float]:
    R = rotation_matrices(np.array(body.quat))
    mass, centre = float(model.body_subtreemass[b]), data.subtree_com[b]
    inertia = _inertia(model, data, b)
    axes = data.xmat[b].reshape(3, 3)
    dof = model.body_dofadr[b]
    spin, arm = axes @ data.qvel[dof + 3 : dof + 6], centre - data.xpos[b]
    turn = axes @ data.qacc[dof + 3 : dof + 6]
    linvel = data.qvel[dof : dof + 3] + np.cross(spin, arm)
    acceleration = data.qacc[dof : dof + 3] + np.cross(turn, arm) + np.cross(spin, np.cross(spin, arm))
    ours = _acceleration(body, R @ body.inertia @ R.T, scene)
    return {
        "mass": abs(body.mass - mass) / mass,
        "inertia": _off(R @ body.inertia @ R.T, inertia, np.abs(inertia).max()),
        "pose": max(_off(body.pos, centre, max(1.0, np.abs(centre).max())), _shape_off(model, data, b, body, R)),
        "velocity": max(_off(body.linvel, linvel, _size(linvel)), _off(body.angvel, spin, _size(spin))),
        "acceleration": max(
            _off(mine, its, _size(its)) for mine, its in zip(ours, (acceleration, turn), strict=True)
        ),
    }  # fmt: skip


def _off(a, b, size: float) -> float:
    return float(np.abs(np.asarray(a) - b).max() / size)


def _size(vector: np.ndarray) -> float:
    return max(1.0, float(np.abs(vector).max()))


def _inertia(model, data, root: int) -> np.ndarray:
    """(3, 3) inertia about the centre of mass of the body and what is fixed to it, world frame."""
    total = np.zeros((3, 3))
    for b in range(model.nbody):
        if model.body_weldid[b] == root:
            R, d = data.ximat[b].reshape(3, 3), data.xipos[b] - data.subtree_com[root]
            total += R @ np.diag(model.body_inertia[b]) @ R.T + model.body_mass[b] * (
                d @ d * np.eye(3) - np.outer(d, d)
            )
    return total


def _acceleration(body, I: np.ndarray, scene: physics.Scene) -> tuple[np.ndarray, np.ndarray]:
    """Acceleration of the centre of mass, and of the spin, by the laws of the scene's effects."""
    gravity, drag, brake = (scene.effect(kind) for kind in (physics.Gravity, physics.Drag, physics.AngularDrag))
    v, spin = np.array(body.linvel), np.array(body.angvel)
    force = body.mass * np.array(gravity.acceleration if gravity else (0, 0, 0))
    force = force - (drag.linear * v if drag else 0.0)
    torque = -np.cross(spin, I @ spin) - (brake.linear * spin if brake else 0.0)
    return force / body.mass, np.linalg.solve(I, torque)


def _able(model, geoms: list[int]) -> list[int]:
    """Geoms that something can touch, else all."""
    paired = {*map(int, model.pair_geom1), *map(int, model.pair_geom2)}
    return [g for g in geoms if model.geom_contype[g] or model.geom_conaffinity[g] or g in paired] or geoms


def _geoms(model, root: int) -> list[int]:
    return [g for g in range(model.ngeom) if model.body_weldid[model.geom_bodyid[g]] == root]


def _fixed_geoms(model) -> list[int]:
    return [g for g in range(model.ngeom) if not model.body_dofnum[model.body_weldid[model.geom_bodyid[g]]]]


def _shape_off(model, data, b: int, body, R: np.ndarray) -> float:
    """Difference of the shape in its place, of a compound the largest one of a part and its geom, in their order."""
    geoms, pos = _able(model, _geoms(model, b)), np.array(body.pos)
    placed = [(body, pos + R @ body.center, R)]
    if body.kind == "compound":
        placed = [(each.part, pos + R @ each.place, R @ each.R) for each in body.placed_parts]
    return max(_part_off(model, data, g, *each) for g, each in zip(geoms, placed, strict=True))


def _part_off(model, data, geom: int, body, here: np.ndarray, R: np.ndarray) -> float:
    """Difference of a shape in its place: corners of a hull, centre and axes of others."""
    there, axes, size = data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3), model.geom_size[geom]
    scale = max(1.0, float(np.abs(there).max()))
    if body.kind == "hull":
        mesh = model.geom_dataid[geom]
        start = model.mesh_vertadr[mesh]
        points = there + model.mesh_vert[start : start + model.mesh_vertnum[mesh]] @ axes.T
        corners = here + body.polyhedron.vertices @ R.T
        inside = ((points - here) @ R @ body.polyhedron.normals.T).max(axis=0)
        distance = (body.polyhedron.vertices @ body.polyhedron.normals.T).max(axis=0)
        near = np.linalg.norm(corners[:, None] - points[None], axis=2).min(axis=1).max()
        return float(max(near, np.abs(inside - distance).max()) / scale)
    size = np.full(3, size[0]) if body.kind == "sphere" else size
    if body.kind == "capsule":  # radius and half the axis, which is along z there
        size = np.array([size[0], size[0], size[0] + size[1]])
    if body.kind == "cylinder":
        size = np.array([size[0], size[0], size[1]])
    spread, its = R @ np.diag(body.dimensions**2) @ R.T, axes @ np.diag(size**2) @ axes.T
    return max(_off(here, there, scale), _off(spread, its, float(np.max(size) ** 2)))


# contact


def _of_walls(model, scene: physics.Scene) -> float:
    """Difference of the planes that a body touches from the walls; infinite where their number differs."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    planes = [g for g in _fixed_geoms(model) if model.geom_type[g] == mujoco.mjtGeom.mjGEOM_PLANE]
    if scene.effect(physics.Contact):
        planes = [g for g in planes if any(_met(model, b, g) for b in free_bodies(model)[:MOST_BODIES])]
    if len(planes) != len(scene.walls):
        return np.inf
    normals = [data.geom_xmat[g].reshape(3, 3)[:, 2] for g in planes]
    return max(
        (
            max(_off(wall.normal, normal, 1.0), abs(wall.offset - normal @ data.geom_xpos[g]))
            for wall, normal, g in zip(scene.walls, normals, planes)
        ),
        default=0.0,
    )


def _of_contact(model, scene: physics.Scene) -> float:
    """Largest difference of friction between what touches; infinite where MuJoCo and the scene touch differently."""
    bodies = free_bodies(model)[:MOST_BODIES]
    contact, wall, worst = scene.effect(physics.Contact), -1, 0.0
    for geom in _fixed_geoms(model):
        is_plane = model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE
        found = [_met(model, b, geom) for b in bodies]
        wall += is_plane and any(found)  # planes that no body meets are no walls: `_of_walls`
        for b, mu in enumerate(found):
            expected = (
                {_friction(scene, b, -1 - wall)} if contact and is_plane and scene.walls and wall >= 0 else {None}
            )
            worst = max(worst, _friction_off(mu, expected | ({None} if is_plane else set())))
    for (a, one), (b, other) in combinations(enumerate(bodies), 2):
        expected = {_friction(scene, a, b) if contact and contact.between_bodies else None}
        worst = max(worst, _friction_off(_met_bodies(model, one, other), expected))
    return worst


def _friction(scene: physics.Scene, body: int, other: int) -> float:
    """Coefficient of friction of a body and another one, or wall -1 - `other`, in a scene."""
    friction = scene.effect(physics.Friction)
    if friction is None:
        return 0.0
    for one, second, mu in friction.pairs:  # the reader names ends by their indices
        if {one, second} == {body, other}:
            return mu
    own, theirs = (
        item.friction for item in (scene.bodies[body], scene.bodies[other] if other >= 0 else scene.walls[-1 - other])
    )
    if own is None:
        own = friction.coefficient
    if theirs is None:
        return own
    return COMBINED[friction.rule](own, theirs)


def _friction_off(found: set[float], expected: set[float | None]) -> float:
    if not found:
        return 0.0 if None in expected else np.inf
    mu = {value for value in expected if value is not None}
    return max(abs(value - next(iter(mu))) for value in found) if mu else np.inf


def _apart(model) -> mujoco.MjData:
    """Bodies far from each other and from all else."""
    data = mujoco.MjData(model)
    for k, b in enumerate(free_bodies(model)):
        adr = model.jnt_qposadr[model.body_jntadr[b]]
        data.qpos[adr : adr + 3] = np.array([0.37, 0.21, 1.0]) * FAR * (k + 1)
    mujoco.mj_kinematics(model, data)
    return data


def _met(model, b: int, geom: int) -> set[float]:
    """Coefficients of friction of a body with a fixed geom, put in its middle."""
    data = _apart(model)
    adr = model.jnt_qposadr[model.body_jntadr[b]]
    (own, *_) = _able(model, _geoms(model, b))
    data.qpos[adr : adr + 3] += data.geom_xpos[geom] - data.geom_xpos[own]
    return _contacts(model, data, [geom], _geoms(model, b))


def _met_bodies(model, a: int, b: int) -> set[float]:
    """Coefficients of friction of two bodies, one in the other."""
    data = _apart(model)
    at = [model.jnt_qposadr[model.body_jntadr[body]] for body in (a, b)]
    own, other = (_able(model, _geoms(model, body))[0] for body in (a, b))
    data.qpos[at[1] : at[1] + 3] += data.geom_xpos[own] - data.geom_xpos[other] + 1e-3
    return _contacts(model, data, _geoms(model, a), _geoms(model, b))


def _contacts(model, data, some: list[int], others: list[int]) -> set[float]:
    mujoco.mj_fwdPosition(model, data)
    found = set()
    for contact in data.contact:
        pair = {contact.geom1, contact.geom2}
        if pair & set(some) and pair & set(others):
            found.add(0.0 if contact.dim == 1 else float(contact.friction[0]))
    return found
