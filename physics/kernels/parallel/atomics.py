"""Atomic changes and reads of an array that threads share without a lock.

Only `fused` has them. Elsewhere each thread has a table of its own (`physics.parallel.thread_pool`).
"""

from __future__ import annotations

from physics.kernels.compile.compiler_choice import COMPILER, FUSED
from physics.kernels.compile.decorators import inlined

if COMPILER == FUSED:
    from physics.kernels.compile.fused.atomics import atomic_add
else:

    @inlined
    def atomic_add(table, row, column, number):
        """table[row, column] += number; returns the old value."""
        before = table[row, column]
        table[row, column] = before + number
        return before


__all__ = ["atomic_add"]
