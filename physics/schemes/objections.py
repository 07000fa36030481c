"""Reasons that several schemes have to refuse a scene."""

from __future__ import annotations

from physics.accuracy import Accuracy
from physics.kernels.state.contact_law_dispatch import (
    LAW_ANISOTROPY,
    LAW_ROLLING,
    LAW_SPIN,
    LAW_STIFFNESS,
    LAW_TANGENTIAL,
)
from physics.scene.needs import Needs
from physics.scene.scene import Scene

DECLARED = {
    LAW_TANGENTIAL: "Contact.tangential", LAW_ROLLING: "RollingFriction", LAW_SPIN: "SpinFriction",
    LAW_ANISOTROPY: "Friction with two coefficients", LAW_STIFFNESS: "Contact.stiffness",
}  # fmt: skip
"""Laws of contact by what declares them."""

_OF_STAGES = (LAW_ROLLING, LAW_SPIN, LAW_STIFFNESS)


def declared_laws(needs: Needs) -> str:
    """Names of the laws that a scene declares, with commas."""
    return ", ".join(DECLARED[law] for law in needs.laws if law in DECLARED)


def to_laws_of_stages(needs: Needs) -> str:
    """Object to laws that act over a stage of time stepping, and to sleeping, in a scheme with an error tolerance."""
    unknown = ", ".join(DECLARED[law] for law in needs.laws if law in _OF_STAGES)
    if unknown:
        return (
            f"accuracy has the scheme 'events', which does not know {unknown}; allowed are 'fast', 'balanced' and "
            "every time-stepping scheme"
        )
    return ""


def to_sleeping(needs: Needs) -> str:
    """Object to sleeping bodies."""
    if needs.sleeping:
        return (
            "accuracy has the scheme 'events', which does not know Sleeping; allowed are 'fast', 'balanced' and every "
            "time-stepping scheme"
        )
    return ""


def to_tangential(scene: Scene, needs: Needs) -> str:
    """Object to tangential restitution of bodies that are not spheres."""
    for b, body in enumerate(scene.bodies if LAW_TANGENTIAL in needs.laws else ()):
        if body.kind != "sphere":
            return (
                f"Contact.tangential is {needs.contact.tangential}, but Scene.bodies[{b}] is a {body.kind}; allowed "
                "where every body is a sphere: of others it would not say how an impact ends"
            )
    return ""


def to_turns(needs: Needs, accuracy: Accuracy) -> str:
    """Object to impacts in turn where a step knows what collides within a stage, not at one moment."""
    if needs.touching and accuracy.collisions == "sequential":
        return (
            f"Accuracy.collisions is 'sequential' with scheme {accuracy.scheme!r}; allowed where bodies touch walls "
            "only is the scheme 'events', which knows the moment of a collision"
        )
    return ""
