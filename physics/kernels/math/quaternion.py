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
    """Hamilton product ab of two quaternions: the rotation by b, followed by the rotation by a."""
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


@inlined
def conjugate(q):
    """Conjugate of a unit quaternion: the inverse rotation."""
    return (q[0], -q[1], -q[2], -q[3])


@inlined
def normalise(q):
    """Scale a quaternion to unit length: q / |q|."""
    s = 1.0 / math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return (q[0] * s, q[1] * s, q[2] * s, q[3] * s)


@inlined
def renormalise(q):
    """Scale a quaternion, whose length is 1 up to rounding, to unit length: q / |q| without a square root.

    With x = |q|², 1/√x is found by one Newton step from 1. Its error, 3/8 (x - 1)², is below rounding for
    |x - 1| < 1e-8.
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
    """Product R a of a matrix, nine scalars row by row, and a vector; of a rotation matrix: body to world."""
    return (
        R[0] * a[0] + R[1] * a[1] + R[2] * a[2],
        R[3] * a[0] + R[4] * a[1] + R[5] * a[2],
        R[6] * a[0] + R[7] * a[1] + R[8] * a[2],
    )


@inlined
def transposed_matvec(R, a):
    """Product Rᵀ a of a transposed matrix, R as nine scalars row by row; of a rotation matrix: world to body."""
    return (
        R[0] * a[0] + R[3] * a[1] + R[6] * a[2],
        R[1] * a[0] + R[4] * a[1] + R[7] * a[2],
        R[2] * a[0] + R[5] * a[1] + R[8] * a[2],
    )


@inlined
def symmetric_matvec(A, a):
    """Product A a of a symmetric 3 x 3 matrix and a vector; A is its upper triangle, six scalars row by row."""
    return (
        A[0] * a[0] + A[1] * a[1] + A[2] * a[2],
        A[1] * a[0] + A[3] * a[1] + A[4] * a[2],
        A[2] * a[0] + A[4] * a[1] + A[5] * a[2],
    )


@inlined
def cross(a, b):
    """Cross product a x b of two vectors."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@inlined
def dot(a, b):
    """Dot product a · b of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def rotate(q, a):
    """Turn the body vector a into a world vector, by the attitude q of the body."""
    return matvec(to_matrix(q), a)


@inlined
def exp_map(rotation):
    """Quaternion exp(rotation / 2) of a rotation vector: its direction is the axis, its length the angle [rad].

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
    """Interpolate linearly between the vectors a and b: a + s (b - a)."""
    return (a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]), a[2] + s * (b[2] - a[2]))
