"""A whole step of a rigid body on one page: the course notes of Witkin and Baraff [1]_ in plain NumPy. Read this first.

The exercise: a block of 5 x 3 x 2 m and 6 kg falls on the floor, then among three walls. SI units; world axes x right,
y up, z towards the viewer; body axes along the edges. The state, and how it changes under force F and torque τ:

    Y = (x, q, P, L)        position [m], unit quaternion (w, x, y, z) body to world, linear and angular momentum
    v = P/M,  ω = I⁻¹ L     velocity and angular velocity, with I⁻¹ = R I_body⁻¹ Rᵀ and R the rotation of q
    dY/dt = (v, ½ ω q, F, τ)

Point c of the block at the arm r from x, on a wall with the frame (n, t1, t2), has u = J (v, ω) along these axes. All
contacts together: J is (3k, 6), 𝓜 = diag(M, M, M, I), and A = J 𝓜⁻¹ Jᵀ the Delassus matrix. The stages of `step`,
which have the same names in `physics/kernels/event_driven/step.py`, where they are fast and exact instead of short:

1. Hold loads         F = M g, τ = 0: gravity exerts no torque                           `derivative`
2. Find contacts      vertices whose gap n·(x + r) - offset is zero                      `find_contacts`
3. Resolve impacts    0 <= p_n ⟂ u_n⁺ + e u_n⁻ >= 0, u⁺ = u⁻ + A p, all at once          `resolve_impacts`
4. Limit the stage    bisection to the time of impact, or to the end of a slip           `limit_stage`
5. Integrate          RK4, with resting forces 0 <= f_n ⟂ a_n >= 0, a = A f + b          `rk4`, `resting_contact`
6. Correct positions  g_n = 0 and u = 0 of contacts that hold, by the least change       `correct_positions`
7. Rest               nothing changes where dY/dt = 0                                    `step`

Both problems are complementarity problems, solved by Lemke's method [2]_. Friction is Coulomb's, |f_t| <= μ f_n, against
the slip; in an impact against the slip after it. Simultaneous impacts are Baraff's [3]_. No wall is missed if `h` is so
short that no vertex dips into it and out again. Newton's law of restitution may gain energy where friction turns a slip
round; the kernels limit that, this page does not.

.. [1] A. Witkin, D. Baraff, *Physically Based Modeling*, SIGGRAPH course notes, 1997, Rigid Body Simulation I and II.
.. [2] R. W. Cottle, J.-S. Pang, R. E. Stone, *The Linear Complementarity Problem*, 2009, section 4.4.
.. [3] D. Baraff, *Analytical methods for dynamic simulation of non-penetrating rigid bodies*, SIGGRAPH 1989.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

TOUCH = 1e-8  # gap that counts as zero [m]
SLOW = 1e-7  # speed of a contact that counts as zero [m/s]: slower ones do not bounce and do not slip
ROUNDING = 1e-12  # velocity that rounding leaves [m/s], and the residual of a complementarity problem [1]
INSTANT = 1e-13  # length at which bisection ends [s]
FAN = 2.0 ** -np.arange(45) * np.pi / 3  # half-widths of the fans of friction directions, one after the other [rad]


@dataclass(frozen=True)
class HalfSpace:
    """Wall: the block may be where normal·x >= offset; `normal` has unit length."""

    normal: tuple[float, float, float]
    offset: float = 0.0


FLOOR = HalfSpace((0.0, 1.0, 0.0))
THREE_WALLS = (FLOOR, HalfSpace((1.0, 0.0, 0.0), -10.0), HalfSpace((-1.0, 0.0, 0.0), -10.0))


@dataclass(frozen=True)
class Scene:
    """Block of edges `size` [m] and `mass` [kg] at walls; gravity [m/s²], restitution e, friction μ."""

    size: tuple[float, float, float] = (5.0, 3.0, 2.0)
    mass: float = 6.0
    walls: tuple[HalfSpace, ...] = THREE_WALLS
    gravity: tuple[float, float, float] = (0.0, -9.81, 0.0)
    restitution: float = 0.3
    friction: float = 0.5

    @cached_property
    def inertia_body(self):
        """(3,) moments I_body [kg m²]: of a block M (b² + c²)/12 about the axis of edge a."""
        square = np.square(self.size)
        return self.mass / 12 * (square.sum() - square)

    @cached_property
    def vertices(self):
        """(8, 3) in the body frame [m]; bit j of the number of a vertex: the + side of axis j."""
        return (np.arange(8)[:, None] >> np.arange(3) & 1) * np.array(self.size) - np.array(self.size) / 2

    @cached_property
    def frames(self):
        """(walls, 3, 3) with the rows n, t1, t2."""
        n = np.array([wall.normal for wall in self.walls]).reshape(-1, 3)
        t1 = np.cross(n, np.eye(3)[np.abs(n).argmin(axis=1)])
        t1 /= np.linalg.norm(t1, axis=1, keepdims=True)
        return np.stack([n, t1, np.cross(n, t1)], axis=1)


def make_state(scene, pos, quat=(1, 0, 0, 0), linvel=(0, 0, 0), angvel=(0, 0, 0)):
    """Y (13,) of position [m], attitude, velocity [m/s] and angular velocity [rad/s], world frame."""
    R = rotation(np.array(quat, dtype=float))
    return np.concatenate([pos, quat, scene.mass * np.array(linvel), R * scene.inertia_body @ R.T @ angvel], dtype=float)


def star(a):
    """Matrix a* with a* b = a x b."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def rotation(q):
    """Rotation matrix R (3, 3), body to world."""
    skew = star(q[1:])
    return np.eye(3) + 2 / (q @ q) * (q[0] * skew + skew @ skew)


