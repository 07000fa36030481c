"""Diagnostics of a world: energy, momenta and gaps, computed on demand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from physics import validation
from physics.html_table import parts_table
from physics.kernels.forces.queries import evaluate_fields
from physics.kernels.half_space.gap_queries import contact_spring_energies
from physics.kernels.multibody.stepping.spring_energies import contact_spring_energies_of_worlds
from physics.kernels.state import layout as at
from physics.kernels.state.contact_law_dispatch import LAW_STIFFNESS
from physics.kernels.state.groups import BodyArrays
from physics.kernels.time_stepping.workspace import body_records
from physics.parallel.exclusive import exclusive
from physics.scene.field_errors import raised
from physics.summary import parts_repr
from physics.world.parameters import law_column, masses_of
from physics.world.wall_distance import wall_gaps
from physics.world.world import World


@dataclass(frozen=True)
class Diagnostics:
    """Energy, momenta and gaps of each body of each world: arrays (worlds, bodies) or (worlds, bodies, 3).

    Energies and momenta of a fixed body are 0, and its gap is infinite.
    """

    kinetic_energy: np.ndarray  # [J]
    potential_energy: np.ndarray  # [J], of gravity (0 at the origin), contact springs, and fields with a potential
    momentum: np.ndarray  # [kg m/s], world frame
    angular_momentum: np.ndarray  # about the centre of mass [kg m²/s], world frame
    gap: np.ndarray  # smallest distance to a wall [m], negative when penetrating, inf without walls

    __repr__ = parts_repr
    _repr_html_ = parts_table

    def _parts(self) -> tuple[str, ...]:
        worlds, bodies = self.gap.shape
        return (
            f"{worlds} worlds of {bodies} bodies",
            f"energy {self.energy.min():.6g} to {self.energy.max():.6g} J",
            f"gap {self.gap.min():.6g} to {self.gap.max():.6g} m",
        )  # fmt: skip

    @property
    def energy(self) -> np.ndarray:
        """Sum of kinetic and potential energy of each body [J], (worlds, bodies)."""
        return self.kinetic_energy + self.potential_energy


def diagnose(world: World) -> Diagnostics:
    """Compute energy, momenta and gaps of every body of `world` in its present state.

    Kinetic energy is ½ P·v + ½ L·ω. Potential energy is -m g·x, plus the energies of fields (`Field.energy`) and of
    contact springs (`Contact.stiffness`).
    """
    validation.instance(world, World, "world", "a physics.World")
    return _diagnose(world)


@exclusive
def _diagnose(world: World) -> Diagnostics:
    shape = (world.worlds, world.body_count)
    is_fixed = np.array([body.fixed for body in world.scene.bodies])
    mass = np.where(is_fixed, 0.0, masses_of(world.params).reshape(shape))
    angular = world.state[:, at.ANGMOM : at.ANGMOM + 3].reshape(*shape, 3)
    momentum = mass[..., None] * world.linvel
    gaps, which = wall_gaps(world, world.state, world.params)
    potential = -mass * np.sum(world.gravity[:, None, :] * world.pos, axis=-1)
    if world.plan.fields:
        potential += _look_at(world)[1].reshape(shape)
    if LAW_STIFFNESS in world.plan.laws:
        potential += _spring_energies(world).reshape(shape)
    return Diagnostics(
        kinetic_energy=0.5 * np.sum(momentum * world.linvel + angular * world.angvel, axis=-1),
        potential_energy=potential,
        momentum=momentum,
        angular_momentum=angular.copy(),
        gap=np.where((which < 0).reshape(shape) | is_fixed, np.inf, gaps.reshape(shape)),
    )


def _spring_energies(world: World) -> np.ndarray:
    """Energies of the contact springs of every row [J], (worlds * bodies,)."""
    plan, energies = world.plan, np.empty(len(world.state))
    if not plan.scheme.couples_bodies:
        column = law_column(world.params, plan, LAW_STIFFNESS)
        contact_spring_energies(world.state, world.params, world.shapes, world.walls, column, energies)
        return energies
    arrays = BodyArrays(world.state, world.params, world.shapes, None, np.zeros((len(world.state), 6)))
    end, shapes_met = world.params.shape[1] - plan.motion_columns, (plan.ellipsoids, plan.hulls)
    contact_spring_energies_of_worlds(arrays, end, plan.offset_frame, shapes_met, energies, world.scratch[0])
    return energies


def look_at(world: World) -> tuple[np.ndarray, np.ndarray]:
    """Compute loads and potential energies of the scene's force fields in the present state of `world`.

    Returns
    -------
    wrenches : (worlds * bodies, 6) float64
        Force [N] and torque about the centre of mass [N m], world frame.
    energies : (worlds * bodies,) float64
        Potential energies [J]. Both are 0 for fixed bodies.
    """
    validation.instance(world, World, "world", "a physics.World")
    return exclusive(_look_at)(world)


def _look_at(world: World) -> tuple[np.ndarray, np.ndarray]:
    """Do the work of `look_at`, in the workspace of a step: the caller must have exclusive use of the world."""
    wrenches, energies = np.zeros((len(world.state), 6)), np.zeros(len(world.state))
    if world.plan.fields:
        arrays = world.state, world.params, world.shapes
        try:
            evaluate_fields(
                *arrays, world.plan.offset_frame, world.time, body_records(world.scratch[0]), wrenches, energies
            )
        except IndexError as error:
            raise raised(error, world.plan.fields) from error
        is_fixed = np.tile([body.fixed for body in world.scene.bodies], world.worlds)
        wrenches[is_fixed], energies[is_fixed] = 0.0, 0.0
    return wrenches, energies
