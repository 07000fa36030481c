"""Looks that the tests of the stage draw: made by hand, so that no kernel is compiled."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rigid_env.rendering import BodyView, Frame, GoalView, WallView
from rigid_env.rendering.meshes import BLOCK_FACES
from rigid_env.viewer.interface import Look

FLOOR = WallView((0.0, 1.0, 0.0), 0.0)
BLOCK = BodyView("block", (5.0, 3.0, 2.0), (0.0, 2.5, 0.0), (0.9689124, 0.0, 0.2474040, 0.0))
CUBE_CORNERS = np.array([[i, j, k] for i in (-0.5, 0.5) for j in (-0.5, 0.5) for k in (-0.5, 0.5)])


def look_of(bodies=(BLOCK,), time=0.0, **more) -> Look:
    """A look at bodies over a floor; `more` are fields of the frame or of the look."""
    fields = {name: more.pop(name) for name in list(more) if name in Look.__dataclass_fields__}
    frame = Frame(bodies=tuple(bodies), **{"walls": (FLOOR,), **more})
    count = len(bodies)
    plain = {
        "linvel": np.zeros((count, 3)), "angvel": np.zeros((count, 3)), "is_asleep": np.zeros(count, dtype=bool),
        "radius": frame.poses.radius, "drag": None, "ghost": None,
    }  # fmt: skip
    return Look(frame=frame, time=time, **{**plain, **fields})


def busy_look() -> Look:
    """A look with something in every layer."""
    ghost = Frame(bodies=(replace(BLOCK, pos=np.add(BLOCK.pos, (1.0, 0.3, 0.0))),), walls=(FLOOR,))
    return look_of(
        contact_points=((2.0, 0.0, 1.0), (-2.0, 0.0, 1.0)), contact_forces=((0.0, 30.0, 0.0), (5.0, 20.0, 0.0)),
        applied_force=(20.0, 30.0, 0.0), applied_torque=(0.0, 80.0, 0.0), goal=GoalView((5.0, 1.0, 3.0), 1.5, False, 3),
        linvel=np.array([[4.0, 1.0, 0.0]]), angvel=np.array([[0.0, 2.0, 1.0]]), is_asleep=np.array([True]),
        drag=(np.array((2.0, 3.0, 1.0)), np.array((5.0, 6.0, 2.0))), ghost=ghost,
    )  # fmt: skip


def crowd(count: int, rng: np.random.Generator) -> tuple[BodyView, ...]:
    """Bodies of all shapes, turned at random."""
    bodies = []
    for k in range(count):
        pos, quat = np.add(rng.uniform(-4.0, 4.0, 3), (0.0, 5.0, 0.0)), rng.standard_normal(4)
        quat = quat / np.linalg.norm(quat)
        kind = ("block", "sphere", "ellipsoid", "hull", "capsule", "cylinder")[k % 6]
        size = np.full(3, 0.6) if kind in ("sphere", "hull") else rng.uniform(0.4, 1.2, 3)
        size = np.array([0.4, 1.0, 0.4]) if kind in ("capsule", "cylinder") else size
        hull = {"corners": CUBE_CORNERS, "faces": tuple(map(tuple, BLOCK_FACES.tolist()))} if kind == "hull" else {}
        bodies.append(BodyView(kind, size, pos, quat, **hull))
    return tuple(bodies)


def motion(bodies: tuple[BodyView, ...], duration: float, fps: float, rng: np.random.Generator):
    """Looks at bodies that all move and turn all the time: nothing of it can be left out of a file."""
    count = len(bodies)
    speeds, quats = rng.uniform(-1.0, 1.0, (count, 3)), np.array([body.quat for body in bodies])
    for k in range(round(duration * fps) + 1):
        time = k / fps
        quats = quats + 0.02 * rng.standard_normal((count, 4))
        quats /= np.linalg.norm(quats, axis=1, keepdims=True)
        moved = [
            replace(body, pos=body.pos + np.sin(3.0 * time * speed), quat=quat)
            for body, speed, quat in zip(bodies, speeds, quats)
        ]
        yield look_of(moved, time)
