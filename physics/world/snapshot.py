"""Snapshots: copies of everything that decides the future of worlds, in memory and as files."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from physics import validation
from physics.compiler.compiler_choice import COMPILER
from physics.html_table import parts_table
from physics.kernels.state import layout as at
from physics.summary import parts_repr
from physics.version import version
from physics.world.headed_file import FileKind, head_value, is_text

FILE = FileKind("snapshot", "snapshot", "Snapshot.save", format=2)
TIMES = 1  # the format in which commands have times instead of ages, and the settings of the scene are missing

# Arrays that decide the future of a `World`, in the order of `Snapshot.arrays`; the last one only if bodies may sleep.
KEPT = ("state", "params", "gravity", "memory", "report_table", "sleep")


@dataclass(frozen=True)
class Snapshot:
    """Copy of a `World`'s whole state: states, warm starts, parameters, time, the actuator's memory.

    Parameters
    ----------
    arrays : tuple of float64 arrays
        Copies of the arrays that `KEPT` names; rows are those of the first world, then of the second, and so on.
    time : float
        Time of the batch when the snapshot was taken [s].
    actuation : tuple or None
        Wrench that the actuator's lag has reached, (worlds * bodies, 6), and its delayed commands, oldest first: a list
        of the age of each [s] and the command (worlds * bodies, 6). None without an actuator.
    compiler : str
        Compiler of the session that took it (`physics.compiler.compiler_choice`). Under another compiler the future of
        a world differs in its last bits.
    is_read : bool
        Whether the snapshot was read from a file, so that its numbers are checked before it is restored.
    scene : dict of str to str or None
        Settings of its scene that the arrays do not hold (`physics.world.scene_settings`); None: unknown.
    """

    arrays: tuple[np.ndarray, ...]
    time: float
    actuation: tuple | None = None
    compiler: str = COMPILER
    is_read: bool = False
    scene: Mapping[str, str] | None = None

    @property
    def worlds(self) -> int:
        """Number of worlds in the snapshot."""
        return len(self.arrays[KEPT.index("gravity")])

    def renew(self, time: float, actuation: tuple | None, scene: Mapping[str, str]) -> None:
        """Set everything but the arrays, after `World.snapshot` with `out` has overwritten these."""
        new = {"time": time, "actuation": actuation, "compiler": COMPILER, "is_read": False, "scene": scene}
        for name, value in new.items():
            object.__setattr__(self, name, value)

    def save(self, path: str | os.PathLike) -> Path:
        """Write the snapshot as an ``.npz`` file, which `load` reads; return the path.

        Parameters
        ----------
        path : str or Path
            Path of the file; an existing file is overwritten.
        """
        with open(validation.path(path), "wb") as file:
            self.write(file)
        return Path(path)

    def write(self, file: BinaryIO) -> None:
        """Write the snapshot into an open binary file, as `save` does."""
        parts: dict[str, Any] = {"time": np.float64(self.time), **dict(zip(KEPT, self.arrays))}
        if self.actuation is not None:
            output, late = self.actuation
            parts["actuator_output"] = output
            parts["actuator_ages"] = np.array([age for age, _ in late], dtype=np.float64)
            parts["actuator_commands"] = np.array([command for _, command in late]).reshape(-1, *output.shape)
        scene = None if self.scene is None else dict(self.scene)
        FILE.write(file, {"compiler": self.compiler, "version": version(), "scene": scene}, parts)

    @classmethod
    def load(cls, path: str | os.PathLike) -> Snapshot:
        """Read a snapshot that `save` has written, bit for bit, without running code from the file.

        Parameters
        ----------
        path : str or Path
            Path of the file.

        Raises
        ------
        ValueError
            The file is no snapshot, is damaged, or has a newer format.
        OSError
            The file cannot be read.
        """
        return cls.read(io.BytesIO(Path(validation.path(path)).read_bytes()), path)

    @classmethod
    def read(cls, content: BinaryIO, path: str | os.PathLike) -> Snapshot:
        """Read a snapshot from an open binary file as `load` does; errors call the file `path`."""
        return FILE.read(content, path, _from_parts)

    __repr__ = parts_repr
    _repr_html_ = parts_table

    def _parts(self) -> tuple[str, ...]:
        shapes = (f"{name} {array.shape}" for name, array in zip(KEPT, self.arrays))
        return (f"time={self.time:.6g} s", *shapes, f"compiler={self.compiler}")


def _is_scene(value: Any) -> bool:
    return value is None or (isinstance(value, dict) and all(map(is_text, value.values())))


def _from_parts(head: Mapping[str, Any], parts: dict[str, np.ndarray]) -> Snapshot:
    """Make a snapshot from the head and the arrays of a file; the shapes are checked, but not against a scene."""
    compiler, scene = head_value(head, "compiler", is_text, "the name of a compiler"), None
    if head["format"] > TIMES:
        scene = head_value(head, "scene", _is_scene, "null and settings of a scene by name, as text")
    if parts["report_table"].ndim == 2:  # files of earlier versions lack its last columns
        missing = max(0, at.REPORT_SIZE - parts["report_table"].shape[1])
        parts["report_table"] = np.pad(parts["report_table"], [(0, 0), (0, missing)])
    arrays = tuple(parts[name] for name in KEPT if name != "sleep" or name in parts)
    rows, worlds = len(parts["state"]), len(parts["gravity"])
    rows_of = {"state": rows, "params": rows, "gravity": worlds, "report_table": worlds, "sleep": rows}
    for name, array in zip(KEPT, arrays):
        if array.ndim != 2 or len(array) != rows_of.get(name, len(array)) or (worlds and rows % worlds):
            raise ValueError(f"{name} has shape {array.shape}")
    for name, width in (("state", at.STATE_SIZE), ("gravity", 3), ("report_table", at.REPORT_SIZE)):
        if parts[name].shape[1] != width:
            raise ValueError(f"{name} has {parts[name].shape[1]} columns instead of {width}")
    actuation = None
    if "actuator_output" in parts:
        if head["format"] == TIMES:
            parts["actuator_ages"] = parts["time"] - parts.pop("actuator_times")
        output, ages, commands = (parts[f"actuator_{name}"] for name in ("output", "ages", "commands"))
        if output.shape != (rows, 6) or ages.ndim != 1 or commands.shape != (len(ages), rows, 6):
            raise ValueError(f"actuator_output has shape {output.shape}, actuator_commands {commands.shape}")
        actuation = output, list(zip(ages.tolist(), commands))
    if any(array.dtype != np.float64 for array in parts.values()):
        raise ValueError("it holds other numbers than 64-bit floats")
    return Snapshot(arrays, validation.number(parts["time"], "its time"), actuation, compiler, True, scene)
