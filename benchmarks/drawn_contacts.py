"""Bodies that begin in contact with random walls: the worlds of `benchmarks.pivoting`.

A batch has one set of walls: random half-spaces, notches down to 1e-4 rad, channels, corners of a box, or funnels. Each
of its worlds has a body of its own that touches all of them at once, or nearly. Where walls enclose it, its size
follows from that. Shapes go down to rods and plates of 1 : 1000, and masses from 1e-3 to 1e3 kg. Inertias are those of
a uniform body, or of any other mass spread within it; μ goes up to 1e3. Velocities, loads and steps span up to six
decades; a quarter of the motions slide along the first wall.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import physics
from physics.world.parameters import quaternion_of
from physics.world.setters import start_anew
from rigid_env.hard_cases.cases.random_draws import directions, log_uniform

MOST_WALLS = 4
FAR = -1e6  # offset of walls out of use, which a scene has so that all share one kernel [m]
DEEPEST = 5e-3  # into a wall, of the bounding radius: half of what a world takes

# Of each draw: friction of any user, small, large, none.
KINDS_OF_FRICTION = (0.5, 0.2, 0.25, 0.05)

# Ordinary bodies in corners of a box, as in the environments; ordinary bodies at other walls; all others.
KINDS = ("box", "ordinary", "extreme")

# Bodies of any user: μ and ratio of edges at most so large.
ORDINARY_FRICTION, ORDINARY_RATIO = 1.0, 10.0


@dataclass(frozen=True)
class Drawn:
    """One batch of worlds, each of one body.

    Attributes
    ----------
    scene : Scene
    dt : float
        Step [s].
    state, parameters : dict
        Arguments of `physics.world.setters.start_anew`.
    wrench : (worlds, 1, 6) float64
        Force [N] and torque [N m], world frame.
    is_ordinary : (worlds,) bool
        μ is at most 1, and the edges at most 1 : 10.
    is_box : bool
        Walls meet at right angles.
    """

    scene: physics.Scene
    dt: float
    state: dict
    parameters: dict
    wrench: np.ndarray
    is_ordinary: np.ndarray
    is_box: bool

    @property
    def kinds(self) -> dict[str, np.ndarray]:
        """Worlds (worlds,) bool of each of `KINDS`."""
        kinds = self.is_ordinary & self.is_box, self.is_ordinary & (not self.is_box), ~self.is_ordinary
        return dict(zip(KINDS, kinds))

    def start(self, accuracy: physics.Accuracy) -> physics.World:
        """Make the worlds at their beginning."""
        worlds = len(self.wrench)
        world = physics.World(self.scene, worlds=worlds, dt=self.dt, accuracy=accuracy)
        start_anew(world, np.arange(worlds), self.state, self.parameters)
        return world


def draw(rng: np.random.Generator, effects: Sequence, is_round: bool, worlds: int) -> Drawn | None:
    """Draw a batch.

    Parameters
    ----------
    rng : numpy.random.Generator
    effects : sequence of Effect
        They fix the plan; their numbers are drawn anew, but for those of laws of contact.
    is_round : bool
        Ellipsoids instead of blocks.
    worlds : int

    Returns
    -------
    Drawn or None
        None where no body that was drawn fits between the walls.
    """
    normals, offsets = draw_walls(rng)
    R = _attitudes(rng, normals, worlds)
    edges = log_uniform(rng, rng.choice([-3.0, -0.7, -0.1]), 0, (worlds, 3))
    size = log_uniform(rng, -1.5, 1.5, (worlds, 1)) * edges
    pos, size, fits = _places(rng, normals, offsets, R, size, is_round)
    if not fits.any():
        return None
    chosen = rng.choice(np.flatnonzero(fits), worlds)
    pos, size, R = pos[chosen], size[chosen], R[chosen]
    mass, radius = log_uniform(rng, -3, 3, worlds), 0.5 * np.linalg.norm(size, axis=1)
    quat = np.array([quaternion_of(frame) for frame in R])
    state = {
        "pos": pos[:, None], "quat": quat[:, None],
        "linvel": _motion(rng, normals, worlds, -4, 2)[:, None],
        "angvel": (_motion(rng, normals, worlds, -4, 2) / np.maximum(radius, 0.1)[:, None])[:, None],
    }  # fmt: skip
    parameters = {
        "mass": mass[:, None], "size": size[:, None], "inertia_body": _inertias(rng, mass, size)[:, None],
        "gravity": _motion(rng, normals, worlds, -2, 2), **_coefficients(rng, effects, worlds),
    }  # fmt: skip
    force = _motion(rng, normals, worlds, -2, 3) * mass[:, None] * rng.integers(2, size=(worlds, 1))
    torque = _motion(rng, normals, worlds, -2, 2) * (mass * radius)[:, None] * rng.integers(2, size=(worlds, 1))
    scene = _scene(normals, offsets, effects, is_round, size[0], pos[0], quat[0])
    ratio = size.max(axis=1) / size.min(axis=1)
    is_ordinary = (ratio <= ORDINARY_RATIO) & (parameters.get("friction", mass * 0)[..., 0] <= ORDINARY_FRICTION)
    wrench, angles = np.hstack([force, torque])[:, None], normals @ normals.T
    is_box = bool(np.abs(angles - np.eye(len(normals))).max() < 1e-9)
    return Drawn(scene, float(log_uniform(rng, -4, -1, ())), state, parameters, wrench, is_ordinary, is_box)


def draw_walls(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Draw normals (k, 3) and offsets (k,) [m] of one to four walls."""
    count, kind = int(rng.integers(1, MOST_WALLS + 1)), rng.choice(["random", "notch", "channel", "box", "funnel"])
    offsets = np.zeros(MOST_WALLS)
    if kind == "random":
        normals = directions(rng, (count,))
    elif kind == "notch":
        half = 0.5 * log_uniform(rng, -4, 0.3, ())
        sides = np.array([(np.cos(half), np.sin(half), 0.0), (-np.cos(half), np.sin(half), 0.0)])
        normals = np.concatenate([sides, directions(rng, (max(count - 2, 0),))])
    elif kind == "channel":
        lean = rng.integers(2) * log_uniform(rng, -8, -1, ())
        normals = np.array([(1, 0, 0), (-np.cos(lean), np.sin(lean), 0), (0, 1, 0), (0, 0, 1)], float)[:count]
        offsets[:2] = -0.5
    elif kind == "box":
        normals = np.eye(3)[:count]
    else:
        sides = max(count, 3)
        angle = 2 * np.pi * (np.arange(sides) + 0.3 * rng.random(sides)) / sides
        normals = np.stack([np.cos(angle), np.full(sides, log_uniform(rng, -3, 0, ())), np.sin(angle)], axis=1)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return normals @ _turns(rng, 1)[0].T, offsets[: len(normals)]


