"""Make a recording that breaks a law smaller: fewer steps, no wrenches, fewer bodies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import physics
from physics.io.recording import Recording, Start
from physics.plan.plan import make_plan
from physics.world.snapshot import KEPT
from physics.world.world import Snapshot
from rigid_env.hard_cases.cases.random_scenes import Outcome, gain_limit, look, push


def law_broken(recording: Recording) -> str:
    """The law that the recorded steps break when they are taken again; empty: none.

    Steps with a wrench are held against what it could put in, others against the energy before.
    """
    world = recording.world()
    starts = {start.step: start.snapshot for start in recording.starts}
    limit, outcome = gain_limit(recording.accuracy), Outcome.start(1)
    for k, (wrench, steps, dt) in enumerate(zip(recording.wrenches, recording.steps.tolist(), recording.dt.tolist())):
        if k in starts:
            world.restore(starts[k])
        before, push_now = look(world), push(world, wrench[None]) if wrench.any() else None
        world.step(wrench[None], steps=steps, dt=dt)
        outcome.note(world, before, push_now, steps * dt)
        if outcome.broken_laws(limit)[0]:
            return outcome.law(0, limit)
    return ""


def shrink(recording: Recording) -> Recording:
    """The smallest recording found that still breaks a law; itself where nothing smaller does."""
    recording = _fewer_steps(recording)
    still = replace(recording, wrenches=np.zeros_like(recording.wrenches))
    if law_broken(still):
        recording = still
    for body in reversed(range(len(recording.scene.bodies))):
        smaller = _without(recording, body)
        if smaller is not None and law_broken(smaller):
            recording = smaller
    return _fewer_steps(_taken_again(recording))


def _fewer_steps(recording: Recording) -> Recording:
    """The shortest of the last 1, 2, 4, ... steps that breaks a law."""
    snapshots = _snapshots(recording)
    count = 1
    while count < len(recording):
        first = len(recording) - count
        some = {name: getattr(recording, name)[first:] for name in ("wrenches", "steps", "dt", "states")}
        later = [Start(start.step - first, start.snapshot) for start in recording.starts if start.step > first]
        shorter = replace(recording, starts=(Start(0, snapshots[first]), *later), **some)
        if law_broken(shorter):
            return shorter
        count *= 2
    return recording


def _snapshots(recording: Recording) -> list[Snapshot]:
    """The world before each step."""
    world, found = recording.world(), []
    starts = {start.step: start.snapshot for start in recording.starts}
    for k, (wrench, steps, dt) in enumerate(zip(recording.wrenches, recording.steps.tolist(), recording.dt.tolist())):
        if k in starts:
            world.restore(starts[k])
        found.append(world.snapshot())
        world.step(wrench[None], steps=steps, dt=dt)
    return found


def _without(recording: Recording, body: int) -> Recording | None:
    """The recording with one body less, contacts forgotten; None where the rest has other columns, or is no scene."""
    bodies = recording.scene.bodies
    if len(bodies) < 3:  # one alone would have another plan
        return None
    scene = _fewer(recording.scene, body)
    columns = {make_plan(each, recording.accuracy).columns for each in (scene, recording.scene) if each is not None}
    if scene is None or len(columns) > 1:
        return None
    fresh = dict(zip(KEPT, physics.World(scene, accuracy=recording.accuracy).kept()))

    def smaller(start: Start) -> Start:
        arrays = dict(zip(KEPT, start.snapshot.arrays))
        for name in ("state", "params"):
            arrays[name] = np.delete(arrays[name], body, axis=0)
        arrays |= {name: fresh[name].copy() for name in ("memory", "sleep") if name in fresh}
        return Start(start.step, Snapshot(tuple(arrays.values()), start.snapshot.time))

    return replace(
        recording,
        scene=scene,
        starts=tuple(smaller(start) for start in recording.starts),
        wrenches=np.delete(recording.wrenches, body, axis=1),
        states=np.delete(recording.states, body, axis=1),
    )


def _fewer(scene: physics.Scene, body: int) -> physics.Scene | None:
    """The scene without a body; None where the scene is no scene without it."""
    try:
        return physics.Scene([other for k, other in enumerate(scene.bodies) if k != body], scene.walls, scene.effects)
    except ValueError:  # an exception for a pair, or a spring, that needs it
        return None


def _taken_again(recording: Recording) -> Recording:
    """The recording with the states that its steps now lead to."""
    return replace(recording, states=recording.replay().states)
