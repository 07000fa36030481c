"""Write a page of hard cases: ``python -m benchmarks.hard_cases_page RESULT.json PAGE.md [--picture FILE]``.

RESULT.json is what ``rigid-env hard-cases --json`` wrote, and the picture what ``--plot`` drew in the same run. Nothing
is run: the page names the command, the commit and the machine of the result.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import Annotated

import typer

from benchmarks import machine
from physics.work_precision.contender import OURS
from rigid_env.hard_cases import registry
from rigid_env.hard_cases.case import Check
from rigid_env.lab.hard_cases import show
from rigid_env.lab.hard_cases.report import Report
from rigid_env.lab.hard_cases.run import Outcome, Status
from rigid_env.launchers.job import shell_line

INTRO = """# Hard cases

The situations in which rigid-body simulators break, each with an outcome that theory knows: a closed form, a law of
conservation, a symmetry. Every one is run at default settings; what must come out, and by how much it may be off, is
derived in the docstring of the case (`rigid_env/hard_cases/cases`), with its source. A limit is rounding, or what the
order of the scheme leaves (C dt²), or the tolerance that the preset solves contact problems to.

*Margin* is the share of the tightest limit that is left: 100 % nothing used, 0 % just holds. What an accuracy cannot
express says so; what fails stays, with the reason. The same cases are the tests in `tests/hard_cases`, where a case
that fails is expected to, and fails the test when it does not any more.

