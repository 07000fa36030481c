"""Share the load of a face evenly among its contacts, before an island is solved under error control.

Four or more contacts of one face determine only the resultant of their normal impulses: the sum and two moments. Where
the face slides and turns, friction depends on how they share the load, and so does the motion. As for one body at walls
(`event_driven.contact_forces`) the least Σ p_n² is taken. By Lagrange's condition p_n is then affine in the place
(a, b) on the face:

    p_n = y_0 + y_1 a + y_2 b,

Here the impulses to start from are replaced by the affine ones with the same resultant, a least-squares fit. Friction
is shared like the normal impulses. Newton's method changes p_n by ρ u_n, with one ρ for all contacts. The velocities
u_n of a face are those of a rigid motion, and affine. So the impulses stay affine, unless some contacts open.
"""

from __future__ import annotations

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.contact_set import put_vector
from physics.kernels.multibody.solver.contact_operator import apply_contact_impulse, max_contact_residual

# Contacts of two bodies are on one face if the cosine of the angle of their normals is at least this.
_SAME_NORMAL = 1.0 - 1.0e-12

# Contacts whose places have a smaller determinant of second moments, in units of their squared trace, are on a line.
_ON_A_LINE = 1.0e-6


@inlined
def _are_on_one_face(k, m, many):
    """True if contacts k and m are between the same bodies, or at the same wall, and have the same normal."""
    bodies, frame = many.contacts.bodies, many.contacts.frame
    if bodies[k, 0] != bodies[m, 0] or bodies[k, 1] != bodies[m, 1]:
        return False
    return qt.dot(row_vector(frame, k, 0), row_vector(frame, m, 0)) >= _SAME_NORMAL


@inlined
def _place(k, like, many):
    """Place (a, b) of contact k along the tangents of contact `like`, from the centre of mass of its first body [m]."""
    arm = row_vector(many.contacts.arm, k, 0)
    return qt.dot(row_vector(many.contacts.frame, like, 3), arm), qt.dot(row_vector(many.contacts.frame, like, 6), arm)


@kernel
def _affine_load(first, last, many):
    """Centre (a, b) of contacts on one face, and (y_0, y_1, y_2) of their normal impulses about it; whether there are.

    The contacts are `many.islands.contacts[first:last]`. There are none if the contacts are on a line.
    """
    like, count = many.islands.contacts[first], last - first
    ca = cb = mean = 0.0
    for i in range(first, last):
        k = many.islands.contacts[i]
        a, b = _place(k, like, many)
        ca, cb, mean = ca + a / count, cb + b / count, mean + many.contacts.impulse[k, 0] / count
    aa = ab = bb = pa = pb = 0.0
    for i in range(first, last):
        k = many.islands.contacts[i]
        a, b = _place(k, like, many)
        a, b, p = a - ca, b - cb, many.contacts.impulse[k, 0]
        aa, ab, bb, pa, pb = aa + a * a, ab + a * b, bb + b * b, pa + a * p, pb + b * p
    det = aa * bb - ab * ab
    if not det > _ON_A_LINE * (aa + bb) * (aa + bb):
        return (ca, cb), (mean, 0.0, 0.0), False
    return (ca, cb), (mean, (bb * pa - ab * pb) / det, (aa * pb - ab * pa) / det), True


@kernel
def _even_face(first, last, many):
    """Replace the impulses of contacts on one face by affine ones: `many.islands.contacts[first:last]`."""
    (ca, cb), (mean, ya, yb), is_spread = _affine_load(first, last, many)
    if not is_spread:
        return
    like = many.islands.contacts[first]
    for i in range(first, last):
        k = many.islands.contacts[i]
        a, b = _place(k, like, many)
        p = row_vector(many.contacts.impulse, k, 0)
        load = mean + ya * (a - ca) + yb * (b - cb)
        share = load / p[0] if p[0] > 0.0 and load > 0.0 else 0.0
        new = load, share * p[1], share * p[2]
        apply_contact_impulse(k, (new[0] - p[0], new[1] - p[1], new[2] - p[2]), many.bodies.twist, many)
        put_vector(many.contacts.impulse, k, 0, new)


def _as_they_are(part, friction, residual, many):
    return residual


@if_given("many.even", _as_they_are)
def even_loads(part, friction, residual, many):
    """Share the loads of the faces of an island evenly; return the residual of the new impulses [m/s].

    `part` and `friction` are as in `proximal_newton.newton_contacts`, `residual` is that of the impulses to start from.
    """
    first, end = part[0], part[1]
    has_face = False
    while first < end:
        last, k = first + 1, many.islands.contacts[first]
        while last < end and _are_on_one_face(k, many.islands.contacts[last], many):
            last += 1
        if last - first > 3:
            _even_face(first, last, many)
            has_face = True
        first = last
    return max_contact_residual(part[0], end, friction, many) if has_face else residual
