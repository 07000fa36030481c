"""Explanation of a plan, a row for each effect: on or off, the reason, and the code compiled for it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from physics.kernels.state.contact_law_dispatch import LAW_ROLLING, LAW_SPIN, LAW_STIFFNESS, LAW_TANGENTIAL
from physics.kernels.state.sleeping import SLEEP_SIZE
from physics.scene.effects import Actuator, RollingFriction, Sleeping, SpinFriction
from physics.scene.force_field import Field, FieldSlot
from physics.scene.force_fields import FIELDS
from physics.scene.groups import potential_pairs, touching_pairs
from physics.scene.materials import has_restitution
from physics.scene.pairs import FRICTION_RULE, RESTITUTION_RULE
from physics.scene.parts import with_parts


@dataclass(frozen=True)
class Row:
    """Row of a plan's explanation: an effect, whether it is on, the reason, and the code compiled for it in words."""

    effect: str
    is_on: bool
    reason: str
    compiled: str


def _gravity_row(gravity) -> Row:
    if gravity is None:
        return Row("gravity", False, "not declared", "")
    return Row("gravity", True, f"declared: {gravity.acceleration} m/s²", "acceleration per world")


def _contact_row(scene, contact) -> Row:
    touching = touching_pairs(scene, True)
    if contact is not None and touching is not None and scene.walls and not touching[:, len(scene.bodies) :].any():
        return Row("wall contact", False, "groups keep all bodies from all walls", "")
    if contact is not None and scene.walls:
        kinds = {body.kind for body in with_parts(scene.bodies)}
        also = ", corners of hulls" * ("hull" in kinds) + ", ends of capsules" * ("capsule" in kinds)
        also += ", rims of cylinders" * ("cylinder" in kinds)
        also += ", parts of compounds" * ("compound" in kinds)
        return Row("wall contact", True, f"declared; {len(scene.walls)} wall(s)", f"detection{also}, impacts, solver")
    if contact is not None:
        return Row("wall contact", False, "declared, but the scene has no walls", "")
    reason = "not declared: the walls do not act" if scene.walls else "not declared"
    return Row("wall contact", False, reason, "")


def _between_row(scene, contact, many) -> Row:
    if many:
        kinds = {body.kind for body in with_parts(scene.bodies)}
        also = "".join(
            f", {kind}s" for kind in ("ellipsoid", "capsule", "cylinder", "hull", "compound") if kind in kinds
        )
        return Row(
            "body contact", True, f"declared; {len(scene.bodies)} bodies", f"pairs, one problem for all bodies{also}"
        )
    if contact is None:
        pass_through = ": bodies pass through each other" if len(scene.bodies) > 1 else ""
        return Row("body contact", False, f"not declared{pass_through}", "")
    if len(scene.bodies) == 1:
        return Row("body contact", False, "declared, but the scene has one body", "")
    why = "groups keep all bodies apart" if contact.between_bodies else "declared without contact between bodies"
    return Row("body contact", False, why, "")


def _fixed_rows(scene) -> tuple[Row, ...]:
    """Row that names the fixed bodies of a scene; none if it has no fixed body."""
    fixed = [b for b, body in enumerate(scene.bodies) if body.fixed]
    if not fixed:
        return ()
    reason = f"declared: {'body' if len(fixed) == 1 else 'bodies'} {', '.join(map(str, fixed))}"
    return (Row("fixed bodies", True, reason, "to the solver walls, with a shape of their own"),)


def _group_rows(scene, grouped) -> tuple[Row, ...]:
    """Row that counts the pairs that collision groups keep apart; none if all groups and masks have their defaults."""
    touching = touching_pairs(scene, True)
    if touching is None:
        return ()
    apart, count = potential_pairs(scene, True) & ~touching, len(scene.bodies)
    of_bodies, of_walls = int(np.triu(apart[:, :count]).sum()), int(apart[:, count:].sum())
    reason = f"declared: bits keep apart {of_bodies} pair(s) of bodies and {of_walls} of a body and a wall"
    return (Row("collision groups", bool(grouped), reason, "a test of bits for each pair" if grouped else ""),)


