"""A block that slides on one of its faces, under a force and a torque that friction nearly holds: by LSODA to 1e-12.

The block stays flat on the floor y = 0, so that its motion is (x, z, turn ψ about y). Its centre is at height b over
the floor. Corner i is at r_i from the centre, and slides with u_i = v + ω x r_i. Friction is -μ N_i u_i/|u_i|. Of all
normal forces with the right sum and moments, those of least norm are affine in a corner's coordinates about the
centroid, N_i = c_0 + c_1 x_i + c_2 z_i. This is the choice of the engine, too. The three balances

    Σ N_i = m g - F_y,    Σ (r_i x f_i)·x + T_x = 0,    Σ (r_i x f_i)·z + T_z = 0

give c, since f_i is linear in N_i. Then m v̇ = F + Σ f_i, and J ω̇ = T_y + Σ (r_i x f_i)·y.

Friction turns the direction of a slow slip at the rate μ g/|u|. The equations are stiff, and LSODA notes that.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

RTOL, ATOL = 1e-12, 1e-18


class FlatSlide(NamedTuple):
    """A block of the given size [m] and mass [kg] on the floor, its axes along those of the world at first."""

    size: tuple[float, float, float]
    mass: float
    gravity: float
    friction: float
    force: tuple[float, float, float]  # [N]
    torque: tuple[float, float, float]  # [N m]

    def accelerations(self, turn: float, slip: np.ndarray) -> np.ndarray:
        """Accelerations (v̇_x, v̇_z, ω̇) for the velocities `slip` = (v_x, v_z, ω) at the angle `turn`."""
        a, b, c = 0.5 * np.array(self.size)
        cos, sin = np.cos(turn), np.sin(turn)
        corners = np.array([(i * a, k * c) for i in (-1, 1) for k in (-1, 1)]) @ np.array([[cos, -sin], [sin, cos]])
        x, z = corners.T
        u = np.stack([slip[0] + slip[2] * z, slip[1] - slip[2] * x], axis=1)
        along = -self.friction * u / np.linalg.norm(u, axis=1)[:, None]
        basis = np.stack([np.ones(4), x, z], axis=1)
        about_x, about_z = -b * along[:, 1] - z, x + b * along[:, 0]
        balances = np.stack([basis.sum(axis=0), about_x @ basis, about_z @ basis])
        loads = [self.mass * self.gravity - self.force[1], -self.torque[0], -self.torque[2]]
        f = along * (basis @ np.linalg.solve(balances, loads))[:, None]
        inertia = self.mass / 3.0 * (a * a + c * c)
        return np.array([
            (self.force[0] + f[:, 0].sum()) / self.mass, (self.force[2] + f[:, 1].sum()) / self.mass,
            (self.torque[1] + z @ f[:, 0] - x @ f[:, 1]) / inertia,
        ])  # fmt: skip

    def after(self, time: float, slip) -> tuple[np.ndarray, np.ndarray]:
        """Return (x, z, turn) and (v_x, v_z, ω) after `time` [s] from rest at the origin, but for the given slip."""
        run = solve_ivp(
            lambda t, y: np.concatenate([y[3:], self.accelerations(y[2], y[3:])]), (0.0, time), [0, 0, 0, *slip],
            method="LSODA", rtol=RTOL, atol=ATOL,
        )  # fmt: skip
        return run.y[:3, -1], run.y[3:, -1]
