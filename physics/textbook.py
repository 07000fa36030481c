"""A whole step of a rigid body on one page: the course notes of Witkin and Baraff [1]_ in plain NumPy. Read this first.

The exercise: a block of 5 x 3 x 2 m and 6 kg falls on the floor, then among three walls. Units are SI; world axes are x
right, y up, z towards the viewer; the block's own axes are its edges. The state and its rate, with force F, torque τ:

    Y = (x, q, P, L)          position, unit quaternion (w, x, y, z) body to world, linear and angular momentum
    v = P/M,    ω = I⁻¹ L     velocities, where I⁻¹ = R I_body⁻¹ Rᵀ and R is the rotation matrix of q
    dY/dt = (v, ½ ω q, F, τ)

A contact is a vertex at a wall, r from x. Its velocity along n, t1, t2 is u = J (v, ω), n out of the wall. The Delassus
matrix is A = J diag(M, I)⁻¹ Jᵀ. `step` repeats these stages, which `physics/kernels/event_driven/step.py` names alike:

1. Hold loads         F = M g, and τ = 0: gravity exerts no torque                         `derivative`
2. Find contacts      vertices whose gap n·(x + r) - offset is zero                        `find_contacts`
3. Resolve impacts    impulses p: 0 <= p_n ⟂ u_n⁺ + e u_n⁻ >= 0, u⁺ = u⁻ + A p             `resolve_impacts`
4. Limit the stage    bisection to the time of impact, or to the end of a slip             `limit_stage`
5. Integrate          RK4, with resting forces f: 0 <= f_n ⟂ a_n >= 0, a = A f + b         `rk4`, `resting_contact`
6. Correct positions  zero gaps and velocities of contacts, which the error of RK4 moves   `correct_positions`
7. Rest               nothing changes where dY/dt = 0                                      `step`

All contacts are in one complementarity problem [2]_. Coulomb friction, |f_t| <= μ f_n, opposes the slip, in an impact
the slip after it. Limits: a vertex that dips into a wall and out again within h is not seen; an impact with friction
may gain energy (Kane's paradox), which the kernels prevent.

.. [1] A. Witkin, D. Baraff, *Physically Based Modeling*, SIGGRAPH course notes, 1997: Rigid Body Simulation I and II.
.. [2] D. Baraff, *Analytical methods for dynamic simulation of non-penetrating rigid bodies*, SIGGRAPH 1989.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

TOUCH = 1e-8  # gap that counts as zero [m]
SLOW = 1e-6  # contact velocity that counts as zero [m/s]: neither an impact nor a slip
STILL = 1e-9  # rate that counts as zero: accelerations of contacts [m/s²], dY/dt
CORNERS = (np.arange(8)[:, None] >> np.arange(3) & 1) - 0.5  # of a unit cube (8, 3); bit j of a number: side of axis j
ROUNDING = 1e-12  # residual that rounding leaves; of bisected times [s]


@dataclass(frozen=True)
class HalfSpace:
    """Wall: bodies may be where normal·x >= offset [m]; `normal` has unit length."""

    normal: tuple
    offset: float = 0.0


@dataclass(frozen=True)
class Scene:
    """Block with edges `size` [m] and `mass` M [kg], walls, gravity g [m/s²], restitution e, friction μ."""

    size: tuple = (5.0, 3.0, 2.0)
    mass: float = 6.0
    walls: tuple = (HalfSpace((0, 1, 0)), HalfSpace((1, 0, 0), -10.0), HalfSpace((-1, 0, 0), -10.0))
    gravity: tuple = (0.0, -9.81, 0.0)
    restitution: float = 0.3
    friction: float = 0.5

    @cached_property
    def frames(self):
        """Unit normal n and tangents t1, t2 of each wall, as rows (walls, 3, 3)."""
        return np.array([[wall.normal, *np.linalg.svd([wall.normal])[2][1:]] for wall in self.walls]).reshape(-1, 3, 3)


def make_state(scene, pos, quat=(1, 0, 0, 0), linvel=(0, 0, 0), angvel=(0, 0, 0)):
    """State Y (13,) from position [m], attitude, velocity [m/s] and angular velocity [rad/s] in the world frame."""
    Y = np.concatenate([pos, quat, scene.mass * np.array(linvel), np.zeros(3)])
    return np.concatenate([Y[:10], np.linalg.solve(auxiliary(scene, Y)[1], angvel)])


def star(a):
    """Matrix a* of the cross product: a* b = a x b."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def auxiliary(scene, Y):
    """Arms r = R r_body of the vertices (8, 3) [m], inverse inertia I⁻¹ (3, 3), and velocities v and ω of a state Y."""
    q, square = Y[3:7], np.square(scene.size)
    R = np.eye(3) + 2 / (q @ q) * (q[0] * star(q[1:]) + star(q[1:]) @ star(q[1:]))
    moments = scene.mass / 12 * (square.sum() - square)  # of I_body: M (b² + c²)/12 about the edge a
    inverse = R / moments @ R.T
    return CORNERS * scene.size @ R.T, inverse, Y[7:10] / scene.mass, inverse @ Y[10:]


