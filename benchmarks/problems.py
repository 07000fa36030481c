"""Contact problems to compare solvers on: textbook ones, random ones, and those that hard cases begin with."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

import physics
from physics import scenes
from physics.kernels.multibody.data.allocation import make_bodies_workspace
from physics.kernels.multibody.data.arrays import NUM_CONTACTS, BodiesWorkspace
from physics.kernels.state import layout as at
from rigid_env.hard_cases.cases import arch, stacks

SETTINGS = {"relative_slop": 1e-6, "tolerance": 1e-6, "sweeps": 200, "splits": 8, "rest_share": 0.5}
STEP = 0.01  # of the worlds whose first problem is taken [s]


@dataclass(frozen=True)
class Complementarity:
    """0 <= z ⟂ M z + q >= 0.

    Attributes
    ----------
    name : str
    M : (n, n) float64
    q : (n,) float64
    is_feasible : bool
        False: there is no solution, and the right answer is to say so.
    """

    name: str
    M: np.ndarray
    q: np.ndarray
    is_feasible: bool = True


@dataclass(frozen=True)
class Frictional:
    """Contacts with Coulomb friction between bodies that move freely otherwise.

    Attributes
    ----------
    name : str
    many : Many
        Scratch with the bodies and contacts in it.
    count : int
        Contacts.
    twists : (bodies, 6) float64
        Velocities and angular velocities without any contact impulse, world frame [m/s, rad/s].
    """

    name: str
    many: BodiesWorkspace
    count: int
    twists: np.ndarray

    def dense(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Jacobian (3 n, 6 bodies), inverse mass matrix (6 bodies, 6 bodies) and free contact velocities (3 n,)."""
        many, bodies = self.many, len(self.twists)
        J, inverse = np.zeros((3 * self.count, 6 * bodies)), np.zeros((6 * bodies, 6 * bodies))
        for b in range(bodies):
            K = np.zeros((3, 3))
            K[np.triu_indices(3)] = many.bodies.inv_inertia[b]
            inverse[6 * b : 6 * b + 3, 6 * b : 6 * b + 3] = many.bodies.inv_mass[b] * np.eye(3)
            inverse[6 * b + 3 : 6 * b + 6, 6 * b + 3 : 6 * b + 6] = K + np.triu(K, 1).T
        for k in range(self.count):
            E = many.contacts.frame[k].reshape(3, 3)
            for b, r, sign in zip(many.contacts.bodies[k], many.contacts.arm[k].reshape(2, 3), (1, -1)):
                if b >= 0:
                    J[3 * k : 3 * k + 3, 6 * b : 6 * b + 3] += sign * E
                    J[3 * k : 3 * k + 3, 6 * b + 3 : 6 * b + 6] += sign * np.cross(r, E)
        return J, inverse, J @ self.twists.ravel() - many.contacts.target[: self.count].ravel()


def textbook() -> Iterator[Complementarity]:
    """Problems of the literature on pivoting methods, and of one block on a floor."""
    M = np.array([[1, -1, -1, -1], [-1, 1, -1, -1], [1, 1, 2, 0], [1, 1, 0, 2]], float)
    yield Complementarity("Murty 2.8", M, np.array([3.0, 5, -9, -5]))
    yield Complementarity("Kostreva 1979, cycles", np.array([[1.0, 2, 0], [0, 1, 2], [2, 0, 1]]), -np.ones(3))
    n = 8
    M = np.eye(n) + 2 * np.tril(np.ones((n, n)), -1)
    yield Complementarity("Murty 1978, n = 8", M, np.cumsum(-(2.0 ** np.arange(n - 1, -1, -1))))
    yield Complementarity("wedged between closing walls", np.array([[1.0, -1], [-1, 1]]), -np.ones(2), False)
    corners = [(x, -1.5, z) for x in (-2.5, 2.5) for z in (-1.0, 1.0)]
    for copies, name in ((1, "Baraff 1994, block on four corners"), (10, "the same, each corner ten times")):
        J = np.array([[0, 1, 0, *np.cross(r, (0, 1, 0))] for r in corners * copies])
        A = J @ np.diag(1 / np.array([6, 6, 6, 6.5, 14.5, 17.0])) @ J.T
        yield Complementarity(name, A, J @ [0.3, -1.0, 0.2, 0.4, 0.1, -0.3])


