"""Options of `numba.njit` that turn reference counts off and on.

Numba counts the references to an array in each function that gets it. A kernel neither allocates nor owns arrays, so a
step needs no counts; with them a step of a tower takes three times as long. Numba does not document the option. All
releases from 0.61 on have it; with a release that refuses it, kernels count references.
"""

from __future__ import annotations

import numba


def _nothing() -> None:
    """Do nothing: an empty function, by whose compilation `_knows_option` sees if Numba accepts the option `_nrt`."""


def _knows_option() -> bool:
    """True if Numba accepts the option, found by compiling an empty function with it."""
    try:
        numba.njit("void()", _nrt=False)(_nothing)
    except KeyError:
        return False
    return True


_IS_KNOWN = _knows_option()
WITHOUT_COUNTS = {"_nrt": False} if _IS_KNOWN else {}
WITH_COUNTS = {"_nrt": True} if _IS_KNOWN else {}
