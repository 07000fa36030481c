"""Table of a plan for a terminal, for `rigid-env explain`."""

from __future__ import annotations

from rich.text import Text

from physics.plan.plan import Plan
from rigid_env.terminal import Column, Table

STATES = {True: Text("on", style="green"), False: Text("off", style="dim")}


def make_table(plan: Plan, title: str) -> Table:
    """Table of effects: on or off, the reason, and the kernels compiled for each."""
    columns = [Column("effect"), Column("state", is_whole=True), Column("why"), Column("compiled", under="why")]
    table = Table(columns, title)
    for row in plan.rows:
        table.add_row(row.effect, STATES[row.is_on], row.reason, row.compiled if row.is_on else "nothing")
    return table