def auxiliary(scene, Y):
    """R, I⁻¹ in the world frame, v and ω."""
    R = rotation(Y[3:7])
    inverse = R / scene.inertia_body @ R.T
    return R, inverse, Y[7:10] / scene.mass, inverse @ Y[10:]


def spin(w, q):
    """½ ω q, the product of the quaternions (0, ω) and q."""
    return 0.5 * np.array([-w @ q[1:], *(q[0] * w + star(w) @ q[1:])])


def derivative(scene, Y, contacts):
    """dY/dt, with the forces of contacts that rest."""
    _, _, v, w = auxiliary(scene, Y)
    load = np.concatenate([scene.mass * np.array(scene.gravity), np.zeros(3)])
    if len(contacts):
        J, f, _ = resting_contact(scene, Y, contacts)
        load += J.T @ f
    return np.concatenate([v, spin(w, Y[3:7]), load])


def gaps(scene, Y):
    """(8, walls) distances of the vertices from the walls [m]; negative inside."""
    points = Y[:3] + scene.vertices @ rotation(Y[3:7]).T
    return points @ scene.frames[:, 0].T - [wall.offset for wall in scene.walls]


def find_contacts(scene, Y):
    """(k, 2) vertex and wall of each contact that touches."""
    return np.argwhere(gaps(scene, Y) <= TOUCH)


def contact_jacobian(scene, Y, contacts):
    """J (3k, 6), its rows n, t1, t2 of each contact; 𝓜⁻¹ (6, 6)."""
    R, inverse, _, _ = auxiliary(scene, Y)
    E, r = scene.frames[contacts[:, 1]], scene.vertices[contacts[:, 0]] @ R.T
    J = np.concatenate([E, np.cross(r[:, None], E)], axis=2).reshape(-1, 6)  # n·(v + ω x r) = n·v + (r x n)·ω
    inverse_mass = np.zeros((6, 6))
    inverse_mass[:3, :3], inverse_mass[3:, 3:] = np.eye(3) / scene.mass, inverse
    return J, inverse_mass


def contact_velocities(scene, Y, contacts):
    """u (k, 3): normal and tangential velocities of contacts [m/s]."""
    _, _, v, w = auxiliary(scene, Y)
    return (contact_jacobian(scene, Y, contacts)[0] @ np.concatenate([v, w])).reshape(-1, 3)


def resolve_impacts(scene, Y):
    """Y after the impacts of all contacts that touch; again where a contact approaches after them."""
    Y = Y.copy()
    for _ in range(100):
        contacts = find_contacts(scene, Y)
        u = contact_velocities(scene, Y, contacts)
        if (u[:, 0] >= -ROUNDING).all():
            return Y
        J, inverse_mass = contact_jacobian(scene, Y, contacts)
        rebound = np.where(np.abs(u[:, 0]) > SLOW, scene.restitution * u[:, 0], 0.0)
        u[:, 0] += rebound  # p makes this, at the end, u⁺ + e u⁻
        Y[7:] += J.T @ solve_contacts(J @ inverse_mass @ J.T, u.ravel(), scene.friction, np.zeros((len(u), 2)))
    raise ArithmeticError("contacts still approach after 100 impacts at one time")


