"""Options of `numba.njit` that turn reference counts off and on.

Numba counts the references to an array, in each function that gets it. A kernel allocates nothing and owns nothing, so
a step needs no count; a tower takes three times as long with counts. The option is not documented by Numba. All
releases from 0.61 on have it; if one refuses it, kernels count.
"""

from __future__ import annotations

import numba


def _nothing() -> None:
    """Do nothing, in place of a kernel."""


def _knows_option() -> bool:
    """True if Numba knows the option; only the compilation of an empty function shows it."""
    try:
        numba.njit("void()", _nrt=False)(_nothing)
    except KeyError:
        return False
    return True


_IS_KNOWN = _knows_option()
WITHOUT_COUNTS = {"_nrt": False} if _IS_KNOWN else {}
WITH_COUNTS = {"_nrt": True} if _IS_KNOWN else {}
