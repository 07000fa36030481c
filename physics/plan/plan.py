"""From a scene to what is compiled: which effects are on, why, and the switches of the kernel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from physics import validation
from physics.annotations import Preset
from physics.html_table import parts_table
from physics.kernels.forces.force_field_dispatch import Term
from physics.kernels.state.contact_law_dispatch import (
    LAW_ANISOTROPY,
    LAW_DAMPING,
    LAW_ROLLING,
    LAW_SPIN,
    LAW_STIFFNESS,
    LAW_TANGENTIAL,
    LAWS,
)
from physics.kernels.state.layout import BLOCK, ELLIPSOID, HULL, SPHERE, VERTEX_COUNT
from physics.mass.inertia import principal_axes
from physics.plan.accuracy import EVENTS, SCHEMES, Accuracy, resolve
from physics.plan.explanation import Row, make_rows
from physics.scene.effects import Contact, Friction, Gravity, RollingFriction, Sleeping, SpinFriction
from physics.scene.force_field import Field, FieldSlot, field_slots
from physics.scene.scene import Scene
from physics.summary import parts_repr

SHAPE_CODES = {"block": BLOCK, "sphere": SPHERE, "ellipsoid": ELLIPSOID, "hull": HULL}

# Moments that differ by less than this share are equal to rounding: the gyroscopic torque would be noise.
ISOTROPY_TOLERANCE = 1e-14

# Effects that a `repr` names.
MOST_ROWS = 20


@dataclass(frozen=True)
class Plan:
    """The switches that the kernel is compiled for, and the reasons. None is off, True is on.

    `offset_frame` is on where the body frame of a body is not all there is to know of its mass: its principal axes are
    not its body axes, or its geometric centre is not its centre of mass. `pivots` is on where bodies
    touch walls alone and their solver may pivot. `many` is on where bodies touch each other, or touch walls and are
    tied together by springs, or a hull touches walls; `meeting` says whether they touch each other,
    `ellipsoids` whether there are any among those, `hulls` whether any hulls touch anything. `refined` is on where
    `many` is and steps have an error tolerance: by the scheme ``events``. `linked` is on where they are tied together
    and touch nothing. `sleeping` is on where bodies may sleep. `laws` are those of
    `physics.kernels.state.contact_law_dispatch`.
    """

    contact: bool | None
    friction: bool | None
    restitution: bool | None
    gravity: bool | None
    gyroscopic: bool | None
    offset_frame: bool | None
    pivots: bool | None
    scheme: int | None
    events: bool | None
    many: bool | None
    refined: bool | None
    meeting: bool
    ellipsoids: bool | None
    hulls: bool | None
    linked: bool | None
    sleeping: bool | None
    features: int
    fields: tuple[FieldSlot, ...]
    laws: tuple[str, ...]
    rows: tuple[Row, ...]

    __repr__ = parts_repr
    _repr_html_ = parts_table

    def _parts(self) -> tuple[str, ...]:
        on = [row.effect for row in self.rows if row.is_on]
        return (*(f"{effect}: on" for effect in on[:MOST_ROWS]), f"{len(self.rows) - len(on)} off")

    @property
    def key(self) -> tuple:
        """Key that distinguishes one compiled kernel from another."""
        return (
            self.contact, self.friction, self.restitution, self.gravity, self.gyroscopic, self.offset_frame,
            self.pivots, self.scheme is None, self.events, self.many, self.refined, self.ellipsoids, self.hulls,
            self.linked, self.sleeping, self.features,
            *self.laws,
            *(term.marker for term in self.terms),
        )  # fmt: skip

    @property
    def terms(self) -> tuple[Term, ...]:
        """The fields' part in the kernel."""
        return tuple(slot.term for slot in self.fields)

    @property
    def may_raise(self) -> bool:
        """True if a step may end in an exception: that of a user's field."""
        return any(slot.may_raise for slot in self.fields)

    @property
    def field_columns(self) -> int:
        """Columns of parameters that the fields have."""
        return sum(term.count * term.size for term in self.terms)

    def allows(self, moments: np.ndarray, R: np.ndarray) -> np.ndarray:
        """True if the kernel of this plan can turn bodies with these `physics.mass.inertia.principal_axes`.

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
        return ~is_tilted(R) | bool(self.offset_frame)

    def explain(self) -> str:
        """The plan as text: every effect, on or off, why, and what is compiled for it."""
        width = max(len(row.effect) for row in self.rows)
        lines = [
            f"{row.effect:<{width}}  {'on ' if row.is_on else 'off'}  {row.reason}"
            + (f" [{row.compiled}]" if row.compiled else "")
            for row in self.rows
        ]
        return "\n".join(lines)


def is_isotropic(moments: np.ndarray) -> Any:
    """True if all `moments` (..., 3) are equal to rounding: then ω stays constant in free flight."""
    return np.ptp(moments, axis=-1) <= ISOTROPY_TOLERANCE * np.max(moments, axis=-1)


def is_tilted(R: np.ndarray) -> Any:
    """True if the principal axes `R` (..., 3, 3) are not the body axes."""
    return (R - np.eye(3)).any(axis=(-2, -1))


@dataclass(frozen=True)
class _Seen:
    """Findings that a plan is made of."""

    contact: Any
    friction: Friction | None
    gravity: Gravity | None
    touching: bool
    meeting: bool
    rubbing: bool
    isotropic: bool
    turned: bool
    uneven: list[int]
    sleeping: bool
    fields: tuple[FieldSlot, ...]
    laws: tuple[str, ...]


def _see(scene: Scene) -> _Seen:
    """Find the effects that can act in a scene."""
    contact, friction, gravity = scene.effect(Contact), scene.effect(Friction), scene.effect(Gravity)
    meeting = contact is not None and contact.between_bodies and len(scene.bodies) > 1
    touching = contact is not None and (bool(scene.walls) or meeting)
    axes = [principal_axes(body.inertia) for body in scene.bodies]
    isotropic = all(is_isotropic(moments) for moments, _ in axes)
    steady = all(effect.is_steady for effect in scene.effects if isinstance(effect, Field))
    return _Seen(
        contact, friction, gravity, touching, meeting,
        rubbing=touching and friction is not None,
        isotropic=isotropic,
        turned=not isotropic and any(is_tilted(R) for _, R in axes),
        uneven=[b for b, body in enumerate(scene.bodies) if any(body.center)],
        sleeping=touching and steady and scene.effect(Sleeping) is not None,
        fields=field_slots(scene.effects, len(scene.bodies)),
        laws=_laws(scene, contact, friction) if touching else (),
    )  # fmt: skip


def _laws(scene: Scene, contact: Any, friction: Friction | None) -> tuple[str, ...]:
    """The laws of `physics.kernels.state.contact_law_dispatch` that act where bodies touch walls."""
    has_round = any(body.kind in ("sphere", "ellipsoid") for body in scene.bodies)
    is_on = {
        LAW_TANGENTIAL: contact.tangential is not None,
        LAW_ROLLING: has_round and scene.effect(RollingFriction) is not None,
        LAW_SPIN: has_round and scene.effect(SpinFriction) is not None,
        LAW_ANISOTROPY: friction is not None and friction.axis is not None,
        LAW_STIFFNESS: contact.stiffness is not None,
        LAW_DAMPING: contact.stiffness is not None,
    }
    return tuple(law for law in LAWS if is_on[law])


def make_plan(scene: Scene, accuracy: Preset | Accuracy) -> Plan:
    """Decide what a scene needs at an accuracy, or the preset of that name."""
    validation.instance(scene, Scene, "scene", "a physics.Scene")
    accuracy = resolve(accuracy)
    seen, scheme = _see(scene), SCHEMES[accuracy.scheme]
    is_linked = any(slot.term.is_linked for slot in seen.fields)
    hulls = seen.touching and _has(scene, "hull")
    many = seen.touching and (seen.meeting or is_linked or hulls)
    if seen.touching and not many:
        _check_collisions(accuracy)
    _check_laws(scene, seen, many, scheme)
    if seen.sleeping and scheme == EVENTS:
        raise ValueError(
            "accuracy has the scheme 'events', which does not know Sleeping; allowed are 'fast', 'balanced' and every "
            "time-stepping scheme"
        )
    return Plan(
        contact=seen.touching or None,
        friction=seen.rubbing or None,
        restitution=(seen.touching and seen.contact.restitution is not None) or None,
        gravity=(seen.gravity is not None) or None,
        gyroscopic=(not seen.isotropic) or None,
        offset_frame=(seen.turned or bool(seen.uneven)) or None,
        pivots=(seen.touching and not many and accuracy.solver == "sweeps+pivoting") or None,
        scheme=scheme if scheme > 0 else None,
        events=(scheme == EVENTS and not many) or None,
        many=many or None,
        refined=(scheme == EVENTS and many) or None,
        meeting=seen.meeting,
        ellipsoids=(seen.meeting and _has(scene, "ellipsoid")) or None,
        hulls=hulls or None,
        linked=(is_linked and not many) or None,
        sleeping=seen.sleeping or None,
        features=VERTEX_COUNT if _has(scene, "block") else 1,
        fields=seen.fields,
        laws=seen.laws,
        rows=make_rows(scene, accuracy, seen, scheme == EVENTS and many),
    )


def _has(scene: Scene, kind: str) -> bool:
    return any(body.kind == kind for body in scene.bodies)


def _check_collisions(accuracy: Accuracy) -> None:
    """Refuse impacts in turn where a step knows what collides within a stage, not at one moment."""
    if accuracy.collisions == "sequential" and accuracy.scheme != "events":
        raise ValueError(
            f"Accuracy.collisions is 'sequential' with scheme {accuracy.scheme!r}; allowed where bodies touch walls "
            "only is the scheme 'events', which knows the moment of a collision"
        )


def _check_laws(scene: Scene, seen: _Seen, many: bool, scheme: int) -> None:
    """Refuse laws of contact where they are not known."""
    declared = {
        LAW_TANGENTIAL: "Contact.tangential", LAW_ROLLING: "RollingFriction", LAW_SPIN: "SpinFriction",
        LAW_ANISOTROPY: "Friction with two coefficients", LAW_STIFFNESS: "Contact.stiffness",
    }  # fmt: skip
    names = ", ".join(declared[law] for law in seen.laws if law in declared)
    unknown = ", ".join(declared[law] for law in seen.laws if law in (LAW_ROLLING, LAW_SPIN, LAW_STIFFNESS))
    if unknown and scheme == EVENTS:
        raise ValueError(
            f"accuracy has the scheme 'events', which does not know {unknown}; allowed are 'fast', 'balanced' and "
            "every time-stepping scheme"
        )
    if names and many:
        raise ValueError(
            f"Scene.effects holds {names}, which act between a body and a wall; allowed are scenes of one body, or "
            "with Contact(between_bodies=False), without hulls and without Spring between bodies"
        )
    for b, body in enumerate(scene.bodies if LAW_TANGENTIAL in seen.laws else ()):
        if body.kind != "sphere":
            raise ValueError(
                f"Contact.tangential is {seen.contact.tangential}, but Scene.bodies[{b}] is a {body.kind}; allowed "
                "where every body is a sphere: of others it would not say how an impact ends"
            )