def resting_contact(scene, Y, contacts):
    """J, forces f [N] and accelerations a [m/s²], (3k,) each, of contacts that neither approach nor leave."""
    R, inverse, v, w = auxiliary(scene, Y)
    J, inverse_mass = contact_jacobian(scene, Y, contacts)
    turn = inverse @ -np.cross(w, Y[10:])  # ω̇ without contact forces, from L̇ = 0
    r = scene.vertices[contacts[:, 0]] @ R.T
    free = np.array(scene.gravity) + np.cross(turn, r) + np.cross(w, np.cross(w, r))
    b = np.einsum("kij,kj->ki", scene.frames[contacts[:, 1]], free).ravel()
    slip = (J @ np.concatenate([v, w])).reshape(-1, 3)[:, 1:]
    speed = np.linalg.norm(slip, axis=1, keepdims=True)
    slip = np.where(speed > SLOW, slip / np.maximum(speed, SLOW), 0.0)
    A = J @ inverse_mass @ J.T
    f = solve_contacts(A, b, scene.friction, slip)
    return J, f, A @ f + b


def solve_contacts(A, b, mu, slip):
    """Forces f (3k,) of 0 <= f_n ⟂ a_n >= 0 with a = A f + b, and friction; or impulses p, with velocities for a.

    Where `slip` (k, 2) is a unit vector, f_t = -μ f_n slip. Where it is zero, f_t = -μ f_n a_t/|a_t|, or a_t = 0 and
    |f_t| <= μ f_n. Lemke's method solves this with a polygon for the circle |f_t| <= μ f_n, Newton's method then with
    the circle, from there. Numbers are scaled to 1.
    """
    scale, unit = A.diagonal().max(), np.abs(b).max() or 1.0
    A, b = A / scale, b / unit
    for corners in (8, 32, 128):
        f = solve_polygon(A, b, mu, slip, corners)
        for _ in range(10):
            F = natural_map(A, b, mu, slip, f)
            if np.abs(F).max() <= ROUNDING * max(1.0, np.abs(f).max()):
                return f * unit / scale
            J = [(natural_map(A, b, mu, slip, f + change) - F) / 1e-7 for change in 1e-7 * np.eye(len(f))]
            f = f - np.linalg.lstsq(np.array(J).T, F, rcond=1e-6)[0]
    raise ArithmeticError("no forces found that obey Coulomb's law; there are none in Painlevé's paradox")


def natural_map(A, b, mu, slip, f):
    """Residual of the contact law (3k,): f less its projection f - a onto the cone, zero at solutions."""
    trial = (f - A @ f - b).reshape(-1, 3)
    f = f.reshape(-1, 3)
    push, length = np.maximum(trial[:, 0], 0.0), np.linalg.norm(trial[:, 1:], axis=1)
    friction = trial[:, 1:] * (np.minimum(1.0, mu * push / np.maximum(length, 1e-300)))[:, None]
    friction = np.where(slip.any(axis=1, keepdims=True), -mu * push[:, None] * slip, friction)
    return (f - np.column_stack([push, friction])).ravel()


def solve_polygon(A, b, mu, slip, corners):
    """The same with |f_t| <= μ f_n replaced by f_t = Σ β d, β >= 0, Σ β <= μ f_n, over directions d [4]_."""
    k = len(slip)
    held = np.flatnonzero(~slip.any(axis=1)) if mu > 0 else np.arange(0)
    directions = np.exp(2j * np.pi * np.arange(corners) / corners)
    N, H, D = np.zeros((3 * k, k)), np.zeros((3 * k, k)), np.zeros((3 * k, len(held), corners))
    N[::3] = H[::3] = np.eye(k)
    H[1::3], H[2::3] = -mu * np.diag(slip[:, 0]), -mu * np.diag(slip[:, 1])
    for i, c in enumerate(held):
        D[3 * c + 1, i], D[3 * c + 2, i] = directions.real, directions.imag
    D = D.reshape(3 * k, -1)
    owner = np.kron(np.eye(len(held)), np.ones((corners, 1)))
    tests, forces = np.hstack([N, D]), np.hstack([H, D])
    M = np.block([
        [tests.T @ A @ forces, np.vstack([np.zeros((k, len(held))), owner])],
        [mu * np.eye(k)[held], -owner.T, np.zeros((len(held), len(held)))],
    ])  # fmt: skip
    return forces @ lemke(M, np.concatenate([tests.T @ b, np.zeros(len(held))]))[: forces.shape[1]]


