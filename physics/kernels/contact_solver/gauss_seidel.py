"""Warm-started block Gauss-Seidel sweeps over contacts with the exact circular Coulomb cone.

The problem of one stage, for n contacts with impulses p_i = (normal, tangent 1, tangent 2):

    u = W p + b,    0 <= p_n ⟂ u_n >= 0,    |p_t| <= μ p_n,    u_t = 0 or p_t = -μ p_n u_t / |u_t|.

Its natural-map residual, per contact and in units of velocity, is

    max( |p_n - max(0, p_n - ρ u_n)| / ρ,   |p_t - disk(p_t - ρ_t u_t, μ p_n)| / ρ_t )

with ρ = 1/W_nn and ρ_t = 1/λ_max(W_tt); `disk` projects onto a disk about 0 of the radius μ p_n. It vanishes exactly
at a solution. The velocities u are kept up to date, so the residual is measured, not estimated, before every sweep: a
warm start that still solves the problem needs no sweep.

A sweep visits each contact once, and solves it alone by its 3x3 block of W: it opens, sticks (3x3 solve) or slides.

References
----------
.. [1] M. Jean, *The non-smooth contact dynamics method*, Comput. Methods Appl. Mech. Eng. 177, 1999
   (block sweeps over contacts). The residual: Acary and Brogliato, *Numerical Methods for Nonsmooth Dynamical
   Systems*, 2008, section 12.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.half_space.contact_point import wall_of

# Columns of `solver.local`: rows of the inverse of the contact's 3x3 block, then ρ_t and ρ.
LOCAL_TANGENT_RHO = 9
LOCAL_NORMAL_RHO = 10

# Largest number of Newton steps on a contact's sliding direction in a visit; turns below the tolerance end them [rad].
_ANGLE_NEWTON_STEPS = 3
_ANGLE_TOLERANCE = 1.0e-3

# Sweeps between two extrapolations. Slow sweeps contract along one direction with a ratio q near 1, which follows from
# the last two changes of p. The rest of this geometric series, q/(1 - q) times the last change, is added at once.
EXTRAPOLATION_PERIOD = 4
_MAX_CONTRACTION_RATIO = 0.998


@kernel
def assemble_delassus(n, width, R, v, w, scratch):
    """Assemble the contact problem of the n contacts in `scratch.contacts`: J, W = J M⁻¹ Jᵀ, b = J (v, ω) - target.

    Written are the Jacobian rows `frame` and `angular`, `response` (I⁻¹ times the angular rows), `delassus` and `bias`.

    Parameters
    ----------
    width : int
        Rows per contact: 3 (normal, tangents) with friction, 1 (normal) without.
    R : tuple of 9 floats
        Principal frame to world.
    v, w : tuples of 3 floats
        Velocity and angular velocity without contact impulses, world frame [m/s, rad/s].
    """
    contacts = scratch.contacts
    walls, inv_mass, J = scratch.scene.walls, 1.0 / scratch.body.mass, scratch.body.J
    frame, angular, response, arm = contacts.frame, contacts.angular, contacts.response, contacts.arm
    # I⁻¹ in the world frame, six numbers.
    j1, j2, j3 = J[0], J[1], J[2]
    k11 = j1 * R[0] * R[0] + j2 * R[1] * R[1] + j3 * R[2] * R[2]
    k12 = j1 * R[0] * R[3] + j2 * R[1] * R[4] + j3 * R[2] * R[5]
    k13 = j1 * R[0] * R[6] + j2 * R[1] * R[7] + j3 * R[2] * R[8]
    k22 = j1 * R[3] * R[3] + j2 * R[4] * R[4] + j3 * R[5] * R[5]
    k23 = j1 * R[3] * R[6] + j2 * R[4] * R[7] + j3 * R[5] * R[8]
    k33 = j1 * R[6] * R[6] + j2 * R[7] * R[7] + j3 * R[8] * R[8]
    for i in range(n):
        wall = wall_of(contacts.slot[i], scratch.scene)
        x, y, z = arm[i, 0], arm[i, 1], arm[i, 2]
        for c in range(width):
            row = width * i + c
            a, b, d = walls[wall, 3 * c], walls[wall, 3 * c + 1], walls[wall, 3 * c + 2]
            gx, gy, gz = y * d - z * b, z * a - x * d, x * b - y * a
            frame[row, 0], frame[row, 1], frame[row, 2] = a, b, d
            angular[row, 0], angular[row, 1], angular[row, 2] = gx, gy, gz
            response[row, 0] = k11 * gx + k12 * gy + k13 * gz
            response[row, 1] = k12 * gx + k22 * gy + k23 * gz
            response[row, 2] = k13 * gx + k23 * gy + k33 * gz
            contacts.bias[row] = (
                (a * v[0] + b * v[1] + d * v[2]) + (gx * w[0] + gy * w[1] + gz * w[2]) - contacts.target[i, c]
            )
    W = contacts.delassus
    for r in range(width * n):
        gx, gy, gz = angular[r, 0], angular[r, 1], angular[r, 2]
        a, b, d = frame[r, 0] * inv_mass, frame[r, 1] * inv_mass, frame[r, 2] * inv_mass
        for s in range(r + 1):
            value = (a * frame[s, 0] + b * frame[s, 1] + d * frame[s, 2]) + (
                gx * response[s, 0] + gy * response[s, 1] + gz * response[s, 2]
            )
            W[r, s] = value
            W[s, r] = value


@kernel
def invert_contact_blocks(n, scratch):
    """Write the inverse of each contact's 3x3 block of W, and its ρ and ρ_t (module docstring), into `solver.local`."""
    W, local = scratch.contacts.delassus, scratch.solver.local
    for i in range(n):
        r = 3 * i
        a, b, c = W[r, r], W[r, r + 1], W[r, r + 2]
        d, e, f = W[r + 1, r + 1], W[r + 1, r + 2], W[r + 2, r + 2]
        k11, k12, k13 = d * f - e * e, c * e - b * f, b * e - c * d
        s = 1.0 / (a * k11 + b * k12 + c * k13)
        local[i, 0], local[i, 1], local[i, 2] = k11 * s, k12 * s, k13 * s
        local[i, 3], local[i, 4], local[i, 5] = k12 * s, (a * f - c * c) * s, (b * c - a * e) * s
        local[i, 6], local[i, 7], local[i, 8] = k13 * s, (b * c - a * e) * s, (a * d - b * b) * s
        half = 0.5 * (d - f)
        local[i, LOCAL_TANGENT_RHO] = 1.0 / (0.5 * (d + f) + math.sqrt(half * half + e * e))
        local[i, LOCAL_NORMAL_RHO] = 1.0 / a


