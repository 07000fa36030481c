"""Bodies that touch each other: closed forms, balance of forces, conservation laws, determinism."""

from __future__ import annotations

import itertools
import pickle

import numpy as np
import pytest

import physics
from physics import scenes
from physics.kernels.multibody.data.arrays import NUM_PAIRS
from physics.world.report import Solver, Status
from tests.tiers.sweep import sweep

# Marked `compiled` are those whose kernels other tests need anyway: of towers, and of `heap`.
pytestmark = pytest.mark.interpreted

G = 9.81
FLOOR = [physics.HalfSpace((0, 1, 0))]
EPS = np.finfo(float).eps
CUBE = (1.0, 1.0, 1.0)


def tower(count, top=1.0, offset=0.0, seed=0):
    """Unit cubes of 1 kg on each other, the top one of another mass; `offset` is the largest shift of each [m]."""
    rng = np.random.default_rng(seed)
    masses = [1.0] * (count - 1) + [top]
    shifts = rng.uniform(-offset, offset, (count, 2))
    bodies = [physics.Block(CUBE, m, pos=(x, 0.5 + k, z)) for k, (m, (x, z)) in enumerate(zip(masses, shifts))]
    return physics.Scene(bodies, FLOOR, [physics.Gravity((0, -G, 0)), physics.Contact(), physics.Friction(0.5)])


def balls(positions, velocities, masses, restitution, walls=()):
    bodies = [physics.Sphere(0.5, m, pos=p, linvel=v) for p, v, m in zip(positions, velocities, masses)]
    return physics.World(physics.Scene(bodies, walls, [physics.Contact(restitution)]), dt=0.01)


def momenta(world):
    """Linear momentum, and angular momentum about the origin, of all bodies of world 0."""
    about = physics.diagnose(world)
    p, spin = about.momentum[0], about.angular_momentum[0]
    return p.sum(axis=0), (np.cross(world.pos[0], p) + spin).sum(axis=0)


# --- impacts: closed forms -------------------------------------------------------------------------------------


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("mass", [1.0, 3.0, 1e6])
def test_head_on_impact(restitution, mass):
    world = balls([(-2, 0, 0), (0.3, 0, 0)], [(4, 0, 0), (-1, 0, 0)], [1.0, mass], restitution)
    world.step(steps=60)
    # Momentum, and Newton's law: the relative velocity 5 m/s becomes -5 e. One contact is answered in closed form.
    common = (4 - mass) / (1 + mass)
    expected = [common - 5 * restitution * mass / (1 + mass), common + 5 * restitution / (1 + mass)]
    np.testing.assert_allclose(world.linvel[0, :, 0], expected, rtol=1e-12, atol=1e-12)
    assert not world.linvel[0, :, 1:].any()


def test_oblique_impact_turns_along_the_line_of_centres():
    world = balls([(-3, 0, 0), (0, 0.6, 0)], [(5, 0, 0), (0, 0, 0)], [1.0, 1.0], 1.0)
    world.step(steps=100)
    # At the impact the centres are 1 m apart: the line between them rises by asin(0.6). Equal masses: the struck ball
    # takes all of the velocity along it. The place of the impact is off by up to the slop, 5e-7 m, so the line by
    # 5e-7/0.8 rad.
    along = 5 * 0.8
    np.testing.assert_allclose(world.linvel[0, 1], (along * 0.8, along * 0.6, 0), atol=5 * 1e-6)
    np.testing.assert_allclose(world.linvel[0].sum(axis=0), (5, 0, 0), atol=1e-12)
    assert physics.diagnose(world).energy.sum() == pytest.approx(12.5, rel=1e-12)


