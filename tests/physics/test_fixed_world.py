"""Fixed bodies in worlds: no step changes their bits; setters, sleep, contacts, events, threads, snapshots, pickles."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import physics

PULL = physics.Gravity((0, -9.81, 0))
TABLE = physics.Block((6, 1, 6), fixed=True, pos=(0, -0.5, 0), name="table")
LAWS = [PULL, physics.Contact(), physics.Friction(0.5)]


def cube(height: float, x: float = 0.0, **start) -> physics.Block:
    return physics.Block((1, 0.5, 0.7), 2.0, pos=(x, height, 0), **start)


def scene(*bodies, laws=LAWS) -> physics.Scene:
    return physics.Scene([bodies[0], TABLE, *bodies[1:]], effects=laws)


def tossed(worlds: int, threads: int = 1) -> physics.World:
    world = physics.World(scene(cube(1.0), cube(2.0, 0.4)), worlds, 0.005, threads=threads)
    spins = np.zeros((worlds, 3, 3))
    spins[:, 0] = np.linspace((1, 2, 3), (3, 1, 2), 5)[:worlds]
    world.set_state(angvel=spins)
    return world


def test_no_step_changes_their_bits():
    """Not one of a hundred thousand steps, nor a wrench, nor gravity."""
    world = physics.World(scene(cube(0.26)), dt=0.005)
    before = world.state[1].tobytes()
    wrench = np.zeros((1, 2, 6))
    wrench[:, 1] = 1e6
    world.step(wrench, steps=100)
    world.step(steps=100_000)
    assert world.state[1].tobytes() == before
    assert world.report.ok
    assert abs(world.pos[0, 0, 1] - 0.25) < 1e-5


def test_a_wrench_on_one_changes_nothing():
    """Bodies on the table move to the same bits."""
    one, other = tossed(1), tossed(1)
    wrench = np.zeros((1, 3, 6))
    wrench[:, 1] = 1e9
    one.step(wrench, steps=50)
    other.step(steps=50)
    assert one.state.tobytes() == other.state.tobytes()


def test_bits_do_not_depend_on_batch_and_threads():
    alone, batch, threads = tossed(1), tossed(5), tossed(5, threads=2)
    for world in (alone, batch, threads):
        world.step(steps=200)
    assert batch.state.tobytes() == threads.state.tobytes()
    assert batch.state[:3].tobytes() == alone.state.tobytes()


def test_snapshots_and_pickles_go_on_with_the_same_bits():
    world = tossed(2)
    world.step(steps=60)
    snapshot, copy = world.snapshot(), pickle.loads(pickle.dumps(world))
    world.step(steps=60)
    copy.step(steps=60)
    assert copy.state.tobytes() == world.state.tobytes()
    end = world.state.tobytes()
    world.restore(snapshot)
    world.step(steps=60)
    assert world.state.tobytes() == end


def test_a_snapshot_of_a_moving_body_does_not_fit():
    """Fixed bodies are a setting of the scene."""
    moving = physics.Block(TABLE.size, 1.0, pos=TABLE.pos, name="table")
    other = physics.World(physics.Scene([cube(1.0), moving], effects=LAWS), dt=0.005)
    with pytest.raises(ValueError, match="fixed block"):
        physics.World(scene(cube(1.0)), dt=0.005).restore(other.snapshot())


def test_energies_and_momenta_are_zero():
    found = physics.diagnose(tossed(2))
    for values in (found.kinetic_energy, found.potential_energy, found.momentum, found.angular_momentum):
        assert not values[:, 1].any()
        assert np.isfinite(values).all()
    assert (found.gap[:, 1] == np.inf).all()


def test_setters_refuse_motion_and_mass_and_place_it_elsewhere():
    world = tossed(1)
    velocity = np.zeros((1, 3, 3))
    velocity[0, 1] = (0, 1, 0)
    for name in ("linvel", "angvel"):
        with pytest.raises(ValueError, match=rf"{name} is .* for body 1 .*table.* in world 0, which is fixed"):
            world.set_state(**{name: velocity})
    with pytest.raises(ValueError, match=r"mass is 3.0 for Scene.bodies\[1\], which is fixed; allowed is inf"):
        world.set_parameters(mass=3.0)
    before = world.params.copy()
    world.set_parameters(mass=[4.0, np.inf, 5.0])
    assert world.params[:, 0].tolist() == [0.25, 0.0, 0.2]
    assert (world.params[1] == before[1]).all()
    pos = world.pos.copy()
    pos[0, 1, 1] = -1.5
    world.set_state(pos=pos)
    world.step(steps=400)
    assert abs(world.pos[0, 0, 1] - (-0.75)) < 0.5  # it lies on the table, which is 1 m lower
    assert (world.pos[0, 1] == pos[0, 1]).all()


def test_contacts_and_impacts_name_the_body():
    world = physics.World(scene(cube(0.3, linvel=(0, -2, 0))), dt=0.005)
    world.keep_impacts()
    hits = []
    for _ in range(30):
        world.step()
        found = world.read_impacts()
        hits += found.ends[0, : int(found.count[0])].tolist()
    assert hits
    assert hits[0] == [0, 1]
    found = world.read_contacts()
    assert (found.ends[0, : int(found.count[0])] == (0, 1)).all()
    events = physics.simulate(scene(cube(0.3, linvel=(0, -2, 0))), 0.1, dt=0.005).events
    first = next(event for event in events if event.kind == "impact")
    assert (first.body, first.other, first.wall) == (0, 1, -1)


def test_friction_of_a_pair_is_the_geometric_mean():
    """A block with μ = 0.4 on a table with 0.1 slides as with 0.2; restitution is the larger one."""
    world = physics.World(scene(cube(0.25, linvel=(2, 0, 0))), dt=0.005)
    world.set_parameters(friction=[0.4, 0.1])
    world.step(steps=100)
    np.testing.assert_allclose(world.linvel[0, 0], (2 - 0.2 * 9.81 * 0.5, 0, 0), atol=1e-5)


def test_bodies_that_pass_each_other_rest_on_it():
    """`between_bodies=False`: two blocks slide through each other on the table."""
    laws = [PULL, physics.Contact(between_bodies=False), physics.Friction(0.0)]
    pair = cube(0.25, -1.0, linvel=(1, 0, 0)), cube(0.25, 1.0, linvel=(-1, 0, 0))
    world = physics.World(scene(*pair, laws=laws), dt=0.005)
    world.step(steps=400)
    np.testing.assert_allclose(world.pos[0, 0], (1, 0.25, 0), atol=1e-5)
    np.testing.assert_allclose(world.pos[0, 2], (-1, 0.25, 0), atol=1e-5)


@pytest.mark.exhaustive
def test_bodies_on_it_sleep_and_wake_apart():
    """It joins nothing: a block that lands beside a sleeping one does not wake it, one that lands on it does."""
    world = physics.World(scene(cube(0.25, -2.0), cube(0.25, 2.0), laws=[*LAWS, physics.Sleeping()]), dt=0.005)
    before = world.state[1].tobytes()
    world.step(steps=1500)
    assert (world.sleep[[0, 2], 0] > 0).all()
    wrench = np.zeros((1, 3, 6))
    wrench[0, 0, 1] = 30.0  # lifts one of them
    world.step(wrench, steps=1)
    assert world.sleep[0, 0] == 0
    assert world.sleep[2, 0] > 0
    wrench[:] = 0.0
    wrench[0, 1, 0] = 5.0
    world.step(steps=1500)
    world.step(wrench, steps=1)  # on the table: nothing wakes
    assert (world.sleep[[0, 2], 0] > 0).all()
    assert world.state[1].tobytes() == before


@pytest.mark.exhaustive
def test_springs_between_bodies_beside_it():
    """A stiff spring holds two blocks above the table: the fixed body is not part of the springs' problem."""
    spring = physics.Spring(body=0, other=2, stiffness=1e6, damping=100.0, length=1.5)
    world = physics.World(scene(cube(0.25), cube(1.75), laws=[*LAWS, spring]), dt=0.005)
    before = world.state[1].tobytes()
    world.step(steps=100)
    assert np.isfinite(world.state).all()
    assert world.state[1].tobytes() == before
    assert not physics.diagnose(world).energy[:, 1].any()
    assert np.linalg.norm(world.pos[0, 0] - world.pos[0, 2]) == pytest.approx(1.5, abs=1e-3)


def test_it_may_stand_in_a_wall_and_in_another_fixed_body():
    floor = physics.HalfSpace((0, 1, 0))
    post = physics.Block((1, 4, 1), fixed=True)
    both = [post, physics.Sphere(1.0, fixed=True), physics.Block((1, 0.5, 0.7), 2.0, pos=(3, 0.25, 0))]
    world = physics.World(physics.Scene(both, [floor], LAWS), dt=0.005)
    world.step(steps=20)
    assert world.report.ok
    assert world.report.penetration[0] < 1e-6
