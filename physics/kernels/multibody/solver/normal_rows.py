"""Rows of the normals' Jacobian, and of M⁻¹ times it, for sweeps along the normals: a visit reads them as `lanes`.

For the normal n of a contact and the arms r, s from its bodies

    u_n = n·(v_a - v_b) + (r x n)·ω_a - (s x n)·ω_b,

and an impulse p changes v_a by p n/m_a and ω_a by p I_a⁻¹ (r x n), those of b by as much the other way. `many.rows` has
n, r x n, I_a⁻¹ (r x n), s x n and I_b⁻¹ (s x n); `many.motion` has the twists meanwhile. A vector is three numbers and
one that is zero: a sum over four lanes is that over three. The zero is written each time, since what is not a number in
one world would stay there for all that come after it.
"""

from __future__ import annotations

from physics.kernels.compile.decorators import inlined
from physics.kernels.compile.simd import Lanes, put_row, row, total
from physics.kernels.math import quaternion as qt
from physics.kernels.multibody.data.contact_set import put, vector
from physics.kernels.multibody.solver.block_lu import SPIN
from physics.kernels.multibody.solver.contact_operator import turned

# Where the vectors begin: normal, its moment about a and that moment's turning, those of b.
AXIS, MOMENT_A, TURN_A, MOMENT_B, TURN_B = range(0, 20, 4)


@inlined
def put_padded(array, i, j, a):
    """Write a vector and its zero."""
    put_row(array, i, j, Lanes(a[0], a[1], a[2], 0.0))


@inlined
def _set_moving(b, many):
    put_padded(many.motion, b, 0, vector(many.twist, b, 0))
    put_padded(many.motion, b, SPIN, vector(many.twist, b, 3))


@inlined
def set_moved(b, many):
    """The twist of body b from `many.motion`."""
    put(many.twist, b, 0, vector(many.motion, b, 0))
    put(many.twist, b, 3, vector(many.motion, b, SPIN))


@inlined
def set_motion(first, last, many):
    """`many.motion` of the bodies of the contacts `many.queue[first:last]` from their twists."""
    for i in range(first, last):
        a, b = many.ends[many.queue[i], 0], many.ends[many.queue[i], 1]
        _set_moving(a, many)
        if b >= 0:
            _set_moving(b, many)


@inlined
def set_twists(first, last, many):
    """Twists of the bodies of the contacts `many.queue[first:last]` from `many.motion`."""
    for i in range(first, last):
        a, b = many.ends[many.queue[i], 0], many.ends[many.queue[i], 1]
        set_moved(a, many)
        if b >= 0:
            set_moved(b, many)


@inlined
def _normal_mobility(k, b, first, moment, many):
    """Share of one end in W_nn of a contact; write its vectors of the normal to `many.rows`."""
    g = qt.cross(vector(many.arm, k, first), vector(many.frame, k, 0))
    h = turned(b, g, many)
    put_padded(many.rows, k, moment, g)
    put_padded(many.rows, k, moment + 4, h)
    return many.lightness[b] + qt.dot(g, h)


@inlined
def assemble_normal(k, many):
    """Write what only asks of the normal of contact k: W_nn and its row."""
    put_padded(many.rows, k, AXIS, vector(many.frame, k, 0))
    W = _normal_mobility(k, many.ends[k, 0], 0, MOMENT_A, many)
    if many.ends[k, 1] >= 0:
        W += _normal_mobility(k, many.ends[k, 1], 3, MOMENT_B, many)
    many.block[k, 0] = W


@inlined
def normal_velocity(k, many):
    """u_n of contact k."""
    R, t, a, b = many.rows, many.motion, many.ends[k, 0], many.ends[k, 1]
    v = row(t, a, 0)
    if b >= 0:
        v = v - row(t, b, 0)
    x = row(R, k, AXIS) * v + row(R, k, MOMENT_A) * row(t, a, SPIN)
    if b >= 0:
        x = x - row(R, k, MOMENT_B) * row(t, b, SPIN)
    return total(x)


@inlined
def _add(b, first, x, many):
    put_row(many.motion, b, first, row(many.motion, b, first) + x)


@inlined
def push_normal(k, p, many):
    """Change the motion of both bodies by an impulse p along the normal of contact k [N s]."""
    R, a, b = many.rows, many.ends[k, 0], many.ends[k, 1]
    n = row(R, k, AXIS)
    _add(a, 0, (many.lightness[a] * p) * n, many)
    _add(a, SPIN, p * row(R, k, TURN_A), many)
    if b >= 0:
        _add(b, 0, (-many.lightness[b] * p) * n, many)
        _add(b, SPIN, -p * row(R, k, TURN_B), many)
