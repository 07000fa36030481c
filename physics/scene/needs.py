"""Needs of a scene: the effects that can act in it. Scheme and compiled kernels depend on them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from physics.kernels.contact_law.materials import WALL_COLUMNS
from physics.kernels.state.contact_law_dispatch import (
    LAW_ANISOTROPY,
    LAW_DAMPING,
    LAW_ROLLING,
    LAW_SPIN,
    LAW_STIFFNESS,
    LAW_TANGENTIAL,
    LAWS,
)
from physics.kernels.state.layout import VERTEX_COUNT
from physics.mass.inertia import principal_axes
from physics.scene.effects import Contact, Friction, Gravity, RollingFriction, Sleeping, SpinFriction
from physics.scene.field_shapes import have_axes, shape_table
from physics.scene.force_field import Field, FieldSlot, field_slots
from physics.scene.groups import potential_pairs, touching_pairs
from physics.scene.materials import find_materials, has_restitution
from physics.scene.parts import with_parts
from physics.scene.scene import Scene

# Moments of inertia that differ by less than this share are equal to rounding; their gyroscopic torque would be noise.
ISOTROPY_TOLERANCE = 1e-14


@dataclass(frozen=True)
class Needs:
    """Effects that can act in a scene.

    Attributes
    ----------
    contact, friction, gravity : Contact, Friction, Gravity or None
        Effects as the scene declares them.
    touching : bool
        Whether bodies can touch anything, a wall or another body.
    meeting : bool
        Whether bodies can touch each other, fixed ones included.
    fixed : bool
        Whether some bodies are fixed.
    rubbing : bool
        Whether friction can act.
    rebounding : bool
        Whether contacts may rebound by Newton's law.
    material_columns : int
        Numbers of a body for its coefficients at walls; 0 if no wall has one of its own, and no exception names a wall.
    walls_differ, pair_materials : bool
        Whether a body may have different coefficients at two walls; whether two bodies have others than those of the
        default rules (`physics.scene.materials`).
    lone : bool
        Whether exactly one body moves, and it can touch fixed bodies, none of them a compound; or it is `grained`, or a
        cylinder that can touch walls, or contact is compliant.
    grouped : bool
        Whether collision groups keep some pairs apart that would touch otherwise, so that contact must ask for them.
    motion_columns : int
        Numbers of a body for its prescribed motion; 0 if no body has one.
    grained : bool
        Whether bodies have axes of friction of their own, which turn with them.
    linked : bool
        Whether springs tie bodies together.
    kinds : frozenset of str
        Shapes of the bodies, such as ``block``, and of the parts of compounds.
    features : int
        Features with which a body may touch a wall: the 8 vertices of a block if the scene has blocks, else 1.
    isotropic : bool
        Whether every body that is not fixed has three equal moments of inertia.
    turned : bool
        Whether some body's principal axes are not its body axes; False if `isotropic`.
    uneven : list of int
        Indices of bodies whose centre of mass is not their geometric centre.
    sleeping : bool
        Whether bodies may sleep.
    fields : tuple of FieldSlot
        Force fields of the scene.
    laws : tuple of str
        Contact laws at walls beyond rigid contact, names from `physics.kernels.state.contact_law_dispatch.LAWS`.
    """

    contact: Any
    friction: Friction | None
    gravity: Gravity | None
    touching: bool
    meeting: bool
    fixed: bool
    rubbing: bool
    rebounding: bool
    material_columns: int
    walls_differ: bool
    pair_materials: bool
    lone: bool
    grouped: bool
    motion_columns: int
    grained: bool
    linked: bool
    kinds: frozenset[str]
    features: int
    isotropic: bool
    turned: bool
    uneven: list[int]
    sleeping: bool
    fields: tuple[FieldSlot, ...]
    laws: tuple[str, ...]

    @property
    def ellipsoids(self) -> bool:
        """True if bodies can touch each other and ellipsoids are among them."""
        return self.meeting and "ellipsoid" in self.kinds

    @property
    def hulls(self) -> bool:
        """True if hulls can touch walls or other bodies."""
        return self.touching and "hull" in self.kinds

    @property
    def capsules(self) -> bool:
        """True if capsules can touch walls or other bodies."""
        return self.touching and "capsule" in self.kinds

    @property
    def cylinders(self) -> bool:
        """True if cylinders can touch walls or other bodies."""
        return self.touching and "cylinder" in self.kinds

    @property
    def compounds(self) -> bool:
        """True if compounds can touch walls or other bodies."""
        return self.touching and "compound" in self.kinds


def _is_lone(moving: int, kinds: frozenset[str], touching: bool, is_coupled: bool) -> bool:
    return moving == 1 and "compound" not in kinds and (is_coupled or (touching and "cylinder" in kinds))


def is_isotropic(moments: np.ndarray) -> Any:
    """True (...) where the three `moments` (..., 3) of a body are equal to rounding: it needs no gyroscopic torque."""
    return np.ptp(moments, axis=-1) <= ISOTROPY_TOLERANCE * np.max(moments, axis=-1)


def is_tilted(R: np.ndarray) -> Any:
    """True (...) where the rotation `R` (..., 3, 3) from principal to body axes is not the identity."""
    return (R - np.eye(3)).any(axis=(-2, -1))


def find_needs(scene: Scene) -> Needs:
    """Find the effects that can act in a scene."""
    contact, friction, gravity = scene.effect(Contact), scene.effect(Friction), scene.effect(Gravity)
    kinds = frozenset(body.kind for body in with_parts(scene.bodies))
    fixed = any(body.fixed for body in scene.bodies)
    meeting, at_walls, grouped = _meetings(scene, contact, fixed)
    touching = at_walls or meeting
    axes = [principal_axes(body.inertia) for body in scene.bodies if not body.fixed]
    isotropic = all(is_isotropic(moments) for moments, _ in axes)
    motion_columns = max([0, *(body.motion.column_count for body in scene.bodies if body.motion is not None)])
    steady = all(effect.is_steady for effect in scene.effects if isinstance(effect, Field))
    shapes = None if have_axes(scene.bodies) else shape_table(scene.bodies)
    fields, materials = field_slots(scene.effects, len(scene.bodies), shapes), find_materials(scene)
    grained = touching and friction is not None and bool(friction.body_axes)
    soft = touching and contact.stiffness is not None
    return Needs(
        contact, friction, gravity, touching, meeting, fixed,
        rubbing=touching and friction is not None,
        rebounding=touching and has_restitution(scene),
        material_columns=WALL_COLUMNS * len(scene.walls) if touching and materials.act_at_walls else 0,
        walls_differ=touching and materials.differ_at_walls,
        pair_materials=meeting and materials.act_between_bodies,
        lone=_is_lone(len(axes), kinds, touching, (meeting and fixed) or grained or soft),
        grouped=grouped,
        motion_columns=motion_columns,
        grained=grained,
        linked=any(slot.term.is_linked for slot in fields),
        kinds=kinds,
        features=VERTEX_COUNT if "block" in kinds else 1,
        isotropic=isotropic,
        turned=not isotropic and any(is_tilted(R) for _, R in axes),
        uneven=[b for b, body in enumerate(scene.bodies) if any(body.center)],
        sleeping=touching and steady and not motion_columns and scene.effect(Sleeping) is not None,
        fields=fields,
        laws=_laws(scene, contact, friction) if touching else (),
    )  # fmt: skip


def _meetings(scene: Scene, contact: Contact | None, fixed: bool) -> tuple[bool, bool, bool]:
    """Answer whether bodies can touch each other, whether they can touch walls, and whether groups decide which.

    Groups that keep all bodies apart, and none from a wall, are `Contact(between_bodies=False)`.
    """
    if contact is None:
        return False, False, False
    touching, bodies = touching_pairs(scene, contact.between_bodies), len(scene.bodies)
    if touching is None:
        return fixed or (contact.between_bodies and bodies > 1), bool(scene.walls), False
    meeting, at_walls = bool(touching[:, :bodies].any()), bool(touching[:, bodies:].any())
    apart = potential_pairs(scene, contact.between_bodies) & ~touching
    return meeting, at_walls, bool(apart[:, bodies * (not meeting) :].any()) and (meeting or at_walls)


def _laws(scene: Scene, contact: Any, friction: Friction | None) -> tuple[str, ...]:
    """Names of the contact laws in `physics.kernels.state.contact_law_dispatch.LAWS` that act at the scene's walls."""
    has_round = any(body.kind in ("sphere", "ellipsoid", "capsule", "cylinder") for body in with_parts(scene.bodies))
    is_on = {
        LAW_TANGENTIAL: contact.tangential is not None,
        LAW_ROLLING: has_round and scene.effect(RollingFriction) is not None,
        LAW_SPIN: has_round and scene.effect(SpinFriction) is not None,
        LAW_ANISOTROPY: friction is not None and friction.axis is not None,
        LAW_STIFFNESS: contact.stiffness is not None,
        LAW_DAMPING: contact.stiffness is not None,
    }
    return tuple(law for law in LAWS if is_on[law])
