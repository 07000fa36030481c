"""Put each small fault of the list into a copy of the sources, and see whether its tests fail.

A verdict is kept in `benchmarks/results/mutants.json`, and an unchanged mutant is not run again: a run that was
interrupted goes on where it was. Exit status 0 means that tests have killed every mutant that was chosen.
"""

from __future__ import annotations

import tempfile
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated

import typer

from rigid_env.terminal import make_console, run_program
from tests.mutants.catalogue import MUTANTS
from tests.mutants.mutant import Mutant
from tests.mutants.results import KILLED, Results
from tests.mutants.runner import Copy, in_copies, verdict_of

INTERRUPTED = 130
"""Exit status after Ctrl-C."""


def choose(patterns: list[str]) -> list[Mutant]:
    """Mutants whose names fit one of some globs; all without globs.

    Raises
    ------
    typer.BadParameter
        A glob that fits none.
    """
    for pattern in patterns:
        if not any(fnmatchcase(mutant.name, pattern) for mutant in MUTANTS):
            raise typer.BadParameter(f"no mutant has the name {pattern!r}; allowed are globs of names in --table")
    return [mutant for mutant in MUTANTS if not patterns or any(fnmatchcase(mutant.name, each) for each in patterns)]


def judge_all(mutants: list[Mutant], results: Results, jobs: int, is_anew: bool) -> None:
    """Run the mutants that have no verdict yet, or all of them anew, and keep each verdict at once."""
    waiting = [mutant for mutant in mutants if is_anew or results.of(mutant) is None]
    console, done = make_console(), []

    def judge(copy: Copy, mutant: Mutant) -> None:
        found = copy.judge(mutant)
        if copy.is_stopped:
            return
        results.keep(mutant, *found)
        done.append(mutant)
        about = f"{found.seconds:6.1f} s" + ("" if found.verdict == KILLED else f"  {found.reason}")
        console.print(f"{len(done):3d} of {len(waiting)}  {found.verdict:8}  {mutant.name:40} {about}")

    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        in_copies(judge, waiting, jobs, Path(folder))


def check_sound(mutants: list[Mutant], jobs: int) -> bool:
    """Run the tests of the mutants without any fault: whether all of them pass."""
    tests = list(dict.fromkeys(mutant.tests for mutant in mutants))
    console, unsound, done = make_console(), [], []

    def check(copy: Copy, chosen: tuple[str, ...]) -> None:
        outcome = copy.run(chosen)
        done.append(chosen)
        if outcome.status != 0 or not outcome.ran:
            unsound.append(chosen)
        told = "passed" if chosen not in unsound else f"not sound: {verdict_of(outcome)[1]}"
        console.print(f"{len(done):3d} of {len(tests)}  {' '.join(chosen)}  {told}")

    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        in_copies(check, tests, jobs, Path(folder))
    return not unsound


def main(
    names: Annotated[list[str] | None, typer.Argument(help="Names of mutants, or globs; all without.")] = None,
    jobs: Annotated[int, typer.Option(min=1, help="Mutants that run side by side.")] = 1,
    table: Annotated[bool, typer.Option("--table", help="Print the kept verdicts only.")] = False,
    again: Annotated[bool, typer.Option("--again", help="Run mutants that have a verdict, too.")] = False,
    sound: Annotated[bool, typer.Option("--check-sound", help="Run the tests without any fault instead.")] = False,
) -> None:
    """Run the tests of each mutant, which must fail."""
    mutants, results = choose(names or []), Results()
    try:
        if sound:
            raise typer.Exit(0 if check_sound(mutants, jobs) else 1)
        if not table:
            results.forget_others({mutant.name for mutant in MUTANTS})
            judge_all(mutants, results, jobs, again)
    except KeyboardInterrupt:
        make_console().print("interrupted; run it again to go on")
        raise typer.Exit(INTERRUPTED) from None
    make_console().print(results.table(mutants))
    rows = [results.of(mutant) for mutant in mutants]
    raise typer.Exit(0 if all(row is not None and row["verdict"] == KILLED for row in rows) else 1)


if __name__ == "__main__":
    run_program(main)
