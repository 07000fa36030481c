"""Other engines on our scenes: the same start in our conventions, the same physics, and what they cannot express."""

from __future__ import annotations

import importlib.util
import math

import numpy as np
import pytest

import physics
from physics import scenes
from physics.work_precision.contender import TooSlow
from rigid_env.lab.measure import peers
from rigid_env.lab.measure.peers import PeerContender, Unsupported, contender
from rigid_env.lab.measure.peers.contender import friction, gravity, restitution, walls

G = 9.81


@pytest.fixture(params=peers.ENGINES)
def engine(request):
    """Each peer that is installed."""
    pytest.importorskip(peers.ENGINES[request.param][2])
    return peers.load(request.param)


def turned(**more) -> physics.Scene:
    """A block in no simple attitude that flies and turns far above a floor."""
    quat = np.array((0.7, -0.1, 0.5, 0.3)) / math.sqrt(0.84)
    body = physics.Block(
        scenes.SIZE, scenes.MASS, pos=(1, 50, -2), quat=quat, linvel=(1, 2, 3), angvel=(0.3, -0.2, 0.1)
    )
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(**more), physics.Friction(0.4)]
    return physics.Scene([body], [physics.HalfSpace((0, 1, 0))], effects)


def contenders(engine, scene, dt):
    return [PeerContender(engine, scene, name, options, dt) for name, options in engine.settings(scene).items()]


def test_every_setting_starts_where_the_scene_does(engine):
    scene = turned()
    assert next(iter(engine.settings(scene))) == "default"
    assert engine.version
    start = physics.simulate(scene, 0.0)
    for one in contenders(engine, scene, 0.01):
        seen = one.watch(2)
        assert seen.t.tolist() == pytest.approx([0.0, 0.01, 0.02])
        # Turned into the engine's frames and back: a few roundings of numbers up to 50.
        for name in ("pos", "linvel", "angvel"):
            np.testing.assert_allclose(getattr(seen, name)[0], getattr(start, name)[0], rtol=0, atol=1e-13)
        assert abs(seen.quat[0, 0] @ start.quat[0, 0]) == pytest.approx(1.0, abs=1e-14)
        assert seen.energy[0, 0] == pytest.approx(start.energy[0, 0], rel=1e-13)


def test_the_default_falls_by_semi_implicit_euler_and_turns_right(engine):
    """All three step velocities first: after n steps it is g h² n (n + 1)/2 down, to rounding."""
    scene, n, h = turned(), 50, 0.01
    seen = contenders(engine, scene, h)[0].watch(n)
    true = np.array((1, 50, -2)) + n * h * np.array((1, 2, 3)) - (0, G * h * h * n * (n + 1) / 2, 0)
    # 50 sums of numbers up to 50.
    np.testing.assert_allclose(seen.pos[-1, 0], true, rtol=0, atol=1e-12)
    exact = physics.simulate(scene, n * h, sample_dt=h)
    # First order in the turn: h ω² t = 0.01 * 0.14 * 0.5, and the difference of the moments matters less.
    assert abs(seen.quat[-1, 0] @ exact.quat[-1, 0]) >= math.cos(0.5 * 7e-4)


def test_a_restart_forgets(engine):
    """A run, timed or not, is the same again after a restart: nothing of the first is remembered."""
    scene = scenes.slide()
    for one in contenders(engine, scene, 0.01)[:2]:
        run = engine.open(scene, 0.01, **one.options)
        ends = []
        for _ in range(2):
            run.restart()
            run.advance(20)
            ends.append(np.concatenate([part.ravel() for part in run.state()]))
        np.testing.assert_array_equal(*ends)


def test_steps_at_once_are_steps_one_by_one(engine):
    scene = scenes.slide()
    one = contenders(engine, scene, 0.01)[0]
    restart, run = one.runner(20)
    restart()
    run()
    opened = engine.open(scene, 0.01, **one.options)
    opened.restart()
    opened.advance(20)
    np.testing.assert_allclose(opened.state()[0], one.watch(20).pos[-1], rtol=0, atol=1e-12)


