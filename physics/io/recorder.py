"""Recorder, which keeps the last steps of a batch of worlds, so that faults can be replayed bit for bit."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from physics import validation
from physics.io.recording import Recording, Start, origin
from physics.keywords import known_keywords
from physics.summary import shown
from physics.world.report import Status, gravest
from physics.world.snapshot import Snapshot
from physics.world.world import World


class _Load(NamedTuple):
    """Arguments of one call of a step, for all worlds."""

    wrench: np.ndarray  # (worlds, bodies, 6)
    past: np.ndarray | None  # (worlds, bodies, 6), load that bypasses the actuator
    steps: int
    dt: float  # [s]


@dataclass
class _Chapter:
    """Consecutive calls of a step, with the states of all worlds before the first, and their changes from outside."""

    # States before a call: number of the call, worlds, rows of each kept array for each of these worlds, time [s].
    starts: list[tuple[int, np.ndarray, list[np.ndarray], float]] = field(default_factory=list)
    loads: list[_Load] = field(default_factory=list)
    states: list[np.ndarray] = field(default_factory=list)


@known_keywords
class Recorder:
    """Keeper of the last steps of a `World`; it writes the steps of a world with a fault to a file.

    The recorder sees every step of `World.step`, of a `Stepper` and of an environment. It sees every change by
    `set_state`, `set_parameters` and `restore`, but not arrays of the world written directly. Worlds are independent,
    so a file holds one world only. A world without a recorder pays nothing for it.

    Parameters
    ----------
    world : World
        World to record. It has one recorder at a time; this one replaces an earlier one.
    keep : int
        Least number of calls of a step that can be replayed. Up to twice as many are kept, each with a copy of all
        wrenches and states (176 bytes per body).
    folder : str or Path, optional
        Folder for automatic files, made when the first is written. None: only `save` writes files.
    on : sequence of Status
        Statuses of a world after which its steps are written automatically.
    limit : int
        Largest number of automatic files.

    Attributes
    ----------
    files : list of Path
        Paths of the automatic files.

    Raises
    ------
    ValueError
        A parameter out of range; or the world has an `Actuator` with a lag or a delay, whose memory a recording does
        not hold.

    Examples
    --------
    >>> recorder = physics.Recorder(world, keep=100, folder="faults")
    >>> physics.Recording.load("faults/fault-0.npz").replay().is_identical
    True
    """

    def __init__(
        self,
        world: World,
        keep: int = 200,
        folder: str | Path | None = None,
        on: Sequence[Status] = (Status.FAULT,),
        limit: int = 10,
    ):
        validation.instance(world, World, "world", "a physics.World")
        if world.actuation is not None and world.actuation.actuator.remembers:
            raise ValueError(
                f"world has {world.actuation.actuator!r}, whose memory a recording does not hold; allowed are "
                "actuators without lag and delay"
            )
        self.world = world
        self.keep = validation.count(keep, "keep")
        self.limit = validation.count(limit, "limit")
        if folder is not None and not isinstance(folder, (str, os.PathLike)):
            raise ValueError(f"folder is {shown(folder)}; allowed are a path and None")
        self.folder = None if folder is None else Path(folder)
        self.on = tuple(on) if isinstance(on, Iterable) else (on,)
        if not all(isinstance(status, Status) for status in self.on):
            raise ValueError(f"on is {shown(on)}; allowed are values of physics.Status")
        self.files: list[Path] = []
        self._chapters = [_Chapter()]
        self._changed = np.ones(world.worlds, dtype=np.bool_)
        self._status = np.zeros(world.worlds, dtype=np.int64)
        world.recorder = self

    def stop(self) -> None:
        """Stop recording the world; the steps kept so far can still be saved."""
        if self.world.recorder is self:
            self.world.recorder = None

    # --- told by the world -------------------------------------------------------------------------------------

    def changed(self, worlds: np.ndarray | slice) -> None:
        """Note that a user has changed these worlds; the next call of a step begins with a copy of their states."""
        self._changed[worlds] = True

    def before(self, wrench: np.ndarray, steps: int, dt: float) -> None:
        """Keep the arguments of a call of a step, and the states of changed worlds, before the call."""
        chapter = self._chapters[-1]
        if len(chapter.loads) == self.keep:
            chapter = _Chapter()
            self._chapters = [self._chapters[-1], chapter]
            self._changed[:] = True
        if self._changed.any():
            chosen, world = np.flatnonzero(self._changed), self.world
            rows = [_rows(array, world.worlds, chosen) for array in world.kept()]
            chapter.starts.append((len(chapter.loads), chosen, rows, world.time))
            self._changed[:] = False
        past = None if self.world.actuation is None else self.world.actuation.past
        chapter.loads.append(_Load(wrench.copy(), None if past is None else past.copy(), steps, dt))

    def after(self) -> None:
        """Keep the states after a call of a step, and write files for worlds with a status among `on`."""
        self._chapters[-1].states.append(self.world.state.copy())
        if self.folder is None or len(self.files) == self.limit:
            return
        gravest(self.world.report_table, self._status)
        for world in np.flatnonzero(np.isin(self._status, self.on))[: self.limit - len(self.files)].tolist():
            status = Status(int(self._status[world]))
            reason = f"{status.name} of world {world} at t = {self.world.time!r} s: {status.message}"
            self.folder.mkdir(parents=True, exist_ok=True)
            self.files.append(self.recording(world, reason).save(_free_path(self.folder, status.name.lower())))

    def undone(self) -> None:
        """Forget the last call announced by `before`, which an exception has ended and undone."""
        chapter = self._chapters[-1]
        del chapter.loads[len(chapter.states) :]

    # --- asked by the user -------------------------------------------------------------------------------------

    def save(self, path: str | Path, world: int = 0, reason: str = "requested") -> Path:
        """Write the last steps of the world with index `world` to a file; return the path.

        `reason` is a text that the file keeps.
        """
        return self.recording(world, reason).save(path)

    def recording(self, world: int = 0, reason: str = "requested") -> Recording:
        """Make a recording of the last steps of the world with index `world`.

        It holds at least `keep` calls of a step, if so many were made.

        Raises
        ------
        ValueError
            No such world exists.
        """
        worlds, bodies = self.world.worlds, self.world.body_count
        validation.index(world, worlds, "world")
        starts: list[Any] = []
        loads: list[_Load] = []
        states: list[Any] = []
        for chapter in self._chapters:
            first, count = len(loads), len(chapter.states)  # an interrupted step has a load, but no state
            starts += _starts_of(chapter, world, first, count, self.world.scene_settings)
            loads += chapter.loads[:count]
            states += [state[world * bodies : (world + 1) * bodies] for state in chapter.states]
        if not starts:
            arrays = [_rows(array, worlds, np.array([world]))[0] for array in self.world.kept()]
            starts = [Start(0, Snapshot(tuple(arrays), self.world.time, scene=self.world.scene_settings))]
        return Recording(
            scene=self.world.scene,
            accuracy=self.world.accuracy,
            starts=tuple(starts),
            wrenches=np.array([load.wrench[world] for load in loads]).reshape(-1, bodies, 6),
            steps=np.array([load.steps for load in loads], dtype=np.int64),
            dt=np.array([load.dt for load in loads], dtype=np.float64),
            states=np.array(states).reshape(-1, bodies, self.world.state.shape[1]),
            reason=reason,
            origin=origin(),
            past=_past(loads, world, bodies),
        )


def _past(loads: Sequence[_Load], world: int, bodies: int) -> np.ndarray | None:
    """Loads (n, bodies, 6) of one world that bypassed its actuator in n calls; None if there were none."""
    if all(load.past is None for load in loads):
        return None
    nothing = np.zeros((bodies, 6))
    return np.array([nothing if load.past is None else load.past[world] for load in loads])


def _rows(array: np.ndarray, worlds: int, chosen: np.ndarray) -> np.ndarray:
    """Copy the rows of the chosen worlds of an array: (k, rows of a world, columns).

    The array holds the rows of the first of `worlds` worlds, then of the second, and so on.
    """
    if len(array) < worlds:  # the contact memory of a scene without contact: one row, never used
        return np.broadcast_to(array, (len(chosen), *array.shape)).copy()
    return array.reshape(worlds, len(array) // worlds, *array.shape[1:])[chosen]


def _starts_of(chapter: _Chapter, world: int, first: int, count: int, scene: dict[str, str]) -> list[Start]:
    """Find the starts of one world in the first `count` calls of a chapter, which begins with call `first`."""
    found = []
    for step, worlds, rows, time in chapter.starts:
        place = np.flatnonzero(worlds == world)
        if len(place) and step < count:
            arrays = tuple(part[place[0]] for part in rows)
            found.append(Start(first + step, Snapshot(arrays, time, scene=scene)))
    return found


def _free_path(folder: Path, name: str) -> Path:
    """Create an empty file with a new name in `folder`, safe against other processes; return its path."""
    number = 0
    while True:
        path = folder / f"{name}-{number}.npz"
        try:
            os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY))
            return path
        except FileExistsError:
            number += 1
