"""A whole step of a rigid body on one page: the course notes of Witkin and Baraff [1]_ in plain NumPy. Read this first.

The exercise: a block of 5 x 3 x 2 m and 6 kg falls on the floor, then among three walls. Units are SI; world axes are x
right, y up, z towards the viewer; the block's own axes are its edges. The state and its rate, with force F, torque τ:

    Y = (x, q, P, L)          position, unit quaternion (w, x, y, z) body to world, linear and angular momentum
    v = P/M,    ω = I⁻¹ L     velocities, where I⁻¹ = R I_body⁻¹ Rᵀ and R is the rotation matrix of q
    dY/dt = (v, ½ ω q, F, τ)

A vertex at the arm r from x touches a wall: u is its velocity along the axes n, t1, t2 of the wall, n out of the wall.
All k contacts together have u = J (v, ω) and A = J diag(M, I)⁻¹ Jᵀ, the Delassus matrix. `step` repeats these stages,
until its time is used up. They have the same names in `physics/kernels/event_driven/step.py`.

1. Hold loads         F = M g, and τ = 0: gravity exerts no torque                        `derivative`
2. Find contacts      vertices whose gap n·(x + r) - offset is zero                       `find_contacts`
3. Resolve impacts    impulses p: 0 <= p_n ⟂ u_n⁺ + e u_n⁻ >= 0, u⁺ = u⁻ + A p            `resolve_impacts`
4. Limit the stage    bisection to the time of impact, or to the end of a slip            `limit_stage`
5. Integrate          RK4, with forces f of resting contacts: 0 <= f_n ⟂ a_n >= 0,        `rk4`, `resting_contact`
                      accelerations a = A f + b
6. Correct positions  the least change that makes gaps and velocities of contacts zero    `correct_positions`
7. Rest               nothing changes where dY/dt = 0                                     `step`

Friction is Coulomb's, |f_t| <= μ f_n against the slip; in an impact, against the slip after it. All contacts take part
at once in one complementarity problem [2]_ [3]_. Without position correction, resting contacts would drift by the error
of RK4. Two limits: a vertex that dips into a wall and out again within h is not seen; and an impact with friction may
gain energy (Kane's paradox), which the kernels prevent.

.. [1] A. Witkin, D. Baraff, *Physically Based Modeling*, SIGGRAPH course notes, 1997: Rigid Body Simulation I and II.
.. [2] D. Baraff, *Analytical methods for dynamic simulation of non-penetrating rigid bodies*, SIGGRAPH 1989.
.. [3] D. E. Stewart, J. C. Trinkle, *An implicit time-stepping scheme for rigid body dynamics*, IJNME 39, 1996.
.. [4] R. W. Cottle, J.-S. Pang, R. E. Stone, *The Linear Complementarity Problem*, 2009, section 4.4.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

TOUCH = 1e-8  # gap that counts as zero [m]
SLOW = 1e-6  # contact velocity that counts as zero [m/s]: it neither bounces nor slips
STILL = 1e-6  # contact acceleration that counts as zero [m/s²]
INSTANT = 1e-13  # length at which bisection ends [s]
ROUNDING = 1e-12  # residual that rounding leaves; of velocities [m/s]


@dataclass(frozen=True)
class HalfSpace:
    """Wall: bodies may be where normal·x >= offset [m]; `normal` has unit length."""

    normal: tuple[float, float, float]
    offset: float = 0.0


THREE_WALLS = (HalfSpace((0, 1, 0)), HalfSpace((1, 0, 0), -10.0), HalfSpace((-1, 0, 0), -10.0))


@dataclass(frozen=True)
class Scene:
    """Block with edges `size` [m] and `mass` M [kg], walls, gravity g [m/s²], restitution e, friction μ."""

    size: tuple[float, float, float] = (5.0, 3.0, 2.0)
    mass: float = 6.0
    walls: tuple[HalfSpace, ...] = THREE_WALLS
    gravity: tuple[float, float, float] = (0.0, -9.81, 0.0)
    restitution: float = 0.3
    friction: float = 0.5

    @cached_property
    def moments(self):
        """Diagonal of I_body (3,) [kg m²]: M (b² + c²)/12 about the edge a."""
        square = np.square(self.size)
        return self.mass / 12 * (square.sum() - square)

    @cached_property
    def vertices(self):
        """Vertices (8, 3) in the body frame [m]; bit j of a vertex's number: its side of axis j."""
        return ((np.arange(8)[:, None] >> np.arange(3) & 1) - 0.5) * self.size

    @cached_property
    def frames(self):
        """Axes n, t1, t2 of each wall: (walls, 3, 3)."""
        n = np.array([wall.normal for wall in self.walls], dtype=float).reshape(-1, 3)
        t1 = np.cross(n, np.eye(3)[np.abs(n).argmin(axis=1)])
        t1 /= np.linalg.norm(t1, axis=1, keepdims=True)
        return np.stack([n, t1, np.cross(n, t1)], axis=1)


