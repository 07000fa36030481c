"""Solve a contact problem, and change the bodies' momenta by its impulses."""

from __future__ import annotations

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.contact_set import (
    PARTED,
    UNBALANCED,
    add_scaled,
    put_vector,
    row_matrix,
    subtract,
)
from physics.kernels.multibody.data.driven_bodies import aim_at_driven_ends, aim_at_relative_velocities
from physics.kernels.multibody.solver.contact_operator import apply_body_inv_inertia
from physics.kernels.multibody.solver.resistance_torques import (
    apply_resistance,
    drop_resistance,
    solve_with_resistance,
)
from physics.kernels.multibody.solver.solve import solve_all_frictionless
from physics.kernels.state import layout as at
from physics.kernels.state.body import report_solve


@inlined
def leave_moments(n, many):
    """Let the n contacts keep the moments that `_balance_moments` would take, after a solve that has added energy."""
    for k in range(n):
        if many.contacts.owner[k] == PARTED:
            many.contacts.owner[k] = UNBALANCED


@inlined
def apply_impulses(n, many):
    """Apply the impulses of the n contacts to the bodies' states: velocities and angular momenta.

    Velocities are copied from the solved twists; angular momenta L become L + Σ r x p.
    """
    for k in range(n):
        p = qt.transposed_matvec(row_matrix(many.contacts.frame, k), row_vector(many.contacts.impulse, k, 0))
        a, b = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1]
        put_vector(
            many.bodies.state,
            a,
            at.ANGMOM,
            add_scaled(
                row_vector(many.bodies.state, a, at.ANGMOM), 1.0, qt.cross(row_vector(many.contacts.arm, k, 0), p)
            ),
        )
        put_vector(many.bodies.state, a, at.LINVEL, row_vector(many.bodies.twist, a, 0))
        if b >= 0:
            put_vector(
                many.bodies.state,
                b,
                at.ANGMOM,
                add_scaled(
                    row_vector(many.bodies.state, b, at.ANGMOM), -1.0, qt.cross(row_vector(many.contacts.arm, k, 3), p)
                ),
            )
            put_vector(many.bodies.state, b, at.LINVEL, row_vector(many.bodies.twist, b, 0))
            if many.contacts.owner[k] == PARTED:
                _balance_moments(k, a, b, p, many)


@kernel
def _balance_moments(k, a, b, p, many):
    """Correct the angular momenta of bodies a and b for a contact k whose points on them differ.

    The impulse p at one point and -p at the other have a moment together, which would change the total angular
    momentum. Both bodies take up a part of it, in proportion to their m r² (mass, bounding radius). At contacts that
    are not `PARTED` both points coincide. Twists change with them, so that checks of energy see the change.
    """
    x = add_scaled(row_vector(many.bodies.state, a, at.POS), 1.0, row_vector(many.contacts.arm, k, 0))
    y = add_scaled(row_vector(many.bodies.state, b, at.POS), 1.0, row_vector(many.contacts.arm, k, 3))
    moment = qt.cross(subtract(x, y), p)
    one = many.bodies.body[a].radius ** 2 / many.bodies.inv_mass[a]
    share = one / (one + many.bodies.body[b].radius ** 2 / many.bodies.inv_mass[b])
    for body, part in ((a, share), (b, 1.0 - share)):
        L = row_vector(many.bodies.state, body, at.ANGMOM)
        put_vector(many.bodies.state, body, at.ANGMOM, add_scaled(L, -part, moment))
        w = add_scaled(row_vector(many.bodies.twist, body, 3), -part, apply_body_inv_inertia(body, moment, many))
        put_vector(many.bodies.twist, body, 3, w)


@kernel
def solve_and_apply(n, world, friction, report, many):
    """Solve the contact problem of the n contacts, apply its impulses to the bodies, and add it to the report.

    `world` is the index of the world; `friction` is None if the scene has no friction.
    """
    aim_at_driven_ends(n, many)
    iterations, residual, method = solve_with_resistance(n, friction, many)
    aim_at_relative_velocities(n, many)
    apply_impulses(n, many)
    apply_resistance(n, many)
    report_solve(report, world, residual, iterations, method, many.settings[0].tolerance)


@kernel
def solve_frictionless_and_apply(n, many):
    """Solve the n contacts without friction and apply the impulses, after a solve with friction has failed.

    The report counts the failed solve already.
    """
    drop_resistance(n, many)
    aim_at_driven_ends(n, many)
    solve_all_frictionless(n, many)
    aim_at_relative_velocities(n, many)
    apply_impulses(n, many)
