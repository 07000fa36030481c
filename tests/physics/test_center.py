"""A block whose centre of mass is not its geometric centre, against bodies and laws that know nothing of `center`."""

from __future__ import annotations

import math

import numpy as np
import pytest

import physics
from physics.analysis.resting_contact import resting_contact
from physics.work_precision.errors import deepest_penetration, distances
from rigid_env.rendering.picture import world_frame
from tests.reference import hybrid
from tests.reference.rigid_body import rotation_matrix

pytestmark = pytest.mark.interpreted

G = 9.81
CENTER = (0.1, -0.2, 0.05)
SIZE, MASS = np.array([2.0, 1.0, 1.0]), 2.0
INERTIA = np.array([[1.0, 0.1, 0.05], [0.1, 1.3, -0.1], [0.05, -0.1, 0.9]])
QUAT = np.array([0.8, 0.3, 0.1, 0.5]) / np.linalg.norm([0.8, 0.3, 0.1, 0.5])
SIGNS = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
CORNERS = SIGNS * SIZE / 2 + CENTER  # from the centre of mass, body axes
FLOOR = [physics.HalfSpace((0, 1, 0))]

END = 0.85  # [s]; corners hit at 0.35, 0.43, 0.67 and 0.72, the next at 0.90

schemes = pytest.mark.parametrize("accuracy", ["balanced", "precise"])


def block(center=CENTER, inertia_body=INERTIA, **state):
    return physics.Block(size=SIZE, mass=MASS, center=center, inertia_body=inertia_body, **state)


def scene(restitution=0.5, friction=0.5, gravity=(0, -G, 0), body=None, **state):
    effects = [physics.Gravity(gravity), physics.Contact(restitution), physics.Friction(friction)]
    return physics.Scene([body or block(**state)], FLOOR, effects)


# flight


def cloud(rng):
    """Masses (n,), and their places (n, 3) from the middle of the block that they are in."""
    return rng.uniform(0.1, 1.0, 12), rng.uniform(-0.5, 0.5, (12, 3)) * SIZE


@schemes
def test_flies_as_the_masses_in_it_do(accuracy, rng):
    """Momentum and angular momentum about the origin, summed over the masses in the block, change as gravity says."""
    masses, places = cloud(rng)
    heavy = masses @ places / masses.sum()
    arms = places - heavy
    tensor = sum(m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in zip(masses, arms))
    body = physics.Block(
        size=SIZE, mass=masses.sum(), center=-heavy, inertia_body=tensor, pos=(1, 50, -2), quat=QUAT,
        linvel=(2, 3, -1), angvel=(1, -2, 3),
    )  # fmt: skip
    path = physics.simulate(scene(body=body), 1.0, accuracy, sample_dt=0.05)

    def momenta(k):
        r = arms @ rotation_matrix(path.quat[k, 0]).T
        p = masses[:, None] * (path.linvel[k, 0] + np.cross(path.angvel[k, 0], r))
        return p.sum(axis=0), np.cross(path.pos[k, 0] + r, p).sum(axis=0)

    gravity = np.array([0, -G, 0])
    start, velocity = path.pos[0, 0], path.linvel[0, 0]
    p0, L0 = momenta(0)
    p, L = momenta(-1)
    # weight's torque about the origin over 1 s: m ∫ (x₀ + v₀ t + ½ g t²) x g dt; 20 steps of some roundings of 500
    np.testing.assert_allclose(p, p0 + masses.sum() * gravity, rtol=0, atol=1e-11)
    np.testing.assert_allclose(L, L0 + masses.sum() * np.cross(start + velocity / 2, gravity), rtol=0, atol=1e-10)
    np.testing.assert_allclose(path.pos[-1, 0], start + velocity + gravity / 2, rtol=1e-13)


# contact


def test_gap_is_that_of_the_shifted_block():
    # lowest face at pos_y + center_y - 1/2
    assert physics.diagnose(physics.World(scene(pos=(0, 5, 0)))).gap[0, 0] == pytest.approx(4.3, rel=1e-15)
    tilted = physics.diagnose(physics.World(scene(pos=(0, 5, 0), quat=QUAT))).gap[0, 0]
    assert tilted == pytest.approx(5 + (CORNERS @ rotation_matrix(QUAT).T)[:, 1].min(), rel=1e-14)


