"""Standard entries of observations: each function gives an `Entry` for a task's `observation`.

Lengths, speeds and forces are told in the world frame. `body` is an index into the scene's bodies; the name of an entry
begins with that of the body where there are several.
"""

from __future__ import annotations

import numpy as np

from physics import validation
from rigid_env.tasks.actions import check_body
from rigid_env.tasks.entries import Entry

AXES = "xyz"
LENGTH, SPEED, SPIN, REACH = 5.0, 5.0, 5.0, 10.0  # [m], [m/s], [rad/s], and how many units an entry may hold
IMPULSE = 0.01  # [m g s]: a weight over two of the default physics steps
IMPACT = 0.1  # [m g s]: a plastic collision at 1 m/s
MOST_CONTACTS = 1024


def _names(what: str, body: int, parts=AXES) -> tuple[str, ...]:
    check_body(body)
    head = what if body == 0 else f"{what} of body {body}"
    return tuple(f"{head} {part}" for part in parts)


def pos(body: int = 0, scale: float = LENGTH, bound: float = REACH) -> Entry:
    """Position of the centre of mass [m]."""
    return Entry(_names("position", body), "m", -bound, bound, lambda worlds: worlds.pos[:, body], scale)


def height(body: int = 0, scale: float = LENGTH, bound: float = REACH) -> Entry:
    """Height of the centre of mass, y [m]."""
    (name,) = _names("height", body, ("y",))
    return Entry(name, "m", -bound, bound, lambda worlds: worlds.pos[:, body, 1], scale)


def linvel(body: int = 0, scale: float = SPEED, bound: float = REACH) -> Entry:
    """Velocity of the centre of mass [m/s]."""
    return Entry(_names("linear velocity", body), "m/s", -bound, bound, lambda worlds: worlds.linvel[:, body], scale)


def angvel(body: int = 0, scale: float = SPIN, bound: float = REACH) -> Entry:
    """Angular velocity [rad/s]."""
    return Entry(_names("angular velocity", body), "rad/s", -bound, bound, lambda worlds: worlds.angvel[:, body], scale)


def quat(body: int = 0) -> Entry:
    """Unit quaternion w, x, y, z, body to world."""
    return Entry(_names("quaternion", body, "wxyz"), "1", -1.0, 1.0, lambda worlds: worlds.quat[:, body])


def rotation(body: int = 0) -> Entry:
    """Rotation matrix, body to world, row by row; unlike a quaternion it has no two signs."""
    check_body(body)
    head = "R" if body == 0 else f"R of body {body}"
    names = tuple(f"{head}[{i}, {j}]" for i in range(3) for j in range(3))
    return Entry(names, "1", -1.0, 1.0, lambda worlds: worlds.rotation[:, body].reshape(-1, 9))


def offset(of: int, to: int, scale: float = LENGTH, bound: float = REACH) -> Entry:
    """Centre of mass of one body minus that of another [m]."""
    check_body(of)
    check_body(to)
    names = tuple(f"offset of body {of} from body {to} {axis}" for axis in AXES)
    return Entry(names, "m", -bound, bound, lambda worlds: worlds.pos[:, of] - worlds.pos[:, to], scale)


def wall_gaps(body: int = 0, walls: int = 3, scale: float = LENGTH, bound: float = REACH) -> Entry:
    """Distances between a body and each of the scene's first `walls` walls [m], negative inside."""
    names = _names("gap", body, [f"to wall {k}" for k in range(walls)])
    return Entry(names, "m", -1.0, bound, lambda worlds: worlds.wall_gaps[:, body, :walls], scale)


def contact_force(body: int = 0, bound: float = REACH) -> Entry:
    """Sum of the contact forces on a body over its weight, averaged over the last physics step."""
    names = _names("contact force", body)
    read = lambda worlds: worlds.contact_force[:, body] / worlds.weight[:, body, None]  # noqa: E731
    return Entry(names, "m g", -bound, bound, read)


def contact_impulse(body: int = 0, scale: float = IMPULSE, bound: float = REACH) -> Entry:
    """Sum of the contact impulses on a body over its weight, in the last resting stage.

    A stage is what the last physics step ends with: see `physics.Contacts`. Those of impacts: `impact_impulse`.
    """
    names = _names("contact impulse", body)
    read = lambda worlds: worlds.contact_impulse[:, body] / worlds.weight[:, body, None]  # noqa: E731
    return Entry(names, "m g s", -bound, bound, read, scale)


def impact_impulse(body: int = 0, scale: float = IMPACT, bound: float = REACH) -> Entry:
    """Sum of the impulses of impacts on a body over its weight, in the whole control step."""
    names = _names("impact impulse", body)
    read = lambda worlds: worlds.impact_impulse[:, body] / worlds.weight[:, body, None]  # noqa: E731
    return Entry(names, "m g s", -bound, bound, read, scale)


def contact_points(body: int = 0, count: int = 4, scale: float = LENGTH, bound: float = REACH) -> Entry:
    """Points of the `count` strongest contacts of a body, from its centre of mass [m]; zeros if there are fewer."""
    names = _contact_names("point", body, count)
    return Entry(names, "m", -bound, bound, lambda worlds: _arms(worlds, body, count), scale)


def contact_forces(body: int = 0, count: int = 4, bound: float = REACH) -> Entry:
    """Forces of these contacts on the body over its weight, in the same order."""
    names = _contact_names("force", body, count)
    read = lambda worlds: _rows(worlds.contacts_of(body, count).force) / worlds.weight[:, body, None]  # noqa: E731
    return Entry(names, "m g", -bound, bound, read)


def impact_impulses(body: int = 0, count: int = 2, scale: float = IMPACT, bound: float = REACH) -> Entry:
    """Impulses of a body's impacts over its weight: of each wall or body that it hit, the `count` largest."""
    names = _contact_names("impulse", body, count, "impact")
    read = lambda worlds: _rows(worlds.impacts_of(body, count).impulse) / worlds.weight[:, body, None]  # noqa: E731
    return Entry(names, "m g s", -bound, bound, read, scale)


def _contact_names(what: str, body: int, count: int, of: str = "contact") -> tuple[str, ...]:
    check_body(body)
    validation.count(count, "count", most=MOST_CONTACTS)
    head = of if body == 0 else f"{of} of body {body}"
    return tuple(f"{head}: {what} {k} {axis}" for k in range(count) for axis in AXES)


def _rows(vectors: np.ndarray) -> np.ndarray:
    """(n, rows, 3) as (n, 3 rows)."""
    return vectors.reshape(len(vectors), -1)


def _arms(worlds, body: int, count: int) -> np.ndarray:
    """(n, 3 count) [m]: from the centre of mass of a body to the points of its contacts."""
    contacts = worlds.contacts_of(body, count)
    is_there = np.arange(count) < contacts.count[:, None]
    return _rows((contacts.point - worlds.pos[:, body, None]) * is_there[:, :, None])


def drawn(name: str, length: int = 1, unit: str = "1", scale: float = 1.0, bound: float = REACH) -> Entry:
    """Value of the episode, such as the goal, by its name in the task's `draws`."""
    names = name if length == 1 else tuple(f"{name} {k}" for k in range(length))
    return Entry(names, unit, -bound, bound, lambda worlds: worlds.drawn[name], scale)


def previous_action(size: int) -> Entry:
    """The action before the last one, clipped to ±1; zeros at the start."""
    names = tuple(f"previous action {k}" for k in range(size))
    return Entry(names, "1", -1.0, 1.0, lambda worlds: worlds.previous_action)