@kernel
def update_contact_velocities(rows, W, p, b, u):
    """Compute the contact velocities u = W p + b [m/s] in the first `rows` rows; u is overwritten."""
    for r in range(rows):
        total = b[r]
        for s in range(rows):
            total += W[r, s] * p[s]
        u[r] = total


@kernel
def cone_residual(n, p, u, mu, local):
    """Largest natural-map residual (module docstring) of n contacts with friction [m/s]; infinite if u is not finite.

    p and u are impulses and velocities, mu the friction coefficients; `local` is that of `invert_contact_blocks`.
    """
    worst = check = 0.0
    for i in range(n):
        r = 3 * i
        rho, rho_t = local[i, LOCAL_NORMAL_RHO], local[i, LOCAL_TANGENT_RHO]
        worst = max(worst, abs(min(u[r], p[r] / rho)))
        x, y = p[r + 1] - rho_t * u[r + 1], p[r + 2] - rho_t * u[r + 2]
        size, limit = math.sqrt(x * x + y * y), mu[i] * max(p[r], 0.0)
        if size > limit:
            x *= limit / size
            y *= limit / size
        dx, dy = p[r + 1] - x, p[r + 2] - y
        worst = max(worst, math.sqrt(dx * dx + dy * dy) / rho_t)
        check += u[r] + u[r + 1] + u[r + 2]
    return worst if math.isfinite(check) else math.inf


@kernel
def normal_residual(n, p, u, W):
    """Largest natural-map residual of n contacts without friction, one row each [m/s]; infinite if u is not finite."""
    worst = check = 0.0
    for i in range(n):
        worst = max(worst, abs(min(u[i], p[i] * W[i, i])))
        check += u[i]
    return worst if math.isfinite(check) else math.inf