def _motion_rows(scene, columns) -> tuple[Row, ...]:
    """Row that names the bodies with a prescribed motion; none if no body has one. A motion has so many `columns`."""
    driven = [b for b, body in enumerate(scene.bodies) if body.motion is not None]
    if not driven:
        return ()
    reason = f"declared: {'body' if len(driven) == 1 else 'bodies'} {', '.join(map(str, driven))}"
    return (Row("prescribed motion", True, reason, f"{columns} numbers per body, velocities at contacts"),)


def _sensor_rows(scene) -> tuple[Row, ...]:
    """Row that counts the sensors of a scene; none if it has no sensor."""
    if not scene.sensors:
        return ()
    reason = f"declared: {_counted(len(scene.sensors), 'region')}"
    return (Row("sensors", True, reason, "nothing in a step; World.read_sensors asks for overlaps"),)


def _own_coefficients(scene, name, pairs, rule, usual) -> str:
    """Text about the coefficients called `name` that bodies, walls and pairs have of their own, and about their rule.

    It is "" if there are none, and the rule is the `usual` one.
    """
    bodies, walls = (sum(getattr(each, name) is not None for each in items) for items in (scene.bodies, scene.walls))
    counts = ((bodies, "body", "bodies"), (walls, "wall", "walls"), (len(pairs), "pair", "pairs"))
    told = [f"{count} {one if count == 1 else several}" for count, one, several in counts if count]
    return f"; own of {', '.join(told)}" * bool(told) + f"; rule {rule}" * bool(told or rule != usual)


def _per_wall(needs) -> str:
    return ", a number per wall" * needs.walls_differ


def _friction_row(scene, needs) -> Row:
    friction = needs.friction
    if needs.rubbing:
        cone = "circular cone" if friction.axis is None else "elliptic cone"
        own = _own_coefficients(scene, "friction", friction.pairs, friction.rule, FRICTION_RULE)
        reason = f"declared: μ = {friction.coefficient}{own}"
        return Row("friction", True, reason, f"three rows per contact, {cone}{_per_wall(needs)}")
    if friction is not None:
        return Row("friction", False, "declared, but nothing can touch", "")
    return Row("friction", False, "not declared", "")


def _restitution_row(scene, needs) -> Row:
    contact = needs.contact
    if not has_restitution(scene):
        return Row("restitution", False, "not declared: impacts are plastic", "")
    if not needs.touching:
        return Row("restitution", False, "declared, but nothing can touch", "")
    own = _own_coefficients(scene, "restitution", contact.restitution_pairs, contact.restitution_rule, RESTITUTION_RULE)
    reason = f"declared: e = {contact.restitution or 0.0}{own}"
    return Row("restitution", True, reason, f"Newton's law at impacts{_per_wall(needs)}")


def _gyroscopic_row(isotropic, turned) -> Row:
    if isotropic:
        return Row("gyroscopic torque", False, "automatic: all moments of every body are equal", "")
    note = "free-rotation flow" + (", principal axes tilted against body axes" if turned else "")
    return Row("gyroscopic torque", True, "automatic: moments of inertia differ", note)


def _center_row(uneven) -> Row:
    if not uneven:
        return Row("uneven mass", False, "automatic: every body's centre of mass is its geometric centre", "")
    reason = f"declared: center of {'body' if len(uneven) == 1 else 'bodies'} {', '.join(map(str, uneven))} is not 0"
    return Row("uneven mass", True, reason, "contacts about the centre of mass")


def _counted(count: int, what: str) -> str:
    return f"{count} {what}{'' if count == 1 else 's'}"


def _field_rows(fields: tuple[FieldSlot, ...]) -> list[Row]:
    """Rows of the declared force fields, then of the built-in fields that the scene does not declare."""
    rows = [
        Row(slot.effects[0].label, True, f"declared: {', '.join(map(repr, slot.effects))}",
            f"{_counted(slot.term.count * slot.term.size, 'parameter')} per body, one function"
            + (", all bodies at once" if slot.term.is_linked else ""))
        for slot in fields
    ]  # fmt: skip
    declared = {type(slot.effects[0]) for slot in fields}
    return rows + [Row(kind().label, False, "not declared", "") for kind in FIELDS if kind not in declared]


