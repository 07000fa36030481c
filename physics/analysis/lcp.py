"""Linear complementarity problem: solution by a pivoting method, with checked arguments and an explained result."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from physics.kernels.lcp import scaling_and_certificate
from physics.kernels.lcp.dantzig import dantzig, dantzig_sizes
from physics.kernels.lcp.lemke import lemke, lemke_sizes

METHODS = ("lemke", "dantzig")
PIVOTS_PER_UNKNOWN = 50  # a few are usual; worst cases take 2^n, for which a caller sets max_pivots
PSD_TOLERANCE = 2.0**-46  # rounding error of symmetry and eigenvalues, relative to n times the largest entry


class LcpStatus(IntEnum):
    """Outcome of a pivoting solver; `message` explains it."""

    SOLVED = scaling_and_certificate.LCP_SOLVED
    RAY = scaling_and_certificate.LCP_RAY
    PIVOT_LIMIT = scaling_and_certificate.LCP_PIVOT_LIMIT
    BAD_DATA = scaling_and_certificate.LCP_BAD_DATA
    INACCURATE = scaling_and_certificate.LCP_INACCURATE

    @property
    def message(self) -> str:
        """Explanation of the status in words, and advice."""
        return _MESSAGES[self]


_MESSAGES = {
    LcpStatus.SOLVED: "Solved.",
    LcpStatus.RAY: (
        "No solution found: the path ended in a ray. For a positive semidefinite M there is no z >= 0 with "
        "M z + q >= 0: check q for demands that contradict each other. For other M try another method."
    ),
    LcpStatus.PIVOT_LIMIT: "Pivot limit reached before a solution: raise max_pivots.",
    LcpStatus.BAD_DATA: (
        "The data are not of the kind the method needs: M and q must be finite, and for 'dantzig' "
        "the diagonal of M must be >= 0."
    ),
    LcpStatus.INACCURATE: (
        "A solution was found, but rounding left a residual above 1e-9 of the data: M is nearly singular. "
        "Use z only if the residual is small enough for you, or try the other method."
    ),
}


@dataclass(frozen=True)
class LcpResult:
    """Solution of w = M z + q, w >= 0, z >= 0, z·w = 0.

    Attributes
    ----------
    z, w : (n,) float64
        Solution; z is zero unless the status is `SOLVED` or `INACCURATE`. w = M z + q, as computed.
    status : LcpStatus
        Outcome; `status.message` explains it.
    pivots : int
        Number of pivots.
    residual : float
        Natural map max |min(z, w)|; zero exactly at solutions.
    """

    z: np.ndarray
    w: np.ndarray
    status: LcpStatus
    pivots: int
    residual: float


def lcp(M, q, method: str = "lemke", max_pivots: int | None = None) -> LcpResult:
    """Solve the linear complementarity problem w = M z + q, w >= 0, z >= 0, z·w = 0.

    Parameters
    ----------
    M : (n, n) array_like
        Matrix of the problem.
    q : (n,) array_like
        Vector of the problem.
    method : {"lemke", "dantzig"}
        "lemke" takes any M. If M is positive semidefinite, or more generally
        copositive-plus, it finds a solution or shows that there is none. "dantzig"
        is faster and takes symmetric positive semidefinite M only, as in
        frictionless contact.
    max_pivots : int, optional
        Largest number of pivots; None: 50 (n + 1).

    Returns
    -------
    LcpResult
        Solution and outcome.

    Raises
    ------
    ValueError
        Shapes do not fit, an entry is not finite, the method is unknown or does not
        take this M, or max_pivots is negative.

    References
    ----------
    See `physics.kernels.lcp.lemke` and `physics.kernels.lcp.dantzig`.
    """
    M, q = _checked(M, q)
    n = len(q)
    if method not in METHODS:
        raise ValueError(f"method is {method!r}; allowed: {', '.join(map(repr, METHODS))}")
    if max_pivots is None:
        max_pivots = PIVOTS_PER_UNKNOWN * (n + 1)
    if max_pivots < 0:
        raise ValueError(f"max_pivots is {max_pivots}; allowed: 0 or more")
    z = np.zeros(n)
    if method == "lemke":
        shape, length = lemke_sizes(n)
        kernel = lemke
    else:
        _require_semidefinite(M)
        shape, length = dantzig_sizes(n)
        kernel = dantzig
    status, pivots = kernel(M, q, z, np.empty(shape), np.empty(length, np.int64), int(max_pivots))
    w = M @ z + q
    residual = float(np.max(np.abs(np.minimum(z, w)), initial=0.0))
    return LcpResult(z, w, LcpStatus(status), int(pivots), residual)


def _checked(M, q) -> tuple[np.ndarray, np.ndarray]:
    M = np.ascontiguousarray(M, dtype=np.float64)
    q = np.ascontiguousarray(q, dtype=np.float64)
    if q.ndim != 1:
        raise ValueError(f"q has shape {q.shape}; allowed: (n,)")
    if M.shape != (len(q), len(q)):
        raise ValueError(f"M has shape {M.shape}; allowed: {(len(q), len(q))}, from the length of q")
    for name, value in (("M", M), ("q", q)):
        bad = np.argwhere(~np.isfinite(value))
        if len(bad):
            where = tuple(int(k) for k in bad[0])
            raise ValueError(f"{name}{list(where)} is {value[where]}; allowed: finite numbers")
    return M, q


def _require_semidefinite(M: np.ndarray) -> None:
    tolerance = PSD_TOLERANCE * len(M) * np.max(np.abs(M), initial=0.0)
    asymmetry = float(np.max(np.abs(M - M.T), initial=0.0))
    if asymmetry > tolerance:
        raise ValueError(
            f"M differs from its transpose by {asymmetry:g}; method 'dantzig' takes symmetric M only: "
            "use method='lemke'"
        )
    least = float(np.min(np.linalg.eigvalsh(M), initial=0.0)) if len(M) else 0.0
    if least < -tolerance:
        raise ValueError(
            f"M has the eigenvalue {least:g}; method 'dantzig' takes positive semidefinite M only: use method='lemke'"
        )
