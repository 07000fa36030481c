"""Contacts as sweeps visit them: all that a visit reads stands in one row, in the order of the visits.

A visit of one contact asks for some forty numbers and changes two bodies. For the frame E, the arms r, s from the
bodies a, b, and impulses p in the frame,

    u = E (v_a + ω_a x r - v_b - ω_b x s),

and v_a changes by f/m_a with f = Eᵀ p, ω_a by I_a⁻¹ (r x f), those of b by as much the other way.
"""

from __future__ import annotations

from physics.kernels.compile.decorators import inlined
from physics.kernels.math import quaternion as qt
from physics.kernels.multibody.data.contact_set import matrix, minus, plus, put, vector
from physics.kernels.multibody.solver.block_lu import SPIN
from physics.kernels.multibody.solver.contact_operator import turned

# Columns of `many.visit`: frame, arms of both bodies, block and its inverse (00, 01, 02, 11, 12, 22), target, μ,
# λ_max of its tangential part, impulse.
ARM_A, ARM_B, BLOCK, INVERSE, TARGET, MU, STIFF, IMPULSE = 9, 12, 15, 21, 27, 30, 31, 32

# First number of an inverse that has not been needed yet: that of any block is positive.
UNKNOWN = 0.0


@inlined
def _write(i, k, many):
    """Write contact k as visit i."""
    R, B = many.visit, many.block
    for c in range(9):
        R[i, c] = many.frame[k, c]
    for c in range(6):
        R[i, ARM_A + c] = many.arm[k, c]
    R[i, BLOCK], R[i, BLOCK + 1], R[i, BLOCK + 2] = B[k, 0], B[k, 1], B[k, 2]
    R[i, BLOCK + 3], R[i, BLOCK + 4], R[i, BLOCK + 5] = B[k, 4], B[k, 5], B[k, 8]
    R[i, INVERSE] = UNKNOWN
    put(R, i, TARGET, vector(many.target, k, 0))
    R[i, MU], R[i, STIFF] = many.mu[k], 1.0 / many.step[k]
    put(R, i, IMPULSE, vector(many.impulse, k, 0))
    many.side[i, 0], many.side[i, 1] = many.ends[k, 0], many.ends[k, 1]


@inlined
def line_up(first, last, many):
    """Write the contacts `many.queue[first:last]` as visits 0, 1, 2 ..."""
    for i in range(first, last):
        _write(i - first, many.queue[i], many)


@inlined
def take_back(first, last, many):
    """Impulses of the contacts `many.queue[first:last]` from their visits."""
    for i in range(first, last):
        put(many.impulse, many.queue[i], 0, vector(many.visit, i - first, IMPULSE))


@inlined
def six(i, first, many):
    """Six numbers of visit i: a symmetric matrix."""
    R = many.visit
    return (R[i, first], R[i, first + 1], R[i, first + 2], R[i, first + 3], R[i, first + 4], R[i, first + 5])


@inlined
def put_inverse(i, W, many):
    """Write the inverse of the contact's own block W (upper triangle)."""
    x, y, z = W[3] * W[5] - W[4] * W[4], W[2] * W[4] - W[1] * W[5], W[1] * W[4] - W[2] * W[3]
    s = 1.0 / (W[0] * x + W[1] * y + W[2] * z)
    put(many.visit, i, INVERSE, (s * x, s * y, s * z))
    rest = (s * (W[0] * W[5] - W[2] * W[2]), s * (W[1] * W[2] - W[0] * W[4]), s * (W[0] * W[3] - W[1] * W[1]))
    put(many.visit, i, INVERSE + 3, rest)


@inlined
def velocity(i, many):
    """u of visit i less its target."""
    t, a, b = many.motion, many.side[i, 0], many.side[i, 1]
    v = plus(vector(t, a, 0), 1.0, qt.cross(vector(t, a, SPIN), vector(many.visit, i, ARM_A)))
    if b >= 0:
        v = minus(v, plus(vector(t, b, 0), 1.0, qt.cross(vector(t, b, SPIN), vector(many.visit, i, ARM_B))))
    return minus(qt.matvec(matrix(many.visit, i), v), vector(many.visit, i, TARGET))


@inlined
def _move(b, s, f, arm, many):
    """Change the motion of body b by an impulse s f (world frame) at `arm`."""
    t = many.motion
    put(t, b, 0, plus(vector(t, b, 0), s * many.lightness[b], f))
    put(t, b, SPIN, plus(vector(t, b, SPIN), s, turned(b, qt.cross(arm, f), many)))


@inlined
def push(i, p, many):
    """Change the motion of both bodies of visit i by an impulse p, given in the contact's frame [N s]."""
    f = qt.transposed_matvec(matrix(many.visit, i), p)
    _move(many.side[i, 0], 1.0, f, vector(many.visit, i, ARM_A), many)
    if many.side[i, 1] >= 0:
        _move(many.side[i, 1], -1.0, f, vector(many.visit, i, ARM_B), many)