def _tangential_row(contact, laws) -> Row:
    if contact is None or contact.tangential is None:
        return Row("tangential restitution", False, "not declared", "")
    if LAW_TANGENTIAL not in laws:
        return Row("tangential restitution", False, "declared, but nothing can touch", "")
    return Row("tangential restitution", True, f"declared: e_t = {contact.tangential}", "a target along the wall")


def _compliance_row(contact, laws) -> Row:
    if contact is None or contact.stiffness is None:
        return Row("compliance", False, "not declared: contact is rigid", "")
    if LAW_STIFFNESS not in laws:
        return Row("compliance", False, "declared, but nothing can touch", "")
    reason = f"declared: {contact.stiffness} N/m, {contact.damping} N s/m per contact point"
    return Row("compliance", True, reason, "a number on the diagonal, and a target")


def _resistance_row(scene, kind, law, laws) -> Row:
    name = {RollingFriction: "rolling friction", SpinFriction: "spin friction"}[kind]
    effect = scene.effect(kind)
    if effect is None:
        return Row(name, False, "not declared", "")
    if law not in laws:
        return Row(name, False, "declared, but only round bodies roll and spin, and none can touch anything", "")
    return Row(name, True, f"declared: {effect.radius} m", "the contact problem again, with a torque")


def _actuator_row(scene) -> Row:
    actuator = scene.effect(Actuator)
    if actuator is None:
        return Row("actuator", False, "not declared: the wrench acts as given", "")
    note = "one call per step" if actuator.remembers else ""
    return Row("actuator", True, f"declared: {actuator!r}", f"before the step{', ' + note if note else ''}")


def _sleeping_row(scene, touching, sleeping) -> Row:
    effect = scene.effect(Sleeping)
    if effect is None:
        return Row("sleeping", False, "not declared", "")
    if sleeping:
        return Row("sleeping", True, f"declared: {effect!r}", f"{SLEEP_SIZE} numbers per body, a look at each")
    if not touching:
        return Row("sleeping", False, "declared, but nothing can touch", "")
    if any(body.motion is not None for body in scene.bodies):
        return Row("sleeping", False, "declared, but nothing sleeps where a body has a prescribed motion", "")
    restless = [field for field in scene.effects if isinstance(field, Field) and not field.is_steady]
    names = ", ".join(field.label for field in restless)
    return Row("sleeping", False, f"declared, but nothing rests under what may change on its own: {names}", "")


def make_rows(scene, accuracy, needs, refined) -> tuple[Row, ...]:
    """Make all rows of a plan from the needs of its scene (`physics.scene.needs`) and its accuracy.

    `refined` tells whether error control cuts substeps into parts.
    """
    contact, touching = needs.contact, needs.touching
    return (
        _gravity_row(needs.gravity),
        *_fixed_rows(scene),
        *_motion_rows(scene, needs.motion_columns),
        Row("applied wrench", True, "given to step(wrench)", "six numbers per body, zero without one"),
        _actuator_row(scene),
        _sleeping_row(scene, touching, needs.sleeping),
        _contact_row(scene, contact),
        _between_row(scene, contact, needs.meeting),
        *_group_rows(scene, needs.grouped),
        *_sensor_rows(scene),
        _friction_row(scene, needs),
        _restitution_row(scene, needs),
        _tangential_row(contact, needs.laws),
        _compliance_row(contact, needs.laws),
        _resistance_row(scene, RollingFriction, LAW_ROLLING, needs.laws),
        _resistance_row(scene, SpinFriction, LAW_SPIN, needs.laws),
        _gyroscopic_row(needs.isotropic, needs.turned),
        _center_row(needs.uneven),
        *_field_rows(needs.fields),
        Row("free motion", True, f"scheme {accuracy.scheme}, {_counted(accuracy.substeps, 'substep')} per dt",
            "parts that meet an error" if refined else ""),
    )  # fmt: skip
