"""Heights of a block's vertices along a normal, one by one and all at once."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from physics.compiler.decorators import kernel
from physics.kernels.half_space.support_function import vertex_height, vertex_heights

EDGES = st.tuples(*[st.floats(-100, 100, allow_subnormal=False)] * 3)


@kernel
def _heights(e, out):
    lower, upper = vertex_heights(e)
    for k in range(4):
        out[0, k], out[0, 4 + k] = lower[k], upper[k]
    for k in range(8):
        out[1, k] = vertex_height(e, k)


@given(EDGES)
def test_all_at_once_they_are_what_each_is(e):
    """To the last bit, and to rounding the sum with the signs of the vertex's bits."""
    out = np.zeros((2, 8))
    _heights(e, out)
    np.testing.assert_array_equal(out[0], out[1])
    signs = 2.0 * (np.arange(8)[:, None] >> np.arange(3) & 1) - 1.0
    np.testing.assert_allclose(out[0], signs @ np.array(e), rtol=0, atol=4 * np.finfo(float).eps * 300)
