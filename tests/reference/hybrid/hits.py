"""When the next gap closes: every root of the gaps on a step's dense output, which is a polynomial."""

from __future__ import annotations

from math import comb

import numpy as np

from tests.reference.hybrid import body
from tests.reference.hybrid.body import GAPS

DEGREE = 7  # of DOP853's dense output


def _bernstein(n):
    """Rows give Bernstein coefficients on [0, 1] of a polynomial of degree n: all positive, no root."""
    return np.array([[comb(i, j) / comb(n, j) if j <= i else 0.0 for j in range(n + 1)] for i in range(n + 1)])


BERNSTEIN = _bernstein(DEGREE)


def first_hit(problem, options, now, dense, solver, state):
    """([contacts], h) of the first gap that closes: all roots of the step's dense output, which is a polynomial."""
    width = solver.t - solver.t_old
    nodes = 0.5 - 0.5 * np.cos(np.pi * (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1))
    loose = [c for c in range(problem.contact_count) if c not in now.fixed]
    if not loose:
        return None
    sampled = dense(solver.t_old + width * nodes)[GAPS][loose]
    coefficients = np.linalg.solve(np.vander(nodes, increasing=True), sampled.T)
    start = state(0.0)[GAPS][loose]
    coefficients[0] = start
    times = {}
    for k, c in enumerate(loose):
        if start[k] > 0.0 and np.min(BERNSTEIN @ coefficients[:, k]) > 0.0:
            continue
        theta = down_crossing(coefficients[:, k], start[k], width, 0.1 * options.tiny)
        if theta is not None:
            times[c] = polish(problem, c, theta * width, width, state)
    if not times:
        return None
    h = min(times.values())
    y = state(h)
    speeds = body.normal_speeds(problem, y)
    both = [c for c in loose if c in times and times[c] - h <= options.together]
    near = [c for c in loose if speeds[c] < 0 and y[GAPS][c] <= -speeds[c] * options.together]
    return sorted(set(both) | set(near)), h


def down_crossing(coefficients, start, width, slowest):
    """The first root θ in (0, 1] at which the gap falls; a gap that starts at zero has that root taken out."""
    reduced = coefficients[1:] if start == 0.0 else coefficients
    slope = np.polynomial.polynomial.polyder(coefficients)
    roots = np.polynomial.polynomial.polyroots(reduced)
    real = np.sort(roots.real[(np.abs(roots.imag) < 1e-6 * np.abs(roots)) & (roots.real > 0) & (roots.real <= 1)])
    for theta in real:
        if np.polynomial.polynomial.polyval(theta, slope) / width < -slowest:
            return theta
    return None


def polish(problem, c, h, width, state):
    """Newton on the gap itself."""
    for _ in range(20):
        y = state(h)
        speed = body.normal_speeds(problem, y)[c]
        if speed >= 0:
            break
        change = y[GAPS][c] / speed
        h = min(max(h - change, 0.0), width)
        if abs(change) <= 1e-15 * width:
            break
    return h
