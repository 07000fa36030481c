"""Collector of errors about elements of a model that a scene cannot hold: it raises the first, or lists all."""

from __future__ import annotations

from physics.io.mjcf.text import ModelError


class LeftOut:
    """Collector of errors about elements of a model that no scene can hold.

    Parameters
    ----------
    drop : bool
        Whether to list the errors, so that the elements are left out; False raises the first error.

    Attributes
    ----------
    messages : list of str
        Messages about the elements left out, each with its line where that is known.
    """

    def __init__(self, drop: bool = False):
        self.drop = drop
        self.messages: list[str] = []

    def add(self, error: ModelError) -> None:
        """Raise the error, or with `drop` add its message to `messages`."""
        if not self.drop:
            raise ModelError(f"{error}; load_mjcf(path, drop=True) reads the rest", error.line)
        self.messages.append(f"{error.place}: {error}" if error.place else str(error))
