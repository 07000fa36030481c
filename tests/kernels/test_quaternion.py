"""Quaternion algebra: the laws, for all inputs, and the kernels against plain NumPy and SciPy."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from physics.kernels.math import quaternion as kernels
from tests.reference.rigid_body import orientation_error

EPS = np.finfo(float).eps

scalars = st.floats(-10, 10)
vectors = st.tuples(scalars, scalars, scalars)
quaternions = st.tuples(scalars, scalars, scalars, scalars)
unit_quaternions = quaternions.filter(lambda q: math.hypot(*q) > 0.1).map(
    lambda q: tuple(float(a) for a in np.array(q) / math.hypot(*q))
)
rotation_vectors = st.tuples(*[st.floats(-3, 3)] * 3)

# A product of two quaternions with parts ≤ 10 sums four terms ≤ 100: 4 roundings of 400 EPS/2 at most.
PRODUCT = 800 * EPS


def scipy_rotation(q):
    """The same rotation in SciPy, which puts the scalar last."""
    return Rotation.from_quat([q[1], q[2], q[3], q[0]])


def distance(a, b):
    """Largest difference between two tuples."""
    return float(np.abs(np.subtract(a, b)).max())


def test_the_units_multiply_as_hamilton_wrote_on_the_bridge():
    one, i, j, k = (tuple(map(float, row)) for row in np.eye(4))
    minus_one = (-1.0, 0.0, 0.0, 0.0)
    assert kernels.multiply(i, j) == k
    assert kernels.multiply(j, k) == i
    assert kernels.multiply(k, i) == j
    assert kernels.multiply(i, i) == kernels.multiply(j, j) == kernels.multiply(k, k) == minus_one
    assert kernels.multiply(kernels.multiply(i, j), k) == minus_one
    assert kernels.multiply(one, k) == k


@settings(deadline=None)
@given(quaternions, quaternions, quaternions)
def test_the_product_is_associative_and_distributive(a, b, c):
    left = kernels.multiply(kernels.multiply(a, b), c)
    right = kernels.multiply(a, kernels.multiply(b, c))
    # Two products, the second of parts ≤ 400 with parts ≤ 10.
    assert distance(left, right) <= 2 * (40 * PRODUCT + 40 * PRODUCT)
    both = tuple(float(x) for x in np.add(b, c))
    apart = np.add(kernels.multiply(a, b), kernels.multiply(a, c))
    assert distance(kernels.multiply(a, both), apart) <= 4 * PRODUCT


@settings(deadline=None)
@given(quaternions, quaternions)
def test_the_norm_is_multiplicative_and_conjugation_reverses_a_product(a, b):
    norm = math.hypot(*kernels.multiply(a, b))
    assert abs(norm - math.hypot(*a) * math.hypot(*b)) <= 2 * PRODUCT
    reverse = kernels.multiply(kernels.conjugate(b), kernels.conjugate(a))
    assert distance(kernels.conjugate(kernels.multiply(a, b)), reverse) <= PRODUCT


@settings(deadline=None)
@given(unit_quaternions)
def test_the_conjugate_is_the_inverse(q):
    # Parts ≤ 1: PRODUCT over 100; |q| itself is 1 to 2 EPS.
    assert distance(kernels.multiply(q, kernels.conjugate(q)), (1, 0, 0, 0)) <= 12 * EPS


@settings(deadline=None)
@given(quaternions.filter(lambda q: math.hypot(*q) > 1e-3))
def test_normalised_is_of_length_one_in_the_same_direction(q):
    unit = kernels.normalise(q)
    # Sum of squares 2 EPS, its root half of that, root, quotient and product EPS/2 each: 2.5 EPS; and hypot.
    assert abs(math.hypot(*unit) - 1) <= 4 * EPS
    assert distance(np.array(unit) * math.hypot(*q), q) <= 4 * EPS * math.hypot(*q)


@settings(deadline=None)
@given(unit_quaternions, st.floats(-1e-9, 1e-9))
def test_renormalise_is_normalise_near_length_one(q, off):
    near = tuple(float(a) * (1 + off) for a in q)
    # The Newton step errs by 3/8 (2 · 1e-9)² = 1.5e-18; the rest is rounding.
    assert distance(kernels.renormalise(near), kernels.normalise(near)) <= 4 * EPS


@settings(deadline=None)
@given(unit_quaternions, unit_quaternions)
def test_the_matrix_is_a_rotation_and_a_homomorphism(a, b):
    A, B = (np.array(kernels.to_matrix(q)).reshape(3, 3) for q in (a, b))
    # Entries are 1 minus two products of a q with |q|² = 1 to 4 EPS: 8 EPS; three of them in a dot.
    assert np.abs(A @ A.T - np.eye(3)).max() <= 48 * EPS
    assert abs(np.linalg.det(A) - 1) <= 48 * EPS
    product = np.array(kernels.to_matrix(kernels.multiply(a, b))).reshape(3, 3)
    assert np.abs(product - A @ B).max() <= 48 * EPS
    assert np.abs(A - scipy_rotation(a).as_matrix()).max() <= 16 * EPS
    assert kernels.to_matrix(tuple(-x for x in a)) == kernels.to_matrix(a)


@settings(deadline=None)
@given(unit_quaternions, vectors, vectors)
def test_rotation_keeps_lengths_angles_and_handedness(q, a, b):
    R = kernels.to_matrix(q)
    turned_a, turned_b = kernels.rotate(q, a), kernels.rotate(q, b)
    assert turned_a == kernels.matvec(R, a)
    # Matrix entries 8 EPS off, three terms ≤ 10 each: 240 EPS a vector; times 10 and three terms a product.
    assert distance(kernels.transposed_matvec(R, turned_a), a) <= 2 * 300 * EPS
    assert abs(kernels.dot(turned_a, turned_b) - kernels.dot(a, b)) <= 2 * 60 * 300 * EPS
    turned_cross = kernels.rotate(q, kernels.cross(a, b))
    assert distance(turned_cross, kernels.cross(turned_a, turned_b)) <= 4 * 60 * 300 * EPS
    sandwich = kernels.multiply(kernels.multiply(q, (0.0, *a)), kernels.conjugate(q))
    assert distance(sandwich, (0, *turned_a)) <= 2 * 300 * EPS


@settings(deadline=None)
@given(vectors, vectors)
def test_vector_products_are_those_of_numpy(a, b):
    assert distance(kernels.cross(a, b), np.cross(a, b)) <= 200 * EPS
    assert abs(kernels.dot(a, b) - np.dot(a, b)) <= 600 * EPS
    assert kernels.cross(a, a) == (0, 0, 0)


@settings(deadline=None)
@given(rotation_vectors)
def test_the_exponential_turns_by_the_rotation_vector(rotation):
    q = kernels.exp_map(rotation)
    assert abs(math.hypot(*q) - 1) <= 4 * EPS
    # The half angle ≤ 2.6 is rounded by 3 EPS of itself; then sine, cosine and two products.
    expected = Rotation.from_rotvec(rotation).as_quat()[[3, 0, 1, 2]]
    expected *= math.copysign(1, float(np.dot(expected, q)))
    assert distance(q, expected) <= 16 * EPS


@settings(deadline=None)
@given(rotation_vectors, st.floats(-1, 1), st.floats(-1, 1))
def test_rotations_about_one_axis_add(rotation, s, t):
    one, two, both = (kernels.exp_map(tuple(float(a * f) for a in rotation)) for f in (s, t, s + t))
    # Three half angles ≤ 5.2, each good to 4 EPS of itself, and a product of unit quaternions.
    assert distance(kernels.multiply(one, two), both) <= 80 * EPS


@pytest.mark.parametrize("half", [0.0, 5e-324, 1e-200, 1e-9, 9.999999e-5, 1e-4, 1.000001e-4, 1e-3])
def test_the_exponential_has_no_seam_between_series_and_quotient(half):
    axis = np.array([2, -3, 6]) / 7
    q = kernels.exp_map(tuple(2 * half * axis))
    assert q[0] == pytest.approx(math.cos(half), rel=2 * EPS)
    # Squares of what is below 1e-154 vanish: the series is then sin(x)/x = 1 to rounding, which it is.
    assert np.allclose(q[1:], math.sin(half) * axis, rtol=8 * EPS, atol=5e-324)


@pytest.mark.parametrize("angle", [1e-300, 1e-12, 1e-8, 1e-3, 1.0, 3.0])
def test_the_orientation_error_of_the_oracle_sees_small_angles(angle):
    start = np.array([0.5, -0.5, 0.5, 0.5])
    turned = kernels.multiply(tuple(start), kernels.exp_map((angle * 0.6, 0.0, angle * 0.8)))
    # Products of the quaternions round parts of size 1/2, so that the angle is good to a few EPS absolute.
    assert abs(orientation_error(start, turned) - angle) <= 8 * EPS
    assert abs(orientation_error(start, np.negative(turned)) - angle) <= 8 * EPS
