"""The memory behind a `World`: as much as its plan asks for, and what the scene says in it."""

from __future__ import annotations

import os
from dataclasses import replace

import numpy as np

from physics.kernels.event_driven import workspace
from physics.kernels.half_space.gap_queries import write_angular_momenta
from physics.kernels.multibody.data import allocation as many
from physics.kernels.multibody.stepping.adaptive_substep import MIN_RELATIVE_SLOP, MIN_SOLVER_TOLERANCE
from physics.kernels.state import layout as at
from physics.kernels.time_stepping.midpoint_friction import MEAN_SLIP_CONTACTS
from physics.kernels.time_stepping.spring_coupled_step import make_linked_world
from physics.kernels.time_stepping.warm_start import wall_memory_size
from physics.kernels.time_stepping.workspace import make_workspace
from physics.plan.accuracy import Accuracy
from physics.plan.plan import Plan
from physics.scene.effects import Contact, Friction, Gravity
from physics.scene.force_field import write_columns
from physics.scene.scene import Scene
from physics.world import parameters
from physics.world.batch import Batch


def make_scratch(scene: Scene, plan: Plan, walls: np.ndarray, accuracy: Accuracy):
    """Working memory of one thread, with the numerical settings in it; `walls` is the table of `parameters`."""
    if plan.refined:
        accuracy = replace(
            accuracy,
            tolerance=max(accuracy.tolerance, MIN_SOLVER_TOLERANCE),
            slop=max(accuracy.slop, MIN_RELATIVE_SLOP),
        )
    bodies = len(scene.bodies)
    numbers = {
        "tolerance": accuracy.tolerance, "sweeps": accuracy.iterations,
        "splits": accuracy.impacts * (bodies if plan.many else 1),
        "relative_slop": accuracy.slop, "rest_share": accuracy.rest_share,
        "mean_slip": MEAN_SLIP_CONTACTS if accuracy.slip == "mean" else 0,
    }  # fmt: skip
    if plan.many:
        return many.make_bodies_workspace(
            bodies, walls, plan.terms, parameters.polyhedra(scene.bodies), meet=plan.meeting,
            is_sequential=accuracy.collisions == "sequential", is_error_controlled=bool(plan.refined), **numbers,
        )  # fmt: skip
    if plan.linked:
        return make_linked_world(bodies, plan.terms, **numbers)
    return make_workspace(walls, plan.features, plan.terms, plan.laws, **numbers)


def make_motion(scene: Scene, plan: Plan, accuracy: Accuracy):
    """Make the scratch of one thread for error control: a smooth motion, or the world at some moments."""
    bodies, walls = len(scene.bodies), len(scene.walls)
    if plan.events:
        return workspace.make_motion(walls, plan.features, accuracy.collisions == "sequential")
    if plan.refined:
        return many.make_snapshots(bodies, many.warm_start_size(bodies, walls, parameters.polyhedra(scene.bodies)))
    return None


def make_memory(scene: Scene, plan: Plan, worlds: int) -> np.ndarray:
    """Make the memory of contacts: a row per world where bodies touch each other, else a row per body."""
    bodies, walls = len(scene.bodies), len(scene.walls)
    if plan.many:
        polyhedra = parameters.polyhedra(scene.bodies)
        return np.zeros((worlds, many.warm_start_size(bodies, walls, polyhedra, bool(plan.refined))))
    return np.zeros((worlds * bodies if plan.contact else 1, wall_memory_size(max(walls * plan.features, 1))))


def check_room(worlds: int, bodies: int, plan: Plan) -> None:
    """Refuse more worlds than this machine's memory holds: a few would otherwise end the process."""
    row = 8 * (at.STATE_SIZE + at.PARAM_SIZE + plan.field_columns)  # the least that a body takes [bytes]
    memory = machine_memory()
    if worlds * bodies * row > memory:
        raise ValueError(
            f"worlds is {worlds} of {bodies} bodies; allowed are at most {memory // (bodies * row)}, which fill the "
            f"{memory / 2**30:.0f} GiB of memory of this machine"
        )


def machine_memory() -> int:
    """Physical memory [bytes]; where the system does not say, an amount that no machine has."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return 2**62


def fill(world: Batch) -> None:
    """Write the scene's bodies and effects into the arrays of every world."""
    scene, plan = world.scene, world.plan
    contact, friction, gravity = scene.effect(Contact), scene.effect(Friction), scene.effect(Gravity)
    state = world.state.reshape(world.worlds, world.body_count, at.STATE_SIZE)
    for b, body in enumerate(scene.bodies):
        state[:, b, at.POS : at.POS + 3] = body.pos
        state[:, b, at.QUAT : at.QUAT + 4] = body.quat
        state[:, b, at.LINVEL : at.LINVEL + 3] = body.linvel
        state[:, b, at.ANGVEL : at.ANGVEL + 3] = body.angvel
    parameters.write_bodies(world.params, scene.bodies)
    world.params[:, at.FRICTION] = friction.along if friction else 0.0
    world.params[:, at.RESTITUTION] = (contact.restitution or 0.0) if contact else 0.0
    world.gravity[:] = gravity.acceleration if gravity else 0.0
    parameters.write_laws(world.params, plan.laws, scene.effects)
    columns = world.params[:, at.PARAM_SIZE :]
    write_columns(plan.fields, columns, world.body_count, np.arange(world.worlds))
    write_angular_momenta(np.arange(len(world.state)), world.state, world.params)
