"""Data of a patch: three or four contacts of one wall, a lane each, and the groups that its solvers share.

Vectors are in the stretched frame of `anisotropic_friction`; where friction is the same in all directions this is the
frame of the wall. Of three contacts the fourth lane is a copy of the third, which never pushes.
"""

from __future__ import annotations

from typing import NamedTuple

from physics.compiler.decorators import inlined
from physics.compiler.simd import Lanes
from physics.kernels.contact_law.anisotropic_friction import friction_ratio
from physics.kernels.contact_solver.one_contact import FreeBody
from physics.kernels.math.simd_gather import gather_column


class Patch(NamedTuple):
    """Contacts of one wall, a lane each.

    Attributes
    ----------
    points : tuple of 3 lanes
        Coordinates (normal, tangents) from the centre of mass [m].
    targets : tuple of 3 lanes
        Velocities aimed at along the same axes [m/s].
    mobility : lanes
        W_aa + W_bb of each contact [1/kg].
    """

    points: tuple
    targets: tuple
    mobility: Lanes


class PatchProblem(NamedTuple):
    """Contact problem of a patch.

    Attributes
    ----------
    patch : Patch
        The contacts.
    body : FreeBody
        The body without their impulses.
    mu : float
        Coefficient of friction along tangent a; 0 without friction.
    goal : float
        Tolerance of the residual [m/s].
    loose : float
        Speed up to which an open contact may close while it is sought which others push [m/s].
    """

    patch: Patch
    body: FreeBody
    mu: float
    goal: float
    loose: float


class NormalMotion(NamedTuple):
    """Motion along the normal that the pushing contacts must have, known before their impulses.

    Attributes
    ----------
    center : tuple of 3 floats
        Centroid (normal, tangents) of the contacts that push [m].
    wa, wb : float
        Angular velocity about the tangents [rad/s].
    push : float
        Sum of the normal impulses that it takes [N s].
    y0 : float
        Their mean [N s].
    gain : tuple of 2 floats
        Change of the angular velocity about the tangents that it takes [rad/s].
    """

    center: tuple
    wa: float
    wb: float
    push: float
    y0: float
    gain: tuple


class PatchFriction(NamedTuple):
    """Friction of the contacts, and their slip.

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
    """Coordinates of the contacts along an axis, from the centre of mass."""
    return (
        axis[0] * gather_column(contacts.arm, 0, n)
        + axis[1] * gather_column(contacts.arm, 1, n)
        + axis[2] * gather_column(contacts.arm, 2, n)
    )


@inlined
def gather_patch(n, body, scratch):
    """The `Patch` of the n contacts in `scratch`, on the wall of `body`."""
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
