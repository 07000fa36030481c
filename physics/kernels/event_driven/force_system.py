"""Solve the linear system for the forces of a contact mode (`contact_forces`), whose rows may be dependent."""

from __future__ import annotations

from physics.compiler.decorators import kernel
from physics.kernels.event_driven.contact_forces import (
    apply_inverse_inertia,
    assemble_unknowns,
    free_angular_motion,
    set_contact_kinematics,
)
from physics.kernels.event_driven.slip_onset import set_slip_onset_direction
from physics.kernels.math import quaternion as qt
from physics.kernels.math.full_pivot_solve import solve_full_pivot, solve_least_norm
from physics.kernels.math.vector import plus, row_vector, times

# A pivot below this share of the largest one may be that of a row that depends linearly on others.
_DOUBTFUL_PIVOT = 1.0e-7


@kernel
def _set_metric(m, P, body, unknowns):
    """Fill `unknowns.matrix` with products of the m constraint rows in the kinetic metric; the right-hand side is 0.

    P is the rotation matrix of the principal axes.
    """
    inv_mass, J, A = 1.0 / body.mass, body.J, unknowns.matrix
    for k in range(m):
        F, g = row_vector(unknowns.row, k, 0), apply_inverse_inertia(P, J, row_vector(unknowns.row_moment, k, 0))
        for l in range(m):
            A[l, k] = inv_mass * qt.dot(row_vector(unknowns.row, l, 0), F) + qt.dot(
                row_vector(unknowns.row_moment, l, 0), g
            )
        A[k, m] = 0.0


@kernel
def _choose_rows(m, P, body, unknowns):
    """Choose linearly independent rows among the m constraint rows; return their number.

    Their indices come first in `unknowns.independent_row`. The matrix of products of rows is positive semidefinite, so
    its largest entry is on the diagonal, and the columns of the pivots are indices of rows, too.
    """
    _set_metric(m, P, body, unknowns)
    rank, _ = solve_full_pivot(m, unknowns.matrix, unknowns.independent_row, unknowns.value)
    return rank


@kernel
def _set_rows(rows, m, P, body, unknowns):
    """Write equations in m unknowns to `unknowns.matrix`: those at the first `rows` indices in `independent_row`."""
    inv_mass, J, A = 1.0 / body.mass, body.J, unknowns.matrix
    F, g = row_vector(unknowns.given_wrench, 0, 0), apply_inverse_inertia(P, J, row_vector(unknowns.given_wrench, 1, 0))
    for i in range(rows):
        l = unknowns.independent_row[i]
        A[i, m] = unknowns.rhs[l]
        row, moment = row_vector(unknowns.row, l, 0), row_vector(unknowns.row_moment, l, 0)
        A[i, m] -= inv_mass * qt.dot(row, F) + qt.dot(moment, g)
    for k in range(m):
        F, g = (
            row_vector(unknowns.column_force, k, 0),
            apply_inverse_inertia(P, J, row_vector(unknowns.column_moment, k, 0)),
        )
        for i in range(rows):
            l = unknowns.independent_row[i]
            A[i, k] = inv_mass * qt.dot(row_vector(unknowns.row, l, 0), F) + qt.dot(
                row_vector(unknowns.row_moment, l, 0), g
            )


@kernel
def solve_contact_forces(m, P, body, unknowns):
    """Solve for the m unknowns, which change the given forces least; return the contacts' total force and moment.

    Rows of several contacts may be linearly dependent. If each contact pushes along its row, the pivots show it: a row
    whose independent part is the share e gives a pivot of the order e². If a contact slides, its force has another
    direction than its row, and the pivot is of the order e. A row that differs from a sum of others by rounding only
    would then be solved, by forces that stop a body although no contact holds it. So if a pivot is small, independent
    rows are chosen by `_choose_rows`, and the solution of least norm is taken.
    """
    for k in range(m):
        unknowns.independent_row[k] = k
    _set_rows(m, m, P, body, unknowns)
    rank, least = solve_full_pivot(m, unknowns.matrix, unknowns.order, unknowns.value)
    if rank < m or (unknowns.is_skew and least < _DOUBTFUL_PIVOT):
        rows = _choose_rows(m, P, body, unknowns)
        _set_rows(rows, m, P, body, unknowns)
        if rows < m:
            solve_least_norm(rows, m, unknowns.matrix, unknowns.value)
        else:
            solve_full_pivot(m, unknowns.matrix, unknowns.order, unknowns.value)
    force, moment = row_vector(unknowns.given_wrench, 0, 0), row_vector(unknowns.given_wrench, 1, 0)
    for k in range(m):
        s = unknowns.value[k]
        force = plus(force, times(s, row_vector(unknowns.column_force, k, 0)))
        moment = plus(moment, times(s, row_vector(unknowns.column_moment, k, 0)))
    return force, moment


@kernel
def solve_mode_forces(y, offset_frame, scratch, motion):
    """Solve the contact forces of the contact mode in the state y.

    Returns (total force [N], total moment about the centre of mass [N m], ω, dω/dt without contact, matrix of the
    principal axes).
    """
    body = scratch.body
    R, P, w, alpha = free_angular_motion(y, offset_frame, body)
    zero = (0.0, 0.0, 0.0)
    if motion.contacts.count == 0:
        return zero, zero, w, alpha, P
    set_contact_kinematics(y, R, w, alpha, offset_frame, scratch, motion)
    set_slip_onset_direction(P, scratch, motion.contacts)
    m = assemble_unknowns(body.mu, True, scratch, motion)
    force, moment = solve_contact_forces(m, P, body, motion.unknowns)
    return force, moment, w, alpha, P