@kernel
def normal_sweeps(n, tolerance, limit, contacts):
    """Solve n contacts without friction by projected Gauss-Seidel sweeps: u = W p + b, 0 <= p ⟂ u >= 0.

    Sweeps end at a residual of at most `tolerance` [m/s], or after `limit` of them. `contacts.impulse` has the warm
    start and gets the result. Returns (sweeps, residual [m/s]).
    """
    p, u, W = contacts.impulse, contacts.velocity, contacts.delassus
    update_contact_velocities(n, W, p, contacts.bias, u)
    residual = normal_residual(n, p, u, W)
    sweeps = 0
    while not residual <= tolerance and sweeps < limit:
        for i in range(n):
            q = max(0.0, p[i] - u[i] / W[i, i])
            d = q - p[i]
            p[i] = q
            for s in range(n):
                u[s] += W[i, s] * d
        sweeps += 1
        residual = normal_residual(n, p, u, W)
    return sweeps, residual


@inlined
def _solve_sliding_contact(r, bn, bx, by, p1, p2, mu, W):
    """Solve one contact that slides, with all other impulses fixed: (found, p_n, tangential impulses).

    The contact has the rows r to r + 2 of W, and the velocity b = (bn, bx, by) without its own impulse; p1 and p2 are
    its last tangential impulses. With the direction d of sliding, p = p_n (1, -μ d), and p_n = -b_n / (W_nn - μ W_nt·d)
    stops the approach. The unknown is the angle of d, for which the velocity across, g = e·u_t with e = n x d,
    vanishes. Newton's method finds it, with g' = -d·u_t + e·(p_n' (W_tn - μ W_tt d) - μ p_n W_tt e) and
    p_n' = μ p_n W_nt·e / (W_nn - μ W_nt·d).
    """
    a, b, c = W[r, r], W[r, r + 1], W[r, r + 2]
    d, e, f = W[r + 1, r + 1], W[r + 1, r + 2], W[r + 2, r + 2]
    x, y = -p1, -p2
    size = math.sqrt(x * x + y * y)
    if not size > 0.0:
        x, y = bx, by
        size = math.sqrt(x * x + y * y)
    if size > 0.0:
        x, y = x / size, y / size
    pn = 0.0
    for _ in range(_ANGLE_NEWTON_STEPS):
        along = a - mu * (b * x + c * y)
        pn = -bn / along
        gx, gy = b - mu * (d * x + e * y), c - mu * (e * x + f * y)
        ux, uy = bx + pn * gx, by + pn * gy
        across, forward = x * uy - y * ux, x * ux + y * uy
        ex, ey = mu * (e * x - d * y), mu * (f * x - e * y)
        change = mu * pn * (c * x - b * y) / along
        slope = -forward + (x * (change * gy - pn * ey) - y * (change * gx - pn * ex))
        if not (pn >= 0.0 and forward > 0.0 and slope < 0.0):
            return False, 0.0, 0.0, 0.0
        t = -across / slope
        x, y = x - t * y, y + t * x
        size = 1.0 / math.sqrt(x * x + y * y)
        x, y = size * x, size * y
        if abs(t) <= _ANGLE_TOLERANCE:
            break
    pn = -bn / (a - mu * (b * x + c * y))
    return pn >= 0.0, pn, -mu * pn * x, -mu * pn * y


