"""A file of one world's steps, and its bit-for-bit replay.

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

# Number of the format; a reader refuses what is newer than itself. Format 2 has loads past an actuator.
FORMAT = 2
ALLOWED = "allowed is what physics.Recorder writes (.npz)"

# Difference allowed in a replay by a compiler that rounds differently. Before the first contact changes it is rounding;
# from then on a solver's tolerance decides, 2e-7 for a block dropped at `balanced`. Chaotic motion exceeds any number.
OTHER_COMPILER = 1.0e-6


@dataclass(frozen=True)
class Start:
    """State from which the recorded world continued: the first one, and one after each change from outside.

    Parameters
    ----------
    step : int
        Number of the recorded step that it is before.
    snapshot : Snapshot
        Of one world.
    """

    step: int
    snapshot: Snapshot


@dataclass(frozen=True)
class Recording:
    """Consecutive calls of `World.step` of one world.

    Parameters
    ----------
    scene : Scene
    accuracy : Accuracy
    starts : tuple of Start
        The first is before step 0.
    wrenches : (n, bodies, 6) float64
        Force [N] and torque [N m] of each call, world frame.
    steps : (n,) int64
        Steps that each call took at once.
    dt : (n,) float64
        Length of one of them [s].
    states : (n, bodies, STATE_SIZE) float64
        After each call; columns in `physics.kernels.state.layout`.
    reason : str
        Why it was kept.
    origin : dict of str to str
        What it was made with: version, kernels, compiler, numba, numpy, python, machine.
    past : (n, bodies, 6) float64 or None
        Force [N] and torque [N m] of each call that went past the actuator, as gusts of an environment do; None: none.
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
        """Make a `World` of one world in the state before the first step."""
        world = World(self.scene, dt=float(self.dt[0]) if len(self) else 0.01, accuracy=self.accuracy)
        world.restore(self.starts[0].snapshot)
        return world

    def replay(self) -> Replay:
        """Take the recorded steps again in a new `World`."""
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
        """Let the load of call `k` that bypassed the actuator act in a world during a block."""
        if self.past is None or world.actuation is None:
            return nullcontext()
        return world.actuation.passed_by(self.past[k : k + 1])

    def save(self, path: str | Path) -> Path:
        """Write the recording as ``.npz`` (`load` reads it); return the path."""
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
        """Read a recording.

        Parameters
        ----------
        path : str or Path
        kinds : sequence of classes, optional
            Fields of your own that its scene may name; a file never imports code on its own.

        Raises
        ------
        ValueError
            It is no recording, or one of a newer format.
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
        except Exception as error:  # whatever is wrong with it, it is none
            told = f"there is no {error}" if isinstance(error, KeyError) else error
            raise ValueError(f"{path} is no recording ({told}); {ALLOWED}") from None
        if number > FORMAT:
            raise ValueError(f"{path} has format {number}; allowed are formats up to {FORMAT}")
        scene = from_toml(head["scene"], str(path), kinds)
        starts = tuple(Start(step, replace(each, scene=scene_settings(scene))) for step, each in found.pop("starts"))
        return cls(scene=scene, starts=starts, **found)


def _from_parts(head: dict[str, Any], content: dict[str, np.ndarray]) -> dict[str, Any]:
    """Fields of a recording except its scene, from the head and the arrays of a file."""
    head_value(head, "scene", is_text, "a scene as TOML")
    settings = head_value(head, "accuracy", lambda value: Accuracy(**value), "the fields of a physics.Accuracy")
    about = head_value(head, "origin", _is_table_of_text, "names and texts")
    about.setdefault("compiler", FUSED)  # there was no other
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
    """Report table (..., columns) of a version with fewer columns, filled with zeros."""
    return np.pad(table, [(0, 0)] * (table.ndim - 1) + [(0, max(0, at.REPORT_SIZE - table.shape[-1]))])


@dataclass(frozen=True)
class Replay:
    """Outcome of a replay of a `Recording`.

    Parameters
    ----------
    recording : Recording
    states : (n, bodies, STATE_SIZE) float64
    reports : tuple of StepReport
    energies : (n,) float64
        Of all bodies, kinetic and potential [J].
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
        """Tolerance of the comparison: 0 (bits), or `OTHER_COMPILER` if the recording's compiler rounds differently.

        A number x of a state may differ by the tolerance times (1 + |x|).
        """
        return 0.0 if round_alike(self.recording.origin["compiler"], COMPILER) else OTHER_COMPILER

    @property
    def first_difference(self) -> int | None:
        """First step whose state differs from the recorded one, by a bit or beyond `tolerance`; None if all agree."""
        ours, theirs = self.states, self.recording.states
        is_other = ours.view(np.int64) != theirs.view(np.int64)
        if self.tolerance > 0.0:
            is_other &= ~(np.abs(ours - theirs) <= self.tolerance * (1.0 + np.abs(theirs)))
        different = np.flatnonzero(is_other.any(axis=(1, 2)))
        return int(different[0]) if len(different) else None

    @property
    def is_identical(self) -> bool:
        """True if every state is the recorded one, bit for bit."""
        return np.array_equal(self.states.view(np.int64), self.recording.states.view(np.int64))

    @property
    def distances(self) -> np.ndarray:
        """Largest distance (n,) of any body from its recorded place [m]."""
        offset = (self.states - self.recording.states)[:, :, at.POS : at.POS + 3]
        return np.sqrt((offset * offset).sum(axis=-1)).max(axis=1, initial=0.0)

    @property
    def times(self) -> np.ndarray:
        """Times (n,) after each call since the world began [s]."""
        recording, times, now = self.recording, [], 0.0
        starts = {start.step: start.snapshot.time for start in recording.starts}
        for k, (steps, dt) in enumerate(zip(recording.steps.tolist(), recording.dt.tolist())):
            now = starts.get(k, now) + steps * dt
            times.append(now)
        return np.array(times)


def origin() -> dict[str, str]:
    """Software and processor of a new recording; where any differs, a replay may differ in the last bits."""
    return {
        "version": version(),
        "kernels": folder_name(),  # digest of their sources
        "compiler": COMPILER,
        "numba": metadata.version("numba"),
        "numpy": np.__version__,
        "python": platform.python_version(),
        "machine": platform.platform(),
    }
