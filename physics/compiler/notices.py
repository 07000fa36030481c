"""Print lines about compiling on standard error."""

from __future__ import annotations

import sys


def warn(text: str) -> None:
    """Print one line on standard error."""
    print(f"rigid-env: {text}", file=sys.stderr, flush=True)


def warn_once(subject: str, text: str) -> None:
    """Print the first line about a subject in this process."""
    if subject not in _SAID:
        _SAID.add(subject)
        warn(text)


_SAID: set[str] = set()
