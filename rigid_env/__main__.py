"""``python -m rigid_env``: the command line."""

from rigid_env.cli import app

app(prog_name="rigid-env")
