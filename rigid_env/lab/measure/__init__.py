"""Measurements of speed and accuracy that `rigid-env bench`, `rigid-env accuracy` and `benchmarks/` share.

For speed: `timing` repeats measurements in turns and computes medians and ratios, `machine` describes the machine of a
result, `workloads` is the work of our engine, `mujoco_scene` is the same work for MuJoCo, `rows` pairs the two,
`environments` is the work of environments, and `table` prints.

For error against time, which `physics.frontier` measures: `truths` are scenes with a known outcome, `peers` are other
engines, `accuracy` pairs them, `accuracy_table` and `accuracy_plot` show results, and `accuracy_report` runs all of it
in a terminal.
"""
