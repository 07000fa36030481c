"""Standard entries of observations: each function returns an `Entry` for the attribute `observation` of a task.

Vectors are given in the world frame. The argument `body` is the index of a body of the scene; names of entries contain
it unless it is 0. `scale` is the number that an observation is divided by, and `bound` is the largest absolute value
after that; larger ones are clipped.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from physics import validation
from rigid_env.tasks.actions import check_body
from rigid_env.tasks.entries import Entry

AXES = "xyz"
LENGTH, SPEED, SPIN, REACH = 5.0, 5.0, 5.0, 10.0  # scales [m], [m/s], [rad/s], and the bound of scaled numbers
IMPULSE = 0.01  # [m g s]: impulse of a body's weight during two default physics steps
IMPACT = 0.1  # [m g s]: about the impulse of a plastic impact at 1 m/s
MOST_CONTACTS = 1024


def _names(what: str, body: int, parts=AXES) -> tuple[str, ...]:
    check_body(body)
    head = what if body == 0 else f"{what} of body {body}"
    return tuple(f"{head} {part}" for part in parts)


def pos(body: int = 0, scale: float = LENGTH, bound: float = REACH) -> Entry:
    """Position of a body's centre of mass: x, y, z [m]."""
    return Entry(_names("position", body), "m", -bound, bound, lambda worlds: worlds.pos[:, body], scale)


def height(body: int = 0, scale: float = LENGTH, bound: float = REACH) -> Entry:
    """Height y of a body's centre of mass [m]."""
    (name,) = _names("height", body, ("y",))
    return Entry(name, "m", -bound, bound, lambda worlds: worlds.pos[:, body, 1], scale)


def linvel(body: int = 0, scale: float = SPEED, bound: float = REACH) -> Entry:
    """Velocity of a body's centre of mass: x, y, z [m/s]."""
    return Entry(_names("linear velocity", body), "m/s", -bound, bound, lambda worlds: worlds.linvel[:, body], scale)


def angvel(body: int = 0, scale: float = SPIN, bound: float = REACH) -> Entry:
    """Angular velocity of a body: x, y, z, world frame [rad/s]."""
    return Entry(_names("angular velocity", body), "rad/s", -bound, bound, lambda worlds: worlds.angvel[:, body], scale)


def quat(body: int = 0) -> Entry:
    """Attitude of a body as a unit quaternion w, x, y, z, body to world."""
    return Entry(_names("quaternion", body, "wxyz"), "1", -1.0, 1.0, lambda worlds: worlds.quat[:, body])


def rotation(body: int = 0) -> Entry:
    """Attitude of a body as a rotation matrix, body to world: nine numbers row by row.

    Unlike a unit quaternion, a rotation matrix is unique for each attitude.
    """
    check_body(body)
    head = "R" if body == 0 else f"R of body {body}"
    names = tuple(f"{head}[{i}, {j}]" for i in range(3) for j in range(3))
    return Entry(names, "1", -1.0, 1.0, lambda worlds: worlds.rotation[:, body].reshape(-1, 9))


def offset(of: int, to: int, scale: float = LENGTH, bound: float = REACH) -> Entry:
    """Position of body `of` minus the position of body `to`, between centres of mass: x, y, z [m]."""
    check_body(of)
    check_body(to)
    names = tuple(f"offset of body {of} from body {to} {axis}" for axis in AXES)
    return Entry(names, "m", -bound, bound, lambda worlds: worlds.pos[:, of] - worlds.pos[:, to], scale)


def wall_gaps(body: int = 0, walls: int = 3, scale: float = LENGTH, bound: float = REACH) -> Entry:
    """Gaps between a body and each of the scene's first `walls` walls [m]; negative where it overlaps a wall."""
    names = _names("gap", body, [f"to wall {k}" for k in range(walls)])
    return Entry(names, "m", -1.0, bound, lambda worlds: worlds.wall_gaps[:, body, :walls], scale)


def lidar(body: int, directions: ArrayLike, max_distance: float, origin: ArrayLike = (0.0, 0.0, 0.0)) -> Entry:
    """Distances along rays fixed to a body, divided by `max_distance`: 1 where a ray hits nothing within it.

    Rays hit other bodies and walls, and pass through the body itself. `directions` (rays, 3), of any length but 0, and
    `origin` (3,), from the centre of mass [m], are in the frame of the body.
    """
    ways = validation.rows(directions, 3, "directions")
    if not ways.any(axis=1).all():
        raise ValueError(f"directions[{int(np.argmin(ways.any(axis=1)))}] is (0, 0, 0); allowed are other vectors")
    start = validation.finite(origin, (3,), "origin")
    farthest = float(validation.positive(max_distance, (), "max_distance"))
    names = _names("lidar", body, range(len(ways)))

    def read(worlds):
        distance = worlds.cast_rays(start, ways, farthest, body).distance
        return np.minimum(distance, farthest)

    return Entry(names, "m", 0.0, 1.0, read, farthest)