```sh
rigid-env hard-cases                                # all, at the default accuracy and 10 ms
rigid-env hard-cases zeno 21 --accuracy precise     # by name or number
rigid-env hard-cases --steps 1e-3,1e-2,5e-2 --peers # where each holds; and other engines
```
"""
BESIDE = (
    "At {ms:g} ms, the same runs and the same limits. Ours at `{first}`, every other engine at its defaults and, where "
    "it does not hold with them, at the settings of `rigid_env/lab/measure/peers`: the first that holds is shown. They "
    "make the shorter runs of `--quick`. A wrench, contact forces and reports are not handed to other engines, so that "
    "only cases that look at the motion alone are here."
)


def read_report(content: dict) -> Report:
    """Report of a result.

    Raises
    ------
    ValueError
        It is no result of hard cases, or of a case that there is not any more.
    """
    if content.get("name") != "hard_cases":
        raise ValueError(f"name is {content.get('name')!r}; allowed is a result of rigid-env hard-cases --json")
    cases = {case.number: case for case in registry.find(dict.fromkeys(str(row["number"]) for row in content["rows"]))}
    outcomes = tuple(
        Outcome(cases[row["number"]], row["engine"], row["accuracy"], row["dt"], Status(row["status"]),
                tuple(map(_check, row["checks"])), row["reason"], row["seconds"])
        for row in content["rows"]
    )  # fmt: skip
    return Report(tuple(cases.values()), **content["settings"], outcomes=outcomes, is_complete=content["is_complete"])


def _check(row: dict) -> Check:
    """A check of a result; JSON has null for numbers that are not finite."""
    value, limit, expected = (math.nan if row[name] is None else row[name] for name in ("value", "limit", "expected"))
    return Check(row["what"], value, limit, row["unit"], row["kind"], expected)


def command(report: Report, result: Path) -> str:
    """Line for a shell that makes a result."""
    options = {
        "accuracy": ",".join(report.accuracies), "dt": None if report.dt == 0.01 else f"{report.dt:g}",
        "steps": ",".join(f"{step:g}" for step in report.steps) or None, "peers": bool(report.beside),
        "quick": not report.is_thorough,
    }  # fmt: skip
    spans = _spans([case.number for case in report.cases])
    return " ".join(["rigid-env hard-cases", *spans, shell_line(**options, json=result)])


def _spans(numbers: list[int]) -> list[str]:
    """Numbers in a row as ``$(seq first last)``."""
    spans = [[k for _, k in some] for _, some in groupby(enumerate(numbers), lambda pair: pair[1] - pair[0])]
    return [f"$(seq {span[0]} {span[-1]})" if len(span) > 2 else " ".join(map(str, span)) for span in spans]


def write_page(page: Path, result: Path, picture: Path | None = None) -> None:
    """Write the page of a result; `picture` is the one that the same run drew."""
    content = json.loads(result.read_text(encoding="utf-8"))
    report, of = read_report(content), content["machine"]
    lines = f"{command(report, result)}{f' --plot {picture}' if picture else ''}"
    lines += f"\npython -m benchmarks.hard_cases_page {result} {page}{f' --picture {picture}' if picture else ''}"
    parts = [INTRO, f"This page was written by\n\n```sh\n{lines}\n```\n", f"at {machine.headline(of)}."]
    for accuracy in report.accuracies:
        if found := [one for one in report.details if one.accuracy == accuracy]:
            parts += [f"## `{accuracy}` at {1e3 * report.dt:g} ms", f"{show.summary(found)}.", detail(found)]
            parts += _reasons(found)
    if report.steps and report.ours:
        place = picture and os.path.relpath(picture, page.parent).replace(os.sep, "/")
        drawn = f"![Margin of every case at every step]({place})" if place else ""
        parts += ["## At which steps each holds", drawn, f"{show.LEGEND}.", grid(report.ours)]
    if report.beside:
        note = BESIDE.format(ms=1e3 * report.dt, first=report.accuracies[0])
        parts += ["## Beside other engines", note, beside(report.beside)]
    page.parent.mkdir(parents=True, exist_ok=True)
    page.write_text("\n\n".join(part for part in parts if part) + "\n", encoding="utf-8")


def _reasons(outcomes: Sequence[Outcome]) -> list[str]:
    """Why those that fail do, as far as it is known."""
    lines = []
    for one in (one for one in outcomes if one.status is Status.FAILS):
        failed = "; ".join(f"{check.what}: {check.value:.3g}" for check in one.checks if not check.passes)
        why = one.case.faults.get(one.accuracy, "not known yet")
        lines.append(f"- **{one.case.number}, {one.case.name}** ({failed or one.reason}): {why}.")
    return ["Why they fail:\n\n" + "\n".join(lines)] if lines else []


def detail(outcomes: Sequence[Outcome]) -> str:
    """Number, case, what must and what came out, margin, status."""
    rows = [
        (one.case.number, f"`{one.case.name}`: {one.case.title}", one.case.must, one.came_out, show.margin(one),
         f"**{one.status.value}**" if one.status is Status.FAILS else one.status.value)
        for one in outcomes
    ]  # fmt: skip
    head = ("#", "case", "what must come out", "what came out, tightest check", "margin", "")
    return machine.markdown_table(head, rows)


def grid(outcomes: Sequence[Outcome]) -> str:
    """A row per case, a column per accuracy and step."""
    settings, found = show.grid(outcomes)
    rows = [
        (case.number, case.name, *(show.MARKS[one.status] if one else "" for one in row)) for case, row in found
    ]  # fmt: skip
    return machine.markdown_table(("#", "case", *(f"{name}, {1e3 * dt:g} ms" for name, dt in settings)), rows)


def beside(outcomes: Sequence[Outcome]) -> str:
    """A row per case, a column per engine: whether it holds, and at which of its settings."""
    engines = [OURS, *dict.fromkeys(one.engine for one in outcomes if one.engine != OURS)]
    rows = []
    for _, some in groupby(outcomes, lambda one: one.case.number):
        of = {one.engine: one for one in some}
        case = next(iter(of.values())).case
        rows.append((case.number, case.name, *(_cell(of.get(engine)) for engine in engines)))
    return machine.markdown_table(("#", "case", *engines), rows)


def _cell(outcome: Outcome | None) -> str:
    if outcome is None:
        return ""
    told = outcome.accuracy if outcome.status is Status.HOLDS else outcome.came_out
    return f"{show.MARKS[outcome.status]} {told}"


def main(
    result: Annotated[Path, typer.Argument(help="Written by rigid-env hard-cases --json.", exists=True)],
    page: Annotated[Path, typer.Argument(help="Page to write.")],
    picture: Annotated[Path | None, typer.Option(help="Drawn by --plot in the same run.")] = None,
) -> None:
    """Write a page of hard cases from a result."""
    try:
        write_page(page, result, picture)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="result") from error
    typer.echo(f"written to {page}")


if __name__ == "__main__":
    typer.run(main)