def random_complementarity(seed: int = 0) -> Iterator[Complementarity]:
    """Positive definite, and semidefinite of rank 6, as contacts of one body are."""
    rng = np.random.default_rng(seed)
    for n, rank in ((24, 24), (24, 6), (60, 6)):
        J = rng.normal(size=(n, rank))
        yield Complementarity(f"random, {n} unknowns, rank {rank}", J @ J.T, J @ rng.normal(size=rank))


def pile(seed: int, bodies: int, contacts: int, mu: float, masses: float = 1.0) -> Frictional:
    """Bodies on each other, each on the one before by `contacts` contacts at random places, falling onto each other.

    Masses are powers of `masses` at random; the lowest lies on a wall.
    """
    rng = np.random.default_rng(seed)
    many = make_bodies_workspace(bodies, np.zeros((1, at.WALL_SIZE)), **SETTINGS)
    mass = masses ** rng.uniform(-1, 1, bodies)
    many.bodies.body["mass"], many.bodies.body["radius"], many.bodies.inv_mass[:] = mass, 1.0, 1 / mass
    for b in range(bodies):
        A = rng.normal(size=(3, 3))
        K = (A @ A.T + np.eye(3)) / mass[b]
        many.bodies.inv_inertia[b] = K[np.triu_indices(3)]
    many.bodies.twist[:] = rng.normal(size=(bodies, 6))
    many.bodies.twist[:, 1] -= 3.0
    n = bodies * contacts
    for k in range(n):
        b = k // contacts
        normal = np.array([0, 1, 0]) + 0.3 * rng.normal(size=3)
        frame = np.linalg.qr(np.column_stack([normal, rng.normal(size=(3, 2))]))[0].T
        many.contacts.bodies[k] = (b, b - 1) if b > 0 else (0, -1)
        many.contacts.frame[k] = (frame * np.sign(frame[0] @ normal)).ravel()
        many.contacts.arm[k] = rng.normal(size=6)
    many.contacts.mu[:] = mu
    many.bodies.touched[:] = 1
    ratio = f", masses 1 : {masses**2:g}" if masses > 1.0 else ""
    return Frictional(f"pile of {bodies}, {contacts} contacts each, μ = {mu}{ratio}", many, n, many.bodies.twist.copy())


def beginning(name: str, scene: physics.Scene) -> Frictional:
    """The first problem of a scene that starts at rest, everything touching: loads of one step, no warm start."""
    world = physics.World(scene, dt=STEP)
    world.step()
    many = world.scratch[0]
    count = int(many.counts[NUM_CONTACTS])
    many.contacts.target[:count] = 0.0
    return Frictional(name, many, count, many.bodies.free_twist.copy())


def hard() -> Iterator[Frictional]:
    """Contact problems of hard cases: high, heavy, wide, and on the limit."""
    yield beginning("tower of 10", scenes.tower(10))
    yield beginning("tower of 50", scenes.tower(50))
    yield beginning("1,000,000 kg on 1 kg", stacks.tower([1.0, 1e6]))
    yield beginning("arch of 7 stones, 0.5 % above the limit", arch.arch(7, 1.005 * arch.least_thickness(7)))


def piles() -> Iterator[Frictional]:
    """Random piles: easy, of masses far apart, and such as wedge."""
    yield pile(0, 12, 4, 0.2)
    yield pile(0, 12, 4, 0.2, 100.0)
    yield pile(0, 12, 4, 0.2, 1000.0)
    yield pile(1, 12, 4, 0.5)
