"""Contacts that bounce in an impact, and tangential restitution of those.

With tangential restitution the point of contact of a sphere leaves an impact with -e_t times its tangential velocity,
as far as the cone of friction allows (`time_stepping.tangential_restitution` has the sources). It is a target along the
contact plane. All bodies that move are spheres there, so that motions along and across the plane are independent, and
the only contact of two bodies creates no energy. Where a body bounces at several contacts at once, friction alone acts
along them.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined
from physics.kernels.math import quaternion as qt
from physics.kernels.multibody.data.contact_set import (
    PARTED,
    pair_slop,
    relative_acceleration_bound,
    row_matrix,
    slip_velocity,
)
from physics.kernels.state.contact_law_dispatch import LAW_TANGENTIAL, if_law
from physics.kernels.time_stepping.tangential_restitution import tangential_restitution

# Depth, in slops, that a body may go in until the resting stage stops it at its middle. This saves the contact problem
# of an impact.
_SOFT_LANDING_SLOPS = 100.0


@inlined
def _rest_speed(k, many):
    """Speed that loads give contact k within `rest_share` of the substep [m/s].

    The whole substep counts, even if little of it is left after another impact; else such impacts would make resting
    bodies bounce.
    """
    return many.settings[0].rest_share * relative_acceleration_bound(k, many) * many.settings[0].substep


@inlined
def rest_speed_limit(k, h, many):
    """Largest approach speed of contact k that a resting stage of length h [s] may stop without an impact [m/s].

    It is the speed that loads give within `rest_share` of the substep, or one that closes a few slops until the middle
    of the stage, whichever is larger.
    """
    slop = pair_slop(many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], many)
    return max(2.0 * _SOFT_LANDING_SLOPS * slop / h, _rest_speed(k, many))


def _never(k, many, body):
    return False


@if_law((LAW_TANGENTIAL,), _never)
def _bounces_along(k, many, body):
    """True if contact k rebounds along its plane only: it has no restitution, and is too fast to come to rest.

    `body` is any record of `many.bodies.body`, whose type tells the laws of the scene.
    """
    is_fast = -many.contacts.speed[k] > rest_speed_limit(k, many.settings[0].substep, many)
    return many.contacts.restitution[k] == 0.0 and is_fast


@inlined
def is_bouncing(k, many):
    """True if contact k would rebound from an impact at its present speed.

    A rebound that would be over within `rest_share` of the substep does not count.
    """
    bounce = -many.contacts.restitution[k] * many.contacts.speed[k]
    return (many.contacts.restitution[k] > 0.0 and bounce > _rest_speed(k, many)) or _bounces_along(
        k, many, many.bodies.body[0]
    )


@inlined
def _is_alone(n, k, b, many):
    """True if no other of the n contacts of an impact bounces at body b than contact k."""
    for i in range(n):
        is_at = many.contacts.bodies[i, 0] == b or many.contacts.bodies[i, 1] == b
        if i != k and is_at and many.contacts.target[i, 0] >= 0.0 and is_bouncing(i, many):
            return False
    return True


def _no_aim(n, many, body):
    return None


@if_law((LAW_TANGENTIAL,), _no_aim)
def set_tangential_targets(n, many, body):
    """Set the targets along the planes of those of the n contacts of an impact at which their bodies bounce alone.

    `body` is any record of `many.bodies.body`, whose type tells the laws of the scene.
    """
    for k in range(n):
        a, b = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1]
        if many.contacts.owner[k] == PARTED or not (many.contacts.target[k, 0] >= 0.0 and is_bouncing(k, many)):
            continue
        if _is_alone(n, k, a, many) and (b < 0 or _is_alone(n, k, b, many)):
            share = tangential_restitution(many.bodies.body[a])
            u = qt.matvec(row_matrix(many.contacts.frame, k), slip_velocity(k, many))
            many.contacts.target[k, 1], many.contacts.target[k, 2] = -share * u[1], -share * u[2]


@if_law((LAW_TANGENTIAL,), _never)
def aims_along(k, many, body):
    """True if contact k has a target along its plane; for `body` see `set_tangential_targets`."""
    return many.contacts.target[k, 1] != 0.0 or many.contacts.target[k, 2] != 0.0


def _no_target(k, many, body):
    return None


@if_law((LAW_TANGENTIAL,), _no_target)
def clear_tangential_target(k, many, body):
    """Set the target of contact k along its plane to 0; for `body` see `set_tangential_targets`."""
    many.contacts.target[k, 1] = many.contacts.target[k, 2] = 0.0
