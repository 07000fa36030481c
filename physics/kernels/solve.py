"""One contact problem: direct, else warm-started sweeps, else the pivoting fallback; with its residual."""

from __future__ import annotations

from physics.kernels import quaternion as qt
from physics.kernels.compiler import inlined, kernel
from physics.kernels.direct import hold_all
from physics.kernels.pyramid import normal_fallback, pyramid_fallback
from physics.kernels.sweeps import (
    assemble,
    cone_residual,
    cone_sweeps,
    factor_blocks,
    normal_residual,
    normal_sweeps,
    velocities,
)

# Methods, weakest need first (column SOLVER of the report).
NO_SOLVE = 0
DIRECT = 1
SWEEPS = 2
PIVOTING = 3

# Pivots of the fallback at most: several times the unknowns of a dozen contacts.
MAX_PIVOTS = 500


@inlined
def _free_speed(rows, bias):
    """Largest free contact speed [m/s]: the scale of the relative residual."""
    largest = 0.0
    for r in range(rows):
        largest = max(largest, abs(bias[r]))
    return largest


@kernel
def _pivot(n, width, friction, residual, work):
    """Pivoting fallback; its result is kept where it beats that of the sweeps. Returns the residual [m/s]."""
    rows = width * n
    p, W, b, u = work.impulse, work.delassus, work.bias, work.velocity
    for r in range(rows):
        work.saved[r] = p[r]
    if friction is None:
        normal_fallback(W, b, n, p, work.fallback_float, work.fallback_int, MAX_PIVOTS)
        velocities(rows, W, p, b, u)
        after = normal_residual(n, p, u, W)
    else:
        pyramid_fallback(W, b, work.friction, n, p, work.fallback_float, work.fallback_int, MAX_PIVOTS)
        velocities(rows, W, p, b, u)
        after = cone_residual(n, p, u, work.friction, work.local)
    if not after < residual:
        for r in range(rows):
            p[r] = work.saved[r]
        after = residual
    return after


@inlined
def _apply(n, width, v, L, work):
    """Velocity and angular momentum after the impulses: v + Σ P/m, L + Σ r x P."""
    walls, features = work.walls, work.features
    inv_mass = 1.0 / work.mass
    px = py = pz = lx = ly = lz = 0.0
    for i in range(n):
        wall = work.slot[i] // features
        x = y = z = 0.0
        for c in range(width):
            s = work.impulse[width * i + c]
            x += s * walls[wall, 3 * c]
            y += s * walls[wall, 3 * c + 1]
            z += s * walls[wall, 3 * c + 2]
        rx, ry, rz = work.arm[i, 0], work.arm[i, 1], work.arm[i, 2]
        px, py, pz = px + x, py + y, pz + z
        lx, ly, lz = lx + (ry * z - rz * y), ly + (rz * x - rx * z), lz + (rx * y - ry * x)
    return (
        (v[0] + inv_mass * px, v[1] + inv_mass * py, v[2] + inv_mass * pz),
        (L[0] + lx, L[1] + ly, L[2] + lz),
    )


@kernel
def _sweep(n, width, friction, tolerance, limit, work):
    if friction is None:
        return normal_sweeps(n, tolerance, limit, work)
    factor_blocks(n, work)
    for i in range(n):
        work.friction[i] = work.mu
    return cone_sweeps(n, work.friction, tolerance, limit, work)


@kernel
def solve_contacts(n, friction, pivots, v, L, R, work):
    """Contact impulses that bring the contacts of `work` to their target velocities as far as they can.

    Parameters
    ----------
    n : int
        Contacts in `work`: slot, arm, target are read, impulse (width * n, the warm start) is overwritten.
    friction : True or None
        None: frictionless, one row per contact.
    pivots : True or None
        None: no pivoting fallback.
    v, L : tuples of 3 floats
        Velocity [m/s] and angular momentum [kg m²/s] without contact impulses.
    R : tuple of 9 floats
        Principal frame to world.

    Returns
    -------
    v, L : tuples of 3 floats
        After the impulses.
    residual : float
        Relative to the largest free contact speed.
    sweeps : int
    method : int
        DIRECT, SWEEPS or PIVOTING.
    """
    width = 3
    if friction is None:
        width = 1
    else:
        found, v1, L1 = hold_all(n, R, v, L, work)
        if found:
            return v1, L1, 0.0, 0, DIRECT
    J = work.J
    mb = qt.transposed_matvec(R, L)
    w = qt.matvec(R, (J[0] * mb[0], J[1] * mb[1], J[2] * mb[2]))
    assemble(n, width, R, v, w, work)
    tolerance = work.tolerance
    scale = _free_speed(width * n, work.bias)
    sweeps, residual = _sweep(n, width, friction, tolerance * scale, work.sweeps, work)
    method = SWEEPS
    if pivots is not None and not residual <= tolerance * scale:
        residual = _pivot(n, width, friction, residual, work)
        method = PIVOTING
    v, L = _apply(n, width, v, L, work)
    if scale > 0.0:
        residual /= scale
    return v, L, residual, sweeps, method
