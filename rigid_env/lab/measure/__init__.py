"""Measure speed and accuracy: what `rigid-env bench`, `rigid-env accuracy` and `benchmarks/` share.

`timing` takes turns and has the arithmetic (repeats, medians, ratios), `machine` says where a number was measured and
writes it, `workloads` is the work our engine is given, `mujoco_scene` the same work for MuJoCo, `rows` pairs the two,
`environments` is the work of environments, and `table` prints.

Error against time is `physics.frontier`'s: `truths` are scenes with a known outcome, `peers` other engines on them,
`accuracy` pairs them, `accuracy_table` and `accuracy_plot` show, `accuracy_report` runs all of it in a terminal.
"""
