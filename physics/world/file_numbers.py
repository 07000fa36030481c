"""Check of the numbers of a snapshot file, before a kernel reads them."""

from __future__ import annotations

import numpy as np

from physics.kernels.state import layout as at
from physics.world.batch import Batch
from physics.world.snapshot import KEPT, Snapshot


def check_numbers(world: Batch, snapshot: Snapshot) -> None:
    """Refuse a snapshot of a file with numbers that no step of this scene could have written.

    Kernels use some of these numbers as counts and indices without a check.

    Raises
    ------
    ValueError
        A state or a parameter is not finite, or the contact memory names contacts that cannot exist in the scene.
    """
    parts = dict(zip(KEPT, snapshot.arrays))
    for name in ("state", "params", "gravity"):
        if not (np.abs(parts[name]) <= at.OVERFLOW_LIMIT).all():
            raise ValueError(f"snapshot is {snapshot!r}, of a file whose {name} is not finite; allowed are real states")
    if world.plan.contact and not world.plan.scheme.memory.is_valid(world, parts["memory"]):
        raise ValueError(
            f"snapshot is {snapshot!r}, of a file whose contact memory names contacts that there cannot be; allowed is "
            "what a step has written"
        )
