"""Trajectories as files: samples, events and shapes come back, and other files are refused."""

from __future__ import annotations

import numpy as np
import pytest

import physics
from physics import scenes
from physics.analysis.trajectory import SAMPLES
from physics.analysis.trajectory_arrays import scene_arrays, scene_of

pytestmark = pytest.mark.interpreted

WEDGE = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0.2, 0.2, 0.2))


def zoo() -> physics.Scene:
    """One body of each kind, and a wall that leans."""
    off = physics.Block((1, 2, 3), 2.0, pos=(0, 5, 0), center=(0.1, 0.2, 0.0), inertia_body=np.diag((2.0, 3.0, 4.0)))
    bodies = [off, physics.Sphere(0.5, density=3.0, pos=(4, 5, 0)), physics.Ellipsoid((1, 2, 3), 4.0, pos=(-9, 5, 0)),
              physics.Hull(WEDGE, 1.5, pos=(9, 5, 0))]  # fmt: skip
    return physics.Scene(bodies, [physics.HalfSpace((0.1, 2, 0), 1.0)], [physics.Contact()])


@pytest.fixture(scope="module")
def fall():
    """The block falls without rebound: an impact, then touches."""
    drop = scenes.drop()
    return physics.simulate(physics.Scene(drop.bodies, drop.walls, [physics.Gravity(), physics.Contact()]), 1.2)


def test_samples_and_events_come_back(fall, tmp_path):
    path = tmp_path / "fall.npz"
    fall.to_npz(path)
    read = physics.Trajectory.from_npz(path)
    for name in SAMPLES:
        assert getattr(read, name).tobytes() == getattr(fall, name).tobytes()
    assert read.events == fall.events
    assert len({event.kind for event in read.events}) > 1
    assert read.reports == ()
    assert read.scene.walls == scenes.drop().walls
    assert "121 samples of 1 bodies" in repr(read)


def test_shapes_of_all_kinds_come_back():
    scene, read = zoo(), scene_of(scene_arrays(zoo()))
    assert [body.kind for body in read.bodies] == ["block", "sphere", "ellipsoid", "hull"]
    for body, other in zip(scene.bodies, read.bodies, strict=True):
        assert other.mass == body.mass
        assert other.center == body.center
        for name in ("dimensions", "inertia"):
            assert getattr(other, name) == pytest.approx(getattr(body, name), rel=1e-12)
    assert sorted(map(tuple, np.round(read.bodies[3].polyhedron.vertices, 9))) == sorted(
        map(tuple, np.round(scene.bodies[3].polyhedron.vertices, 9))
    )
    assert read.walls[0].normal == pytest.approx(scene.walls[0].normal)
    assert read.walls[0].offset == scene.walls[0].offset


def test_a_file_of_samples_alone_has_no_scene(fall, tmp_path):
    """As earlier versions wrote it."""
    np.savez(tmp_path / "old.npz", **{name: getattr(fall, name) for name in SAMPLES})
    read = physics.Trajectory.from_npz(tmp_path / "old.npz")
    assert read.scene is None
    assert read.events == ()


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda parts: parts.pop("quat"), "there is no 'quat"),
        (lambda parts: parts.update(pos=parts["pos"][:-1]), "pos of shape"),
        (lambda parts: parts.update(t=parts["t"][::-1].copy()), "its times do not rise"),
        (lambda parts: parts["linvel"].fill(np.nan), "linvel of shape"),
        (lambda parts: parts.update(energy=np.zeros(3)), "energy has shape"),
        (lambda parts: parts.update(scene_arrays(scenes.tower(2))), "its scene has 2 bodies, its samples have 1"),
        (lambda parts: parts["scene_kind"].fill("cube"), "kind 'cube'"),
        (lambda parts: parts.update(event_t=parts["event_t"][1:]), "is no trajectory"),
    ],
)
def test_damaged_files_are_refused(fall, tmp_path, change, told):
    path = tmp_path / "fall.npz"
    fall.to_npz(path)
    parts = dict(np.load(path))
    change(parts)
    np.savez(path, **parts)
    with pytest.raises(ValueError, match=rf"fall.npz is no trajectory.*{told}|{told}.*allowed"):
        physics.Trajectory.from_npz(path)


def test_other_files_are_refused(tmp_path):
    (tmp_path / "x.npz").write_bytes(b"text")
    with pytest.raises(ValueError, match="is no trajectory; allowed"):
        physics.Trajectory.from_npz(tmp_path / "x.npz")
    with pytest.raises(ValueError, match="path is 3; allowed"):
        physics.Trajectory.from_npz(3)
    with pytest.raises(OSError, match="none"):
        physics.Trajectory.from_npz(tmp_path / "none.npz")
