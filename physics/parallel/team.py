"""Thread team of a batch, `Team`: work stealing with the compiler `fused`, fixed ranges with other compilers."""

from __future__ import annotations

import numpy as np

from physics.compiler.decorators import backend
from physics.kernels.parallel import work_stealing as at

if backend.PREPARES_CALLS:
    from physics.parallel.thread_team import Team
else:
    from physics.parallel.thread_pool import Pool as Team

__all__ = ["Team", "listed"]


def listed(worlds: np.ndarray) -> np.ndarray:
    """Make the list of taken worlds (TAKEN_FIRST_WORLD + n,) int64, which threads read, from indices `worlds` (n,)."""
    taken = np.zeros(at.TAKEN_FIRST_WORLD + len(worlds), dtype=np.int64)
    taken[at.TAKEN_COUNT], taken[at.TAKEN_FIRST_WORLD :] = len(worlds), worlds
    return taken