def test_friction_is_that_of_the_scene(engine):
    """The default's stopping distance is within v h/2 of v²/(2 μ g), by which a time stepper is off; Drake's slips on
    at its regularised friction, which is why it is given a centimetre more."""
    seen = contenders(engine, scenes.slide(), 0.005)[0].watch(400)
    assert seen.pos[-1, 0, 0] == pytest.approx(9.0 / (0.6 * G), abs=3.0 * 0.005 / 2 + 0.01)


def test_walls_with_any_normal_hold(engine):
    """On the incline that must stick nothing falls through, and the block stays within a decimetre for a second."""
    scene = scenes.by_name("incline")
    seen = contenders(engine, scene, 0.005)[0].watch(200)
    assert np.linalg.norm(seen.pos[-1, 0] - scene.bodies[0].pos) < 0.1


def test_bodies_meet_each_other_where_the_scene_says_so(engine):
    """Two blocks fly on through each other, or do not; an engine that is not given that says so."""
    bodies = [physics.Block((1, 1, 1), 1.0, pos=(-0.6 * v, 5, 0), linvel=(v, 0, 0)) for v in (1.0, -1.0)]
    floor = [physics.HalfSpace((0, 1, 0))]
    scene = physics.Scene(bodies, floor, [physics.Contact(between_bodies=False)])
    seen = contenders(engine, scene, 0.01)[0].watch(30)
    np.testing.assert_allclose(seen.linvel[-1, :, 0], (1.0, -1.0), rtol=0, atol=1e-12)
    scene = physics.Scene(bodies, floor, [physics.Contact()])
    if engine.name == "mujoco":
        assert np.abs(contenders(engine, scene, 0.01)[0].watch(30).linvel[-1]).max() < 0.5  # soft, and plastic
    else:
        with pytest.raises(Unsupported, match="between bodies"):
            engine.open(scene, 0.01)


def bouncing_sphere(e) -> physics.Scene:
    """A sphere that flies onto a floor at 1 m/s, without gravity; it arrives after half a second."""
    body = physics.Sphere(0.5, 1.0, pos=(0, 1, 0), linvel=(0, -1, 0))
    return physics.Scene([body], [physics.HalfSpace((0, 1, 0))], [physics.Contact(e)])


def test_mujoco_bounces_in_one_step():
    pytest.importorskip("mujoco")
    engine = peers.load("mujoco")
    scene = bouncing_sphere(0.5)
    seen = PeerContender(engine, scene, "one-step", engine.settings(scene)["one-step"], 0.01).watch(100)
    # An impedance of 0.9999 leaves 1e-4 of the (1 + e) v that an impact changes.
    assert seen.linvel[-1, 0, 1] == pytest.approx(0.5, abs=3e-4)


def test_pybullet_bounces():
    pytest.importorskip("pybullet")
    engine = peers.load("pybullet")
    scene = bouncing_sphere(0.5)
    options = engine.settings(scene)["breaking 0.1 mm, erp 0"]
    seen = PeerContender(engine, scene, "", options, 0.01).watch(100)
    # It takes hold of a contact up to the breaking distance early and keeps the speed that this leaves: 0.1 mm / 10 ms.
    assert seen.linvel[-1, 0, 1] == pytest.approx(0.5, abs=0.01)


def test_drakes_dissipation_gives_the_restitution_of_the_first_impact():
    pytest.importorskip("pydrake")
    from rigid_env.lab.measure.peers.drake import dissipation

    d = dissipation(scenes.bounce(1.0, 0.5))
    s = d * math.sqrt(2 * G)
    assert s * 1.5 == pytest.approx(math.log((1 + s) / (1 - 0.5 * s)), rel=1e-9)
    assert dissipation(scenes.bounce(1.0, 1.0)) == 0.0
    engine = peers.load("drake")
    scene = bouncing_sphere(0.5)
    seen = PeerContender(engine, scene, "", engine.settings(scene)["RK3, 1e-4"], 0.001).watch(1000)
    # The integrator's accuracy of 1e-4 is per step of the contact, which takes a hundred or so.
    assert seen.linvel[-1, 0, 1] == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize(
    "scene",
    [
        scenes.closed_box(),
        physics.Scene(
            [physics.Sphere(1.0, 1.0, pos=(0, 5, 0), linvel=(0, 1, 0))],
            [physics.HalfSpace((0, 1, 0))],
            [physics.Contact(0.5)],
        ),
        scenes.drop(),
    ],
    ids=["elastic", "flies away", "turns"],
)
def test_drake_has_no_restitution_at_many_speeds(scene):
    pytest.importorskip("pydrake")
    from rigid_env.lab.measure.peers.drake import dissipation

    if restitution(scene) == 1.0:
        assert dissipation(scene) == 0.0
    else:
        with pytest.raises(Unsupported, match="no restitution"):
            dissipation(scene)


