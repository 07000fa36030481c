"""Recording of one world's steps, its file, and its replay, which is compared bit for bit.

The future of a world follows from its `Snapshot`, and from the wrenches and lengths of its steps. A recording holds
these, the scene as text, and the state after every step, with which a replay is compared.
"""

from __future__ import annotations

import json
import platform
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict, dataclass, replace
from importlib import metadata
from pathlib import Path
from typing import Any
from zipfile import is_zipfile

import numpy as np

from physics import validation
from physics.accuracy import Accuracy
from physics.analysis.diagnostics import diagnose
from physics.compiler.cache_folder import folder_name
from physics.compiler.compiler_choice import COMPILER, FUSED, round_alike
from physics.html_table import parts_table
from physics.io.toml import from_toml, to_toml
from physics.kernels.state import layout as at
from physics.scene.force_field import Field
from physics.scene.scene import Scene
from physics.summary import parts_repr
from physics.version import version
from physics.world.headed_file import head_value, is_count, is_text
from physics.world.report import StepReport
from physics.world.scene_settings import scene_settings
from physics.world.snapshot import KEPT, Snapshot
from physics.world.stepper import Stepper
from physics.world.world import World

# Number of the file format; a reader refuses newer formats than its own. Format 2 adds loads that bypass an actuator.
FORMAT = 2
ALLOWED = "allowed is what physics.Recorder writes (.npz)"

# Difference allowed in a replay by a compiler that rounds differently. Up to the first contact the difference is
# rounding; after it the solver's tolerance decides, 2e-7 for a block dropped at `balanced`. In chaotic motion it grows
# beyond any bound.
OTHER_COMPILER = 1.0e-6


@dataclass(frozen=True)
class Start:
    """State of a recorded world before its first call of a step, or after a change from outside.

    Parameters
    ----------
    step : int
        Number of the recorded call that follows.
    snapshot : Snapshot
        State of the one world.
    """

    step: int
    snapshot: Snapshot


