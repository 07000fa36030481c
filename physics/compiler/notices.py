"""Lines about compilation for the user, on standard error."""

from __future__ import annotations

import sys


def warn(text: str) -> None:
    """Print a line on standard error, with the name of the package in front."""
    print(f"rigid-env: {text}", file=sys.stderr, flush=True)


def warn_once(subject: str, text: str) -> None:
    """Print a line on standard error, unless this process has printed one about the same `subject`."""
    if subject not in _SAID:
        _SAID.add(subject)
        warn(text)


_SAID: set[str] = set()
