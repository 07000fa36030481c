"""All mutants, and the folders that need at least two."""

from __future__ import annotations

from tests.mutants.compilers import COMPILERS
from tests.mutants.environments import ENVIRONMENTS
from tests.mutants.many_bodies import MANY_BODIES
from tests.mutants.mutant import ROOT, Mutant
from tests.mutants.one_body import ONE_BODY
from tests.mutants.world import WORLDS

MUTANTS: list[Mutant] = [*ONE_BODY, *MANY_BODIES, *COMPILERS, *WORLDS, *ENVIRONMENTS]

# Folders whose parts are covered one by one.
SPLIT = ("physics/kernels/multibody",)


def covered_folders() -> list[str]:
    """Folders that need at least two mutants, those below them included."""
    kernels = [path.parent.relative_to(ROOT).as_posix() for path in (ROOT / "physics/kernels").glob("*/__init__.py")]
    parts = [path.parent.relative_to(ROOT).as_posix() for of in SPLIT for path in (ROOT / of).glob("*/__init__.py")]
    others = ["physics/compiler", "physics/world", "physics/io", "rigid_env/tasks", "rigid_env/envs", "agents"]
    return sorted({*kernels, *parts, *others} - set(SPLIT))
