"""Rows of the Jacobian of a contact, and of M⁻¹ times it, for sweeps: what a visit needs is read as `lanes`.

For the rows e_i of a contact's frame and the arms r, s from its bodies

    u_i = e_i·(v_a - v_b) + (r x e_i)·ω_a - (s x e_i)·ω_b,

and an impulse p changes v_a by Σ p_i e_i/m_a and ω_a by Σ p_i I_a⁻¹ (r x e_i), those of b by as much the other way.
`many.rows` has e, r x e, I_a⁻¹ (r x e), s x e and I_b⁻¹ (s x e), three each; `many.motion` has the twists meanwhile. A
vector is three numbers and one that is zero: a sum over four lanes is that over three. The zero is written each time,
since what is not a number in one world would stay there for all that come after it.
"""

from __future__ import annotations

from physics.kernels.compiler import inlined
from physics.kernels.lanes import Lanes, put_row, row, total, totals
from physics.kernels.many.blocks import SPIN
from physics.kernels.many.contacts import put, vector

# Where the vectors of a kind begin: frame, moments of a, their turning, those of b.
AXIS, MOMENT_A, TURN_A, MOMENT_B, TURN_B = range(0, 60, 12)


@inlined
def put_padded(array, i, j, a):
    """Write a vector and its zero."""
    put_row(array, i, j, Lanes(a[0], a[1], a[2], 0.0))


@inlined
def put_rows(k, first, x, y, z, many):
    """Write three vectors of a kind."""
    put_padded(many.rows, k, first, x)
    put_padded(many.rows, k, first + 4, y)
    put_padded(many.rows, k, first + 8, z)


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
def _along(k, i, v, a, b, many):
    """What is summed for u_i, for the difference v of the velocities."""
    R, t = many.rows, many.motion
    x = row(R, k, AXIS + i) * v + row(R, k, MOMENT_A + i) * row(t, a, SPIN)
    if b >= 0:
        x = x - row(R, k, MOMENT_B + i) * row(t, b, SPIN)
    return x


@inlined
def _difference(a, b, many):
    """v_a - v_b."""
    v = row(many.motion, a, 0)
    if b >= 0:
        v = v - row(many.motion, b, 0)
    return v


@inlined
def normal_velocity(k, many):
    """u_n of contact k."""
    a, b = many.ends[k, 0], many.ends[k, 1]
    return total(_along(k, 0, _difference(a, b, many), a, b, many))


@inlined
def velocity(k, many):
    """u of contact k."""
    a, b = many.ends[k, 0], many.ends[k, 1]
    v = _difference(a, b, many)
    u = totals(
        _along(k, 0, v, a, b, many), _along(k, 4, v, a, b, many), _along(k, 8, v, a, b, many),
        Lanes(0.0, 0.0, 0.0, 0.0),
    )  # fmt: skip
    return (u[0], u[1], u[2])


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


@inlined
def _combined(k, first, p, many):
    """Σ p_i times the vectors of a kind."""
    R = many.rows
    return p[0] * row(R, k, first) + p[1] * row(R, k, first + 4) + p[2] * row(R, k, first + 8)


@inlined
def push_rows(k, p, many):
    """Change the motion of both bodies by an impulse p of contact k, given in its frame [N s]."""
    a, b = many.ends[k, 0], many.ends[k, 1]
    f = _combined(k, AXIS, p, many)
    _add(a, 0, many.lightness[a] * f, many)
    _add(a, SPIN, _combined(k, TURN_A, p, many), many)
    if b >= 0:
        _add(b, 0, -many.lightness[b] * f, many)
        _add(b, SPIN, -_combined(k, TURN_B, p, many), many)