def quaternion_rate(omega, q):
    """Rate dq/dt = ½ ω q = ½ (-ω·v, w ω + ω x v) of a quaternion q = (w, v) at the angular velocity ω [rad/s]."""
    return 0.5 * np.array([-omega @ q[1:], *(q[0] * omega + star(omega) @ q[1:])])


def derivative(scene, Y, contacts):
    """Rate dY/dt (13,) of the state under gravity and the forces of resting `contacts` (k, 3): see `find_contacts`."""
    _, _, v, omega = auxiliary(scene, Y)
    load = scene.mass * np.array([*scene.gravity, 0.0, 0.0, 0.0])
    if len(contacts):
        load += resting_contact(scene, Y, contacts)[0]
    return np.concatenate([v, quaternion_rate(omega, Y[3:7]), load])


def rk4(scene, Y, contacts, h):
    """State Y after h [s] by the classical Runge-Kutta method, with the same resting `contacts` throughout."""
    k1 = derivative(scene, Y, contacts)
    k2 = derivative(scene, Y + h / 2 * k1, contacts)
    k3 = derivative(scene, Y + h / 2 * k2, contacts)
    k4 = derivative(scene, Y + h * k3, contacts)
    Y = Y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return np.concatenate([Y[:3], Y[3:7] / np.linalg.norm(Y[3:7]), Y[7:]])


def gaps(scene, Y):
    """Distance of each vertex of the block from each wall [m], (8, walls); negative where it penetrates."""
    return (Y[:3] + auxiliary(scene, Y)[0]) @ scene.frames[:, 0].T - [wall.offset for wall in scene.walls]


def find_contacts(scene, Y):
    """Find contacts: rows (vertex, wall, 1 if it slips, else 0) (k, 3), and their velocities u (n, t1, t2) (k, 3)."""
    pairs = np.argwhere(gaps(scene, Y) <= TOUCH)
    _, _, u = contact_jacobian(scene, Y, pairs)
    return np.column_stack([pairs, np.linalg.norm(u[:, 1:], axis=1) > SLOW]), u


def contact_jacobian(scene, Y, contacts):
    """J (3k, 6), diag(M, I)⁻¹ Jᵀ (6, 3k), velocities u (k, 3). A row of J: n·(v + ω x r) = n·v + (r x n)·ω."""
    arms, inverse, v, omega = auxiliary(scene, Y)
    axes, r = scene.frames[contacts[:, 1]], arms[contacts[:, :1]]
    J = np.concatenate([axes, np.cross(r, axes)], axis=2).reshape(-1, 6)
    response = np.concatenate([J[:, :3] / scene.mass, J[:, 3:] @ inverse], axis=1).T
    return J, response, (J @ np.concatenate([v, omega])).reshape(-1, 3)


