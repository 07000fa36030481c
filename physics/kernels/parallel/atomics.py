"""Atomic changes and reads of an array that threads share without a lock.

Where the compiler has none, each thread has a table of its own (`physics.parallel.thread_pool`).
"""

from __future__ import annotations

from physics.compiler.decorators import backend, inlined


@inlined
def _add(table, row, column, number):
    """table[row, column] += number; returns what was there before."""
    before = table[row, column]
    table[row, column] = before + number
    return before


atomic_add = backend.atomic_add or _add
