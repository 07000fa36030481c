"""Data of a patch, three or four contacts of one wall, that its solvers share: one SIMD lane for each contact.

Vectors have the components (normal, tangent a, tangent b) in the stretched frame of `anisotropic_friction`. If friction
is the same in all directions, this is the frame of the wall. For three contacts the fourth lane is a copy of the third,
which never pushes.
"""

from __future__ import annotations

from typing import NamedTuple

from physics.compiler.decorators import inlined
from physics.compiler.simd import Lanes
from physics.kernels.contact_law.anisotropic_friction import friction_ratio
from physics.kernels.contact_solver.one_contact import FreeBody
from physics.kernels.math.simd_gather import gather_column


class Patch(NamedTuple):
    """Geometry and targets of the contacts of one wall, one lane for each contact.

    Attributes
    ----------
    points : tuple of 3 lanes
        Coordinates (normal, tangents) from the centre of mass [m].
    targets : tuple of 3 lanes
        Target velocities along the same axes [m/s].
    mobility : lanes
        W_aa + W_bb of each contact [1/kg].
    """

    points: tuple
    targets: tuple
    mobility: Lanes


class PatchProblem(NamedTuple):
    """Contact problem of a patch: its contacts, the body without contact impulses, and tolerances.

    Attributes
    ----------
    patch : Patch
        The contacts.
    body : FreeBody
        The body without contact impulses.
    mu : float
        Coefficient of friction along tangent a; 0 without friction.
    goal : float
        Tolerance of the residual [m/s].
    loose : float
        Larger tolerance: speed up to which an open contact may close while the pushing contacts are searched [m/s].
    """

    patch: Patch
    body: FreeBody
    mu: float
    goal: float
    loose: float


class NormalMotion(NamedTuple):
    """Velocity along a wall's normal and turning about its tangents, by which pushing contacts meet normal targets.

    This motion is known before the impulses are.

    Attributes
    ----------
    center : tuple of 3 floats
        Centroid (normal, tangents) of the contacts that push [m].
    wa, wb : float
        Angular velocity about the tangents, after the impulses [rad/s].
    push : float
        Sum of the normal impulses [N s].
    y0 : float
        Mean of the normal impulses [N s].
    gain : tuple of 2 floats
        Change of the angular velocity about the tangents by the impulses [rad/s].
    """

    center: tuple
    wa: float
    wb: float
    push: float
    y0: float
    gain: tuple


class PatchFriction(NamedTuple):
    """Friction of the contacts of a patch per normal impulse, and their slip speeds.

    Attributes
    ----------
    x, y : lanes
        Impulses along the tangents a and b per normal impulse: -μ d where a contact slides in the direction d, -μ z
        with |z| <= 1 anywhere in the disc, 0 where it is open.
    speed : lanes
        Size of the tangential velocity less its target [m/s].
    """

    x: Lanes
    y: Lanes
    speed: Lanes


@inlined
def patch_coordinates_along(axis, n, contacts):
    """Coordinates of the first n contacts along an axis, from the centre of mass, one lane each [m]."""
    return (
        axis[0] * gather_column(contacts.arm, 0, n)
        + axis[1] * gather_column(contacts.arm, 1, n)
        + axis[2] * gather_column(contacts.arm, 2, n)
    )


@inlined
def gather_patch(n, body, scratch):
    """Gather the `Patch` of the n contacts in `scratch`, in the frame of the wall that `body` (`FreeBody`) is in."""
    contacts = scratch.contacts
    axes, inv_mass, K, ratio = body.axes, body.inv_mass, body.K, friction_ratio(scratch.body)
    c, a, b = (
        ratio * patch_coordinates_along(axes[0], n, contacts),
        ratio * patch_coordinates_along(axes[1], n, contacts),
        patch_coordinates_along(axes[2], n, contacts),
    )
    target = (
        gather_column(contacts.target, 0, n),
        gather_column(contacts.target, 1, n),
        ratio * gather_column(contacts.target, 2, n),
    )
    mass_b = ratio * ratio * inv_mass
    mobility = (inv_mass + mass_b) + K[0] * (a * a + b * b) - 2.0 * c * (K[1] * a + K[2] * b) + c * c * (K[3] + K[5])
    return Patch((c, a, b), target, mobility)
