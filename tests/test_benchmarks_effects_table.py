"""The table of effects, schemes and shapes: the page is what the program writes."""

from __future__ import annotations

import pytest

import physics
from benchmarks import effects_table as program
from physics.scene.effects import EFFECTS
from physics.scene.force_fields import FIELDS
from physics.scene.parts import SHAPE_CODES


def test_the_page_is_written_by_its_program(tmp_path):
    program.main(tmp_path / "page.md")
    assert program.PAGE.read_text(encoding="utf-8") == (tmp_path / "page.md").read_text(encoding="utf-8")


def test_every_shape_has_a_column():
    assert set(program.SHAPES) == set(SHAPE_CODES)
    for name, make in program.SHAPES.items():
        assert make(pos=(0, 1, 0)).kind == name


def test_every_effect_has_a_row():
    told = {*EFFECTS, *FIELDS} - {physics.Field}
    assert {kind.__name__ for kind in told} <= {row.name.strip("`").partition("(")[0] for row in program.ROWS}


@pytest.mark.parametrize("row", program.ROWS, ids=[row.name for row in program.ROWS])
def test_a_row_acts_somewhere(row):
    """A name that is in no plan would leave a whole row empty."""
    assert not program.reason(row, program.KINDS[0], program.SHAPES["sphere"], "balanced")
