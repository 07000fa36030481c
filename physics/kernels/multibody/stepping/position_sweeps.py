"""Displacements that push bodies apart: sweeps along the normals over contacts that overlap.

Most contacts of a set never move: they begin as they are asked to be, and no body of theirs is pushed. So a contact is
assembled where it is visited first, and once no sweep comes to a new body only the contacts of bodies that were pushed
are gone through.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.multibody.solver.block_lu import ANGULAR_OFFSET
from physics.kernels.multibody.solver.gauss_seidel import is_contact_up_to_date, relax_normal_impulse
from physics.kernels.multibody.solver.normal_rows import assemble_normal_row, body_twist_from_motion, put_padded

# Share of the error allowed within which a contact is left as it is: each that is answered leaves those of two bodies
# to be visited again.
_SKIP_SHARE = 0.5

# W_nn of a contact that is not assembled yet: that of any other is positive.
_NOT_ASSEMBLED = 0.0


@inlined
def _clear_displacements(n, many):
    """Clear displacements, and flag only contacts with a target above 0 for a visit."""
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
    """Sweep once over `many.islands.contacts[:count]`: (largest error of an impulse, visits so far, whether it spread).

    It has spread if it pushed a body that had not been pushed before.
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
    """List the contacts of bodies that were pushed; return their number."""
    count = 0
    for k in range(n):
        b = many.contacts.bodies[k, 1]
        if many.sweeps.pushed[many.contacts.bodies[k, 0]] > 0 or (b >= 0 and many.sweeps.pushed[b] > 0):
            many.islands.contacts[count] = k
            count += 1
    return count


@kernel
def sweep_positions(n, goal, limit, many):
    """Displacements `many.bodies.twist` that bring the n contacts to their targets within `goal` [m]; counts sweeps.

    `many.sweeps.pushed` is 0 for bodies that stay where they are.
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
