"""Hits of an elastic, frictionless block without gravity between walls, in multiple precision.

Between hits the centre moves straight and the block turns freely: Taylor series of the body-frame equations,
ω̇_i = (I_j - I_k)/I_i ω_j ω_k and q̇ = ½ q ω, by recurrence (Hairer, Nørsett, Wanner, *Solving Ordinary
Differential Equations I*, 1993, section I.8). The gaps of the vertices are then series too; the first root is
found in double precision and made exact by Newton's method on the series. At a hit the normal velocity of the
vertex is reversed: j = -2 u_n / (1/m + (r x n)·I⁻¹(r x n)).
"""

from __future__ import annotations

from typing import NamedTuple

import mpmath
import numpy as np

from tests.reference.hybrid import body
from tests.reference.rigid_body import taylor_coefficients

STEP = 0.04  # s; the singularities nearest to real time are some 0.5 s away
NEAR = 1e-9  # gaps that in double precision come closer than this are looked at in full [m]


class Hit(NamedTuple):
    """Time [s], contact number, and the state right after: x, q, v (world), ω (body), multiple precision."""

    t: mpmath.mpf
    contact: int
    state: list


class ElasticBlock:
    """The block of a `Problem`, in the working precision of the moment.

    Parameters
    ----------
    problem : body.Problem
        A block, diagonal inertia, no gravity, no friction, restitution 1.
    order : int
        Terms of the Taylor series.
    step : float
        [s].
    """

    def __init__(self, problem: body.Problem, order: int, step: float = STEP):
        mpf = np.frompyfunc(lambda a: mpmath.mpf(float(a)), 1, 1)
        self.mass, self.moments = mpmath.mpf(problem.mass), mpf(np.diag(problem.inertia))
        self.points, self.normals, self.offsets = mpf(problem.points), mpf(problem.frames[:, 0]), mpf(problem.offsets)
        self.euler = [
            (self.moments[(i + 1) % 3] - self.moments[(i + 2) % 3]) / self.moments[i] for i in range(3)
        ]  # fmt: skip
        self.order, self.step = order, mpmath.mpf(step)
        powers = np.linspace(0.0, 1.0, 33)[:, None] ** np.arange(order + 1)
        self.powers = powers * float(step) ** np.arange(order + 1)

    def series(self, state):
        """Taylor coefficients of (ω, q): 7 lists."""
        rows = [[a] for a in (*state[10:13], *state[3:7])]
        for k in range(self.order):
            for row, rate in zip(rows, taylor_coefficients(rows, self.euler)):
                row.append(rate / (k + 1))
        return rows

    def gap_series(self, state, rows):
        """(contacts, order + 1) coefficients of the gaps; the vertices' from R(q) = products of quaternion series."""
        R = rotation_series([np.array(row) for row in rows[3:]])
        place = np.array([[sum(R[i][j] * p[j] for j in range(3)) for i in range(3)] for p in self.points])
        for i in range(3):
            place[:, i, 0] += state[i]
            place[:, i, 1] += state[7 + i]
        gaps = np.array([[sum(n * c for n, c in zip(normal, p) if n) for p in place] for normal in self.normals])
        gaps[:, :, 0] -= self.offsets[:, None]
        return gaps.reshape(-1, self.order + 1)

    def first_root(self, gaps, just_hit):
        """(h, contact) of the first hit within a step, or None; `just_hit` is the contact whose gap starts at 0."""
        values = gaps.astype(float) @ self.powers.T
        rates = (gaps[:, 1:] * np.arange(1, self.order + 1)).astype(float) @ self.powers[:, :-1].T
        best = None
        # Between samples a gap is above the chord by at most (its greatest change of slope) x (sample) / 8.
        sag = np.abs(np.diff(rates)).max(axis=1) * float(self.step) / 32 / 4
        for c in np.flatnonzero(values.min(axis=1) < sag + NEAR):
            h = self._root(gaps[c], c == just_hit)
            if h is not None and (best is None or h < best[0]):
                best = h, c
        return best

    def _root(self, coefficients, starts_at_zero):
        """First root in (0, step] with falling gap; where the gap starts at zero that root is taken out."""
        kept = coefficients[1:] if starts_at_zero else coefficients
        scaled = kept.astype(float) * float(self.step) ** np.arange(len(kept))
        roots = np.polynomial.polynomial.polyroots(np.trim_zeros(scaled[:16], "b"))
        for theta in np.sort(roots.real[(np.abs(roots.imag) < 1e-7) & (roots.real > 0) & (roots.real <= 1 + 1e-9)]):
            h = self.step * mpmath.mpf(float(theta))
            for _ in range(12):
                change = mpmath.polyval(list(kept[::-1]), h) / mpmath.polyval(derivative(kept)[::-1], h)
                h -= change
                if abs(change) < mpmath.mpf(10) ** (8 - mpmath.mp.dps):
                    break
            if 0 < h <= self.step and mpmath.polyval(derivative(coefficients)[::-1], h) < 0:
                return h
        return None

    def moved(self, state, rows, h):
        """The state h later."""
        x = [a + h * v for a, v in zip(state[:3], state[7:10])]
        turned = [mpmath.polyval(row[::-1], h) for row in rows]
        length = mpmath.sqrt(sum(a * a for a in turned[3:]))
        return [*x, *(a / length for a in turned[3:]), *state[7:10], *turned[:3]]

    def reflected(self, state, contact):
        """The state after the hit of a contact."""
        q, v, omega = state[3:7], state[7:10], np.array(state[10:13])
        R = rotation(q)
        n_world = self.normals[contact // len(self.points)]
        n = R.T @ n_world
        lever = cross(self.points[contact % len(self.points)], n)
        speed = sum(a * b for a, b in zip(n_world, v)) + lever @ omega
        j = -2 * speed / (1 / self.mass + sum(lever * lever / self.moments))
        return [*state[:7], *(np.array(v) + j / self.mass * n_world), *(omega + j * lever / self.moments)]

    def run(self, state, hits, after):
        """([Hit], state `after` seconds [s] after the last of them)."""
        found, t, contact = [], mpmath.mpf(0), None
        while len(found) < hits:
            rows = self.series(state)
            h, contact = self.first_root(self.gap_series(state, rows), contact) or (self.step, None)
            state, t = self.moved(state, rows, h), t + h
            if contact is not None:
                state = self.reflected(state, contact)
                found.append(Hit(t, int(contact), state))
        rows = self.series(state)
        next_hit = self.first_root(self.gap_series(state, rows), contact)
        if after > self.step or (next_hit and next_hit[0] < after):
            raise ValueError(f"there is another hit, or a step, within {after} s after the last hit")
        return found, self.moved(state, rows, mpmath.mpf(after))


def derivative(coefficients):
    """Coefficients of the derivative."""
    return [k * a for k, a in enumerate(coefficients)][1:]


def cross(a, b):
    """a x b of object arrays."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def rotation(q):
    """Body-to-world rotation (3, 3) of a unit quaternion."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def rotation_series(q):
    """The same of quaternion series: 3 x 3 of coefficient arrays."""
    n = len(q[0])

    def product(a, b):
        return np.array([sum(a[: k + 1] * b[k::-1]) for k in range(n)])

    p = {(i, j): product(q[i], q[j]) for i in range(4) for j in range(i, 4)}
    one = np.array([mpmath.mpf(1)] + [mpmath.mpf(0)] * (n - 1))
    w, x, y, z = range(4)
    return [
        [one - 2 * (p[y, y] + p[z, z]), 2 * (p[x, y] - p[w, z]), 2 * (p[x, z] + p[w, y])],
        [2 * (p[x, y] + p[w, z]), one - 2 * (p[x, x] + p[z, z]), 2 * (p[y, z] - p[w, x])],
        [2 * (p[x, z] - p[w, y]), 2 * (p[y, z] + p[w, x]), one - 2 * (p[x, x] + p[y, y])],
    ]


def start(scene_body):
    """The exact start of a body as multiple-precision numbers: x, q, v, ω in the body frame."""
    return start_of([*scene_body.pos, *scene_body.quat, *scene_body.linvel, *scene_body.angvel])


def start_of(numbers):
    """The same of 13 numbers with ω in the world frame; |q| is made 1."""
    numbers = [mpmath.mpf(a) for a in numbers]
    length = mpmath.sqrt(sum(a * a for a in numbers[3:7]))
    q = [a / length for a in numbers[3:7]]
    return [*numbers[:3], *q, *numbers[7:10], *(rotation(q).T @ np.array(numbers[10:]))]


def world_frame(state):
    """The state with ω in the world frame."""
    return [*state[:10], *(rotation(state[3:7]) @ np.array(state[10:13]))]
