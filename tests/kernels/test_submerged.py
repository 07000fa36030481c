"""The part of a body below a plane: volumes and centres against closed forms, polyhedra and integrals."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from physics.kernels.forces.submerged_volume import submerged_part
from physics.kernels.state.layout import BLOCK, ELLIPSOID, SPHERE
from tests.reference.fields import cut_block

EPS = np.finfo(float).eps
SIDES = st.floats(0.3, 3.0)
COMPONENTS = st.floats(-1.0, 1.0)


def unit(vector) -> np.ndarray:
    length = np.linalg.norm(vector)
    assume(length > 0.1)
    return np.asarray(vector) / length


@given(st.tuples(SIDES, SIDES, SIDES), st.tuples(COMPONENTS, COMPONENTS, COMPONENTS), st.floats(-0.99, 0.99))
def test_a_block_is_cut_as_qhull_cuts_it(half, normal, share):
    """Qhull merges facets within about 1e-12 of its coordinates; areas of up to 36 m² times that."""
    half, normal = np.array(half), unit(normal)
    normal[np.abs(normal) < 1e-6] = 0.0  # Qhull cannot tell such a plane from a face
    normal = unit(normal)
    height = share * (half @ np.abs(normal))
    volume, centre = submerged_part(BLOCK, tuple(half), tuple(normal), height)
    expected, middle = cut_block(half, normal, height)
    assert volume == pytest.approx(expected, abs=1e-9)
    if volume > 1e-3:  # a corner that hardly dips in has its centre to no more digits than its volume
        assert np.array(centre) == pytest.approx(middle, abs=1e-6)


@given(st.tuples(SIDES, SIDES, SIDES), st.tuples(COMPONENTS, COMPONENTS, COMPONENTS), st.floats(-1.2, 1.2))
def test_the_parts_above_and_below_make_the_whole(dims, normal, share):
    """V(n, h) + V(-n, -h) is the whole volume, and their moments cancel, for every shape."""
    normal = unit(normal)
    height = share * float(np.max(dims))
    for shape, d in ((BLOCK, dims), (SPHERE, (dims[0],) * 3), (ELLIPSOID, dims)):
        below, a = submerged_part(shape, d, tuple(normal), height)
        above, b = submerged_part(shape, d, tuple(-normal), -height)
        whole = (8.0 if shape == BLOCK else 4.0 * math.pi / 3.0) * math.prod(d)
        # Cones of an apex up to |height| away from the faces: each sum rounds 24 times at their size.
        size = whole + 24 * (abs(height) + max(d)) * max(d) ** 2
        assert below + above == pytest.approx(whole, abs=100 * EPS * size)
        assert below * np.array(a) == pytest.approx(-above * np.array(b), abs=100 * EPS * size * (abs(height) + max(d)))


@pytest.mark.parametrize("share", [-0.9, -0.3, 0.0, 0.5, 0.99])
def test_an_ellipsoid_by_its_slices(share):
    """∫ π a c (1 - y²/b²) dy over the part below, cut along an axis: the polynomial's own antiderivative."""
    a, b, c = 2.5, 1.5, 1.0
    height = share * b
    volume, centre = submerged_part(ELLIPSOID, (a, b, c), (0.0, 1.0, 0.0), height)
    top = -height
    expected = math.pi * a * c * ((top + b) - (top**3 + b**3) / (3 * b * b))
    moment = math.pi * a * c * ((top**2 - b**2) / 2 - (top**4 - b**4) / (4 * b * b))
    # Differences of terms of size 40.
    assert volume == pytest.approx(expected, abs=40 * 8 * EPS)
    assert volume * centre[1] == pytest.approx(moment, abs=40 * 8 * EPS)
    assert centre[0] == centre[2] == 0.0


def test_out_of_the_fluid_and_under_it():
    for shape, whole in ((BLOCK, 30.0), (ELLIPSOID, 4 * math.pi / 3 * 3.75)):
        assert submerged_part(shape, (2.5, 1.5, 1.0), (0.0, 1.0, 0.0), 1.5)[0] == 0.0
        volume, centre = submerged_part(shape, (2.5, 1.5, 1.0), (0.0, 1.0, 0.0), -1.5)
        assert volume == pytest.approx(whole, rel=4 * EPS)
        assert centre == pytest.approx((0, 0, 0), abs=4 * EPS)
