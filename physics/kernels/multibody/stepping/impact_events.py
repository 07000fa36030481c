"""Log impacts as events: one for each pair of bodies, or body and wall, with an impulse between them."""

from __future__ import annotations

from physics.compiler.decorators import kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.contact_set import add_scaled, row_matrix
from physics.kernels.multibody.data.fixed_bodies import body_at
from physics.kernels.state.layout import POS
from physics.kernels.time_stepping import event_log as ev


@kernel
def log_impacts(n, world, t, many, log, counts):
    """Log the impulses of the n contacts of an impact as events, at t [s] after the start of the call.

    Contacts of one pair follow each other in the set (`dispatch.find_contacts`) and make one event. Its impulse is the
    sum of those on the first body of the pair, at points of that body. The event belongs to the first body. `world` is
    the index of the world; `log` and `counts` are those of `state.groups.Records`.
    """
    first_row, largest = world * many.bodies.state.shape[0], 0.0
    for k in range(n):
        largest = max(largest, many.contacts.impulse[k, 0])
    impulse, sums = (0.0, 0.0, 0.0), ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0)
    for k in range(n):
        a, b = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1]
        p = qt.transposed_matvec(row_matrix(many.contacts.frame, k), row_vector(many.contacts.impulse, k, 0))
        point = add_scaled(row_vector(many.bodies.state, a, POS), 1.0, row_vector(many.contacts.arm, k, 0))
        impulse = add_scaled(impulse, 1.0, p)
        sums = ev.add_weighted_contact(sums, row_vector(many.contacts.frame, k, 0), many.contacts.impulse[k, 0], point)
        if k + 1 < n and many.contacts.bodies[k + 1, 0] == a and many.contacts.bodies[k + 1, 1] == b:
            continue
        if sums[2] > ev.EVENT_IMPULSE_ROUNDING * largest:
            other = body_at(b, many)
            wall, other = (-1 - b, ev.NOBODY) if other < 0 else (-1, other)
            ev.note_impact(log, counts, first_row + a, t, wall, other, impulse, sums)
        impulse, sums = (0.0, 0.0, 0.0), ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0)
