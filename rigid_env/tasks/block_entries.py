"""Entries of the observations of the block's tasks: names, units and bounds as in the environments' docstrings."""

from __future__ import annotations

from rigid_env.tasks.entries import Entry
from rigid_env.tasks.kernels import LENGTH_BOUND, RATE_BOUND

GOAL_OFFSET = (
    Entry("goal x minus centre x", "5 m", -LENGTH_BOUND, LENGTH_BOUND),
    Entry("goal z minus centre z", "5 m", -LENGTH_BOUND, LENGTH_BOUND),
    Entry("tanh of (goal x minus centre x) / 1 m", "1", -1.0, 1.0),
    Entry("tanh of (goal z minus centre z) / 1 m", "1", -1.0, 1.0),
)

MOTION = (
    Entry("height of the centre over the floor", "2.5 m", 0.0, LENGTH_BOUND),
    *(Entry(f"linear velocity {axis}", "5 m/s", -RATE_BOUND, RATE_BOUND) for axis in "xyz"),
    *(Entry(f"angular velocity {axis}", "5 rad/s", -RATE_BOUND, RATE_BOUND) for axis in "xyz"),
)

ROTATION = tuple(Entry(f"R[{i}, {j}]", "1", -1.0, 1.0) for i in range(3) for j in range(3))

GOAL_AXES = (
    *(Entry(f"outward normal of the target face, {axis}", "1", -1.0, 1.0) for axis in "xyz"),
    *(Entry(f"next body axis, {axis}", "1", -1.0, 1.0) for axis in "xyz"),
    *(Entry(f"body axis after that, {axis}", "1", -1.0, 1.0) for axis in "xyz"),
    *(Entry(f"half edge along {which}", "2.5 m", 0.0, LENGTH_BOUND) for which in ("normal", "next", "last")),
)

GAPS = tuple(Entry(f"gap between block and wall {k}", "5 m", -1.0, LENGTH_BOUND) for k in range(3))

HOLD = (Entry("share of the hold completed", "1", 0.0, 1.0),)
