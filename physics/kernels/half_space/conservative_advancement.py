"""Safe times of free flight near a wall, for bodies that turn far in a step (conservative advancement).

A feature that turns by a large angle may pass through a wall and be out of it again at the end of a stage. A test of
gaps at the end would miss it. So this module bounds the gap from below at every time t of a free flight. The wall has
the normal n; the body has the centre of mass x, the velocity v, the angular velocity ω and the angular momentum L. A
point of the body at the arm r from its centre of mass rises along n, after t, at least by

    t n·(v + ω x r) - a t²/2,    a a bound of the acceleration of all points.

Now n·(ω x r) = (n x ω)·r. With k = n + t (n x ω), all points of a convex body are after t above the wall at least by

    n·x - offset + t n·v - s(-k) - a t²/2,    s the support function.

This bound is concave in t. So a chord between a time where the bound is positive and a time where it is not has its
zero at a time where the bound is positive. The body flies up to that time, and the bound is computed again
(conservative advancement, Mirtich 1996, to second order).

The acceleration bound a comes from a bound of |ω|. Let J be the inverse principal moments, R the bounding radius and τ
the torque. J² <= (J_max + J_min) J - J_max J_min for each of them, so |ω|² <= (J_max + J_min) ω·L - J_max J_min |L|²,
with equality for a rod that turns across its axis. The coefficients of Euler's equations lie between -1 and 1, so
|dω/dt| <= |ω|²/√3 + J_max |τ|. Hence a <= |a_centre| + R (1 + 1/√3) |ω|² + R J_max |τ|.

A second bound goes by components along the principal axes. Let ρ_i be the largest distance of the body's points from
axis i, and w_i = min(√(J_i ω·L), J_i |L|) a bound of |ω_i|. Then |ω x r| <= Σ w_i ρ_i and
|dω/dt x r| <= Σ (w_j w_k + J_i |τ|) ρ_i. This is smaller where a rod turns fast about its own axis. The smaller of the
two bounds counts.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import cold_kernel, inlined, kernel
from physics.kernels.flight.free_flight import fly
from physics.kernels.half_space import support_function as geo
from physics.kernels.half_space.contact_point import center_arm, wall_normal
from physics.kernels.math import quaternion as qt
from physics.kernels.math.quaternion import to_matrix
from physics.kernels.state.body import angular_velocity
from physics.kernels.state.layout import ELLIPSOID, HULL, SPHERE, WALL_OFFSET

# A body turns far where it turns by more than this within a step [rad]; for smaller turns a test of the gaps at the
# end of each stage suffices.
FAR_TURN = 0.25

# Largest number of cuts of a substep because its body turns far; cuts at impacts are counted apart.
MAX_TURNING_CUTS = 64

# Largest number of advances of one flight; the next stage makes the rest of the flight.
MAX_ADVANCES = 100

# Largest number of pairs of a chord and a halving in one advance, and the share of the gap that may be left after it.
CHORDS = 8
GAP_LEFT_SHARE = 0.2

ACCELERATION_SHARE = 1.0 + 1.0 / math.sqrt(3.0)


@inlined
def max_inv_inertia(body):
    """Largest inverse principal moment of inertia of a body [1/(kg m²)]."""
    return max(body.J[0], max(body.J[1], body.J[2]))


@inlined
def is_centred(offset_frame, body):
    """True if the geometric centre of a body is its centre of mass."""
    return offset_frame is None or (body.center[0] == 0.0 and body.center[1] == 0.0 and body.center[2] == 0.0)


@inlined
def may_turn(L, h, least, offset_frame, body):
    """True if a body with the angular momentum L may turn by more than `least` [rad] within the time h [s].

    The test is cheap and safe: it may be true of a body that turns less, never false of one that turns more. A sphere
    whose centre is its centre of mass never counts as turning.
    """
    if body.shape == SPHERE and is_centred(offset_frame, body):
        return False
    s, t = h * max_inv_inertia(body), (body.torque[0], body.torque[1], body.torque[2])
    return 2.0 * (qt.dot(L, L) + h * h * qt.dot(t, t)) * s * s > least * least


@kernel
def spin_bound(q, L, h, offset_frame, body):
    """Upper bound of the angular speed |ω| [rad/s] in a free flight of h [s] from attitude q, angular momentum L."""
    most, least = max_inv_inertia(body), min(body.J[0], min(body.J[1], body.J[2]))
    w = angular_velocity(q, L, body, offset_frame)
    push = h * math.sqrt(body.torque[0] ** 2 + body.torque[1] ** 2 + body.torque[2] ** 2)
    size = max(0.0, math.sqrt(qt.dot(L, L)) - push)
    energy = math.sqrt(max(0.0, qt.dot(w, L))) + math.sqrt(most) * push
    square = (most + least) * energy * energy - most * least * size * size
    return math.sqrt(max(square, qt.dot(w, w)))


@inlined
def _arm(i, offset_frame, body):
    """Largest distance of a body's points from its principal axis i [m]."""
    if offset_frame is not None or body.shape == HULL:
        return body.radius
    b, c = body.dims[(i + 1) % 3], body.dims[(i + 2) % 3]
    return math.sqrt(b * b + c * c)


