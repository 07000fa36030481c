"""Solve the contact problem by pivoting, as a linear complementarity problem, with or without friction.

n contacts with impulses p = (normal, tangent 1, tangent 2) each [N s] and
velocities u = W p + b [m/s]. Coulomb's cone |p_t| <= mu p_n is replaced by the
pyramid *inscribed* in it whose base is a regular octagon with unit directions
d_k, k = 0..7: p_t = sum beta_k d_k with sum beta_k <= mu p_n. With the sliding
speed lambda as the last unknown the conditions of each contact are

    0 <= p_n     perpendicular to  u_n >= 0,
    0 <= beta_k  perpendicular to  lambda + d_k·u_t >= 0,
    0 <= lambda  perpendicular to  mu p_n - sum beta_k >= 0.

The matrix is copositive, and Lemke's method finds a solution whenever contacts
are not wedged. Contacts are wedged if they can push against each other without
moving the body.

An inscribed pyramid never gives more friction than the cone, and at least
cos(pi/8) = 0.924 of it against the sliding velocity. It is turned so that d_0
is opposite to the sliding velocity at the initial impulses p, so that friction
against this velocity is exact: a call that returns its initial impulses has
solved the problem with the cone.

References
----------
.. [1] D. E. Stewart, J. C. Trinkle, *An implicit time-stepping scheme for rigid
   body dynamics with inelastic collisions and Coulomb friction*, IJNME 39, 1996,
   doi:10.1002/(SICI)1097-0207(19960815)39:15<2673::AID-NME972>3.0.CO;2-I.
.. [2] M. Anitescu, F. A. Potra, *Formulating dynamic multi-rigid-body contact
   problems with friction as solvable linear complementarity problems*, Nonlinear
   Dynamics 14, 1997, doi:10.1023/A:1008292328909.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from physics.compiler.decorators import inlined, kernel
from physics.kernels.lcp.dantzig import dantzig, dantzig_sizes
from physics.kernels.lcp.lemke import lemke, lemke_sizes
from physics.kernels.lcp.scaling_and_certificate import (
    LCP_BAD_DATA,
    LCP_INACCURATE,
    LCP_RAY,
    LCP_SOLVED,
    inverse_power_of_two,
)

DIRECTIONS = 8
UNKNOWNS_PER_CONTACT = DIRECTIONS + 2  # per contact: p_n, beta_0 .. beta_7, lambda
SLIDING_TOLERANCE = 2.0**-30  # share of the terms that add up to u_t; a smaller u_t is rounding
RETRY_ANGLE = 1.0  # turn of a pyramid at the second try [rad]; no fraction of a full turn, so all turns differ

_R = math.sqrt(0.5)
COSINE = (1.0, _R, 0.0, -_R, -1.0, -_R, 0.0, _R)
SINE = (0.0, _R, 1.0, _R, 0.0, -_R, -1.0, -_R)


class PyramidProblem(NamedTuple):
    """Linear complementarity problem of n contacts with friction, of m = 10 n unknowns, and memory to solve it.

    All members are views of one array.

    Attributes
    ----------
    M : (m, m) float64
        Matrix: the Delassus matrix W between normals and directions, times w_scale, a power of two, and the rows of
        the cones (module docstring).
    q : (m,) float64
        Right-hand side [m/s].
    z : (m,) float64
        Unknowns p_n, beta_0 .. beta_7, lambda of each contact; w_scale times p_n and beta are impulses [N s].
    tableau : (m + 3, m + 2) float64
        Tableau of Lemke's method.
    heading : (n, 2) float64
        Direction d_0 of each contact.
    """

    M: np.ndarray
    q: np.ndarray
    z: np.ndarray
    tableau: np.ndarray
    heading: np.ndarray


def pyramid_sizes(n_max: int) -> tuple[int, int]:
    """Lengths of the arrays `floats` (float64) and `index` (int64) of `solve_pyramid_lcp` for up to n_max contacts.

    They have about 200 n_max² numbers, 1 MB for 24 contacts. So each thread has them once, not each world.
    """
    size = UNKNOWNS_PER_CONTACT * n_max
    (rows, columns), integers = lemke_sizes(size)
    return size * size + 2 * size + rows * columns + 2 * n_max, integers


def normal_lcp_sizes(n_max: int) -> tuple[int, int]:
    """Lengths of `floats` (float64) and `index` (int64) of `solve_normal_lcp` for up to n_max contacts."""
    (rows, columns), integers = dantzig_sizes(n_max)
    return rows * columns + n_max, integers


@kernel
def orient_pyramids(W, b, n, p, heading):
    """Write the direction d_0 of each contact's pyramid into `heading` (n, 2), from the impulses p.

    It is opposite to the tangential velocity u_t = (W p + b)_t. If u_t vanishes, it is along the tangential impulse.
    """
    for i in range(n):
        ux, uy = b[3 * i + 1], b[3 * i + 2]
        magnitude = abs(ux) + abs(uy)
        for j in range(3 * n):
            x, y = W[3 * i + 1, j] * p[j], W[3 * i + 2, j] * p[j]
            ux += x
            uy += y
            magnitude += abs(x) + abs(y)
        speed = math.sqrt(ux * ux + uy * uy)
        px, py = p[3 * i + 1], p[3 * i + 2]
        length = math.sqrt(px * px + py * py)
        if speed > SLIDING_TOLERANCE * magnitude:
            heading[i, 0], heading[i, 1] = -ux / speed, -uy / speed
        elif length > 0.0:
            heading[i, 0], heading[i, 1] = px / length, py / length
        else:
            heading[i, 0], heading[i, 1] = 1.0, 0.0


@kernel
def rotate_pyramids(n, heading):
    """Turn the pyramid of contact i, its direction d_0 in `heading`, by (i + 1) `RETRY_ANGLE`, for a second try."""
    for i in range(n):
        c, s = math.cos((i + 1) * RETRY_ANGLE), math.sin((i + 1) * RETRY_ANGLE)
        x, y = heading[i, 0], heading[i, 1]
        heading[i, 0], heading[i, 1] = c * x - s * y, s * x + c * y


@kernel
def pyramid_direction(heading, i, k):
    """Direction d_k of the pyramid of contact i: d_0, in `heading`, turned by k pi / 4."""
    x, y = heading[i, 0], heading[i, 1]
    return COSINE[k] * x - SINE[k] * y, SINE[k] * x + COSINE[k] * y


@kernel
def fill_pyramid_block(W, w_scale, heading, i, j, M):
    """Fill the block of the contacts i and j in the matrix M: w_scale W between normals and pyramid directions."""
    row, column = UNKNOWNS_PER_CONTACT * i, UNKNOWNS_PER_CONTACT * j
    for c in range(DIRECTIONS + 1):
        if c == 0:
            gn, gx, gy = 1.0, 0.0, 0.0
        else:
            gn = 0.0
            gx, gy = pyramid_direction(heading, j, c - 1)
        un = w_scale * (W[3 * i, 3 * j] * gn + W[3 * i, 3 * j + 1] * gx + W[3 * i, 3 * j + 2] * gy)
        ux = w_scale * (W[3 * i + 1, 3 * j] * gn + W[3 * i + 1, 3 * j + 1] * gx + W[3 * i + 1, 3 * j + 2] * gy)
        uy = w_scale * (W[3 * i + 2, 3 * j] * gn + W[3 * i + 2, 3 * j + 1] * gx + W[3 * i + 2, 3 * j + 2] * gy)
        M[row, column + c] = un
        for k in range(DIRECTIONS):
            dx, dy = pyramid_direction(heading, i, k)
            M[row + 1 + k, column + c] = dx * ux + dy * uy


@kernel
def fill_pyramid_lcp(W, b, mu, n, w_scale, heading, M, q):
    """Fill matrix M and right-hand side q of the complementarity problem of n contacts, with W times `w_scale`."""
    M[:] = 0.0
    for i in range(n):
        row = UNKNOWNS_PER_CONTACT * i
        last = row + UNKNOWNS_PER_CONTACT - 1
        for j in range(n):
            fill_pyramid_block(W, w_scale, heading, i, j, M)
        q[row] = b[3 * i]
        for k in range(DIRECTIONS):
            dx, dy = pyramid_direction(heading, i, k)
            q[row + 1 + k] = dx * b[3 * i + 1] + dy * b[3 * i + 2]
            M[row + 1 + k, last] = 1.0
            M[last, row + 1 + k] = -1.0
        q[last] = 0.0
        M[last, row] = mu[i]


@kernel
def store_pyramid_impulses(z, mu, n, w_scale, heading, p):
    """Convert the unknowns z of the complementarity problem of n contacts, with friction pyramids, to impulses p [N s].

    `heading` has the direction d_0 of each pyramid, and `w_scale` is the factor of z in the scaled problem. Impulses
    that rounding has put outside their friction cone are moved back into it.
    """
    for i in range(n):
        row = UNKNOWNS_PER_CONTACT * i
        x, y = 0.0, 0.0
        for k in range(DIRECTIONS):
            dx, dy = pyramid_direction(heading, i, k)
            x += z[row + 1 + k] * dx
            y += z[row + 1 + k] * dy
        bound = mu[i] * z[row]
        length = math.sqrt(x * x + y * y)
        shrink = bound / length if length > bound else 1.0
        p[3 * i] = z[row] * w_scale
        p[3 * i + 1] = x * shrink * w_scale
        p[3 * i + 2] = y * shrink * w_scale


@inlined
def _pyramid_problem(n, floats):
    """Make a `PyramidProblem` of n contacts of views of the array `floats`; its numbers are not set."""
    size = UNKNOWNS_PER_CONTACT * n
    rows, columns = size + 3, size + 2
    end_M = size * size
    end_tableau = end_M + rows * columns
    end_z = end_tableau + 2 * size
    return PyramidProblem(
        floats[:end_M].reshape((size, size)),
        floats[end_tableau : end_tableau + size],
        floats[end_tableau + size : end_z],
        floats[end_M:end_tableau].reshape((rows, columns)),
        floats[end_z : end_z + 2 * n].reshape((n, 2)),
    )


@kernel
def solve_pyramid_lcp(W, b, mu, n, p, floats, index, max_pivots):
    """Solve the contact problem with a friction pyramid of eight directions by Lemke's method.

    Parameters
    ----------
    W : (3 n or more, 3 n or more) float64
        [1/kg]. Delassus matrix, symmetric positive semidefinite; the leading block is read.
    b : (3 n or more,) float64
        [m/s]. Free contact velocities, bias included.
    mu : (n or more,) float64
        Coefficients of friction, >= 0.
    n : int
        Number of contacts.
    p : (3 n or more,) float64, in and out
        [N s]. In: initial impulses, from which the pyramids are turned, or zeros. Out:
        the solution if the status is `LCP_SOLVED`, else unchanged.
    floats, index : float64, int64, scratch
        Scratch arrays of the lengths that `pyramid_sizes` gives, or longer.
    max_pivots : int
        Largest number of pivots; about 10 n are usual.

    Returns
    -------
    status : int
        0 solved, 1 ray (wedged), 2 pivot limit, 3 data not finite or mu negative, 4 inaccurate.
    pivots : int
        Pivots made.

    Notes
    -----
    Redundant contacts can make the path of Lemke's method so degenerate that, once in about
    10⁵ problems, rounding leads it to a wrong end. So a try without a result is repeated once
    with every pyramid turned. Multiplying W, or b, by a power of two gives exactly the scaled p.
    """
    M, q, z, tableau, heading = _pyramid_problem(n, floats)
    largest = 0.0
    for i in range(3 * n):
        if not mu[i // 3] >= 0.0 or not math.isfinite(p[i]):
            return LCP_BAD_DATA, 0
        largest = max(largest, W[i, i])
    if not math.isfinite(largest):
        return LCP_BAD_DATA, 0
    w_scale = inverse_power_of_two(largest)
    orient_pyramids(W, b, n, p, heading)
    fill_pyramid_lcp(W, b, mu, n, w_scale, heading, M, q)
    status, pivots = lemke(M, q, z, tableau, index, max_pivots)
    if status in (LCP_RAY, LCP_INACCURATE):
        rotate_pyramids(n, heading)
        fill_pyramid_lcp(W, b, mu, n, w_scale, heading, M, q)
        status, again = lemke(M, q, z, tableau, index, max_pivots - pivots)
        pivots += again
    if status == LCP_SOLVED:
        store_pyramid_impulses(z, mu, n, w_scale, heading, p)
    return status, pivots


@kernel
def solve_normal_lcp(W, b, n, p, floats, index, max_pivots):
    """Solve the contact problem without friction: p >= 0, u = W p + b >= 0, p·u = 0.

    Parameters
    ----------
    W : (n or more, n or more) float64
        [1/kg]. Delassus matrix of the normals alone; the leading block is read.
    b : (n or more,) float64
        [m/s]. Free normal velocities, bias included.
    n : int
        Number of contacts.
    p : (n or more,) float64, out
        [N s]. The solution if the status is `LCP_SOLVED`, else unchanged.
    floats, index : float64, int64, scratch
        Scratch arrays of the lengths that `normal_lcp_sizes` gives, or longer.
    max_pivots : int
        Largest number of pivots; about 2 n are usual.

    Returns
    -------
    status, pivots : int
        Those of `physics.kernels.lcp.dantzig.dantzig`.
    """
    size = (2 * n + 6) * n
    z = floats[size : size + n]
    status, pivots = dantzig(W, b[:n], z, floats[:size].reshape((2 * n + 6, n)), index, max_pivots)
    if status == LCP_SOLVED:
        for i in range(n):
            p[i] = z[i]
    return status, pivots
