"""A surface twice the picture's size, a camera, and shapes given in world coordinates."""

from __future__ import annotations

import numpy as np

from rigid_env.rendering.camera import NEAR

SUPERSAMPLING = 2
"""Pixels of the canvas for one of the picture, along each side."""

REFERENCE_HEIGHT = 600
"""[px]. Widths of lines and marks are given in units: pixels of a picture this high, else in proportion."""

LEAST_UNIT = 0.55
"""[px] of the picture. Below it lines would vanish in small pictures."""


class Canvas:
    """Draws world-frame shapes on a pygame surface.

    Parameters
    ----------
    surface : pygame.Surface
        `SUPERSAMPLING` times as large as the picture.
    camera : Camera
    pygame : module
        With `gfxdraw` imported.
    """

    def __init__(self, surface, camera, pygame):
        self.surface = surface
        self.camera = camera
        self.size = surface.get_size()
        self.unit = SUPERSAMPLING * max(LEAST_UNIT, self.size[1] / (SUPERSAMPLING * REFERENCE_HEIGHT))
        self._draw = pygame.draw
        self._filled = pygame.gfxdraw.filled_polygon

    def project(self, points):
        """Canvas pixels (n, 2) and depths (n,) [m] of world points (n, 3) [m]."""
        return self.camera.project(points, self.size)

    def polygon(self, points, colour, alpha=255):
        """Fill a convex world polygon (n, 3) [m], clipped to what is in sight; alpha 0..255."""
        self.fill(self.camera.project_polygon(points, self.size), colour, alpha)

    def loop(self, points, width, colour):
        """Closed line of `width` units through world points (n, 3) [m]."""
        self.segments(points, np.roll(points, -1, axis=0), width, colour)

    def segments(self, starts, ends, width, colour):
        """Lines of `width` units between world points (n, 3) and (n, 3) [m], clipped."""
        pixels, depths = self.project(np.concatenate([starts, ends]))
        if self.is_in_sight(pixels, depths):
            self._strokes(pixels[: len(starts)], pixels[len(starts) :], width, colour)
            return
        for segment in np.stack([starts, ends], axis=1):
            pair = self.camera.project_polygon(segment, self.size)
            if len(pair) == 2:
                self._strokes(pair[:1], pair[1:], width, colour)

    def is_in_sight(self, pixels, depths):
        """True if projected points can be drawn as they are: in front of the camera and not far off."""
        if not np.all(depths > NEAR):
            return False
        return bool(np.all(np.abs(pixels - 0.5 * np.array(self.size)) < self.size))

    def fill(self, pixels, colour, alpha=255):
        """Fill a convex polygon given in canvas pixels (n, 2)."""
        if len(pixels) < 3:
            return
        if alpha == 255:
            self._draw.polygon(self.surface, colour, pixels.tolist())
        else:
            self._filled(self.surface, np.rint(pixels).astype(int).tolist(), (*colour, alpha))

    def fill_all(self, polygons, colours):
        """Fill convex polygons (n, k, 2) in canvas pixels with colours (n, 3)."""
        for polygon, colour in zip(polygons.tolist(), colours.tolist()):
            self._draw.polygon(self.surface, colour, polygon)

    def stroke(self, pixels, width, colour):
        """Line with round joints through canvas pixels (n, 2); `width` in units."""
        self._strokes(pixels[:-1], pixels[1:], width, colour)

    def _strokes(self, starts, ends, width, colour):
        half = 0.5 * self.unit * width
        along = ends - starts
        length = np.maximum(np.hypot(along[:, 0], along[:, 1]), 1e-9)[:, None]
        across = half * np.stack([-along[:, 1], along[:, 0]], axis=1) / length
        quads = np.stack([starts + across, ends + across, ends - across, starts - across], axis=1)
        for quad in quads.tolist():
            self._draw.polygon(self.surface, colour, quad)
        if half >= 1.0:
            for joint in starts.tolist() + ends.tolist():
                self._draw.circle(self.surface, colour, joint, half)

    def disc(self, pixel, radius, colour):
        """Disc of `radius` units around a canvas pixel (2,)."""
        self._draw.circle(self.surface, colour, pixel.tolist(), self.unit * radius)
