"""From a scene to what is compiled: which effects are on, why, and the switches of the kernel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from physics.accuracy import EVENTS, SCHEMES, Accuracy
from physics.effects import Contact, Friction, Gravity
from physics.field import FieldSlot, field_slots
from physics.fields import FIELDS
from physics.inertia import principal_axes
from physics.kernels.fields.terms import Term
from physics.kernels.layout import BLOCK, ELLIPSOID, SPHERE, VERTEX_COUNT
from physics.scene import Scene

SHAPE_CODES = {"block": BLOCK, "sphere": SPHERE, "ellipsoid": ELLIPSOID}

# Moments that differ by less than this share are equal to rounding: the gyroscopic torque would be noise.
ISOTROPY_TOLERANCE = 1e-14


@dataclass(frozen=True)
class Row:
    """One effect in the plan."""

    effect: str
    is_on: bool
    reason: str
    compiled: str


@dataclass(frozen=True)
class Plan:
    """The switches that the kernel is compiled for, and the reasons. None is off, True is on.

    `tilted` is on where the body frame of a body is not all there is to know of its mass: its principal axes are not
    its body axes, or its geometric centre is not its centre of mass. `many` is on where bodies touch each other.
    """

    contact: bool | None
    friction: bool | None
    restitution: bool | None
    gravity: bool | None
    gyroscopic: bool | None
    tilted: bool | None
    pivots: bool | None
    scheme: int | None
    events: bool | None
    many: bool | None
    features: int
    fields: tuple[FieldSlot, ...]
    rows: tuple[Row, ...]

    @property
    def smooth(self) -> bool | None:
        """Contact without friction: the switch opposite to `friction`.

        Numba prunes a branch only for the argument that is None, so that each of two alternatives needs one.
        """
        return True if self.contact and not self.friction else None

    @property
    def key(self) -> tuple:
        """What distinguishes one compiled kernel from another."""
        return (
            self.contact, self.friction, self.restitution, self.gravity, self.gyroscopic, self.tilted,
            self.pivots, self.scheme is None, self.events, self.many, self.features,
            *(term.marker for term in self.terms),
        )  # fmt: skip

    @property
    def terms(self) -> tuple[Term, ...]:
        """The fields' part in the kernel."""
        return tuple(slot.term for slot in self.fields)

    @property
    def field_columns(self) -> int:
        """Columns of parameters that the fields have."""
        return sum(term.count * term.size for term in self.terms)

    def allows(self, moments: np.ndarray, R: np.ndarray) -> np.ndarray:
        """Whether the kernel of this plan can turn bodies with these `physics.inertia.principal_axes`.

        Parameters
        ----------
        moments : (n, 3) float64
            [kg m²].
        R : (n, 3, 3) float64
            Principal frame to body frame.

        Returns
        -------
        (n,) bool
        """
        if not self.gyroscopic:
            return is_isotropic(moments)
        return ~is_tilted(R) | bool(self.tilted)

    def explain(self) -> str:
        """The plan as text: every effect, on or off, why, and what is compiled for it."""
        width = max(len(row.effect) for row in self.rows)
        lines = [
            f"{row.effect:<{width}}  {'on ' if row.is_on else 'off'}  {row.reason}"
            + (f" [{row.compiled}]" if row.compiled else "")
            for row in self.rows
        ]
        return "\n".join(lines)


def is_isotropic(moments: np.ndarray) -> np.ndarray:
    """Whether all `moments` (..., 3) are equal to rounding: then ω stays constant in free flight."""
    return np.ptp(moments, axis=-1) <= ISOTROPY_TOLERANCE * np.max(moments, axis=-1)


def is_tilted(R: np.ndarray) -> np.ndarray:
    """Whether the principal axes `R` (..., 3, 3) are not the body axes."""
    return (R - np.eye(3)).any(axis=(-2, -1))


