"""Kernels compiled although an earlier run has kept them."""

from __future__ import annotations

from physics.compiler.fused.backend import make


def anew(kernel):
    """The same kernel, to be compiled at its first call: neither found on disk nor kept there."""
    return make(kernel.py_func)
