"""Names of everything in a scene that MJCF cannot express."""

from __future__ import annotations

from physics.scene.effects import Contact, Friction, Gravity
from physics.scene.force_fields import Spring
from physics.scene.scene import Scene
from physics.summary import counted, shown


def inexpressible(scene: Scene) -> list[str]:
    """Name fields, effects and sensors of a scene that MJCF cannot express, such as ``Contact.restitution of 0.5``.

    A body with such a field stays a body without it: one with a motion stands still.
    """
    items = [(body, f"bodies[{b}]") for b, body in enumerate(scene.bodies)]
    items += [(wall, f"walls[{k}]") for k, wall in enumerate(scene.walls)]
    lost = _of_contact(scene.effect(Contact))
    for item, place in items:
        kind = type(item).__name__
        owner = f"{place} {item.name!r}" if item.name else place
        if item.restitution:
            lost.append(f"{kind}.restitution of {owner}")
        if getattr(item, "motion", None):
            lost.append(f"{kind}.motion of {owner} (it stands still in MJCF)")
    friction = scene.effect(Friction)
    if friction is not None and friction.axis is not None:
        lost.append(f"Friction of two coefficients {shown(friction.coefficient)}")
    known = (Gravity, Contact, Friction, Spring)
    others = [type(effect).__name__ for effect in scene.effects if not isinstance(effect, known)]
    lost += [counted(others, most=len(others))] if others else []
    return lost + [f"sensors[{k}]{f' {each.name!r}' if each.name else ''}" for k, each in enumerate(scene.sensors)]


def _of_contact(contact: Contact | None) -> list[str]:
    """Name fields of `Contact` that MJCF cannot express."""
    if contact is None:
        return []
    named = ("restitution", "tangential", "stiffness", "damping")
    lost = [f"Contact.{name} of {getattr(contact, name)}" for name in named if getattr(contact, name)]
    pairs = any(e for _, _, e in contact.restitution_pairs)
    return lost + ["Contact.restitution_pairs"] * pairs