def sensor(sensor: int = 0, body: int | None = None) -> Entry:
    """Number of a sensor of the scene: 1 if the body touches it, else 0. Without `body`: 1 if any body does.

    `sensor` is its index in `Scene.sensors`.
    """
    index = validation.count(sensor, "sensor", 0)
    if body is not None:
        check_body(body)
    name = f"sensor {index}" + ("" if body is None else f" on body {body}")

    def read(worlds):
        inside = worlds.sensors[:, index]
        return (inside.any(axis=1) if body is None else inside[:, body]).astype(np.float64)

    return Entry(name, "1", 0.0, 1.0, read)


def contact_force(body: int = 0, bound: float = REACH) -> Entry:
    """Sum of the contact forces on a body over its weight, a vector averaged over the last physics step."""
    names = _names("contact force", body)
    read = lambda worlds: worlds.contact_force[:, body] / worlds.weight[:, body, None]  # noqa: E731
    return Entry(names, "m g", -bound, bound, read)


def contact_impulse(body: int = 0, scale: float = IMPULSE, bound: float = REACH) -> Entry:
    """Sum of the contact impulses on a body over its weight [s], in the last resting stage.

    A resting stage is the final part of a physics step.

    See `physics.Contacts` for stages. Impulses of impacts are not included; `impact_impulse` has them.
    """
    names = _names("contact impulse", body)
    read = lambda worlds: worlds.contact_impulse[:, body] / worlds.weight[:, body, None]  # noqa: E731
    return Entry(names, "m g s", -bound, bound, read, scale)


def impact_impulse(body: int = 0, scale: float = IMPACT, bound: float = REACH) -> Entry:
    """Sum of the impulses of impacts on a body over its weight [s], in the whole control step."""
    names = _names("impact impulse", body)
    read = lambda worlds: worlds.impact_impulse[:, body] / worlds.weight[:, body, None]  # noqa: E731
    return Entry(names, "m g s", -bound, bound, read, scale)


def contact_points(body: int = 0, count: int = 4, scale: float = LENGTH, bound: float = REACH) -> Entry:
    """Points of the `count` contacts of a body with the largest forces, from its centre of mass: x, y, z each [m].

    With fewer contacts, the remaining numbers are 0.
    """
    names = _contact_names("point", body, count)
    return Entry(names, "m", -bound, bound, lambda worlds: _arms(worlds, body, count), scale)


def contact_forces(body: int = 0, count: int = 4, bound: float = REACH) -> Entry:
    """Forces on a body at its `count` strongest contacts, over its weight, in the order of `contact_points`."""
    names = _contact_names("force", body, count)
    read = lambda worlds: _rows(worlds.contacts_of(body, count).force) / worlds.weight[:, body, None]  # noqa: E731
    return Entry(names, "m g", -bound, bound, read)


def impact_impulses(body: int = 0, count: int = 2, scale: float = IMPACT, bound: float = REACH) -> Entry:
    """Impulses of a body's impacts over its weight [s]: a vector for each wall or body hit, the `count` largest."""
    names = _contact_names("impulse", body, count, "impact")
    read = lambda worlds: _rows(worlds.impacts_of(body, count).impulse) / worlds.weight[:, body, None]  # noqa: E731
    return Entry(names, "m g s", -bound, bound, read, scale)


def _contact_names(what: str, body: int, count: int, of: str = "contact") -> tuple[str, ...]:
    check_body(body)
    validation.count(count, "count", most=MOST_CONTACTS)
    head = of if body == 0 else f"{of} of body {body}"
    return tuple(f"{head}: {what} {k} {axis}" for k in range(count) for axis in AXES)


def _rows(vectors: np.ndarray) -> np.ndarray:
    """Array (n, rows, 3) reshaped to (n, 3 rows)."""
    return vectors.reshape(len(vectors), -1)


def _arms(worlds, body: int, count: int) -> np.ndarray:
    """Vectors (n, 3 count) from the centre of mass of a body to its contact points, world frame [m]."""
    contacts = worlds.contacts_of(body, count)
    is_there = np.arange(count) < contacts.count[:, None]
    return _rows((contacts.point - worlds.pos[:, body, None]) * is_there[:, :, None])


def drawn(name: str, length: int = 1, unit: str = "1", scale: float = 1.0, bound: float = REACH) -> Entry:
    """Drawn value of the episode, such as the goal, by its name in the task's `draws`; it has `length` numbers."""
    names = name if length == 1 else tuple(f"{name} {k}" for k in range(length))
    return Entry(names, unit, -bound, bound, lambda worlds: worlds.drawn[name], scale)


def previous_action(size: int) -> Entry:
    """Action of the control step before the last one: `size` numbers clipped to ±1; zeros at the start."""
    names = tuple(f"previous action {k}" for k in range(size))
    return Entry(names, "1", -1.0, 1.0, lambda worlds: worlds.previous_action)
