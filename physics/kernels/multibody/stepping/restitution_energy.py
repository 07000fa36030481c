"""Impacts among bodies that would gain energy by friction and restitution; see `contact_law.restitution_energy`."""

from __future__ import annotations

from physics.kernels.compile.decorators import inlined, kernel
from physics.kernels.contact_law.restitution_energy import ROUNDING, rebound_share
from physics.kernels.math import quaternion as qt
from physics.kernels.multibody.data.contact_set import pair_slop, plus, put, vector
from physics.kernels.multibody.stepping.solve_and_apply import settle, settle_smoothly
from physics.kernels.state import layout as at
from physics.kernels.state.body import angular_velocity, read_state

BEFORE, FULL = 0, 6

# Tolerances of its solve by which a plastic impact may raise the energy, as a share of it.
SOLVED = 4.0


@inlined
def _keep(first, many):
    """Copy the momenta of all bodies to `many.momenta`."""
    for b in range(many.now.shape[0]):
        put(many.momenta, b, first, vector(many.now, b, at.LINVEL))
        put(many.momenta, b, first + 3, vector(many.now, b, at.ANGMOM))


@inlined
def _turn(tilted, many):
    """Twists of all bodies from their momenta."""
    for b in range(many.now.shape[0]):
        _, q, v, L = read_state(many.now, b)
        put(many.twist, b, 0, v)
        put(many.twist, b, 3, angular_velocity(q, L, many.bodies[b], tilted))


@kernel
def kinetic_energy(tilted, many):
    """Kinetic energy of all bodies of the world [J]; their twists are computed anew."""
    _turn(tilted, many)
    total = 0.0
    for b in range(many.now.shape[0]):
        v, L = vector(many.now, b, at.LINVEL), vector(many.now, b, at.ANGMOM)
        total += 0.5 * (qt.dot(v, v) / many.lightness[b] + qt.dot(L, vector(many.twist, b, 3)))
    return total


@inlined
def _mix(s, many):
    """Move the momenta of all bodies by the share s towards those with all of the rebound."""
    for b in range(many.now.shape[0]):
        v, L = vector(many.now, b, at.LINVEL), vector(many.now, b, at.ANGMOM)
        v_full, L_full = vector(many.momenta, b, FULL), vector(many.momenta, b, FULL + 3)
        put(many.now, b, at.LINVEL, plus(plus(v, -s, v), s, v_full))
        put(many.now, b, at.ANGMOM, plus(plus(L, -s, L), s, L_full))


@inlined
def _keep_impulses(n, many):
    """Copy the impulses of the n contacts to `many.rebound`."""
    for k in range(n):
        put(many.rebound, k, 0, vector(many.impulse, k, 0))


@inlined
def _mix_impulses(n, s, many):
    """Move the impulses of the n contacts by the share s towards those with all of the rebound."""
    for k in range(n):
        p = vector(many.impulse, k, 0)
        put(many.impulse, k, 0, plus(plus(p, -s, p), s, vector(many.rebound, k, 0)))


@inlined
def _aim_plastic(n, many):
    """Targets of what touches without rebound, and momenta as before the impact."""
    for k in range(n):
        put(many.impulse, k, 0, (0.0, 0.0, 0.0))
        if not many.gap[k] > pair_slop(many.ends[k, 0], many.ends[k, 1], many):
            many.target[k, 0] = 0.0
    for b in range(many.now.shape[0]):
        put(many.now, b, at.LINVEL, vector(many.momenta, b, BEFORE))
        put(many.now, b, at.ANGMOM, vector(many.momenta, b, BEFORE + 3))


@inlined
def _has_rebound(n, many):
    """True if any contact that touches is to leave with a speed."""
    for k in range(n):
        if many.target[k, 0] != 0.0 and not many.gap[k] > pair_slop(many.ends[k, 0], many.ends[k, 1], many):
            return True
    return False


@kernel
def _settle_without_friction(n, tilted, many):
    """The plastic impact without friction from the momenta before: no solve with friction came out right."""
    _aim_plastic(n, many)
    _turn(tilted, many)
    settle_smoothly(n, many)


@kernel
def settle_restrained(n, world, friction, tilted, report, many):
    """`settle` the n contacts of an impact; with friction, with as much of the rebound as there is energy for."""
    if friction is None:
        settle(n, world, friction, report, many)
        return
    _keep(BEFORE, many)
    before = kinetic_energy(tilted, many)
    most = before + SOLVED * many.settings[0].tolerance * before
    has_rebound = _has_rebound(n, many)
    settle(n, world, friction, report, many)
    full = kinetic_energy(tilted, many)
    if not full > (before + ROUNDING * before if has_rebound else most):
        return
    plastic = full
    if has_rebound:
        _keep(FULL, many)
        _keep_impulses(n, many)
        _aim_plastic(n, many)
        _turn(tilted, many)
        settle(n, world, friction, report, many)
        plastic = kinetic_energy(tilted, many)
    if plastic > most:
        _settle_without_friction(n, tilted, many)
        return
    _mix(0.5, many)
    middle = kinetic_energy(tilted, many)
    s = rebound_share(before, plastic, full, middle)
    _mix(2.0 * s - 1.0, many)  # from the middle
    _mix_impulses(n, s, many)
    _turn(tilted, many)
