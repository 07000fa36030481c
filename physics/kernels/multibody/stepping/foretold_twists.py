"""Targets of a resting stage of several bodies under error control: smooth, and of second order where a slip turns.

Friction opposes the mean slip where a slip is foretold to go on and to turn (`lone_stage.mean_slip_target`). For that a
stage is foretold to have the forces of the stage before. Where contacts of that one are no longer there, or it was much
shorter, a body is foretold to keep its twist.

A face rests on more corners than it needs, so that its contact problem has no solution unless its targets are those of
a rigid motion. Three rules keep them so: gaps and overlaps close alike, contacts that push stay in contact, and targets
are not clamped one by one. Gaps close in the time of the substep: in that of a short part, rounding would be a speed.

All of this is left out of kernels without error control, and of those with compliant contact, whose parts are
extrapolated. A lone body has the three rules; `lone_stage` has its own mean slip and closing time.
"""

from __future__ import annotations

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import as_vector, minus, plus, row_vector, times
from physics.kernels.multibody.data.arrays import (
    NUM_CONTACTS,
    WARM_BODY_A,
    WARM_BODY_B,
    WARM_CONTACT_COUNT,
    WARM_CONTACT_SIZE,
    WARM_HEADER_SIZE,
    WARM_IMPULSE,
    WARM_STAGE_LENGTH,
)
from physics.kernels.multibody.data.contact_set import pair_slop, put_vector, relative_acceleration_bound, row_matrix
from physics.kernels.multibody.data.warm_start import load_warm_impulses
from physics.kernels.multibody.stepping.allowed_error import allowed_depth
from physics.kernels.state.body import angular_velocity, read_state
from physics.kernels.state.fixed_body import is_fixed

# Largest length of a stage, in lengths of the one before, and largest share of that one's impulse on contacts that are
# no longer there, for which the stage before foretells this one.
MAX_STRETCH = 8.0
LOST_SHARE = 0.05

# Least size of a target that opposes the mean slip, as a share of the slip before the stage.
_MEAN_SHARE = 0.5


@inlined
def _add(rows, b, p, sign):
    """Add the vector p, times `sign`, to the first three columns of row b, if b is a body (-1 stands for a wall)."""
    if b >= 0:
        for c in range(3):
            rows[b, c] += sign * p[c]


@kernel
def _add_impulses_of_last_stage(world, memory, foretold):
    """Add the impulses of the stage before to `foretold.before` of both bodies of each contact, world frame [N s]."""
    for k in range(int(memory[world, WARM_CONTACT_COUNT])):
        row = WARM_HEADER_SIZE + WARM_CONTACT_SIZE * k
        p = row_vector(memory, world, row + WARM_IMPULSE)
        _add(foretold.before, int(memory[world, row + WARM_BODY_A]), p, 1.0)
        _add(foretold.before, int(memory[world, row + WARM_BODY_B]), p, -1.0)


@kernel
def _add_impulses_of_contacts(n, many):
    """Add the impulses of the n contacts to `foretold.push`, their moments to `foretold.turn` [N s], [kg m²/s]."""
    contacts, foretold = many.contacts, many.foretold
    for k in range(n):
        p = qt.transposed_matvec(row_matrix(contacts.frame, k), row_vector(contacts.impulse, k, 0))
        for end in range(2):
            b, sign = contacts.bodies[k, end], 1.0 - 2.0 * end
            _add(foretold.push, b, p, sign)
            _add(foretold.turn, b, qt.cross(row_vector(contacts.arm, k, 3 * end), p), sign)


@kernel
def _foretell_body(b, h, last, offset_frame, many):
    """Write the foretold twist of body b after a stage of h [s] to `foretold.twist`, if all its pushes go on.

    `last` is the length of the stage before [s].
    """
    foretold, body = many.foretold, many.bodies.body[b]
    push, before = row_vector(foretold.push, b, 0), times(h / last, row_vector(foretold.before, b, 0))
    lost = minus(push, before)
    if qt.dot(lost, lost) <= LOST_SHARE * LOST_SHARE * qt.dot(before, before):
        _, q, v, L = read_state(many.bodies.state, b)
        v = plus(plus(v, times(h, as_vector(body.free_acceleration))), times(many.bodies.inv_mass[b], push))
        L = plus(L, plus(row_vector(foretold.turn, b, 0), times(h, as_vector(body.torque))))
        put_vector(foretold.twist, b, 0, v)
        put_vector(foretold.twist, b, 3, angular_velocity(q, L, body, offset_frame))


