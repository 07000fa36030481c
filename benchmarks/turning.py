"""Turning rods past things: ``python -m benchmarks.turning [--placements N] [--json FILE]``.

A rod of 2 x 0.02 x 0.02 m turns by 0.3 to 3 rad a step past a ball, a cube, a hull, another rod that turns as well, and
a wall; an ellipsoid of these axes past a ball and a wall. An oracle (`tests.reference.turning`) says of each placement
whether the rod meets the thing; a third of them are drawn near to grazing. Missed: it does, by more than `MARGIN` where
nothing hinders it, and the run has no impulse. Invented: it stays clear by more than that, and there is one.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

import physics
from benchmarks import machine
from rigid_env.lab.measure.machine import write_json
from rigid_env.terminal import make_console
from tests.reference import turning as truth

SIZE = np.array([2.0, 0.02, 0.02])  # of the rod [m]
BALL = 0.1  # radius [m]
CUBE = 0.2  # edge [m]
HULL = 0.1 * np.array([[1, 0, -0.6], [-0.5, 0.9, -0.6], [-0.5, -0.9, -0.6], [0.2, 0.1, 1.1], [0.9, 0.8, 0.3]])
DT = 0.01  # [s]
STEPS = 3
MARGIN = 1e-4  # [m], ten slops at `fast`
APART = 0.01  # at the start, at least [m]
THINGS = ("ball", "cube", "hull", "rod", "wall", "ellipsoid", "ellipsoid-wall")
PRESETS = ("fast", "balanced", "precise", "reference")


@dataclass(frozen=True)
class Drawn:
    """Placements of a rod, body 0, and of a thing, body 1 (but for a wall), and how near they come."""

    thing: str
    scene: physics.Scene
    pos: np.ndarray  # (n, bodies, 3)
    quat: np.ndarray  # (n, bodies, 4)
    linvel: np.ndarray
    angvel: np.ndarray
    least: np.ndarray  # least distance in `STEPS` steps [m], negative where they meet


def _scene(thing: str) -> physics.Scene:
    rod = physics.Block(tuple(SIZE), 1.0, pos=(0, 3, 0))
    if thing.startswith("ellipsoid"):
        rod = physics.Ellipsoid(tuple(0.5 * SIZE), 1.0, pos=(0, 3, 0))
    effects = [physics.Gravity(tuple(_gravity(thing))), physics.Contact(0.5), physics.Friction(0.3)]
    if thing.endswith("wall"):
        return physics.Scene([rod], [physics.HalfSpace((0, 1, 0), 0.0)], effects)
    other = {
        "ball": lambda: physics.Sphere(BALL, 1.0),
        "ellipsoid": lambda: physics.Sphere(BALL, 1.0),
        "cube": lambda: physics.Block((CUBE, CUBE, CUBE), 1.0),
        "hull": lambda: physics.Hull(tuple(map(tuple, HULL)), 1.0),
        "rod": lambda: physics.Block(tuple(SIZE), 1.0),
    }[thing]()
    return physics.Scene([rod, other], [], effects)


def _gravity(thing: str) -> np.ndarray:
    """None without a wall to lie on. It is declared all the same: so the kernel is that of other scenes."""
    return np.array([0.0, -9.81 if thing.endswith("wall") else 0.0, 0.0])


def _units(rng, n: int, size: int) -> np.ndarray:
    v = rng.standard_normal((n, size))
    return v / np.linalg.norm(v, axis=1)[:, None]


def _tops(thing: str, scene, pos, quat, linvel, angvel) -> list[truth.Top]:
    gravity = _gravity(thing)
    moments = [np.diag(body.inertia) for body in scene.bodies]
    return [
        truth.Top(I[0], I[1], pos[:, b], quat[:, b], linvel[:, b], angvel[:, b], gravity) for b, I in enumerate(moments)
    ]


def _distance(thing: str, scene, tops, k: int):
    """Distance over the time of placement k."""
    rod = truth.polyhedron(truth.box_corners(SIZE))
    if thing == "ellipsoid-wall":
        return lambda t: truth.ellipsoid_from_wall(*tops[0].at(k, t), 0.5 * SIZE, np.array([0, 1.0, 0]), 0.0)
    if thing == "ellipsoid":
        return lambda t: truth.ellipsoid_from_ball(*tops[0].at(k, t), 0.5 * SIZE, tops[1].pos[k], BALL)
    if thing == "wall":
        return lambda t: truth.apart_from_wall(*tops[0].at(k, t), rod.corners, np.array([0, 1.0, 0]), 0.0)
    if thing == "ball":
        return lambda t: truth.apart_from_ball(*tops[0].at(k, t), 0.5 * SIZE, tops[1].pos[k], BALL)
    points = {"cube": truth.box_corners([CUBE] * 3), "rod": rod.corners}.get(thing)
    if points is None:
        points = np.array(scene.bodies[1].polyhedron.vertices)
    other = truth.polyhedron(points)
    if thing != "rod":
        return lambda t: truth.apart_from_small(*tops[0].at(k, t), 0.5 * SIZE, *tops[1].at(k, t), other)
    return lambda t: truth.apart(*tops[0].at(k, t), rod, *tops[1].at(k, t), other)


def _draw_some(thing: str, scene, n: int, rng) -> tuple[np.ndarray, ...]:
    """Places and velocities (n, bodies, ...): the rod turns across its axis, with some spin along it."""
    bodies = len(scene.bodies)
    quat = _units(rng, n * bodies, 4).reshape(n, bodies, 4)
    turn = rng.uniform(0.3, 3.0, n)
    R = np.stack([truth.Rotation.from_quat(q[[1, 2, 3, 0]]).as_matrix() for q in quat[:, 0]])
    across = np.einsum("tij,tj->ti", R, np.c_[np.zeros(n), _units(rng, n, 2)])
    pos, linvel, angvel = np.zeros((n, bodies, 3)), np.zeros((n, bodies, 3)), np.zeros((n, bodies, 3))
    angvel[:, 0] = (turn[:, None] * across + rng.uniform(-0.5, 0.5, (n, 1)) * R[:, :, 0]) / DT
    linvel[:, 0] = rng.uniform(0, 0.2, (n, 1)) * _units(rng, n, 3) / DT
    is_grazing = rng.random(n) < 0.35
    if thing.endswith("wall"):
        pos[:, 0, 1] = np.where(is_grazing, rng.uniform(0.97, 1.02, n), rng.uniform(0.1, 1.2, n))
        return pos, quat, linvel, angvel
    reach = {"ball": BALL, "ellipsoid": BALL, "cube": 0.87 * CUBE, "hull": 0.12, "rod": 1.0}[thing]
    far = np.where(is_grazing, 1.0 + reach * rng.uniform(0.8, 1.05, n), rng.uniform(0.1, 1.0, n) * (1 + reach))
    lift = rng.uniform(-1, 1, n) * reach * np.where(rng.random(n) < 0.5, 1.0, 0.1)
    way = np.cross(across, _units(rng, n, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    pos[:, 1] = far[:, None] * way + lift[:, None] * across
    if thing == "rod":
        S = np.stack([truth.Rotation.from_quat(q[[1, 2, 3, 0]]).as_matrix() for q in quat[:, 1]])
        turn = rng.uniform(0.3, 3.0, n)[:, None] * np.c_[np.zeros(n), _units(rng, n, 2)]
        angvel[:, 1] = np.einsum("tij,tj->ti", S, turn) / DT
    return pos, quat, linvel, angvel


def draw(thing: str, placements: int, seed: int = 0) -> Drawn:
    """So many placements in which the two are apart at first and are not within `MARGIN` of grazing."""
    rng, scene = np.random.default_rng([seed, THINGS.index(thing)]), _scene(thing)
    kept: list[tuple] = []
    while len(kept) < placements:
        some = _draw_some(thing, scene, 50, rng)
        tops = _tops(thing, scene, *some)
        for k in range(50):
            least, first = truth.least(_distance(thing, scene, tops, k), STEPS * DT)
            if first > APART and abs(least) > MARGIN:
                kept.append((*(a[k] for a in some), least))
    return Drawn(thing, scene, *(np.array(column) for column in zip(*kept[:placements])))


def run(drawn: Drawn, accuracy: str, step_share: float = 1.0) -> dict:
    """Counts of a run of all placements at a preset."""
    n = len(drawn.least)
    world = physics.World(drawn.scene, worlds=n, dt=DT * step_share, accuracy=accuracy)
    world.set_state(drawn.pos, drawn.quat, drawn.linvel, drawn.angvel)
    world.step(dt=1e-12)  # compiled
    world.set_state(drawn.pos, drawn.quat, drawn.linvel, drawn.angvel)
    start, bad = time.perf_counter(), np.zeros(n, bool)
    for _ in range(round(STEPS / step_share)):
        bad |= np.asarray(world.step().status) != 0
    seconds = time.perf_counter() - start
    free = drawn.linvel + STEPS * DT * _gravity(drawn.thing)
    is_hit = (np.abs(world.linvel - free).max(axis=(1, 2)) > 1e-9) | (
        np.abs(np.linalg.norm(world.angvel, axis=2) - np.linalg.norm(drawn.angvel, axis=2)).max(axis=1) > 1e-6
    )
    meets = drawn.least < 0
    return {
        "thing": drawn.thing, "accuracy": accuracy, "placements": n, "meet": int(meets.sum()),
        "missed": int((meets & ~is_hit).sum()), "invented": int((~meets & is_hit).sum()), "reported": int(bad.sum()),
        "finite": bool(np.isfinite(world.state).all()), "seconds": seconds,
        "which": np.flatnonzero(meets & ~is_hit)[:20].tolist(),
    }  # fmt: skip


def main(
    placements: Annotated[int, typer.Option(help="Of each thing.")] = 500,
    thing: Annotated[list[str] | None, typer.Option(help=f"Some of {', '.join(THINGS)}.")] = None,
    accuracy: Annotated[list[str] | None, typer.Option(help="Presets.")] = None,
    json: Annotated[Path | None, typer.Option(help="Where to write the result.")] = None,
) -> None:
    """Count what turning rods miss."""
    console, rows = make_console(), []
    console.print(machine.headline())
    for name in thing or THINGS:
        drawn = draw(name, placements)
        for preset in accuracy or PRESETS:
            row = run(drawn, preset)
            rows.append(row)
            console.print(" ".join(f"{key} {value}" for key, value in row.items()), soft_wrap=True, highlight=False)
    if placements >= 500 and not thing and not accuracy:
        path = json.resolve() if json else machine.RESULTS / "turning.json"
        write_json(path, {"name": "turning", "settings": {"dt": DT, "steps": STEPS, "margin": MARGIN}, "rows": rows})
        console.print(f"written to {path}")


if __name__ == "__main__":
    typer.run(main)
