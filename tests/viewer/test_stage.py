"""The stage without a browser: the nodes it makes, and those that it leaves alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rigid_env.rendering import BodyView, WallView
from tests.viewer.looks import BLOCK, busy_look, crowd, look_of

pytest.importorskip("viser")

from rigid_env.rendering import palette
from rigid_env.viewer.servers import server_for_a_while
from rigid_env.viewer.stage import LAYERS, Stage

NODES = {
    "walls": "/scene/walls/0", "contacts": "/scene/contacts", "forces": "/scene/forces",
    "applied": "/scene/applied/force", "velocities": "/scene/velocities", "axes": "/scene/axes",
    "bounds": "/scene/bounds/0", "goal": "/scene/goal/disc", "drag": "/scene/drag", "ghost": "/scene/ghost/0.0",
}  # fmt: skip


@pytest.fixture(scope="module")
def server():
    with server_for_a_while() as server:
        yield server


@pytest.fixture
def stage(server):
    server.scene.reset()
    return Stage(server)


def node(stage, name):
    return stage._scene.get_handle_by_name(name)


def is_shown(stage, name) -> bool:
    found = node(stage, name)
    return found is not None and found.visible


def recorded(server, act) -> bytes:
    """Messages that something sends to whoever is connected."""
    before = server.get_scene_serializer()
    act()
    return before.serialize()


@pytest.mark.parametrize("name", sorted(NODES))
def test_a_layer_comes_and_goes(stage, name):
    stage.show(busy_look())
    for is_on in (True, False, True):
        stage.set_layer(name, is_on)
        assert stage.has_layer(name) == is_on
        assert is_shown(stage, NODES[name]) == is_on


def test_a_layer_that_is_off_stays_off_in_later_looks(stage):
    for name in LAYERS:
        stage.set_layer(name, False)
    stage.show(busy_look())
    stage.show(busy_look())
    assert not any(is_shown(stage, name) for name in NODES.values())
    assert is_shown(stage, "/scene/bodies/0.0")


def test_an_unknown_layer_is_named_with_those_there_are(stage):
    with pytest.raises(ValueError, match=r"^layer is 'contact'; allowed are contacts, "):
        stage.set_layer("contact", True)
    with pytest.raises(ValueError, match=r"^layer is 'x'; allowed are "):
        stage.has_layer("x")


def test_bodies_of_one_shape_are_one_batch(stage, rng):
    bodies = crowd(40, rng)
    stage.show(look_of(bodies))
    batches = {len(node(stage, f"/scene/bodies/{k}.0").batched_positions) for k in range(5)}
    assert batches == {6, 7, 14}
    assert node(stage, "/scene/bodies/5.0") is None
    positions = node(stage, "/scene/bodies/1.0").batched_positions
    members = [k for k, body in enumerate(bodies) if body.kind in ("sphere", "ellipsoid")]
    expected = stage.placement.drawn([bodies[k].pos for k in members])
    np.testing.assert_array_equal(positions, expected)


def test_parts_of_compounds_are_drawn_as_solids_of_their_body(stage):
    parts = (replace(BLOCK, pos=(0.0, 1.0, 0.0)), replace(BLOCK, pos=(0.0, -1.0, 0.0)))
    whole = BodyView("compound", (3.0, 3.0, 3.0), (1.0, 5.0, 0.0), (0.6, 0.0, 0.0, 0.8), parts=parts)
    stage.show(look_of([BLOCK, whole], is_asleep=np.array([False, True])))
    blocks = node(stage, "/scene/bodies/0.0")
    expected = stage.placement.drawn([BLOCK.pos, *(solid.pos for solid in whole.solids)])
    np.testing.assert_allclose(blocks.batched_positions, expected, atol=1e-6)
    awake, first, second = blocks.batched_colors.astype(int)
    np.testing.assert_array_equal(first, second)
    assert np.ptp(first) < 0.5 * np.ptp(awake)


def test_a_later_look_moves_the_same_nodes(stage):
    stage.show(look_of())
    solid = node(stage, "/scene/bodies/0.0")
    moved = replace(
        BLOCK, pos=np.add(BLOCK.pos, (1.0, 2.0, 3.0)), quat=(0.0, 1.0, 0.0, 0.0), dimensions=(4.0, 3.0, 2.0)
    )
    stage.show(look_of([moved]))
    assert node(stage, "/scene/bodies/0.0") is solid
    np.testing.assert_allclose(stage.placement.world(solid.batched_positions[0]), moved.pos, atol=1e-5)
    np.testing.assert_array_equal(solid.batched_wxyzs[0], (0.0, 1.0, 0.0, 0.0))
    np.testing.assert_allclose(solid.batched_scales[0] / stage.placement.scale, (4.0, 3.0, 2.0), rtol=1e-6)


def test_the_same_look_sends_nothing(stage, server, rng):
    stage.show(replace(busy_look(), frame=busy_look().frame))
    look = look_of(crowd(8, rng), contact_points=np.ones((2, 3)), contact_forces=9.0 * np.ones((2, 3)))
    stage.show(look)
    assert recorded(server, lambda: stage.show(look)) == recorded(server, lambda: None)
    assert recorded(server, lambda: stage.show(look_of())) != recorded(server, lambda: None)


def test_another_number_of_bodies_makes_new_batches(stage, rng):
    for count in (1, 7, 0, 3):
        stage.show(look_of(crowd(count, rng)))
        stage.set_layer("axes", True)
        stage.set_layer("bounds", True)
        if count:
            assert len(node(stage, "/scene/bodies/0.0").batched_positions) == -(-count // 5)
            assert len(node(stage, "/scene/axes").batched_positions) == count
        else:
            assert node(stage, "/scene/bodies/0.0") is None


def test_sleeping_bodies_are_paler(stage):
    bodies = [BLOCK, replace(BLOCK, pos=(9.0, 1.5, 0.0), colour=BLOCK.colour or palette.BODIES[0])]
    look = look_of(bodies, is_asleep=np.array([True, False]))
    stage.show(look)
    asleep, awake = node(stage, "/scene/bodies/0.0").batched_colors.astype(int)
    assert np.ptp(asleep) < 0.5 * np.ptp(awake)
    stage.set_layer("sleeping", False)
    first, second = node(stage, "/scene/bodies/0.0").batched_colors
    np.testing.assert_array_equal(first, second)


def test_other_walls_make_another_room_and_the_layers_stay(stage):
    stage.show(busy_look())
    stage.set_layer("velocities", True)
    stage.set_layer("contacts", False)
    walled = busy_look()
    walls = (*walled.frame.walls, WallView((1.0, 0.0, 0.0), -9.0), WallView((0.0, 0.6, 0.8), -5.0))
    stage.show(replace(walled, frame=replace(walled.frame, walls=walls)))
    assert is_shown(stage, "/scene/walls/1")
    assert is_shown(stage, "/scene/velocities")
    assert not is_shown(stage, "/scene/contacts")


def test_a_scene_without_walls_or_bodies_is_drawn(stage):
    stage.show(look_of([], walls=()))
    stage.show(look_of([BLOCK], walls=()))
    assert is_shown(stage, "/scene/bodies/0.0")


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_a_scene_of_any_size_is_drawn_as_large(stage, size):
    body = replace(BLOCK, dimensions=size * BLOCK.dimensions, pos=size * BLOCK.pos)
    stage.show(look_of([body]))
    eye = stage.placement.drawn(stage.placement.camera.eye) - stage.placement.drawn(stage.placement.camera.target)
    assert np.linalg.norm(eye) == pytest.approx(12.0, rel=1e-5)


def test_a_followed_body_stays_over_the_middle(stage):
    stage.show(look_of())
    stage.follow(0)
    for x in (0.0, 3.0, -40.0):
        stage.show(look_of([replace(BLOCK, pos=(x, 2.5, 1.0))]))
        drawn = node(stage, "/scene/bodies/0.0").batched_positions[0] + node(stage, "/scene").position
        np.testing.assert_allclose(drawn[[0, 2]], 0.0, atol=1e-5)
    stage.follow(None)
    np.testing.assert_array_equal(node(stage, "/scene").position, 0.0)


@pytest.mark.parametrize("body", [1, -1, "0", True])
def test_a_body_that_is_not_there_cannot_be_followed(stage, body):
    stage.show(look_of())
    with pytest.raises(ValueError, match=r"^body is .*; allowed are indices from 0 to 0"):
        stage.follow(body)


class Event:
    """Drag or click, as viser tells of it."""

    def __init__(self, phase="start", start=(0.0,) * 3, end=(0.0,) * 3, origin=None, direction=None):
        self.phase, self.start_position, self.end_position = phase, start, end
        self.ray_origin, self.ray_direction = origin, direction


def test_a_drag_keeps_the_point_that_was_grabbed(stage):
    found = []
    stage.on_drag(lambda *drag: found.append(drag))
    stage.show(look_of())
    grip = np.add(BLOCK.pos, (0.4, 0.3, 0.2))
    stage._drag("start", 0, Event(start=stage.placement.drawn(grip), end=stage.placement.drawn(grip)))
    stage.show(look_of([replace(BLOCK, pos=np.add(BLOCK.pos, (1.0, 0.0, 0.0)))]))
    stage._drag("update", 0, Event(start=stage.placement.drawn(grip), end=stage.placement.drawn((3.0, 4.0, 5.0))))
    stage._drag("end", 0, Event(start=stage.placement.drawn(grip), end=stage.placement.drawn((3.0, 4.0, 5.0))))
    assert [phase for phase, *_ in found] == ["start", "update", "end"]
    np.testing.assert_array_equal(found[0][2], found[1][2])
    np.testing.assert_allclose(np.linalg.norm(found[0][2]), np.linalg.norm((0.4, 0.3, 0.2)), rtol=1e-5)
    np.testing.assert_allclose(found[1][3], (3.0, 4.0, 5.0), atol=1e-5)


def test_a_click_tells_the_point_of_the_surface(stage):
    found = []
    stage.on_click(lambda *click: found.append(click))
    stage.show(look_of([replace(BLOCK, quat=(1.0, 0.0, 0.0, 0.0))]))
    above = stage.placement.drawn((0.5, 20.0, 0.25))
    stage._click(0, Event(origin=above, direction=(0.0, -3.0, 0.0)))
    stage._click(0, Event(origin=above, direction=(0.0, 3.0, 0.0)))
    ((body, point, direction),) = found
    assert body == 0
    np.testing.assert_allclose(point, (0.5, 4.0, 0.25), atol=1e-5)
    np.testing.assert_array_equal(direction, (0.0, -1.0, 0.0))