@if_given("many.foretold")
def foretell_twists_of_several(n, world, h, switches, memory, many):
    """Write to `many.foretold.twist` the twists after a stage of h [s] whose n contacts push as in the stage before.

    A body keeps its twist if contacts that pushed it are no longer there, or the stage before was much shorter. `world`
    is the index of the world, `memory` has its warm starts.
    """
    foretold, last = many.foretold, memory[world, WARM_STAGE_LENGTH]
    load_warm_impulses(n, world, h, switches.friction, memory, many)
    for b in range(many.bodies.state.shape[0]):
        for c in range(6):
            foretold.twist[b, c] = many.bodies.twist[b, c]
        for c in range(3):
            foretold.push[b, c] = foretold.turn[b, c] = foretold.before[b, c] = 0.0
    if not last * MAX_STRETCH >= h:
        return
    _add_impulses_of_last_stage(world, memory, foretold)
    _add_impulses_of_contacts(n, many)
    for b in range(many.bodies.state.shape[0]):
        if many.bodies.touched[b] == 1 and not is_fixed(b, many.bodies):
            _foretell_body(b, h, last, switches.flight.offset_frame, many)


@if_given("many.foretold")
def note_substep(h, many):
    """Note the length h of a substep [s], before its parts are stepped."""
    many.foretold.substep[0] = h


def _same(h, many):
    return h


@if_given("many.foretold", _same)
def longest_stage(h, many):
    """Length of the substep, of which a stage of h [s] is a part [s]; h without error control of several bodies."""
    return many.foretold.substep[0]


def _not_foretold(many):
    return False


@if_given("many.even", _not_foretold)
def is_foretold(many):
    """True if stages foretell the twists of bodies."""
    return True


@inlined
def _is_beside_pushing(k, step, many):
    """True if a later contact of the same pair as contact k (`step` = 1) has pushed, or an earlier one (-1).

    Contact k must have no larger gap than that one, except for a slop.
    """
    a, b, m = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], k + step
    least = many.contacts.gap[k] - pair_slop(a, b, many)
    while 0 <= m < many.counts[NUM_CONTACTS] and many.contacts.bodies[m, 0] == a and many.contacts.bodies[m, 1] == b:
        if many.contacts.impulse[m, 0] > 0.0 and many.contacts.gap[m] >= least:
            return True
        m += step
    return False


def _never(k, many):
    return False


@if_given("many.even", _never)
def is_held(k, many):
    """True if contact k stays in contact, whatever its gap at the middle is: it has pushed in the stage before.

    That gap is an error of third order in the length of the stage. A contact without load that lies no farther than one
    of its face that has pushed stays, too: where a load leaves a corner of a face and comes back, nothing must jump.
    The contacts have the warm start.
    """
    return many.contacts.impulse[k, 0] > 0.0 or _is_beside_pushing(k, 1, many) or _is_beside_pushing(k, -1, many)


def _closes_alike(k, gap, many):
    if gap > -allowed_depth(many.contacts.bodies[k, 0], many) and relative_acceleration_bound(k, many) > 0.0:
        return gap
    return max(gap, 0.0)


@if_given("many.driven", _closes_alike)
def _gap_or_overlap(k, gap, many):
    """Gap to close of contact k where bodies are driven: there overlaps stay, to open them would be work [m]."""
    return max(gap, 0.0)


def _only_gap(k, gap, many):
    return max(gap, 0.0)


@if_given("many.even", _only_gap)
def gap_to_close(k, gap, many):
    """Gap of contact k, which touches, that closes in the time `longest_stage`; below 0 it is an overlap [m].

    Under error control overlaps open as gaps close, so that the gaps of one face stay those of a plane. Otherwise no
    velocity of the body would meet the targets of all its contacts. Overlaps above the allowed error are left to the
    correction of positions, and so are those of bodies without loads, whose speeds would be rounding of the gaps.
    """
    return _gap_or_overlap(k, gap, many)


def _not_known(k, slip, many):
    return False


@if_given("many.foretold", _not_known)
def is_slip_foretold(k, slip, many):
    """True if friction of contact k opposes the mean slip in the present stage: its slip is foretold to go on.

    `slip` is its size before the stage [m/s]. Targets against the mean slip have that size, others are much smaller.
    """
    t = row_vector(many.contacts.target, k, 0)
    return t[1] * t[1] + t[2] * t[2] > _MEAN_SHARE * _MEAN_SHARE * slip * slip
