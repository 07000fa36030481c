"""Table of physical parameters for the kernels, from the bodies of a scene and from values for each world."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from physics import validation
from physics.compiler.decorators import entry_kernel
from physics.kernels.flight.free_rotation import attitude_series, write_attitude_series
from physics.kernels.state import layout as at
from physics.kernels.state.contact_law_dispatch import (
    LAW_ANISOTROPY,
    LAW_DAMPING,
    LAW_ROLLING,
    LAW_SPIN,
    LAW_STIFFNESS,
    LAW_TANGENTIAL,
)
from physics.mass.inertia import check_inertia, check_range, principal_axes
from physics.plan.plan import Plan
from physics.scene.bodies import Body
from physics.scene.effects import Contact, Friction, RollingFriction, SpinFriction
from physics.scene.scene import HalfSpace
from physics.summary import shown


def quaternion_of(R: np.ndarray) -> np.ndarray:
    """Unit quaternion (w, x, y, z) with w >= 0 of a rotation matrix (3, 3), computed from its largest component."""
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


def write_bodies(params: np.ndarray, bodies: tuple[Body, ...]) -> None:
    """Write mass properties and dimensions of a scene's bodies into `params` (worlds * bodies, PARAM_SIZE)."""
    for b, body in enumerate(bodies):
        moments, R = (np.diag(body.inertia), np.eye(3)) if body.fixed else principal_axes(body.inertia)
        _write_body(
            params[b :: len(bodies)], body, np.array([body.mass]), moments[None], R[None], body.dimensions[None]
        )
    _write_series(params)


def _write_body(rows, body, masses, moments, R, dimensions) -> None:
    """Write mass properties and dimensions of one body into its rows (n, PARAM_SIZE), one for each of n worlds.

    Coefficients of the attitude series are left as they are. The arrays `masses` [kg], `moments` [kg m²], `R`
    (principal to body axes) and `dimensions` [m] have n rows, or one for all worlds.
    """
    rows[:, at.INV_MASS] = 1.0 / masses
    rows[:, at.INV_INERTIA : at.INV_INERTIA + 3] = 1.0 / moments
    rows[:, at.PRINCIPAL : at.PRINCIPAL + 4] = np.reshape([quaternion_of(frame) for frame in R], (-1, 4))
    rows[:, at.DIMENSIONS : at.DIMENSIONS + 3] = dimensions
    rows[:, at.CENTER : at.CENTER + 3] = body.center
    rows[:, at.RADIUS] = body.bounding_radius(dimensions) + np.linalg.norm(body.center)  # about the centre of mass


# Effect, and its attribute, from which the number of each contact law comes.
LAW_EFFECTS = {
    LAW_TANGENTIAL: (Contact, "tangential"),
    LAW_ROLLING: (RollingFriction, "radius"),
    LAW_SPIN: (SpinFriction, "radius"),
    LAW_ANISOTROPY: (Friction, "ratio"),
    LAW_STIFFNESS: (Contact, "stiffness"),
    LAW_DAMPING: (Contact, "damping"),
}


def law_column(params: np.ndarray, plan: Plan, law: str) -> int:
    """Column of a contact law in `params`: the laws' columns are before those of motions, which are the last ones."""
    return params.shape[1] - plan.motion_columns - len(plan.laws) + plan.laws.index(law)


def write_laws(params: np.ndarray, plan: Plan, effects: Sequence) -> None:
    """Write the number of each contact law of the plan, found among `effects`, into its column of `params`."""
    for law in plan.laws:
        kind, name = LAW_EFFECTS[law]
        for effect in effects:
            if isinstance(effect, kind):
                params[:, law_column(params, plan, law)] = getattr(effect, name)


def _write_series(params: np.ndarray) -> None:
    """Write the coefficients of the attitude series into all rows of `params`, from their moments of inertia."""
    first, series = at.INV_INERTIA, params[:, at.SERIES : at.SERIES + at.SERIES_SIZE]
    write_attitude_series(*params[:, first : first + 3].T, series.T)


@entry_kernel
def _change_series(params):
    """Do `_write_series` in a compiled kernel, which is fast enough for resets."""
    first = at.INV_INERTIA
    for i in range(params.shape[0]):
        series = params[i, at.SERIES : at.SERIES + at.SERIES_SIZE]
        attitude_series(params[i, first], params[i, first + 1], params[i, first + 2], series)