@pytest.mark.parametrize("restitution", [0.2, 0.7])
@pytest.mark.parametrize("ball_first", [True, False])
@pytest.mark.parametrize("shape", ["block", "hull"])
def test_a_ball_turns_the_block_that_it_hits_off_centre(restitution, ball_first, shape):
    v, offset, mass, moment = 3.0, 0.6, 5.0, 5.0 * (1.0**2 + 2.0**2) / 12
    ball = physics.Sphere(0.5, 2.0, pos=(-2, offset, 0), linvel=(v, 0, 0))
    corners = 0.5 * np.array(list(itertools.product((-1, 1), (-2, 2), (-1, 1))))
    block = physics.Block((1, 2, 1), mass) if shape == "block" else physics.Hull(corners, mass)
    bodies = [ball, block] if ball_first else [block, ball]
    world = physics.World(physics.Scene(bodies, (), [physics.Contact(restitution)]), dt=0.01)
    # One contact is one sweep, which is exact: were it wrong, Newton's method would mend it unseen.
    assert {int(world.step().solver[0]) for _ in range(50)} == {Solver.NONE, Solver.SWEEPS}
    b, k = (0, 1) if ball_first else (1, 0)
    # The normal goes through the ball's centre; the block gets -offset times the impulse about z. Solved to 1e-6.
    j = (1 + restitution) * v / (1 / 2.0 + 1 / mass + offset**2 / moment)
    assert world.linvel[0, b, 0] == pytest.approx(v - j / 2.0, abs=1e-6 * v)
    assert world.linvel[0, k, 0] == pytest.approx(j / mass, abs=1e-6 * v)
    assert world.angvel[0, k, 2] == pytest.approx(-offset * j / moment, abs=1e-6 * v)


@pytest.mark.compiled
@pytest.mark.parametrize("floor", ["body", "wall"])
@pytest.mark.parametrize("is_first", [True, False])
def test_a_pair_has_the_mean_friction_and_the_larger_restitution_and_a_wall_the_body_s(floor, is_first):
    """A ball that slides all through its impact loses μ (1 + e) of its normal speed along the floor."""
    ball = physics.Sphere(0.5, 1.0, pos=(0, 0.6, 0), linvel=(5, -1, 0))
    other = (
        physics.Block((10, 1, 10), 1e12, pos=(0, -0.5, 0))
        if floor == "body"
        else physics.Sphere(0.5, 1.0, pos=(0, 9, 0))
    )
    bodies, walls = [ball, other] if is_first else [other, ball], FLOOR if floor == "wall" else []
    world = physics.World(physics.Scene(bodies, walls, [physics.Contact(0.0), physics.Friction()]), dt=0.01)
    order = slice(None) if is_first else slice(None, None, -1)
    mu, e = np.array([0.1, 0.4])[order], np.array([0.3, 0.6])[order]
    world.set_parameters(friction=mu[None], restitution=e[None])
    world.step(steps=30)
    mu, e = (0.2, 0.6) if floor == "body" else (0.1, 0.3)
    np.testing.assert_allclose(world.linvel[0, 0 if is_first else 1], (5 - mu * (1 + e), e, 0), rtol=0, atol=1e-9)


def test_a_plastic_landing_stops_in_front_of_what_it_meets():
    """At whatever moment of a step it comes: eight heights, spread over the way of one step."""
    speed, dt = np.sqrt(2 * G * 0.5), 0.01
    assert speed * dt < 0.1 * np.sqrt(0.75)  # too slow to be met in time: `impact._FAST_RADIUS_SHARE`
    bodies = [physics.Block(CUBE, 1.0, pos=(0, 0.5, 0)), physics.Block(CUBE, 1.0, pos=(0, 2.0, 0))]
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(), physics.Friction(0.5)]
    world = physics.World(physics.Scene(bodies, FLOOR, effects), worlds=8, dt=dt)
    pos = world.pos.copy()
    pos[:, 1, 1] += speed * dt * np.arange(8) / 8
    world.set_state(pos=pos)
    worst = np.max([world.step().penetration for _ in range(60)], axis=0)
    # A hundred slops is what the resting stage may stop alone; without the limit half a step's way, 16 mm.
    assert worst.max() <= 101 * 1e-6 * np.sqrt(0.75)
    assert world.pos[:, 1, 1] == pytest.approx(1.5, abs=1e-4)


@pytest.mark.parametrize("thin", [True, False])
def test_a_bullet_does_not_pass_through_a_plate(thin):
    plate = physics.Block((0.01 if thin else 1.0, 4, 4), 1000.0)
    ball = physics.Sphere(0.01, 0.01, pos=(-7.3, 0.1, 0.2), linvel=(500, 0, 0))
    world = physics.World(physics.Scene([plate, ball], (), [physics.Contact(1.0)]), dt=0.01)
    world.step(steps=3)  # it flies 5 m in a step
    assert world.pos[0, 1, 0] < -7  # back again
    assert world.linvel[0, 1, 0] == pytest.approx(-500, rel=1e-3)