def _scene(normals, offsets, effects, is_round, size, pos, quat) -> physics.Scene:
    """Scene of a batch, with the body of its first world."""
    walls = [physics.HalfSpace(tuple(n), float(c)) for n, c in zip(normals, offsets)]
    walls += [physics.HalfSpace((0, 1, 0), FAR)] * (MOST_WALLS - len(walls))
    place = {"mass": 1.0, "pos": tuple(pos), "quat": tuple(quat)}
    body = physics.Ellipsoid(tuple(0.5 * size), **place) if is_round else physics.Block(tuple(size), **place)
    return physics.Scene([body], walls, list(effects))


def _turns(rng: np.random.Generator, count: int) -> np.ndarray:
    """Rotations (count, 3, 3)."""
    Q = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    return Q * np.linalg.det(Q)[:, None, None]


def _attitudes(rng: np.random.Generator, normals: np.ndarray, worlds: int) -> np.ndarray:
    """Rotations (worlds, 3, 3): half of them any, a quarter with a face on the first wall, a quarter along two."""
    up = normals[0]
    aside = np.cross(up, normals[1]) if len(normals) > 1 else np.zeros(3)
    if np.linalg.norm(aside) < 1e-9:
        aside = np.cross(up, np.roll(up, 1) + np.array([0.3, 0.2, 0.1]))
    aside = aside / np.linalg.norm(aside)
    angle = (rng.uniform(0, 2 * np.pi, worlds) * rng.integers(2, size=worlds))[:, None]
    first = np.cos(angle) * aside + np.sin(angle) * np.cross(up, aside)
    flat = np.stack([first, np.broadcast_to(up, first.shape), np.cross(first, up)], axis=2)
    return np.where((rng.random(worlds) < 0.5)[:, None, None], _turns(rng, worlds), flat)


