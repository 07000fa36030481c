"""An ellipsoid that slides on a floor with friction until its contact sticks, and rolls from there: to rounding.

With n the floor's normal, r the arm of the contact, u = v + ω x r the velocity of the body there, d = u/|u| and ṙ the
rate at which the lowest point wanders,

    m v̇ = m g + f,    I ω̇ = r x f - ω x Iω,    u̇ = v̇ + ω̇ x r + ω x ṙ,    n·u = n·u̇ = 0.

*Sliding*: f = N (n - μ d). The direction d turns at the rate of |u̇|/|u|, so that no method in t sees the moment at
which u vanishes. With the time σ of dt = |u| dσ and u = e^s (cos φ, sin φ) it is

    dφ/dσ = u̇·d⊥,    ds/dσ = u̇·d,

smooth: s falls at a steady rate, φ goes to a direction that stays, and t = ∫ e^s dσ to its end. u is a part of the
state and v what follows from it, so that nothing is lost where u is small.
*Holding*: u = 0 and u̇ = 0 give the three components of f, up to the moment at which f_t is as large as μ f_n.
*Slip that begins*: then |u| grows with the square of the time, and d follows what acts at a rate of 1/|u|: stiff, but
without a jump. Radau integrates that up to a small |u|, from one of rounding; DOP853 all the rest.

`python -m tests.reference.restick` writes `data/restick.json`: bodies that roll, slip and stick again, drawn at random.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from tests.reference.rigid_body import rotation_matrix

NORMAL = np.array([0.0, 1.0, 0.0])
ALONG = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # the directions of φ = 0 and of φ = 90 degrees
STOPPED = np.log(1e-18)  # of |u| in m/s: what is left of the slide is shorter than rounding
FIRST, MOVING = 1e-13, 1e-4  # |u| with which a slip begins, and from which on it is not stiff [m/s]
RTOL, ATOL = 1e-13, 1e-15


class Ellipsoid(NamedTuple):
    """A body on the floor y = 0."""

    axes: np.ndarray  # (3,) half-axes [m]
    mass: float
    friction: float
    gravity: float

    @property
    def inertia(self) -> np.ndarray:
        """(3,) principal moments."""
        s = self.axes**2
        return 0.2 * self.mass * (s.sum() - s)


class State(NamedTuple):
    """State of a body that touches the floor; v and the height of the centre follow from the rest."""

    t: float
    place: np.ndarray  # (2,) of the centre, x and z
    quat: np.ndarray
    angvel: np.ndarray
    slip: np.ndarray  # (2,) u, along x and z


def arm_and_rate(body: Ellipsoid, R, omega):
    """(r, ṙ): r = -R D²Rᵀn/|D Rᵀn|, and its derivative by the quotient rule."""
    square = R @ np.diag(body.axes**2) @ R.T
    s = np.sqrt(NORMAL @ square @ NORMAL)
    spin = np.array([[0, -omega[2], omega[1]], [omega[2], 0, -omega[0]], [-omega[1], omega[0], 0]])
    change = spin @ square - square @ spin
    rate = NORMAL @ change @ NORMAL / (2 * s)
    return -square @ NORMAL / s, -change @ NORMAL / s + square @ NORMAL * rate / (s * s)


def velocity(body: Ellipsoid, quat, omega, slip):
    """v of the centre (3,)."""
    r, _ = arm_and_rate(body, rotation_matrix(quat), omega)
    return slip @ ALONG - np.cross(omega, r)


def _problem(body: Ellipsoid, quat, omega):
    """(A, b, R, r, inverse inertia): u̇ = A f + b."""
    R = rotation_matrix(quat)
    r, rate = arm_and_rate(body, R, omega)
    inverse = R @ np.diag(1 / body.inertia) @ R.T
    moved = np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
    turning = -inverse @ np.cross(omega, R @ (body.inertia * (R.T @ omega)))
    A = np.eye(3) / body.mass - moved @ inverse @ moved
    b = -body.gravity * NORMAL + np.cross(turning, r) + np.cross(omega, rate)
    return A, b, r, inverse, turning


def sliding_force(body: Ellipsoid, quat, omega, phi):
    """(f, u̇) where the slip has the direction φ."""
    A, b, *_ = _problem(body, quat, omega)
    push = NORMAL - body.friction * (np.cos(phi) * ALONG[0] + np.sin(phi) * ALONG[1])
    f = -(NORMAL @ b) / (NORMAL @ A @ push) * push
    return f, A @ f + b


def holding_force(body: Ellipsoid, quat, omega):
    """f where the contact sticks."""
    A, b, *_ = _problem(body, quat, omega)
    return -np.linalg.solve(A, b)


def cone_margin(body: Ellipsoid, quat, omega):
    """Margin of friction beyond the force that sticking needs [N]."""
    f = holding_force(body, quat, omega)
    return body.friction * f[1] - np.hypot(f[0], f[2])


def _turning_rates(body: Ellipsoid, quat, omega, f):
    """(q̇, ω̇)."""
    _, _, r, inverse, turning = _problem(body, quat, omega)
    w, x, y, z = quat
    a, b, c = omega
    rate = 0.5 * np.array([-a * x - b * y - c * z, a * w + b * z - c * y, b * w + c * x - a * z, c * w + a * y - b * x])
    return rate, inverse @ np.cross(r, f) + turning


def slide(body: Ellipsoid, start: State) -> State:
    """The state in which the slip that `start` has is gone.

    Raises
    ------
    RuntimeError
        The floor would have to pull, or the slip does not end within 10 s.
    """

    def rates(_, y):
        quat, omega, phi, s = y[2:6], y[6:9], y[9], y[10]
        speed = np.exp(s)
        d, across = np.array([np.cos(phi), np.sin(phi)]), np.array([-np.sin(phi), np.cos(phi)])
        f, change = sliding_force(body, quat, omega, phi)
        turned, spun = _turning_rates(body, quat, omega, f)
        v = velocity(body, quat, omega, speed * d)
        u = ALONG @ change
        return np.concatenate([speed * v[[0, 2]], speed * turned, speed * spun, [u @ across, u @ d, speed]])

    def has_stopped(_, y):
        return y[10] - STOPPED

    def pulls(_, y):
        return sliding_force(body, y[2:6], y[6:9], y[9])[0][1]

    def lasts(_, y):
        return 10.0 - y[11]

    for event in (has_stopped, pulls, lasts):
        event.terminal, event.direction = True, -1
    phi, s = np.arctan2(start.slip[1], start.slip[0]), np.log(np.hypot(*start.slip))
    y = np.concatenate([start.place, start.quat, start.angvel, [phi, s, 0.0]])
    run = solve_ivp(rates, (0, 1e6), y, "DOP853", rtol=RTOL, atol=ATOL, events=(has_stopped, pulls, lasts))
    if not len(run.t_events[0]):
        raise RuntimeError("the slip does not end while the floor pushes")
    y = run.y_events[0][0]
    return State(start.t + y[11], y[:2], y[2:6] / np.linalg.norm(y[2:6]), y[6:9], np.zeros(2))


def roll(body: Ellipsoid, start: State, duration: float) -> tuple[State, bool]:
    """The state after `duration` of rolling without slip, or where friction does not hold any more, and which it is."""

    def rates(_, y):
        quat, omega = y[2:6], y[6:9]
        turned, spun = _turning_rates(body, quat, omega, holding_force(body, quat, omega))
        return np.concatenate([velocity(body, quat, omega, np.zeros(2))[[0, 2]], turned, spun])

    def slips(_, y):
        return cone_margin(body, y[2:6], y[6:9])

    slips.terminal, slips.direction = True, -1
    y = np.concatenate([start.place, start.quat, start.angvel])
    run = solve_ivp(rates, (0, duration), y, "DOP853", rtol=RTOL, atol=ATOL, events=slips)
    y = run.y[:, -1]
    end = State(start.t + run.t[-1], y[:2], y[2:6] / np.linalg.norm(y[2:6]), y[6:9], np.zeros(2))
    return end, not len(run.t_events[0])


def begin_slip(body: Ellipsoid, start: State) -> State:
    """The state with a slip of `MOVING`, from one in which friction is used up and the contact holds."""

    def rates(_, y):
        quat, omega, phi, speed = y[2:6], y[6:9], y[9], y[10]
        d, across = np.array([np.cos(phi), np.sin(phi)]), np.array([-np.sin(phi), np.cos(phi)])
        f, change = sliding_force(body, quat, omega, phi)
        turned, spun = _turning_rates(body, quat, omega, f)
        u = ALONG @ change
        v = velocity(body, quat, omega, speed * d)
        return np.concatenate([v[[0, 2]], turned, spun, [u @ across / speed, u @ d]])

    def moves(_, y):
        return y[10] - MOVING

    moves.terminal = True
    f = holding_force(body, start.quat, start.angvel)
    y = np.concatenate([start.place, start.quat, start.angvel, [np.arctan2(-f[2], -f[0]), FIRST]])
    run = solve_ivp(rates, (0, 1.0), y, "Radau", rtol=1e-11, atol=1e-14, events=moves)
    y = run.y_events[0][0]
    slip = y[10] * np.array([np.cos(y[9]), np.sin(y[9])])
    return State(start.t + run.t_events[0][0], y[:2], y[2:6] / np.linalg.norm(y[2:6]), y[6:9], slip)


DATA = Path(__file__).with_name("data") / "restick.json"
STARTS, SEED, GRAVITY = 20, 0, 9.81


class Truth(NamedTuple):
    """A body that rolls from its start, slips and sticks again."""

    body: Ellipsoid
    start: State
    slips: float  # [s]
    sticks: State


def run(body: Ellipsoid, start: State) -> Truth | None:
    """The way of a body up to where it sticks again; None where it is another one."""
    slipping, holds = roll(body, start, 0.3)
    if holds or holding_force(body, slipping.quat, slipping.angvel)[1] < 0.1 * body.mass * GRAVITY:
        return None
    try:
        sticks = slide(body, begin_slip(body, slipping))
    except (RuntimeError, IndexError):
        return None
    return Truth(body, start, slipping.t, sticks)


def is_plain(truth: Truth) -> bool:
    """Test whether it sticks within 2 s, with a hundredth of what friction can do left, and holds for 20 ms."""
    body, end = truth.body, truth.sticks
    has_room = cone_margin(body, end.quat, end.angvel) > 0.01 * body.friction * body.mass * body.gravity
    return has_room and end.t < 2.0 and roll(body, end, 0.02)[1]


def drawn(rng: np.random.Generator) -> tuple[Ellipsoid, State]:
    """A body that rolls, at random."""
    body = Ellipsoid(rng.uniform(0.1, 0.3, 3), rng.uniform(0.5, 3.0), rng.uniform(0.1, 0.6), GRAVITY)
    quat, omega = rng.normal(size=4), 4 * rng.normal(size=3)
    return body, State(0.0, np.zeros(2), quat / np.linalg.norm(quat), omega, np.zeros(2))


def find(count: int, seed: int):
    """Truths from the first drawn starts that hold and press at first, and slip and stick again."""
    rng, found = np.random.default_rng(seed), 0
    while found < count:
        body, start = drawn(rng)
        weight = body.mass * body.gravity
        if cone_margin(body, start.quat, start.angvel) < 0.1 * body.friction * weight:
            continue
        if holding_force(body, start.quat, start.angvel)[1] < 0.2 * weight:
            continue
        truth = run(body, start)
        if truth is not None and is_plain(truth):
            found += 1
            yield truth


def load() -> list[Truth]:
    """The stored truths."""
    truths = []
    for row in json.loads(DATA.read_text(encoding="utf-8"))["truths"]:
        body = Ellipsoid(np.array(row["axes"]), row["mass"], row["friction"], GRAVITY)
        start = State(0.0, np.zeros(2), np.array(row["quat"]), np.array(row["angvel"]), np.zeros(2))
        t, place, quat, angvel = row["sticks"]
        end = State(t, np.array(place), np.array(quat), np.array(angvel), np.zeros(2))
        truths.append(Truth(body, start, row["slips"], end))
    return truths


def write() -> None:
    """Store the truths, a line each."""
    lines = []
    for k, truth in enumerate(find(STARTS, SEED)):
        body, start, slips, end = truth
        row = {"axes": body.axes.tolist(), "mass": body.mass, "friction": body.friction, "quat": start.quat.tolist(),
               "angvel": start.angvel.tolist(), "slips": slips,
               "sticks": [end.t, end.place.tolist(), end.quat.tolist(), end.angvel.tolist()]}  # fmt: skip
        lines.append(json.dumps(row))
        print(k, slips, end.t, flush=True)
    head = {"command": "python -m tests.reference.restick", "units": "SI; place (x, z) of the centre; world frame"}
    text = json.dumps(head)[:-1] + ',\n"truths": [\n' + ",\n".join(lines) + "\n]}\n"
    DATA.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    write()
