"""Put the costs of effects into a page: ``python -m benchmarks.effects_page RESULT.json PAGE.md``.

RESULT.json is what ``rigid-env effects --json`` wrote, of all effects. The table goes between the lines `BEGIN` and
`END` of the page. Nothing is measured.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from benchmarks import machine
from rigid_env.lab.measure.effects import CASES, STEP

BEGIN, END = "<!-- costs: python -m benchmarks.effects_page -->", "<!-- end of costs -->"


def table(rows: list[dict]) -> str:
    """The rows of a result as a table of a page: what an effect adds to a step, in time and in memory."""
    head = ("effect", "its scene without it [ns a step]", "adds [ns]", "stores [bytes a body]")
    cells = [
        (row["what"], f"{1e9 / row['peer']['median']:.0f}", f"{row['notes']['added_ns_per_step']:.0f}",
         row["notes"]["added_bytes_per_body"])
        for row in rows
    ]  # fmt: skip
    return machine.markdown_table(head, cells)


def write_page(page: Path, result: Path) -> None:
    """Put the table of a result into a page.

    Raises
    ------
    ValueError
        The result lacks an effect, or the page has no lines `BEGIN` and `END`.
    """
    rows = json.loads(result.read_text(encoding="utf-8"))["rows"]
    if missing := [name for name in CASES if name not in [row["key"] for row in rows]]:
        raise ValueError(f"result is {str(result)!r} without {', '.join(missing)}; a page is written for all effects")
    head, found, rest = page.read_text(encoding="utf-8").partition(BEGIN)
    _, closed, tail = rest.partition(END)
    if not (found and closed):
        raise ValueError(f"page is {str(page)!r}; allowed are pages with the lines {BEGIN} and {END}")
    text = f"\nMedians at `{rows[0]['accuracy']}`, one world, steps of {STEP} s.\n\n{table(rows)}\n\n"
    page.write_text(f"{head}{BEGIN}\n{text}{END}{tail}", encoding="utf-8")


def main(
    result: Annotated[Path, typer.Argument(help="Written by rigid-env effects --json.", exists=True)],
    page: Annotated[Path, typer.Argument(help="Page that has a table of costs.", exists=True)],
) -> None:
    """Put the costs of effects into a page."""
    try:
        write_page(page, result)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    typer.echo(f"written to {page}")


if __name__ == "__main__":
    typer.run(main)
