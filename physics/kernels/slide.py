"""A patch of contacts that slide: their impulses from a few small linear systems, without a Delassus matrix.

A sliding contact has the impulse p_i (n - μ d_i) along the direction d_i = u_t/|u_t| of its own sliding (u_t
less what is asked of it). Given the directions, "every normal velocity is the one asked for" is linear in the
normal impulses; given the impulses so are the velocities, and these give new directions. What remains is to
turn a few unit vectors the right way.

In the frame (n, a, b) of the wall the normal velocity of a point is affine in its coordinates,
u_n = v_n + ω_a b - ω_b a. Three contacts that are not on a line therefore fix v_n, ω_a and ω_b beforehand,
and with them the sum of the normal impulses. Of all normal impulses with the right sum and moments the affine
ones, p_i = y_0 + y_1 a_i + y_2 b_i about the centroid, have the least norm (a symmetric patch has symmetric
impulses); y_0 follows from the sum, y_1 and y_2 from ω_a and ω_b (2 x 2). Left over is the planar motion τ =
(v_a, v_b, ω_n).

With the directions of τ the impulses lead to τ + δ(τ); sought is δ = 0. When τ turns a direction, the
friction of contact i changes across it like a drag of coefficient κ_i = μ p_i / |u_i|: with e_i = n x d_i,
h_i = (e_i, r_i x e_i),

    δ(τ + Δ) = δ(τ) - (1 + C H) Δ,    H = Σ κ_i h_i h_iᵀ,

where C is the planar compliance of the body while y_1 and y_2 go on holding ω_a and ω_b. That is Newton's
method (the contacts are taken to be equally far from the centre of mass along n here, which is so to a few
slops). Where the impulses are those of the directions of τ, the velocity across direction i is h_i·δ exactly,
so the residual is measured, not estimated: |h_i·δ| s/(s + |u|) with s = μ p_i (W_aa + W_bb), no less than the
natural map of `sweeps`.

A contact that would have to pull opens, the one that pulls most first; the fit of the targets says whether it
then separates fast enough. Without friction the first linear system is the solution.
"""

from __future__ import annotations

import math

from physics.kernels import quaternion as qt
from physics.kernels.compiler import inlined, kernel
from physics.kernels.patch import (
    PATCH_SIZE,
    P,
    X,
    Y,
    drag,
    fit_targets,
    misfit,
    place_patch,
    respond,
    resultant,
    slide_residual,
)
from physics.kernels.share import wall_axes

# Linear solves of one attempt at most. Two are usual at a tolerance of 1e-6, each contact that opens costs
# one more.
SLIDE_LIMIT = 8

# Times that a sliding direction may have to turn right round before the contacts are taken not to slide.
STRIKES = 2


@inlined
def _newton(compliance, k, delta):
    """Step Δτ of (1 + C H) Δτ = δ, by the columns of the matrix and Cramer's rule."""
    c0, c1, c2, c3, c4, c5, c6, c7, c8 = compliance
    k0, k1, k2, k3, k4, k5 = k
    p = (
        1.0 + (c0 * k0 + c1 * k1 + c2 * k2),
        c3 * k0 + c4 * k1 + c5 * k2,
        c6 * k0 + c7 * k1 + c8 * k2,
    )
    q = (
        c0 * k1 + c1 * k3 + c2 * k4,
        1.0 + (c3 * k1 + c4 * k3 + c5 * k4),
        c6 * k1 + c7 * k3 + c8 * k4,
    )
    r = (
        c0 * k2 + c1 * k4 + c2 * k5,
        c3 * k2 + c4 * k4 + c5 * k5,
        1.0 + (c6 * k2 + c7 * k4 + c8 * k5),
    )
    qr = qt.cross(q, r)
    s = 1.0 / qt.dot(p, qr)
    return s * qt.dot(qr, delta), s * qt.dot(qt.cross(r, p), delta), s * qt.dot(qt.cross(p, q), delta)


@inlined
def _drop(loser, count, work):
    """Open the active contact at place `loser`: the contacts behind it move up."""
    work.normal[work.active[loser]] = -1.0
    for j in range(loser, count - 1):
        work.active[j] = work.active[j + 1]
        for c in range(PATCH_SIZE):
            work.patch[j, c] = work.patch[j + 1, c]
    return count - 1


@inlined
def _store(n, count, friction, work):
    """Impulses of the active contacts to `work.impulse`, zero for the open ones."""
    width = 1 if friction is None else 3
    if count < n:
        for k in range(width * n):
            work.impulse[k] = 0.0
    for j in range(count):
        p, k = work.patch[j, P], width * work.active[j]
        work.impulse[k] = p
        if friction is not None:
            work.impulse[k + 1] = p * work.patch[j, X]
            work.impulse[k + 2] = p * work.patch[j, Y]