def resolve_impacts(scene, Y):
    """State Y after impacts: all contacts collide at once, and again until no contact approaches its wall."""
    for _ in range(100):
        contacts, u = find_contacts(scene, Y)
        if (u[:, 0] >= -SLOW).all():
            return Y
        J, response, _ = contact_jacobian(scene, Y, contacts)
        u[:, 0] *= np.where(np.abs(u[:, 0]) > SLOW, 1 + scene.restitution, 1.0)  # u⁺ + e u⁻ = A p + (1 + e) u⁻
        p = solve_contacts(J @ response, u.ravel(), scene.friction, 0 * u[:, 1:])
        Y = Y + np.concatenate([np.zeros(7), J.T @ p])
    raise ArithmeticError("contacts still approach after 100 impacts at one time")


def resting_contact(scene, Y, contacts):
    """Load Jᵀf (6,), forces f and accelerations a (k, 3) [N, m/s²] of contacts that neither approach nor leave."""
    arms, inverse, _, omega = auxiliary(scene, Y)
    J, response, u = contact_jacobian(scene, Y, contacts)
    turn = star(inverse @ np.cross(Y[10:], omega)) + star(omega) @ star(omega)  # ω̇ x r + ω x (ω x r), Iω̇ = L x ω
    b = np.einsum("kij,kj->ki", scene.frames[contacts[:, 1]], scene.gravity + arms[contacts[:, 0]] @ turn.T).ravel()
    slip = u[:, 1:] * contacts[:, 2:] / np.maximum(np.linalg.norm(u[:, 1:], axis=1, keepdims=True), ROUNDING)
    f = solve_contacts(J @ response, b, scene.friction, slip)
    return J.T @ f, f.reshape(-1, 3), (J @ response @ f + b).reshape(-1, 3)


def solve_contacts(A, b, mu, slip):
    """Contact forces f (3k,) with 0 <= f_n ⟂ a_n >= 0, a = A f + b, and friction. Velocities for a: impulses.

    Where `slip` (k, 2) is a unit vector, f_t = -μ f_n slip. Elsewhere a_t = 0, or f_t = -μ f_n a_t/|a_t|. Lemke's
    method finds forces without friction; from there Newton's method follows them as μ grows, in few steps or in many.
    """
    if not len(b):
        return b
    scale, unit = A.diagonal().max(), np.abs(b).max() or 1.0
    A, b = A / scale, b / unit
    for steps in (1, 4, 16, 64, 256):
        f = np.kron(lemke(A[::3, ::3], b[::3]), [1.0, 0.0, 0.0])
        for part in np.linspace(0.0, mu, steps + 1)[1:]:
            for _ in range(10):
                residual = natural_map(A, b, part, slip, f)
                if is_solved := np.abs(residual).max() <= ROUNDING * max(1.0, np.abs(f).max()):
                    break
                slopes = [(natural_map(A, b, part, slip, f + df) - residual) / 1e-7 for df in 1e-7 * np.eye(len(f))]
                f -= np.linalg.lstsq(np.transpose(slopes), residual, rcond=1e-6)[0]
        if is_solved:
            return f * unit / scale
    raise ArithmeticError("no forces found that obey Coulomb's law; in Painlevé's paradox there are none")


def natural_map(A, b, mu, slip, f):
    """Residual (3k,) of the contact law: f less the projection of f - a, a = A f + b, on the cone |f_t| <= μ f_n."""
    trial = (f - A @ f - b).reshape(-1, 3)
    push, length = np.maximum(trial[:, :1], 0.0), np.linalg.norm(trial[:, 1:], axis=1, keepdims=True)
    grip = trial[:, 1:] * np.minimum(1.0, mu * push / np.maximum(length, ROUNDING))
    return f - np.hstack([push, np.where(slip.any(axis=1, keepdims=True), -mu * push * slip, grip)]).ravel()


