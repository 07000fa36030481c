"""Kernels compiled although an earlier run has kept them."""

from __future__ import annotations

from physics.kernels.compile.decorators import _make


def anew(kernel):
    """The same kernel, to be compiled at its first call: neither found on disk nor kept there."""
    return _make(kernel.py_func)
