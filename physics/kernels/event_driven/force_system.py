"""Linear system for the forces of a contact mode: its independent rows, and its solution (`contact_forces`)."""

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

# A pivot of less than this share of the largest may be that of a row which says what others say.
_DOUBTFUL_PIVOT = 1.0e-7


@kernel
def _set_metric(m, P, body, unknowns):
    """Fill `matrix` with the products of the rows in their metric, and the right-hand side with 0."""
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
    """Mark rows that are no sums of others in `independent_row`, by their own metric; return their number.

    The largest entry of a positive semidefinite matrix is on the diagonal, so columns of pivots are rows, too.
    """
    _set_metric(m, P, body, unknowns)
    rank, _ = solve_full_pivot(m, unknowns.matrix, unknowns.independent_row, unknowns.value)
    return rank


@kernel
def _set_rows(rows, m, P, body, unknowns):
    """Fill `matrix` with the `rows` chosen equations of the m unknowns."""
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
    """Solve for the m unknowns that change the shares least; return total force and moment of the contacts.

    Rows of two contacts may be dependent. If each contact pushes along its row, the matrix shows it: a row whose
    independent part is the share e gives a pivot of e². If one slides, its friction pushes elsewhere, and the pivot is
    of the order e. A row that differs from a sum of others by rounding would then still be solved, by forces that stop
    a body although no contact holds it. So where a pivot is small the rows are chosen by their own metric.
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
    """Forces of the contact mode at y: (total force, total moment, ω, dω/dt without contact, principal axes)."""
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
