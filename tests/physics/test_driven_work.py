"""Work of driven bodies on the others, against closed forms, and what it does for torques and on a lift."""

import pytest

from physics import Block, Contact, Friction, Gravity, Motion, Scene, Sphere, SpinFriction, World, diagnose

pytestmark = pytest.mark.interpreted

G, MU, ARM = 9.81, 0.5, 0.02
LAWS = (Gravity(), Contact(), Friction(MU))
BOX = Block((0.4, 0.2, 0.4), mass=3.0, pos=(0, 0.6, 0))


def support(**motion) -> Block:
    return Block((8, 1, 8), fixed=True, motion=Motion(**motion))


def lift(way: float) -> Block:
    """Lift that goes this far up in half a second, at the constant acceleration 8 `way`, then as far again."""
    return Block(
        (4, 1, 4), fixed=True, motion=Motion.table((0, 0.5, 1.0), [(0, 0, 0), (0, way, 0), (0, 8 / 3 * way, 0)])
    )


def run(bodies, effects, steps, accuracy, dt=0.005) -> tuple[World, float, float]:
    """World after some steps, the work of its driven bodies [J], and what its energy has gained [J]."""
    world = World(Scene(bodies, effects=effects), dt=dt, accuracy=accuracy)
    start = diagnose(world).energy.sum()
    work = sum(float(world.step().driven_work[0]) for _ in range(steps))
    return world, work, float(diagnose(world).energy.sum() - start)


# At `balanced` the end of a slip is found to the tolerance of 1e-6, as a share of the belt's speed; the work is off by
# the square of that, and by rounding. At `precise` only rounding is left, of 1e-15 for each of some hundred parts.
@pytest.mark.parametrize(
    ("accuracy", "share"), [("balanced", 1e-6), pytest.param("precise", 1e-11, marks=pytest.mark.exhaustive)]
)
def test_a_belt_works_twice_what_the_block_keeps(accuracy, share):
    """μ m g acts until v = μ g t; in this time the belt goes v²/(μ g), the block half as far."""
    v = 0.5
    _, work, gain = run([BOX, support(surface_velocity=(v, 0, 0))], LAWS, 30, accuracy)
    assert work == pytest.approx(BOX.mass * v**2, rel=share)
    assert gain == pytest.approx(0.5 * BOX.mass * v**2, rel=share)


@pytest.mark.parametrize("accuracy", ["balanced", "precise"])
def test_a_wall_that_hits_a_ball_works_by_its_impulse(accuracy):
    """p = m (1 + e) (v + V), and the wall moves at V."""
    ball = Sphere(0.25, mass=2.0, pos=(1.0, 0, 0), linvel=(-1.0, 0, 0))
    wall = Block((1, 4, 4), fixed=True, motion=Motion(velocity=(2.0, 0, 0)))
    _, work, gain = run([ball, wall], [Contact(restitution=0.5)], 20, accuracy)
    assert work == pytest.approx(2.0 * 1.5 * 3.0 * 2.0, rel=1e-12)
    assert gain == pytest.approx(0.5 * 2.0 * (3.5**2 - 1.0**2), rel=1e-12)


@pytest.mark.parametrize("way", [0.3, -0.3])
@pytest.mark.parametrize("accuracy", ["balanced", "precise"])
def test_a_block_on_a_lift_has_its_velocity_and_takes_its_work(accuracy, way):
    """Both stages and closed forms are of second order in time: nothing but rounding and the tolerance is left.

    On a lift that accelerates downwards a block that coasts for half a stage seems to leave it.
    """
    world, work, gain = run([BOX, lift(way)], LAWS, 5, accuracy, dt=0.01)
    v = 8 * way * 0.05
    share = 1e-6 if accuracy == "balanced" else 1e-11
    assert world.linvel[0, 0, 1] == pytest.approx(v, rel=share)
    assert work == pytest.approx(BOX.mass * (G + 8 * way) * 0.5 * v * 0.05, rel=share)
    assert gain == pytest.approx(work, rel=share)


# For half a second the acceleration falls at j = 19.2 m/s³. The velocity v at the middle of a step h then differs from
# its mean by j h²/24, which is 4e-5 J in all for v = 1.2 m/s; the bound is five times that. `precise` leaves rounding.
@pytest.mark.exhaustive
@pytest.mark.parametrize(("accuracy", "most"), [("balanced", 2e-4), ("precise", 1e-10)])
def test_a_whole_ride_from_rest_to_rest_takes_the_work_of_gravity(accuracy, most):
    _, work, gain = run([BOX, lift(0.3)], LAWS, 200, accuracy)
    assert work == pytest.approx(BOX.mass * G * 0.8, abs=most)
    assert gain == pytest.approx(BOX.mass * G * 0.8, abs=most)


def test_a_turntable_spins_a_ball_up_by_spin_friction():
    """The torque is m g times its arm while the ball turns slower; its energy is no error of the solver."""
    mass, radius, spin, t = 2.0, 0.3, 1.5, 0.1
    ball = Sphere(radius, mass=mass, pos=(0, 0.8, 0))
    world, work, _ = run([ball, support(spin=(0, spin, 0))], [*LAWS, SpinFriction(ARM)], 20, "balanced")
    torque = ARM * mass * G
    assert world.angvel[0, 0, 1] == pytest.approx(torque * t / (0.4 * mass * radius**2), rel=1e-12)
    assert work == pytest.approx(torque * spin * t, rel=1e-12)


def test_nothing_driven_does_no_work():
    _, work, _ = run([BOX, Block((4, 1, 4), fixed=True)], LAWS, 2, "balanced")
    assert work == 0.0