def spread(value, shape: tuple[int, ...], field: str) -> tuple[np.ndarray, tuple[int, ...], str]:
    """Broadcast `value` to `shape` (worlds, bodies, ...); the axes of bodies, or of both, may be missing.

    Returns the arguments (array, shape, field) of the functions in `physics.validation`. ValueError if the shapes do
    not fit.
    """
    allowed = f"shape {shape}, or without the axis of bodies, or of worlds and bodies"
    array = validation.floats(value, field, f"are numbers in {allowed}")
    given = array.shape
    if array.ndim == len(shape) - 1 and given[:1] == shape[:1]:
        array = array[:, None]
    try:
        return np.broadcast_to(array, shape), shape, field
    except ValueError:
        raise ValueError(f"{field} has shape {given}; allowed is {allowed}") from None


def change_inertia(params, bodies, plan, mass, size, inertia_body, shape) -> None:
    """Write new masses, sizes and inertia tensors into the parameters of k worlds.

    An argument that is None leaves its numbers unchanged. Without `inertia_body` the inertia follows from mass and
    size, or is that of the scene's body, scaled with the mass.

    Parameters
    ----------
    params : (k * bodies, PARAM_SIZE) float64, changed
        Rows of the worlds.
    bodies : tuple of Body
        Bodies of the scene.
    plan : Plan
        Plan of the scene; it decides the inertias that the kernel supports.
    mass : array_like or None
        Masses [kg], of `shape`; that of a fixed body must be infinite.
    size : array_like or None
        Full extents along the body axes [m], of `shape` and three numbers: edges, or diameters.
    inertia_body : array_like or None
        Inertia tensors about the centre of mass, body frame [kg m²], of `shape` and 3 x 3 numbers; those of fixed
        bodies are not used.
    shape : tuple of int
        (k, bodies).
    """
    masses = masses_of(params)
    if mass is not None:
        masses = _new_masses(*spread(mass, shape, "mass"), bodies).ravel()
    halves = params[:, at.DIMENSIONS : at.DIMENSIONS + 3].copy()
    if size is not None:
        halves = 0.5 * validation.positive(*spread(size, (*shape, 3), "size")).reshape(-1, 3)
    tensors = None
    if inertia_body is not None:
        tensors = validation.finite(*spread(inertia_body, (*shape, 3, 3), "inertia_body")).reshape(-1, 3, 3)
    for b, body in enumerate(bodies):
        rows = slice(b, None, len(bodies))
        if body.kind == "sphere":
            _check_spheres(halves[rows])
        if body.kind == "capsule":
            _check_capsules(halves[rows])
        if body.kind == "cylinder":
            _check_cylinders(halves[rows])
        if body.kind in ("hull", "compound"):
            _check_unscaled(b, body, halves[rows])
        if body.fixed:
            _write_body(params[rows], body, masses[rows], np.full((1, 3), np.inf), np.eye(3)[None], halves[rows])
            continue
        given = None if tensors is None else tensors[rows]
        moments, R = _principal_axes(body, masses[rows], halves[rows], given)
        check_range(masses[rows], moments)
        _check_allowed(plan, moments, R)
        _write_body(params[rows], body, masses[rows], moments, R, halves[rows])
    _change_series(params)


def masses_of(params: np.ndarray) -> np.ndarray:
    """Masses [kg] of bodies from their parameters (..., PARAM_SIZE); infinite for fixed bodies."""
    with np.errstate(divide="ignore"):
        return 1.0 / params[..., at.INV_MASS]


def _new_masses(mass, shape, field, bodies) -> np.ndarray:
    """Check new masses (k, bodies) [kg]: positive, and infinite for fixed bodies."""
    fixed = np.array([body.fixed for body in bodies])
    finite = validation.positive(np.where(fixed & (mass == np.inf), 1.0, mass), shape, field)
    bad = np.flatnonzero((fixed & (mass != np.inf)).any(axis=0))
    if len(bad):
        raise ValueError(
            f"mass is {shown(mass[0, bad[0]])} for Scene.bodies[{bad[0]}], which is fixed; allowed is inf for it, in "
            "an array with the masses of all bodies"
        )
    return np.where(fixed, np.inf, finite)