@kernel
def turning_acceleration_bound(spin, q, L, h, offset_frame, body):
    """Upper bound of the acceleration that turning gives to any point of a body within the time h [m/s²].

    `spin` is the bound of |ω| from `spin_bound`. The bound is 0 for a sphere whose centre is its centre of mass.
    """
    if body.shape == SPHERE and is_centred(offset_frame, body):
        return 0.0
    torque = math.sqrt(body.torque[0] ** 2 + body.torque[1] ** 2 + body.torque[2] ** 2)
    w, most, J = angular_velocity(q, L, body, offset_frame), max_inv_inertia(body), body.J
    size = math.sqrt(qt.dot(L, L)) + h * torque
    energy = math.sqrt(max(0.0, qt.dot(w, L))) + math.sqrt(most) * h * torque
    u = min(math.sqrt(J[0]) * energy, J[0] * size)
    v = min(math.sqrt(J[1]) * energy, J[1] * size)
    t = min(math.sqrt(J[2]) * energy, J[2] * size)
    a, b, c = _arm(0, offset_frame, body), _arm(1, offset_frame, body), _arm(2, offset_frame, body)
    bend = spin * (u * a + v * b + t * c)
    bend += (v * t + J[0] * torque) * a + (t * u + J[1] * torque) * b + (u * v + J[2] * torque) * c
    return min(bend, body.radius * (ACCELERATION_SHARE * spin * spin + most * torque))


@inlined
def turned_normal(n, m, t):
    """Turn a wall's normal n as a body that turns at ω sees it: k = n + t m after the time t [s], with m = n x ω."""
    return (n[0] + t * m[0], n[1] + t * m[1], n[2] + t * m[2])


@inlined
def support_of_vector(shape, dims, R, k):
    """Support function s(k) of a point-symmetric shape (block, sphere, ellipsoid), for a vector k of any length [m]."""
    if shape == SPHERE:
        return dims[0] * math.sqrt(qt.dot(k, k))
    return geo.support(shape, dims, geo.scaled_normal(shape, dims, R, k))


@inlined
def bracket_safe_time(gap, rate, turning, bend, horizon):
    """Times (before, after), at most `horizon` [s], between which the lower bound of a body's gap falls to zero.

    The bound is `gap` [m] now, and the body moves away from the wall at `rate` [m/s]. Turning changes this rate by
    between -`turning` and `turning` [m/s]. The acceleration towards the wall is at most `bend` [m/s²]. `before` is the
    zero with the worst turning, `after` the zero with the best.
    """
    s, u = max(0.0, turning - rate), max(0.0, turning + rate)
    before = 2.0 * gap / (s + math.sqrt(s * s + 2.0 * bend * gap))
    after = (u + math.sqrt(u * u + 2.0 * bend * gap)) / bend
    return min(before, horizon), min(after, horizon)


@inlined
def secant_root(low, at_low, high, at_high):
    """Zero of the straight line from the point (low, at_low) to (high, at_high), with at_low > 0 > at_high."""
    return low + (high - low) * (at_low / (at_low - at_high))


@inlined
def mean_time(low, high):
    """Mean of two times high > low >= 0: geometric where they differ by more than the factor 4, else arithmetic.

    With such means few halvings find a root, whatever its order of magnitude.
    """
    return math.sqrt(low * high) if high > 4.0 * low else 0.5 * (low + high)


@inlined
def _height(t, n, m, gap, rate, bend, c, R, body):
    """Lower bound of a body's gap to a wall after the time t of free flight [m].

    n is the wall's normal and m = n x ω. `gap` and `rate` are the distance [m] and velocity [m/s] of the centre of mass
    from the wall, and `bend` bounds the acceleration of the body's points towards it [m/s²]. c is the geometric centre
    relative to the centre of mass, and R the body's rotation matrix.
    """
    k = turned_normal(n, m, t)
    dims = (body.dims[0], body.dims[1], body.dims[2])
    return gap + t * (rate - 0.5 * bend * t) + qt.dot(k, c) - support_of_vector(body.shape, dims, R, k)


