"""The unknown forces of a regime: the linear system of `contact_forces`, which rows of it count, and its solution."""

from __future__ import annotations

from physics.kernels.compile.decorators import kernel
from physics.kernels.event_driven.contact_forces import (
    free_turning,
    list_unknowns,
    place,
    plus,
    times,
    turned_by,
    vector,
)
from physics.kernels.event_driven.slip_onset import turn_to_slip
from physics.kernels.math import quaternion as qt
from physics.kernels.math.full_pivot_solve import eliminate, solve_least

# A pivot of less than this share of the largest may be that of a row which says what others say.
DOUBTFUL = 1.0e-7


@kernel
def _set_metric(m, P, work, motion):
    """`matrix`: what the rows would have to do with each other if all pushed along themselves; right-hand side 0."""
    inv_mass, J, A = 1.0 / work.mass, work.J, motion.matrix
    for k in range(m):
        F, g = vector(motion.row, k), turned_by(P, J, vector(motion.row_turn, k))
        for l in range(m):
            A[l, k] = inv_mass * qt.dot(vector(motion.row, l), F) + qt.dot(vector(motion.row_turn, l), g)
        A[k, m] = 0.0


@kernel
def _choose_rows(m, P, work, motion):
    """`chosen`: the rows that are no sums of others, by their own metric; their number.

    Of a symmetric matrix without negative directions the largest entry is on the diagonal: columns of pivots are rows.
    """
    _set_metric(m, P, work, motion)
    rank, _ = eliminate(m, motion.matrix, motion.chosen, motion.unknown)
    return rank


@kernel
def _set_rows(rows, m, P, work, motion):
    """`matrix`: the `rows` chosen equations of the m unknowns."""
    inv_mass, J, A = 1.0 / work.mass, work.J, motion.matrix
    F, g = vector(motion.known, 0), turned_by(P, J, vector(motion.known, 1))
    for i in range(rows):
        l = motion.chosen[i]
        A[i, m] = motion.asked[l]
        A[i, m] -= inv_mass * qt.dot(vector(motion.row, l), F) + qt.dot(vector(motion.row_turn, l), g)
    for k in range(m):
        F, g = vector(motion.push, k), turned_by(P, J, vector(motion.turn, k))
        for i in range(rows):
            l = motion.chosen[i]
            A[i, k] = inv_mass * qt.dot(vector(motion.row, l), F) + qt.dot(vector(motion.row_turn, l), g)


@kernel
def solve_unknowns(m, P, work, motion):
    """Solve for the m unknowns, those that add least to the shares; total force and moment of the contacts.

    Contacts can say the same of the body's motion twice. Where each pushes along its row the matrix shows it: what a
    row has beyond the others, a share e of it, gives a pivot of e². Where one slides, its friction pushes elsewhere,
    the pivot is of the order e, and a row that differs by rounding from a sum of others would still be met, by forces
    that stop a body which no contact holds. So where a pivot is small the rows are chosen by their own metric.
    """
    for k in range(m):
        motion.chosen[k] = k
    _set_rows(m, m, P, work, motion)
    rank, least = eliminate(m, motion.matrix, motion.order, motion.unknown)
    if rank < m or (motion.is_skew and least < DOUBTFUL):
        rows = _choose_rows(m, P, work, motion)
        _set_rows(rows, m, P, work, motion)
        if rows < m:
            solve_least(rows, m, motion.matrix, motion.unknown)
        else:
            eliminate(m, motion.matrix, motion.order, motion.unknown)
    force, moment = vector(motion.known, 0), vector(motion.known, 1)
    for k in range(m):
        s = motion.unknown[k]
        force = plus(force, times(s, vector(motion.push, k)))
        moment = plus(moment, times(s, vector(motion.turn, k)))
    return force, moment


@kernel
def regime_forces(y, tilted, work, motion):
    """Forces of the regime at y: (total force, total moment, ω, dω/dt without contact, principal axes)."""
    R, P, w, alpha = free_turning(y, tilted, work)
    zero = (0.0, 0.0, 0.0)
    if motion.count == 0:
        return zero, zero, w, alpha, P
    place(y, R, w, alpha, tilted, work, motion)
    turn_to_slip(P, work, motion)
    m = list_unknowns(work.mu, True, work, motion)
    force, moment = solve_unknowns(m, P, work, motion)
    return force, moment, w, alpha, P