# --- impacts: laws ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("restitution", [0.0, 0.6])
@pytest.mark.parametrize("seed", sweep(range(10), [0]))
def test_free_bodies_keep_their_momenta_and_gain_no_energy(seed, restitution, is_exhaustive):
    rng = np.random.default_rng(seed)
    bodies = []
    for place in itertools.product((-1.5, 1.5), repeat=3):
        q = rng.normal(size=4)
        bodies.append(
            physics.Block(
                rng.uniform(0.5, 1.4, 3), 10 ** rng.uniform(-1, 1), pos=place, quat=q / np.linalg.norm(q),
                linvel=-1.5 * np.array(place) + rng.normal(size=3), angvel=rng.normal(size=3),
            )
        )  # fmt: skip
    scene = physics.Scene(bodies, (), [physics.Contact(restitution), physics.Friction(0.0 if restitution else 0.5)])
    world = physics.World(scene, dt=0.01)
    linear, angular = momenta(world)
    energy = physics.diagnose(world).energy.sum()
    size = np.abs(physics.diagnose(world).momentum).sum()
    depth = 0.0
    for _ in range(150 if is_exhaustive else 90):
        world.step()
        now = physics.diagnose(world).energy.sum()
        # A solve with residual r of the speeds u is off by r u² per unit mass. And what overlaps by d is pushed apart,
        # which turns a body of radius >= 0.4 m by d/0.4 under its angular momentum: of its energy of turning as much,
        # times the ratio of its moments of inertia less one (< 8 for edges of 0.5 to 1.4 m).
        turn = 8 * max(depth, world.report.penetration[0]) / 0.4
        assert now <= energy * (1 + 10 * max(1e-6, world.report.residual[0]) + turn)
        energy, depth = now, world.report.penetration[0]
    after, spin = momenta(world)
    # Impulses act in pairs on points that differ by the gap of a contact at most: linear momentum to rounding of 150
    # steps, angular momentum to the gaps at which speculative contacts push (a tenth of a radius, `FAST_SHARE`).
    np.testing.assert_allclose(after, linear, atol=150 * 1e-16 * size)
    assert np.abs(spin - angular).max() <= 0.1 * size


def test_a_ball_among_others_rolls_as_it_does_alone():
    """The point of contact of a ball does not turn with it: it lost the wall when it turned far in a step."""
    v, mu = 7.0, 0.3
    bodies = [physics.Sphere(0.1, 1.0, pos=(0, 0.1, 0), linvel=(v, 0, 0)), physics.Sphere(0.1, 1.0, pos=(0, 0.1, 5))]
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(), physics.Friction(mu)]
    world = physics.World(physics.Scene(bodies, FLOOR, effects), dt=0.01)
    world.step(steps=200)
    # It slides until 2 v/(7 μ g) = 0.68 s, and rolls on at 5 v/7, turning by 0.5 rad a step. Solved to 1e-6 each step.
    assert world.linvel[0, 0, 0] == pytest.approx(5 * v / 7, rel=200 * 1e-6)
    assert world.angvel[0, 0, 2] == pytest.approx(-50 * v / 7, rel=200 * 1e-6)
    assert abs(world.pos[0, 0, 1] - 0.1) <= 1e-6 * 0.1  # the slop


@pytest.mark.parametrize("count", [1, 2])
def test_a_block_that_turns_by_radians_in_a_step_gains_no_energy(count):
    """Once up to ten thousand times its energy: what was asked of a vertex in contact was h ω² r/2, far above ω r."""
    bodies = [
        physics.Block((0.2, 0.3, 1.0), 1.0, pos=(3 * k, 1, 0), linvel=(0, -20, 0), angvel=(300, 500, 200))
        for k in range(count)
    ]
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(0.0), physics.Friction(0.0)]
    world = physics.World(physics.Scene(bodies, FLOOR, effects), dt=0.01)
    energy = physics.diagnose(world).energy.sum()
    for _ in range(100):
        report = world.step()
        now = physics.diagnose(world).energy.sum()
        # Nine problems a step, each off by 4 tolerances of the energy; and pushed out of the floor by some slops.
        assert now <= energy + 36e-6 * abs(energy) + count * G * 2 * max(1e-6, report.penetration[0])
        energy = now


