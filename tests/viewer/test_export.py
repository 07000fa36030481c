"""Offline files: their size, what is in them, and what is refused."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigid_env.viewer.notebook import Embedded, embed, frame_of_page, in_notebook
from tests.viewer.looks import BLOCK, crowd, look_of, motion

pytest.importorskip("viser")

import physics
from physics import scenes
from rigid_env.viewer.export import html_of, taken, to_html
from rigid_env.viewer.replay import trajectory_looks

MEGABYTE = 1e6


def test_ten_seconds_of_a_block_that_never_rests_are_small(tmp_path, rng):
    path = to_html(motion((BLOCK,), 10.0, 30.0, rng), tmp_path / "one.html")
    assert path.stat().st_size <= 2.0 * MEGABYTE


@pytest.mark.slow
def test_ten_seconds_of_fifty_bodies_that_never_rest_are_small(tmp_path, rng):
    path = to_html(motion(crowd(50, rng), 10.0, 30.0, rng), tmp_path / "fifty.html")
    assert path.stat().st_size <= 5.0 * MEGABYTE


def test_one_look_is_less_than_a_megabyte(tmp_path):
    assert to_html([look_of()], tmp_path / "still.html").stat().st_size < MEGABYTE


def test_a_page_loads_nothing_from_elsewhere():
    page = html_of([look_of()], title="drop <1> & 2")
    head = page[: page.index("</head>")]
    assert not re.findall(r"<(?:script|link)[^>]*(?:src|href)=[\"']?(?:https?:)?//", page)
    assert "<title>drop &lt;1> &amp; 2</title>" in head


def test_a_trajectory_is_a_source(tmp_path):
    scene = scenes.drop()
    state = {name: np.zeros((3, 1, 3)) for name in ("linvel", "angvel")}
    t, pos = np.array((0.0, 0.1, 0.2)), np.linspace((0, 6, 0), (0, 5, 0), 3)[:, None]
    trajectory = physics.Trajectory(
        t, pos, np.tile((1.0, 0.0, 0.0, 0.0), (3, 1, 1)), **state, energy=np.zeros((3, 1)), events=(), reports=()
    )
    looks = list(trajectory_looks(scene, trajectory))
    assert [look.time for look in looks] == [0.0, 0.1, 0.2]
    np.testing.assert_allclose([look.frame.bodies[0].pos for look in looks], pos[:, 0])
    assert len(looks[0].frame.walls) == len(scene.walls)
    assert to_html(trajectory, tmp_path / "t.html", scene=scene).exists()
    with pytest.raises(ValueError, match=r"^scene is None with a Trajectory; allowed is the Scene"):
        to_html(trajectory, tmp_path / "u.html")
    with pytest.raises(ValueError, match=r"^trajectory has 1 bodies; allowed is one of as many as the scene's 50"):
        to_html(trajectory, tmp_path / "u.html", scene=scenes.heap(50))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"duration": 0.0}, r"^duration is "),
        ({"fps": -1.0}, r"^fps is "),
        ({"layers": ["walls", "wall"]}, r"^layers is 'wall'; allowed are walls, "),
        ({"source": []}, r"^source has no looks; allowed is at least one$"),
        ({"source": [look_of(time=1.0), look_of(time=0.5)]}, r"^source has a look at 0.5 s after one at 1 s; allowed"),
        ({"path": ""}, r"^path is ''; allowed is the path of a file"),
    ],
)
def test_what_is_wrong_is_named_and_no_file_is_left(tmp_path, arguments, message):
    given_ = {"source": [look_of()], "path": tmp_path / "run.html", **arguments}
    with pytest.raises(ValueError, match=message):
        to_html(**given_)
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_cannot_be_written_leaves_the_old_one(tmp_path):
    with pytest.raises(FileNotFoundError):
        to_html([look_of()], tmp_path / "nowhere" / "run.html")
    old = tmp_path / "run.html"
    old.write_text("old")

    def breaks():
        yield look_of()
        raise RuntimeError("the source broke")

    with pytest.raises(RuntimeError, match="broke"):
        to_html(breaks(), old)
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
