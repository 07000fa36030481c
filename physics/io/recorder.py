"""Keep the last steps of a batch of worlds, for a bit-for-bit replay of faults."""

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
    """Arguments of a call, for all worlds."""

    wrench: np.ndarray
    past: np.ndarray | None  # past the actuator
    steps: int
    dt: float


@dataclass
class _Chapter:
    """Consecutive steps of the batch from one complete snapshot on."""

    # (step, worlds, rows of each kept array for each of these worlds, time)
    starts: list[tuple[int, np.ndarray, list[np.ndarray], float]] = field(default_factory=list)
    loads: list[_Load] = field(default_factory=list)
    states: list[np.ndarray] = field(default_factory=list)


@known_keywords
class Recorder:
    """Keeps the last steps of a `World` and writes those of a world with a fault to a file.

    The recorder sees every step of `World.step`, of a `Stepper` and of an environment. It sees every change by
    `set_state`, `set_parameters` and `restore`, but not arrays of the world written directly. Worlds are independent,
    so a file holds one world only. A world without a recorder pays nothing for it.

    Parameters
    ----------
    world : World
        Has one recorder at a time: this one from now on.
    keep : int
        Calls of a step that can be replayed at least; up to twice as many are kept, each with a copy of all wrenches
        and states (176 bytes per body).
    folder : str or Path, optional
        Where files go; made when there is one. None: only `save` writes.
    on : sequence of Status
        What makes a world's steps a file.
    limit : int
        Files that are written by themselves, at most.

    Attributes
    ----------
    files : list of Path
        Written by themselves.

    Raises
    ------
    ValueError
        A parameter out of range; or the world has an `Actuator` with a lag or a delay, whose memory no recording holds.

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
        """Detach from the world; the kept steps stay."""
        if self.world.recorder is self:
            self.world.recorder = None

    # --- told by the world -------------------------------------------------------------------------------------

    def changed(self, worlds: np.ndarray | slice) -> None:
        """Note that these worlds were changed from outside."""
        self._changed[worlds] = True

    def before(self, wrench: np.ndarray, steps: int, dt: float) -> None:
        """Note the start of a step."""
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
        """Note the end of a step."""
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
        """Drop the announced step: it was not taken, and the world is as before."""
        chapter = self._chapters[-1]
        del chapter.loads[len(chapter.states) :]

    # --- asked by the user -------------------------------------------------------------------------------------

    def save(self, path: str | Path, world: int = 0, reason: str = "requested") -> Path:
        """Write the last steps of one world; returns the path."""
        return self.recording(world, reason).save(path)

    def recording(self, world: int = 0, reason: str = "requested") -> Recording:
        """Last steps of one world, at least `keep` if so many were taken.

        Raises
        ------
        ValueError
            There is no such world.
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
    """Loads (n, bodies, 6) of one world past its actuator; None without any."""
    if all(load.past is None for load in loads):
        return None
    nothing = np.zeros((bodies, 6))
    return np.array([nothing if load.past is None else load.past[world] for load in loads])


def _rows(array: np.ndarray, worlds: int, chosen: np.ndarray) -> np.ndarray:
    """Copied rows (chosen, rows of a world, columns) of some worlds in an array with each world's rows in turn."""
    if len(array) < worlds:  # the contact memory of a scene without contact: one row, never used
        return np.broadcast_to(array, (len(chosen), *array.shape)).copy()
    return array.reshape(worlds, len(array) // worlds, *array.shape[1:])[chosen]


def _starts_of(chapter: _Chapter, world: int, first: int, count: int, scene: dict[str, str]) -> list[Start]:
    """Find the starts of one world in a chapter whose first step is number `first` of the recording."""
    found = []
    for step, worlds, rows, time in chapter.starts:
        place = np.flatnonzero(worlds == world)
        if len(place) and step < count:
            arrays = tuple(part[place[0]] for part in rows)
            found.append(Start(first + step, Snapshot(arrays, time, scene=scene)))
    return found


def _free_path(folder: Path, name: str) -> Path:
    """Path in `folder` that no file has, even if several processes write there."""
    number = 0
    while True:
        path = folder / f"{name}-{number}.npz"
        try:
            os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY))
            return path
        except FileExistsError:
            number += 1
