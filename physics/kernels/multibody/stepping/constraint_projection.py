"""Put the pressed contacts of a lone body back on their surfaces, after each stage under error control.

A stage leaves gaps of third order in its length. `position_correction` takes back a share of those that overlap by more
than a slop, and open gaps close in the next stage. Both depend on the slop, and neither is smooth: parts would differ
from their halves by it, and could not be extrapolated. So contacts that have pushed are found again at the end of the
stage, and the body is moved by the least displacement, in the kinetic metric, that brings their gaps g to zero:

    minimise ½ δ·M δ    subject to    J δ = -g.

Gauss-Seidel sweeps solve it, one contact after another; contacts of one face may be redundant. Momenta do not change.

All of this is left out of kernels unless exactly one body moves, among fixed ones.
"""

from __future__ import annotations

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import plus, row_vector, times
from physics.kernels.multibody.data.arrays import NUM_CONTACTS
from physics.kernels.multibody.data.contact_set import pair_slop
from physics.kernels.multibody.data.kinematics import update_body_pose
from physics.kernels.multibody.data.lone_body import lone_body
from physics.kernels.multibody.data.warm_start import load_warm_impulses
from physics.kernels.multibody.narrowphase.dispatch import find_contacts
from physics.kernels.multibody.solver.contact_operator import apply_body_inv_inertia
from physics.kernels.state.body import read_state, write_state

# Largest number of sweeps, and gap at which they end, as a share of the slop.
_MAX_SWEEPS = 100
_END_SHARE = 1.0e-4


@inlined
def _sweep(n, b, x, turn, many):
    """Sweep once over the pushing contacts of body b: (largest gap that was left [m], displacement, turn)."""
    worst = 0.0
    for k in range(n):
        if not many.contacts.impulse[k, 0] > 0.0:
            continue
        normal, arm = row_vector(many.contacts.frame, k, 0), row_vector(many.contacts.arm, k, 0)
        moment = qt.cross(arm, normal)
        answer = apply_body_inv_inertia(b, moment, many)
        gap = many.contacts.gap[k] + qt.dot(normal, x) + qt.dot(moment, turn)
        p = -gap / (many.bodies.inv_mass[b] + qt.dot(moment, answer))
        x, turn = plus(x, times(p * many.bodies.inv_mass[b], normal)), plus(turn, times(p, answer))
        worst = max(worst, abs(gap))
    return worst, x, turn


@kernel
def _project(world, h, switches, memory, many):
    b, offset_frame = lone_body(many), switches.flight.offset_frame
    touched = many.bodies.touched[b]
    update_body_pose(b, offset_frame, many)
    find_contacts(h, switches.ellipsoids, switches.hulls, world, None, many)
    many.bodies.touched[b] = touched
    n = many.counts[NUM_CONTACTS]
    if n == 0:
        return
    load_warm_impulses(n, world, h, None, memory, many)
    end = _END_SHARE * pair_slop(many.contacts.bodies[0, 0], many.contacts.bodies[0, 1], many)
    x, turn = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for _ in range(_MAX_SWEEPS):
        worst, further, more = _sweep(n, b, x, turn, many)
        if not worst > end:
            break
        x, turn = further, more
    place, q, v, L = read_state(many.bodies.state, b)
    if qt.dot(x, x) + qt.dot(turn, turn) > 0.0:
        write_state(many.bodies.state, b, (plus(place, x), qt.normalise(qt.multiply(qt.exp_map(turn), q)), v, L))
        update_body_pose(b, offset_frame, many)


def _close_gaps(world, h, switches, memory, many):
    _project(world, h, switches, memory, many)


@if_given("many.compliance", _close_gaps)
def _project_rigid(world, h, switches, memory, many):
    """Leave compliant contacts as deep as their springs hold them."""


@if_given("many.lone")
def project_constraints(world, h, switches, memory, many):
    """Close the gaps of the contacts that pushed in a stage of length h [s] that has just ended.

    Only under error control. `world` is the index of the world, `memory` has its warm starts.
    """
    if many.settings[0].is_error_controlled == 1:
        _project_rigid(world, h, switches, memory, many)
