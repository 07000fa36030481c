"""Unit quaternions (w, x, y, z), body to world, as tuples of scalars.

A tuple costs a compiled kernel nothing, a small array costs an allocation:
every function here takes scalars or tuples and returns a tuple.

Source: Witkin and Baraff, *Physically Based Modeling* (SIGGRAPH course notes),
"Rigid Body Dynamics", section 4, for the kinematics q' = 1/2 w q (w in the
world frame) = 1/2 q w (w in the body frame).
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined


@inlined
def multiply(a, b):
    """Hamilton product ab: first rotate by b, then by a."""
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


@inlined
def conjugate(q):
    """The inverse rotation of a unit quaternion."""
    return (q[0], -q[1], -q[2], -q[3])


@inlined
def normalise(q):
    """q / |q|."""
    s = 1.0 / math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return (q[0] * s, q[1] * s, q[2] * s, q[3] * s)


@inlined
def renormalise(q):
    """q / |q| for a quaternion whose length is 1 up to rounding.

    One Newton step for 1/√x from 1: its error, 3/8 (x - 1)², vanishes below rounding for |x - 1| < 1e-8.
    """
    s = 1.5 - 0.5 * ((q[0] * q[0] + q[1] * q[1]) + (q[2] * q[2] + q[3] * q[3]))
    return (q[0] * s, q[1] * s, q[2] * s, q[3] * s)


@inlined
def to_matrix(q):
    """Rotation matrix R(q), body to world, as nine scalars row by row."""
    w, x, y, z = q
    x2, y2, z2 = x + x, y + y, z + z
    xx, yy, zz = x * x2, y * y2, z * z2
    xy, xz, yz = x * y2, x * z2, y * z2
    wx, wy, wz = w * x2, w * y2, w * z2
    return (
        1.0 - (yy + zz), xy - wz, xz + wy,
        xy + wz, 1.0 - (xx + zz), yz - wx,
        xz - wy, yz + wx, 1.0 - (xx + yy),
    )  # fmt: skip


@inlined
def matvec(R, a):
    """R a for a matrix of nine scalars: body to world."""
    return (
        R[0] * a[0] + R[1] * a[1] + R[2] * a[2],
        R[3] * a[0] + R[4] * a[1] + R[5] * a[2],
        R[6] * a[0] + R[7] * a[1] + R[8] * a[2],
    )


@inlined
def transposed_matvec(R, a):
    """Rᵀ a for a matrix of nine scalars: world to body."""
    return (
        R[0] * a[0] + R[3] * a[1] + R[6] * a[2],
        R[1] * a[0] + R[4] * a[1] + R[7] * a[2],
        R[2] * a[0] + R[5] * a[1] + R[8] * a[2],
    )


@inlined
def symmetric_matvec(A, a):
    """A a for a symmetric matrix, its upper triangle row by row."""
    return (
        A[0] * a[0] + A[1] * a[1] + A[2] * a[2],
        A[1] * a[0] + A[3] * a[1] + A[4] * a[2],
        A[2] * a[0] + A[4] * a[1] + A[5] * a[2],
    )


@inlined
def cross(a, b):
    """a x b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@inlined
def dot(a, b):
    """a · b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def rotate(q, a):
    """Body vector a in the world frame."""
    return matvec(to_matrix(q), a)


@inlined
def exp_map(rotation):
    """Quaternion of the rotation vector `free_rotation` [rad], exp(rotation / 2).

    sin(x)/x is taken from its series where the quotient would lose digits:
    at x = 1e-4 the first neglected term x⁴/120 is 8e-19, below rounding.
    """
    square = 0.25 * (rotation[0] * rotation[0] + rotation[1] * rotation[1] + rotation[2] * rotation[2])
    half = math.sqrt(square)
    if half < 1e-4:
        sinc = 1.0 - square / 6.0
    else:
        sinc = math.sin(half) / half
    s = 0.5 * sinc
    return (math.cos(half), s * rotation[0], s * rotation[1], s * rotation[2])


@inlined
def lerp(a, b, s):
    """a + s (b - a) of vectors."""
    return (a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]), a[2] + s * (b[2] - a[2]))
