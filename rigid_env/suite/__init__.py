"""Suite of environments: one file for each, with the task, its documentation and a handwritten controller.

`SUITE` lists them. To add one, write a file like `block_curl.py`, and add it to `rigid_env.envs.registration.SUITE`.
The file contains a subclass of `rigid_env.Task` whose docstring follows Gymnasium's form, and ``controller``, if a
handwritten one is feasible.
"""
