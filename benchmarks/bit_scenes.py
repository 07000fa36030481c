"""Scenes whose states are compared to the last bit, and the run that records them: the worker of `same_bits`.

Only names of the public contract are used, so that the same file runs over an older commit.
"""

from __future__ import annotations

import hashlib
import json
import math
import sys
from collections.abc import Callable

import numpy as np

import physics

DT = 0.01  # [s]
STEPS = 500
PART = 25  # steps between two looks at the state; a shoved scene has a fresh wrench in each
PRESETS = ("fast", "balanced", "precise", "reference")

FLOOR = physics.HalfSpace((0, 1, 0))
TILTED = (math.cos(0.125), math.sin(0.125) / math.sqrt(2), math.sin(0.125) / math.sqrt(2), 0.0)
WEDGE = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)]


def _block(pos=(0, 4, 0), **more) -> physics.Block:
    return physics.Block((5, 3, 2), 6.0, pos=pos, **{"quat": TILTED, "angvel": (0.3, 0.2, 0.1), **more})


def _on_floor(*bodies, effects=()) -> physics.Scene:
    ground = (physics.Gravity(), physics.Contact(0.3), physics.Friction(0.5))
    classes = {type(effect) for effect in effects}
    kept = [effect for effect in ground if type(effect) not in classes]
    return physics.Scene(list(bodies), [FLOOR], [*kept, *effects])


def _in_box(effects=(), **start) -> physics.Scene:
    return physics.Scene(
        [_block(**start)],
        physics.three_walls(10.0),
        [physics.Gravity(), physics.Contact(0.3), physics.Friction(0.5), *effects],
    )


def _corner() -> physics.Scene:
    effects = [physics.Gravity(), physics.Contact(0.2), physics.Friction(0.4)]
    return physics.Scene([_block((3.5, 5, 3.5), linvel=(-1.5, 0, -1))], physics.corner(), effects)


def _cubes(count: int, gap: float = 0.0) -> list[physics.Block]:
    return [physics.Block((1, 1, 1), 1.0, pos=(0.02 * k, 0.5 + (1 + gap) * k, 0)) for k in range(count)]


def _mixed() -> physics.Scene:
    return _on_floor(
        physics.Sphere(0.5, 1.0, pos=(0, 2, 0)),
        physics.Block((1, 1, 1), 2.0, pos=(0.2, 3.5, 0.1), quat=TILTED),
        physics.Ellipsoid((0.6, 0.4, 0.3), 1.0, pos=(0.1, 5, 0)),
        physics.Hull(WEDGE, mass=2.0, pos=(0.3, 6.5, 0.1)),
    )


def _pendulum() -> physics.Scene:
    balls = [physics.Sphere(0.2, 1.0, pos=(1.0 + k, 5, 0)) for k in range(2)]
    springs = [
        physics.Spring(anchor=(0, 5, 0), stiffness=200.0, damping=0.5, length=1.0),
        physics.Spring(body=0, other=1, anchor=(0, 0, 0), stiffness=150.0, damping=0.2, length=1.0),
    ]
    return physics.Scene(balls, [], [physics.Gravity(), *springs])


