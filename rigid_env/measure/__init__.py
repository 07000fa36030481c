"""Measuring speed: what `rigid-env bench` and the programs in `benchmarks/` share.

`timing` has the arithmetic (repeats, medians, ratios), `machine` says where a number was measured,
`workloads` is the work our engine is given, `mujoco_scene` the same work for MuJoCo, `rows` pairs the two,
`environments` is the work of environments, and `table` prints.
"""
