"""Displacements that push bodies apart: sweeps along the contact normals over contacts that overlap.

Most contacts of a set have no target displacement above 0, and their bodies are never pushed. So the row of a contact
is assembled at its first visit. After a sweep that pushes no new body, only contacts of pushed bodies are visited.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.multibody.solver.block_lu import ANGULAR_OFFSET
from physics.kernels.multibody.solver.gauss_seidel import is_contact_up_to_date, relax_normal_impulse
from physics.kernels.multibody.solver.normal_rows import assemble_normal_row, body_twist_from_motion, put_padded

# Share of the goal within which a contact is left as it is: every correction makes the contacts of two bodies due for
# another visit.
_SKIP_SHARE = 0.5

# W_nn of a contact whose row is not assembled yet; that of any other contact is positive.
_NOT_ASSEMBLED = 0.0


@inlined
def _clear_displacements(n, many):
    """Clear the displacements; flag those of the n contacts whose target is above 0, so that they are visited."""
    for b in range(many.bodies.state.shape[0]):
        many.sweeps.pushed[b] = 0
        put_padded(many.sweeps.motion, b, 0, (0.0, 0.0, 0.0))
        put_padded(many.sweeps.motion, b, ANGULAR_OFFSET, (0.0, 0.0, 0.0))
    for k in range(n):
        many.islands.contacts[k] = k
        many.contacts.impulse[k, 0] = 0.0
        many.contacts.block[k, 0] = _NOT_ASSEMBLED
        many.sweeps.visited[k] = -1 if many.contacts.target[k, 0] > 0.0 else 0


@inlined
def _sweep(count, is_up, visits, goal, many):
    """Sweep once over `many.islands.contacts[:count]`: (largest error [m], visits so far, whether it has spread).

    The sweep goes up the list if `is_up`, else down. It has spread if it pushed a body that had not been pushed before.
    `goal` [m] is the error below which a contact is done; `visits` is the number of earlier visits.
    """
    worst, has_spread = 0.0, False
    for i in range(count):
        k = many.islands.contacts[i if is_up else count - 1 - i]
        if is_contact_up_to_date(k, many):
            continue
        if many.contacts.block[k, 0] == _NOT_ASSEMBLED:
            assemble_normal_row(k, many)
        visits += 1
        a, b = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1]
        is_new = many.sweeps.pushed[a] == 0 or (b >= 0 and many.sweeps.pushed[b] == 0)
        off = relax_normal_impulse(k, visits, _SKIP_SHARE * goal, many)
        worst = max(worst, off)
        has_spread = has_spread or (is_new and many.sweeps.pushed[a] == visits)
    return worst, visits, has_spread


@inlined
def _list_all(n, many):
    for k in range(n):
        many.islands.contacts[k] = k
    return n


@inlined
def _list_pushed(n, many):
    """List the contacts of pushed bodies, of the n in the set, in `many.islands.contacts`; return their number."""
    count = 0
    for k in range(n):
        b = many.contacts.bodies[k, 1]
        if many.sweeps.pushed[many.contacts.bodies[k, 0]] > 0 or (b >= 0 and many.sweeps.pushed[b] > 0):
            many.islands.contacts[count] = k
            count += 1
    return count


@kernel
def sweep_positions(n, goal, limit, many):
    """Find displacements that bring the n contacts to their targets within `goal` [m]; return the number of sweeps.

    The displacements (translation and rotation) are written to `many.bodies.twist`. `many.sweeps.pushed` is 0 for
    bodies that stay where they are. There are at most `limit` sweeps.
    """
    _clear_displacements(n, many)
    sweeps, visits, count, worst = 0, 0, n, math.inf
    while worst > goal and sweeps < limit:
        worst, visits, has_spread = _sweep(count, sweeps % 2 == 0, visits, goal, many)
        sweeps += 1
        if has_spread and count < n:
            count = _list_all(n, many)
        elif not has_spread and count == n:
            count = _list_pushed(n, many)
    for b in range(many.bodies.state.shape[0]):
        body_twist_from_motion(b, many)
    return sweeps