SCENES: dict[str, Callable[[], physics.Scene]] = {
    "tumble": lambda: physics.Scene([_block(angvel=(0.1, 5.0, 0.1))]),
    "drop": _in_box,
    "shoved": lambda: _in_box(pos=(0, 1.5, 0), quat=(1, 0, 0, 0), angvel=(0, 0, 0)),
    "corner": _corner,
    "frictionless": lambda: physics.Scene([_block()], [FLOOR], [physics.Gravity(), physics.Contact(0.5)]),
    "elastic": lambda: _on_floor(_block(), effects=(physics.Contact(1.0),)),
    "superball": lambda: _on_floor(
        physics.Sphere(0.5, 1.0, pos=(0, 2, 0), linvel=(2, 0, 0), angvel=(0, 0, 9)),
        effects=(physics.Contact(0.9, tangential=0.8),),
    ),
    "compliant": lambda: _on_floor(_block(), effects=(physics.Contact(stiffness=2e4, damping=30.0),)),
    "grain": lambda: _on_floor(
        _block((0, 2, 0), linvel=(3, 0, 1)), effects=(physics.Friction((0.2, 0.6), axis=(1, 0, 0)),)
    ),
    "sphere-rolls": lambda: _on_floor(
        physics.Sphere(1.0, 1.0, pos=(0, 1, 0), linvel=(5, 0, 1)),
        effects=(physics.RollingFriction(0.01), physics.SpinFriction(0.01)),
    ),
    "ellipsoid": lambda: _on_floor(physics.Ellipsoid((2.0, 1.0, 0.7), 3.0, pos=(0, 2.5, 0), angvel=(0.5, 0.2, 1.0))),
    "hull": lambda: _on_floor(physics.Hull(WEDGE, mass=2.0, pos=(0, 2, 0), angvel=(1, 2, 0.5))),
    "offset-inertia": lambda: _on_floor(_block(inertia_body=((8, 1, 0.5), (1, 12, 0.3), (0.5, 0.3, 15)))),
    "kick": lambda: physics.Scene(
        [physics.Sphere(0.11, 0.43, linvel=(20, 10, 0), angvel=(0, 0, 60))],
        [],
        [physics.Gravity(), physics.Drag(0.25), physics.Magnus(), physics.AngularDrag(1e-5), physics.Wind(gust=2.0)],
    ),
    "floats": lambda: physics.Scene(
        [_block((0, 0.5, 0))], [], [physics.Gravity(), physics.Buoyancy(), physics.Drag(1.0, density=1000.0)]
    ),
    "spring": lambda: physics.Scene(
        [_block((3, 0, 0))],
        [],
        [physics.Gravity(), physics.Spring(anchor=(0, 2, 0), point=(1, 0.5, 0), stiffness=80, damping=1)],
    ),
    "push": lambda: _in_box((physics.Push((20, 0, 0), point=(0, 1, 0), frame="body"),)),
    "actuated": lambda: _in_box((physics.Actuator(limit_force=40.0, limit_torque=50.0, lag=0.05, delay=0.02),)),
    "pendulum": _pendulum,
    "tower": lambda: _on_floor(*_cubes(4)),
    "falling-cubes": lambda: _on_floor(*_cubes(5, gap=0.4)),
    "mixed": _mixed,
    "sleeping-block": lambda: _on_floor(_block((0, 1.6, 0)), effects=(physics.Sleeping(),)),
    "sleeping-tower": lambda: _on_floor(*_cubes(3, gap=0.05), effects=(physics.Sleeping(),)),
}
"""Every shape, every family of effects, one body and several, sleep and springs."""

SHOVED = ("shoved", "actuated", "tower", "kick")


def record(name: str, preset: str, steps: int) -> dict:
    """Run one scene at one preset.

    Returns
    -------
    dict
        `digest` of the states at every look and of the last report, `state` at the end, or the `error` it ends with.
    """
    try:
        world = physics.World(SCENES[name](), worlds=2, dt=DT, accuracy=preset)
        return _run(world, steps, is_shoved=name in SHOVED)
    except ValueError as error:
        return {"error": type(error).__name__}


def _run(world: physics.World, steps: int, is_shoved: bool) -> dict:
    rng = np.random.default_rng(7)
    digest = hashlib.sha256()
    for _ in range(steps // PART):
        wrench = None
        if is_shoved:
            wrench = rng.normal(size=(world.worlds, world.body_count, 6)) * 10.0
        world.step(wrench, steps=PART)
        for array in (world.pos, world.quat, world.linvel, world.angvel):
            digest.update(np.ascontiguousarray(array).tobytes())
    state = np.concatenate([world.pos, world.quat, world.linvel, world.angvel], axis=-1)
    return {"digest": digest.hexdigest(), "state": state.ravel().tolist()}


def main() -> None:
    """Answer requests, a JSON list (scene, preset, steps) in each line of standard input, with a line each."""
    for line in sys.stdin:
        print(json.dumps(record(*json.loads(line))), flush=True)


if __name__ == "__main__":
    main()
