"""Materials: the coefficients of a contact, where a wall has coefficients of its own, or a pair is an exception.

A rule combines the coefficients of a body and of a wall that has its own. At a wall without coefficients those of the
body act. An exception for a pair of body and wall replaces the result.

Where walls have no coefficients, and no exception names a wall, nothing here is compiled: the numbers of the body act
everywhere. Else the record of a body has members with its coefficients at each wall (`material_members`), which
`bind_wall_coefficients` fills. If all walls have equal coefficients, a body has one number for all of them, and the
kernels of contact read `body.mu` and `body.restitution`, as in scenes without such walls. If walls differ, a member
`walls_differ` of the record makes these kernels read the coefficients of the contact's wall.

A wall is found by its number k. Fixed bodies may follow behind the walls, with further numbers.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from physics.compiler.decorators import backend, inlined, members, when
from physics.kernels.half_space.contact_point import wall_of

RULES = ("minimum", "average", "geometric_mean", "product", "maximum")
"""Names of the rules that combine the coefficients of two bodies, or of a body and a wall."""

MINIMUM, AVERAGE, GEOMETRIC_MEAN, PRODUCT = range(len(RULES) - 1)  # the last one is the maximum

# Columns of `params` for each wall, from `body.material_column` on. A number that is missing is NaN.
OF_WALL, OF_PAIR = 0, 2  # coefficients of the wall; those of an exception for this body and this wall
FRICTION, RESTITUTION = 0, 1  # which of the two coefficients
WALL_COLUMNS = 4


class WallMaterials(NamedTuple):
    """Layout of the coefficients at walls: the members of a body's record that stay the same in all steps."""

    walls: int  # number of walls
    differ: bool  # a body may have different coefficients at two walls
    column: int  # first of the `WALL_COLUMNS` columns of wall 0 in `params`
    rules: tuple[int, int]  # indices in `RULES` for friction and restitution

    def write(self, records: np.ndarray) -> None:
        """Write column and rules into the records of bodies."""
        records["material_column"] = self.column
        records["friction_rule"], records["restitution_rule"] = self.rules


def material_members(materials: WallMaterials | None) -> list[tuple]:
    """Fields, in the form of `numpy.dtype`, that a body's record has for its coefficients at walls; None: none."""
    if materials is None:
        return []
    f, i = float, int
    numbers = [
        ("wall_friction", f, (materials.walls,)),  # Coulomb coefficient of the body at each wall
        ("wall_restitution", f, (materials.walls,)),
        ("material_column", i),  # the members of `WallMaterials`
        ("friction_rule", i),
        ("restitution_rule", i),
    ]
    return numbers + [("walls_differ", f)] * materials.differ


def _body(record):
    """Record of a body: `record` itself, or its member `body` if `record` is a workspace; also for types of records."""
    return backend.member(record, "body") if "body" in members(record) else record


def _if_member(name: str, instead):
    """Decorate a kernel that runs only if a body's record has the member `name`; else `instead` is called or returned.

    The last argument of the kernel is the record, or the workspace that contains it.
    """
    return when(lambda *types: name in members(_body(types[-1])), instead)


@inlined
def combine(rule, a, b):
    """Combine the coefficients a and b of two bodies, or of a body and a wall; `rule` is an index in `RULES`."""
    if rule == MINIMUM:
        return min(a, b)
    if rule == AVERAGE:
        return 0.5 * (a + b)
    if rule == GEOMETRIC_MEAN:
        return math.sqrt(a * b)
    if rule == PRODUCT:
        return a * b
    return max(a, b)


@inlined
def _coefficient_at_wall(own, params, i, column, rule):
    """Coefficient of the body in row i of `params` at a wall, from its `own` one.

    `column` is that of the wall's coefficient.
    """
    of_wall, of_pair = params[i, column + OF_WALL], params[i, column + OF_PAIR]
    if not math.isnan(of_pair):
        return of_pair
    if not math.isnan(of_wall):
        return combine(rule, own, of_wall)
    return own