def make_plan(scene: Scene, accuracy: Accuracy) -> Plan:
    """Decide what a scene needs at an accuracy."""
    contact, friction, gravity = (scene.effect(kind) for kind in (Contact, Friction, Gravity))
    many = contact is not None and contact.between_bodies and len(scene.bodies) > 1
    touching = contact is not None and (bool(scene.walls) or many)
    axes = [principal_axes(body.inertia) for body in scene.bodies]
    isotropic = all(is_isotropic(moments) for moments, _ in axes)
    turned = not isotropic and any(is_tilted(R) for _, R in axes)
    uneven = [b for b, body in enumerate(scene.bodies) if any(body.center)]
    has_block = any(body.kind == "block" for body in scene.bodies)
    restitution = touching and contact.restitution is not None
    rubbing = touching and friction is not None
    scheme = SCHEMES[accuracy.scheme]
    if many:
        _check_many(scene, scheme)
    fields = field_slots(scene.effects, len(scene.bodies))
    return Plan(
        contact=touching or None,
        friction=rubbing or None,
        restitution=restitution or None,
        gravity=(gravity is not None) or None,
        gyroscopic=(not isotropic) or None,
        tilted=(turned or bool(uneven)) or None,
        pivots=(touching and accuracy.solver == "sweeps+pivoting") or None,
        scheme=scheme if scheme > 0 else None,
        events=(scheme == EVENTS) or None,
        many=many or None,
        features=VERTEX_COUNT if has_block else 1,
        fields=fields,
        rows=(
            _gravity_row(gravity),
            Row(
                "applied wrench",
                True,
                "given to step(wrench)",
                "six numbers per body, zero without one",
            ),
            _contact_row(scene, contact),
            _between_row(scene, contact, many),
            _friction_row(friction, rubbing),
            _restitution_row(contact, touching),
            _gyroscopic_row(isotropic, turned),
            _center_row(uneven),
            *_field_rows(fields),
            Row("free motion", True, f"scheme {accuracy.scheme}, {accuracy.substeps} substep(s) per dt", ""),
        ),
    )


def _gravity_row(gravity) -> Row:
    if gravity is None:
        return Row("gravity", False, "not declared", "")
    return Row("gravity", True, f"declared: {gravity.acceleration} m/s²", "acceleration per world")


def _check_many(scene, scheme) -> None:
    """Refuse what contact between bodies does not know yet."""
    hint = "; give the scene Contact(between_bodies=False) if its bodies need not meet"
    if scheme == EVENTS:
        raise ValueError(
            "accuracy has the scheme 'events', which knows contact with walls only; allowed for bodies that touch "
            f"each other are 'fast', 'balanced' and every time-stepping scheme{hint}"
        )
    for b, body in enumerate(scene.bodies):
        if body.kind not in ("block", "sphere"):
            raise ValueError(
                f"Scene.bodies[{b}] is an {body.kind}; allowed where bodies touch each other are blocks and "
                f"spheres{hint}"
            )


def _contact_row(scene, contact) -> Row:
    if contact is not None and scene.walls:
        return Row("wall contact", True, f"declared; {len(scene.walls)} wall(s)", "detection, impacts, solver")
    if contact is not None:
        return Row("wall contact", False, "declared, but the scene has no walls", "")
    reason = "not declared: the walls do not act" if scene.walls else "not declared"
    return Row("wall contact", False, reason, "")


def _between_row(scene, contact, many) -> Row:
    if many:
        return Row("body contact", True, f"declared; {len(scene.bodies)} bodies", "pairs, one problem for all bodies")
    if contact is None:
        return Row("body contact", False, "not declared", "")
    if len(scene.bodies) == 1:
        return Row("body contact", False, "declared, but the scene has one body", "")
    return Row("body contact", False, "declared without contact between bodies", "")


def _friction_row(friction, rubbing) -> Row:
    if rubbing:
        return Row("friction", True, f"declared: μ = {friction.coefficient}", "three rows per contact, circular cone")
    if friction is not None:
        return Row("friction", False, "declared, but nothing can touch", "")
    return Row("friction", False, "not declared", "")


def _restitution_row(contact, touching) -> Row:
    if contact is None or contact.restitution is None:
        return Row("restitution", False, "not declared: impacts are plastic", "")
    if not touching:
        return Row("restitution", False, "declared, but nothing can touch", "")
    return Row("restitution", True, f"declared: e = {contact.restitution}", "Newton's law at impacts")


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


def _field_rows(fields: tuple[FieldSlot, ...]) -> list[Row]:
    """What is declared, then the built-in fields that are not."""
    rows = [
        Row(slot.effects[0].label, True, f"declared: {', '.join(map(repr, slot.effects))}",
            f"{slot.term.count * slot.term.size} parameters per body, one function")
        for slot in fields
    ]  # fmt: skip
    declared = {type(slot.effects[0]) for slot in fields}
    return rows + [Row(kind().label, False, "not declared", "") for kind in FIELDS if kind not in declared]