@dataclass(frozen=True)
class Recording:
    """Consecutive calls of `World.step` of one world, with everything that a replay needs.

    Parameters
    ----------
    scene : Scene
        Scene of the world.
    accuracy : Accuracy
        Accuracy of the world.
    starts : tuple of Start
        States before call 0 and after each change from outside.
    wrenches : (n, bodies, 6) float64
        Force [N] and torque [N m] of each of the n calls, world frame.
    steps : (n,) int64
        Number of steps of each call.
    dt : (n,) float64
        Length of a step of each call [s].
    states : (n, bodies, STATE_SIZE) float64
        States after each call; columns in `physics.kernels.state.layout`.
    reason : str
        Reason for which the recording was kept.
    origin : dict of str to str
        Software and processor that made it: version, kernels, compiler, numba, numpy, python, machine.
    past : (n, bodies, 6) float64 or None
        Force [N] and torque [N m] of each call that bypassed the actuator, as gusts of an environment do; None: none.
    """

    scene: Scene
    accuracy: Accuracy
    starts: tuple[Start, ...]
    wrenches: np.ndarray
    steps: np.ndarray
    dt: np.ndarray
    states: np.ndarray
    reason: str
    origin: dict
    past: np.ndarray | None = None

    __repr__ = parts_repr
    _repr_html_ = parts_table

    def _parts(self) -> tuple[str, ...]:
        return (
            f"{len(self)} calls of step", f"{len(self.scene.bodies)} bodies",
            f"{len(self.starts)} starts", f"reason={self.reason!r}",
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.states)

    def world(self) -> World:
        """Make a `World` of one world in the state before the first recorded call."""
        world = World(self.scene, dt=float(self.dt[0]) if len(self) else 0.01, accuracy=self.accuracy)
        world.restore(self.starts[0].snapshot)
        return world

    def replay(self) -> Replay:
        """Repeat the recorded calls in a new `World`; return the outcome, which compares the states."""
        world = self.world()
        starts = {start.step: start.snapshot for start in self.starts}
        steppers: dict[tuple[int, float], Stepper] = {}
        states, reports, energies = [], [], []
        for k, (wrench, steps, dt) in enumerate(zip(self.wrenches, self.steps.tolist(), self.dt.tolist())):
            if k in starts:
                world.restore(starts[k])
            if (steps, dt) not in steppers:
                steppers[steps, dt] = Stepper(world, steps, dt)
            stepper = steppers[steps, dt]
            stepper.wrench[0] = wrench  # as it was: `World.step` would refuse one that is not finite
            with self.past_actuator(world, k):
                stepper()
            states.append(world.state.copy())
            reports.append(world.report)
            energies.append(float(diagnose(world).energy.sum()))
        return Replay(self, np.array(states).reshape(self.states.shape), tuple(reports), np.array(energies))

    def past_actuator(self, world: World, k: int) -> AbstractContextManager[None]:
        """Context manager in which the load of call `k` that bypassed the actuator acts in a world."""
        if self.past is None or world.actuation is None:
            return nullcontext()
        return world.actuation.passed_by(self.past[k : k + 1])

    def save(self, path: str | Path) -> Path:
        """Write the recording as an ``.npz`` file, which `load` reads; return the path."""
        head = {
            "format": 1 if self.past is None else FORMAT, "scene": to_toml(self.scene),
            "accuracy": asdict(self.accuracy), "reason": self.reason, "origin": self.origin,
        }  # fmt: skip
        columns = zip(*(start.snapshot.arrays for start in self.starts))
        with open(path, "wb") as file:
            more: Any = {f"start_{name}": np.array(column) for name, column in zip(KEPT, columns)}
            if self.past is not None:
                more["past"] = self.past
            np.savez_compressed(
                file,
                head=json.dumps(head),
                wrenches=self.wrenches, steps=self.steps, dt=self.dt, states=self.states,
                start_steps=[start.step for start in self.starts],
                start_times=[start.snapshot.time for start in self.starts],
                **more,
            )  # fmt: skip
        return Path(path)

    @classmethod
    def load(cls, path: str | Path, kinds: Sequence[type[Field]] = ()) -> Recording:
        """Read a recording that `save` or a `Recorder` has written.

        Parameters
        ----------
        path : str or Path
            Path of the file.
        kinds : sequence of classes, optional
            Classes of a user's own fields that the recorded scene has. Reading a file never imports code.

        Raises
        ------
        ValueError
            The file is no recording, is damaged, or has a newer format.
        OSError
            The file cannot be read.
        """
        validation.path(path)
        if not is_zipfile(path) and Path(path).is_file():
            raise ValueError(f"{path} is no recording; {ALLOWED}")
        try:
            with np.load(path, allow_pickle=False) as file:
                content = dict(file)
            head = json.loads(str(content["head"]))
            number = head_value(head, "format", is_count, "the number of a format")
            found = _from_parts(head, content) if number <= FORMAT else {}
        except OSError:
            raise
        except Exception as error:  # any fault means that the file is no recording
            told = f"there is no {error}" if isinstance(error, KeyError) else error
            raise ValueError(f"{path} is no recording ({told}); {ALLOWED}") from None
        if number > FORMAT:
            raise ValueError(f"{path} has format {number}; allowed are formats up to {FORMAT}")
        scene = from_toml(head["scene"], str(path), kinds)
        starts = tuple(Start(step, replace(each, scene=scene_settings(scene))) for step, each in found.pop("starts"))
        return cls(scene=scene, starts=starts, **found)


def _from_parts(head: dict[str, Any], content: dict[str, np.ndarray]) -> dict[str, Any]:
    """Make the fields of a `Recording`, except its scene, from the head and the arrays of a file."""
    head_value(head, "scene", is_text, "a scene as TOML")
    settings = head_value(head, "accuracy", lambda value: Accuracy(**value), "the fields of a physics.Accuracy")
    about = head_value(head, "origin", _is_table_of_text, "names and texts")
    about.setdefault("compiler", FUSED)  # files without this entry are from versions with one compiler
    content["start_report_table"] = _widened(content["start_report_table"])
    columns = [content[f"start_{name}"] for name in KEPT if name != "sleep" or "start_sleep" in content]
    starts = zip(content["start_steps"].tolist(), content["start_times"].tolist(), zip(*columns))
    return {
        "accuracy": Accuracy(**settings),
        "starts": [(step, Snapshot(arrays, time, compiler=about["compiler"])) for step, time, arrays in starts],
        **{name: content[name] for name in ("wrenches", "steps", "dt", "states")},
        "reason": head_value(head, "reason", is_text, "a text"), "origin": about, "past": content.get("past"),
    }  # fmt: skip


