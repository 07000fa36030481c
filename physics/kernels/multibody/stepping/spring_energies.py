"""Energies of the contact springs of bodies that touch each other, in states without a step."""

from __future__ import annotations

from physics.compiler.decorators import entry_kernel
from physics.kernels.contact_law.compliance import contact_stiffness
from physics.kernels.multibody.data.arrays import NUM_CONTACTS
from physics.kernels.multibody.data.fixed_bodies import body_at
from physics.kernels.multibody.data.kinematics import update_poses_and_twists
from physics.kernels.multibody.data.parts import bind_parts
from physics.kernels.multibody.narrowphase.dispatch import find_contacts
from physics.kernels.multibody.stepping.conservative_advancement import clear_spin_bounds
from physics.kernels.multibody.stepping.still_bodies import place_still_bodies
from physics.kernels.state import layout as at
from physics.kernels.state.body import bind_body, read_state, write_state
from physics.kernels.state.contact_law_dispatch import bind_laws
from physics.kernels.state.fixed_body import is_fixed


@entry_kernel
def contact_spring_energies_of_worlds(arrays, first_motion, offset_frame, shapes_met, energies, many):
    """Write the energy ½ k g² of the contact springs of every row into `energies` (rows,) [J].

    Two bodies that move have half of the energy of their springs each. `arrays` is a `BodyArrays`, `first_motion` the
    column of `params` behind the contact laws, `shapes_met` the switches for ellipsoids and hulls.
    """
    bodies = arrays.shapes.shape[0]
    for world in range(energies.shape[0] // bodies):
        for b in range(bodies):
            i = world * bodies + b
            bind_body(world, i, arrays.shapes[b], arrays, None, None, offset_frame, many.bodies.body[b])
            many.bodies.inv_mass[b] = arrays.params[i, at.INV_MASS]
            bind_laws(arrays.params, i, first_motion, many.bodies.body[b])
            write_state(many.bodies.state, b, read_state(arrays.state, i))
            energies[i] = 0.0
        bind_parts(many)
        place_still_bodies(offset_frame, many)
        update_poses_and_twists(offset_frame, many)
        clear_spin_bounds(many)
        find_contacts(0.0, shapes_met[0], shapes_met[1], world, None, many)
        for k in range(many.counts[NUM_CONTACTS]):
            gap, a = min(many.contacts.gap[k], 0.0), many.contacts.bodies[k, 0]
            b = body_at(many.contacts.bodies[k, 1], many)
            energy = 0.5 * contact_stiffness(many.bodies.body[a]) * gap * gap
            if b >= 0 and not is_fixed(b, many.bodies):
                energy *= 0.5
                energies[world * bodies + b] += energy
            energies[world * bodies + a] += energy