@schemes
def test_rests_with_its_weight_split_by_the_lever_arms(accuracy):
    # The face's edges are at center ± half the size from the centre of mass, which carries the weight.
    world = physics.World(scene(pos=(0, 0.7, 0)), accuracy=accuracy)
    for _ in range(50):
        report = world.step()
    assert report.ok
    np.testing.assert_allclose(world.pos[0, 0], (0, 0.7, 0), atol=1e-5)
    points, forces = world.contacts()
    assert len(points) == 4
    weight = MASS * G
    # 1e-5: the tolerance of `balanced` in contact speed, 1e-6, and its slop of 1e-5 radii
    np.testing.assert_allclose(forces.sum(axis=0), (0, weight, 0), atol=1e-5 * weight)
    for axis in (0, 2):
        half = SIZE[axis] / 2
        share = forces[points[:, axis] > 0, 1].sum() / weight
        assert share == pytest.approx((half - CENTER[axis]) / (2 * half), abs=1e-5)
    np.testing.assert_allclose(np.cross(points - world.pos[0, 0], forces).sum(axis=0), 0.0, atol=1e-4 * weight)


def test_course_notes_problem_has_the_shifted_arms():
    found = resting_contact(physics.World(scene(pos=(0, 0.7, 0))))
    assert found.forces.sum() == pytest.approx(MASS * G, rel=1e-12)
    np.testing.assert_allclose(found.forces @ found.points, (0, 0, 0), atol=1e-12)


@schemes
@pytest.mark.parametrize("side", [-1, 1])
def test_tips_when_gravity_points_past_the_edge_and_not_before(accuracy, side):
    """Gravity leans by θ; the centre of mass is 0.7 above the face and 1 ± 0.1 m beside its edges."""
    reach, height = 1.0 + side * CENTER[0], 0.5 - CENTER[1]
    for share, tips in ((0.999, False), (1.001, True)):
        angle = math.atan(share * reach / height)
        gravity = (side * G * math.sin(angle), -G * math.cos(angle), 0)
        body = block(pos=(0, height, 0), inertia_body=(1.0, 1.3, 0.9))
        path = physics.simulate(scene(friction=5.0, gravity=gravity, body=body), 0.5, accuracy, sample_dt=0.01)
        if tips:
            # α = m g_n (0.001 reach) / (I + m r²) at the edge, and growing
            alpha = MASS * -gravity[1] * 0.001 * reach / (0.9 + MASS * (reach**2 + height**2))
            assert -side * path.angvel[-1, 0, 2] > 0.5 * alpha
        else:
            np.testing.assert_allclose(path.angvel[-1, 0], 0.0, atol=1e-9)


@schemes
def test_one_vertex_hits_with_the_impulse_of_the_shifted_arm(accuracy):
    """Without friction, gravity and turning before it: j = -(1 + e) u_n / (1/m + (r x n)·I⁻¹(r x n))."""
    speed, e = -3.0, 0.4
    effects = [physics.Contact(e)]
    falling = block(pos=(0, 2, 0), quat=QUAT, linvel=(0.5, speed, 0))
    world = physics.World(physics.Scene([falling], FLOOR, effects), dt=1e-3, accuracy=accuracy)
    while not world.step().impacts[0]:
        assert world.time < 1.0
    R = rotation_matrix(QUAT)
    arms, n = CORNERS @ R.T, np.array([0, 1, 0])
    arm = arms[np.argmin(arms[:, 1])]
    inverse = R @ np.linalg.inv(INERTIA) @ R.T
    lever = np.cross(arm, n)
    j = -(1 + e) * speed / (1 / MASS + lever @ inverse @ lever)
    # the tolerance of `balanced`, 1e-6 of the contact speed; ω turns with the body for the rest of the step
    np.testing.assert_allclose(world.linvel[0, 0], (0.5, speed + j / MASS, 0), atol=1e-5)
    np.testing.assert_allclose(physics.diagnose(world).angular_momentum[0, 0], j * lever, atol=1e-5)
    np.testing.assert_allclose(world.angvel[0, 0], j * inverse @ lever, atol=0.1)


