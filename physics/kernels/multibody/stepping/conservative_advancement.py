"""Safe times of free flight for bodies that turn far in a stage, near walls and each other.

`physics.kernels.half_space.conservative_advancement` for many bodies: along a direction n, out of b, a and b are apart
after t by at least

    n·(x_a - x_b) + t n·(v_a - v_b) - s_a(-k_a) - s_b(k_b) - (a_a + a_b) t²/2,    k = n + t (n x ω),

which is concave in t. The direction is that in which they are nearest (`gjk`), found again after each advance.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.flight.free_flight import fly
from physics.kernels.half_space.conservative_advancement import (
    CHORDS,
    FAR_TURN,
    GAP_LEFT_SHARE,
    MAX_ADVANCES,
    bracket_safe_time,
    is_centred,
    may_turn,
    mean_time,
    secant_root,
    spin_bound,
    support_of_vector,
    time_to_turn_far,
    turned_normal,
    turning_acceleration_bound,
)
from physics.kernels.half_space.contact_point import center_arm
from physics.kernels.math import quaternion as qt
from physics.kernels.math.quaternion import to_matrix
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.broadphase.sweep_and_prune import may_meet, may_reach_wall
from physics.kernels.multibody.data.arrays import NUM_PAIRS
from physics.kernels.multibody.data.contact_set import add_scaled, arrival_gap, subtract
from physics.kernels.multibody.narrowphase.gjk import gjk_distance, hull_support_vertex
from physics.kernels.state.body import angular_velocity, read_state
from physics.kernels.state.layout import HULL, SPHERE, WALL_NORMAL, WALL_OFFSET

# Turn from which bodies are looked at under error control [rad]: of a body that turns by less within a part the
# points are off the line along which contacts are foretold by θ²/8 of its radius, 1.3e-3. A part of longer turns that
# meets something differs from its halves if these do not, and is refused.
_MIN_TURN = 0.1

# Share of `data.contact_set.arrival_gap` to which they are flown: a contact's gap is along its own normal, which may be
# 11 degrees off, and none must be left to the other's care.
_ARRIVAL_FRACTION = 0.5


@inlined
def write_spin_bounds(h, offset_frame, many):
    """Write `many.bodies.spin_bound`: bounds of |ω| of bodies that may turn far in h, else 0; return whether any may.

    A cheap test settles most bodies. Loads turn a body by at most h times its acceleration over its radius. While it
    turns by less than `FAR_TURN`, its spin grows by less than a factor of √2 (see
    `conservative_advancement.spin_bound`).
    """
    least, found = FAR_TURN, False
    if many.settings[0].is_error_controlled == 1:
        least = _MIN_TURN
    limit = 0.5 * (least / h) ** 2
    for b in range(many.bodies.state.shape[0]):
        many.bodies.spin_bound[b] = 0.0
        w, r, push = (
            row_vector(many.bodies.twist, b, 3),
            many.bodies.body[b].radius,
            h * many.bodies.body[b].acceleration,
        )
        if r * r * (qt.dot(w, w) - limit) + push * push > 0.0:
            found = _write_spin_bound(b, h, least, offset_frame, many) or found
    return found


@kernel
def _write_spin_bound(b, h, least, offset_frame, many):
    """Write `many.bodies.spin_bound` of one body; return whether it turns far."""
    _, q, _, L = read_state(many.bodies.state, b)
    if not may_turn(L, h, least, offset_frame, many.bodies.body[b]):
        return False
    spin = spin_bound(q, L, h, offset_frame, many.bodies.body[b])
    if not spin * h > least:
        return False
    many.bodies.spin_bound[b] = spin
    return True


@inlined
def clear_spin_bounds(many):
    """Clear all bounds: no body turns far."""
    for b in range(many.bodies.state.shape[0]):
        many.bodies.spin_bound[b] = 0.0


@inlined
def _contact_side(b, y, n, offset_frame, many):
    """(geometric centre, rotation, its arm, velocity along n, n x ω) of body b in state y; a sphere's ω is left out."""
    x, q, v, L = y
    R, c, m = to_matrix(q), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    if offset_frame is not None:
        c = center_arm(R, many.bodies.body[b])
    if not (many.bodies.body[b].shape == SPHERE and is_centred(offset_frame, many.bodies.body[b])):
        m = qt.cross(n, angular_velocity(q, L, many.bodies.body[b], offset_frame))
    return add_scaled(x, 1.0, c), R, c, qt.dot(n, v), m


@inlined
def _support(b, R, k, hulls, many):
    """Reach of body b along k from its geometric centre, in |k|."""
    d, shape = many.bodies.body[b].dims, many.bodies.body[b].shape
    if hulls is not None:  # noqa: SIM102 (a branch of its own is what the compiler prunes)
        if shape == HULL:
            e = qt.transposed_matvec(R, k)
            return qt.dot(e, hull_support_vertex(b, e, many))
    return support_of_vector(shape, (d[0], d[1], d[2]), R, k)


@kernel
def _gap_bound(t, a, b, n, sides, rate, bend, hulls, many):
    """Bound of the gap between body a and body b, or wall -1 - b, along n after t [m]; see the module."""
    one, other = sides
    x, R, c, _, m = one
    k = turned_normal(n, m, t)
    gap = t * (rate - 0.5 * bend * t) + t * qt.dot(m, c) - _support(a, R, (-k[0], -k[1], -k[2]), hulls, many)
    if b < 0:
        return gap + qt.dot(n, x) - many.walls[-1 - b, WALL_OFFSET]
    y, S, c, _, m = other
    k = turned_normal(n, m, t)
    return gap + qt.dot(n, subtract(x, y)) - t * qt.dot(m, c) - _support(b, S, k, hulls, many)


