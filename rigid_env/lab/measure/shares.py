"""Share of each effect in a run: the number of steps in which it acts, and its share of the computing time.

An effect acts in a step if the same step without it ends in another state, by at least one bit. Its time is the time of
the run minus that of the same scene without it, measured in turns. Without the effect the bodies may move differently
(without contact they fall without end), which is part of this difference.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from rich.text import Text

import physics
from rigid_env.lab.measure.timing import Spread, interleave
from rigid_env.lab.measure.workloads import Steps
from rigid_env.terminal import Column, Table, number_columns

STEP = 0.01  # [s] default step of `rigid-env run`
WHOLE = "whole"
REPEATS = 5


@dataclass(frozen=True)
class Share:
    """Share of one effect in a run.

    Attributes
    ----------
    effect : str
        Name of the effect.
    acted : float
        Share of the steps in which the effect changed the state.
    time : Spread
        Share of the computing time that the run saves without the effect, for each turn; negative if it takes longer.
    """

    effect: str
    acted: float
    time: Spread

    @property
    def is_seen(self) -> bool:
        """True if the time is above the noise: it has the same sign in every turn."""
        return self.time.lowest > 0 or self.time.highest < 0

    def to_dict(self) -> dict:
        """Share as a dict for JSON."""
        return {"effect": self.effect, "acted": self.acted, "time": self.time.to_dict(), "is_seen": self.is_seen}


def without(scene: physics.Scene, effect) -> physics.Scene:
    """Scene without one of its effects, and without other effects that depend on it."""
    left = [other for other in scene.effects if other is not effect]
    needs_contact = (physics.Friction, physics.RollingFriction, physics.SpinFriction, physics.Sleeping)
    if isinstance(effect, physics.Contact):
        left = [other for other in left if not isinstance(other, needs_contact)]
    if isinstance(effect, physics.Friction):
        left = [replace(e, tangential=None) if isinstance(e, physics.Contact) else e for e in left]
    fields = [other for other in left if isinstance(other, physics.Field)]
    if all(field.is_air for field in fields):
        left = [other for other in left if other not in fields]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", physics.SceneWarning)  # without Contact walls do nothing: that is measured
        return physics.Scene(scene.bodies, scene.walls, left)


def names_of(scene: physics.Scene) -> list[str]:
    """Names of a scene's effects: their classes, with a number if there are several of one class."""
    kinds = [type(effect).__name__ for effect in scene.effects]
    return [f"{kind} {kinds[:k].count(kind) + 1}" if kinds.count(kind) > 1 else kind for k, kind in enumerate(kinds)]


def acted_shares(world: physics.World, others: list[physics.World], steps: int) -> list[float]:
    """Shares of the steps in which effects act.

    Parameters
    ----------
    world : World
        World with all effects, which takes the steps.
    others : list of World
        Worlds that lack one effect each; every step is repeated in them from the same state.
    steps : int

    Returns
    -------
    list of float
        For each of `others`, the share of steps that end in another state.
    """
    acted = np.zeros(len(others))
    for _ in range(steps):
        before, time = world.state.copy(), world.time
        memory, sleep = world.memory.copy(), world.sleep.copy()
        world.step()
        for k, other in enumerate(others):
            other.state[...] = before
            other.time = time
            other.memory[...] = memory if other.memory.shape == memory.shape else 0.0
            if other.sleep.shape == sleep.shape:
                other.sleep[...] = sleep
            other.step()
            acted[k] += not np.array_equal(other.state, world.state)
    return (acted / steps).tolist()


def run_count(scene: physics.Scene, repeats: int = REPEATS) -> int:
    """Number of calls of `tick` by `measure`."""
    return (len(scene.effects) + 1) * (repeats + 1)


def measure(
    scene: physics.Scene, duration: float, accuracy: str, repeats: int = REPEATS,
    tick: Callable[[str], None] | None = None,
) -> list[Share]:  # fmt: skip
    """Run a scene for `duration` [s] in steps of `STEP`, with all effects and without each of them.

    `tick` is called with a name before each run.

    Returns
    -------
    list of Share
        Shares in the order of `scene.effects`.

    Raises
    ------
    ValueError
        A duration of less than one step.
    """
    steps = round(duration / STEP)
    if steps < 1:
        raise ValueError(f"duration is {duration!r}; allowed is at least one step, {STEP} s")
    names = names_of(scene)
    worlds = {WHOLE: physics.World(scene, dt=STEP, accuracy=accuracy)}
    for name, effect in zip(names, scene.effects):
        worlds[name] = physics.World(without(scene, effect), dt=STEP, accuracy=accuracy)
    runs = {name: Steps(world, steps) for name, world in worlds.items()}
    spreads = interleave(runs, repeats, tick)
    for run in runs.values():
        run.world.restore(run.start)
    acted = acted_shares(worlds[WHOLE], [worlds[name] for name in names], steps)
    ratios = {name: spreads[WHOLE] / spreads[name] for name in names}  # of times, by speeds
    return [
        Share(name, share, Spread(tuple(1.0 - ratio for ratio in ratios[name].samples)))
        for name, share in zip(names, acted)
    ]


def make_table(shares: list[Share], title: str) -> Table:
    """Table of effects: share of the steps in which each acted, and share of the time as median and range."""
    table = Table([Column("effect"), *number_columns("acted in", "of the time")], title)
    for share in shares:
        time = f"{share.time.median:.1%}" if share.is_seen else "below noise"
        spread = (f"\n{share.time.lowest:.1%} .. {share.time.highest:.1%}", "dim")
        table.add_row(share.effect, f"{share.acted:.1%} of steps", Text.assemble(time, spread))
    return table
