"""Program ``python -m rigid_env``: the command line ``rigid-env``."""

from rigid_env.cli import app

app(prog_name="rigid-env")
