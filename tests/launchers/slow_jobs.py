"""Program of slow jobs, which a test interrupts: ``python -m tests.launchers.slow_jobs FOLDER [--stubborn]``.

Each job writes a file when it begins, and another one when it is interrupted. A stubborn one then goes on.
"""

from __future__ import annotations

import signal
import sys
import time
from functools import partial
from pathlib import Path

from rigid_env.launchers import local
from rigid_env.launchers.job import Job

INTERRUPTED = 130


def sleep(folder: Path, name: str, is_stubborn: bool) -> None:
    (folder / f"{name}.begun").touch()
    try:
        time.sleep(300.0)
    except KeyboardInterrupt:
        (folder / f"{name}.saved").touch()
        if is_stubborn:
            time.sleep(300.0)
        raise


def main(folder: Path, is_stubborn: bool) -> None:
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a suite in the background ignores it
    jobs = [Job(f"job {k}", partial(sleep, folder, f"{k}", is_stubborn), "") for k in range(5)]
    try:
        list(local.launch(jobs, folder, 2))
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)


if __name__ == "__main__":
    main(Path(sys.argv[1]), "--stubborn" in sys.argv)
