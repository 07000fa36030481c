"""Speed of ray casts beside MuJoCo's: ``python -m benchmarks.rays [--repeats N] [--json FILE]``.

1,000 rays in scenes of 100 bodies (blocks, spheres, ellipsoids) over a floor, with one thread each, in turns. The rays
of a lidar are rings of neighbours; scattered rays have random directions. Both engines return distances, geoms and
normals, and must agree on them. A sample is the CPU time of some casts.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

import physics
from benchmarks import machine
from rigid_env.lab.measure.table import make_table
from rigid_env.lab.measure.timing import Row, interleave
from rigid_env.terminal import make_console

BODIES, RAYS, CASTS = 100, 1000, 20
TARGET = 5.0  # least ratio to MuJoCo
AGREEMENT = 1e-9  # largest difference of two distances [m]
EXTENT = 5.0  # half the edge of the cube in which the bodies are [m]
RINGS = 20
DT = 0.005


def scene() -> physics.Scene:
    """100 bodies of three shapes in a cube, over a floor."""
    rng, bodies = np.random.default_rng(1), []
    for k in range(BODIES):
        size, quat = rng.uniform(0.2, 0.5, 3), rng.standard_normal(4)
        pose = {"pos": rng.uniform(-EXTENT, EXTENT, 3), "quat": quat / np.linalg.norm(quat)}
        kinds = (physics.Block, 2 * size), (physics.Ellipsoid, size), (physics.Sphere, float(size[0]))
        kind, given = kinds[k % 3]
        bodies.append(kind(given, 1.0, **pose))
    return physics.Scene(bodies, [physics.HalfSpace((0, 1, 0), -EXTENT - 1)], [physics.Contact()])


def directions(name: str) -> np.ndarray:
    """Unit vectors (RAYS, 3): rings of a lidar, or scattered."""
    if name == "scattered":
        found = np.random.default_rng(2).standard_normal((RAYS, 3))
        return found / np.linalg.norm(found, axis=1)[:, None]
    height, turn = np.meshgrid(
        np.linspace(-0.6, 0.6, RINGS), np.linspace(0, 2 * np.pi, RAYS // RINGS, endpoint=False), indexing="ij"
    )
    return np.stack((np.cos(height) * np.cos(turn), np.sin(height), np.cos(height) * np.sin(turn)), -1).reshape(-1, 3)


class Ours:
    """Our ray casts from the middle of the scene; a call returns rays per second of CPU time."""

    def __init__(self, what: physics.Scene, rays: np.ndarray):
        self.world, self.rays, self.origin = physics.World(what, dt=DT), rays, np.zeros(3)
        self.hits = self.world.cast_rays(self.origin, rays)

    def __call__(self) -> float:
        start = time.thread_time()
        for _ in range(CASTS):
            self.world.cast_rays(self.origin, self.rays, out=self.hits)
        return CASTS * len(self.rays) / (time.thread_time() - start)

    def result(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Distances, codes and normals."""
        return self.hits.distance[0], self.hits.hit[0], self.hits.normal[0]


class Theirs:
    """`mj_multiRay` on the same rays; a call returns rays per second of CPU time."""

    def __init__(self, what: physics.Scene, rays: np.ndarray):
        import mujoco

        from rigid_env.lab.measure.peers.mujoco import MuJoCo

        self.mujoco, run = mujoco, MuJoCo().open(what, DT)
        self.model, self.data = run.model, run.data
        mujoco.mj_forward(self.model, self.data)
        self.origin, self.rays = np.zeros(3), rays.ravel()
        self.distance, self.normal = np.zeros(len(rays)), np.zeros(self.rays.size)
        self.geom = np.zeros(len(rays), np.int32)
        self.bodies = len(what.bodies)

    def cast(self) -> None:
        """Cast all rays, with no limit of their length."""
        self.mujoco.mj_multiRay(
            self.model, self.data, self.origin, self.rays, None, True, -1, self.geom, self.distance, self.normal,
            len(self.geom), self.mujoco.mjMAXVAL,
        )  # fmt: skip

    def __call__(self) -> float:
        start = time.thread_time()
        for _ in range(CASTS):
            self.cast()
        return CASTS * len(self.geom) / (time.thread_time() - start)

    def result(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Distances, codes and normals in our terms: body b + 1 of MuJoCo is our body b, its world is our wall."""
        is_hit = self.geom >= 0
        owner = self.model.geom_bodyid[self.geom] - 1
        code = np.where(is_hit, owner, -(2**31))
        return np.where(is_hit, self.distance, np.inf), code, self.normal.reshape(-1, 3) * is_hit[:, None]


def differences(ours: Ours, theirs: Theirs) -> dict[str, float]:
    """Rays that only one engine lets hit, or that hit another body, and the largest differences where both hit."""
    (t, code, n), (their_t, their_code, their_n) = ours.result(), theirs.result()
    both = np.isfinite(t) & np.isfinite(their_t)
    return {
        "hits": int(np.isfinite(t).sum()),
        "other_hits": int((code != their_code).sum()),
        "distance": float(np.abs(t[both] - their_t[both]).max()),
        "normal": float(np.abs(n[both] - their_n[both]).max()),
    }


def measure(name: str, repeats: int) -> Row:
    """Rays per second of both engines on one kind of rays."""
    what, rays = scene(), directions(name)
    ours, theirs = Ours(what, rays), Theirs(what, rays)
    spreads = interleave({"ours": ours, "mujoco": theirs}, repeats)
    found = differences(ours, theirs)
    return Row(
        name, f"{RAYS} {name} rays, {BODIES} bodies", "rays/CPU s", spreads["ours"], peer_name="mj_multiRay",
        peer=spreads["mujoco"], target=TARGET, notes=found,
        is_valid=found["other_hits"] == 0 and found["distance"] <= AGREEMENT,
    )  # fmt: skip


def main(
    repeats: Annotated[int, typer.Option(min=1, help="Samples of each engine, in turns.")] = 15,
    json: Annotated[Path | None, typer.Option(metavar="FILE", help="Instead of benchmarks/results/rays.json.")] = None,
) -> None:
    """Measure ray casts beside MuJoCo's."""
    rows = [measure(name, repeats) for name in ("lidar", "scattered")]
    console = make_console()
    console.print(make_table(rows, machine.headline(), ("ours", "MuJoCo")))
    for row in rows:
        console.print(f"{row.key}: {row.notes}")
    machine.keep("rays", rows, json, bodies=BODIES, rays=RAYS, casts=CASTS)


if __name__ == "__main__":
    typer.run(main)
