"""The suite of environments: one file each, with its task, its documentation and a controller written by hand.

`SUITE` names them. To add one: write a file as `block_curl.py` (a subclass of `rigid_env.Task` whose docstring follows
Gymnasium's form, and ``controller``, if a hand can write one), and name it in `rigid_env.envs.registration.SUITE`.
"""
