"""Count how often pivoting beats sweeps and Newton's method: ``python -m benchmarks.pivoting``.

Each batch of random contacts (`benchmarks.drawn_contacts`) is stepped twice from the same states: with pivoting, and
without it (`Accuracy.solver`). Pivoting is tried where a problem keeps a residual above 1 %. Its impulses are taken if
they have the smaller residual; only then the two states differ. Residuals are the worst of a step, relative to the
largest free contact speed. A step may discard a solve that would create energy and solve again. So a step that took
impulses of pivoting may be the worse one in the end, or name another method as its last.

With ``--hard-cases`` the steps of single bodies in all hard cases (`rigid_env.hard_cases`) are counted, in short runs.
Ctrl-C ends it early; the same command goes on from the file of results.
"""

from __future__ import annotations

import itertools
import json as json_module
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

import physics
from benchmarks import machine
from benchmarks.drawn_contacts import KINDS, draw
from physics.plan.plan import make_plan
from rigid_env.hard_cases import registry
from rigid_env.hard_cases.case import Setting, UnsupportedError
from rigid_env.lab.measure.machine import write_json
from rigid_env.terminal import Column, Table, make_console, number_columns, progress_bar, run_program

WORLDS = 100
STEPS = 5  # of a batch: the first without a warm start
SAVED = 10  # batches between two writes of the result
KEPT = 5  # places of the largest gains, of each family and preset

RESULT = machine.RESULTS / "pivoting.json"

# Bounds of what rattles or cannot be solved, for the time a run takes.
MOST_IMPACTS, MOST_ITERATIONS = 200, 2000

_GRAVITY, _RIGID, _GIVES = (
    physics.Gravity(),
    physics.Contact(0.0, between_bodies=False),
    physics.Contact(stiffness=1e3, damping=1.0, between_bodies=False),
)
# Family: effects, whether bodies are round, and presets.
ALL, SOME = tuple(physics.PRESETS), ("balanced",)
FAMILIES = {
    "friction": ((_GRAVITY, _RIGID, physics.Friction(0.0)), False, ALL),
    "no friction": ((_GRAVITY, _RIGID), False, ALL),
    "round": ((_GRAVITY, _RIGID, physics.Friction(0.0)), True, SOME),
    "anisotropic": ((_GRAVITY, _RIGID, physics.Friction((0.2, 0.6), axis=(1, 0, 0))), False, SOME),
    "compliant": ((_GRAVITY, _GIVES, physics.Friction(0.0)), False, SOME),
    "compliant, no friction": ((_GRAVITY, _GIVES), False, SOME),
}  # fmt: skip


def with_pivoting(preset: str) -> physics.Accuracy:
    """Return a preset that pivots, within the bounds of this program."""
    knobs = physics.PRESETS[preset]
    impacts, iterations = min(knobs.impacts, MOST_IMPACTS), min(knobs.iterations, MOST_ITERATIONS)
    return replace(knobs, solver="sweeps+pivoting", impacts=impacts, iterations=iterations)


def tally() -> dict:
    """Counts of nothing yet.

    ``problems`` and ``unconverged`` (above the tolerance, with pivoting) count contact problems. The others count steps
    of a world: pivoting ``tried``; ``won``, with a smaller residual than without it, of these ``by_tolerance`` smaller
    by more than the tolerance, and ``solved`` to within it; ``worse``, with a larger one; ``unreported``, where the
    states differ though no try is reported.
    """
    names = ("problems", "unconverged", "tried", "won", "by_tolerance", "solved", "worse", "unreported")
    return {**dict.fromkeys(names, 0), "decades": {}}