def test_pybullet_says_what_it_cannot_express():
    pytest.importorskip("pybullet")
    engine = peers.load("pybullet")
    with pytest.raises(Unsupported, match="ellipsoid"):
        engine.open(physics.Scene([physics.Ellipsoid((3, 2, 1), 1.0)]), 0.01)
    tilted = physics.Block((1, 1, 1), 1.0, inertia_body=((2, 0.5, 0), (0.5, 2, 0), (0, 0, 2)))
    with pytest.raises(Unsupported, match="moments of inertia"):
        engine.open(physics.Scene([tilted]), 0.01)


def test_an_ellipsoid_rests_in_the_others():
    body = physics.Ellipsoid((3, 2, 1), 5.0, pos=(0, 2.0, 0))
    scene = physics.Scene([body], [physics.HalfSpace((0, 1, 0))], [physics.Gravity((0, -G, 0)), physics.Contact()])
    for name in ("mujoco", "drake"):
        if peers.is_installed(name):
            seen = contenders(peers.load(name), scene, 0.005)[0].watch(20)
            # Soft contacts give way: by millimetres under 5 kg.
            assert seen.pos[-1, 0, 1] == pytest.approx(2.0, abs=0.01)


def test_a_hull_rests_where_it_can_be_expressed_and_is_refused_elsewhere(engine):
    cube = physics.Hull([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], 2.0, pos=(0, 1, 0))
    scene = physics.Scene([cube], [physics.HalfSpace((0, 1, 0))], [physics.Gravity(), physics.Contact()])
    if engine.name != "mujoco":
        with pytest.raises(Unsupported, match="hulls are not handed to"):
            engine.open(scene, 0.01)
        return
    run = engine.open(scene, 0.01)
    run.restart()
    run.advance(100)
    assert run.state()[0][0, 1] == pytest.approx(1.0, abs=1e-2)  # its contacts are soft


def test_a_peer_that_is_missing_names_the_extra(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    for name in peers.ENGINES:
        with pytest.raises(ModuleNotFoundError, match=r"rigid-env\[peers\]"):
            peers.load(name)
    with pytest.raises(ValueError, match="peer is 'nobody'; allowed are mujoco, pybullet, drake"):
        peers.load("nobody")


def test_a_peer_that_takes_too_long_gives_up(monkeypatch):
    monkeypatch.setattr(contender, "LIMIT", -1.0)
    slow = PeerContender(Standing(), scenes.tumble(), "default", {}, 0.01)
    with pytest.raises(TooSlow, match="0 s simulated in -1 s"):
        slow.watch(10)


class Standing:
    """An engine in which nothing moves."""

    name, version = "standing", "1"

    def open(self, scene, dt):
        return self

    def restart(self):
        pass

    def advance(self, steps):
        pass

    def state(self):
        return np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0, 0.0]]), np.zeros((1, 3)), np.zeros((1, 3))


@pytest.mark.filterwarnings("ignore::physics.SceneWarning")
def test_what_peers_ask_of_a_scene():
    assert (restitution(scenes.drop()), friction(scenes.drop()), gravity(scenes.drop())) == (0.3, 0.5, (0.0, -G, 0.0))
    assert (restitution(scenes.slide()), len(walls(scenes.slide()))) == (0.0, 1)
    bare = physics.Scene([physics.Sphere(1.0, 1.0)], [physics.HalfSpace((0, 1, 0))])
    assert (restitution(bare), friction(bare), gravity(bare), walls(bare)) == (0.0, 0.0, (0.0, 0.0, 0.0), ())
