"""Reading tosses in both formats, what is said about wrong files, and the split."""

import re

import numpy as np
import pytest

from rigid_env.lab.tosses import data


def saved(path, **arrays):
    np.savez(path, **arrays)
    return path


def test_npz_is_read_as_it_is(npz, made):
    read = data.load(npz)
    np.testing.assert_array_equal(read.offsets, made.offsets)
    np.testing.assert_array_equal(read.numbers, made.numbers)
    # the quaternions are normalised again: rounding
    np.testing.assert_allclose(read.states, made.states, rtol=0, atol=1e-15)
    assert len(read) == 24
    assert [len(toss) for toss in read] == read.lengths.tolist()
    assert read.duration == pytest.approx(24 * 69 / 148.0)


@pytest.mark.parametrize("has_leading_axis", [False, True])
def test_pt_files_are_in_half_widths_and_in_numerical_order(tmp_path, made, has_leading_axis):
    torch = pytest.importorskip("torch")
    for number, toss in ((10, 1), (2, 0)):
        states = list(made)[toss].copy()
        states[:, data.POS] /= 0.0524
        states[:, data.LINVEL] /= 0.0524
        rows = torch.tensor(np.hstack([states, np.zeros((len(states), 6))]))
        torch.save(rows[None] if has_leading_axis else rows, tmp_path / f"{number}.pt")
    (tmp_path / "notes.pt").write_text("not a toss")
    read = data.load(tmp_path)
    assert read.numbers.tolist() == [2, 10]
    np.testing.assert_allclose(read.states, made.states[: 2 * 70], rtol=0, atol=1e-14)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ([1.0, 2.0], "list"),
        ("(3, 13)", r"shape \(3, 13\); allowed is \(frames, 19\)"),
    ],
)
def test_wrong_pt_files_are_named(tmp_path, content, message):
    torch = pytest.importorskip("torch")
    torch.save(torch.zeros(3, 13) if content == "(3, 13)" else content, tmp_path / "7.pt")
    with pytest.raises(ValueError, match=r"7\.pt.*" + message):
        data.load(tmp_path)


def test_broken_files_and_empty_folders_are_named(tmp_path):
    pytest.importorskip("torch")
    with pytest.raises(ValueError, match=r"no <number>\.pt"):
        data.load(tmp_path)
    (tmp_path / "0.pt").write_bytes(b"nothing")
    with pytest.raises(ValueError, match=r"0\.pt cannot be read"):
        data.load(tmp_path)
    (tmp_path / "a.npz").write_bytes(b"nothing")
    with pytest.raises(ValueError, match=r"a\.npz cannot be read"):
        data.load(tmp_path / "a.npz")
    (tmp_path / "a.csv").write_text("")
    with pytest.raises(ValueError, match=r"neither a \.npz"):
        data.load(tmp_path / "a.csv")
    with pytest.raises(FileNotFoundError, match="does not exist"):
        data.load(tmp_path / "b.npz")


def test_without_torch_the_extra_is_named(tmp_path, monkeypatch):
    from gymnasium.error import DependencyNotInstalled

    (tmp_path / "0.pt").write_bytes(b"")
    monkeypatch.setitem(__import__("sys").modules, "torch", None)
    with pytest.raises(DependencyNotInstalled, match=r"rigid-env\[agents\]"):
        data.load(tmp_path)


def test_wrong_arrays_are_named_with_their_value(tmp_path, made):
    path = tmp_path / "wrong.npz"
    states, offsets = made.states, made.offsets
    with pytest.raises(ValueError, match="no array 'offsets'"):
        data.load(saved(path, states=states))
    with pytest.raises(ValueError, match=r"states has shape .*12\)"):
        data.load(saved(path, states=states[:, :12], offsets=offsets))
    with pytest.raises(ValueError, match="offsets is"):
        data.load(saved(path, states=states, offsets=offsets[:-1]))
    with pytest.raises(ValueError, match="source_index has shape"):
        data.load(saved(path, states=states, offsets=offsets, source_index=np.arange(3)))
    bad = states.copy()
    bad[5, 0] = np.nan
    with pytest.raises(ValueError, match=r"frame 5 is .*finite"):
        data.load(saved(path, states=bad, offsets=offsets))
    bad = states.copy()
    bad[6, data.QUAT] = (0.5, 0.0, 0.0, 0.0)
    with pytest.raises(ValueError, match=re.escape("the quaternion of frame 6 is [0.5, 0.0, 0.0, 0.0]")):
        data.load(saved(path, states=bad, offsets=offsets))


def test_split_is_a_seeded_quarter():
    fitted, rest = data.split(400)
    assert (len(fitted), len(rest)) == (100, 300)
    np.testing.assert_array_equal(np.sort(np.concatenate([fitted, rest])), np.arange(400))
    np.testing.assert_array_equal(fitted, data.split(400)[0])
    assert fitted.tolist() != data.split(400, seed=1)[0].tolist()
    with pytest.raises(ValueError, match="1 tosses cannot be divided"):
        data.split(1)


def test_subset_keeps_order_and_numbers(made):
    part = made.subset([5, 2])
    assert part.numbers.tolist() == [5, 2]
    np.testing.assert_array_equal(part.states[70:], list(made)[2])
    np.testing.assert_array_equal(part.first[0], list(made)[5][0])


def test_the_real_tosses_are_as_their_description_says(measured):
    assert len(measured) == 400
    assert measured.lengths.min() >= 80
    # velocities are backward differences, exactly but for rounding in most frames
    toss = next(iter(measured))
    backward = np.diff(toss[:, data.POS], axis=0) / data.SAMPLE_DT
    assert np.median(np.abs(toss[1:, data.LINVEL] - backward)) < 0.005
