"""Friction of a scene in the form of MJCF: a coefficient for each geom, and exceptions for pairs of geoms.

MuJoCo gives a pair the larger coefficient of its geoms. If a scene's rule gives a pair another coefficient, the pair is
written as a ``<pair>`` element, whose coefficient replaces those of the geoms.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

from physics.compiler.decorators import plain_function
from physics.kernels.contact_law.materials import RULES, combine
from physics.scene.effects import Contact, Friction
from physics.scene.groups import touching_pairs
from physics.scene.materials import find_materials
from physics.scene.scene import Scene


class Frictions:
    """Coefficients of friction of a scene.

    Parameters
    ----------
    scene : Scene
        Its friction must have one coefficient; without friction all coefficients are 0.

    Attributes
    ----------
    bodies, walls : list of float
        Coefficient of each geom. A wall without a coefficient of its own has the least coefficient of all bodies, so
        that the body's coefficient decides.
    """

    def __init__(self, scene: Scene):
        friction = scene.effect(Friction)
        usual = 0.0 if friction is None or friction.axis is not None else friction.along
        is_own = friction is not None and friction.axis is None
        self._scene, self._materials = scene, find_materials(scene)
        self._pairs = self._materials.friction_pairs if is_own else {}
        self._own = [wall.friction if is_own else None for wall in scene.walls]
        self.bodies = [body.friction if is_own and body.friction is not None else usual for body in scene.bodies]
        self.walls = [min(self.bodies) if own is None else own for own in self._own]

    def of_pair(self, body: int, other: int) -> float:
        """Coefficient of a body and another one, or of a body and wall -1 - `other`."""
        own = self.bodies[body]
        theirs = self.bodies[other] if other >= 0 else self._own[-1 - other]
        if (body, other) in self._pairs:
            return self._pairs[body, other]
        if theirs is None:
            return own
        return float(plain_function(combine)(RULES.index(self._materials.rules[0]), own, theirs))

    def exceptions(self) -> Iterator[tuple[int, int, float]]:
        """Iterate over pairs that touch and whose coefficient is not the larger one of their geoms.

        Items are (body, other body or -1 - wall, coefficient).
        """
        contact, bodies = self._scene.effect(Contact), self._scene.bodies
        if contact is None:
            return
        ends = [*(-1 - k for k in range(len(self.walls))), *range(len(bodies))]
        touching = touching_pairs(self._scene, contact.between_bodies)
        for body, other in product(range(len(bodies)), ends):
            if bodies[body].fixed and (other < 0 or bodies[other].fixed):
                continue
            if touching is not None and not touching[body, other if other >= 0 else len(bodies) - 1 - other]:
                continue
            is_pair_of_moving = other >= 0 and not (bodies[body].fixed or bodies[other].fixed)
            if 0 <= other <= body or (is_pair_of_moving and not contact.between_bodies):
                continue
            mu = self.of_pair(body, other)
            if mu != max(self.bodies[body], self.bodies[other] if other >= 0 else self.walls[-1 - other]):
                yield body, other, mu

    @property
    def is_none(self) -> bool:
        """True if no geom has friction."""
        return not any((*self.bodies, *self.walls))
