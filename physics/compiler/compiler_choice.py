"""Choice of the compiler of all kernels, made once in a process, when this module is imported.

==========  ============================================================================================================
`fused`     Compile kernels together through interfaces of Numba that are not public (`compiler.fused`): the fastest.
            The default where the installed Numba is a release that this was tested with.
`numba`     Compile each kernel with `numba.njit`: slower to compile and to run, and works with any Numba.
`python`    Compile nothing. A debugger stops in a kernel as in any function; a step takes a thousand times as long.
==========  ============================================================================================================

The environment variable `RIGID_ENV_COMPILER` names the compiler; `NUMBA_DISABLE_JIT=1` chooses `python`. Kernels have
one source for all three. Results of `numba` and `python` have the same bits. `fused` rounds a product and a sum
together, only once (`fused.folding_builder.fused_multiply_add`).
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version

from physics.compiler.notices import warn

VARIABLE = "RIGID_ENV_COMPILER"
FUSED, NUMBA, PYTHON = COMPILERS = ("fused", "numba", "python")

# Releases of Numba, major and minor, that `fused` is tested with.
TESTED_RELEASES = ((0, 68),)


def choose_compiler(environment: Mapping[str, str], numba_version: str) -> tuple[str, str | None]:
    """Choose the compiler of all kernels from the environment and the installed Numba.

    Parameters
    ----------
    environment : mapping
        Environment variables.
    numba_version : str
        Version of the installed Numba; "" if it is not installed.

    Returns
    -------
    compiler : str
        One of `COMPILERS`.
    warning : str or None
        Line that tells the user of a slower or untested compiler; None if there is nothing to tell.

    Raises
    ------
    ValueError
        `RIGID_ENV_COMPILER` names none of `COMPILERS`.
    """
    asked = environment.get(VARIABLE, "")
    if asked and asked not in COMPILERS:
        raise ValueError(f"{VARIABLE} is {asked!r}; allowed are {', '.join(COMPILERS)}")
    if environment.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
        is_overruled = asked not in ("", PYTHON)
        return PYTHON, f"NUMBA_DISABLE_JIT is set, and {VARIABLE}={asked} is not followed" if is_overruled else None
    if asked in (NUMBA, PYTHON):
        return asked, None
    is_tested = _release(numba_version) in TESTED_RELEASES
    if not numba_version:
        return PYTHON, "Numba is not installed: kernels are run by Python, a thousand times slower"
    tested = " and ".join(f"{major}.{minor}" for major, minor in TESTED_RELEASES)
    if asked == FUSED and not is_tested:
        return FUSED, f"{VARIABLE} is 'fused', which is tested with Numba {tested}; installed is {numba_version}"
    if is_tested:
        return FUSED, None
    return NUMBA, (
        f"Numba {numba_version} is installed; the fast compiler is tested with {tested}. Kernels are compiled by plain "
        "Numba: the first step of a scene takes some ten times as long, later ones two to three times"
    )


def round_alike(one: str, other: str) -> bool:
    """True if kernels give the same bits with these two compilers, named as in `COMPILERS`."""
    return one == other or FUSED not in (one, other)


def _release(numba_version: str) -> tuple[int, ...]:
    """Major and minor number of a version such as ``0.68.1``."""
    return tuple(int(part) for part in numba_version.split(".")[:2] if part.isdigit())


def _choose() -> str:
    try:
        installed = version("numba")
    except PackageNotFoundError:
        installed = ""
    compiler, warning = choose_compiler(os.environ, installed)
    if warning is not None:
        warn(warning)
    return compiler


COMPILER = _choose()