def make_state(scene, pos, quat=(1, 0, 0, 0), linvel=(0, 0, 0), angvel=(0, 0, 0)):
    """Y (13,) from position [m], attitude, velocity [m/s] and angular velocity [rad/s] in the world frame."""
    R = rotation_matrix(np.array(quat))
    return np.concatenate([pos, quat, scene.mass * np.array(linvel), R * scene.moments @ R.T @ angvel], dtype=float)


def star(a):
    """Matrix a* of the cross product: a* b = a x b."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def rotation_matrix(q):
    """R (3, 3) = 1 + 2 (w v* + v* v*)/|q|² for q = (w, v)."""
    return np.eye(3) + 2 / (q @ q) * (q[0] * star(q[1:]) + star(q[1:]) @ star(q[1:]))


def quaternion_rate(omega, q):
    """½ ω q = ½ (-ω·v, w ω + ω x v)."""
    return 0.5 * np.array([-omega @ q[1:], *(q[0] * omega + star(omega) @ q[1:])])


def auxiliary(scene, Y):
    """R, I⁻¹, v, ω of the state."""
    R = rotation_matrix(Y[3:7])
    inverse = R / scene.moments @ R.T
    return R, inverse, Y[7:10] / scene.mass, inverse @ Y[10:]


def derivative(scene, Y, contacts):
    """dY/dt under gravity and the forces of resting contacts."""
    _, _, v, omega = auxiliary(scene, Y)
    load = np.concatenate([scene.mass * np.array(scene.gravity), np.zeros(3)])
    J, f, _ = resting_contact(scene, Y, contacts)
    return np.concatenate([v, quaternion_rate(omega, Y[3:7]), load + J.T @ f])


def rk4(scene, Y, contacts, h):
    """Y after h [s] by the classical Runge-Kutta method, with the same resting contacts throughout."""
    k1 = derivative(scene, Y, contacts)
    k2 = derivative(scene, Y + h / 2 * k1, contacts)
    k3 = derivative(scene, Y + h / 2 * k2, contacts)
    k4 = derivative(scene, Y + h * k3, contacts)
    Y = Y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    Y[3:7] /= np.linalg.norm(Y[3:7])
    return Y


def gaps(scene, Y):
    """Distance of each vertex from each wall [m], (8, walls); negative where it penetrates."""
    points = Y[:3] + scene.vertices @ rotation_matrix(Y[3:7]).T
    return points @ scene.frames[:, 0].T - [wall.offset for wall in scene.walls]


def find_contacts(scene, Y):
    """Vertex, wall, and 1 where it slips, of each contact (k, 3); and its velocity u (k, 3)."""
    pairs = np.argwhere(gaps(scene, Y) <= TOUCH)
    _, _, u = contact_jacobian(scene, Y, pairs)
    return np.column_stack([pairs, np.linalg.norm(u[:, 1:], axis=1) > SLOW]), u


def contact_jacobian(scene, Y, contacts):
    """J (3k, 6), diag(M, I)⁻¹ Jᵀ (6, 3k) and u (k, 3). A row of J: n·(v + ω x r) = n·v + (r x n)·ω."""
    R, inverse, v, omega = auxiliary(scene, Y)
    axes, r = scene.frames[contacts[:, 1]], scene.vertices[contacts[:, 0]] @ R.T
    J = np.concatenate([axes, np.cross(r[:, None], axes)], axis=2).reshape(-1, 6)
    response = np.concatenate([J[:, :3] / scene.mass, J[:, 3:] @ inverse], axis=1).T
    return J, response, (J @ np.concatenate([v, omega])).reshape(-1, 3)


def resolve_impacts(scene, Y):
    """Y after the impacts of all contacts at once; and again, where a contact approaches after them."""
    Y = Y.copy()
    for _ in range(100):
        contacts, u = find_contacts(scene, Y)
        if (u[:, 0] >= -ROUNDING).all():
            return Y
        J, response, _ = contact_jacobian(scene, Y, contacts)
        u[:, 0] *= np.where(np.abs(u[:, 0]) > SLOW, 1 + scene.restitution, 1.0)  # u⁺ + e u⁻ = A p + (1 + e) u⁻
        Y[7:] += J.T @ solve_contacts(J @ response, u.ravel(), scene.friction, np.zeros((len(u), 2)))
    raise ArithmeticError("contacts still approach after 100 impacts at one time")


def resting_contact(scene, Y, contacts):
    """J, forces f (3k,) [N] and accelerations a (k, 3) [m/s²] of contacts that neither approach nor leave."""
    R, inverse, _, omega = auxiliary(scene, Y)
    J, response, u = contact_jacobian(scene, Y, contacts)
    r = scene.vertices[contacts[:, 0]] @ R.T
    turn = star(inverse @ np.cross(Y[10:], omega)) + star(omega) @ star(omega)  # ω̇ = I⁻¹ (L x ω) where L̇ = 0
    b = np.einsum("kij,kj->ki", scene.frames[contacts[:, 1]], scene.gravity + r @ turn.T).ravel()
    slip = u[:, 1:] * contacts[:, 2:] / np.maximum(np.linalg.norm(u[:, 1:], axis=1, keepdims=True), ROUNDING)
    f = solve_contacts(J @ response, b, scene.friction, slip)
    return J, f, (J @ response @ f + b).reshape(-1, 3)


def solve_contacts(A, b, mu, slip):
    """Forces f (3k,) of 0 <= f_n ⟂ a_n >= 0 with a = A f + b, and friction; or impulses, with velocities for a.

    Where `slip` (k, 2) is a unit vector, f_t = -μ f_n slip. Elsewhere a_t = 0, or f_t = -μ f_n a_t/|a_t|: Lemke's method
    takes a polygon for the circle |f_t| <= μ f_n, and Newton's method goes on from there with the circle.
    """
    if not len(b):
        return b
    scale, unit = A.diagonal().max(), np.abs(b).max() or 1.0
    A, b = A / scale, b / unit

    def natural_map(f):  # f less the projection of f - a on the cone: zero where the law holds
        trial = (f - A @ f - b).reshape(-1, 3)
        push, length = np.maximum(trial[:, :1], 0.0), np.linalg.norm(trial[:, 1:], axis=1, keepdims=True)
        grip = trial[:, 1:] * np.minimum(1.0, mu * push / np.maximum(length, ROUNDING))
        return f - np.hstack([push, np.where(slip.any(axis=1, keepdims=True), -mu * push * slip, grip)]).ravel()

    for corners in (8, 16, 32):
        f = solve_polygon(A, b, mu, slip, corners)
        for _ in range(10):
            residual = natural_map(f)
            if np.abs(residual).max() <= ROUNDING * max(1.0, np.abs(f).max()):
                return f * unit / scale
            slopes = [(natural_map(f + df) - residual) / 1e-7 for df in 1e-7 * np.eye(len(f))]
            f = f - np.linalg.lstsq(np.transpose(slopes), residual, rcond=1e-6)[0]
    raise ArithmeticError("no forces found that obey Coulomb's law; in Painlevé's paradox there are none")


def solve_polygon(A, b, mu, slip, corners):
    """The same with f_t = Σ β d over the corners d of a polygon, β >= 0 and Σ β <= μ f_n: a linear problem [3]_."""
    k, held, angle = len(slip), ~slip.any(axis=1) & (mu > 0), 2 * np.pi * np.arange(corners) / corners
    n, d = np.kron(np.eye(k), [[1], [0], [0]]), np.kron(np.eye(k)[:, held], [0 * angle, np.cos(angle), np.sin(angle)])
    slips = (np.eye(k)[:, None] * np.column_stack([np.ones(k), -mu * slip])[:, :, None]).reshape(3 * k, k)
    sums = np.kron(np.eye(held.sum()), np.ones(corners))
    tests, forces = np.hstack([n, d]), np.hstack([slips, d])
    cone = np.hstack([mu * np.eye(k)[held], -sums])  # μ f_n - Σ β >= 0 ⟂ the speed or acceleration of the slip >= 0
    M = np.block([[tests.T @ A @ forces, np.vstack([0 * cone[:, :k].T, sums.T])], [cone, 0 * sums @ sums.T]])
    return forces @ lemke(M, np.concatenate([tests.T @ b, np.zeros(len(cone))]))[: len(forces.T)]


def lemke(M, q):
    """Solution z of w = M z + q, w >= 0, z >= 0, z·w = 0 by complementary pivoting [4]_."""
    n = len(q)
    cover = np.linspace(1.0, 2.0, n)  # column of the artificial variable z0; unequal, so that no two rows tie
    T = np.hstack([np.eye(n), -M, -cover[:, None], q[:, None]])  # columns of w, z, z0, and the right-hand side
    basis, entering, row = np.arange(n), 2 * n, np.argmin(q / cover)
    if q[row] >= 0.0:
        return np.zeros(n)
    for _ in range(50 * n):
        pivot = T[row] / T[row, entering]
        T -= np.outer(T[:, entering], pivot)
        T[row] = pivot
        leaving, basis[row] = basis[row], entering
        if leaving == 2 * n:
            z = np.zeros(2 * n)
            z[basis] = T[:, -1]
            return z[n:]
        entering = (leaving + n) % (2 * n)  # the complement of the variable that left
        ratio = np.divide(T[:, -1], T[:, entering], out=np.full(n, np.inf), where=T[:, entering] > 1e-11)
        z0 = np.argmax(basis)  # it leaves as soon as it can
        row = z0 if ratio[z0] <= ratio.min() + ROUNDING else np.argmin(ratio)
        if ratio[row] == np.inf:
            break
    raise ArithmeticError("Lemke's method found no forces")


def limit_stage(scene, Y, contacts, h):
    """Length of the stage [s]: h, or the time at which a vertex meets a wall or a slip comes to its end."""
    lowest = np.minimum(gaps(scene, Y), 0.0)
    lowest[tuple(contacts[:, :2].T)] = -TOUCH
    slip = contact_jacobian(scene, Y, contacts)[2][:, 1:] * contacts[:, 2:]

    def is_over(t):
        end = rk4(scene, Y, contacts, t)
        turned = np.sum(slip * contact_jacobian(scene, end, contacts)[2][:, 1:], axis=1) < 0.0
        return turned.any() or (gaps(scene, end) < lowest).any()

    before, after = (0.0, h) if is_over(h) else (h, h)
    while after - before > INSTANT:
        middle = (before + after) / 2
        before, after = (before, middle) if is_over(middle) else (middle, after)
    return after


def correct_positions(scene, Y, contacts):
    """Y with zero gap and velocity of contacts that hold: the least change, measured by kinetic energy."""
    J, response, u = contact_jacobian(scene, Y, contacts)
    holds = np.abs(resting_contact(scene, Y, contacts)[2]) < STILL
    holds[:, 1:] = (holds.all(axis=1) & (contacts[:, 2] == 0))[:, None]  # along the wall: of those that stick
    row, n = np.flatnonzero(holds), 3 * np.flatnonzero(holds[:, 0])
    Y[7:] -= J[row].T @ np.linalg.pinv(J[row] @ response[:, row], rcond=1e-10) @ u[holds]
    gap = gaps(scene, Y)[tuple(contacts[holds[:, 0], :2].T)]
    move = response[:, n] @ np.linalg.pinv(J[n] @ response[:, n], rcond=1e-10) @ gap
    Y[:7] -= np.concatenate([move[:3], quaternion_rate(move[3:], Y[3:7])])
    return Y


def step(scene, Y, h):
    """Y after h [s]."""
    while h > 0.0:
        Y = resolve_impacts(scene, Y)
        contacts, u = find_contacts(scene, Y)
        contacts = contacts[u[:, 0] <= SLOW]
        if np.abs(derivative(scene, Y, contacts)).max() < STILL:
            break
        stage = limit_stage(scene, Y, contacts, h)
        Y = correct_positions(scene, rk4(scene, Y, contacts, stage), contacts)
        h -= stage
    return Y
