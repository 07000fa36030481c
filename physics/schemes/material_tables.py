"""Materials of a scene in the form in which kernels take them: at walls, and for two bodies."""

from __future__ import annotations

import numpy as np

from physics.kernels.contact_law.materials import WallMaterials
from physics.kernels.multibody.data.arrays import PairMaterials
from physics.kernels.state import layout as at
from physics.scene.materials import find_materials
from physics.scene.scene import Scene
from physics.schemes.scheme import Switches


def wall_materials(scene: Scene, switches: Switches, differ: bool | None = None) -> WallMaterials | None:
    """Layout of a scene's coefficients at walls; None if each body has the same coefficients at all walls.

    `differ` tells whether the scheme looks at the wall of each contact; None: only if walls differ.
    """
    if not switches.material_columns:
        return None
    if differ is None:
        differ = bool(switches.walls_differ)
    column = at.PARAM_SIZE + switches.field_columns
    return WallMaterials(len(scene.walls), differ, column, find_materials(scene).rule_codes)


def pair_materials(scene: Scene, switches: Switches) -> PairMaterials | None:
    """Rules and exceptions for two bodies of a scene; None if the default rules hold for all of them."""
    if not switches.pair_materials:
        return None
    found, count = find_materials(scene), len(scene.bodies)
    tables = []
    for pairs in (found.friction_pairs, found.restitution_pairs):
        numbers = {a * count + b: value for (a, b), value in pairs.items() if b >= 0}
        keys = sorted(numbers)
        tables += [np.array(keys, dtype=np.int64), np.array([numbers[key] for key in keys], dtype=np.float64)]
    return PairMaterials(np.array(found.rule_codes, dtype=np.int64), *tables)