def _principal_axes(body, masses, halves, tensors) -> tuple[np.ndarray, np.ndarray]:
    """Principal moments (n, 3) [kg m²] and axes (n, 3, 3), or (1, 3, 3) for all, of one body in n worlds.

    They come from `tensors` (n, 3, 3) if given, else from the body's shape with `masses` (n,) [kg] and half edges or
    semi-axes `halves` (n, 3) [m].
    """
    if tensors is not None:
        each = [principal_axes(check_inertia(tensor, "inertia_body")) for tensor in tensors]
        return np.array([moments for moments, _ in each]).reshape(-1, 3), np.array([R for _, R in each]).reshape(
            -1, 3, 3
        )
    if body.inertia_body is not None or body.kind in ("hull", "compound"):
        moments, R = principal_axes(body.inertia)
        return moments * (masses / body.mass)[:, None], R[None]
    return body.uniform_moments(halves, masses), np.eye(3)[None]


def _check_spheres(halves) -> None:
    bad = np.flatnonzero(np.ptp(halves, axis=1) > 0)
    if len(bad):
        size = (2 * halves[bad[0]]).tolist()
        raise ValueError(f"size is {size} for a sphere; allowed are three equal diameters")


def _check_capsules(halves) -> None:
    bad = np.flatnonzero((halves[:, 0] != halves[:, 2]) | ~(halves[:, 1] > halves[:, 0]))
    if len(bad):
        size = (2 * halves[bad[0]]).tolist()
        raise ValueError(f"size is {size} for a capsule; allowed are diameter, a larger length, the diameter again")


def _check_cylinders(halves) -> None:
    bad = np.flatnonzero(halves[:, 0] != halves[:, 2])
    if len(bad):
        size = (2 * halves[bad[0]]).tolist()
        raise ValueError(f"size is {size} for a cylinder; allowed are diameter, height, the diameter again")


def _check_unscaled(b, body, halves) -> None:
    if (halves != body.dimensions).any():
        size = (2 * halves[(halves != body.dimensions).any(axis=1)][0]).tolist()
        raise ValueError(
            f"size is {size} for Scene.bodies[{b}], a {body.kind}, which has its {_OWN[body.kind]} in all worlds; "
            f"allowed is twice its dimensions, {(2 * body.dimensions).tolist()}"
        )


_OWN = {"hull": "points", "compound": "parts"}
"""Shapes that no world scales, and their descriptions."""


def _check_allowed(plan, moments, R) -> None:
    bad = np.flatnonzero(~plan.allows(moments, R))
    if len(bad):
        frame = np.broadcast_to(R, (len(moments), 3, 3))[bad[0]]
        tensor = frame * moments[bad[0]] @ frame.T
        raise ValueError(
            f"the inertia becomes {tensor.tolist()}; the scene's bodies are all isotropic, or aligned with "
            "their axes, and its kernel leaves the rest out: give a body of the scene such an inertia_body"
        )


def wall_table(walls: tuple[HalfSpace, ...], along: np.ndarray | None = None) -> np.ndarray:
    """Table of walls (walls, WALL_SIZE): unit normal, two tangents that make a right-handed frame with it, offset [m].

    The first tangent is the component along the wall of the directions `along` (walls, 3). Without `along` it is that
    of a world axis: of the axis after the one to which the normal is closest, in the cyclic order x, y, z. So the frame
    of a wall that is normal to a world axis is exactly a permutation of the world axes.
    """
    table = np.zeros((len(walls), at.WALL_SIZE))
    for k, (row, wall) in enumerate(zip(table, walls)):
        n = np.array(wall.normal)
        axis = np.eye(3)[(int(np.argmax(np.abs(n))) + 1) % 3]
        if along is not None:
            axis = along[k] / np.linalg.norm(along[k])
        t1 = axis - (axis @ n) * n
        t1 /= np.linalg.norm(t1)
        row[at.WALL_NORMAL : at.WALL_NORMAL + 3] = n
        row[at.WALL_TANGENT_1 : at.WALL_TANGENT_1 + 3] = t1
        row[at.WALL_TANGENT_2 : at.WALL_TANGENT_2 + 3] = np.cross(n, t1)
        row[at.WALL_OFFSET] = wall.offset
    return table
