"""The contact problem of one instant, solved by trying what each contact may do.

For impulses p and velocities after an impact, u = W p + b, or for forces f and
accelerations, a = A f + b, in the same words: each contact

    is open    f = 0,                     a_n >= 0,
    holds      a = 0,                     |f_t| <= μ f_n,
    slides     a_n = 0,  f_n >= 0,        f_t = -μ f_n d,

with d the direction of sliding: given (the contact slides already), or unknown
(it starts to) and then d = a_t/|a_t|. After an impact the normal components are
relative to what the law of restitution asks for.

Four contacts of one wall share a normal force in more than one way: it is
max(0, ℓ(place)) with ℓ affine in the plane of the wall, which is the least
norm that gives the same resultant.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq, minimize, root

OPEN, HOLD, SLIDE = "open", "hold", "slide"
RANK = 1e-9  # singular values below this share of the largest are those of an indeterminate problem
SIGN = 1e-10  # how negative, relative to the largest, what must not be negative may be by rounding


class Contacts(NamedTuple):
    """A contact problem; components are normal, tangent 1, tangent 2."""

    A: np.ndarray  # (3 n, 3 n)
    b: np.ndarray  # (3 n,)
    mu: float
    walls: tuple  # of each contact
    places: np.ndarray  # (n, 2) in the plane of the wall, relative to the centre of mass [m]
    given: tuple  # of each contact the direction of sliding, (2,), or None


class Answer(NamedTuple):
    """Modes of the contacts, forces or impulses (n, 3), accelerations or velocities (n, 3)."""

    modes: tuple
    f: np.ndarray
    a: np.ndarray


def shape_functions(walls, places):
    """(n, m) basis of the normal forces of active contacts: per wall affine in the place if there are four or more."""
    columns = []
    for wall in sorted(set(walls)):
        mine = np.flatnonzero(np.array(walls) == wall)
        block = np.eye(len(mine)) if len(mine) <= 3 else np.column_stack([np.ones(len(mine)), places[mine]])
        for column in block.T:
            columns.append(np.zeros(len(walls)))
            columns[-1][mine] = column
    return np.array(columns).T.reshape(len(walls), -1)


def force_basis(walls, places, modes, directions, mu):
    """(3 n, m) with f = G z for n active contacts: normal forces, friction of those that slide, holds."""
    normal = shape_functions(walls, places)
    G = np.zeros((3 * len(walls), normal.shape[1]))
    for i, mode in enumerate(modes):
        G[3 * i] = normal[i]
        if mode == SLIDE:
            G[3 * i + 1 : 3 * i + 3] = -mu * np.outer(directions[i], normal[i])
    tangents = [3 * i + k for i, mode in enumerate(modes) if mode == HOLD for k in (1, 2)]
    return np.hstack([G, np.eye(len(G))[:, tangents]])


def constrained_rows(modes):
    """Rows of a that are zero: normals of the active contacts, tangents of those that hold."""
    return [3 * i + k for i, mode in enumerate(modes) for k in range(3 if mode == HOLD else 1)]


def mode_forces(A, b, walls, places, modes, directions, mu):
    """(n, 3) forces of active contacts whose modes and directions of sliding are known."""
    G = force_basis(walls, places, modes, directions, mu)
    rows = constrained_rows(modes)
    z = np.linalg.lstsq(A[rows] @ G, -b[rows], rcond=RANK)[0]
    return (G @ z).reshape(-1, 3)


def hold_margin(A, modes, f, mu):
    """Margin of the contacts that hold inside their cones, >= 0 if their friction can be had; [N] or [N s].

    Tangential forces that give no acceleration may be added: none for one
    contact, those along the connecting line for two (then the margin is the
    length of the interval that is left), more for three and more.
    """
    holds = [i for i, mode in enumerate(modes) if mode == HOLD]
    if not holds:
        return np.inf
    tangents = [3 * i + k for i in holds for k in (1, 2)]
    _, s, Vt = np.linalg.svd(A[:, tangents])
    null = Vt[np.count_nonzero(s > RANK * s[0]) :].reshape(-1, len(holds), 2)
    reach, f_t = mu * f[holds, 0], f[holds, 1:]
    if len(null) == 0:
        return np.min(reach - np.linalg.norm(f_t, axis=1))
    if len(null) == 1:
        return _interval(reach, f_t, null[0])
    return _widest(reach, f_t, null)


def _interval(reach, f_t, k):
    """Length of the s for which |f_t + s k| <= reach at every contact; negative if there are none."""
    a, h, c = np.sum(k * k, 1), np.sum(k * f_t, 1), np.sum(f_t * f_t, 1) - reach**2
    moved = a > RANK * a.max()
    if np.any(reach < 0) or np.any(c[~moved] > 0):
        return -np.inf
    a, h, c = a[moved], h[moved], c[moved]
    square = h * h - a * c
    if square.min() < 0:
        return square.min() / np.abs(reach).max()
    width = np.sqrt(square)
    return np.min((-h + width) / a) - np.max((-h - width) / a)


def _widest(reach, f_t, null):
    """The largest m with |f_t + Σ s_k null_k| <= reach - m: a small convex programme."""
    scale = max(np.abs(reach).max(), np.abs(f_t).max(), 1e-300)

    def inside(z):
        moved = (f_t / scale + np.tensordot(z[:-1], null, 1)) ** 2
        return reach / scale - np.sqrt(moved.sum(1) + 1e-24) - z[-1]

    begin = np.zeros(len(null) + 1)
    begin[-1] = inside(begin).min()
    found = minimize(lambda z: -z[-1], begin, constraints={"type": "ineq", "fun": inside}, method="SLSQP")
    return scale * max(begin[-1], inside(np.append(found.x[:-1], 0.0)).min())


def solve(problem: Contacts) -> Answer:
    """The first combination of modes that obeys every law.

    The order decides where there is more than one (large friction): combinations in which at most one contact
    starts to slide come first, then those in which none holds; among them those with most contacts active; then
    those with most that hold.

    Raises
    ------
    RuntimeError
        If there is none (Painlevé).
    """
    choices = [(HOLD, SLIDE, OPEN) if d is None else (SLIDE, OPEN) for d in problem.given]

    def effort(modes):
        searched = sum(mode == SLIDE and d is None for mode, d in zip(modes, problem.given))
        return searched > 1, searched > 1 and HOLD in modes, modes.count(OPEN), -modes.count(HOLD)

    for modes in sorted(itertools.product(*choices), key=effort):
        answer = _attempt(problem, modes)
        if answer is not None:
            return answer
    raise RuntimeError("no combination of open, holding and sliding contacts obeys the laws")


def _forces(problem, modes, directions):
    active = [i for i, mode in enumerate(modes) if mode != OPEN]
    f = np.zeros((len(modes), 3))
    if active:
        rows = [3 * i + k for i in active for k in range(3)]
        f[active] = mode_forces(
            problem.A[np.ix_(rows, rows)], problem.b[rows], [problem.walls[i] for i in active],
            problem.places[active], [modes[i] for i in active], [directions[i] for i in active], problem.mu,
        )  # fmt: skip
    return f, (problem.A @ f.ravel() + problem.b).reshape(-1, 3)


def _attempt(problem, modes):
    unknown = [i for i, mode in enumerate(modes) if mode == SLIDE and problem.given[i] is None]

    def answer(angles):
        directions = list(problem.given)
        for i, angle in zip(unknown, angles):
            directions[i] = np.array([np.cos(angle), np.sin(angle)])
        return Answer(modes, *_forces(problem, modes, directions)), directions

    def across(angles):
        (_, _, a), d = answer(angles)
        return np.array([d[i][0] * a[i, 2] - d[i][1] * a[i, 1] for i in unknown])

    for angles in _angles(across, len(unknown)):
        candidate, directions = answer(angles)
        along = [directions[i] @ candidate.a[i, 1:] for i in unknown]
        scale = max(np.abs(problem.b).max(), 1e-300)
        if all(s > SIGN * scale for s in along) and _obeys(problem, candidate, scale):
            return candidate
    return None


def _angles(across, count):
    """Angles at which no acceleration is across the assumed direction of sliding, as they are found."""
    if count == 0:
        yield np.zeros(0)
    elif count == 1:
        grid = np.linspace(-np.pi, np.pi, 49)
        values = [across([angle])[0] for angle in grid]
        for k in range(48):
            if values[k] * values[k + 1] <= 0:
                yield [brentq(lambda x: across([x])[0], grid[k], grid[k + 1], xtol=1e-15, rtol=1e-14)]
    else:
        starts = itertools.product(np.linspace(-np.pi, np.pi, 9 if count == 2 else 5)[:-1], repeat=count)
        for begin in itertools.islice(starts, 256):
            result = root(across, begin, tol=1e-14)
            if np.abs(result.fun).max() < 1e-11 * max(1e-300, np.abs(across(begin)).max()):
                yield result.x


def _obeys(problem, answer, scale):
    """Test whether forces push, cones hold, open contacts open, and constraints are met."""
    modes, f, a = answer
    active = np.array([mode != OPEN for mode in modes])
    size = max(np.abs(f).max(), 1e-300)
    met = [abs(a[i, k]) <= 1e-8 * scale for i, m in enumerate(modes) if m != OPEN for k in range(3 if m == HOLD else 1)]
    if not all(met) or np.any(f[active, 0] < -SIGN * size) or np.any(a[~active, 0] < -SIGN * scale):
        return False
    rows = [3 * i + k for i in np.flatnonzero(active) for k in range(3)]
    held = hold_margin(problem.A[np.ix_(rows, rows)], [m for m in modes if m != OPEN], f[active], problem.mu)
    return held >= -SIGN * size and all(v <= SIGN * size for v in idle_pulls(problem, answer, scale).values())


def idle_pulls(problem, answer, scale):
    """{contact: ℓ(place)} of those without force that stay on a wall where three others carry."""
    modes, f, a = answer
    pulls = {}
    for i, mode in enumerate(modes):
        carry = [k for k, m in enumerate(modes) if m != OPEN and problem.walls[k] == problem.walls[i]]
        if mode == OPEN and len(carry) == 3 and abs(a[i, 0]) <= 1e-8 * scale:
            pulls[i] = extrapolated(problem.places[carry], f[carry, 0], problem.places[i])
    return pulls


def extrapolated(places, values, place):
    """The affine function through three values, at another place."""
    return np.array([1.0, *place]) @ np.linalg.solve(np.column_stack([np.ones(3), places]), values)
