"""Mass properties: the table against quadrature, the algebra against clouds of particles, the errors."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from physics.mass import inertia
from physics.mass.inertia import MassProperties, check_inertia, compose, parallel_axis, point_cloud, principal_axes

EPS = np.finfo(float).eps
# Clouds below sum at most 100 terms of one sign; each addition rounds by EPS/2 and the products by 3 EPS.
CLOUD = 60 * EPS

lengths = st.floats(0.01, 100)
masses = st.floats(1e-3, 1e3)
vectors = st.tuples(*[st.floats(-10, 10)] * 3).map(np.array)


def rotation(rotvec: np.ndarray) -> np.ndarray:
    """Rotation matrix of a rotation vector, by Rodrigues' formula, orthonormal to rounding."""
    angle = np.linalg.norm(rotvec)
    if angle < 1e-6:
        return np.eye(3)
    x, y, z = rotvec / angle
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + 2 * np.sin(angle / 2) ** 2 * (K @ K)


def gauss(low: float, high: float, n: int = 4) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Legendre points and weights, of sum 2: exact for polynomials of degree 2n - 1."""
    x, w = np.polynomial.legendre.leggauss(n)
    return (low + high) / 2 + (high - low) / 2 * x, w


def radii(inner: float, outer: float, power: int) -> tuple[np.ndarray, np.ndarray]:
    """Quadrature over r^power dr; one radius for a wall without thickness."""
    if inner == outer:
        return np.array([outer]), np.array([1.0])
    r, w = gauss(inner, outer)
    return r, w * r**power


def block_cloud(size: tuple, mass: float) -> MassProperties:
    """Particles with exactly the second moments of a block."""
    rules = [gauss(-a / 2, a / 2, 2) for a in size]
    points = np.stack(np.meshgrid(*[x for x, _ in rules], indexing="ij"), axis=-1).reshape(-1, 3)
    return point_cloud(points, np.full(8, mass / 8))


def ball_cloud(inner: float, outer: float, mass: float, semi_axes: tuple = (1, 1, 1)) -> MassProperties:
    """Particles with exactly the second moments of a spherical shell, stretched by `semi_axes`."""
    (r, wr), (cos, wc) = radii(inner, outer, 2), gauss(-1, 1, 3)
    phi = np.arange(4) * np.pi / 2
    r, cos, phi = np.meshgrid(r, cos, phi, indexing="ij")
    sin = np.sqrt(1 - cos**2)
    points = np.stack([r * sin * np.cos(phi), r * sin * np.sin(phi), r * cos], axis=-1).reshape(-1, 3)
    weights = (wr[:, None, None] * wc[None, :, None] * np.ones(4)).ravel()
    return point_cloud(points * semi_axes, mass * weights / weights.sum())


def tube_cloud(inner: float, outer: float, height: float, mass: float) -> MassProperties:
    """Particles with exactly the second moments of a tube along y."""
    (r, wr), (y, wy) = radii(inner, outer, 1), gauss(-height / 2, height / 2, 2)
    phi = np.arange(3) * 2 * np.pi / 3
    r, y, phi = np.meshgrid(r, y, phi, indexing="ij")
    points = np.stack([r * np.cos(phi), y, r * np.sin(phi)], axis=-1).reshape(-1, 3)
    weights = (wr[:, None, None] * wy[None, :, None] * np.ones(3)).ravel()
    return point_cloud(points, mass * weights / weights.sum())


def capsule_cloud(radius: float, length: float, mass: float) -> MassProperties:
    """Particles with exactly the second moments of a capsule along y: a cylinder, and a ball with its halves moved."""
    share = length / (length + 4 / 3 * radius)
    (r, wr), (cos, wc) = radii(0.0, radius, 2), gauss(0, 1, 3)
    phi = np.arange(4) * np.pi / 2
    r, cos, phi = np.meshgrid(r, cos, phi, indexing="ij")
    across = r * np.sqrt(1 - cos**2)
    weights = np.tile((wr[:, None, None] * wc[None, :, None] * np.ones(4)).ravel(), 2)
    halves = [
        np.stack([across * np.cos(phi), side * (r * cos + length / 2), across * np.sin(phi)], axis=-1).reshape(-1, 3)
        for side in (1, -1)
    ]
    ball = point_cloud(np.concatenate(halves), (1 - share) * mass * weights / weights.sum())
    return compose([tube_cloud(0, radius, length, share * mass), ball])


def same(a: np.ndarray, b: np.ndarray, tolerance: float = CLOUD) -> bool:
    """Equal up to `tolerance` of the largest entry."""
    return np.abs(a - b).max() <= tolerance * np.abs(b).max()


@pytest.mark.parametrize(
    ("tensor", "cloud"),
    [
        (inertia.block((5, 3, 2), 6), block_cloud((5, 3, 2), 6)),
        (inertia.solid_sphere(1.5, 4), ball_cloud(0, 1.5, 4)),
        (inertia.hollow_sphere(1.5, 4), ball_cloud(1.5, 1.5, 4)),
        (inertia.hollow_sphere(1.5, 4, 0.7), ball_cloud(0.7, 1.5, 4)),
        (inertia.solid_ellipsoid((1, 2, 3.5), 5), ball_cloud(0, 1, 5, (1, 2, 3.5))),
        (inertia.solid_cylinder(0.5, 3, 2), tube_cloud(0, 0.5, 3, 2)),
        (inertia.solid_capsule(0.5, 3, 2), capsule_cloud(0.5, 3, 2)),
        (inertia.hollow_cylinder(0.5, 3, 2), tube_cloud(0.5, 0.5, 3, 2)),
        (inertia.hollow_cylinder(0.5, 3, 2, 0.2), tube_cloud(0.2, 0.5, 3, 2)),
        (inertia.disk(2, 3), tube_cloud(0, 2, 0, 3)),
        (inertia.rod(4, 3), tube_cloud(0, 0, 4, 3)),
    ],
)
def test_table_is_the_quadrature_of_the_shape(tensor, cloud):
    assert same(tensor, cloud.inertia)


def test_the_block_it_all_starts_from():
    assert np.array_equal(inertia.block((5, 3, 2), 6), np.diag([6.5, 14.5, 17]))


def test_textbook_values():
    assert same(inertia.solid_sphere(2, 5), np.diag([8.0] * 3), 4 * EPS)
    assert same(inertia.hollow_sphere(3, 5), np.diag([30.0] * 3), 4 * EPS)
    assert np.array_equal(inertia.disk(2, 3), np.diag([3.0, 6, 3]))
    assert np.array_equal(inertia.rod(2, 3), np.diag([1.0, 0, 1]))


@settings(deadline=None)
@given(lengths, masses)
def test_thin_walls_are_the_limit_of_thick_ones(radius, mass):
    # The moments are smooth in the inner radius: (1 - t) r moves them by less than 1.5 t, here 1e-12.
    inner = radius * (1 - 1e-12)
    thick, thin = inertia.hollow_sphere(radius, mass, inner), inertia.hollow_sphere(radius, mass)
    assert same(thick, thin, 2e-12)
    assert same(inertia.hollow_cylinder(radius, 1, mass, inner), inertia.hollow_cylinder(radius, 1, mass), 2e-12)


@settings(deadline=None)
@given(st.tuples(lengths, lengths, lengths), masses, st.floats(0.1, 0.9), st.integers(0, 2))
def test_a_block_is_its_two_pieces(size, mass, cut, axis):
    parts = []
    for share, sign in ((cut, -1), (1 - cut, 1)):
        piece = np.array(size) * np.where(np.arange(3) == axis, share, 1)
        pos = sign * (np.array(size) - piece) / 2 * (np.arange(3) == axis)
        part = MassProperties(mass * share, np.zeros(3), inertia.block(piece, mass * share))
        parts.append(part.placed(pos))
    whole = compose(parts)
    assert whole.mass == pytest.approx(mass, rel=2 * EPS)
    assert np.abs(whole.centre).max() <= 4 * EPS * max(size)
    assert same(whole.inertia, inertia.block(size, mass), 20 * EPS)


@settings(deadline=None)
@given(st.lists(st.tuples(vectors, masses), min_size=2, max_size=6), vectors, vectors)
def test_composition_of_placed_clouds_is_the_cloud_of_all(particles, pos, rotvec):
    positions, weights = np.array([p for p, _ in particles]), np.array([m for _, m in particles])
    R = rotation(rotvec)
    first = point_cloud(positions, weights)
    joined = compose([first, first.placed(pos, R)])
    everything = point_cloud(np.vstack([positions, positions @ R.T + pos]), np.concatenate([weights, weights]))
    # Coordinates reach 40 m, so that tensors lose EPS of M (40 m)² per term, of 12 terms.
    assert np.abs(joined.centre - everything.centre).max() <= 60 * EPS * 40
    assert np.abs(joined.inertia - everything.inertia).max() <= 60 * EPS * joined.mass * 40**2


@settings(deadline=None)
@given(st.lists(st.tuples(vectors, masses), min_size=1, max_size=6), vectors)
def test_parallel_axis_is_the_sum_about_the_other_point(particles, point):
    positions, weights = np.array([p for p, _ in particles]), np.array([m for _, m in particles])
    cloud = point_cloud(positions, weights)
    r = positions - point
    direct = sum(m * (a @ a * np.eye(3) - np.outer(a, a)) for m, a in zip(weights, r))
    moved = parallel_axis(cloud.inertia, cloud.mass, cloud.centre - point)
    assert np.abs(moved - direct).max() <= 60 * EPS * cloud.mass * 35**2


@settings(deadline=None)
@given(st.tuples(*[st.floats(1e-6, 1e6)] * 3))
def test_a_diagonal_tensor_is_left_alone_bit_for_bit(moments):
    found, R = principal_axes(np.diag(moments))
    assert np.array_equal(R, np.eye(3))
    assert np.array_equal(found, np.array(moments))


@settings(deadline=None)
@given(st.tuples(lengths, lengths, lengths), vectors)
def test_principal_axes_put_the_tensor_together_again(size, rotvec):
    tensor = inertia.rotate(inertia.block(size, 1), rotation(rotvec))
    moments, R = principal_axes(tensor)
    assert np.abs(R.T @ R - np.eye(3)).max() <= 20 * EPS
    assert np.linalg.det(R) > 0
    assert same(R @ np.diag(moments) @ R.T, tensor, 40 * EPS)
    assert same(np.sort(moments), np.sort(np.diag(inertia.block(size, 1))), 40 * EPS)


@settings(deadline=None)
@given(vectors.filter(lambda a: np.linalg.norm(a) > 0.1), st.floats(0, 0.7))
def test_the_axes_nearest_to_the_body_axes_are_chosen(direction, angle):
    # Two of the 24 frames are 90° or more apart: less than 45° away, the given one is the nearest.
    turn = rotation(direction / np.linalg.norm(direction) * angle)
    moments, R = principal_axes(inertia.rotate(np.diag([3.0, 1, 2]), turn))
    # Eigenvectors move by the rounding of the tensor over the gap of 1 between moments.
    assert np.abs(R - turn).max() <= 60 * EPS
    assert np.abs(moments - [3, 1, 2]).max() <= 60 * EPS


def test_a_turned_cube_keeps_its_body_axes():
    tensor = inertia.rotate(inertia.block((1, 1, 1), 6), rotation(np.array([0.3, -0.4, 0.5])))
    assert np.array_equal(principal_axes(tensor)[1], np.eye(3))


@settings(deadline=None)
@given(st.tuples(lengths, lengths, lengths), masses, vectors)
def test_every_block_is_a_body_however_it_is_turned(size, mass, rotvec):
    tensor = inertia.rotate(inertia.block(size, mass), rotation(rotvec))
    ratio = np.linalg.eigvalsh(inertia.block(size, mass))
    if ratio[0] > 1e-11 * ratio[2]:
        assert np.array_equal(check_inertia(tensor, "inertia_body"), tensor)


def test_flat_bodies_pass_the_triangle_inequality_as_an_equality():
    R = rotation(np.array([0.3, 1.1, -2]))
    flat = point_cloud(np.array([[1, 0, 0.3], [0, 0, 2], [-1, 0, 0], [0.2, 0, -1.7]]), [1, 2, 3, 0.1])
    for tensor in (inertia.disk(2, 3), flat.inertia, (0.1, 0.2, 0.1 + 0.2)):
        check_inertia(tensor, "inertia_body")
    check_inertia(flat.placed((1, 2, 3), R).inertia, "inertia_body")


def test_moments_may_stand_for_the_tensor():
    assert np.array_equal(check_inertia((6.5, 14.5, 17), "inertia_body"), np.diag([6.5, 14.5, 17]))


@pytest.mark.parametrize(
    ("value", "rule"),
    [
        ((1, 1, 2.001), "sum of the other two"),
        (np.diag([1, 3.001, 2]), "sum of the other two"),
        ((0, 1, 1), "greater than 0"),
        (inertia.rod(2, 3), "greater than 0"),
        (inertia.rotate(inertia.rod(2, 3), rotation(np.array([0.3, 0.4, 0.5]))), "greater than 0"),
        ((1, -1, 1), "greater than 0"),
        ((1, 1, np.nan), "finite"),
        ((1, np.inf, 1), "finite"),
        ([[1, 0.1, 0], [0, 1, 0], [0, 0, 1]], "symmetric"),
        ((1, 2), "shape"),
        ([[1], [2, 3]], "numbers"),
        ("heavy", "numbers"),
    ],
)
def test_what_is_no_inertia_is_named_with_its_value_and_the_rule(value, rule):
    with pytest.raises(ValueError, match=r"inertia_body is (.|\n)*allowed") as error:
        check_inertia(value, "inertia_body")
    assert rule in str(error.value)
    assert repr(value) in str(error.value)


@pytest.mark.parametrize("bad", [0, -1, np.nan, np.inf, "a", None])
@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda x: inertia.block((1, x, 1), 1), "size"),
        (lambda x: inertia.block((1, 1, 1), x), "mass"),
        (lambda x: inertia.solid_sphere(x, 1), "radius"),
        (lambda x: inertia.solid_ellipsoid((1, 1, x), 1), "semi_axes"),
        (lambda x: inertia.solid_cylinder(1, x, 1), "height"),
        (lambda x: inertia.disk(x, 1), "radius"),
        (lambda x: inertia.rod(x, 1), "length"),
        (lambda x: point_cloud([[0, 0, 0]], [x]), "masses"),
        (lambda x: MassProperties(x, np.zeros(3), np.eye(3)), "mass"),
    ],
)
def test_sizes_and_masses_are_finite_and_positive(make, field, bad):
    with pytest.raises(ValueError, match=f"^{field} is .*allowed"):
        make(bad)


def test_other_arguments_that_make_no_sense():
    with pytest.raises(ValueError, match=r"inner_radius is 1\.1; allowed"):
        inertia.hollow_sphere(1, 1, 1.1)
    with pytest.raises(ValueError, match=r"R is (.|\n)*allowed is a rotation matrix"):
        inertia.rotate(np.eye(3), np.diag([1, 1, -1]))
    with pytest.raises(ValueError, match="parts is empty"):
        compose([])
    with pytest.raises(ValueError, match="one particle or more"):
        point_cloud(np.empty((0, 3)), [])
    with pytest.raises(ValueError, match="masses is"):
        point_cloud(np.zeros((2, 3)), [1])


def test_mass_properties_cannot_be_changed():
    properties = point_cloud([[1, 0, 0], [0, 1, 0]], [1, 2])
    with pytest.raises(dataclasses.FrozenInstanceError):
        properties.mass = 2
    with pytest.raises(ValueError, match="read-only"):
        properties.inertia[0, 0] = 2
