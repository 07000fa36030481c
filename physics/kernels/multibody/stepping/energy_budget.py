"""Energy budget of resting stages and position corrections, where bodies touch each other.

Targets of resting contacts allow for the rotation of the bodies (`midpoint_step.set_resting_targets`). Such a target
adds no energy if a body's response to impulses is the same in all directions. Other bodies, and many contacts together,
may gain energy. Position corrections may lift bodies against their loads, and the work is taken from their motion. They
also turn bodies, which changes ½ L·I⁻¹L at constant L. For impacts see
`physics.kernels.contact_law.restitution_energy`.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.contact_law.compliance import ENERGY_GAIN_TOLERANCE
from physics.kernels.half_space import support_function as geo
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import as_vector, row_vector
from physics.kernels.multibody.data.arrays import LOADED_MOMENTA, PRE_LOAD_VELOCITY
from physics.kernels.multibody.data.capsules import capsule_support, is_capsule
from physics.kernels.multibody.data.collision_groups import share_group
from physics.kernels.multibody.data.contact_set import add_scaled, put_vector, row_matrix, subtract
from physics.kernels.multibody.data.cylinders import cylinder_support, is_cylinder
from physics.kernels.multibody.data.driven_bodies import driven_velocity, driven_work
from physics.kernels.multibody.data.parts import is_compound, place_parts
from physics.kernels.multibody.stepping.compliant_stage import dissipative_target, energy_with_springs
from physics.kernels.state import layout as at
from physics.kernels.state.body import angular_velocity, read_state
from physics.kernels.state.layout import HULL, WALL_NORMAL, WALL_OFFSET

# Largest gains of energy that a position correction does not take from the motion: as a share of the body's rotational
# energy, and as a lift in slops. A larger lift is paid for only in islands that a wall pushes; elsewhere bodies push
# each other apart and keep their momentum.
_FREE_ROTATION_SHARE = 1.0e-7
_FREE_LIFT_SLOPS = 10.0


@inlined
def save_pre_load_velocity(b, velocity, many):
    """Store velocity and angular velocity of body b before its loads act, in `many.bodies.momenta`.

    `velocity` is given [m/s]; the angular velocity is read from `many.bodies.twist`.
    """
    put_vector(many.bodies.momenta, b, PRE_LOAD_VELOCITY, velocity)
    put_vector(many.bodies.momenta, b, PRE_LOAD_VELOCITY + 3, row_vector(many.bodies.twist, b, 3))


@inlined
def save_loaded_momenta(b, many):
    """Store velocity and angular momentum of body b after its loads have acted, in `many.bodies.momenta`."""
    put_vector(many.bodies.momenta, b, LOADED_MOMENTA, row_vector(many.bodies.state, b, at.LINVEL))
    put_vector(many.bodies.momenta, b, LOADED_MOMENTA + 3, row_vector(many.bodies.state, b, at.ANGMOM))


@kernel
def _has_gained_by_impulses(n, h, many):
    """True if the impulses of the n contacts in a resting stage of length h [s] have created energy.

    Errors of the solve and of the step are allowed for. Impulse P and angular impulse Q on a body change its energy by
    ½ P·(v + v') + ½ Q·(ω + ω'), from velocities before the stage to v' and ω' after it. A contact with the impulse p
    may keep a residual r = tolerance · s, with the largest free speed s, and so add ½ p r. In a tower this is far more
    than the energy of its bodies. But no contact needs an impulse above the sum F of all loads to hold them; the rest
    of p is internal strain. Driven bodies do the work Σ p·w, which is no gain.
    """
    gain = size = fastest = F = 0.0
    for b in range(many.bodies.state.shape[0]):
        if many.bodies.touched[b] == 0:
            continue
        body, v_new, L_new = (
            many.bodies.body[b],
            row_vector(many.bodies.state, b, at.LINVEL),
            row_vector(many.bodies.state, b, at.ANGMOM),
        )
        v, w = (
            row_vector(many.bodies.momenta, b, PRE_LOAD_VELOCITY),
            row_vector(many.bodies.momenta, b, PRE_LOAD_VELOCITY + 3),
        )
        P, Q = (
            subtract(v_new, row_vector(many.bodies.momenta, b, LOADED_MOMENTA)),
            subtract(L_new, row_vector(many.bodies.momenta, b, LOADED_MOMENTA + 3)),
        )
        w_new, a = row_vector(many.bodies.twist, b, 3), body.free_acceleration
        gain += body.mass * qt.dot(P, add_scaled(v, 1.0, v_new)) + qt.dot(Q, add_scaled(w, 1.0, w_new))
        square = h * h * (a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
        size += body.mass * (qt.dot(v, v) + square) + abs(qt.dot(L_new, w_new))
        fastest = max(fastest, qt.dot(v, v) + square)
        F += body.mass * math.sqrt(square)
    held = 0.0
    for k in range(n):
        held += min(many.contacts.impulse[k, 0], F)
        w = driven_velocity(k, many)
        fastest = max(fastest, qt.dot(w, w))
    tolerance, work = many.settings[0].tolerance, 2.0 * driven_work(n, many)
    gain, size = gain - work, size + abs(work)
    return gain > max(tolerance, ENERGY_GAIN_TOLERANCE) * size + tolerance * math.sqrt(fastest) * held


def _has_gained_without_springs(n, h, many):
    return _has_gained_by_impulses(n, h, many)


@if_given("many.compliance", _has_gained_without_springs)
def has_gained_energy(n, h, many):
    """True if the springs of the n contacts and the motion have gained energy, in a stage of length h [s].

    Rigid contacts are served by `_has_gained_by_impulses`, compliant ones by `compliant_stage`.
    """
    gain, size = energy_with_springs(n, h, many)
    return gain > max(many.settings[0].tolerance, ENERGY_GAIN_TOLERANCE) * size


@inlined
def update_twist(b, offset_frame, many):
    """Compute the twist of body b from its momenta."""
    put_vector(many.bodies.twist, b, 0, row_vector(many.bodies.state, b, at.LINVEL))
    q, L = read_state(many.bodies.state, b)[1], row_vector(many.bodies.state, b, at.ANGMOM)
    put_vector(many.bodies.twist, b, 3, angular_velocity(q, L, many.bodies.body[b], offset_frame))


@kernel
def revert_to_dissipative(n, offset_frame, many):
    """Undo the impulses of a resting stage, and set targets of its n contacts that cannot raise the energy.

    Bodies get their momenta back that they had before the impulses, with the loads of the stage.
    """
    for b in range(many.bodies.state.shape[0]):
        if many.bodies.touched[b] == 0:
            continue
        put_vector(many.bodies.state, b, at.LINVEL, row_vector(many.bodies.momenta, b, LOADED_MOMENTA))
        put_vector(many.bodies.state, b, at.ANGMOM, row_vector(many.bodies.momenta, b, LOADED_MOMENTA + 3))
        update_twist(b, offset_frame, many)
    for k in range(n):
        put_vector(many.contacts.target, k, 0, (dissipative_target(k, many), 0.0, 0.0))


@inlined
def work_against_loads(b, x, many):
    """Work against its loads that moved body b from position x to its present position [J]."""
    body, y = many.bodies.body[b], row_vector(many.bodies.state, b, at.POS)
    return -body.mass * qt.dot(as_vector(body.free_acceleration), subtract(y, x))


@kernel
def cap_rotational_energy(b, before, offset_frame, many):
    """Shorten the angular momentum L of body b if turning it has raised its energy ½ L·I⁻¹L above `before` [J]."""
    _, q, _, L = read_state(many.bodies.state, b)
    after = 0.5 * qt.dot(L, angular_velocity(q, L, many.bodies.body[b], offset_frame))
    if after > before + _FREE_ROTATION_SHARE * before:
        s = math.sqrt(before / after)
        put_vector(many.bodies.state, b, at.ANGMOM, (s * L[0], s * L[1], s * L[2]))


@kernel
def take_kinetic_energy(b, price, offset_frame, many):
    """Take the energy `price` [J] from the motion of body b, at most all of it."""
    _, q, v, L = read_state(many.bodies.state, b)
    body = many.bodies.body[b]
    kinetic = 0.5 * (body.mass * qt.dot(v, v) + qt.dot(L, angular_velocity(q, L, body, offset_frame)))
    s = math.sqrt(1.0 - price / kinetic) if price < kinetic else 0.0
    put_vector(many.bodies.state, b, at.LINVEL, (s * v[0], s * v[1], s * v[2]))
    put_vector(many.bodies.state, b, at.ANGMOM, (s * L[0], s * L[1], s * L[2]))


@inlined
def free_lift_work(b, many):
    """Work of lifting body b by a few slops [J]; position corrections take no energy for less work than that."""
    body = many.bodies.body[b]
    return body.mass * body.acceleration * _FREE_LIFT_SLOPS * body.slop


@kernel
def clamp_body_inside_walls(b, many):
    """Move body b back inside if its geometric centre is behind a wall that it may touch; return whether it was.

    The velocity into the wall is removed, too. Contacts hold points of a body, not its centre. Loads of a million times
    the weight may turn a body by many radians in a step, and its points then do not show where the centre goes.
    """
    body, was_outside = many.bodies.body[b], False
    dims = (body.dims[0], body.dims[1], body.dims[2])
    for k in range(many.walls.shape[0]):
        n, center = row_vector(many.walls, k, WALL_NORMAL), row_vector(many.bodies.center, b, 0)
        d = qt.dot(n, center) - many.walls[k, WALL_OFFSET]
        if d >= 0.0 or not share_group(b, -1 - k, many):
            continue
        was_outside = True
        reach = body.radius
        if is_capsule(b, many):
            reach = capsule_support(b, row_matrix(many.bodies.rotation, b), n, many)
        elif is_cylinder(b, many):
            reach = cylinder_support(b, row_matrix(many.bodies.rotation, b), n, many)
        elif body.shape != HULL and not is_compound(b, many):
            reach = geo.support(
                body.shape, dims, geo.scaled_normal(body.shape, dims, row_matrix(many.bodies.rotation, b), n)
            )
        put_vector(many.bodies.center, b, 0, add_scaled(center, reach - d, n))
        place_parts(b, many)
        put_vector(many.bodies.state, b, at.POS, add_scaled(row_vector(many.bodies.state, b, at.POS), reach - d, n))
        v = row_vector(many.bodies.state, b, at.LINVEL)
        put_vector(many.bodies.state, b, at.LINVEL, add_scaled(v, -min(qt.dot(n, v), 0.0), n))
    return was_outside
