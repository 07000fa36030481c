"""Snapshots as files: the same bits, and no other file is taken for one."""

from __future__ import annotations

import dataclasses
import json
import zipfile

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import physics
from physics.world.snapshot import KEPT
from tests.physics.test_restore import CASES, advanced, blocks, go_on, lagging, pushes


@pytest.mark.parametrize("name", CASES)
def test_a_world_goes_on_from_a_file_bit_for_bit(name, tmp_path):
    source = advanced(name)
    kept = source.snapshot()
    assert kept.save(tmp_path / "kept.npz") == tmp_path / "kept.npz"
    read = physics.Snapshot.load(str(tmp_path / "kept.npz"))
    for array, value in zip(read.arrays, kept.arrays, strict=True):
        assert array.dtype == value.dtype
        np.testing.assert_array_equal(array.view(np.int64), value.view(np.int64))
    assert (read.time, read.compiler, read.worlds) == (kept.time, kept.compiler, 3)
    batch = CASES[name][0](3)
    batch.restore(read)
    go_on(batch, [0, 1, 2], source, [0, 1, 2])
    assert batch.time == source.time


def test_commands_on_their_way_are_in_the_file(tmp_path):
    source = advanced("an actuator with memory")
    output, late = source.snapshot().actuation
    read = physics.Snapshot.load(source.snapshot().save(tmp_path / "kept.npz"))
    assert len(late) > 1
    np.testing.assert_array_equal(read.actuation[0], output)
    for (given_at, command), (moment, held) in zip(read.actuation[1], late, strict=True):
        assert given_at == moment
        np.testing.assert_array_equal(command, held)
    fresh = physics.Snapshot.load(lagging(2).snapshot().save(tmp_path / "fresh.npz"))  # nothing on its way
    assert fresh.actuation[1] == []
    lagging(2).restore(fresh)


def test_a_file_of_the_first_format_goes_on(tmp_path):
    """It has the times of commands instead of their ages, and no scene."""
    source = advanced("an actuator with memory")
    with np.load(source.snapshot().save(tmp_path / "kept.npz")) as file:
        parts = dict(file)
    head = json.loads(str(parts["head"]))
    del head["scene"]
    parts["actuator_times"] = parts["time"] - parts.pop("actuator_ages")
    np.savez(tmp_path / "kept.npz", **{**parts, "head": json.dumps({**head, "format": 1})})
    batch = lagging(3)
    batch.restore(physics.Snapshot.load(tmp_path / "kept.npz"))
    for k in range(10):
        batch.step(pushes(batch, k))
        source.step(pushes(batch, k))
    np.testing.assert_allclose(batch.state, source.state, rtol=0, atol=1e-13)  # ages by a rounding of the time


def test_the_compiler_is_in_the_file(tmp_path):
    other = dataclasses.replace(blocks(1).snapshot(), compiler="numba")
    assert "compiler=numba" in repr(physics.Snapshot.load(other.save(tmp_path / "kept.npz")))


def rewritten(path, **changes):
    """A file of a snapshot with other parts; None leaves one out."""
    with np.load(blocks(2).snapshot().save(path)) as file:
        parts = dict(file)
    head = {**json.loads(str(parts["head"])), **changes.pop("head", {})}
    parts = {**parts, "head": json.dumps(head), **changes}
    np.savez(path, **{name: part for name, part in parts.items() if part is not None})
    return path


class Loud:
    """A thing that runs code when it is unpickled."""

    def __reduce__(self):
        return print, ("code of a file was run",)


def with_head(**changes):
    return lambda path: rewritten(path, head=changes)


FOREIGN = {
    "newer": (with_head(format=3), "has format 3; allowed are formats up to 2"),
    "no compiler": (with_head(compiler=7), r"\(compiler of its head is 7; allowed is the name"),
    "no scene": (with_head(scene=["a"]), r"\(scene of its head is \['a'\]; allowed is null and"),
    "half a scene": (with_head(scene={"walls": 3}), r"\(scene of its head is {'walls': 3}; allowed"),
    "another kind": (with_head(kind="recording"), r"is no snapshot \(it is a recording\)"),
    "no format": (with_head(format="1"), r"\(format of its head is '1'; allowed is an integer"),
    "no state": (lambda path: rewritten(path, state=None), r"is no snapshot \(there is no 'state.*'\); allowed is"),
    "no axes": (lambda path: rewritten(path, memory=np.zeros(4)), r"\(memory has shape \(4,\)\)"),
    "other rows": (lambda path: rewritten(path, params=np.zeros((3, 35))), r"\(params has shape \(3, 35\)\)"),
    "other columns": (lambda path: rewritten(path, state=np.zeros((2, 9))), r"\(state has 9 columns instead of 16\)"),
    "other numbers": (lambda path: rewritten(path, gravity=np.zeros((2, 3), np.float32)), "than 64-bit floats"),
    "no time": (lambda path: rewritten(path, time=np.nan), r"\(its time is nan; allowed are finite numbers\)"),
    "half an actuator": (lambda path: rewritten(path, actuator_output=np.zeros((2, 6))), "there is no 'actuator_ages"),
    "a pickle": (lambda path: rewritten(path, memory=np.array([Loud()])), r"allow_pickle=False"),
    "text": (lambda path: path.write_text("state"), "is no snapshot; allowed is what Snapshot.save writes"),
    "nothing": (lambda path: path.write_bytes(b""), "is no snapshot; allowed is what Snapshot.save writes"),
    "another zip": (lambda path: zipfile.ZipFile(path, "w").writestr("a.txt", "a"), "is no snapshot"),
}  # fmt: skip


