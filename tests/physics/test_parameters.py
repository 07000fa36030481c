"""Per-world parameters: a batch at once gives what one world alone gets, and what the scene's own bodies get."""

from __future__ import annotations

import numpy as np
import pytest

import physics
from physics import scenes
from physics.mass import inertia

WORLDS = 40
TILTED = np.array([[6.0, 0.5, 0.2], [0.5, 8.0, 0.1], [0.2, 0.1, 9.0]])
BODIES = (
    physics.Block((5, 3, 2), 6.0, pos=(0, 9, 0)),
    physics.Block((5, 3, 2), 6.0, pos=(0, 9, 0), inertia_body=TILTED),
    physics.Ellipsoid((1, 2, 3), 2.0, pos=(0, 9, 0)),
    physics.Sphere(1.3, 2.1, pos=(0, 9, 0)),
)


def make(worlds, bodies=BODIES):
    effects = [physics.Gravity(), physics.Contact(0.2, between_bodies=False), physics.Friction(0.5)]
    return physics.World(physics.Scene(bodies, physics.three_walls(), effects), worlds=worlds)


@pytest.fixture
def drawn(rng):
    """Masses, sizes and tensors of every body in every world; spheres have equal diameters."""
    shape = (WORLDS, len(BODIES))
    size = rng.uniform(1, 5, (*shape, 3))
    size[:, 3] = size[:, 3, :1]
    return {
        "mass": rng.uniform(1, 9, shape),
        "size": size,
        "inertia_body": TILTED * rng.uniform(0.5, 2, (*shape, 1, 1)),
    }


@pytest.mark.parametrize("fields", [("mass",), ("size",), ("mass", "size"), ("mass", "size", "inertia_body")])
def test_a_batch_at_once_gets_what_its_worlds_get_alone(drawn, fields):
    batch = make(WORLDS)
    batch.set_parameters(**{field: drawn[field] for field in fields})
    for world in range(WORLDS):
        alone = make(1)
        alone.set_parameters(**{field: drawn[field][world : world + 1] for field in fields})
        rows = slice(world * len(BODIES), (world + 1) * len(BODIES))
        np.testing.assert_array_equal(batch.params[rows], alone.params)


def test_parameters_set_are_those_of_a_scene_with_such_bodies(drawn):
    """To the bit, for bodies of uniform density."""
    size, mass = drawn["size"][0], drawn["mass"][0]
    bodies = (
        physics.Block(tuple(size[0]), mass[0], pos=(0, 9, 0)),
        physics.Ellipsoid(tuple(0.5 * size[2]), mass[2], pos=(0, 9, 0)),
        physics.Sphere(0.5 * size[3, 0], mass[3], pos=(0, 9, 0)),
    )
    world = make(1, (BODIES[0], *BODIES[2:]))
    world.set_parameters(mass=mass[None, [0, 2, 3]], size=size[None, [0, 2, 3]])
    np.testing.assert_array_equal(world.params, make(1, bodies).params)


def test_a_body_with_its_own_inertia_scales_it_with_the_mass(drawn):
    world = make(WORLDS)
    world.set_parameters(mass=drawn["mass"], size=drawn["size"])
    at = physics.kernels.state.layout
    moments = 1 / world.params[1 :: len(BODIES), at.INV_INERTIA : at.INV_INERTIA + 3]
    expected = inertia.principal_axes(TILTED)[0] * (drawn["mass"][:, 1] / 6.0)[:, None]
    np.testing.assert_allclose(moments, expected, rtol=4 * np.finfo(float).eps)  # a quotient, a product, two inverses


def test_stacked_moments_are_those_of_the_table(drawn):
    for size, mass in zip(drawn["size"][:, 0], drawn["mass"][:, 0]):
        assert np.array_equal(np.diag(inertia.block_moments(size, mass)), inertia.block(size, mass))
        assert np.array_equal(np.diag(inertia.ellipsoid_moments(size, mass)), inertia.solid_ellipsoid(size, mass))
    stacked = inertia.block_moments(drawn["size"], drawn["mass"])
    assert np.array_equal(stacked[3, 1], np.diag(inertia.block(drawn["size"][3, 1], drawn["mass"][3, 1])))


@pytest.mark.parametrize(
    ("bodies", "change", "message"),
    [
        (BODIES[3:], {"size": (1.0, 1.0, 2.0)}, r"size is \[1.0, 1.0, 2.0\] for a sphere.*equal diameters"),
        (BODIES[3:], {"inertia_body": np.diag([1.0, 2.0, 2.5])}, "inertia becomes .*isotropic"),
        (BODIES[:1], {"inertia_body": TILTED}, "inertia becomes .*aligned with their axes"),
    ],
)
def test_what_the_kernel_leaves_out_is_refused_and_changes_nothing(bodies, change, message):
    world = make(3, bodies)
    before = world.params.copy()
    with pytest.raises(ValueError, match=message):
        world.set_parameters(**change, worlds=[1, 2])
    np.testing.assert_array_equal(world.params, before)


def test_no_worlds_chosen_changes_nothing():
    world = physics.World(scenes.rest(), worlds=2, dt=0.005)
    before = world.params.copy()
    world.set_parameters(mass=np.zeros((0, 1)), inertia_body=np.zeros((0, 1, 3, 3)), worlds=[])
    np.testing.assert_array_equal(world.params, before)