def lemke(M, q):
    """Solution z of w = M z + q, w >= 0, z >= 0, z·w = 0, by complementary pivoting with the lexicographic rule."""
    n = len(q)
    T = np.hstack([np.eye(n), -M, -np.ones((n, 1)), q[:, None]])  # columns w, z, the artificial z0, right-hand side
    basis, entering, rows = np.arange(n), 2 * n, np.arange(n)
    if (q >= 0).all():
        return np.zeros(n)
    ratio_of = np.ones(n)
    for _ in range(50 * n):
        for column in (-1, *range(n)):  # the least ratio; of equals the next column decides, so that nothing cycles
            ratio = T[rows, column] / ratio_of[rows]
            rows = rows[ratio <= ratio.min() + 1e-12 * max(1.0, abs(ratio.min()))]
            if column == -1 and entering != 2 * n and 2 * n in basis[rows]:
                rows = rows[basis[rows] == 2 * n]
            if len(rows) == 1:
                break
        row = rows[0]
        T[row] /= T[row, entering]
        others = np.arange(n) != row
        T[others] -= np.outer(T[others, entering], T[row])
        leaving, basis[row] = basis[row], entering
        if leaving == 2 * n:
            z = np.zeros(2 * n + 1)
            z[basis] = np.maximum(T[:, -1], 0.0)
            return z[n : 2 * n]
        entering = (leaving + n) % (2 * n)
        ratio_of = T[:, entering]
        rows = np.flatnonzero(ratio_of > 1e-11)
        if not len(rows):
            raise ArithmeticError("Lemke's method ends in a ray")
    raise ArithmeticError("Lemke's method does not end")


def rk4(scene, Y, contacts, h):
    """Y after h [s] by the classical Runge-Kutta method, with these resting contacts."""
    k1 = derivative(scene, Y, contacts)
    k2 = derivative(scene, Y + h / 2 * k1, contacts)
    k3 = derivative(scene, Y + h / 2 * k2, contacts)
    k4 = derivative(scene, Y + h * k3, contacts)
    Y = Y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    Y[3:7] /= np.linalg.norm(Y[3:7])
    return Y


def limit_stage(scene, Y, contacts, h):
    """Length of the stage: h, or the time at which first a vertex meets a wall or a slip comes to its end."""
    lowest = np.minimum(gaps(scene, Y), 0.0)
    lowest[tuple(contacts.T)] = -TOUCH
    u = contact_velocities(scene, Y, contacts)[:, 1:]
    slides = np.linalg.norm(u, axis=1) > SLOW

    def is_over(t):
        end = rk4(scene, Y, contacts, t)
        slip = np.sum(u * contact_velocities(scene, end, contacts)[:, 1:], axis=1)
        return (gaps(scene, end) < lowest).any() or (slip[slides] <= 0.0).any()

    if not is_over(h):
        return h
    before, after = 0.0, h
    while after - before > INSTANT:
        middle = (before + after) / 2
        before, after = (before, middle) if is_over(middle) else (middle, after)
    return after


def correct_positions(scene, Y, contacts):
    """Y moved onto the walls of contacts that hold: the least change for which their gaps and speeds are zero."""
    _, _, a = resting_contact(scene, Y, contacts)
    a = a.reshape(-1, 3)
    u = contact_velocities(scene, Y, contacts)
    J, inverse_mass = contact_jacobian(scene, Y, contacts)
    at_rest = np.abs(a) < 1e-6
    slow = np.linalg.norm(u[:, 1:], axis=1) <= 1e-6
    at_rest[:, 1:] &= (slow & at_rest[:, 1:].all(axis=1))[:, None]
    rows = J[at_rest.ravel()]
    Y[7:] -= rows.T @ np.linalg.pinv(rows @ inverse_mass @ rows.T, hermitian=True, rcond=1e-10) @ u[at_rest]
    rows = J[::3][at_rest[:, 0]]
    gap = gaps(scene, Y)[tuple(contacts[at_rest[:, 0]].T)]
    move = -inverse_mass @ rows.T @ np.linalg.pinv(rows @ inverse_mass @ rows.T, hermitian=True, rcond=1e-10) @ gap
    Y[:3] += move[:3]
    Y[3:7] += spin(move[3:], Y[3:7])
    Y[3:7] /= np.linalg.norm(Y[3:7])
    return Y


def step(scene, Y, h):
    """Y after h [s]."""
    while h > 0.0:
        Y = resolve_impacts(scene, Y)
        contacts = find_contacts(scene, Y)
        contacts = contacts[contact_velocities(scene, Y, contacts)[:, 0] <= SLOW]
        if np.abs(derivative(scene, Y, contacts)).max() < 1e-9:
            return Y
        stage = limit_stage(scene, Y, contacts, h)
        Y = rk4(scene, Y, contacts, stage)
        if len(contacts):
            Y = correct_positions(scene, Y, contacts)
        h -= stage
    return Y