def compare(counts: dict, on: physics.World, off: physics.World, chosen: np.ndarray) -> np.ndarray:
    """Add a step with and without pivoting to the counts of the `chosen` worlds; return which of all are won."""
    tried = on.report.solver == physics.Solver.PIVOTING
    differs = (on.state.view(np.int64) != off.state.view(np.int64)).reshape(on.worlds, -1).any(axis=1)
    before, after = off.report.residual, on.report.residual
    won = tried & differs & (after < before)
    tolerance = on.accuracy.tolerance
    for name, value in {
        "problems": on.report.solves, "unconverged": on.report.unconverged, "tried": tried, "won": won,
        "by_tolerance": won & (before - after > tolerance), "solved": won & (after <= tolerance),
        "worse": tried & differs & (after > before), "unreported": differs & ~tried,
    }.items():  # fmt: skip
        counts[name] += int(value[chosen].sum())
    pairs = zip(_decades(before[won & chosen]), _decades(after[won & chosen]))
    counts["decades"] = dict(Counter(counts["decades"]) + Counter(f"{a} -> {b}" for a, b in pairs))
    return won


def _decades(residual: np.ndarray) -> list[int]:
    """Powers of ten above residuals; -16 is the least, 4 the largest."""
    return np.clip(np.ceil(np.log10(np.maximum(residual, 1e-300))), -16, 4).astype(int).tolist()


# --- random contacts ---------------------------------------------------------------------------------------------


def run_batch(family: str, preset: str, seed: int, found: dict) -> None:
    """Step the next batch of a family, and add it to `found`."""
    effects, is_round, _ = FAMILIES[family]
    batch, accuracy = found["batches"], with_pivoting(preset)
    place = list(FAMILIES).index(family), list(physics.PRESETS).index(preset), batch
    drawn = draw(np.random.default_rng([seed, *place]), effects, is_round, WORLDS)
    found["batches"] += 1
    if drawn is None:
        found["refused"] += 1
        return
    on, off = drawn.start(accuracy), drawn.start(replace(accuracy, solver="sweeps"))
    for step in range(STEPS):
        off.restore(on.snapshot())
        on.step(drawn.wrench)
        off.step(drawn.wrench)
        for kind, chosen in drawn.kinds.items():
            won = compare(found[kind], on, off, chosen)
        gains = [
            [float(off.report.residual[w]), float(on.report.residual[w]), batch, step, w]
            for w in np.flatnonzero(won).tolist()
        ]
        found["largest"] = sorted(found["largest"] + gains, key=lambda row: row[1] - row[0])[:KEPT]


def empty() -> dict:
    """Nothing found yet of a family at a preset."""
    return {"batches": 0, "refused": 0, **{kind: tally() for kind in KINDS}, "largest": []}


def problems(found: dict) -> int:
    """Contact problems of a family at a preset."""
    return sum(found[kind]["problems"] for kind in KINDS)


# --- hard cases --------------------------------------------------------------------------------------------------


class Watched(physics.World):
    """A world whose steps are taken once more without pivoting where it was tried, and counted."""

    counts: dict
    twin: physics.World | None = None

    def step(self, wrench=None, steps: int = 1, dt: float | None = None) -> physics.StepReport:
        """`physics.World.step`; each call is one step of the counts."""
        before = self.snapshot()
        report = super().step(wrench, steps, dt)
        if self.twin is None:
            accuracy = replace(self.accuracy, solver="sweeps")
            self.twin = physics.World(self.scene, worlds=self.worlds, dt=self.dt, accuracy=accuracy)
        twin, every = self, np.ones(self.worlds, dtype=np.bool_)
        if (report.solver == physics.Solver.PIVOTING).any():
            twin = self.twin
            twin.restore(before)
            twin.step(wrench, steps, dt)
        compare(self.counts, self, twin, every)
        return report


@dataclass(frozen=True)
class WatchedSetting(Setting):
    """Setting whose worlds are `Watched`."""

    counts: dict = field(default_factory=tally)

    def world(self, scene: physics.Scene, worlds: int = 1) -> physics.World:
        """`Setting.world`; refuses what has no solver that pivots."""
        if not make_plan(scene, self.accuracy).pivots:
            raise UnsupportedError("no solver of this scene pivots")
        world = Watched(scene, worlds=worlds, dt=self.dt, accuracy=self.accuracy)
        world.counts = self.counts
        return world


def run_case(case, preset: str) -> dict:
    """Counts of a hard case in a short run."""
    setting = WatchedSetting(accuracy=preset, is_thorough=False)
    try:
        case.run(setting)
    except (UnsupportedError, ValueError) as error:
        return {**setting.counts, "left_out": str(error)}
    return setting.counts


