"""Work in the background: kernels compile while the viewer goes on."""

from __future__ import annotations

import threading
from collections.abc import Callable


class Background:
    """One call in a thread of its own, which ends with the program.

    Parameters
    ----------
    name : str
        Of the thread.
    work : callable
        Takes nothing.

    Attributes
    ----------
    error : BaseException or None
        The one that it ended in.
    """

    def __init__(self, name: str, work: Callable[[], None]):
        self.error: BaseException | None = None
        self._work = work
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        try:
            self._work()
        except BaseException as error:  # told by whoever looks
            self.error = error

    @property
    def is_done(self) -> bool:
        """True once the call has ended, in an error, too."""
        return not self._thread.is_alive()

    def join(self) -> None:
        """Wait for its end."""
        self._thread.join()
