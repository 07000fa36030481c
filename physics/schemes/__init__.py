"""Schemes that step a world, one module for each; `physics.schemes.scheme` explains how to add one."""

from __future__ import annotations

from importlib import import_module

from physics.accuracy import Accuracy
from physics.scene.needs import Needs
from physics.scene.scene import Scene
from physics.schemes.scheme import Scheme

MODULES = (
    "many_bodies",
    "springs",
    "events",
    "walls",
)
"""Names of the modules with schemes, in order of preference: the first scheme that takes a scene steps it."""

SCHEMES: tuple[Scheme, ...] = tuple(
    scheme for name in MODULES for scheme in import_module(f"physics.schemes.{name}").SCHEMES
)


def scheme_for(scene: Scene, needs: Needs, accuracy: Accuracy) -> Scheme:
    """Find the scheme that steps a scene at an accuracy.

    Raises
    ------
    ValueError
        No scheme takes the scene, or the scene declares an effect that its scheme does not support.
    """
    for scheme in SCHEMES:
        if scheme.takes(needs, accuracy):
            if objection := scheme.objection(scene, needs, accuracy):
                raise ValueError(objection)
            return scheme
    raise ValueError(
        f"Accuracy.scheme is {accuracy.scheme!r}, which none of the schemes {', '.join(map(repr, SCHEMES))} takes for "
        f"{scene!r}; allowed are other schemes"
    )