@inlined
def _norm(m):
    return math.sqrt(qt.dot(m, m))


@kernel
def _safe_time(a, b, n, one, other, bend, horizon, hulls, many):
    """Time within which the gap along n cannot close, at most `horizon` [s]."""
    rate, turning = one[3], many.bodies.body[a].radius * _norm(one[4])
    if b >= 0:
        rate -= other[3]
        turning += many.bodies.body[b].radius * _norm(other[4])
    gap = _gap_bound(0.0, a, b, n, (one, other), rate, bend, hulls, many)
    if not gap > 0.0:
        return 0.0
    if not bend > 0.0:
        return horizon
    low, high = bracket_safe_time(gap, rate, turning, bend, horizon)
    at_low = _gap_bound(low, a, b, n, (one, other), rate, bend, hulls, many)
    at_high = _gap_bound(high, a, b, n, (one, other), rate, bend, hulls, many)
    if at_high >= 0.0:
        return high
    for _ in range(CHORDS):
        if not at_low > GAP_LEFT_SHARE * gap:
            break
        t = secant_root(low, at_low, high, at_high)
        found = _gap_bound(t, a, b, n, (one, other), rate, bend, hulls, many)
        if found > 0.0:
            low, at_low = t, found
        t = mean_time(low, high)
        found = _gap_bound(t, a, b, n, (one, other), rate, bend, hulls, many)
        if found > 0.0:
            low, at_low = t, found
        else:
            high, at_high = t, found
    return low


@inlined
def _turning_acceleration(b, h, offset_frame, many):
    """Bound of the acceleration of a point of body b by turning within h [m/s²]."""
    _, q, _, L = read_state(many.bodies.state, b)
    spin = many.bodies.spin_bound[b]
    if not spin > 0.0:
        spin = spin_bound(q, L, h, offset_frame, many.bodies.body[b])
    return turning_acceleration_bound(spin, q, L, h, offset_frame, many.bodies.body[b])


@inlined
def _load_acceleration(b, n, many):
    """Acceleration of body b along n [m/s²]."""
    g = many.bodies.body[b].free_acceleration
    return n[0] * g[0] + n[1] * g[1] + n[2] * g[2]


@kernel
def _time_of_impact(a, b, h, gyroscopic, offset_frame, hulls, many):
    """Time of free flight, at most h, after which a and b (or wall -1 - b) have arrived, or will not [s].

    The free flight of the bound does not apply to bodies in contact, nor to a pair that touches. These turn at most as
    far as a test at the end can judge.
    """
    touch, gone, first = _ARRIVAL_FRACTION * arrival_gap(a, b, many), 0.0, h
    one = read_state(many.bodies.state, a)
    other, partner = one, a
    if b >= 0:
        other, partner = read_state(many.bodies.state, b), b
    bend = _turning_acceleration(a, h, offset_frame, many) + (
        _turning_acceleration(b, h, offset_frame, many) if b >= 0 else 0.0
    )
    is_held = many.bodies.touched[a] == 1 or many.bodies.touched[partner] == 1
    n = (1.0, 0.0, 0.0)
    if b < 0:
        n = row_vector(many.walls, -1 - b, WALL_NORMAL)
    elif _norm(subtract(one[0], other[0])) > 0.0:
        n = subtract(one[0], other[0])
    for _ in range(MAX_ADVANCES):
        left = _contact_side(a, one, n, offset_frame, many)
        right = _contact_side(partner, other, n, offset_frame, many)
        if b >= 0:
            n, gap = gjk_distance(a, b, (left[:2], right[:2]), None, n, touch, 0.0, hulls, many)
            left, right = _contact_side(a, one, n, offset_frame, many), _contact_side(b, other, n, offset_frame, many)
        else:
            gap = _gap_bound(0.0, a, b, n, (left, right), 0.0, 0.0, hulls, many)
        if gone == 0.0 and (is_held or not gap > touch):
            if many.bodies.spin_bound[a] > 0.0:
                first = min(first, time_to_turn_far(n, one, offset_frame, many.bodies.body[a]))
            if many.bodies.spin_bound[partner] > 0.0:
                first = min(first, time_to_turn_far(n, other, offset_frame, many.bodies.body[partner]))
            if not gap > touch:
                return first
        if not gap > touch:
            return gone
        pull = _load_acceleration(a, n, many) - (_load_acceleration(b, n, many) if b >= 0 else 0.0)
        step = _safe_time(a, b, n, left, right, bend - min(0.0, pull), first - gone, hulls, many)
        if not step > 0.0:
            break
        gone += step
        if not gone < first:
            return first
        one = fly(one, many.bodies.body[a], step, gyroscopic, offset_frame)
        if b >= 0:
            other = fly(other, many.bodies.body[b], step, gyroscopic, offset_frame)
    return gone


@kernel
def safe_stage_length(h, gyroscopic, offset_frame, hulls, many):
    """Time, at most h, that a stage may take so that no body that turns far passes through another [s]."""
    first = h
    for b in range(many.bodies.state.shape[0]):
        if many.bodies.spin_bound[b] > 0.0:
            for wall in range(many.walls.shape[0]):
                if may_reach_wall(b, wall, first, many):
                    first = min(first, _time_of_impact(b, -1 - wall, first, gyroscopic, offset_frame, hulls, many))
    for k in range(many.counts[NUM_PAIRS]):
        a, b = many.broadphase.pairs[k, 0], many.broadphase.pairs[k, 1]
        if (many.bodies.spin_bound[a] > 0.0 or many.bodies.spin_bound[b] > 0.0) and may_meet(a, b, first, many):
            first = min(first, _time_of_impact(a, b, first, gyroscopic, offset_frame, hulls, many))
    return first
