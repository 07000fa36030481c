"""Measure the computing time of an effect: a scene with it and the same scene without it, run in turns."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import physics
from physics import scenes, validation
from rigid_env.lab.measure.timing import Row, interleave
from rigid_env.lab.measure.workloads import Steps

STEP = 0.005  # [s]
STEPS = 20_000  # steps of one run
QUICK_STEPS = 500
ON, OFF = "on", "off"

GRAVITY = physics.Gravity((0.0, -scenes.GRAVITY, 0.0))
FLOATING = physics.Block((2.0, 1.0, 3.0), 3000.0, pos=(0.0, 0.1, 0.0), angvel=(0.1, 0.2, 0.1))
CORNER = (2.5, 1.5, 1.0)


FLOOR = physics.HalfSpace((0.0, 1.0, 0.0))
BALL = physics.Sphere(0.5, 2.0, pos=(0.0, 0.5, 0.0), linvel=(5.0, 0.0, 0.0), angvel=(0.0, 30.0, -10.0))
BOUNCING = physics.Sphere(0.5, 2.0, pos=(0.0, 1.5, 0.0), linvel=(5.0, 0.0, 0.0), angvel=(0.0, 3.0, 1.0))
TOUCH = (GRAVITY, physics.Contact(), physics.Friction(50.0))

# A slope on which a slab slides without end, across the axis of anisotropic friction.
SLAB = physics.Block((2.0, 0.2, 2.0), 2.0, pos=(0.0, 0.1, 0.0))
SLOPE = physics.Gravity((5.0, -8.0, 3.0))


def _flying() -> physics.Body:
    """The tumbling block of the canonical scene "tumble"."""
    return scenes.tumble().bodies[0]


def _case(effect, *others, bodies=None, walls=()) -> tuple[physics.Scene, physics.Scene]:
    """Make two scenes, with and without the effect, both with `others`; one body in flight by default."""
    bodies = bodies or [_flying()]
    return tuple(physics.Scene(bodies, walls, [*others, *extra]) for extra in ((effect,), ()))


def _bouncing() -> tuple[physics.Scene, physics.Scene]:
    """Two scenes of a bouncing ball: with tangential restitution (a superball), and with sticking impacts."""
    laws = (physics.Contact(1.0, tangential=1.0), physics.Contact(1.0))
    return tuple(physics.Scene([BOUNCING], [FLOOR], [GRAVITY, law, physics.Friction(50.0)]) for law in laws)


def _soft() -> tuple[physics.Scene, physics.Scene]:
    """Two scenes of the block at rest: on compliant contacts with stiffness and damping, and on rigid contacts."""
    scene = scenes.rest()
    others = [effect for effect in scene.effects if not isinstance(effect, physics.Contact)]
    laws = (physics.Contact(stiffness=1e5, damping=1e3), physics.Contact())
    return tuple(physics.Scene(scene.bodies, scene.walls, [*others, law]) for law in laws)


def _grained() -> tuple[physics.Scene, physics.Scene]:
    """Two scenes of a sliding slab: with two coefficients of friction, and with one."""
    laws = (physics.Friction((0.2, 0.4), axis=(0.0, 0.0, 1.0)), physics.Friction(0.3))
    return tuple(physics.Scene([SLAB], [FLOOR], [SLOPE, physics.Contact(), law]) for law in laws)


def _pair() -> list[physics.Body]:
    return [_flying(), physics.Block((2.0, 1.0, 3.0), 4.0, pos=(6.0, 5.0, 0.0), angvel=(0.5, 1.0, 0.0))]


def _touching(kind: type) -> tuple[physics.Scene, physics.Scene]:
    """Two scenes of the block at rest: with an effect of contact of class `kind`, and without it.

    Without `Contact` the block falls.
    """
    scene = scenes.rest()
    gone = {physics.Contact: (physics.Contact, physics.Friction)}.get(kind, (kind,))
    without = [effect for effect in scene.effects if not isinstance(effect, gone)]
    return scene, physics.Scene(scene.bodies, () if kind is physics.Contact else scene.walls, without)


def _resting() -> tuple[physics.Scene, physics.Scene]:
    """Two scenes of the block at rest: with sleeping, which starts after a second and a half, and without."""
    scene = scenes.rest()
    return physics.Scene(scene.bodies, scene.walls, [*scene.effects, physics.Sleeping()]), scene


CASES: dict[str, Callable[[], tuple[physics.Scene, physics.Scene]]] = {
    "gravity": lambda: _case(GRAVITY),
    "contact": lambda: _touching(physics.Contact),
    "friction": lambda: _touching(physics.Friction),
    "drag": lambda: _case(physics.Drag(), GRAVITY),
    "angular drag": lambda: _case(physics.AngularDrag(), GRAVITY),
    "magnus": lambda: _case(physics.Magnus(), GRAVITY),
    "wind": lambda: _case(physics.Wind(), GRAVITY, physics.Drag()),
    "gusts": lambda: _case(physics.Wind(gust=2.0), GRAVITY, physics.Drag()),
    "buoyancy": lambda: _case(physics.Buoyancy(), GRAVITY, bodies=[FLOATING]),
    "spring": lambda: _case(physics.Spring((0.0, 5.0, 0.0), CORNER, 40.0, 1.0), GRAVITY),
    "spring between bodies": lambda: _case(physics.Spring(CORNER, CORNER, 40.0, 1.0, other=1), bodies=_pair()),
    "push": lambda: _case(physics.Push((1.0, 0.0, 0.0), CORNER), GRAVITY),
    "tangential restitution": _bouncing,
    "friction of two coefficients": _grained,
    "compliance": _soft,
    "rolling friction": lambda: _case(physics.RollingFriction(), *TOUCH, bodies=[BALL], walls=[FLOOR]),
    "spin friction": lambda: _case(physics.SpinFriction(), *TOUCH, bodies=[BALL], walls=[FLOOR]),
    "sleeping": _resting,
    "actuator": lambda: _case(physics.Actuator(limit_force=1.0, lag=0.1), GRAVITY),
}


def bytes_per_body(world: physics.World) -> int:
    """Bytes that a world stores per body for parameters and sleep."""
    return (world.params.nbytes + world.sleep.nbytes) // (world.worlds * world.body_count)


def chosen(names: Sequence[str]) -> list[str]:
    """Check names of effects, and return them; all effects if there are none.

    Raises
    ------
    ValueError
        A name that is not in `CASES`.
    """
    for name in names:
        validation.one_of(name, CASES, "effect")
    return list(names or CASES)


def run_count(effects: int, repeats: int) -> int:
    """Number of calls of `tick` by `effect_row` for this number of effects."""
    return effects * 2 * (repeats + 1)


def effect_row(name: str, accuracy: str, steps: int, repeats: int, tick: Callable[[str], None] | None = None) -> Row:
    """Measure one effect of `CASES`; `tick` is called with a text before each run.

    Returns
    -------
    Row
        Steps per second with the effect, compared with those without it. `notes` has the time that the effect adds to a
        step [ns], and the bytes of parameters that it adds per body.
    """
    worlds = {key: physics.World(scene, dt=STEP, accuracy=accuracy) for key, scene in zip((ON, OFF), CASES[name]())}
    runners = {key: Steps(world, steps) for key, world in worlds.items()}
    told = None if tick is None else lambda key: tick(f"{name}: {key}")
    spreads = interleave(runners, repeats, told)
    stored = {key: bytes_per_body(world) for key, world in worlds.items()}
    added = 1e9 / spreads[ON].median - 1e9 / spreads[OFF].median
    return Row(
        key=name, what=name, unit="steps/s", ours=spreads[ON], accuracy=accuracy, peer_name="the scene without it",
        peer=spreads[OFF], notes={"added_ns_per_step": added, "added_bytes_per_body": stored[ON] - stored[OFF]},
    )  # fmt: skip
