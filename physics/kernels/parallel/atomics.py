"""Add atomically to an array that threads share without a lock.

Compilers without atomic operations use a plain addition; then each thread has a table of its own
(`physics.parallel.thread_pool`).
"""

from __future__ import annotations

from physics.compiler.decorators import backend, inlined


@inlined
def _add(table, row, column, number):
    """Add `number` to table[row, column], not atomically; return the value before the addition."""
    before = table[row, column]
    table[row, column] = before + number
    return before


atomic_add = backend.atomic_add or _add
