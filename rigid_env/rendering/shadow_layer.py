"""Shadows in a picture: the darkness of a pixel is the share of samples of the sun that bodies hide from it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import islice

import numpy as np

from rigid_env.rendering import palette
from rigid_env.rendering.camera import NEAR
from rigid_env.rendering.geometry import point_lists
from rigid_env.rendering.layout import faces_point
from rigid_env.rendering.shadows import SAMPLES, SUN_SAMPLES, fall, outlines

DEPTH = 0.39
"""Share of the light that is lost where all samples of the sun are hidden."""

GRAZING = 0.05
"""Smallest sine of the angle between light and wall for which shadows are drawn on the wall."""

COARSE_HEIGHT = 400
"""[px] Height of a picture from which on shadows are computed at half the resolution, which their soft edges allow."""

COVER_SIDE = 2
COVER = COVER_SIDE**2
"""Number of parts of a pixel, `COVER_SIDE` along each side; each part belongs to one wall or to none."""

JITTER = np.arange(1, SAMPLES + 1)[:, None] * (0.7548776662, 0.5698402910) % 1.0 - 0.5
"""Offset (SAMPLES, 2) of each sample's polygons [px], spread evenly over a pixel (the R2 sequence, Roberts 2018). It
smooths the edges of shadows."""

DARKNESS = np.rint(255 * (1 - (1 - DEPTH) ** (np.arange(256) / (COVER * SAMPLES)))).astype(np.uint8)
"""Opacity (256,) uint8 of the shadow at a pixel, by the number of its hidden samples times its parts on a wall."""


@dataclass(frozen=True, eq=False)
class LitWall:
    """Wall that shadows fall on, as it appears in a picture.

    Parameters
    ----------
    wall : WallView
    cover : (height, width) uint8
        Number of parts of each pixel, out of `COVER`, that show the wall.
    sides : (k, 3) float64
    offsets : (k,) float64
        Half-spaces sides·x ≥ offsets that bound the visible part of the wall's plane; sides are unit normals.
    """

    wall: object
    cover: np.ndarray
    sides: np.ndarray
    offsets: np.ndarray

    @cached_property
    def stretch(self):
        """Largest 1 / (normal·light) over all samples of the sun: longest semi-axis of a unit sphere's shadow."""
        return 1.0 / np.min(SUN_SAMPLES @ self.wall.normal)

    @cached_property
    def drift(self):
        """Largest distance of a point's shadows from their middle, over all samples of the sun, per height [m/m]."""
        middle = palette.LIGHT / (palette.LIGHT @ self.wall.normal)
        return np.linalg.norm(SUN_SAMPLES / (SUN_SAMPLES @ self.wall.normal)[:, None] - middle, axis=1).max()


def lit_walls(camera, size, room, pygame):
    """Walls of a `Room` that shadows can fall on, as `LitWall` for a `ShadowLayer` of `size` (width, height) [px]."""
    width, height = size
    labels = np.zeros((height * COVER_SIDE, width * COVER_SIDE), dtype=np.uint8)
    fine = (width * COVER_SIDE, height * COVER_SIDE)
    surface = pygame.image.frombuffer(labels, fine, "P")
    found = []
    for index, (wall, shown) in enumerate(zip(room.walls, room.wall_polygons)):
        is_lit = np.min(SUN_SAMPLES @ wall.normal) > GRAZING
        pixels = camera.project_polygon(shown, fine) if len(shown) else shown
        if len(pixels) >= 3 and is_lit and faces_point(wall, camera.eye):
            pygame.draw.polygon(surface, index + 1, pixels.tolist())
            found.append((index, wall, shown))
    parts = labels.reshape(height, COVER_SIDE, width, COVER_SIDE)
    covers = [np.sum(parts == index + 1, axis=(1, 3), dtype=np.uint8) for index, _, _ in found]
    return [LitWall(wall, cover, *_side_planes(shown, wall.normal)) for (_, wall, shown), cover in zip(found, covers)]


def _side_planes(polygon, normal):
    """Half-spaces that bound a convex polygon (k, 3) in its plane: unit normals (k, 3) and offsets (k,)."""
    sides = np.cross(normal, np.roll(polygon, -1, axis=0) - polygon)
    sides /= np.maximum(np.linalg.norm(sides, axis=1, keepdims=True), 1e-12)
    offsets = np.sum(sides * polygon, axis=1)
    signs = np.sign(sides @ polygon.mean(axis=0) - offsets)
    return signs[:, None] * sides, signs * offsets


