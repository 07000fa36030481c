"""Materials of a scene: coefficients of friction and restitution that bodies, walls and pairs have of their own."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from physics.kernels.contact_law.materials import FRICTION, OF_PAIR, OF_WALL, RESTITUTION, RULES, WALL_COLUMNS
from physics.scene.effects import Contact, Friction
from physics.scene.pairs import FRICTION_RULE, RESTITUTION_RULE, pair_indices

if TYPE_CHECKING:
    from physics.scene.scene import Scene

NO_PAIRS: dict[tuple[int, int], float] = {}


class Materials(NamedTuple):
    """Coefficients of a scene that do not follow from its bodies alone.

    Attributes
    ----------
    rules : tuple of two str
        Rules that combine frictions, and restitutions.
    friction_pairs, restitution_pairs : dict of (int, int) to float
        Exceptions by the indices of their ends (`physics.scene.pairs.pair_indices`).
    at_walls : (bodies, walls, WALL_COLUMNS) float64
        Coefficients of each wall, and of exceptions for a body and a wall; NaN where there is none.
    """

    rules: tuple[str, str]
    friction_pairs: dict[tuple[int, int], float]
    restitution_pairs: dict[tuple[int, int], float]
    at_walls: np.ndarray

    @property
    def act_at_walls(self) -> bool:
        """True if a wall has a coefficient, or an exception names one."""
        return not bool(np.isnan(self.at_walls).all())

    @property
    def differ_at_walls(self) -> bool:
        """True if a body may have different coefficients at two walls."""
        return self.act_at_walls and not _are_equal(self.at_walls)

    @property
    def act_between_bodies(self) -> bool:
        """True if the coefficients of two bodies do not follow from the default rules alone."""
        pairs = (*self.friction_pairs, *self.restitution_pairs)
        return self.rules != (FRICTION_RULE, RESTITUTION_RULE) or any(other >= 0 for _, other in pairs)

    @property
    def rule_codes(self) -> tuple[int, int]:
        """Indices of the rules in `RULES`."""
        return RULES.index(self.rules[0]), RULES.index(self.rules[1])


def _are_equal(at_walls: np.ndarray) -> bool:
    """True if the numbers (bodies, walls, columns) of each body are the same for all walls."""
    return bool(((at_walls == at_walls[:, :1]) | (np.isnan(at_walls) & np.isnan(at_walls[:, :1]))).all())


def find_materials(scene: Scene) -> Materials:
    """Find the materials of a scene.

    Raises
    ------
    ValueError
        An exception for a pair that the scene does not have.
    """
    friction, contact = scene.effect(Friction), scene.effect(Contact)
    rules = (friction.rule if friction else FRICTION_RULE, contact.restitution_rule if contact else RESTITUTION_RULE)
    of_friction = pair_indices(scene, friction.pairs, "Friction.pairs") if friction else NO_PAIRS
    of_contact = pair_indices(scene, contact.restitution_pairs, "Contact.restitution_pairs") if contact else NO_PAIRS
    table = np.full((len(scene.bodies), len(scene.walls), WALL_COLUMNS), np.nan)
    for k, wall in enumerate(scene.walls):
        for which, value in ((FRICTION, wall.friction), (RESTITUTION, wall.restitution)):
            table[:, k, OF_WALL + which] = np.nan if value is None else value
    for which, pairs in ((FRICTION, of_friction), (RESTITUTION, of_contact)):
        for (body, other), value in pairs.items():
            if other < 0:
                table[body, -1 - other, OF_PAIR + which] = value
    return Materials(rules, of_friction, of_contact, table)


def has_restitution(scene: Scene) -> bool:
    """True if any contact of a scene may rebound by Newton's law."""
    contact = scene.effect(Contact)
    if contact is None:
        return False
    own = any(each.restitution is not None for each in (*scene.bodies, *scene.walls))
    return contact.restitution is not None or own or bool(contact.restitution_pairs)


def check_materials(scene: Scene) -> None:
    """Raise a ValueError for a coefficient without its effect, or for a pair that the scene does not have."""
    friction, contact = scene.effect(Friction), scene.effect(Contact)
    for name, items in (("bodies", scene.bodies), ("walls", scene.walls)):
        for k, item in enumerate(items):
            if item.friction is not None and friction is None:
                raise ValueError(
                    f"Scene.{name}[{k}].friction is {item.friction}, but the scene has no friction; add "
                    "physics.Friction() to Scene.effects"
                )
            if item.restitution is not None and contact is None:
                raise ValueError(
                    f"Scene.{name}[{k}].restitution is {item.restitution}, but nothing touches; add physics.Contact() "
                    "to Scene.effects"
                )
            if item.restitution is not None and contact is not None and contact.stiffness is not None:
                raise ValueError(
                    f"Scene.{name}[{k}].restitution is {item.restitution} with Contact.stiffness; allowed is None: "
                    "springs and dampers say how a body bounces"
                )
    find_materials(scene)
