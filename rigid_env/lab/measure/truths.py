"""Scenes with known outcomes, and the error of a simulation of each, for `rigid-env accuracy`.

The outcomes are closed forms of the course notes' physics. Only the free rotation is integrated by SciPy's DOP853, at
two tolerances; their difference is the error of the known outcome itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.integrate import solve_ivp

import physics
from physics import scenes
from physics.work_precision.errors import angles_between

G = scenes.GRAVITY
INCLINE = math.radians(20.0)


@dataclass(frozen=True)
class Path:
    """Path of one body after each step: t (n,), pos (n, 3), quat (n, 4), linvel (n, 3), angvel (n, 3).

    `events` has the events of our own engine; other engines have none.
    """

    t: np.ndarray
    pos: np.ndarray
    quat: np.ndarray
    linvel: np.ndarray
    angvel: np.ndarray
    events: tuple[physics.Event, ...] = ()

    @classmethod
    def of(cls, trajectory: physics.Trajectory) -> Path:
        """Make the path of the first body of a trajectory."""
        columns = ("pos", "quat", "linvel", "angvel")
        return cls(trajectory.t, *(getattr(trajectory, name)[:, 0] for name in columns), trajectory.events)


@dataclass(frozen=True)
class Case:
    """Scene with a known outcome.

    Attributes
    ----------
    key, what : str
        Name for programs, and description of the error for people.
    unit : str
        Unit of the error.
    duration : float
        Simulated time [s].
    scene : callable
        () -> Scene.
    error : callable
        Path -> error.
    goals : tuple of (error, microseconds)
        Goals of this project: an error, and a wall-clock time per simulated second; one setting must reach both.
    scale : float, optional
        Size of the motion, in `unit`; an error larger than half of it counts as lost. None: nothing moves.
    own_error : callable
        () -> error of the known outcome itself, in `unit`. Rounding of a closed form does not count.
    """

    key: str
    what: str
    unit: str
    duration: float
    scene: Callable[[], physics.Scene]
    error: Callable[[Path], float]
    goals: tuple[tuple[float, float], ...]
    scale: float | None = None
    own_error: Callable[[], float] = float

    def truth(self) -> physics.Truth:
        """Make the truth that `physics.frontier` compares with."""
        own = self.own_error()
        text = "DOP853 at two tolerances" if own else "closed form"
        return physics.Truth(lambda seen: self.error(Path.of(seen)), self.unit, own, self.scale, text)


# --- free rotation -------------------------------------------------------------------------------------------------


@cache
def free_attitude(spin: tuple[float, float, float], duration: float, rtol: float = 1e-13) -> tuple[float, ...]:
    """Attitude of the block after free rotation for `duration` [s], a unit quaternion (w, x, y, z).

    The block starts at (1, 0, 0, 0) with the angular velocity `spin` [rad/s]; `rtol` is DOP853's relative tolerance.
    """
    x, y, z = scenes.SIZE
    inertia = scenes.MASS / 12.0 * np.array([y * y + z * z, z * z + x * x, x * x + y * y])

    def rate(_, state):
        q, w = state[:4], state[4:]
        turn = 0.5 * np.array([
            -q[1] * w[0] - q[2] * w[1] - q[3] * w[2],
            q[0] * w[0] + q[2] * w[2] - q[3] * w[1],
            q[0] * w[1] + q[3] * w[0] - q[1] * w[2],
            q[0] * w[2] + q[1] * w[1] - q[2] * w[0],
        ])  # fmt: skip
        return np.concatenate([turn, -np.cross(w, inertia * w) / inertia])

    start = np.concatenate([[1.0, 0.0, 0.0, 0.0], spin])
    end = solve_ivp(rate, (0.0, duration), start, method="DOP853", rtol=rtol, atol=rtol * 1e-2).y[:4, -1]
    return tuple(end / np.linalg.norm(end))


def angle_between(q, p) -> float:
    """Angle of the rotation from one unit quaternion to another [rad]; accurate for small angles."""
    return float(angles_between(q, p))


def truth_error(spin: tuple[float, float, float], duration: float) -> float:
    """Error of `free_attitude` itself [rad], by comparison with a tolerance ten times as large."""
    return angle_between(free_attitude(spin, duration), free_attitude(spin, duration, 1e-12))


def rotation(key: str, spin: tuple[float, float, float], duration: float, goal) -> Case:
    """Case of the block rotating in empty space with the angular velocity `spin` [rad/s]."""
    return Case(
        key, f"free rotation, ω = {spin} rad/s, {duration:g} s: attitude", "rad", duration,
        lambda: physics.Scene([physics.Block(scenes.SIZE, scenes.MASS, angvel=spin)]),
        lambda path: angle_between(path.quat[-1], free_attitude(spin, duration)), (goal,),
        scale=math.pi, own_error=lambda: truth_error(spin, duration),
    )  # fmt: skip


# --- bounces -------------------------------------------------------------------------------------------------------


def flights(path: Path) -> list[tuple[float, float]]:
    """Time of each bounce [s] and height of the apex after it [m], from the first sample after the bounce."""
    height, speed = path.pos[:, 1] - scenes.SIZE[1] / 2, path.linvel[:, 1]
    found = []
    for k in np.flatnonzero((speed[1:] > 0.0) & (speed[:-1] <= 0.0)) + 1:
        apex = height[k] + speed[k] ** 2 / (2 * G)
        found.append((path.t[k] + speed[k] / G - math.sqrt(2 * max(apex, 0.0) / G), apex))
    return found


def elastic_error(path: Path, bounces: int = 10) -> float:
    """Largest error of the apex heights [m] and times [s] of the first bounces; infinite if there are fewer."""
    found = flights(path)[:bounces]
    if len(found) < bounces:
        return math.inf
    fall = math.sqrt(2.0 / G)
    return max(max(abs(apex - 1.0), abs(t - (2 * k + 1) * fall)) for k, (t, apex) in enumerate(found))


def damped_error(path: Path) -> float:
    """Larger one of two errors of a block that falls from h: first apex e² h [m], and time to rest [s].

    The time to rest is √(2h/g) (1 + e)/(1 - e), for the restitution e.
    """
    found, rest = flights(path), time_of_rest(path)
    if not found:
        return math.inf
    return max(abs(found[0][1] - 0.25), abs(rest - 3.0 * math.sqrt(2.0 / G)))


STILL = 1e-9  # speed below which a block is at rest [m/s]
RESTLESS = 1e-2  # speed near the end of a run above which a block counts as never at rest [m/s]


def time_of_rest(path: Path) -> float:
    """Time at which the block comes to rest [s]; infinite if it never does.

    It is the time of the engine's event if there is one, else the first sample after which the block stays still. Still
    means below the speed `STILL`. A soft contact never reaches that; then the limit is twice the largest speed in the
    last tenth of the run, if that speed is small. The time may then be too early by the bounces below that speed v,
    which take 4 v/g, 0.4 ms for 1 mm/s.
    """
    told = [event.t for event in path.events if event.kind == "rest"]
    if told:
        return told[-1]
    speed, height = np.abs(path.linvel[:, 1]), path.pos[:, 1] - scenes.SIZE[1] / 2
    residue = speed[path.t >= 0.9 * path.t[-1]].max()
    if not residue <= RESTLESS or not height[-1] < 1e-3:
        return math.inf
    moving = np.flatnonzero((speed > max(STILL, 2.0 * residue)) | (height >= 1e-3))
    return float(path.t[moving[-1] + 1])


TILT = (math.cos(0.35), math.sin(0.35) / math.sqrt(2), math.sin(0.35) / math.sqrt(2), 0.0)  # 0.7 rad about (1, 1, 0)
LANDING_SPEED = 3.0  # speed of the vertex before the impact [m/s]
LANDING_TIME = 0.16  # time of the impact [s]


def lowest_vertex() -> tuple[np.ndarray, np.ndarray]:
    """Arm (3,) from the centre of the tilted block to its lowest vertex [m], and its inertia tensor [kg m²].

    Both are in the world frame.
    """
    w, *v = TILT
    v = np.array(v)
    R = (w * w - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * w * np.cross(np.eye(3), -v)
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * np.array(scenes.SIZE) / 2
    x, y, z = scenes.SIZE
    inertia = R @ np.diag(scenes.MASS / 12.0 * np.array([y * y + z * z, z * z + x * x, x * x + y * y])) @ R.T
    return min((R @ c for c in corners), key=lambda r: r[1]), inertia


def vertex_scene() -> physics.Scene:
    """Scene of the tilted block without gravity, whose lowest vertex hits the floor at `LANDING_TIME`."""
    arm, _ = lowest_vertex()
    start = (0.0, LANDING_TIME * LANDING_SPEED - arm[1], 0.0)
    body = physics.Block(scenes.SIZE, scenes.MASS, pos=start, quat=TILT, linvel=(0, -LANDING_SPEED, 0))
    return physics.Scene([body], [physics.HalfSpace((0, 1, 0))], [physics.Contact(0.5)])


def vertex_error(path: Path) -> float:
    """Error of the vertex's velocity just after the impact [m/s], from the momentum after it.

    The impulse is j = (1 + e) v / w with w = 1/m + (r x n)·I⁻¹ (r x n). Then the vertex leaves at e v, and an error of
    j changes its velocity by w times this error.
    """
    arm, inertia = lowest_vertex()
    turn = np.cross(arm, (0, 1, 0))
    mobility = 1.0 / scenes.MASS + turn @ np.linalg.solve(inertia, turn)
    impulse = scenes.MASS * (path.linvel[-1, 1] + LANDING_SPEED)
    return abs(impulse * mobility - 1.5 * LANDING_SPEED)


# --- friction ------------------------------------------------------------------------------------------------------


def along_incline(path: Path) -> np.ndarray:
    """Distance moved down the incline after each step (n,) [m]."""
    down = np.array([math.cos(INCLINE), -math.sin(INCLINE), 0.0])
    return (path.pos - np.array(scenes.incline(INCLINE, 1.0).bodies[0].pos)) @ down


def slipping_error(path: Path) -> float:
    """Error of the distance that the block slides down the incline in 10 s, ½ g (sin θ - μ cos θ) t² [m]."""
    pull = G * (math.sin(INCLINE) - 0.99 * math.tan(INCLINE) * math.cos(INCLINE))
    return abs(along_incline(path)[-1] - 0.5 * pull * 100.0)


def sphere_error(path: Path) -> float:
    """Larger one of two errors: of the sphere's final speed, 5/7 v [m/s], and of its distance [m].

    The sphere slips until t = 2 v/(7 μ g).
    """
    v, mu = 5.0, 0.2
    slip = 2.0 * v / (7.0 * mu * G)
    way = v * slip - 0.5 * mu * G * slip**2 + 5.0 / 7.0 * v * (path.t[-1] - slip)
    return max(abs(path.linvel[-1, 0] - 5.0 / 7.0 * v), abs(path.pos[-1, 0] - way))


CASES = (
    rotation("tumble", (0.1, 5.0, 0.1), 20.0, (1e-10, 100.0)),
    rotation("high_spin", (1.0, 100.0, 1.0), 5.0, (1e-8, 200.0)),
    Case("elastic", "face-down drop, e = 1: worst apex and time of 10 bounces", "m, s", 9.4,
         lambda: scenes.bounce(1.0, 1.0), elastic_error, ((1e-9, 200.0),), 1.0),
    Case("damped", "face-down drop, e = 0.5: first apex and time to rest", "m, s", 2.0,
         lambda: scenes.bounce(1.0, 0.5), damped_error, ((1e-6, 300.0),), 1.0),
    Case("slide", "slide, 3 m/s, μ = 0.3: stopping distance", "m", 2.0, scenes.slide,
         lambda path: abs(path.pos[-1, 0] - 9.0 / (0.6 * G)), ((1e-6, 500.0), (1e-4, 150.0)), 9.0 / (0.6 * G)),
    Case("creep", "incline 20°, μ 1 % too high, 10 s: creep", "m", 10.0,
         lambda: scenes.incline(INCLINE, 1.01 * math.tan(INCLINE)),
         lambda path: float(np.abs(along_incline(path)).max()), ((1e-12, 150.0),)),
    Case("slip", "incline 20°, μ 1 % too low, 10 s: distance", "m", 10.0,
         lambda: scenes.incline(INCLINE, 0.99 * math.tan(INCLINE)), slipping_error, ((1e-6, 500.0),), 1.7),
    Case("vertex", "one vertex hits, e = 0.5: velocity after", "m/s", 0.2, vertex_scene, vertex_error,
         ((1e-12, 300.0),), 1.5 * LANDING_SPEED),
    Case("sphere", "sphere slips, then rolls: final speed and distance", "m/s, m", 2.0, scenes.rolling_sphere,
         sphere_error, ((1e-9, 100.0),), 5.0),
)  # fmt: skip
