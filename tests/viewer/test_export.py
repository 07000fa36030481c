"""Offline files: their size, what is in them, and what is refused."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.viewer.looks import BLOCK, crowd, look_of, motion

pytest.importorskip("viser")

from rigid_env.viewer.export import Embedded, embed, frame_of_page, in_notebook, page_of, taken, write_page

MEGABYTE = 1e6


def size_of(looks) -> int:
    return len(page_of(looks).encode("utf-8"))


def test_ten_seconds_of_a_block_that_never_rests_are_small(rng):
    assert size_of(motion((BLOCK,), 10.0, 30.0, rng)) <= 2.0 * MEGABYTE


def test_ten_seconds_of_fifty_bodies_that_never_rest_are_small(rng):
    assert size_of(motion(crowd(50, rng), 10.0, 30.0, rng)) <= 5.0 * MEGABYTE


def test_one_look_is_less_than_a_megabyte():
    assert size_of([look_of()]) < MEGABYTE


def test_a_page_loads_nothing_from_elsewhere():
    page = page_of([look_of()], title="drop <1> & 2")
    head = page[: page.index("</head>")]
    assert not re.findall(r"<(?:script|link)[^>]*(?:src|href)=[\"']?(?:https?:)?//", page)
    assert "<title>drop &lt;1> &amp; 2</title>" in head


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"duration": 0.0}, r"^duration is "),
        ({"fps": -1.0}, r"^fps is "),
        ({"layers": ["walls", "wall"]}, r"^layers is 'wall'; allowed are walls, "),
        ({"looks": []}, r"^there are no looks; allowed is at least one$"),
        ({"looks": [look_of(time=1.0), look_of(time=0.5)]}, r"^looks have one at 0.5 s after one at 1 s; allowed"),
    ],
)
def test_what_is_wrong_is_named(arguments, message):
    with pytest.raises(ValueError, match=message):
        page_of(**{"looks": [look_of()], **arguments})


def test_a_file_that_cannot_be_written_leaves_the_old_one(tmp_path, monkeypatch):
    with pytest.raises(FileNotFoundError):
        write_page("new", tmp_path / "nowhere" / "run.html")
    old = write_page("old", tmp_path / "run.html")

    def breaks(self, text, **_):
        self.write_bytes(text[:1].encode())
        raise OSError("the disk is full")

    monkeypatch.setattr(Path, "write_text", breaks)
    with pytest.raises(OSError, match="full"):
        write_page("new", old)
    assert old.read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["run.html"]


@given(
    st.lists(st.floats(0.0, 0.5), min_size=1, max_size=40), st.floats(0.05, 5.0), st.floats(0.01, 1.0),
    st.floats(-3.0, 3.0),
)  # fmt: skip
def test_the_looks_taken_are_apart_and_within_the_duration(gaps, duration, interval, start):
    times = (start + np.cumsum([0.0, *gaps])).tolist()
    look = look_of()
    kept = [one.time for one in taken((replace(look, time=time) for time in times), duration, interval)]
    assert kept[0] == times[0]
    assert kept[-1] <= start + duration + 1e-6
    assert all(b - a >= 0.49 * interval for a, b in pairwise(kept))
    assert len(kept) <= duration / interval + 2
    assert set(kept) <= set(times)


@pytest.mark.parametrize("fps", [10.0, 30.0, 60.0])
def test_looks_at_the_rate_of_the_file_are_all_taken(fps):
    look = look_of()
    times = [k / fps for k in range(200)]
    kept = [one.time for one in taken((replace(look, time=time) for time in times), 100.0, 1.0 / fps)]
    assert kept == times


def test_a_notebook_shows_the_page_in_a_frame():
    page = '<html><body title="a & b">x</body></html>'
    frame = frame_of_page(page, height=300)
    import html

    inside = re.search(r'srcdoc="([^"]*)"', frame)[1]
    assert html.unescape(inside) == page
    assert 'height="300"' in frame
    assert Embedded(page)._repr_html_() == frame_of_page(page)
    assert "<iframe" not in repr(Embedded(page))


@pytest.mark.parametrize("height", [0, -1, 2.5, True, "300"])
def test_a_height_that_is_none_is_refused(height):
    with pytest.raises(ValueError, match=r"^height is .*; allowed are integers of at least 1$"):
        frame_of_page("x", height)


def test_there_is_no_notebook_in_a_test():
    assert not in_notebook()
    with pytest.raises(RuntimeError, match=r"^there is no notebook here"):
        embed("x")


def test_a_kernel_is_a_notebook(monkeypatch):
    import sys
    import types

    shell = types.SimpleNamespace(kernel=object())
    monkeypatch.setitem(sys.modules, "IPython", types.SimpleNamespace(get_ipython=lambda: shell))
    assert in_notebook()
    del shell.kernel
    assert not in_notebook()
