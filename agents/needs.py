"""Check for the packages that the commands of `agents` need, before the first of them is imported."""

from __future__ import annotations

import sys

from gymnasium.error import DependencyNotInstalled

from rigid_env.extras import require


def require_or_exit() -> None:
    """End the program with one line of text, without a traceback, if a package of the extra ``agents`` is missing.

    Raises
    ------
    SystemExit
        With status 1.
    """
    command = sys.orig_argv[sys.orig_argv.index("-m") + 1] if "-m" in sys.orig_argv else "agents"
    try:
        require("agents", purpose=f"python -m {command}")
    except DependencyNotInstalled as error:
        print(f"Error: {error}", file=sys.stderr)
        raise SystemExit(1) from None