# --- rest ------------------------------------------------------------------------------------------------------


def balance(world, index=0):
    """Largest defect of force [N] and moment [N m] of any body at rest, and of the friction cones [N]."""
    points, forces = world.contacts(index)
    force = np.array([b.mass for b in world.scene.bodies])[:, None] * np.array([0, -G, 0])
    moment = np.zeros_like(force)
    for (a, b), point, f in zip(world.contact_ends(index), points, forces):
        for body, sign in ((a, 1.0), (b, -1.0)):
            if body >= 0:
                force[body] += sign * f
                moment[body] += np.cross(point - world.pos[index, body], sign * f)
    push = np.where(world.contact_ends(index)[:, 1] < 0, forces[:, 1], -forces[:, 1])  # of two, on the lower one
    slack = np.hypot(forces[:, 0], forces[:, 2]) - 0.5 * push
    return np.abs(force).max(), np.abs(moment).max(), max(slack.max(), -push.min())


@pytest.mark.compiled
def test_at_fast_too_a_tower_gathers_no_speed():
    """A solve leaves its residual at every step: 1e-9 of the largest free speed g h, whatever the tolerance."""
    world = physics.World(scenes.tower(10), dt=0.005, accuracy="fast")
    world.step(steps=100)
    # A velocity is made up of what is left at each of the ten faces below; g h = 0.049 m/s.
    assert np.abs(world.linvel).max() <= 100 * 10 * 1e-9 * 0.049


@pytest.mark.exhaustive
@pytest.mark.parametrize("accuracy", ["fast", "balanced"])
def test_a_pile_lies_stiller_than_its_solves_are_fine(accuracy):
    """Solves may leave a share of g h, the tolerance. Left to them the pile goes on at that, body by body in cycles."""
    world, seen = physics.World(scenes.heap(25), dt=0.005, accuracy=accuracy), []
    world.step(steps=1600)
    for _ in range(200):
        world.step()
        seen.append(np.abs(world.linvel).max())
    # Between sweeps velocities grow by two thousandths of it a step at most: a quarter takes 125 steps.
    assert np.median(seen) <= 0.25 * world.accuracy.tolerance * G * 0.005


@pytest.mark.compiled
@pytest.mark.parametrize("count", sweep([2, 10, 20], [2, 10]))
@pytest.mark.parametrize("top", sweep([1.0, 1e3, 1e6], [1.0, 1e6]))
@pytest.mark.parametrize("accuracy", ["fast", "balanced"])
def test_a_tower_stands_and_every_body_is_in_balance(count, top, accuracy):
    world = physics.World(tower(count, top), dt=0.01, accuracy=accuracy)
    start = world.pos.copy()
    for _ in range(100):
        report = world.step()
        assert report.status[0] == Status.OK
    # It rests where it was put, to the slop of every interface.
    slop = world.accuracy.slop * np.sqrt(0.75)
    assert np.abs(world.pos - start).max() <= 2 * count * slop
    # A residual r of the free speed g h leaves each body an acceleration of about r g: of its mass and all above it.
    force, moment, cone = balance(world)
    tolerance = 10 * world.accuracy.tolerance * G * (count + top)
    assert force <= tolerance
    assert moment <= tolerance
    assert cone <= tolerance


@pytest.mark.compiled
def test_a_heavy_block_does_not_sink_into_a_light_one():
    world = physics.World(tower(2, 1e6), dt=0.01)
    for _ in range(200):
        assert world.step().penetration[0] <= 1e-3  # 0.1 % of the edge; the slop is 9e-7 m
    gap = world.pos[0, 1, 1] - world.pos[0, 0, 1] - 1
    assert abs(gap) <= 2e-6


