"""The gallery: every picture of its program is there, small, on the page, and comes out again."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path

import numpy as np
import pytest

import rigid_env  # noqa: F401 (registers the environments)
from rigid_env.envs.registration import GOALS, MAX_EPISODE_STEPS

pytest.importorskip("pygame")
image = pytest.importorskip("PIL.Image")

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "gallery.md").read_text(encoding="utf-8")
LARGEST_FILE, LARGEST_FOLDER = 60_000, 1_000_000  # [bytes]
ALIKE = 4.0  # mean difference of a picture from its file: steps of brightness, and edges on other machines [of 255]


@pytest.fixture(scope="module")
def gallery():
    """The program `docs/images/gallery.py` as a module."""
    spec = importlib.util.spec_from_file_location("gallery", DOCS / "images" / "gallery.py")
    module = importlib.util.module_from_spec(spec)
    monkeypatch = pytest.MonkeyPatch()
    monkeypatch.setitem(sys.modules, "gallery", module)  # dataclasses look there
    spec.loader.exec_module(module)
    yield module
    monkeypatch.undo()


def test_the_page_shows_every_picture(gallery):
    assert re.findall(r"\(images/gallery/([\w-]+)\.png\)", PAGE) == list(gallery.PICTURES)
    assert {path.stem for path in gallery.FOLDER.iterdir()} == set(gallery.PICTURES)


def test_there_are_ten_cases_and_every_environment(gallery):
    assert len(gallery.CASES) == 10
    shown = [driven.env.removesuffix("-v0") for driven in gallery.ENVIRONMENTS]
    assert sorted(shown) == sorted([*MAX_EPISODE_STEPS, *GOALS, "Scene", "Scene"])


def test_pictures_are_small_and_not_blank(gallery):
    for name in gallery.PICTURES:
        path = gallery.FOLDER / f"{name}.png"
        assert path.stat().st_size <= LARGEST_FILE, name
        picture = np.array(image.open(path).convert("RGB"))
        assert picture.shape == (*gallery.SIZE[::-1], 3), name
        assert picture.std() > 10.0, name
    files = [path for path in (DOCS / "images").rglob("*") if path.is_file() and "__pycache__" not in path.parts]
    assert sum(path.stat().st_size for path in files) <= LARGEST_FOLDER


@pytest.mark.parametrize("name", ["towers", "block-reach"])
def test_a_picture_comes_out_again(gallery, name, tmp_path, monkeypatch):
    kept = np.array(image.open(gallery.FOLDER / f"{name}.png").convert("RGB"), dtype=float)
    monkeypatch.setattr(gallery, "FOLDER", tmp_path)
    gallery.main([name])
    again = np.array(image.open(tmp_path / f"{name}.png").convert("RGB"), dtype=float)
    assert np.abs(again - kept).mean() < ALIKE


def test_every_body_is_in_its_picture(gallery):
    """The camera has the corners of all bodies in sight."""
    frame = gallery.world_frame(gallery.physics.World(gallery.scene_of("towers")), arrows=False)
    camera = gallery.camera_at([frame], (-0.35, -0.35, -1.0))
    reach = 0.5 * np.array([(-1, -1, -1), (1, 1, 1)])
    pixels, depths = camera.project((frame.poses.pos[:, None] + reach).reshape(-1, 3), gallery.SIZE)
    assert (depths > 0.0).all()
    assert (pixels >= 0.0).all()
    assert (pixels <= gallery.SIZE).all()


def test_an_unknown_picture_is_named(gallery):
    with pytest.raises(SystemExit, match=r"picture is 'tower'; allowed are towers, pyramids"):
        gallery.main(["tower"])
