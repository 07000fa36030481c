"""A block whose centre of mass is not its centre."""

import numpy as np
import pytest

import physics

CENTER = (0.1, -0.2, 0.05)
INERTIA = (1.0, 1.3, 0.9)


def scene(pos=(0, 5, 0), **state):
    block = physics.Block(size=(2, 1, 1), mass=2.0, center=CENTER, inertia_body=INERTIA, pos=pos, **state)
    effects = [physics.Gravity(), physics.Contact(restitution=0.5), physics.Friction(0.5)]
    return physics.Scene([block], [physics.HalfSpace((0, 1, 0))], effects)


def test_gap_is_that_of_the_shifted_block():
    # lowest face at pos_y + center_y - 1/2
    gap = physics.diagnose(physics.World(scene())).gap[0, 0]
    assert gap == pytest.approx(5.0 - 0.2 - 0.5, rel=1e-15)


def test_at_rest_on_its_face_it_stays_and_its_weight_is_over_its_centre_of_mass():
    world = physics.World(scene(pos=(0, 0.7, 0)))
    for _ in range(50):
        report = world.step()
    assert report.ok
    np.testing.assert_allclose(world.pos[0, 0], (0, 0.7, 0), atol=1e-5)
    points, forces = world.contacts()
    np.testing.assert_allclose(forces.sum(axis=0), (0, 2.0 * 9.81, 0), rtol=1e-5, atol=1e-5)
    # the solve's tolerance, 1e-6 of the contact speed, in torque
    np.testing.assert_allclose(np.cross(points - world.pos[0, 0], forces).sum(axis=0), 0.0, atol=1e-3)


def test_one_vertex_hits_and_leaves_by_newtons_law_about_the_centre_of_mass():
    quat = np.array([0.8, 0.3, 0.1, 0.5]) / np.linalg.norm([0.8, 0.3, 0.1, 0.5])
    world = physics.World(scene(quat=quat, linvel=(0, -3, 0), angvel=(0.2, 0.1, -0.4)), dt=1e-3, accuracy="precise")
    corners = np.array([[i, j, k] for i in (-1, 1) for j in (-0.5, 0.5) for k in (-0.5, 0.5)]) + CENTER

    def lowest_speed():
        w, x, y, z = world.quat[0, 0]
        row = np.array([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)])
        R = np.array([
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], row,
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ])  # fmt: skip
        arms = corners @ R.T
        arm = arms[np.argmin(arms[:, 1])]
        return (world.linvel[0, 0] + np.cross(world.angvel[0, 0], arm))[1]

    before = lowest_speed()
    while not world.step().impacts[0]:
        before = lowest_speed()
    # half a millisecond of gravity and turning on each side: 0.02 of 8 m/s
    assert lowest_speed() == pytest.approx(-0.5 * before, rel=1e-2)


def test_without_its_inertia_it_is_refused():
    with pytest.raises(ValueError, match="center is"):
        physics.Block(size=(1, 1, 1), mass=1.0, center=(0.1, 0, 0))
