"""Training, evaluation and recording of agents, and baselines to compare them with, on Stable-Baselines3.

``python -m agents.train`` and the other commands say before anything else which package of the extra ``agents`` is
missing. As a library, `agents.baselines`, `agents.curve` and `agents.interval` do without the extra.
"""

import sys

if sys.argv[0] == "-m":  # Python is still looking for the command's module: this package is imported for it
    from agents.needs import require_or_exit

    require_or_exit()