@pytest.mark.parametrize(("accuracy", "tolerance"), [("balanced", 1e-5), ("precise", 1e-9)])
def test_tumbles_as_the_independent_reference_does(accuracy, tolerance):
    """Flight and four corner impacts with friction, before the first sequence of ever smaller bounces."""
    tumbling = scene(restitution=0.3, pos=(0, 2, 0), quat=QUAT, linvel=(1, -1, 0.3), angvel=(0.2, 1.1, -2.4))
    problem, y = hybrid.from_scene(tumbling)
    np.testing.assert_allclose(np.sort(problem.points, axis=0), np.sort(CORNERS, axis=0))
    true = hybrid.simulate(problem, y, END)
    assert [event.kind for event in true.events] == ["impact"] * 4
    path = physics.simulate(tumbling, END, accuracy, sample_dt=0.01)
    np.testing.assert_allclose(path.pos[-1, 0], true.y[:3], rtol=0, atol=tolerance)
    assert abs(path.quat[-1, 0] @ true.y[3:7]) == pytest.approx(1.0, abs=tolerance)
    np.testing.assert_allclose(path.linvel[-1, 0], true.y[7:10], rtol=0, atol=10 * tolerance)
    np.testing.assert_allclose(path.angvel[-1, 0], true.y[10:13], rtol=0, atol=10 * tolerance)


# around it


@schemes
def test_an_uneven_neighbour_changes_no_bit_of_an_even_block(accuracy):
    """The even block runs through the kernel that adds an offset, of 0."""
    even = block(center=(0, 0, 0), inertia_body=(1.0, 1.3, 0.9), pos=(0, 2, 0), quat=QUAT, angvel=(1, 2, -1))
    effects = [physics.Gravity(), physics.Contact(0.3, between_bodies=False), physics.Friction(0.4)]
    worlds = [
        physics.World(physics.Scene(bodies, FLOOR, effects), accuracy=accuracy)
        for bodies in ([even], [even, block(pos=(9, 3, 0))])
    ]
    for world in worlds:
        for _ in range(100):
            world.step()
    assert worlds[0].pos[0, 0].tobytes() == worlds[1].pos[0, 0].tobytes()
    assert worlds[0].quat[0, 0].tobytes() == worlds[1].quat[0, 0].tobytes()


def test_a_new_size_keeps_the_center():
    world = physics.World(scene(pos=(0, 5, 0)))
    world.set_parameters(size=(4.0, 2.0, 2.0))
    assert physics.diagnose(world).gap[0, 0] == pytest.approx(5.0 - 0.2 - 1.0, rel=1e-15)


def test_pictures_and_error_measures_have_the_block_where_it_is():
    world = physics.World(scene(pos=(0, 5, 0), quat=QUAT))
    shown = world_frame(world).bodies[0]
    R = rotation_matrix(QUAT)
    np.testing.assert_allclose(shown.pos, (0, 5, 0) + R @ CENTER, rtol=1e-14)
    pos, quat = world.pos.copy(), world.quat.copy()
    pos[0, 0, 1] = 0.1 - (CORNERS @ R.T)[:, 1].min() - 0.3  # 0.2 deep
    assert deepest_penetration(world.scene, pos, quat) == pytest.approx(0.2, rel=1e-12)
    # half a turn about an axis: a corner moves by at most twice its distance from the centre of mass
    bound = distances(world.scene, pos, np.array([[[1.0, 0, 0, 0]]]), pos, np.array([[[0, 0, 0, 1.0]]]))[0, 0]
    assert bound >= 2 * np.linalg.norm(CORNERS, axis=1).max()


def test_without_its_inertia_it_is_refused():
    with pytest.raises(ValueError, match="center is"):
        physics.Block(size=(1, 1, 1), mass=1.0, center=(0.1, 0, 0))
