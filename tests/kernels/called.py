"""Call a kernel from a test, as a step does."""

from __future__ import annotations

import numpy as np

from physics.compiler.compiler_choice import COMPILER, PYTHON
from physics.compiler.interpreted.records import records_of


def called(kernel, *arguments):
    """Return what a kernel returns; where nothing is compiled, records have attributes, and 0/0 is no warning."""
    if COMPILER != PYTHON:
        return kernel(*arguments)
    with np.errstate(all="ignore"):
        return kernel(*records_of(arguments))
