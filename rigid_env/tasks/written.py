"""Read the sections that a class's docstring writes out by hand, under Gymnasium's titles."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from dataclasses import dataclass

SENTENCE_END = re.compile(r"(?<=[.:])\s+(?=[A-Z`0-9])")


@dataclass(frozen=True)
class Part:
    """Section of a docstring: paragraphs and one table.

    Attributes
    ----------
    before, after : tuple of str
        Paragraphs before and after the table; without a table all of them are in `before`.
    rows : tuple of tuple of str
        Cells of the table, row by row, without its head.
    """

    before: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()
    after: tuple[str, ...] = ()

    @property
    def text(self) -> tuple[str, ...]:
        """All paragraphs, those before the table first."""
        return (*self.before, *self.after)


def written_parts(documented: type) -> dict[str, Part]:
    """Sections of a class's docstring by title; empty if the docstring has no headings."""
    doc = inspect.cleandoc(documented.__doc__ or "")
    _, *rest = re.split(r"^## (.+)$", doc, flags=re.MULTILINE)
    return {title: _part(body) for title, body in zip(rest[::2], rest[1::2])}


def sentences(paragraphs: tuple[str, ...], is_kept: Callable[[str], bool]) -> tuple[str, ...]:
    """Paragraphs without the sentences for which `is_kept` returns False, and without paragraphs that become empty."""
    found = (" ".join(filter(is_kept, SENTENCE_END.split(text))) for text in paragraphs)
    return tuple(filter(None, found))


def _part(body: str) -> Part:
    blocks = [block.strip() for block in body.split("\n\n") if block.strip()]
    tables = [k for k, block in enumerate(blocks) if block.startswith("|")]
    lines = blocks[tables[0]].splitlines()[2:] if tables else []
    rows = tuple(tuple(cell.strip() for cell in re.split(r"(?<!\\)\|", line.strip())[1:-1]) for line in lines)
    texts = [" ".join(block.split()) for block in blocks]
    cut = tables[0] if tables else len(blocks)
    return Part(tuple(texts[:cut]), rows, tuple(texts[cut + 1 :]))
