"""Safe times of free flight for bodies that turn far in a stage, near walls and each other.

The same method as `physics.kernels.half_space.conservative_advancement`, for pairs of bodies a and b. Let x be their
geometric centres, v the velocities of these centres, ω the angular velocities, s the support functions, and A a bound
of the acceleration of a body's points. For a direction n out of b, the gap after a time t is at least

    n·(x_a - x_b) + t n·(v_a - v_b) - s_a(-k_a) - s_b(k_b) - (A_a + A_b) t²/2,    k = n + t (n x ω),

which is concave in t. The bodies are flown to a time before its zero, and the direction n in which they are nearest is
found again by `gjk` after each advance.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
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
from physics.kernels.multibody.data.capsules import capsule_support, is_capsule
from physics.kernels.multibody.data.contact_set import add_scaled, arrival_gap, subtract
from physics.kernels.multibody.data.cylinders import cylinder_support, is_cylinder
from physics.kernels.multibody.data.driven_bodies import acceleration_of, spin_of, state_after
from physics.kernels.multibody.data.fixed_bodies import is_still
from physics.kernels.multibody.data.parts import body_of, posed_part
from physics.kernels.multibody.narrowphase.gjk import gjk_distance, hull_support_vertex
from physics.kernels.state.body import read_state
from physics.kernels.state.fixed_body import is_fixed
from physics.kernels.state.layout import HULL, SPHERE, WALL_NORMAL, WALL_OFFSET

# Turn from which a body turns far under error control [rad]. A point of a body that turns by θ leaves the straight line
# along which contacts are predicted by θ²/8 of its radius, 1.3e-3. If a longer turn misses a contact that shorter parts
# find, the results differ and the part is refused.
_MIN_TURN = 0.1

# Share of `data.contact_set.arrival_gap` to which a pair is flown. The gap of a contact is along its own normal, which
# may be 11 degrees off the direction used here, and must be found to have arrived, too.
_ARRIVAL_FRACTION = 0.5


@inlined
def write_spin_bounds(h, offset_frame, many):
    """Write bounds of |ω| [rad/s] for bodies that may turn far within h [s], 0 for others; return whether any may.

    The bounds are written to `many.bodies.spin_bound`. `offset_frame` is a switch of `state.groups.FlightSwitches`. A
    cheap test settles most bodies: loads raise |ω| by at most h times a body's acceleration over its radius. While a
    body turns by less than `FAR_TURN`, its spin grows by less than a factor of √2 (see
    `conservative_advancement.spin_bound`).
    """
    least, found = FAR_TURN, False
    if many.settings[0].is_error_controlled == 1:
        least = _MIN_TURN
    limit = 0.5 * (least / h) ** 2
    for b in range(many.bodies.state.shape[0]):
        if is_still(b, many):
            continue
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
    """Write `many.bodies.spin_bound` of body b; return whether it may turn by more than `least` [rad] within h [s]."""
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
    """Clear the spin bounds: every body then counts as one that does not turn far."""
    for b in range(many.bodies.state.shape[0]):
        many.bodies.spin_bound[b] = 0.0


@inlined
def _contact_side(part, y, n, offset_frame, many):
    """Data of a part of a body in a state y for `_gap_bound` along the unit vector n, of which there are five.

    They are the geometric centre, the rotation matrix, the arm from the centre of mass to the geometric centre (world
    frame), the velocity along n, and n x ω. The last is 0 for a sphere about its centre of mass, whose rotation moves
    no surface.
    """
    (x, q, v, L), b = y, body_of(part, many)
    R, c, m = to_matrix(q), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    if offset_frame is not None:
        c = center_arm(R, many.bodies.body[b])
    c, R = posed_part(part, c, R, many)
    if not (many.bodies.body[b].shape == SPHERE and is_centred(offset_frame, many.bodies.body[b])):
        m = qt.cross(n, spin_of(b, q, L, offset_frame, many))
    return add_scaled(x, 1.0, c), R, c, qt.dot(n, v), m


@inlined
def _support(b, R, k, hulls, many):
    """Support function of body b along the vector k of any length: the largest k·r over its points r.

    The points r are relative to its geometric centre; R is the body's rotation matrix.
    """
    d, shape = many.bodies.body[b].dims, many.bodies.body[b].shape
    if hulls is not None:  # noqa: SIM102 (a branch of its own is what the compiler prunes)
        if shape == HULL:
            e = qt.transposed_matvec(R, k)
            return qt.dot(e, hull_support_vertex(b, e, many))
    if is_capsule(b, many):
        return capsule_support(b, R, k, many)
    if is_cylinder(b, many):
        return cylinder_support(b, R, k, many)
    return support_of_vector(shape, (d[0], d[1], d[2]), R, k)


@kernel
def _gap_bound(t, a, b, n, sides, rate, bend, hulls, many):
    """Lower bound of the gap between part a and part b, or wall -1 - b, along n after t [s] of free flight [m].

    It is the formula of the module. `sides` are the results of `_contact_side` for a and b, `rate` is the relative
    velocity along n [m/s], and `bend` the bound of the relative acceleration [m/s²].
    """
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
    """Time within which the gap of part a and part b, or wall -1 - b, along n cannot close, at most `horizon` [s].

    `one` and `other` are the results of `_contact_side` for a and b; `bend` is the bound of the relative acceleration
    of their points [m/s²].
    """
    rate, turning = one[3], many.bodies.body[body_of(a, many)].radius * _norm(one[4])
    if b >= 0:
        rate -= other[3]
        turning += many.bodies.body[body_of(b, many)].radius * _norm(other[4])
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
    """Bound of the acceleration [m/s²] that the rotation of body b gives to its points within h [s]."""
    if is_fixed(b, many.bodies):
        return acceleration_of(b, many)
    _, q, _, L = read_state(many.bodies.state, b)
    spin = many.bodies.spin_bound[b]
    if not spin > 0.0:
        spin = spin_bound(q, L, h, offset_frame, many.bodies.body[b])
    return turning_acceleration_bound(spin, q, L, h, offset_frame, many.bodies.body[b])


@inlined
def _load_acceleration(b, n, many):
    """Acceleration of body b's centre of mass by its loads, along the unit vector n [m/s²]."""
    g = many.bodies.body[b].free_acceleration
    return n[0] * g[0] + n[1] * g[1] + n[2] * g[2]


