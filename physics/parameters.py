"""Rows of physical parameters, as the kernels read them, from bodies and from per-world values."""

from __future__ import annotations

import numpy as np

from physics import checks
from physics.inertia import check_inertia, principal_axes
from physics.kernels import layout as at
from physics.kernels.rotation import attitude_series
from physics.scene import HalfSpace


def quaternion_of(R: np.ndarray) -> np.ndarray:
    """Unit quaternion (w, x, y, z), w >= 0, of a rotation matrix, by the largest of its four components."""
    trace = np.trace(R)
    four = np.array([trace, R[0, 0], R[1, 1], R[2, 2]])
    largest = int(np.argmax(four))
    q = np.empty(4)
    if largest == 0:
        q[:] = 1 + trace, R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    else:
        i, j, k = largest - 1, largest % 3, (largest + 1) % 3
        q[0] = R[k, j] - R[j, k]
        q[1 + i] = 1 + 2 * R[i, i] - trace
        q[1 + j] = R[j, i] + R[i, j]
        q[1 + k] = R[k, i] + R[i, k]
    q /= np.linalg.norm(q)
    return q if q[0] >= 0 else -q


def write_mass_properties(row: np.ndarray, mass: float, inertia: np.ndarray) -> None:
    """Mass, inverse principal moments, principal frame and rotation series into one parameter row."""
    moments, R = principal_axes(inertia)
    row[at.INV_MASS] = 1.0 / mass
    row[at.INV_INERTIA : at.INV_INERTIA + 3] = 1.0 / moments
    row[at.PRINCIPAL : at.PRINCIPAL + 4] = quaternion_of(R)
    attitude_series(*row[at.INV_INERTIA : at.INV_INERTIA + 3], row[at.SERIES : at.SERIES + at.SERIES_SIZE])


def write_dimensions(row: np.ndarray, dimensions: np.ndarray, radius: float) -> None:
    """Half edges or semi-axes [m] and bounding radius [m] into one parameter row."""
    row[at.DIMENSIONS : at.DIMENSIONS + 3] = dimensions
    row[at.RADIUS] = radius


def spread(value, shape: tuple[int, ...], field: str) -> tuple[np.ndarray, tuple[int, ...], str]:
    """(array, shape, field) for `checks`: `value` with a missing worlds or bodies axis added."""
    try:
        array = np.asarray(value, dtype=np.float64)
        if array.ndim == len(shape) - 1 and array.shape[:1] == shape[:1]:
            array = array[:, None]
        return np.broadcast_to(array, shape), shape, field
    except (TypeError, ValueError):
        raise ValueError(f"{field} is {value!r}; allowed is shape {shape}, or without the bodies axis") from None


def change_inertia(params, bodies, plan, mass, size, inertia_body, shape) -> None:
    """Write new masses, sizes and inertias (each may be None) into `params` ((k * bodies, PARAM_SIZE))."""
    masses = 1.0 / params[:, at.INV_MASS]
    if mass is not None:
        masses = checks.positive(*spread(mass, shape, "mass")).ravel()
    halves = params[:, at.DIMENSIONS : at.DIMENSIONS + 3].copy()
    if size is not None:
        halves = 0.5 * checks.positive(*spread(size, (*shape, 3), "size")).reshape(-1, 3)
    tensors = None
    if inertia_body is not None:
        tensors = checks.finite(*spread(inertia_body, (*shape, 3, 3), "inertia_body")).reshape(-1, 3, 3)
    for k, row in enumerate(params):
        body = bodies[k % len(bodies)]
        if body.kind == "sphere" and len(set(halves[k])) > 1:
            raise ValueError(f"size is {(2 * halves[k]).tolist()} for a sphere; allowed are three equal diameters")
        if tensors is not None:
            tensor = check_inertia(tensors[k], "inertia_body")
        elif body.inertia_body is not None:
            tensor = body.inertia * (masses[k] / body.mass)
        else:
            tensor = body.uniform_inertia(halves[k], float(masses[k]))
        if not plan.allows(tensor):
            raise ValueError(
                f"the inertia becomes {tensor.tolist()}; the scene's bodies are all isotropic, or aligned with "
                "their axes, and its kernel leaves the rest out: give a body of the scene such an inertia_body"
            )
        write_mass_properties(row, float(masses[k]), tensor)
        write_dimensions(row, halves[k], body.bounding_radius(halves[k]))


def wall_table(walls: tuple[HalfSpace, ...]) -> np.ndarray:
    """(walls, WALL_SIZE): normal, two tangents that complete it to a right-handed frame, offset.

    The first tangent comes from the world axis that follows the one the normal is most along, made perpendicular:
    for a wall normal to a world axis the frame is a permutation of the world's, exactly.
    """
    table = np.zeros((len(walls), at.WALL_SIZE))
    for row, wall in zip(table, walls):
        n = np.array(wall.normal)
        axis = np.eye(3)[(int(np.argmax(np.abs(n))) + 1) % 3]
        t1 = axis - (axis @ n) * n
        t1 /= np.linalg.norm(t1)
        row[at.NORMAL : at.NORMAL + 3] = n
        row[at.TANGENT_1 : at.TANGENT_1 + 3] = t1
        row[at.TANGENT_2 : at.TANGENT_2 + 3] = np.cross(n, t1)
        row[at.OFFSET] = wall.offset
    return table
