"""Places where the trials of a sweep run. A launcher yields the outcome of each as it ends, in any order.

To add a launcher: write a function like `local.launch` in a module here, and name it in `agents.sweep.LAUNCHERS`.
`run_trial` runs one trial. The folder of a trial is the same wherever the trial runs, so a trial that is lost can
be started again, and continues from its last checkpoint.
"""