def _nothing(params, i, body):
    return None


@_if_member("wall_friction", _nothing)
def bind_wall_coefficients(params, i, body):
    """Write the coefficients of the body in row i of `params` at each wall into its record.

    `bind_body` must have written the body's own coefficients.
    """
    for k in range(body.wall_friction.shape[0]):
        column = body.material_column + WALL_COLUMNS * k
        body.wall_friction[k] = _coefficient_at_wall(body.mu, params, i, column + FRICTION, body.friction_rule)
        body.wall_restitution[k] = _coefficient_at_wall(
            body.restitution, params, i, column + RESTITUTION, body.restitution_rule
        )


@_if_member("wall_friction", _nothing)
def bind_materials(params, i, body):
    """Write the coefficients of a body that meets walls only into its record.

    `mu` and `restitution` become the largest coefficients at any wall, which are those at every wall unless walls
    differ.
    """
    bind_wall_coefficients(params, i, body)
    body.mu, body.restitution = body.wall_friction[0], body.wall_restitution[0]
    for k in range(1, body.wall_friction.shape[0]):
        body.mu = max(body.mu, body.wall_friction[k])
        body.restitution = max(body.restitution, body.wall_restitution[k])


def _own_friction(wall, body):
    return body.mu


@_if_member("walls_differ", _own_friction)
def friction_at(wall, body):
    """Coulomb coefficient of a body at a wall."""
    return body.wall_friction[wall]


def _own_restitution(wall, body):
    return body.restitution


@_if_member("walls_differ", _own_restitution)
def restitution_at(wall, body):
    """Coefficient of restitution of a body at a wall."""
    return body.wall_restitution[wall]


def _own_friction_of(slot, scratch):
    return scratch.body.mu


@_if_member("walls_differ", _own_friction_of)
def friction_of(slot, scratch):
    """Coulomb coefficient of the contact in a slot, wall * features + feature."""
    return scratch.body.wall_friction[wall_of(slot, scratch.scene)]


def _own_restitution_of(slot, scratch):
    return scratch.body.restitution


@_if_member("walls_differ", _own_restitution_of)
def restitution_of(slot, scratch):
    """Coefficient of restitution of the contact in a slot, wall * features + feature."""
    return scratch.body.wall_restitution[wall_of(slot, scratch.scene)]


def _always(slot, scratch):
    return True


@_if_member("walls_differ", _always)
def may_hold(slot, scratch):
    """True if the contact in a slot may stick: where walls differ, one without friction only slides.

    Otherwise the tangential forces of a contact without friction would be unknowns, too.
    """
    return friction_of(slot, scratch) > 0.0


def _same_speed(speed, slot, scratch):
    return speed


@_if_member("walls_differ", _same_speed)
def least_bounce_speed(speed, slot, scratch):
    """Least speed of approach with which the contact in a slot bounces [m/s].

    `speed` is that of the largest coefficient of restitution of the body. A smaller coefficient needs more speed, so
    that the rebound is as fast.
    """
    return speed * (scratch.body.restitution / restitution_of(slot, scratch))


def _no_difference(scratch):
    return False


@_if_member("walls_differ", _no_difference)
def has_different_walls(scratch):
    """True if walls differ: then simultaneous impacts may gain energy even without friction.

    With one coefficient e the impulses p of an impact without friction satisfy p·u <= 0 for the velocities u before,
    and change the energy by (1 - e) p·u/2. With several coefficients e_i the sum of (1 - e_i) p_i u_i may be positive.
    """
    return True


def _same_friction(mu, wall, body):
    return mu


@_if_member("walls_differ", _same_friction)
def limited_friction(mu, wall, body):
    """Coulomb coefficient of a body at a wall, at most mu: `body.mu`, or 0 for a problem without friction."""
    return min(mu, body.wall_friction[wall])
