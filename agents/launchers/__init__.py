"""Places where the trials of a sweep run. A launcher yields the outcome of each as it ends, in any order.

To add one: write a function as `local.launch` in a module here, and name it in `agents.sweep.LAUNCHERS`. A trial is
`run_trial`, whose folder is the same wherever it runs; one that is lost is started again, and goes on from its last
checkpoint.
"""
