"""The oracle's projection on friction cones, which other tests measure with."""

from __future__ import annotations

import numpy as np
import pytest

from tests.reference.lcp import project_on_cone


@pytest.mark.parametrize(
    ("p", "mu", "nearest"),
    [
        ((2.0, 0.6, 0.8), 0.5, (2.0, 0.6, 0.8)),  # on the cone
        ((-1.0, 0.3, 0.4), 0.5, (0.0, 0.0, 0.0)),  # in the polar cone: mu |p_t| <= -p_n
        ((0.0, 3.0, 4.0), 0.5, (2.0, 0.6, 0.8)),  # (p_n + mu |p_t|)/(1 + mu²) = 2 along the same tangent
        ((-1.0, 0.0, 0.0), 0.0, (0.0, 0.0, 0.0)),  # without friction the cone is a half-line
        ((1.5, 0.3, 0.4), 0.0, (1.5, 0.0, 0.0)),
    ],
)
def test_nearest_point_of_the_cone(p, mu, nearest):
    np.testing.assert_allclose(project_on_cone(np.array([p]), np.array([mu]))[0], nearest, atol=1e-15)