def lemke(M, q):
    """Solution z of w = M z + q, w >= 0, z >= 0, z·w = 0 by pivoting (Cottle, Pang & Stone, 2009, section 4.4)."""
    n, cover = len(q), np.linspace(1.0, 2.0, len(q))  # column of the artificial variable z0; unequal: no rows tie
    T = np.hstack([np.eye(n), -M, -cover[:, None], q[:, None]])  # columns of w, z, z0, and the right-hand side
    basis, entering, row = np.arange(n), 2 * n, np.argmin(q / cover)
    if q[row] >= 0.0:
        return np.zeros(n)
    for _ in range(50 * n):
        T[row] /= T[row, entering]
        T -= np.outer(T[:, entering] - np.eye(n)[row], T[row])
        leaving, basis[row] = basis[row], entering
        if leaving == 2 * n:
            return np.bincount(basis, T[:, -1], 2 * n)[n:]
        entering = (leaving + n) % (2 * n)  # the complement of the variable that left
        ratio = np.divide(T[:, -1], T[:, entering], out=np.full(n, np.inf), where=T[:, entering] > 1e-11)
        ratio[np.argmax(basis)] -= ROUNDING  # z0 leaves as soon as it can
        row = np.argmin(ratio)
        if ratio[row] == np.inf:
            break
    raise ArithmeticError("Lemke's method found no solution")


def limit_stage(scene, Y, contacts, h):
    """Length of the stage [s]: h, or the time at which a vertex meets a wall or a slip comes to its end."""
    lowest = np.minimum(gaps(scene, Y), 0.0)
    lowest[tuple(contacts[:, :2].T)] = -TOUCH
    slip = contact_jacobian(scene, Y, contacts)[2][:, 1:] * contacts[:, 2:]
    rate = derivative(scene, Y, contacts)

    def is_over(t):  # Euler's step shows the end of a slip that friction reverses between the stages of RK4
        ends = rk4(scene, Y, contacts, t), Y + t * rate
        left = [np.sum(slip * contact_jacobian(scene, end, contacts)[2][:, 1:], axis=1) for end in ends]
        return np.less(left, 0.0).any() or (gaps(scene, ends[0]) < lowest).any()

    before, after = (0.0, h) if is_over(h) else (h, h)
    while after - before > ROUNDING:
        middle = (before + after) / 2
        before, after = (before, middle) if is_over(middle) else (middle, after)
    return after


def correct_positions(scene, Y, contacts):
    """State Y with zero gaps and velocities at contacts that hold: the least change, measured by kinetic energy."""
    J, response, u = contact_jacobian(scene, Y, contacts)
    holds = np.abs(resting_contact(scene, Y, contacts)[2]) < STILL
    holds[:, 1:] = (holds.all(axis=1) & (contacts[:, 2] == 0))[:, None]  # along the wall: contacts that stick
    row, n = np.flatnonzero(holds), 3 * np.flatnonzero(holds[:, 0])
    kick = J[row].T @ np.linalg.pinv(J[row] @ response[:, row], rcond=1e-10) @ u[holds]
    gap = gaps(scene, Y)[tuple(contacts[holds[:, 0], :2].T)]
    move = response[:, n] @ np.linalg.pinv(J[n] @ response[:, n], rcond=1e-10) @ gap
    return Y - np.concatenate([move[:3], quaternion_rate(move[3:], Y[3:7]), kick])


def step(scene, Y, h):
    """State Y (13,) of a scene's block after a step of h [s]."""
    while h > 0.0:
        Y = resolve_impacts(scene, Y)
        contacts, u = find_contacts(scene, Y)
        contacts = contacts[u[:, 0] <= SLOW]
        if np.abs(derivative(scene, Y, contacts)).max() < STILL:
            break
        stage = limit_stage(scene, Y, contacts, h)
        Y, h = correct_positions(scene, rk4(scene, Y, contacts, stage), contacts), h - stage
    return Y
