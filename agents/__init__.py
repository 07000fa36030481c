"""Training, evaluation and recording of agents with Stable-Baselines3, and baselines for comparison.

``python -m agents.train`` and the other commands first check whether a package of the extra ``agents`` is missing, and
say which. As a library, `agents.baselines`, `agents.curve` and `agents.interval` work without the extra.
"""

import sys

if sys.argv[0] == "-m":  # Python imports this package while it looks for the module of the command
    from agents.needs import require_or_exit

    require_or_exit()
