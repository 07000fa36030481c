"""One rigid block or sphere against half-spaces: state, contacts, kinematics. Plain NumPy, no kernel of the engine."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from physics.scene.effects import Contact, Friction, Gravity
from physics.scene.scene import Scene
from tests.reference.rigid_body import rotation_matrix

POS, QUAT, VEL, ANGVEL, GAPS = slice(0, 3), slice(3, 7), slice(7, 10), slice(10, 13), slice(13, -1)
TWIST = slice(7, 13)
CLOCK = -1  # time since the contact mode began [s]


def skew(a):
    """The matrix (3, 3) of a x."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


class Problem(NamedTuple):
    """Problem of one body, its walls and its loads; SI units, world frame unless said otherwise.

    A contact is a pair of a wall and a point of the body; its number is ``wall * len(points) + point``.
    A block's points are its vertices (bit j of the number set: the + side of body axis j). A sphere has one,
    at -radius n from its centre for the wall of normal n, whatever its attitude.
    """

    mass: float
    inertia: np.ndarray  # (3, 3), body frame
    inverse_inertia: np.ndarray
    points: np.ndarray  # (k, 3), from the centre of mass, body frame; of a sphere one row of zeros
    radius: float  # of a sphere; 0 for a block
    frames: np.ndarray  # (walls, 3, 3): rows normal, tangent 1, tangent 2
    offsets: np.ndarray  # (walls,)
    gravity: np.ndarray
    force: np.ndarray  # constant, besides gravity
    torque: np.ndarray  # constant, about the centre of mass
    restitution: float
    friction: float

    @property
    def contact_count(self) -> int:
        """Walls times points."""
        return len(self.offsets) * len(self.points)

    def wall(self, contact) -> int:
        """The wall of a contact."""
        return contact // len(self.points)

    def name(self, contact) -> list:
        """[vertex, wall] of a contact, as events tell it."""
        return [int(contact % len(self.points)), int(self.wall(contact))]


def _frame(normal):
    """Rows normal, tangent 1, tangent 2, right-handed."""
    normal = np.asarray(normal, float)
    other = np.eye(3)[np.argmin(np.abs(normal))]
    tangent = np.cross(other, normal)
    tangent /= np.linalg.norm(tangent)
    return np.array([normal, tangent, np.cross(normal, tangent)])


def from_scene(scene: Scene, force=(0, 0, 0), torque=(0, 0, 0)):
    """(Problem, y) of a scene of one block or sphere; `force` and `torque` are constant, world frame."""
    body = scene.bodies[0]
    gravity, contact, friction = (scene.effect(kind) for kind in (Gravity, Contact, Friction))
    is_sphere = body.kind == "sphere"
    signs = np.array([bits[::-1] for bits in itertools.product((-1.0, 1.0), repeat=3)])
    problem = Problem(
        mass=body.mass,
        inertia=body.inertia,
        inverse_inertia=np.linalg.inv(body.inertia),
        points=np.zeros((1, 3)) if is_sphere else signs * body.dimensions + body.center,
        radius=body.dimensions[0] if is_sphere else 0.0,
        frames=np.array([_frame(wall.normal) for wall in scene.walls]).reshape(-1, 3, 3),
        offsets=np.array([wall.offset for wall in scene.walls], float),
        gravity=np.array(gravity.acceleration if gravity else (0.0, 0.0, 0.0), float),
        force=np.array(force, float),
        torque=np.array(torque, float),
        restitution=(contact.restitution or 0.0) if contact else 0.0,
        friction=friction.coefficient if friction else 0.0,
    )
    return problem, start(problem, body.pos, body.quat, body.linvel, body.angvel)


def start(problem: Problem, pos, quat, linvel, angvel):
    """The state vector y = (x, q, v, ω, gaps, clock) of the reference."""
    y = np.concatenate([pos, np.asarray(quat, float) / np.linalg.norm(quat), linvel, angvel])
    return np.concatenate([y, gaps(problem, y), [0.0]])


def arms(problem: Problem, y):
    """(contacts, 3) from the centre of mass to the place of each contact, world frame [m]."""
    if problem.radius:
        return -problem.radius * problem.frames[:, 0]
    return np.tile(problem.points @ rotation_matrix(y[QUAT]).T, (len(problem.offsets), 1))


def gaps(problem: Problem, y):
    """(contacts,) distances to the walls, from position and attitude [m]."""
    normals = np.repeat(problem.frames[:, 0], len(problem.points), axis=0)
    return np.sum(normals * (y[POS] + arms(problem, y)), axis=1) - np.repeat(problem.offsets, len(problem.points))


def normal_speeds(problem: Problem, y):
    """(contacts,) rates of the gaps, n·(v + ω x r) [m/s]; of a sphere the arm is along n and ω drops out."""
    normals = np.repeat(problem.frames[:, 0], len(problem.points), axis=0)
    return np.sum(normals * (y[VEL] + arms(problem, y) @ skew(y[ANGVEL]).T), axis=1)


def jacobian(problem: Problem, y, contacts):
    """(n, 3, 6): twist to velocity of the contacts, components normal, tangent 1, tangent 2."""
    r = arms(problem, y)
    rows = []
    for contact in contacts:
        frame = problem.frames[problem.wall(contact)]
        rows.append(np.hstack([frame, -frame @ skew(r[contact])]))
    return np.array(rows).reshape(-1, 3, 6)


def convective(problem: Problem, y, contacts):
    """(n, 3): what a contact accelerates besides v̇ + ω̇ x r: ω x (ω x r), for a sphere 0 since ṙ = 0."""
    if problem.radius:
        return np.zeros((len(contacts), 3))
    spin = skew(y[ANGVEL])
    turned = arms(problem, y) @ (spin @ spin).T
    return np.array([problem.frames[problem.wall(c)] @ turned[c] for c in contacts]).reshape(-1, 3)


def inverse_mass(problem: Problem, y):
    """(6, 6) M⁻¹, world frame, about the centre of mass."""
    R = rotation_matrix(y[QUAT])
    inverse = np.zeros((6, 6))
    inverse[:3, :3] = np.eye(3) / problem.mass
    inverse[3:, 3:] = R @ problem.inverse_inertia @ R.T
    return inverse


def free_acceleration(problem: Problem, y):
    """(6,) of the twist without contact: g + F/m, I⁻¹(τ - ω x Iω)."""
    R = rotation_matrix(y[QUAT])
    omega = y[ANGVEL]
    torque = problem.torque - skew(omega) @ (R @ (problem.inertia @ (R.T @ omega)))
    spin = R @ (problem.inverse_inertia @ (R.T @ torque))
    return np.concatenate([problem.gravity + problem.force / problem.mass, spin])


def quaternion_rate(y):
    """q̇ = ½ ω q."""
    q, omega = y[QUAT], y[ANGVEL]
    return 0.5 * np.array([-omega @ q[1:], *(q[0] * omega + skew(omega) @ q[1:])])


def energy(problem: Problem, y):
    """Kinetic energy and that in gravity and in the constant force [J]."""
    R = rotation_matrix(y[QUAT])
    kinetic = problem.mass * y[VEL] @ y[VEL] + y[ANGVEL] @ R @ problem.inertia @ R.T @ y[ANGVEL]
    return 0.5 * kinetic - (problem.mass * problem.gravity + problem.force) @ y[POS]
