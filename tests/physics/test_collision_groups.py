"""Collision groups: which pairs touch, in motion at every scheme, in plans, files, snapshots, errors and MJCF."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import physics
from physics import Block, Contact, Friction, Gravity, HalfSpace, Scene, Sphere, World
from physics.io.toml import from_toml, to_toml
from physics.kernels.multibody.data.allocation import make_bodies_workspace
from physics.kernels.multibody.data.collision_groups import share_group
from physics.kernels.state.layout import WALL_SIZE
from physics.plan.plan import make_plan
from physics.scene.groups import GROUP, MASK, assign_groups, group_table, may_touch, touching_pairs
from tests.kernels.called import called

pytestmark = pytest.mark.interpreted

LAWS = [Gravity(), Contact(), Friction(0.5)]
FLOOR = HalfSpace((0, 1, 0), group=0b11)
BOX = Block((1, 0.5, 0.7), 2.0, pos=(0, 0.25, 0))
GHOST = Sphere(0.3, 1.0, pos=(0, 0.8, 0), group=0b10, mask=0b10)
BITS = st.integers(0, 0b111) | st.integers(0, MASK)


def settled(scene, accuracy="balanced", time=0.6):
    """Places of the bodies after a while [m]."""
    world = World(scene, dt=0.02, accuracy=accuracy)
    world.step(steps=round(time / world.dt))
    assert world.report.ok
    return world.pos[0]


# --- the rule ---------------------------------------------------------------------------------------------------------


@settings(max_examples=10)  # the workspace takes most of the time
@given(st.lists(st.tuples(BITS, BITS), min_size=2, max_size=8), st.integers(1, 4))
def test_two_ends_touch_if_each_has_a_group_of_the_others_mask(rows, bodies):
    """The kernel, the table of a scene and a plain sentence agree for all bits, and the rule is symmetric."""
    bodies = min(bodies, len(rows))
    table = np.array(rows, np.int64)
    walls = np.zeros((len(rows) - bodies, WALL_SIZE))
    many = make_bodies_workspace(bodies, walls, groups=table, relative_slop=1e-6)
    found = may_touch(table, len(rows))
    assert (found == found.T).all()
    for b in range(bodies):
        for end in (*range(bodies), *(-1 - k for k in range(len(rows) - bodies))):
            row = end if end >= 0 else bodies - 1 - end
            (group, mask), (other_group, other_mask) = rows[b], rows[row]
            expected = bool(group & other_mask) and bool(mask & other_group)
            assert found[b, row] == expected
            assert called(share_group, b, end, many) == expected


@given(st.integers(1, 12), st.randoms(use_true_random=False))
def test_groups_are_found_for_any_pairs(count, random):
    """A symmetric table of pairs, each part of one of some kinds, comes back from the groups that are assigned."""
    kinds = [random.randrange(8) for _ in range(count)]
    meet = {(a, b) for a in range(8) for b in range(a, 8) if random.random() < 0.5}
    table = np.array([[(min(a, b), max(a, b)) in meet for b in kinds] for a in kinds])
    found = assign_groups(table)
    assert (may_touch(np.array(found), count) == table).all()
    assert len({group for group, _ in found}) <= 8


def test_more_than_32_kinds_have_no_groups():
    assert assign_groups(np.eye(32, dtype=bool)) is not None
    assert assign_groups(np.eye(33, dtype=bool)) is None


# --- motion -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("accuracy", ["balanced", "precise"])
def test_bodies_of_other_groups_pass_through_each_other(accuracy):
    """A ball falls through a box to the floor, which is of both groups; a second ball rests on the box."""
    ball = Sphere(0.3, 1.0, pos=(0, 0.8, 0))
    heights = settled(Scene([BOX, GHOST], [FLOOR], LAWS), accuracy)[:, 1]
    assert heights == pytest.approx([0.25, 0.3], abs=1e-5)
    if accuracy == "balanced":  # with a pair that touches, contact asks for groups
        heights = settled(Scene([BOX, GHOST, ball], [FLOOR], LAWS))[:, 1]
        assert heights == pytest.approx([0.25, 0.3, 0.8], abs=1e-4)


def test_a_body_falls_through_a_wall_of_another_group():
    """It falls freely, and may start deep inside; the others stay on the wall."""
    through = replace(GHOST, pos=(2, -3.0, 0))
    scene = Scene([BOX, through], [HalfSpace((0, 1, 0))], LAWS)
    places = settled(scene, time=0.4)
    assert places[:, 1] == pytest.approx([0.25, -3.0 - 0.5 * 9.81 * 0.16], abs=1e-6)
    gaps = physics.diagnose(World(scene)).gap[0]
    assert gaps[0] == pytest.approx(0.0, abs=1e-12)
    assert gaps[1] > 1e100
    with pytest.raises(ValueError, match=r"body 1 in world 0 is 3.3 m inside walls\[0\]"):
        World(replace(scene, walls=(FLOOR,)))


def test_a_hull_touches_only_walls_of_its_group():
    points = [(x, y, z) for x in (-1, 1) for y in (-0.2, 0.2) for z in (-1, 1)]
    hull = physics.Hull(points, 1.0, pos=(0, 0.2, 0), mask=0b1)
    walls = [HalfSpace((0, 1, 0)), HalfSpace((1, 0, 0), 5.0, group=0b10)]
    assert settled(Scene([hull], walls, LAWS), time=0.1)[0] == pytest.approx((0, 0.2, 0), abs=1e-6)
    with pytest.raises(ValueError, match=r"inside walls\[1\]"):
        World(Scene([replace(hull, mask=MASK)], walls, LAWS))


def test_a_fixed_body_holds_its_groups_alone():
    table = Block((4, 1, 4), fixed=True, pos=(0, -0.5, 0), group=0b11)
    net = Block((4, 0.1, 4), fixed=True, pos=(0, 1.0, 0), group=0b10)
    bodies = [table, net, replace(BOX, pos=(0, 2, 0), mask=0b01), replace(BOX, pos=(1.5, 2, 0))]
    places = settled(Scene(bodies, effects=LAWS), time=1.0)
    assert places[2:, 1] == pytest.approx([0.25, 1.3], abs=1e-3)


def test_all_apart_is_contact_with_walls_alone():
    """The same plan, so the same bits, and the fast scheme for a body alone."""
    ball = replace(GHOST, pos=(0.2, 0.9, 0.1))
    apart = Scene([BOX, ball], [FLOOR], LAWS)
    alone = Scene(
        [BOX, replace(ball, group=GROUP, mask=MASK)],
        [HalfSpace((0, 1, 0))],
        [Gravity(), Contact(between_bodies=False), Friction(0.5)],
    )
    assert make_plan(apart, "balanced").key == make_plan(alone, "balanced").key
    assert settled(apart).tobytes() == settled(alone).tobytes()


def test_groups_that_keep_nothing_apart_are_not_asked():
    bodies = [replace(BOX, group=0b10), replace(GHOST, mask=0b11)]
    plan, plain = (make_plan(Scene(each, [FLOOR], LAWS), "balanced") for each in (bodies, [BOX, Sphere(0.3, 1.0)]))
    assert plan.key == plain.key
    assert not plan.grouped


def test_only_bodies_that_touch_need_places_of_their_own():
    """A third body in the place of two that pass through each other is still seen."""
    place = {"pos": (0, 2, 0)}
    one, ghost, other = replace(BOX, **place), replace(GHOST, **place), Sphere(0.2, 1.0, **place)
    World(Scene([one, ghost, Sphere(0.2, 1.0, pos=(3, 2, 0))], [FLOOR], LAWS))
    with pytest.raises(ValueError, match="bodies 0 and 2 in world 0 have their centres in the same place"):
        World(Scene([one, ghost, other], [FLOOR], LAWS))


# --- descriptions -----------------------------------------------------------------------------------------------------


def test_the_plan_tells_how_many_pairs_are_apart():
    scene = Scene([BOX, GHOST, replace(GHOST, pos=(3, 1, 0))], [FLOOR, HalfSpace((1, 0, 0), -9)], LAWS)
    text = make_plan(scene, "balanced").explain()
    assert "bits keep apart 2 pair(s) of bodies and 2 of a body and a wall" in text
    assert "collision groups" not in make_plan(Scene([BOX], [HalfSpace((0, 1, 0))], LAWS), "balanced").explain()
    nothing = Scene([GHOST], [HalfSpace((0, 1, 0))], LAWS)
    assert "groups keep all bodies from all walls" in make_plan(nothing, "balanced").explain()
    assert "groups keep all bodies apart" in make_plan(Scene([BOX, GHOST], [FLOOR], LAWS), "balanced").explain()


def test_files_and_reprs_hold_what_was_given():
    scene = Scene([BOX, GHOST], [FLOOR], LAWS)
    text = to_toml(scene)
    assert from_toml(text) == scene
    assert "mask = 2" in text
    assert eval(repr(GHOST), vars(physics)) == GHOST
    assert repr(FLOOR) == "HalfSpace(normal=(0.0, 1.0, 0.0), offset=0.0, group=3)"
    assert "group" not in repr(BOX)
    with pytest.raises(ValueError, match=r"scene, line \d+: bodies\[1\]: Sphere.mask is -2; allowed are whole numbers"):
        from_toml(text.replace("mask = 2", "mask = -2"))


def test_a_snapshot_does_not_fit_into_other_groups():
    snapshot = World(Scene([BOX, GHOST], [FLOOR], LAWS)).snapshot()
    with pytest.raises(ValueError, match="snapshot is of another scene"):
        World(Scene([BOX, replace(GHOST, mask=0b11)], [FLOOR], LAWS)).restore(snapshot)
    with pytest.raises(ValueError, match="snapshot is of another scene"):
        World(Scene([BOX, GHOST], [replace(FLOOR, group=1)], LAWS)).restore(snapshot)


@pytest.mark.parametrize("value", [-1, 2**32, 1.0, True, "1", None])
@pytest.mark.parametrize("name", ["group", "mask"])
def test_what_is_no_set_of_bits_is_refused(name, value):
    allowed = "allowed are whole numbers from 0 to 4294967295"
    with pytest.raises(ValueError, match=rf"^Sphere.{name} is .*; {allowed}"):
        Sphere(1, 1, **{name: value})
    with pytest.raises(ValueError, match=rf"^HalfSpace.{name} is .*; {allowed}"):
        HalfSpace((0, 1, 0), **{name: value})


def test_no_other_engine_gets_a_scene_without_its_groups():
    from rigid_env.lab.measure.peers.contender import Unsupported, walls

    with pytest.raises(Unsupported, match="collision groups"):
        walls(Scene([BOX, GHOST], [FLOOR], LAWS))


# --- MJCF -------------------------------------------------------------------------------------------------------------


def same_pairs(scene: Scene, other: Scene) -> bool:
    contact, count = scene.effect(Contact), len(scene.bodies)
    tables = [touching_pairs(each, contact.between_bodies) for each in (scene, other)]
    bodies_alike = np.array_equal(*(np.triu(table[:, :count]) for table in tables))
    return bodies_alike and np.array_equal(*(table[:, count:] for table in tables))


def test_mjcf_keeps_the_pairs_in_both_readers():
    from physics.io.mjcf import plain_reader
    from physics.io.mjcf.files import from_mjcf
    from physics.io.mjcf.text import parse
    from physics.io.mjcf.writer import to_mjcf

    pytest.importorskip("mujoco")
    bodies = [BOX, GHOST, replace(GHOST, pos=(3, 1, 0)), Sphere(0.2, 1.0, pos=(5, 1, 0), mask=0b100),
              Block((1, 1, 1), fixed=True, pos=(9, 0, 0), group=0b100)]  # fmt: skip
    scene = Scene(bodies, [FLOOR, HalfSpace((1, 0, 0), -9, group=0b100)], LAWS)
    text = to_mjcf(scene)
    for read in (from_mjcf, lambda text: plain_reader.read_scene(parse(text))):
        assert same_pairs(scene, read(text))
    with pytest.raises(ValueError, match="more than 31 kinds"):
        to_mjcf(Scene([Sphere(0.1, 1.0, pos=(k, 1, 0), group=1 << k, mask=1 << k) for k in range(32)], [], LAWS))


@given(st.lists(st.tuples(st.integers(0, 7), st.integers(0, 7)), min_size=2, max_size=5))
def test_masks_of_mujoco_say_the_same(masks):
    """A plane and balls with random masks: pairs touch as MuJoCo's rule says, in which either mask is enough."""
    from physics.io.mjcf.files import from_mjcf

    pytest.importorskip("mujoco")
    kinds = [f'contype="{one}" conaffinity="{other}"' for one, other in masks]
    balls = "".join(
        f'<body pos="{k} 0 1"><freejoint/><geom type="sphere" size=".1" {bits}/></body>'
        for k, bits in enumerate(kinds[1:])
    )
    plane = f'<geom type="plane" size="1 1 1" {kinds[0]}/>'
    scene = from_mjcf(f"<mujoco><worldbody>{plane}{balls}</worldbody></mujoco>")

    def touch(i, j):
        return bool(masks[i][0] & masks[j][1] or masks[j][0] & masks[i][1])

    contact, count = scene.effect(Contact), len(scene.bodies)
    table = group_table(scene)
    found = np.ones((count, count + len(scene.walls)), bool) if table is None else may_touch(table, count)
    for b in range(count):
        assert (contact is not None and bool(scene.walls) and found[b, -1]) == touch(b + 1, 0)
        for other in range(b):
            is_on = contact is not None and contact.between_bodies and found[b, other]
            assert is_on == touch(b + 1, other + 1)