@kernel
def safe_advance(y, wall, horizon, spin, offset_frame, scratch):
    """Gap of a body to a wall at the state y [m], and a time of free flight within which it cannot close [s].

    The time is at most `horizon`; `spin` is a bound of |ω| up to there (`spin_bound`).
    """
    body = scratch.body
    x, q, v, L = y
    n, R, w = wall_normal(scratch.scene.walls, wall), to_matrix(q), angular_velocity(q, L, body, offset_frame)
    m, d = qt.cross(n, w), qt.dot(n, x) - scratch.scene.walls[wall, WALL_OFFSET]
    c, a = (0.0, 0.0, 0.0), body.free_acceleration
    if offset_frame is not None:
        c = center_arm(R, body)
    rate = qt.dot(n, v)
    bend = turning_acceleration_bound(spin, q, L, horizon, offset_frame, body) - min(
        0.0, n[0] * a[0] + n[1] * a[1] + n[2] * a[2]
    )
    gap = _height(0.0, n, m, d, rate, bend, c, R, body)
    if not gap > 0.0 or not bend > 0.0:
        return gap, horizon
    low, high = bracket_safe_time(gap, rate, body.radius * math.sqrt(qt.dot(m, m)), bend, horizon)
    at_low = _height(low, n, m, d, rate, bend, c, R, body)
    at_high = _height(high, n, m, d, rate, bend, c, R, body)
    if at_high >= 0.0 or not at_low > 0.0:
        return gap, high if at_high >= 0.0 else low
    for _ in range(CHORDS):
        t = secant_root(low, at_low, high, at_high)
        found = _height(t, n, m, d, rate, bend, c, R, body)
        if found > 0.0:
            low, at_low = t, found
        if at_low <= GAP_LEFT_SHARE * gap:
            break
        t = mean_time(low, high)
        found = _height(t, n, m, d, rate, bend, c, R, body)
        if found > 0.0:
            low, at_low = t, found
        else:
            high, at_high = t, found
    return gap, low


@inlined
def may_reach_wall_in_flight(wall, y, h, scratch):
    """True if the bounding sphere of a body may come within a slop of a wall in a free flight of h [s] from y."""
    body = scratch.body
    n, a = wall_normal(scratch.scene.walls, wall), body.free_acceleration
    gap = qt.dot(n, y[0]) - scratch.scene.walls[wall, WALL_OFFSET] - body.radius
    gap += min(0.0, h * qt.dot(n, y[2])) + min(0.0, 0.5 * h * h * (n[0] * a[0] + n[1] * a[1] + n[2] * a[2]))
    return not gap > body.slop


@inlined
def remove_symmetric_spin(R, w, body):
    """Remove from the angular velocity w [rad/s] the part about an ellipsoid's axis of symmetry.

    Turning about that axis leaves the surface in place. For other shapes w is returned as it is. R is the body's
    rotation matrix.
    """
    d = body.dims
    if body.shape != ELLIPSOID or not (d[0] == d[1] or d[1] == d[2] or d[0] == d[2]):
        return w
    if d[0] == d[1] and d[1] == d[2]:
        return (0.0, 0.0, 0.0)
    e = (R[0], R[3], R[6]) if d[1] == d[2] else ((R[1], R[4], R[7]) if d[0] == d[2] else (R[2], R[5], R[8]))
    s = qt.dot(e, w)
    return (w[0] - s * e[0], w[1] - s * e[1], w[2] - s * e[2])


@inlined
def time_to_turn_far(n, y, offset_frame, body):
    """Time in which a body turns by `FAR_TURN` about axes across a wall's normal n [s], infinite without such turning.

    Turning about n itself brings no point nearer to the wall.
    """
    w = angular_velocity(y[1], y[3], body, offset_frame)
    if is_centred(offset_frame, body):
        w = remove_symmetric_spin(to_matrix(y[1]), w, body)
    m = qt.cross(n, w)
    rate = math.sqrt(qt.dot(m, m))
    return FAR_TURN / rate if rate > 0.0 else math.inf


@inlined
def _fly_near(y, wall, h, spin, gyroscopic, offset_frame, scratch):
    """Time of free flight from y, at most h, after which the body is within a slop of a wall [s]; h if it never is.

    It may be shorter where `MAX_ADVANCES` did not suffice.
    """
    now, gone = y, 0.0
    for _ in range(MAX_ADVANCES):
        gap, step = safe_advance(now, wall, h - gone, spin, offset_frame, scratch)
        if not gap > scratch.body.slop:
            break
        gone += step
        if not gone < h:
            return h
        now = fly(now, scratch.body, step, gyroscopic, offset_frame)
    return gone


@cold_kernel
def limit_turning_stage(n, y, h, left, gyroscopic, offset_frame, scratch):
    """Longest time, at most `left`, of a stage from y in which a body that turns far cannot pass through a wall [s].

    `n` is the number of contacts in the set, h the length of the substep, and `left` the part of it that is left. In
    flight the body may go as far as `safe_advance` allows. In contact (n > 0) its flight is not known; then it may turn
    by `FAR_TURN` at most, so that a test of gaps at the end of the stage suffices. So may a body that is already at a
    wall.
    """
    spin = spin_bound(y[1], y[3], h, offset_frame, scratch.body)
    if not spin * h > FAR_TURN:
        return left
    first = left
    for wall in range(scratch.scene.walls.shape[0]):
        if not may_reach_wall_in_flight(wall, y, first, scratch):
            continue
        normal, met = wall_normal(scratch.scene.walls, wall), 0.0
        if scratch.contacts.mask[wall] == 0:
            met = _fly_near(y, wall, first, spin, gyroscopic, offset_frame, scratch)
        limit = time_to_turn_far(normal, y, offset_frame, scratch.body)
        if not met > 0.0:
            met = limit
        if n > 0:
            met = min(met, limit)
        first = min(first, met)
    return first