def test_a_block_slides_on_another_until_friction_stops_it(is_exhaustive):
    bodies = [
        physics.Block((20, 1, 4), 50.0, pos=(0, 0.5, 0)),
        physics.Block((1, 1, 1), 1.0, pos=(-4, 1.5, 0), linvel=(3.0, 0, 0)),
    ]
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(), physics.Friction(0.3)]
    world = physics.World(physics.Scene(bodies, FLOOR, effects), dt=0.005)
    world.step(steps=400 if is_exhaustive else 240)  # it stops after 1.02 s
    # The plank's own friction, 51 times that of the block, holds it. v²/(2 μ g); the step in which it stops is
    # off by at most v_last h <= μ g h².
    distance = world.pos[0, 1, 0] + 4
    assert distance == pytest.approx(9 / (2 * 0.3 * G), abs=0.3 * G * 0.005**2 + 1e-6)
    # A residual of 1e-6 of the free speed g h lets it creep at that speed at most: 1e-6 g h for all the time.
    assert abs(world.pos[0, 0, 0]) <= 1e-6 * G * 0.005 * world.time
    assert not np.any(np.abs(world.linvel) > 1e-6)


def test_overlapping_bodies_come_apart_without_speed():
    bodies = [physics.Block(CUBE, 1.0), physics.Block(CUBE, 1.0, pos=(0.75, 0.1, 0))]
    world = physics.World(physics.Scene(bodies, (), [physics.Contact(), physics.Friction(0.5)]), dt=0.01)
    world.step(steps=60)
    assert world.step().penetration[0] <= 1e-6  # 0.25 m halved 60 times, down to the slop of 9e-7 m
    assert not world.linvel.any()


# --- independence ----------------------------------------------------------------------------------------------


def heap(worlds, threads=1):
    """A few blocks and balls falling on each other, each world a little different."""
    bodies = [
        physics.Block((1, 0.8, 1.2), 2.0, pos=(0, 0.5, 0)),
        physics.Sphere(0.4, 1.0, pos=(0.2, 1.5, 0.1)),
        physics.Block((0.7, 0.7, 0.7), 1.0, pos=(-0.2, 2.4, 0), quat=(np.cos(0.3), 0, 0, np.sin(0.3))),
    ]
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(0.2), physics.Friction(0.5)]
    world = physics.World(physics.Scene(bodies, FLOOR, effects), worlds=worlds, dt=0.01, threads=threads)
    velocity = np.zeros((worlds, 3, 3))
    velocity[:, 2, 0] = 0.1 * np.arange(worlds)
    world.set_state(linvel=velocity)
    return world


@pytest.mark.compiled
def test_same_bits_for_threads_and_batch_sizes():
    one, two = heap(7), heap(7, threads=2)
    one.step(steps=120)
    two.step(steps=120)
    np.testing.assert_array_equal(one.state, two.state)
    few = heap(3)
    few.step(steps=120)
    np.testing.assert_array_equal(few.state, one.state[: 3 * 3])


@pytest.mark.compiled
def test_a_snapshot_in_contact_continues_bit_identically():
    world = heap(1)
    world.step(steps=40)
    assert len(world.contact_ends(0))
    snapshot = pickle.loads(pickle.dumps(world.snapshot()))
    world.step(steps=20)
    expected = world.state.copy()
    other = heap(1)
    other.restore(snapshot)
    other.step(steps=20)
    np.testing.assert_array_equal(other.state, expected)


def test_without_contact_between_them_bodies_are_alone():
    bodies = [physics.Block((1, 1, 1), 1.0, pos=(0, 2, 0), angvel=(1, 2, 3)), physics.Sphere(0.5, 1.0, pos=(0.2, 2, 0))]
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(0.3, between_bodies=False), physics.Friction(0.5)]
    both = physics.World(physics.Scene(bodies, FLOOR, effects), dt=0.01)
    both.step(steps=200)
    for b, body in enumerate(bodies):
        alone = physics.World(physics.Scene([body], FLOOR, effects), dt=0.01)
        alone.step(steps=200)
        # A sphere alone needs no gyroscopic torque, and its kernel leaves it out: equal to rounding there.
        np.testing.assert_allclose(both.pos[0, b], alone.pos[0, 0], atol=1e-12)
    assert not both.plan.scheme.couples_bodies
    assert "declared without contact between bodies" in both.plan.explain()


# --- saying so -------------------------------------------------------------------------------------------------


