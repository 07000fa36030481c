"""Worlds of many bodies, ours and MuJoCo's: steps per second, and the depth of bodies in each other."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

import physics
from physics import scenes
from rigid_env.lab.measure.rows import ACCURACIES, MUJOCO, UNIT, Tick, paired_rows, told
from rigid_env.lab.measure.timing import Row, Stopwatch, interleave
from rigid_env.lab.measure.workloads import STEP


@dataclass(frozen=True)
class Case:
    """A scene, and the number of steps from its start.

    Attributes
    ----------
    what : str
        For people.
    scene : Scene
    steps : int
        Of `STEP` each; every run starts anew.
    target : float
        Least ratio to MuJoCo.
    """

    what: str
    scene: physics.Scene
    steps: int
    target: float


def cases(is_quick: bool) -> dict[str, Case]:
    """Cases by name; `is_quick` has few steps, for tests."""
    return {
        "stack": Case("a stack of 10 blocks", scenes.tower(10), 10 if is_quick else 1000, 4.0),
        "heap": Case("100 cubes settle, 5 s", scenes.heap(100), 3 if is_quick else 1000, 3.0),
    }


class Ours:
    """Our engine on a case; a call runs the case once and returns steps per second."""

    def __init__(self, case: Case, accuracy: str):
        self.world = physics.World(case.scene, dt=STEP, accuracy=accuracy)
        self.start, self.steps = self.world.snapshot(), case.steps

    def __call__(self) -> float:
        self.world.restore(self.start)
        with Stopwatch() as watch:
            self.world.step(steps=self.steps)
        return self.steps / watch.seconds

    def notes(self) -> dict:
        """Deepest penetration [m] of the last run and of its second half, unconverged solves, and final positions."""
        self.world.restore(self.start)
        first = self.world.step(steps=self.steps - self.steps // 2)
        second = self.world.step(steps=max(1, self.steps // 2))
        return {
            "penetration": float(max(first.penetration[0], second.penetration[0])),
            "penetration_late": float(second.penetration[0]),
            "solves": int(first.solves[0] + second.solves[0]),
            "unconverged": int(first.unconverged[0] + second.unconverged[0]),
            "residual": float(max(first.residual[0], second.residual[0])),
            "moved": float(np.abs(self.world.pos[0] - [body.pos for body in self.world.scene.bodies]).max()),
        }


class Theirs:
    """MuJoCo at its defaults on a case."""

    def __init__(self, case: Case):
        from rigid_env.lab.measure.peers.mujoco import MuJoCo

        self.run, self.steps = MuJoCo().open(case.scene, STEP), case.steps

    def __call__(self) -> float:
        self.run.restart()
        with Stopwatch() as watch:
            self.run.advance(self.steps)
        return self.steps / watch.seconds

    def notes(self) -> dict:
        """As `Ours.notes`, observed after every step."""
        self.run.restart()
        depths = []
        for _ in range(self.steps):
            self.run.advance(1)
            contacts = self.run.data.contact.dist[: self.run.data.ncon]
            depths.append(max(0.0, -float(contacts.min())) if len(contacts) else 0.0)
        moved = np.abs(self.run.state()[0] - [body.pos for body in self.run.scene.bodies]).max()
        return {"penetration": max(depths), "penetration_late": max(depths[self.steps // 2 :]), "moved": float(moved)}


def run_count(repeats: int, with_peer: bool) -> int:
    """Number of calls of `tick` by `body_rows`."""
    return len(cases(True)) * (len(ACCURACIES) + with_peer) * (repeats + 1)


def body_rows(is_quick: bool, repeats: int, with_peer: bool, tick: Tick | None = None) -> Iterator[list[Row]]:
    """Measure every case, ours and MuJoCo's in turns; yield the rows of each once they are measured.

    Parameters
    ----------
    is_quick : bool
    repeats : int
        Of every contestant, in turns.
    with_peer : bool
        Whether MuJoCo is measured too.
    tick : callable, optional
        Called before each run with its name.
    """
    for key, case in cases(is_quick).items():
        runners = {accuracy: Ours(case, accuracy) for accuracy in ACCURACIES}
        peers = {}
        if with_peer:
            runners["mujoco"], peers["mujoco"] = Theirs(case), MUJOCO
        spreads = interleave(runners, repeats, told(tick, case.what))
        notes = {name: runner.notes() for name, runner in runners.items()}
        for name in ACCURACIES if with_peer else ():
            notes[name]["peer"] = notes["mujoco"]
        for row in paired_rows(spreads, peers, notes, key=key, what=case.what, unit=UNIT, target=case.target):
            yield [_no_deeper(row)]


def _no_deeper(row: Row) -> Row:
    """Let a row pass only if its penetration after the start is at most the peer's."""
    if row.peer is None:
        return row
    return Row(**{**vars(row), "is_valid": row.notes["penetration_late"] <= row.notes["peer"]["penetration_late"]})
