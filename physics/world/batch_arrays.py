"""Arrays of a batch of worlds: check of the memory they need, and their first contents from the scene."""

from __future__ import annotations

import os

import numpy as np

from physics.kernels.half_space.gap_queries import write_angular_momenta
from physics.kernels.state import layout as at
from physics.plan.plan import Plan
from physics.scene.effects import Gravity
from physics.scene.force_field import write_columns
from physics.world import materials, motions, parameters
from physics.world.batch import Batch


def check_room(worlds: int, bodies: int, plan: Plan) -> None:
    """Raise a ValueError for more worlds than this machine's memory holds, before the system ends the process."""
    row = 8 * (at.STATE_SIZE + at.PARAM_SIZE + plan.columns)  # the least that a body takes [bytes]
    memory = machine_memory()
    if worlds * bodies * row > memory:
        raise ValueError(
            f"worlds is {worlds} of {bodies} bodies; allowed are at most {memory // (bodies * row)}, which fill the "
            f"{memory / 2**30:.0f} GiB of memory of this machine"
        )


def machine_memory() -> int:
    """Physical memory of this machine [bytes]; 2**62 where the system does not tell it."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return 2**62


def fill(world: Batch) -> None:
    """Write the scene's bodies and effects into the state and parameter arrays of all worlds of a batch."""
    scene, plan = world.scene, world.plan
    gravity = scene.effect(Gravity)
    state = world.state.reshape(world.worlds, world.body_count, at.STATE_SIZE)
    for b, body in enumerate(scene.bodies):
        state[:, b, at.POS : at.POS + 3] = body.pos
        state[:, b, at.QUAT : at.QUAT + 4] = body.quat
        state[:, b, at.LINVEL : at.LINVEL + 3] = body.linvel
        state[:, b, at.ANGVEL : at.ANGVEL + 3] = body.angvel
    parameters.write_bodies(world.params, scene.bodies)
    materials.write_materials(world.params, scene, plan)
    world.gravity[:] = gravity.acceleration if gravity else 0.0
    parameters.write_laws(world.params, plan, scene.effects)
    columns = world.params[:, at.PARAM_SIZE :]
    write_columns(plan.fields, columns, world.body_count, np.arange(world.worlds))
    motions.write_scene_motions(scene, plan, world.state, world.params, 0.0)
    write_angular_momenta(np.arange(len(world.state)), world.state, world.params)
