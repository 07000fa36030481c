"""Data of `two_contacts`: one or two contacts of a wall, their contact problem, and trial impulses for it."""

from __future__ import annotations

from typing import NamedTuple

from physics.compiler.decorators import inlined
from physics.kernels.contact_law.anisotropic_friction import friction_ratio
from physics.kernels.contact_solver.one_contact import point_velocity
from physics.kernels.math import quaternion as qt


class WallContact(NamedTuple):
    """One contact in the stretched frame (normal, tangents) of its wall (`anisotropic_friction`).

    Attributes
    ----------
    place : tuple of 3 floats
        Coordinates from the centre of mass [m].
    approach : tuple of 3 floats
        Velocity without contact impulses, less the target [m/s].
    impulse : tuple of 3 floats
        Impulse of the warm start [N s]; 0 without friction.
    """

    place: tuple
    approach: tuple
    impulse: tuple


class PairProblem(NamedTuple):
    """Contact problem of two contacts: u_1 = W_11 p_1 + W_12 p_2 + b_1, u_2 = W_12ᵀ p_1 + W_22 p_2 + b_2.

    Attributes
    ----------
    W11, W12, W22 : tuple of 9 floats
        Blocks of the Delassus matrix, row by row [1/kg].
    b1, b2 : tuple of 3 floats
        Velocities without contact impulses, less the targets [m/s].
    mu : float
        Coefficient of friction.
    goal : float
        Tolerance of the residual [m/s].
    """

    W11: tuple
    W12: tuple
    W22: tuple
    b1: tuple
    b2: tuple
    mu: float
    goal: float


class PairTrial(NamedTuple):
    """Trial impulses of two contacts, and the state from which the search continues.

    Attributes
    ----------
    found : bool
        True if the impulses solve the problem.
    p, q : tuple of 3 floats
        Impulses of the first and of the second contact [N s].
    miss : float
        Residual [m/s].
    first, second : tuple of 2 floats
        Friction -μ d per normal impulse of each contact, with its direction d of sliding.
    """

    found: bool
    p: tuple
    q: tuple
    miss: float
    first: tuple
    second: tuple


class SlidingPair(NamedTuple):
    """Two contacts that slide in given directions, with normal impulses by which normal velocities meet their targets.

    Attributes
    ----------
    p1, p2 : float
        Normal impulses [N s].
    miss1, miss2 : float
        Residuals [m/s]; infinite where a contact moves backwards.
    inverse : tuple of 4 floats
        Matrix (a_11, a_12, a_21, a_22) of normal velocities per normal impulse, divided by its determinant [kg].
    g11, g12, g21, g22 : tuple of 2 floats
        g_ij: tangential velocity of contact i per normal impulse of contact j and its friction [1/kg].
    along1, along2 : float
        Velocities along the directions, times μ [m/s].
    across1, across2 : float
        Velocities across the directions, times μ [m/s].
    """

    p1: float
    p2: float
    miss1: float
    miss2: float
    inverse: tuple
    g11: tuple
    g12: tuple
    g21: tuple
    g22: tuple
    along1: float
    along2: float
    across1: float
    across2: float


@inlined
def swap_pair_problem(pair):
    """Return a `PairProblem` with its two contacts in the opposite order."""
    return PairProblem(pair.W22, transpose_block(pair.W12), pair.W11, pair.b2, pair.b1, pair.mu, pair.goal)


@inlined
def swap_pair_trial(trial):
    """Return a `PairTrial` with its two contacts in the opposite order."""
    return PairTrial(trial.found, trial.q, trial.p, trial.miss, trial.second, trial.first)


@inlined
def contact_in_wall_frame(i, body, scratch):
    """Make the `WallContact` of contact i of a `FreeBody`, with its warm start from `contacts.impulse`."""
    contacts = scratch.contacts
    axes, u, w = body.axes, body.u, body.w
    arm, ratio = (contacts.arm[i, 0], contacts.arm[i, 1], contacts.arm[i, 2]), friction_ratio(scratch.body)
    place = (ratio * qt.dot(axes[0], arm), ratio * qt.dot(axes[1], arm), qt.dot(axes[2], arm))
    f, impulse = point_velocity(place, u, w), (0.0, 0.0, 0.0)
    if scratch.body.mu > 0.0:
        impulse = (contacts.impulse[3 * i], contacts.impulse[3 * i + 1], contacts.impulse[3 * i + 2] / ratio)
    approach = f[0] - contacts.target[i, 0], f[1] - contacts.target[i, 1], f[2] - ratio * contacts.target[i, 2]
    return WallContact(place, approach, impulse)


@inlined
def transpose_block(W):
    """Transpose a 3x3 block, given row by row."""
    return W[0], W[3], W[6], W[1], W[4], W[7], W[2], W[5], W[8]
