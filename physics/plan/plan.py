"""Plan of a scene at an accuracy: its scheme, the switches for which kernels are compiled, and the reasons."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from physics import validation
from physics.accuracy import INTEGRATORS, Accuracy, resolve
from physics.annotations import Preset
from physics.html_table import parts_table
from physics.plan.explanation import Row, make_rows
from physics.scene.needs import find_needs, is_isotropic, is_tilted
from physics.scene.scene import Scene
from physics.schemes import scheme_for
from physics.schemes.scheme import Scheme, Switches
from physics.summary import parts_repr

# Largest number of effects that a `repr` names.
MOST_ROWS = 20


@dataclass(frozen=True)
class Plan(Switches):
    """Switches for which the kernel of a scene is compiled, the scheme that steps it, and rows that explain them."""

    scheme: Scheme
    rows: tuple[Row, ...]

    __repr__ = parts_repr
    _repr_html_ = parts_table

    def _parts(self) -> tuple[str, ...]:
        on = [row.effect for row in self.rows if row.is_on]
        return (*(f"{effect}: on" for effect in on[:MOST_ROWS]), f"{len(self.rows) - len(on)} off")

    @property
    def key(self) -> tuple:
        """Key of the compiled kernel: plans that need different kernels have different keys."""
        return (
            self.contact, self.friction, self.restitution, self.gravity, self.gyroscopic, self.offset_frame,
            self.pivots, self.integrator is None, self.scheme.name, self.scheme.is_error_controlled, self.ellipsoids,
            self.hulls, self.capsules, self.cylinders, self.compounds, self.sleeping, self.fixed, self.lone,
            self.grouped, self.features,
            self.material_columns > 0, self.walls_differ, self.pair_materials, self.motion_columns > 0, *self.laws,
            *(term.marker for term in self.terms),
        )  # fmt: skip

    @property
    def may_raise(self) -> bool:
        """True if a step may end in an exception, raised by a function of a user's field."""
        return any(slot.may_raise for slot in self.fields)

    def allows(self, moments: np.ndarray, R: np.ndarray) -> np.ndarray:
        """True for bodies whose rotation the kernel of this plan can compute, by their inertia tensors.

        Parameters
        ----------
        moments : (n, 3) float64
            Principal moments of n bodies [kg m²], as of `physics.mass.inertia.principal_axes`.
        R : (n, 3, 3) float64
            Rotations from the principal frame to the body frame.

        Returns
        -------
        (n,) bool
            False where the kernel lacks the gyroscopic torque or the principal axes that the body needs.
        """
        if not self.gyroscopic:
            return is_isotropic(moments)
        return ~is_tilted(R) | bool(self.offset_frame)

    def explain(self) -> str:
        """Explain the plan in a line for each effect: on or off, the reason, and the code compiled for it."""
        width = max(len(row.effect) for row in self.rows)
        lines = [
            f"{row.effect:<{width}}  {'on ' if row.is_on else 'off'}  {row.reason}"
            + (f" [{row.compiled}]" if row.compiled else "")
            for row in self.rows
        ]
        return "\n".join(lines)


def make_plan(scene: Scene, accuracy: Preset | Accuracy) -> Plan:
    """Choose the scheme, and the effects to compile, for a scene at an accuracy or a preset's name.

    Raises
    ------
    ValueError
        No scheme can step the scene at this accuracy; the message names the effect that is not supported.
    """
    validation.instance(scene, Scene, "scene", "a physics.Scene")
    accuracy = resolve(accuracy)
    needs = find_needs(scene)
    scheme, integrator = scheme_for(scene, needs, accuracy), INTEGRATORS[accuracy.scheme]
    pivots = needs.touching and not scheme.couples_bodies and accuracy.solver == "sweeps+pivoting"
    return Plan(
        contact=needs.touching or None,
        friction=needs.rubbing or None,
        restitution=needs.rebounding or None,
        gravity=(needs.gravity is not None) or None,
        gyroscopic=(not needs.isotropic) or None,
        offset_frame=(needs.turned or bool(needs.uneven)) or None,
        pivots=pivots or None,
        integrator=integrator if integrator > 0 else None,
        meeting=needs.meeting,
        fixed=needs.fixed or None,
        lone=needs.lone or None,
        grouped=needs.grouped or None,
        ellipsoids=needs.ellipsoids or None,
        hulls=needs.hulls or None,
        capsules=needs.capsules or None,
        cylinders=needs.cylinders or None,
        compounds=needs.compounds or None,
        sleeping=needs.sleeping or None,
        features=needs.features,
        fields=needs.fields,
        laws=needs.laws,
        material_columns=needs.material_columns,
        walls_differ=needs.walls_differ or None,
        pair_materials=needs.pair_materials or None,
        motion_columns=needs.motion_columns,
        scheme=scheme,
        rows=make_rows(scene, accuracy, needs, scheme.is_error_controlled and needs.touching),
    )
