"""Elements of a model that a scene cannot hold: the first is an error, or all are listed."""

from __future__ import annotations

from physics.io.mjcf.text import ModelError


class LeftOut:
    """Parts of a model that no scene can hold.

    Parameters
    ----------
    drop : bool
        List them instead of raising the first.

    Attributes
    ----------
    messages : list of str
        What was left out, each with its line.
    """

    def __init__(self, drop: bool = False):
        self.drop = drop
        self.messages: list[str] = []

    def add(self, error: ModelError) -> None:
        """Raise the error, or add it to the list."""
        if not self.drop:
            raise ModelError(f"{error}; load_mjcf(path, drop=True) reads the rest", error.line)
        self.messages.append(f"{error.place}: {error}" if error.place else str(error))
