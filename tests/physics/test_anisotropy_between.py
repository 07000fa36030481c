"""Friction with two coefficients between bodies and in the frames of bodies: against walls, and against DOP853."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import physics

pytestmark = pytest.mark.interpreted

G = 9.81
MU = (0.2, 0.5)
AXIS = (1, 0, 0.5)
FLOOR = physics.HalfSpace((0, 1, 0))
TURN = 0.35


def slab(**start) -> physics.Block:
    return physics.Block((1, 0.2, 1), 2.0, **{"pos": (0, 0.1, 0), "linvel": (1, 0, 2), **start})


def ball(**start) -> physics.Sphere:
    return physics.Sphere(0.5, 2.0, **{"pos": (0, 0.5, 0), "linvel": (1, 0, 2), **start})


def table(**options) -> physics.Block:
    return physics.Block((8, 1, 8), fixed=True, pos=(0, -0.5, 0), **options)


def ground(kind: str, body: physics.Body, **options) -> physics.World:
    """World of a body on a wall, on a fixed block, on one with an axis of its own, or on one 1e9 times heavier."""
    friction = physics.Friction(MU, axis=AXIS)
    scene: dict = {"bodies": [body], "walls": [FLOOR]}
    if kind == "fixed":
        scene = {"bodies": [body, table()]}
    elif kind == "own":  # the block is turned by 2 TURN about y, and its axis in its own frame back
        c, s = math.cos(2 * TURN), math.sin(2 * TURN)
        own = (c * AXIS[0] - s * AXIS[2], 0, s * AXIS[0] + c * AXIS[2])
        friction = physics.Friction(MU, axis=(0, 0, 1), body_axes={"table": own})
        scene = {"bodies": [body, table(quat=(math.cos(TURN), 0, math.sin(TURN), 0), name="table")]}
    elif kind == "heavy":
        heavy = physics.Block((8, 1, 8), 2e9, pos=(0, -0.5, 0))
        scene = {"bodies": [body, heavy], "walls": [physics.HalfSpace((0, 1, 0), -1.0)]}
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(), friction]
    return physics.World(physics.Scene(**scene, effects=effects), **options)


@pytest.mark.parametrize(
    ("kind", "body", "accuracy", "bound"),
    [
        ("heavy", slab(), "balanced", 1e-6),
        pytest.param("fixed", ball(), "precise", 1e-8, marks=pytest.mark.exhaustive),
        pytest.param("own", ball(), "precise", 1e-8, marks=pytest.mark.exhaustive),
    ],
)
def test_a_body_slides_on_a_body_as_on_a_wall(kind, body, accuracy, bound):
    """Places after 0.1 s. At `balanced` both solves leave 1e-6 of the speed of 2.24 m/s, over 0.1 s.

    Where both bodies move, friction opposes the slip at the end of a step, as that of a face at a wall does.
    """
    dt = 0.005 if accuracy == "balanced" else 0.05
    worlds = [ground(each, body, dt=dt, accuracy=accuracy) for each in ("wall", kind)]
    for each in worlds:
        assert each.step(steps=round(0.1 / dt)).ok
    assert np.abs(worlds[0].pos[0, 0] - worlds[1].pos[0, 0]).max() < bound
    assert np.abs(worlds[0].linvel[0, 0] - worlds[1].linvel[0, 0]).max() < 10 * bound
    assert abs(worlds[1].linvel[0, 0, 0] / worlds[1].linvel[0, 0, 2] - 0.5) > 0.02  # not the way of one coefficient


@pytest.mark.parametrize("kind", ["fixed", "own", "heavy"])
@pytest.mark.parametrize(("direction", "mu"), [((1, 0, 0.5), MU[0]), ((-0.5, 0, 1), MU[1])])
def test_both_coefficients_slow_a_body_on_a_body(kind, direction, mu):
    """Along the axis and across it the way is straight: v t - μ g t²/2, to the tolerance of the solve."""
    v, t = 2 * np.array(direction), 0.1
    built = ground(kind, slab(linvel=v), dt=0.005)
    assert built.step(steps=round(t / 0.005)).ok
    unit = v / np.linalg.norm(v)
    assert built.pos[0, 0] - [0, 0.1, 0] == pytest.approx(v * t - mu * G * t * t / 2 * unit, abs=1e-6)
    assert built.linvel[0, 0] == pytest.approx(v - mu * G * t * unit, abs=1e-5)


def test_a_face_on_a_fixed_body_is_of_second_order():
    """Friction opposes the mean slip of a stage there; at a wall that of its end, with an error of 4e-4 m here."""
    true = ground("wall", slab(), dt=0.05, accuracy="precise")
    true.step(steps=6)
    errors = []
    for dt in (0.02, 0.01):
        built = ground("fixed", slab(), dt=dt)
        built.step(steps=round(0.3 / dt))
        errors.append(np.abs(built.pos[0, 0] - true.pos[0, 0]).max())
    assert errors[0] < 3e-4
    assert 3 < errors[0] / errors[1] < 5


def slides(axis, mu, r, m, v, w, t):
    """Place and velocity of a sliding ball whose axis of friction turns with it, by DOP853 to 1e-13."""
    n = np.array([0.0, 1.0, 0.0])

    def rates(_, y):
        v, w, d = y[3:6], y[6:9], y[9:12]
        along = d - (d @ n) * n
        along /= np.linalg.norm(along)
        across = np.cross(n, along)
        u = v - r * np.cross(w, n)
        a, b = mu[0] ** 2 * (u @ along), mu[1] ** 2 * (u @ across)
        size = math.hypot(mu[0] * (u @ along), mu[1] * (u @ across))
        f = -m * G * (a * along + b * across) / size
        return np.concatenate([v, f / m, np.cross(-r * n, f) / (0.4 * m * r * r), np.cross(w, d)])

    start = np.concatenate([[0, r, 0], v, w, axis])
    end = solve_ivp(rates, (0, t), start, method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
    return end[:3], end[3:6]


@pytest.mark.parametrize("on", ["wall", pytest.param("fixed", marks=pytest.mark.exhaustive)])
def test_an_axis_turns_with_its_body(on):
    """A ball that slides and spins has turned by half a radian after 0.05 s; to the tolerance of `precise`."""
    r, m, v, w, t = 0.5, 2.0, (3.0, 0, 1.0), (0.5, 10.0, 1.0), 0.05
    place, velocity = slides((0.6, 0.0, 0.8), MU, r, m, v, w, t)
    ball = physics.Sphere(r, m, pos=(0, r, 0), linvel=v, angvel=w)
    friction = physics.Friction(MU, axis=(1, 0, 0), body_axes={0: (0.6, 0, 0.8)})
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(), friction]
    bodies, walls = ([ball], [FLOOR]) if on == "wall" else ([ball, table()], [])
    built = physics.World(physics.Scene(bodies, walls, effects), dt=0.025, accuracy="precise")
    assert built.step(steps=2).ok
    assert built.pos[0, 0] == pytest.approx(place, abs=1e-8)
    assert built.linvel[0, 0] == pytest.approx(velocity, abs=1e-8)


def test_equal_coefficients_are_one_coefficient():
    """A stretch by 1 changes tangents only: the motions agree to the tolerance of the solve."""
    effects = [physics.Gravity((0, -G, 0)), physics.Contact()]
    ends = []
    for friction in (physics.Friction(0.3), physics.Friction((0.3, 0.3), axis=AXIS, body_axes={0: (1, 0, 3)})):
        built = physics.World(physics.Scene([slab(), table()], (), [*effects, friction]), dt=0.01)
        built.step(steps=20)
        ends.append(built.pos[0, 0].copy())
    assert np.abs(ends[0] - ends[1]).max() < 1e-6


def test_coefficients_of_single_worlds():
    """A world with other coefficients slides as a scene that declares them."""
    other = physics.Friction((0.4, 0.3), axis=AXIS)
    pair, alone = ground("fixed", slab(), worlds=2, dt=0.01), ground("fixed", slab(), dt=0.01)
    pair.set_parameters(effects=[other], worlds=[1])
    alone.set_parameters(effects=[other])
    for each in (pair, alone):
        each.step(steps=20)
    assert (pair.pos[1] == alone.pos[0]).all()
    assert (pair.pos[0] != alone.pos[0]).any()


def test_a_scene_file_keeps_the_axes(tmp_path):
    friction = physics.Friction(MU, axis=AXIS, body_axes={"ski": (1, 0, 2), 1: (0, 0, 1)})
    scene = physics.Scene([slab(name="ski"), table()], effects=[physics.Contact(), friction])
    physics.save_scene(scene, tmp_path / "scene.toml")
    assert physics.load_scene(tmp_path / "scene.toml") == scene
    assert eval(repr(friction), {"Friction": physics.Friction}) == friction


def scene_with(friction, *bodies) -> physics.Scene:
    return physics.Scene(bodies or [slab(), table()], [FLOOR], [physics.Contact(), friction])


BAD = [
    (lambda: physics.Friction(0.3, body_axes={0: (1, 0, 0)}), "Friction.body_axes is .*; allowed with one coefficient"),
    (lambda: physics.Friction(MU, AXIS, body_axes={0: (0, 0, 0)}), r"body_axes\[0\] is .*; allowed is any vector but"),
    (
        lambda: physics.Friction(MU, AXIS, body_axes={1.5: (1, 0, 0)}),
        "holds the body 1.5; allowed are names and indice",
    ),
    (lambda: physics.Friction(MU, AXIS, body_axes="ski"), "Friction.body_axes is 'ski'; allowed is a dict of bodies"),
    (lambda: physics.Friction(MU, AXIS, body_axes=[(0, AXIS), (0, AXIS)]), "holds the body 0 twice"),
    (lambda: physics.Friction(MU, AXIS, body_axes=[0]), "Friction.body_axes holds 0; allowed is a dict"),
    (lambda: scene_with(physics.Friction(MU, AXIS, body_axes={"sky": AXIS})), "holds the end 'sky'; allowed are"),
    (lambda: scene_with(physics.Friction(MU, AXIS, body_axes={-1: AXIS})), "holds -1, a wall; allowed are bodies"),
    (
        lambda: scene_with(physics.Friction(MU, AXIS, body_axes={"ski": AXIS, 0: AXIS}), slab(name="ski"), table()),
        "holds the body 0 twice",
    ),
    (
        lambda: physics.World(scene_with(physics.Friction(MU, [AXIS]))),
        r"Friction.axis has a direction for each wall, and Scene.bodies\[0\] may touch other bodies; allowed is one",
    ),
]


@pytest.mark.parametrize(("make", "message"), BAD)
def test_it_says_what_is_wrong(make, message):
    with pytest.raises(ValueError, match=message):
        make()