def _is_table_of_text(value: Any) -> bool:
    return isinstance(value, dict) and all(map(is_text, value.values()))


def _widened(table: np.ndarray) -> np.ndarray:
    """Widen a report table (..., columns) of an earlier version to the present columns, with zeros."""
    return np.pad(table, [(0, 0)] * (table.ndim - 1) + [(0, max(0, at.REPORT_SIZE - table.shape[-1]))])


@dataclass(frozen=True)
class Replay:
    """Outcome of a replay of a `Recording`, and its comparison with the recorded states.

    Parameters
    ----------
    recording : Recording
        Recording that was replayed.
    states : (n, bodies, STATE_SIZE) float64
        States of the replay after each of the n calls.
    reports : tuple of StepReport
        Report of each call.
    energies : (n,) float64
        Kinetic and potential energy of all bodies together after each call [J].
    """

    recording: Recording
    states: np.ndarray
    reports: tuple[StepReport, ...]
    energies: np.ndarray

    __repr__ = parts_repr
    _repr_html_ = parts_table

    def _parts(self) -> tuple[str, ...]:
        first = self.first_difference
        told = "identical" if self.is_identical else f"equal within {self.tolerance:g}"
        told = told if first is None else f"the first difference is after call {first}"
        return f"{len(self.states)} calls of step", told

    @property
    def tolerance(self) -> float:
        """Tolerance of the comparison: 0, or `OTHER_COMPILER` if the recording's compiler rounds differently.

        0 compares bits. Otherwise a number x of a state may differ by the tolerance times (1 + |x|).
        """
        return 0.0 if round_alike(self.recording.origin["compiler"], COMPILER) else OTHER_COMPILER

    @property
    def first_difference(self) -> int | None:
        """Index of the first call after which a state differs from the recorded one by more than `tolerance`.

        With the tolerance 0 states differ if any bit does. None: all states agree.
        """
        ours, theirs = self.states, self.recording.states
        is_other = ours.view(np.int64) != theirs.view(np.int64)
        if self.tolerance > 0.0:
            is_other &= ~(np.abs(ours - theirs) <= self.tolerance * (1.0 + np.abs(theirs)))
        different = np.flatnonzero(is_other.any(axis=(1, 2)))
        return int(different[0]) if len(different) else None

    @property
    def is_identical(self) -> bool:
        """True if all states of the replay equal the recorded states bit for bit."""
        return np.array_equal(self.states.view(np.int64), self.recording.states.view(np.int64))

    @property
    def distances(self) -> np.ndarray:
        """Largest distance (n,) of a body's centre of mass from its recorded place after each call [m]."""
        offset = (self.states - self.recording.states)[:, :, at.POS : at.POS + 3]
        return np.sqrt((offset * offset).sum(axis=-1)).max(axis=1, initial=0.0)

    @property
    def times(self) -> np.ndarray:
        """Time (n,) of the recorded world after each call [s]."""
        recording, times, now = self.recording, [], 0.0
        starts = {start.step: start.snapshot.time for start in recording.starts}
        for k, (steps, dt) in enumerate(zip(recording.steps.tolist(), recording.dt.tolist())):
            now = starts.get(k, now) + steps * dt
            times.append(now)
        return np.array(times)


def origin() -> dict[str, str]:
    """Names and versions of the software and processor in use, for a new recording.

    If any of them differs in a replay, the states may differ in their last bits.
    """
    return {
        "version": version(),
        "kernels": folder_name(),  # digest of their sources
        "compiler": COMPILER,
        "numba": metadata.version("numba"),
        "numpy": np.__version__,
        "python": platform.python_version(),
        "machine": platform.platform(),
    }
