"""Reasons for which schemes refuse a scene, as messages; each function returns "" if it has no objection."""

from __future__ import annotations

import numpy as np

from physics.accuracy import Accuracy
from physics.kernels.state.contact_law_dispatch import LAW_ANISOTROPY, LAW_TANGENTIAL
from physics.scene.body_axes import axis_table
from physics.scene.needs import Needs
from physics.scene.scene import Scene


def to_tangential(scene: Scene, needs: Needs) -> str:
    """Message against tangential restitution in a scene with bodies other than spheres; "" if there is no conflict."""
    for b, body in enumerate(scene.bodies if LAW_TANGENTIAL in needs.laws else ()):
        if body.kind != "sphere" and not body.fixed:
            return (
                f"Contact.tangential is {needs.contact.tangential}, but Scene.bodies[{b}] is a {body.kind}; allowed "
                "where every body that moves is a sphere: of others it would not say how an impact ends"
            )
    return ""


def to_axes_of_walls(scene: Scene, needs: Needs) -> str:
    """Message against axes of friction for each wall where bodies touch each other; "" if there is no conflict.

    Bodies with axes of their own need no other one.
    """
    if LAW_ANISOTROPY not in needs.laws or not needs.meeting or np.ndim(needs.friction.axis) == 1:
        return ""
    for b, has_axis in enumerate(axis_table(scene, needs.friction.body_axes).any(axis=1)):
        if not has_axis:
            return (
                f"Friction.axis has a direction for each wall, and Scene.bodies[{b}] may touch other bodies; allowed "
                "is one direction for all contacts, or one of Friction.body_axes for this body"
            )
    return ""


def to_turns(needs: Needs, accuracy: Accuracy) -> str:
    """Message against sequential impacts, for schemes that find the collisions of a stage, but not their exact times.

    "" if the accuracy does not ask for sequential impacts, or nothing can touch.
    """
    if needs.touching and accuracy.collisions == "sequential":
        return (
            f"Accuracy.collisions is 'sequential' with scheme {accuracy.scheme!r}; allowed where bodies touch walls "
            "only is the scheme 'events', which knows the moment of a collision"
        )
    return ""
