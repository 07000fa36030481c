"""Coefficients of friction and restitution in the parameters of worlds: of bodies, of walls, and of exceptions."""

from __future__ import annotations

import numpy as np

from physics import validation
from physics.kernels.contact_law.materials import FRICTION, OF_WALL, RESTITUTION, WALL_COLUMNS
from physics.kernels.state import layout as at
from physics.plan.plan import Plan
from physics.scene.effects import Contact, Friction
from physics.scene.materials import find_materials
from physics.scene.scene import Scene
from physics.summary import shown
from physics.world.parameters import spread


def write_materials(params: np.ndarray, scene: Scene, plan: Plan) -> None:
    """Write the coefficients of a scene's bodies, walls and exceptions into `params` (worlds * bodies, ...)."""
    friction, contact = scene.effect(Friction), scene.effect(Contact)
    params[:, at.FRICTION] = friction.along if friction else 0.0
    params[:, at.RESTITUTION] = (contact.restitution or 0.0) if contact else 0.0
    bodies = len(scene.bodies)
    for b, body in enumerate(scene.bodies):
        if body.friction is not None:
            params[b::bodies, at.FRICTION] = body.friction
        if body.restitution is not None:
            params[b::bodies, at.RESTITUTION] = body.restitution
    if plan.material_columns:
        first = _first_column(params, plan)
        for b, row in enumerate(find_materials(scene).at_walls.reshape(bodies, -1)):
            params[b::bodies, first : first + plan.material_columns] = row


def write_scene_friction(params: np.ndarray, scene: Scene, friction: Friction) -> None:
    """Write the coefficient of the effect `friction` for all bodies that have none of their own."""
    for b, body in enumerate(scene.bodies):
        if body.friction is None:
            params[b :: len(scene.bodies), at.FRICTION] = friction.along


def write_wall_coefficients(params: np.ndarray, shape: tuple[int, int], plan: Plan, friction, restitution) -> None:
    """Write coefficients of all walls into the parameters of k worlds; None leaves the old ones.

    Parameters
    ----------
    params : (k * bodies, PARAM_SIZE + ...) float64, changed
        Rows of the worlds.
    shape : tuple of int
        (k, bodies).
    plan : Plan
        Plan of the scene.
    friction, restitution : array_like or None
        Coefficients, (), (k,) or (k, walls); nan: the wall has none of its own.

    Raises
    ------
    ValueError
        The scene has no coefficients of walls, a value is out of range, or walls would differ in a scene whose kernel
        takes them for equal.
    """
    if friction is not None:
        _needs("friction", plan.friction, plan)
        _write_wall_column(params, shape, plan, FRICTION, "wall_friction", friction, validation.non_negative)
    if restitution is not None:
        _needs("restitution", plan.restitution, plan)
        _write_wall_column(params, shape, plan, RESTITUTION, "wall_restitution", restitution, validation.share)


def wall_coefficients(rows: np.ndarray, plan: Plan) -> dict[str, np.ndarray]:
    """Frictions and restitutions of walls in k worlds, by name, each (k, walls); nan: the wall has none of its own.

    `rows` (k, ...) are the parameters of one body of each world. Empty if the scene has no coefficients of walls.
    """
    if not plan.material_columns:
        return {}
    first = _first_column(rows, plan) + OF_WALL
    return {
        name: rows[:, first + which : first + plan.material_columns : WALL_COLUMNS]
        for name, which in (("friction", FRICTION), ("restitution", RESTITUTION))
    }


def _needs(name: str, acts: bool | None, plan: Plan) -> None:
    """Raise a ValueError unless the effect acts and walls have coefficients in the scene."""
    if not acts or not plan.material_columns:
        raise ValueError(
            f"wall_{name} was given, but no wall of the scene has a {name}; give it one: "
            f"physics.HalfSpace(..., {name}=...)"
        )


def _write_wall_column(params, shape, plan, which, field, value, check) -> None:
    """Write checked numbers (k, walls) of one coefficient, friction or restitution, into the rows of all bodies."""
    walls = plan.material_columns // WALL_COLUMNS
    numbers, expected, _ = spread(value, (shape[0], walls), field)
    check(np.where(np.isnan(numbers), 0.0, numbers), expected, field)
    is_equal = (numbers == numbers[:, :1]) | (np.isnan(numbers) & np.isnan(numbers[:, :1]))
    if not plan.walls_differ and not is_equal.all():
        raise ValueError(
            f"{field} is {shown(value)}; allowed is one number for all walls of a world, since they have equal "
            "coefficients in the scene"
        )
    first = _first_column(params, plan) + OF_WALL + which
    params[:, first : first + WALL_COLUMNS * walls : WALL_COLUMNS] = np.repeat(numbers, shape[1], axis=0)


def _first_column(params: np.ndarray, plan: Plan) -> int:
    """First column of `params` for coefficients at walls: before those of the contact laws and of motions."""
    return params.shape[1] - plan.motion_columns - len(plan.laws) - plan.material_columns
