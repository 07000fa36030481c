"""Onset of sliding: the direction of a velocity that is still zero, by collocation.

Friction is opposed to u_t, and where |u_t| grows from zero its direction follows what acts at the rate μ f_n/(m |u_t|):
an explicit integrator would need steps as short as the inverse, an implicit one of low order very many. So the
direction is made an unknown: an angle for each contact that starts, a polynomial of the time over a short span, such
that at the nodes the velocity that results has that direction. With the angles given the motion is smooth and not
stiff; Newton's method finds them, with differences for its matrix. (Collocation on Chebyshev's points: Trefethen,
*Spectral Methods in MATLAB*, 2000, chapter 6.)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

NODES = 10
STEP = 1e-6  # of an angle, for differences [rad]
ACCEPTED = 1e-12  # velocity across the assumed direction [m/s]


class Turning(NamedTuple):
    """Directions of the contacts that start to slide while the clock runs from 0 to `span`."""

    which: tuple  # indices into the active contacts of the contact mode
    span: float  # [s]
    angles: np.ndarray  # (len(which), degree + 1) polynomial in clock/span, lowest power first [rad]

    def directions(self, clock):
        """(len(which), 2) unit vectors."""
        angles = self.angles @ (clock / self.span) ** np.arange(self.angles.shape[1])
        return np.column_stack([np.cos(angles), np.sin(angles)])


def constant(which, directions) -> Turning:
    """Directions as they are at the start."""
    return Turning(tuple(which), 1.0, np.array([[np.arctan2(d[1], d[0])] for d in directions]))


def collocate(first: Turning, span, velocities) -> Turning:
    """The directions over at most `span` [s].

    Parameters
    ----------
    first : Turning
        Directions at the start.
    velocities : callable
        (Turning, times) -> (len(which), len(times), 2) tangential velocities.

    Raises
    ------
    RuntimeError
        If no span, however short, has an answer.
    """
    for _ in range(8):
        found = _newton(first, span, velocities)
        if found is not None:
            return found
        span /= 4
    raise RuntimeError("no direction in which sliding could begin")


def _newton(first, span, velocities):
    nodes = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, NODES + 1) / NODES)
    to_powers = np.linalg.inv(np.vander(nodes, increasing=True))
    shape = len(first.which), NODES

    def turning(values):
        return Turning(first.which, span, values.reshape(shape) @ to_powers.T)

    def across(values):
        u = velocities(turning(values), span * nodes)
        angle = values.reshape(shape)
        return np.cos(angle) * u[..., 1] - np.sin(angle) * u[..., 0], np.linalg.norm(u, axis=2), u

    values, best, least = np.repeat(first.angles[:, :1], NODES, axis=1).ravel(), None, np.inf
    for _ in range(12):
        off, size, u = across(values)
        if np.abs(off).max() >= least:
            break
        best, least = values, np.abs(off).max()
        if least <= np.finfo(float).eps * size.max():
            break
        weight = 1.0 / np.maximum(size, 1e-300).ravel()
        matrix = np.empty((values.size, values.size))
        for j in range(values.size):
            moved = values.copy()
            moved[j] += STEP
            matrix[:, j] = (across(moved)[0] - off).ravel() / STEP
        values = values - np.linalg.solve(matrix * weight[:, None], off.ravel() * weight)
    if best is None or least > ACCEPTED:
        return None
    _, _, u = across(best)
    angle = best.reshape(shape)
    along = np.cos(angle) * u[..., 0] + np.sin(angle) * u[..., 1]
    return turning(best) if along.min() > 0 else None
