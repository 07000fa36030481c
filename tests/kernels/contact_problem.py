"""One contact problem of a block, in a workspace and as the dense matrices of the reference."""

from __future__ import annotations

import numpy as np

from physics.kernels.contact_solver.solve import solve_contacts
from physics.kernels.math.quaternion import to_matrix
from physics.kernels.state.contact_law_dispatch import LAW_ANISOTROPY, LAW_DAMPING, LAW_STIFFNESS
from physics.kernels.state.groups import ContactSwitches
from physics.kernels.time_stepping.workspace import make_workspace
from tests.kernels.called import called

SIZE = np.array([2.5, 1.5, 1.0])
MASS = 6.0
INERTIA = MASS / 3.0 * np.array([SIZE[1] ** 2 + SIZE[2] ** 2, SIZE[0] ** 2 + SIZE[2] ** 2, SIZE[0] ** 2 + SIZE[1] ** 2])
FLOOR = np.array([0, 1, 0, 0, 0, 1, 1, 0, 0, 0.0])  # normal y, tangents z and x, offset
SIDE = np.array([1, 0, 0, 0, 1, 0, 0, 0, 1, 0.0])
FACE = (0, 1, 4, 5)  # vertices with y < 0


class Problem:
    """Vertices of a block on walls, with a free motion and target velocities.

    `ratio` is μ2/μ1 of friction, `give` the γ [1/kg] of walls that give.
    """

    def __init__(
        self,
        contacts,
        v,
        w,
        mu,
        quat=(1, 0, 0, 0),
        target=None,
        tolerance=1e-10,
        mass=MASS,
        length=1.0,
        ratio=None,
        give=None,
    ):
        laws = (LAW_ANISOTROPY,) * (ratio is not None) + (LAW_STIFFNESS, LAW_DAMPING) * (give is not None)
        self.scratch = make_workspace(np.array([FLOOR, SIDE]), 8, laws=laws, tolerance=tolerance, sweeps=2000)
        if ratio is not None:
            self.scratch["body"]["laws"][0, 0] = ratio
        if give is not None:
            self.scratch["body"]["laws"][0, -2], self.scratch["body"]["give"] = 1.0, give
        self.one = one = self.scratch[0]
        self.n = n = len(contacts)
        self.quat = tuple(float(c) for c in np.array(quat) / np.linalg.norm(quat))
        self.R = tuple(float(c) for c in to_matrix(self.quat))
        R = np.array(self.R).reshape(3, 3)
        inertia = INERTIA * (mass / MASS) * length**2
        one["body"]["mass"], one["body"]["J"], one["body"]["mu"] = mass, 1.0 / inertia, mu
        one["body"]["radius"] = length * np.linalg.norm(SIZE)
        signs = np.array([[1 if k >> c & 1 else -1 for c in range(3)] for k in range(8)])
        for i, (wall, vertex) in enumerate(contacts):
            one["contacts"]["slot"][i] = 8 * wall + vertex
            one["contacts"]["arm"][i] = R @ (length * SIZE * signs[vertex])
        if target is not None:
            one["contacts"]["target"][:n] = target
        self.v = tuple(float(c) for c in v)
        self.inertia = R @ np.diag(inertia) @ R.T
        self.L = tuple(float(c) for c in self.inertia @ np.array(w, float))
        self.mass = mass
        self.mu = np.full(n, float(mu))

    def matrices(self):
        """(W, b) of u = W p + b in plain NumPy."""
        rows, n = [], self.n
        for i in range(n):
            wall = self.one["scene"]["walls"][self.one["contacts"]["slot"][i] // 8]
            for axis in wall[:9].reshape(3, 3):
                rows.append(np.concatenate([axis, np.cross(self.one["contacts"]["arm"][i], axis)]))
        J = np.array(rows)
        inverse = np.zeros((6, 6))
        inverse[:3, :3] = np.eye(3) / self.mass
        inverse[3:, 3:] = np.linalg.inv(self.inertia)
        twist = np.concatenate([self.v, inverse[3:, 3:] @ np.array(self.L)])
        W = J @ inverse @ J.T
        if "give" in self.one["body"].dtype.names:
            W[::3, ::3] += self.one["body"]["give"] * np.eye(n)
        return W, J @ twist - self.one["contacts"]["target"][:n].ravel()

    def residual(self, p):
        """Natural-map residual of impulses (n, 3), see `contact_solver.gauss_seidel`, in plain NumPy: relative."""
        W, b = self.matrices()
        u, worst = (W @ p.ravel() + b).reshape(-1, 3), 0.0
        for i, (pn, *pt) in enumerate(p):
            own = W[3 * i : 3 * i + 3, 3 * i : 3 * i + 3]
            largest = np.linalg.eigvalsh(own[1:, 1:])[-1]
            aim = pt - u[i, 1:] / largest
            aim *= min(1.0, self.mu[i] * max(pn, 0.0) / max(np.hypot(*aim), 1e-300))
            worst = max(worst, abs(min(u[i, 0], pn * own[0, 0])), np.hypot(*(pt - aim)) * largest)
        return worst / np.abs(b).max()

    def solve(self, mode=0, friction=True, warm=None):
        """Impulses (n, 3), and what `solve_contacts` returns."""
        self.one["stage"]["mode"] = mode
        self.one["contacts"]["impulse"] = 0.0
        if warm is not None:
            self.one["contacts"]["impulse"][: 3 * self.n] = np.ravel(warm)
        contact = ContactSwitches(True, True if friction else None, True)
        result = called(solve_contacts, self.n, contact, self.v, self.L, self.R, self.one)
        width = 3 if friction else 1
        return np.array(self.one["contacts"]["impulse"][: width * self.n]).reshape(self.n, width), result