def reach(normals: np.ndarray, R: np.ndarray, size: np.ndarray, is_round: bool) -> np.ndarray:
    """Distance (worlds, k) from the centre of each body to its lowest point above each wall [m]."""
    along = np.einsum("kc,wca->wka", normals, R) * (0.5 * size)[:, None, :]
    return np.linalg.norm(along, axis=2) if is_round else np.abs(along).sum(axis=2)


def _places(rng, normals, offsets, R, size, is_round) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions, sizes (worlds, 3) [m] of bodies that touch all walls, and whether each is outside of them.

    n·x - s r = c for each wall, with the reach r of the body and its scale s, is solved for x and the s next to 1.
    """
    span = reach(normals, R, size, is_round)
    A = np.concatenate([np.broadcast_to(normals, (*span.shape, 3)), -span[:, :, None]], axis=2)
    scale = 1.0 + np.einsum("wij,wj->wi", np.linalg.pinv(A), offsets + span)[:, 3]
    size = size * np.clip(scale, 0.02, 50.0)[:, None]
    span, radius, inverse = (
        reach(normals, R, size, is_round),
        0.5 * np.linalg.norm(size, axis=1),
        np.linalg.pinv(normals),
    )
    away = inverse @ np.ones(len(normals))
    distance = rng.integers(-1, 2, len(R)) * log_uniform(rng, -9, -2.5, len(R)) * radius
    pos = (offsets + span) @ inverse.T + distance[:, None] * away / max(np.linalg.norm(away), 1e-9)
    return pos, size, (pos @ normals.T - offsets - span > -DEEPEST * radius[:, None]).all(axis=1)


def _inertias(rng: np.random.Generator, mass: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Inertias (worlds, 3, 3) [kg m²]: half of them of uniform density, half of any other."""
    spread = np.where(rng.random((len(mass), 1)) < 0.5, 1.0, log_uniform(rng, -3, 0.4, (len(mass), 3)))
    second = size**2 / 12 * spread
    return np.eye(3) * (mass[:, None] * (second.sum(axis=1, keepdims=True) - second))[:, :, None]


def _motion(rng: np.random.Generator, normals: np.ndarray, worlds: int, low: float, high: float) -> np.ndarray:
    """Vectors (worlds, 3) of lengths 10**low to 10**high: any way, into the walls, along the first one, or none."""
    kind, vector = rng.integers(4, size=(worlds, 1)), directions(rng, (worlds,))
    into = -(rng.random((worlds, len(normals))) @ normals)
    into = into / np.maximum(np.linalg.norm(into, axis=1, keepdims=True), 1e-9)
    along = vector - (vector @ normals[0])[:, None] * normals[0] * (1 + log_uniform(rng, -4, 0, (worlds, 1)))
    vector = np.select([kind == 1, kind == 2], [into, along], vector)
    return vector * log_uniform(rng, low, high, (worlds, 1)) * (rng.random((worlds, 1)) > 0.15)


def _coefficients(rng: np.random.Generator, effects: Sequence, worlds: int) -> dict[str, np.ndarray]:
    """Friction and restitution (worlds, 1), of those that the effects declare."""
    found = {}
    if any(isinstance(effect, physics.Friction) for effect in effects):
        values = [
            rng.uniform(0, 2, worlds), log_uniform(rng, -3, 1, worlds), log_uniform(rng, 0, 3, worlds), np.zeros(worlds)
        ]  # fmt: skip
        kind = rng.choice(4, worlds, p=KINDS_OF_FRICTION)
        found["friction"] = np.choose(kind, values)[:, None]
    if any(isinstance(effect, physics.Contact) and effect.restitution is not None for effect in effects):
        found["restitution"] = rng.random((worlds, 1)) * rng.integers(2, size=(worlds, 1))
    return found
