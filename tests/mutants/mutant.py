"""A mutant: a small fault of one source file, and the tests that must notice it."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]


class Mutant(NamedTuple):
    """A fault as an exact replacement of text.

    Attributes
    ----------
    name : str
        Unique, without spaces.
    fault : str
        One sentence: the fault.
    path : str
        Source file, from the root of the checkout.
    old, new : str
        Text that occurs exactly once in the file, and the text that takes its place.
    tests : tuple of str
        Test files or node ids; at least one of their assertions must fail.
    """

    name: str
    fault: str
    path: str
    old: str
    new: str
    tests: tuple[str, ...]

    def digest(self, root: Path = ROOT) -> str:
        """Return a digest of the mutant, its source file and its test files."""
        files = (self.path, *sorted({test.split("::")[0] for test in self.tests}))
        parts = (repr(self[2:]), *((root / path).read_text(encoding="utf-8") for path in files))
        return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:16]

    def mutated(self, text: str) -> str:
        """Return the text of the source file with the fault.

        Raises
        ------
        ValueError
            The old text does not occur exactly once, or is the new one.
        """
        count = text.count(self.old)
        if count != 1 or self.old == self.new:
            raise ValueError(f"{self.name} no longer applies: its old text occurs {count} times in {self.path}")
        return text.replace(self.old, self.new)