# --- all of them -------------------------------------------------------------------------------------------------


def jobs(family: list[str] | None, preset: list[str] | None) -> list[tuple[str, str]]:
    """Families and presets to run."""
    return [
        (name, level)
        for name, (*_, presets) in FAMILIES.items()
        for level in presets
        if name in (family or FAMILIES) and level in (preset or presets)
    ]


def random_steps(found: dict, todo: list[tuple[str, str]], count: int, seed: int) -> Iterator[tuple[str, float]]:
    """Run random contacts, `SAVED` batches at a time: what was run, and the share that is done."""
    for k, (name, level) in enumerate(todo):
        one, wanted = found["random"].setdefault(f"{name}, {level}", empty()), count / len(todo)
        while problems(one) < wanted:
            for _ in range(SAVED):
                if problems(one) < wanted:
                    run_batch(name, level, seed, one)
            yield f"{name}, {level}", (k + min(1.0, problems(one) / wanted)) / len(todo)


def case_steps(found: dict, presets: Sequence[str]) -> Iterator[tuple[str, float]]:
    """Run hard cases one by one: what was run, and the share that is done."""
    for k, (level, case) in enumerate(itertools.product(presets, registry.CASES)):
        cases = found["hard_cases"].setdefault(level, {})
        if case.run is not None and case.name not in cases:
            cases[case.name] = run_case(case, level)
            yield f"{case.name}, {level}", k / (len(presets) * len(registry.CASES))


def read(path: Path, seed: int) -> dict:
    """Result of an earlier run that this one goes on with; nothing where there is no file."""
    if not path.exists():
        return {"name": "pivoting", "seed": seed, "random": {}, "hard_cases": {}}
    found = json_module.loads(path.read_text(encoding="utf-8"))
    if found["seed"] != seed:
        raise typer.BadParameter(f"{path} is of seed {found['seed']}, not {seed}; give another file, or its seed")
    return found


def table(found: dict) -> Table:
    """Counts of all families, then of the hard cases."""
    names = [name for name in tally() if name != "decades"]
    made = Table([Column("worlds"), Column("kind"), *number_columns(*(name.replace("_", " ") for name in names))])
    rows = [(run, kind, found["random"][run][kind]) for run in found["random"] for kind in KINDS]
    for preset, cases in found["hard_cases"].items():
        counts = {name: sum(case[name] for case in cases.values()) for name in names}
        rows.append((f"hard cases, {preset}", f"{len(cases)} cases", counts))
    for run, kind, counts in rows:
        made.add_row(run, kind, *(f"{counts[name]:,}" for name in names))
    return made


def main(
    count: Annotated[int, typer.Option("--problems", min=1, help="Random contact problems in all.")] = 1_000_000,
    seed: Annotated[int, typer.Option(min=0)] = 0,
    family: Annotated[list[str] | None, typer.Option(help=f"Some of: {'; '.join(FAMILIES)}.")] = None,
    preset: Annotated[list[str] | None, typer.Option(help=f"Some of {', '.join(physics.PRESETS)}.")] = None,
    hard_cases: Annotated[bool, typer.Option("--hard-cases", help="Instead of random contacts.")] = False,
    json: Annotated[Path, typer.Option(metavar="FILE", help="Result, gone on with.")] = RESULT,
) -> None:
    """Count contact problems, tries of pivoting, and those it won."""
    console, found = make_console(), read(json, seed)
    console.print(machine.headline())
    steps = case_steps(found, preset or SOME) if hard_cases else random_steps(found, jobs(family, preset), count, seed)
    with progress_bar(console) as progress:
        task = progress.add_task("", total=100)
        try:
            for label, share in steps:
                progress.update(task, description=label, completed=100 * share)
                if not console.is_terminal:
                    console.print(f"{share:4.0%} {label}")
                write_json(json, found)
        except KeyboardInterrupt:
            console.print("ended early; the same command goes on")
    console.print(table(found))
    console.print(f"written to {json}")


if __name__ == "__main__":
    run_program(main)
