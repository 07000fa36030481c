"""Ctrl-C while jobs run: it is counted here, and raises nothing at a place that nobody has thought of."""

from __future__ import annotations

import multiprocessing
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


class Interrupts:
    """Context manager that counts Ctrl-C, in place of a `KeyboardInterrupt`.

    It changes nothing outside the main thread, or where SIGINT is ignored or already handled.

    Parameters
    ----------
    kill : callable
        Function that is called at each Ctrl-C after the first.

    Attributes
    ----------
    count : int
    arrived : multiprocessing.connection.Connection
        It is ready to be received from after the first Ctrl-C.
    """

    def __init__(self, kill: Callable[[], None]):
        self.count, self._kill = 0, kill
        self.arrived, self._notice = multiprocessing.Pipe(duplex=False)
        self._before: Any = None

    def __enter__(self) -> Interrupts:
        if _is_main() and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            self._before = signal.signal(signal.SIGINT, self._count)
        return self

    def __exit__(self, *error: object) -> None:
        if self._before is not None and _is_main():
            signal.signal(signal.SIGINT, self._before)

    @contextmanager
    def ignored(self) -> Iterator[None]:
        """Context manager in which Ctrl-C is ignored, so that a process that is started ignores it from the start."""
        if self._before is None:
            yield
            return
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, self._count)

    def _count(self, *_: object) -> None:
        self.count += 1
        if self.count == 1:
            self._notice.send(None)
        else:
            self._kill()


def _is_main() -> bool:
    return threading.current_thread() is threading.main_thread()
