"""Command `rigid-env hard-cases`: runs the cases that a user typed."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from rigid_env.lab.hard_cases import page, registry
from rigid_env.lab.hard_cases.report import Report, make_plan, run_and_show
from rigid_env.lab.measure.plotting import require_matplotlib


def run(
    console: Console,
    cases: Sequence[str],
    accuracy: str,
    dt: float,
    steps: str,
    has_peers: bool,
    is_quick: bool,
    json: Path | None,
    plot: Path | None,
    markdown: Path | None,
) -> tuple[Report, list[Path]]:
    """Run the cases, print them, write the files of the options: the report, and the files written.

    Raises
    ------
    ValueError
        No such case or preset, or a step out of range; nothing has run then.
    gymnasium.error.DependencyNotInstalled
        An option wants a picture, without matplotlib; likewise.
    """
    if plot:
        require_matplotlib()
    plan = make_plan(registry.find(cases), accuracy, dt, steps, not is_quick, has_peers)
    for path in filter(None, (json, plot, markdown)):
        path.parent.mkdir(parents=True, exist_ok=True)
    report = run_and_show(console, plan, json)
    if markdown:  # first: it says whether the checkout is that of the commit
        page.write_page(markdown, report, plot, " ".join(["rigid-env", *sys.argv[1:]]))
    if plot:
        page.write_picture(plot, report)
    return report, [path for path in (json, plot, markdown) if path]
