"""Read the documentation that a class's docstring writes out by hand, by Gymnasium's sections."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from dataclasses import dataclass

SENTENCE_END = re.compile(r"(?<=[.:])\s+(?=[A-Z`0-9])")


@dataclass(frozen=True)
class Part:
    """Section of a docstring.

    Attributes
    ----------
    before, after : tuple of str
        Paragraphs around its table; all are `before` where there is none.
    rows : tuple of tuple of str
        Of the table, without its head.
    """

    before: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()
    after: tuple[str, ...] = ()

    @property
    def text(self) -> tuple[str, ...]:
        """All paragraphs as one text."""
        return (*self.before, *self.after)


def written_parts(documented: type) -> dict[str, Part]:
    """Sections of a class's docstring by title; none where it has no headings."""
    doc = inspect.cleandoc(documented.__doc__ or "")
    _, *rest = re.split(r"^## (.+)$", doc, flags=re.MULTILINE)
    return {title: _part(body) for title, body in zip(rest[::2], rest[1::2])}


def sentences(paragraphs: tuple[str, ...], is_kept: Callable[[str], bool]) -> tuple[str, ...]:
    """Paragraphs without rejected sentences, and without paragraphs that are then empty."""
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