def test_what_is_not_known_yet_is_refused():
    two = [physics.Block(CUBE, 1.0, pos=(0, 2, 0)), physics.Block(CUBE, 1.0, pos=(3, 2, 0))]
    with pytest.raises(ValueError, match="between_bodies is 1"):
        physics.Contact(between_bodies=1)
    world = physics.World(physics.Scene(two, FLOOR, [physics.Gravity(), physics.Contact(between_bodies=False)]),
                          accuracy="precise")  # fmt: skip
    assert not world.plan.scheme.couples_bodies


@pytest.mark.compiled
def test_contacts_without_room_are_reported():
    # Twenty balls at nearly one place: 190 near pairs, and room for 8 per body.
    bodies = [physics.Sphere(1.0, 1.0, pos=(0.01 * k, 50, 0)) for k in range(20)]
    far = physics.Block((1, 0.8, 1.2), 1.0, pos=(0, 90, 0))  # so that the kernel is that of `heap`
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(1.0), physics.Friction(0.5)]
    world = physics.World(physics.Scene([*bodies, far], FLOOR, effects), dt=0.01)
    report = world.step()
    assert report.status[0] == Status.LEFT_OUT
    assert not report.ok
    assert report.left_out[0] >= 190 - 8 * 21
    assert "contacts were left out" in report.messages()[0]


def test_the_report_names_the_method():
    world = physics.World(tower(10), dt=0.01)
    assert world.step().solver[0] == Solver.NEWTON  # cold start of a tower: sweeps crawl
    two = balls([(-0.6, 0, 0), (0.6, 0, 0)], [(10, 0, 0), (0, 0, 0)], [1, 1], 1.0)
    two.step(steps=5)
    assert two.step().solver[0] == Solver.NONE


def test_what_spins_fast_pushes_nothing_that_it_cannot_reach(rng, is_exhaustive):
    """Slender blocks at 1e4 rad/s and more, 3 m from a block that lies, higher above the floor than a corner reaches.

    The approach of a corner, taken for a straight line, would be one with everything within 100 m. They fly on their
    parabolas; what lies does so as if it were alone.
    """
    count, dt = 64 if is_exhaustive else 24, 0.01
    slender = physics.Block((0.2, 2.0, 0.4), 0.05, pos=(0, 1.6, 0))
    lying = physics.Block((1.0, 0.2, 0.3), 17.0, pos=(3, 0.1, 0))
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(), physics.Friction(0.5)]
    world = physics.World(physics.Scene([slender, lying], FLOOR, effects), worlds=count, dt=dt)
    alone = physics.World(physics.Scene([lying], FLOOR, effects), dt=dt)
    quat, linvel, angvel = np.zeros((count, 2, 4)), np.zeros((count, 2, 3)), np.zeros((count, 2, 3))
    quat[:, 0], quat[:, 1, 0] = rng.normal(size=(count, 4)), 1.0
    quat /= np.linalg.norm(quat, axis=-1, keepdims=True)
    linvel[:, 0] = rng.uniform(-1, 1, (count, 3))
    angvel[:, 0] = rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(4, 5, (count, 1))
    world.set_state(quat=quat, linvel=linvel, angvel=angvel)
    start = world.pos[:, 0].copy()
    report = world.step()
    alone.step()
    fallen = np.array([0, -0.5 * G * dt * dt, 0])
    np.testing.assert_allclose(world.pos[:, 0], start + dt * linvel[:, 0] + fallen, atol=8 * EPS)
    np.testing.assert_allclose(world.pos[:, 1], np.broadcast_to(alone.pos[0, 0], (count, 3)), atol=1e-9)
    assert not report.impacts.any()


def test_many_that_spin_fast_but_far_apart_are_no_pairs():
    """Boxes as wide as the straight ways of their corners would make 780 pairs of forty, for which there is no room."""
    bodies = [physics.Block((1, 2, 3), 1.0, pos=(12.0 * k, 0, 0), angvel=(0, 1e5, 0)) for k in range(40)]
    world = physics.World(physics.Scene(bodies, (), [physics.Contact()]), dt=0.01)
    report = world.step()
    assert not report.left_out.any()
    assert world.scratch[0].counts[NUM_PAIRS] == 0
