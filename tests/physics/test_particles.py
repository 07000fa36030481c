"""Particle systems: state vector, totals, and a rigid body as n particles."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from physics.analysis import particles
from physics.mass import inertia

EPS = np.finfo(float).eps

coordinates = st.floats(-10, 10)
vectors = st.tuples(coordinates, coordinates, coordinates).map(np.array)
clouds = st.integers(1, 8).flatmap(
    lambda n: st.tuples(
        st.lists(vectors, min_size=n, max_size=n).map(np.array),
        st.lists(vectors, min_size=n, max_size=n).map(np.array),
        st.lists(st.floats(0.1, 10), min_size=n, max_size=n).map(np.array),
    )
)
# The largest sum below is of 8 terms m r v ≤ 10 · 35 · 35 (arms and velocities of ≤ 20 √3), each of
# two rounded products and differences: 8 terms · (8 + 6) roundings of EPS/2 each.
ROUNDING = 56 * EPS * 10 * 35 * 35

# A block as eight particles at ±edge / (2 √3): the second moments of the solid block.
CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
BLOCK = CORNERS * np.array([5, 3, 2]) / (2 * np.sqrt(3))
BLOCK_MASSES = np.full(8, 6 / 8)


@settings(deadline=None)
@given(clouds)
def test_the_state_vector_is_particle_by_particle_and_comes_apart_again(cloud):
    positions, velocities, _ = cloud
    state = particles.pack(positions, velocities)
    assert state.shape == (6 * len(positions),)
    assert np.array_equal(state[:6], [*positions[0], *velocities[0]])
    for back, given_ in zip(particles.unpack(state), (positions, velocities)):
        assert np.array_equal(back, given_)


@settings(deadline=None)
@given(clouds, vectors)
def test_the_derivative_is_velocity_and_force_over_mass(cloud, field):
    positions, velocities, masses = cloud
    rate = particles.derivative(particles.pack(positions, velocities), particles.uniform_field(masses, field), masses)
    x_rate, v_rate = particles.unpack(rate)
    assert np.array_equal(x_rate, velocities)
    assert np.abs(v_rate - field).max() <= EPS * 10


def test_shapes_that_are_no_state_are_refused():
    with pytest.raises(ValueError, match=r"\(7,\); allowed is \(6n,\)"):
        particles.unpack(np.zeros(7))
    with pytest.raises(ValueError, match=r"\(2, 3\) and \(3, 3\); allowed is \(n, 3\)"):
        particles.pack(np.zeros((2, 3)), np.zeros((3, 3)))


@settings(deadline=None)
@given(clouds, vectors)
def test_a_uniform_field_has_no_torque_about_the_centre_of_mass(cloud, field):
    positions, _, masses = cloud
    centre = inertia.point_cloud(positions, masses).centre
    force, torque = particles.total_wrench(positions, particles.uniform_field(masses, field), centre)
    assert np.abs(force - masses.sum() * field).max() <= ROUNDING
    assert np.abs(torque).max() <= ROUNDING


@settings(deadline=None)
@given(clouds, vectors, vectors)
def test_torque_about_another_point_differs_by_the_arm_times_the_force(cloud, a, b):
    positions, forces, _ = cloud
    force, about_a = particles.total_wrench(positions, forces, a)
    _, about_b = particles.total_wrench(positions, forces, b)
    assert np.abs(about_b - about_a - np.cross(a - b, force)).max() <= ROUNDING


@settings(deadline=None)
@given(clouds, vectors)
def test_koenig_splits_angular_momentum_and_energy_into_centre_and_spin(cloud, about):
    positions, velocities, masses = cloud
    body = particles.as_rigid_body(positions, velocities, masses)
    orbit = np.cross(body.mass_properties.centre - about, body.momentum)
    total = particles.total_angular_momentum(masses, positions, velocities, about)
    # n masses in P times an arm: 8 times the bound of one term.
    assert np.abs(total - orbit - body.angular_momentum).max() <= 8 * ROUNDING
    inner = particles.kinetic_energy(masses, velocities - body.linvel)
    outer = body.mass_properties.mass * (body.linvel @ body.linvel) / 2
    assert abs(particles.kinetic_energy(masses, velocities) - inner - outer) <= ROUNDING


@settings(deadline=None)
@given(vectors, vectors, vectors)
def test_a_rigidly_moving_cloud_is_the_rigid_body(centre, linvel, angvel):
    positions = BLOCK + centre
    velocities = particles.rigid_velocities(positions, centre, linvel, angvel)
    body = particles.as_rigid_body(positions, velocities, BLOCK_MASSES)
    tensor = inertia.block((5, 3, 2), 6)
    # 8 terms m r² with r ≤ 13 from the origin; L = I ω with ω ≤ 17, and ω = I⁻¹ L with I ≥ 6.5.
    assert np.abs(body.mass_properties.inertia - tensor).max() <= 60 * EPS * 13**2
    assert np.abs(body.linvel - linvel).max() <= 60 * EPS * 60
    assert np.abs(body.angular_momentum - tensor @ angvel).max() <= 60 * EPS * 13**2 * 17
    assert np.abs(body.angvel - angvel).max() <= 60 * EPS * 13**2 * 17 / 6.5
    energy = 3 * linvel @ linvel + angvel @ tensor @ angvel / 2
    assert particles.kinetic_energy(BLOCK_MASSES, velocities) == pytest.approx(energy, abs=60 * EPS * 6 * 60**2)


def test_particles_on_one_line_have_no_angular_velocity():
    positions = np.array([[0.1, 0.2, 0.3]]) * np.arange(3)[:, None]
    body = particles.as_rigid_body(positions, np.zeros((3, 3)), np.ones(3))
    with pytest.raises(ValueError, match=r"mass_properties\.inertia is (.|\n)* greater than 0"):
        _ = body.angvel


def test_semi_implicit_steps_of_free_particles_conserve_what_a_uniform_field_leaves():
    rng = np.random.default_rng(5)
    positions, velocities, masses = rng.normal(size=(4, 3)), rng.normal(size=(4, 3)), rng.uniform(1, 2, 4)
    g, h, n = np.array([0, -9.81, 0]), 0.01, 100
    forces = particles.uniform_field(masses, g)
    state = particles.pack(positions, velocities)
    before = particles.as_rigid_body(positions, velocities, masses)
    for _ in range(n):
        x, v = particles.unpack(state)
        v = v + h * particles.unpack(particles.derivative(state, forces, masses))[1]
        state = particles.pack(x + h * v, v)
    x, v = particles.unpack(state)
    after = particles.as_rigid_body(x, v, masses)
    # Discrete closed forms: v_n = v_0 + n h g, x_n = x_0 + n h v_0 + n (n + 1) h² g / 2.
    # 100 additions to numbers below 10: 100 · EPS/2 · 10 in v, the same again and h · 100 of that in x.
    assert np.abs(v - velocities - n * h * g).max() <= 500 * EPS
    assert np.abs(x - positions - n * h * velocities - n * (n + 1) / 2 * h**2 * g).max() <= 1000 * EPS
    # The football in flight keeps its spin about the centre of mass.
    # L = Σ m r x v with m ≤ 2, |v| ≤ 12 and r good to 1000 EPS.
    assert np.abs(after.angular_momentum - before.angular_momentum).max() <= 4 * 2 * 12 * 1000 * EPS
    # A step changes E by -m h² g²/2 and h m g·v/2 by +m h² g²/2: their sum, the shadow energy, stays.
    shadow = [
        particles.kinetic_energy(masses, b)
        + particles.potential_energy(masses, a, g)
        + h / 2 * particles.total_momentum(masses, b) @ g
        for a, b in ((positions, velocities), (x, v))
    ]
    assert abs(shadow[1] - shadow[0]) <= 6 * 10 * 1000 * EPS * 12