@inlined
def _add(axes, a, b, c, base):
    """base + a axes[0] + b axes[1] + c axes[2]."""
    n, t1, t2 = axes
    return (
        base[0] + (a * n[0] + b * t1[0] + c * t2[0]),
        base[1] + (a * n[1] + b * t1[1] + c * t2[1]),
        base[2] + (a * n[2] + b * t1[2] + c * t2[2]),
    )


@inlined
def _wall_frame(R, v, L, axes, J):
    """Inverse inertia (00, 01, 02, 11, 12, 22), velocity and angular velocity in the frame of the wall."""
    e0, e1 = qt.transposed_matvec(R, axes[0]), qt.transposed_matvec(R, axes[1])
    e2 = qt.transposed_matvec(R, axes[2])
    j0 = (J[0] * e0[0], J[1] * e0[1], J[2] * e0[2])
    j1 = (J[0] * e1[0], J[1] * e1[1], J[2] * e1[2])
    j2 = (J[0] * e2[0], J[1] * e2[1], J[2] * e2[2])
    K = (qt.dot(j0, e0), qt.dot(j0, e1), qt.dot(j0, e2), qt.dot(j1, e1), qt.dot(j1, e2), qt.dot(j2, e2))
    m = qt.transposed_matvec(R, L)
    u = (qt.dot(axes[0], v), qt.dot(axes[1], v), qt.dot(axes[2], v))
    return K, u, (qt.dot(j0, m), qt.dot(j1, m), qt.dot(j2, m))


@inlined
def _normal_motion(n, count, goal, axes, work):
    """Normal motion that meets the targets, (v_n, ω_a, ω_b); the centroid; and whether there is one."""
    is_patch, center, (t0, ga, gb) = fit_targets(count, work)
    wa, wb = gb, -ga
    vn = t0 - wa * center[2] + wb * center[1]
    return is_patch and misfit(n, vn, wa, wb, axes, work) <= goal, center, (vn, wa, wb)


@kernel
def slide_patch(n, friction, R, v, L, work):
    """Try the impulses with which the n contacts slide, or open: three or more of one wall, not on a line.

    Parameters
    ----------
    n : int
        Contacts in `work`: arm, target, slot and impulse (the warm start) are read.
    friction : True or None
        None: frictionless, `work.mu` is 0 and `work.impulse` has one number per contact.
    R : tuple of 9 floats
        Principal frame to world.
    v, L : tuples of 3 floats
        Velocity [m/s] and angular momentum [kg m²/s] without contact impulses, world frame.

    Returns
    -------
    left : int
        0: found, and `work.impulse` written. 1 or 2: so many contacts, those in `work.active`, still push
        when the others open (for `few.slide_few`). n: not found.
    v, L : tuples of 3 floats
        With the contact impulses, when found.
    residual : float
        Relative to the largest free contact speed.
    """
    walls, mass, mu = work.walls, work.mass, work.mu
    wall = work.slot[0] // work.features
    if n < 3 or work.slot[n - 1] // work.features != wall:
        return n, v, L, 0.0
    inv_mass = 1.0 / mass
    axes = wall_axes(walls, wall)
    K, u, w = _wall_frame(R, v, L, axes, work.J)
    scale, start = place_patch(n, friction, axes, u, w, inv_mass, K, work)
    goal = work.tolerance * scale
    count = n
    strikes = 0
    motion = start
    ok, center, normal_motion = _normal_motion(n, count, goal, axes, work)
    for _ in range(SLIDE_LIMIT):
        if not ok or strikes > STRIKES:
            break
        vn, wa, wb = normal_motion
        y0 = mass * (vn - u[0]) / count
        gain = (wa - w[1], wb - w[2])
        y, compliance = respond(count, mu, center, y0, gain, motion, wa, wb, inv_mass, K, work)
        loser, (fa, fb, tn, ta, tb) = resultant(count, center, y0, y, work)
        if loser >= 0:
            count = _drop(loser, count, work)
            if count < 3:
                return count, v, L, 0.0
            motion = start
            ok, center, normal_motion = _normal_motion(n, count, goal, axes, work)
            continue
        wn = w[0] + (K[0] * tn + K[1] * ta + K[2] * tb)
        delta = (u[1] + inv_mass * fa - motion[0], u[2] + inv_mass * fb - motion[1], wn - motion[2])
        miss = slide_residual(count, mu, delta, work)
        if miss <= goal:
            _store(n, count, friction, work)
            if scale > 0.0:
                miss /= scale
            v = _add(axes, inv_mass * (count * y0), inv_mass * fa, inv_mass * fb, v)
            return 0, v, _add(axes, tn, ta, tb, L), miss
        if miss == math.inf:
            strikes += 1
        step = _newton(compliance, drag(count, mu, work), delta)
        motion = (motion[0] + step[0], motion[1] + step[1], motion[2] + step[2])
    return n, v, L, 0.0