@pytest.mark.parametrize("name", FOREIGN)
def test_what_is_no_snapshot_is_refused_and_nothing_of_it_runs(name, tmp_path, capsys):
    make, message = FOREIGN[name]
    path = tmp_path / "file.npz"
    make(path)
    with pytest.raises(ValueError, match=message) as caught:
        physics.Snapshot.load(path)
    assert str(path) in str(caught.value)
    assert "code of a file" not in capsys.readouterr().out


def test_a_recording_is_none(tmp_path):
    world = blocks(2)
    recorder = physics.Recorder(world)
    world.step()
    with pytest.raises(ValueError, match="is no snapshot"):
        physics.Snapshot.load(recorder.save(tmp_path / "recording.npz"))


@pytest.mark.parametrize("path", [None, 3, ""])
def test_a_path_is_needed(path):
    for call in (blocks(1).snapshot().save, physics.Snapshot.load):
        with pytest.raises(ValueError, match=r"path is .*; allowed is the path of a file"):
            call(path)


def test_a_file_that_is_not_there_is_an_error_of_the_system(tmp_path):
    with pytest.raises(FileNotFoundError):
        physics.Snapshot.load(tmp_path / "none.npz")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A snapshot, its file as bytes, and a place for damaged ones."""
    folder = tmp_path_factory.mktemp("damaged")
    kept = advanced("an actuator with memory").snapshot()
    return kept, kept.save(folder / "whole.npz").read_bytes(), folder / "damaged.npz"


@given(data=st.data())
def test_a_cut_file_is_refused(whole, data):
    _, content, path = whole
    path.write_bytes(content[: data.draw(st.integers(0, len(content) - 1))])
    with pytest.raises(ValueError, match="is no snapshot"):
        physics.Snapshot.load(path)


@given(data=st.data())
def test_a_damaged_file_is_refused_or_has_the_same_bits(whole, data):
    """Checksums hold the numbers; other bytes of a zip file, a date say, mean nothing to a snapshot."""
    kept, content, path = whole
    damaged = bytearray(content)
    damaged[data.draw(st.integers(0, len(content) - 1))] ^= 1 << data.draw(st.integers(0, 7))
    path.write_bytes(damaged)
    try:
        read = physics.Snapshot.load(path)
    except ValueError as error:
        assert "is no snapshot" in str(error)  # noqa: PT017
        return
    assert read.time == kept.time
    for array, value in zip(read.arrays, kept.arrays, strict=True):
        np.testing.assert_array_equal(array, value)


def spoiled(world: physics.World, path, name: str, place: tuple, value: float):
    """A file of a snapshot in which one number is another one."""
    kept = world.snapshot()
    kept.arrays[KEPT.index(name)][place] = value
    return physics.Snapshot.load(kept.save(path))


@pytest.mark.parametrize(
    ("case", "name", "place", "value"),
    [
        ("one body, in contact", "memory", (1, 1), 25.0),  # contacts of 24 slots
        ("one body, in contact", "memory", (1, 1), np.nan),
        ("one body, in contact", "memory", (1, 3), 24.0),  # the slot of the first one
        ("one body, in contact", "memory", (1, 3), -1.0),
        ("one body, by events", "memory", (1, 1), 1e9),
        ("many bodies, some asleep", "memory", (0, 1), 1e9),
        ("many bodies, some asleep", "memory", (0, 3), 5.0),  # the first body of a contact of five bodies
        ("many bodies, some asleep", "memory", (0, 4), -2.0),  # the second wall of one
        ("many bodies, some asleep", "memory", (0, 2), 0.5),
        ("one body, in contact", "state", (0, 2), np.inf),
        ("an actuator with memory", "params", (0, 0), np.nan),
        ("a field that changes with time", "gravity", (0, 1), 1e200),
    ],
)
def test_numbers_of_a_file_that_no_step_has_written_are_refused(case, name, place, value, tmp_path):
    """Kernels take indices from the memory, and do not ask whether they are within an array."""
    source = advanced(case)
    before, good = source.snapshot(), physics.Snapshot.load(source.snapshot().save(tmp_path / "good.npz"))
    source.restore(good, source=[0, 1, 2])
    wrong = spoiled(source, tmp_path / "wrong.npz", name, place, value)
    for places in ({}, {"worlds": [2], "source": [0]}):
        with pytest.raises(ValueError, match=r"of a file whose (state|params|gravity|contact memory) "):
            source.restore(wrong, **places)
        for array, kept in zip(source.kept(), before.arrays):
            np.testing.assert_array_equal(array, kept)
