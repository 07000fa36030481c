"""The page `docs/hard-cases.md`, written from what came out, and its picture."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from rigid_env.lab.hard_cases import show
from rigid_env.lab.hard_cases.report import Report
from rigid_env.lab.hard_cases.run import Outcome, Status
from rigid_env.lab.measure.machine import describe
from rigid_env.lab.measure.plotting import require_matplotlib

INTRO = """# Hard cases

The situations in which rigid-body simulators break, each with an outcome that theory knows: a closed form, a law of
conservation, a symmetry. Every one is run at default settings; what must come out, and by how much it may be off, is
derived in the docstring of the case (`rigid_env/lab/hard_cases/`), with its source. A limit is rounding, or what the
order of the scheme leaves (C dt²), or the tolerance that the preset solves contact problems to.

*Margin* is the share of the tightest limit that is left: 100 % nothing used, 0 % just holds. What an accuracy cannot
express says so; what is not built is listed; what fails stays, with the reason. The same cases are the tests in
`tests/hard_cases`, where a case that fails is expected to, and fails the test when it does not any more.

```sh
rigid-env hard-cases                                # all, at the default accuracy and 10 ms
rigid-env hard-cases zeno 21 --accuracy precise     # by name or number
rigid-env hard-cases --steps 1e-3,1e-2,5e-2 --peers # where each holds; and other engines
```
"""


def write_page(path: Path, report: Report, picture: Path | None, command: str) -> None:
    """Write the page; `picture` is where `write_picture` put one, `command` what was typed."""
    plan, machine = report.plan, describe()
    git = machine["git"] or {}
    state = f"commit {git.get('commit', 'unknown')[:7]}{', with changes' if git.get('is_dirty') else ''}"
    parts = [INTRO, f"This page was written by\n\n```sh\n{command}\n```\n",
             f"at {state}, {machine['cores']} cores of {machine['processor']}, {machine['date'][:10]}."]  # fmt: skip
    for accuracy in plan.accuracies:
        found = [one for one in report.details if one.accuracy == accuracy]
        parts += [f"## `{accuracy}` at {1e3 * plan.dt:g} ms", f"{show.summary(found)}.", show.markdown_detail(found)]
        parts += _reasons(found)
    if plan.steps:
        parts += ["## At which steps each holds", _picture(path, picture), show.LEGEND + ".",
                  show.markdown_grid(report.outcomes)]  # fmt: skip
    if report.peers:
        parts += _beside(report)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n\n".join(part for part in parts if part) + "\n", encoding="utf-8")


def _picture(path: Path, picture: Path | None) -> str:
    if picture is None:
        return ""
    place = os.path.relpath(picture, path.parent).replace(os.sep, "/")
    return f"![Margin of every case at every step]({place})"


def _reasons(outcomes: Sequence[Outcome]) -> list[str]:
    """Why those that fail do, as far as it is known."""
    lines = []
    for one in outcomes:
        if one.status is Status.FAILS:
            failed = "; ".join(f"{check.what}: {check.value:.3g}" for check in one.checks if not check.passes)
            why = one.case.faults.get(one.accuracy, "not known yet")
            lines.append(f"- **{one.case.number}, {one.case.name}** ({failed or one.reason}): {why}.")
    return ["Why they fail:\n\n" + "\n".join(lines)] if lines else []


def _beside(report: Report) -> list[str]:
    """A column per engine: whether the case holds, and at which of its settings."""
    first = report.plan.accuracies[0]
    ours = {one.case.number: one for one in report.details if one.accuracy == first}
    engines = list(dict.fromkeys(one.engine for one in report.peers))
    rows = []
    for number in dict.fromkeys(one.case.number for one in report.peers):
        theirs = {one.engine: one for one in report.peers if one.case.number == number}
        rows.append((number, ours[number].case.name, _cell(ours[number]), *(_cell(theirs.get(e)) for e in engines)))
    note = (
        f"At {1e3 * report.plan.dt:g} ms, the same runs and the same limits. Ours at `{first}`, every other engine at "
        "its defaults and, where it does not hold with them, at the settings of `rigid_env/lab/measure/peers`: the "
        "first "
        "that holds is shown. They make the shorter runs of `--quick`. A wrench, contact forces and reports are not "
        "handed to other engines, so that only cases that look at the motion alone are here."
    )
    head = ("#", "case", "rigid-env", *engines)
    return ["## Beside other engines", note, show.markdown_table(head, rows)]


def _cell(outcome: Outcome | None) -> str:
    if outcome is None:
        return ""
    mark = show.MARKS[outcome.status]
    if outcome.status is Status.HOLDS:
        return f"{mark} {outcome.accuracy}"
    return f"{mark} {show.came_out(outcome)}"


def write_picture(path: Path, report: Report) -> None:
    """A square per case and setting: margin in colour, failures in red.

    Raises
    ------
    gymnasium.error.DependencyNotInstalled
        matplotlib is missing.
    """
    require_matplotlib()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    columns = list(dict.fromkeys((one.accuracy, one.dt) for one in report.outcomes))
    cases = list(dict.fromkeys((one.case.number, one.case.name) for one in report.outcomes))
    figure = Figure(figsize=(3.2 + 0.42 * len(columns), 1.6 + 0.22 * len(cases)), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    for one in report.outcomes:
        x, y = columns.index((one.accuracy, one.dt)), cases.index((one.case.number, one.case.name))
        axes.add_patch(_square(x, y, one))
    axes.set_xlim(-0.5, len(columns) - 0.5)
    axes.set_ylim(len(cases) - 0.5, -0.5)
    axes.set_yticks(range(len(cases)), [f"{number} {name}" for number, name in cases], fontsize=7)
    axes.set_xticks(range(len(columns)), [f"{a} {1e3 * dt:g} ms" for a, dt in columns], fontsize=7, rotation=90)
    axes.set_title("green: holds (pale: little margin)   red: fails   grey: not supported, not built", fontsize=8)
    axes.tick_params(length=0)
    for side in axes.spines.values():
        side.set_visible(False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=130)


def _square(x: int, y: int, outcome: Outcome):
    from matplotlib.patches import Rectangle

    if outcome.status is Status.HOLDS:
        colour = (0.0, 0.5, 0.3, 0.25 + 0.75 * min(1.0, max(0.0, outcome.tightest.margin)))
    elif outcome.status is Status.FAILS:
        colour = "#c0392b"
    else:
        colour = "#d9d9d9"
    return Rectangle((x - 0.45, y - 0.42), 0.9, 0.84, facecolor=colour, edgecolor="none")