@kernel
def _time_of_impact(part, other_part, h, gyroscopic, offset_frame, hulls, many):
    """Time that a part can fly freely until it arrives at another part, or wall -1 - k; h if it does not arrive [s].

    Parts of bodies that are no compounds are the bodies. To arrive is to come within the `arrival_gap`. Bodies in
    contact do not fly freely, and neither does a pair that touches. For them the result is the time in which they turn
    by `FAR_TURN`, if it is less than h: a test at the end of the stage then finds any contact.
    """
    a, b = body_of(part, many), body_of(other_part, many)
    touch, gone, first = _ARRIVAL_FRACTION * arrival_gap(a, b, many), 0.0, h
    one = read_state(many.bodies.state, a)
    other, partner, partner_part = one, a, part
    if b >= 0:
        other, partner, partner_part = read_state(many.bodies.state, b), b, other_part
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
        left = _contact_side(part, one, n, offset_frame, many)
        right = _contact_side(partner_part, other, n, offset_frame, many)
        if b >= 0:
            n, gap = gjk_distance(part, other_part, (left[:2], right[:2]), None, n, touch, 0.0, hulls, many)
            left = _contact_side(part, one, n, offset_frame, many)
            right = _contact_side(partner_part, other, n, offset_frame, many)
        else:
            gap = _gap_bound(0.0, part, other_part, n, (left, right), 0.0, 0.0, hulls, many)
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
        step = _safe_time(part, other_part, n, left, right, bend - min(0.0, pull), first - gone, hulls, many)
        if not step > 0.0:
            break
        gone += step
        if not gone < first:
            return first
        one = state_after(a, one, gone - step, step, gyroscopic, offset_frame, many)
        if b >= 0:
            other = state_after(b, other, gone - step, step, gyroscopic, offset_frame, many)
    return gone


def _time_of_bodies(a, b, h, gyroscopic, offset_frame, hulls, many):
    return _time_of_impact(a, b, h, gyroscopic, offset_frame, hulls, many)


@if_given("many.bodies.parts", _time_of_bodies)
def _time_of_parts(a, b, h, gyroscopic, offset_frame, hulls, many):
    """Time until some part of body a arrives at a part of body b, or at wall -1 - b, as of `_time_of_impact` [s]."""
    span, first = many.bodies.parts.span, h
    for part in range(span[a, 0], span[a, 1]):
        if b < 0:
            first = min(first, _time_of_impact(part, b, first, gyroscopic, offset_frame, hulls, many))
            continue
        for other in range(span[b, 0], span[b, 1]):
            first = min(first, _time_of_impact(part, other, first, gyroscopic, offset_frame, hulls, many))
    return first


@kernel
def safe_stage_length(h, gyroscopic, offset_frame, hulls, many):
    """Time, at most h, that a stage may take so that no body that turns far passes through another or a wall [s].

    `gyroscopic` and `offset_frame` are switches of `state.groups.FlightSwitches`; `hulls` is None if the scene has
    none.
    """
    first = h
    for b in range(many.bodies.state.shape[0]):
        if many.bodies.spin_bound[b] > 0.0:
            for wall in range(many.walls.shape[0]):
                if may_reach_wall(b, wall, first, many):
                    first = min(first, _time_of_parts(b, -1 - wall, first, gyroscopic, offset_frame, hulls, many))
    for k in range(many.counts[NUM_PAIRS]):
        a, b = many.broadphase.pairs[k, 0], many.broadphase.pairs[k, 1]
        if (many.bodies.spin_bound[a] > 0.0 or many.bodies.spin_bound[b] > 0.0) and may_meet(a, b, first, many):
            first = min(first, _time_of_parts(a, b, first, gyroscopic, offset_frame, hulls, many))
    return first