class ShadowLayer:
    """Layer that darkens the walls of a picture where bodies hide the sun.

    Parameters
    ----------
    size : (width, height)
        Size of the picture [px].
    pygame : module

    Attributes
    ----------
    size : (width, height)
        Size of the layer [px]; the `lit_walls` that are drawn need the same size.
    """

    def __init__(self, size, pygame):
        self._step = 2 if size[1] >= COARSE_HEIGHT and size[0] % 2 == size[1] % 2 == 0 else 1
        width, height = self.size = size[0] // self._step, size[1] // self._step
        self._pygame = pygame
        self._mask, self._count, self._total = np.zeros((3, height, width), dtype=np.uint8)
        self._mask_surface = pygame.image.frombuffer(self._mask, self.size, "P")
        self._shade = np.zeros((height, width, 4), dtype=np.uint8)
        self._shade[..., :3] = palette.SHADOW
        self._shade_surface = pygame.image.frombuffer(self._shade, self.size, "RGBA")
        self._fine_surface = pygame.image.frombuffer(np.zeros((size[1], size[0], 4), dtype=np.uint8), size, "RGBA")

    def draw(self, picture, camera, walls, frame):
        """Darken a picture where the bodies of a frame cast shadows on walls.

        Parameters
        ----------
        picture : pygame.Surface
        camera : Camera
        walls : list of LitWall
        frame : Frame
            Frame with at least one body.
        """
        frame = frame.solids
        groups = outlines(frame)
        self._total.fill(0)
        rows = [found for wall in walls if (found := self._add_wall(camera, wall, frame.poses, groups)) is not None]
        if rows:
            top, bottom = min(first for first, _ in rows), max(last for _, last in rows)
            count = self._total[top:bottom]
            self._shade[top:bottom, :, 3] = np.take(DARKNESS, count, out=count, mode="clip")
            self._blend(picture, top, bottom)

    def _blend(self, picture, top, bottom):
        """Darken a picture by the layer's rows from `top` to `bottom`."""
        width, step = self.size[0], self._step
        shade = self._shade_surface.subsurface((0, top, width, bottom - top))
        if step > 1:
            fine = self._fine_surface.subsurface((0, step * top, step * width, step * (bottom - top)))
            shade = self._pygame.transform.smoothscale(shade, fine.get_size(), fine)
        picture.blit(shade, (0, step * top))

    def _add_wall(self, camera, lit, poses, groups):
        """Count the hidden samples at the pixels of one wall; returns the range of rows that may be darkened, or None.

        Whole rows are added, since contiguous memory saves more time than leaving out the ends of rows.
        """
        may_show = _may_show(lit, poses)
        drawn = []
        for members, points in groups:
            kept = may_show[members]
            if kept.any():
                drawn += self._project(camera, fall(points[kept], lit.wall, SUN_SAMPLES))
        top = max(min((low for _, _, low, _ in drawn), default=0), 0)
        bottom = min(max((high for _, _, _, high in drawn), default=-1) + 1, self.size[1])
        if top >= bottom:
            return None
        rows = slice(top, bottom)
        self._count_samples(drawn, self._mask[rows], self._count[rows])
        self._total[rows] += self._count[rows] * lit.cover[rows]
        return top, bottom

    def _count_samples(self, drawn, mask, count):
        """Count at each pixel the samples of the sun whose polygons in `drawn` cover it; writes `count`."""
        draw, surface = self._pygame.draw.polygon, self._mask_surface
        count.fill(0)
        for _ in range(SAMPLES):
            for number, polygons, _, _ in drawn:
                for polygon in islice(polygons, number):
                    if len(polygon) > 2:
                        draw(surface, 1, polygon)
            count += mask
            mask.fill(0)

    def _project(self, camera, fallen):
        """Project the shadows of bodies on a wall, (n, SAMPLES, k, 3) [m], to polygons in pixels.

        Returns
        -------
        list of (number, polygons, low, high)
            The next `number` polygons of the iterator `polygons` belong to the next sample; all lie in the rows `low`
            to `high`.
        """
        shape = fallen.shape[:3]
        pixels, depths = camera.project(fallen.reshape(-1, 3), self.size)
        pixels, depths = pixels.reshape(*shape, 2), depths.reshape(shape)
        far = 4 * max(self.size)
        # pixels of points behind the camera are NaN, and comparisons with NaN are False
        is_whole = ((pixels < far) & (pixels > -far)).all(axis=(1, 2, 3)) & (depths > NEAR).all(axis=(1, 2))
        found = [self._clip(camera, body) for body in fallen[~is_whole]]
        if is_whole.any():
            shrunk = _shrunk(pixels[is_whole]) + JITTER[:, None]
            rounded = np.floor(shrunk).astype(np.int64).swapaxes(0, 1)
            low, high = int(rounded[..., 1].min()), int(rounded[..., 1].max())
            found.append((rounded.shape[1], point_lists(rounded.reshape(-1, shape[2], 2)), low, high))
        return found

    def _clip(self, camera, loops):
        """Project and clip the shadows (SAMPLES, k, 3) [m] of a body that is only partly in view, like `_project`."""
        clipped = [np.floor(camera.project_polygon(loop, self.size) + shift) for loop, shift in zip(loops, JITTER)]
        y = np.concatenate([polygon[:, 1] for polygon in clipped])
        low, high = (int(y.min()), int(y.max())) if len(y) else (0, -1)
        return 1, iter([polygon.astype(np.int64).tolist() for polygon in clipped]), low, high


def _shrunk(polygons):
    """Shrink polygons (n, SAMPLES, k, 2) by half a pixel on all sides, as pygame also fills pixels on the border."""
    extent = np.maximum(np.ptp(polygons[:, :1], axis=2, keepdims=True), 1.0)
    return polygons - (polygons - polygons.mean(axis=2, keepdims=True)) / extent


def _may_show(lit, poses):
    """Flags (n,) bool of the bodies whose shadow may reach the visible part of a wall, by their bounding spheres."""
    wall = lit.wall
    heights = poses.pos @ wall.normal - wall.offset
    fallen = poses.pos - heights[:, None] * (palette.LIGHT / (palette.LIGHT @ wall.normal))
    reach = poses.radius * lit.stretch + np.abs(heights) * lit.drift
    return (fallen @ lit.sides.T - lit.offsets >= -reach[:, None]).all(axis=1)