@kernel
def _local_impulse(i, impulse, u, mu, W, local):
    """Solve contact i alone, with all other impulses fixed: its new impulse (normal, tangent 1, tangent 2) [N s].

    `impulse` and u are impulses and velocities of all contacts; `local` is that of `invert_contact_blocks`.
    """
    r = 3 * i
    p0, p1, p2 = impulse[r], impulse[r + 1], impulse[r + 2]
    # Open: without an impulse of its own the contact separates.
    if u[r] - (W[r, r] * p0 + W[r, r + 1] * p1 + W[r, r + 2] * p2) >= 0.0:
        return 0.0, 0.0, 0.0
    # Stick: the impulse that stops the contact point, if it is in the friction cone.
    q0 = p0 - (local[i, 0] * u[r] + local[i, 1] * u[r + 1] + local[i, 2] * u[r + 2])
    q1 = p1 - (local[i, 3] * u[r] + local[i, 4] * u[r + 1] + local[i, 5] * u[r + 2])
    q2 = p2 - (local[i, 6] * u[r] + local[i, 7] * u[r + 1] + local[i, 8] * u[r + 2])
    if q0 >= 0.0 and q1 * q1 + q2 * q2 <= (mu * q0) ** 2:
        return q0, q1, q2
    # Slide: by Newton's method on the direction; if it fails, a step of the normal impulse, then one of the tangential
    # impulse, projected on the disk of radius μ p_n.
    b0 = u[r] - (W[r, r] * p0 + W[r, r + 1] * p1 + W[r, r + 2] * p2)
    b1 = u[r + 1] - (W[r + 1, r] * p0 + W[r + 1, r + 1] * p1 + W[r + 1, r + 2] * p2)
    b2 = u[r + 2] - (W[r + 2, r] * p0 + W[r + 2, r + 1] * p1 + W[r + 2, r + 2] * p2)
    found, q0, q1, q2 = _solve_sliding_contact(r, b0, b1, b2, p1, p2, mu, W)
    if found:
        return q0, q1, q2
    q0 = max(0.0, p0 - local[i, LOCAL_NORMAL_RHO] * u[r])
    dn = q0 - p0
    step = local[i, LOCAL_TANGENT_RHO]
    q1 = p1 - step * (u[r + 1] + W[r + 1, r] * dn)
    q2 = p2 - step * (u[r + 2] + W[r + 2, r] * dn)
    size, limit = math.sqrt(q1 * q1 + q2 * q2), mu * q0
    if size > limit:
        q1 *= limit / size
        q2 *= limit / size
    return q0, q1, q2


@inlined
def _extrapolate(n, mu, ratio, scratch):
    """Extrapolate the impulses p of n contacts, whose changes shrink by `ratio` from sweep to sweep.

    The rest of the geometric series of changes is added to p. The sum is projected into the friction cones, and
    u = W p + b is updated.
    """
    contacts = scratch.contacts
    p, change = contacts.impulse, scratch.solver.change
    s = ratio / (1.0 - ratio)
    for i in range(n):
        r = 3 * i
        q0 = max(0.0, p[r] + s * change[r])
        q1, q2 = p[r + 1] + s * change[r + 1], p[r + 2] + s * change[r + 2]
        size, limit = math.sqrt(q1 * q1 + q2 * q2), mu[i] * q0
        if size > limit:
            q1 *= limit / size
            q2 *= limit / size
        p[r], p[r + 1], p[r + 2] = q0, q1, q2
    update_contact_velocities(3 * n, contacts.delassus, p, contacts.bias, contacts.velocity)


@kernel
def cone_sweeps(n, mu, tolerance, limit, scratch):
    """Solve n contacts with friction by sweeps, until the residual is at most `tolerance` [m/s], or `limit` are made.

    `contacts.impulse` has the warm start and gets the result; `contacts.velocity` gets the contact velocities. mu has
    the friction coefficients.

    Returns
    -------
    sweeps : int
        Number of sweeps made.
    residual : float
        Residual of the resulting impulses [m/s], measured.
    """
    contacts = scratch.contacts
    p, u, W = contacts.impulse, contacts.velocity, contacts.delassus
    local, change = scratch.solver.local, scratch.solver.change
    rows = 3 * n
    update_contact_velocities(rows, W, p, contacts.bias, u)
    residual = cone_residual(n, p, u, mu, local)
    sweeps = 0
    while not residual <= tolerance and sweeps < limit:
        product = square = 0.0
        for i in range(n):
            r = 3 * i
            q0, q1, q2 = _local_impulse(i, p, u, mu[i], W, local)
            d0, d1, d2 = q0 - p[r], q1 - p[r + 1], q2 - p[r + 2]
            p[r], p[r + 1], p[r + 2] = q0, q1, q2
            product += d0 * change[r] + d1 * change[r + 1] + d2 * change[r + 2]
            square += change[r] * change[r] + change[r + 1] * change[r + 1] + change[r + 2] * change[r + 2]
            change[r], change[r + 1], change[r + 2] = d0, d1, d2
            for s in range(rows):
                u[s] += (W[r, s] * d0 + W[r + 1, s] * d1) + W[r + 2, s] * d2
        sweeps += 1
        if sweeps % EXTRAPOLATION_PERIOD == 0 and product > 0.0:
            _extrapolate(n, mu, min(product / square, _MAX_CONTRACTION_RATIO), scratch)
        residual = cone_residual(n, p, u, mu, local)
    return sweeps, residual
