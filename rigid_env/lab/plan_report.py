"""A plan as a table in a terminal: what `rigid-env explain` shows."""

from __future__ import annotations

from rich.text import Text

from physics.plan.plan import Plan
from rigid_env.terminal import Column, Table

STATES = {True: Text("on", style="green"), False: Text("off", style="dim")}


def make_table(plan: Plan, title: str) -> Table:
    """Effect, whether it is on, why, and what is compiled for it."""
    columns = [Column("effect"), Column("state", is_whole=True), Column("why"), Column("compiled", under="why")]
    table = Table(columns, title)
    for row in plan.rows:
        table.add_row(row.effect, STATES[row.is_on], row.reason, row.compiled if row.is_on else "nothing")
    return table
