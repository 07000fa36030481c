"""Evaluate the loads and potential energies of all force fields at given states, for diagnostics of a world."""

from __future__ import annotations

from physics.compiler.decorators import entry_kernel
from physics.kernels.forces.field_loads import field_state
from physics.kernels.forces.force_field_dispatch import total_energy, total_load
from physics.kernels.forces.held_loads import bind_fields
from physics.kernels.forces.two_body_spring import place_anchors_of_body
from physics.kernels.state.body import bind_body, read_state
from physics.kernels.state.groups import BodyArrays


@entry_kernel
def evaluate_fields(state, params, shapes, offset_frame, start, scratch, wrenches, energies):
    """Write the total load and potential energy of the fields of each body, at the time `start` [s].

    Written are `wrenches` (rows, 6), force and torque about the centre of mass [N, N m], and `energies` (rows,) [J].
    `wrenches` must be zero before the call, since it is also read as the wrench that users apply. `scratch` has one
    record of a body.
    """
    body, bodies = scratch[0], BodyArrays(state, params, shapes, None, wrenches)
    for i in range(state.shape[0]):
        bind_body(i // shapes.shape[0], i, shapes[i % shapes.shape[0]], bodies, None, None, offset_frame, body)
        bind_fields(params, i, None, body)
        place_anchors_of_body(i, state, shapes.shape[0], body)
        x, q, v, L = read_state(state, i)
        told = field_state(x, q, v, L, start, offset_frame, body)
        F, T = total_load(told, start, body)
        for c in range(3):
            wrenches[i, c], wrenches[i, 3 + c] = F[c], T[c]
        energies[i] = total_energy(told, start, body)
