"""Compare the results of two commits, or of two compilers of kernels, to the last bit.

``python -m benchmarks.same_bits OTHER_CHECKOUT``, or
``python -m benchmarks.same_bits . --compiler numba --other-compiler python``.

Each of the 24 scenes of `benchmarks.bit_scenes` takes 500 steps at each preset, over this checkout and over the other
one, on this machine. A checkout of an older commit is made with ``git worktree add FOLDER COMMIT``.
"""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.progress import track

from benchmarks.bit_scenes import PRESETS, SCENES, STEPS
from benchmarks.processes import ENDING, PATIENCE, killed_after, wait_for_end
from physics.compiler.compiler_choice import COMPILERS, VARIABLE
from rigid_env.lab.measure.machine import write_json

WORKER = Path(__file__).with_name("bit_scenes.py")


class Checkout:
    """A process that runs a worker over one checkout, with a compiler of kernels (None: the default).

    It is killed where an answer takes longer than `patience` [s], or its end longer than `ending` [s].
    """

    ending = ENDING

    def __init__(self, folder: Path, compiler: str | None = None, worker: Path = WORKER, patience: float = PATIENCE):
        self.patience = patience
        environment = {**os.environ, "PYTHONPATH": str(folder)}
        if compiler is not None:
            environment[VARIABLE] = compiler
        self._process = subprocess.Popen(
            [sys.executable, str(worker)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment, cwd=folder,
        )  # fmt: skip

    def ask(self, *request: str | int) -> None:
        """Have it work on a request; several processes do at once."""
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()

    def answer(self):
        """Wait for the result of the worker."""
        with killed_after(self._process, self.patience):
            line = self._process.stdout.readline()
        if not line:
            status = wait_for_end(self._process, self.ending)
            raise RuntimeError(f"the process over this checkout ended with {status}")
        return json.loads(line)

    def close(self) -> None:
        """End the process."""
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.close()
        wait_for_end(self._process, self.ending)
        self._process.stdout.close()

    def __enter__(self) -> Checkout:
        return self

    def __exit__(self, *_) -> None:
        self.close()


def verdict(ours: dict, theirs: dict) -> str:
    """``same``, or how two results differ."""
    if ours == theirs:
        return "same"
    if "error" in ours or "error" in theirs:
        return f"{ours.get('error', 'runs')}, was {theirs.get('error', 'runs')}"
    return f"differs by {np.abs(np.subtract(ours['state'], theirs['state'])).max():.1e}"


def main(
    other: Annotated[Path, typer.Argument(help="A checkout of the commit to compare with.", exists=True)],
    scene: Annotated[list[str] | None, typer.Option(help=f"Some of {', '.join(SCENES)}.")] = None,
    preset: Annotated[list[str] | None, typer.Option(help=f"Some of {', '.join(PRESETS)}.")] = None,
    steps: Annotated[int, typer.Option(min=1, help="Of each run, in parts of 25.")] = STEPS,
    compiler: Annotated[str | None, typer.Option(help=f"Of {', '.join(COMPILERS)}.")] = None,
    other_compiler: Annotated[str | None, typer.Option(help="Likewise, over the other checkout.")] = None,
    json: Annotated[Path | None, typer.Option(help="Where to write the result, after each run.")] = None,
    patience: Annotated[float, typer.Option(min=1.0, help="Time limit for a run [s].")] = PATIENCE,
) -> None:
    """Compare the states of 24 scenes at four presets with those of another commit; exit with 1 where one differs."""
    for each in (compiler, other_compiler):
        if each not in (None, *COMPILERS):
            raise typer.BadParameter(f"{each} is no compiler; allowed are {', '.join(COMPILERS)}")
    pairs = [(name, level) for name in scene or SCENES for level in preset or PRESETS]
    found: dict[str, str] = {}
    folders = ((Path(__file__).parents[1], compiler), (other.resolve(), other_compiler))
    here, there = (Checkout(folder, by, patience=patience) for folder, by in folders)
    with here, there:
        for name, level in track(pairs, description="scenes"):
            here.ask(name, level, steps)
            there.ask(name, level, steps)
            found[f"{name} {level}"] = how = verdict(here.answer(), there.answer())
            typer.echo(f"{name} {level}: {how}")
            if json is not None:
                compilers = [compiler, other_compiler]
                write_json(json, {"name": "same_bits", "steps": steps, "compilers": compilers, "runs": found})
    different = [run for run, how in found.items() if how != "same"]
    typer.echo(f"{len(found) - len(different)} of {len(found)} runs of {steps} steps have the same bits")
    raise typer.Exit(1 if different else 0)


if __name__ == "__main__":
    typer.run(main)
