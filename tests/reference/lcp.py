"""Complementarity and contact problems solved slowly, in plain NumPy: what the kernels are held against."""

from __future__ import annotations

import itertools

import numpy as np


def enumerate_solutions(M, q, tolerance=1e-9):
    """All basic solutions of w = M z + q, w, z >= 0, z·w = 0, by trying the 2^n sets of positive z.

    A set whose block of M is singular is skipped: every symmetric positive semidefinite
    problem that has a solution also has one with a nonsingular block.

    Parameters
    ----------
    M : (n, n) array
    q : (n,) array
    tolerance : float
        How negative an entry may be, relative to the largest entry of the candidate.

    Returns
    -------
    list of (n,) arrays
    """
    M, q = np.asarray(M, float), np.asarray(q, float)
    n = len(q)
    solutions = []
    for mask in itertools.product([False, True], repeat=n):
        chosen = np.array(mask)
        z = np.zeros(n)
        block = M[np.ix_(chosen, chosen)]
        if chosen.any():
            if np.linalg.matrix_rank(block) < chosen.sum():
                continue
            z[chosen] = np.linalg.solve(block, -q[chosen])
        w = M @ z + q
        allowed = -tolerance * max(1.0, np.abs(z).max(), np.abs(q).max())
        if z.min() >= allowed and w.min() >= allowed:
            solutions.append(z)
    return solutions


def project_on_cone(p, mu):
    """Nearest point of the cone |p_t| <= mu p_n for each row (normal, tangent 1, tangent 2) of p (n, 3)."""
    p = np.array(p, float)
    for row, m in zip(p, mu):
        length = np.hypot(row[1], row[2])
        if row[0] >= 0.0 and length <= m * row[0]:
            continue
        if m * length <= -row[0]:
            row[:] = 0.0
            continue
        normal = (row[0] + m * length) / (1.0 + m * m)
        row[1:] *= m * normal / length
        row[0] = normal
    return p


def coulomb_defect(W, b, mu, p, step):
    """p - proj(p - step ũ), [N s], zero exactly at the solutions of the contact problem.

    ũ = u + mu |u_t| e_n is De Saxcé's velocity: Coulomb's law says that it is in the
    dual of the cone and perpendicular to p. Entries are flat (3 n,); `step` is [kg].
    """
    u = (W @ p + b).reshape(-1, 3)
    u[:, 0] += mu * np.hypot(u[:, 1], u[:, 2])
    return p - project_on_cone(p.reshape(-1, 3) - step * u, mu).ravel()


def _newton(W, b, mu, p, step, tolerance, iterations=30):
    """Newton's method with differences for the Jacobian and least squares for singular W."""
    for _ in range(iterations):
        defect = coulomb_defect(W, b, mu, p, step)
        size = np.abs(defect).max()
        if size <= tolerance:
            break
        h = 1e-6 * max(1e-3, np.abs(p).max())
        jacobian = np.empty((len(p), len(p)))
        for j in range(len(p)):
            e = np.zeros(len(p))
            e[j] = h
            ahead, behind = (coulomb_defect(W, b, mu, p + s * e, step) for s in (1, -1))
            jacobian[:, j] = (ahead - behind) / (2 * h)
        trial = p - np.linalg.lstsq(jacobian, defect, rcond=1e-9)[0]
        if np.abs(coulomb_defect(W, b, mu, trial, step)).max() >= size:
            break
        p = trial
    return p


def solve_coulomb(W, b, mu, tolerance=1e-13, sweeps=20000, check_every=200):
    """Impulses of the contact problem with Coulomb's cone itself: projected sweeps, polished by Newton.

    Parameters
    ----------
    W : (3 n, 3 n) array
        [1/kg]. Symmetric positive semidefinite.
    b : (3 n,) array
        [m/s].
    mu : (n,) array
    tolerance : float
        Of max |defect|, relative to the largest impulse.
    sweeps, check_every : int
        Sweeps over all contacts at most; how often Newton is tried.

    Returns
    -------
    (3 n,) array [N s]

    Raises
    ------
    RuntimeError
        If the defect is still above the tolerance at the end.
    """
    W, b, mu = (np.asarray(a, float) for a in (W, b, mu))
    n = len(mu)
    blocks = [slice(3 * i, 3 * i + 3) for i in range(n)]
    steps = [1.0 / np.linalg.eigvalsh(W[k, k]).max() for k in blocks]
    p = np.zeros(3 * n)
    for sweep in range(1, sweeps + 1):
        for i, k in enumerate(blocks):
            u = W[k] @ p + b[k]
            u[0] += mu[i] * np.hypot(u[1], u[2])
            p[k] = project_on_cone((p[k] - steps[i] * u)[None], mu[i : i + 1])[0]
        if sweep % check_every == 0:
            scale = max(np.abs(p).max(), np.finfo(float).tiny)
            trial = _newton(W, b, mu, p, min(steps), tolerance * scale)
            if np.abs(coulomb_defect(W, b, mu, trial, min(steps))).max() <= tolerance * scale:
                return trial
    raise RuntimeError(f"defect above {tolerance} after {sweeps} sweeps")
