"""Canvas: a surface larger than the picture, on which shapes in world coordinates are drawn through a camera."""

from __future__ import annotations

import numpy as np

from rigid_env.rendering.camera import NEAR
from rigid_env.rendering.geometry import point_lists

SUPERSAMPLING = 2
"""Pixels of the canvas per pixel of the picture, along each side."""

REFERENCE_HEIGHT = 600
"""[px] Height of a picture in which a canvas unit, the unit of line widths and marks, is one pixel; it scales with
height."""

LEAST_UNIT = 0.55
"""[px] Smallest canvas unit in pixels of the picture; below it lines would vanish in small pictures."""


class Canvas:
    """Surface of pygame on which shapes in the world frame are drawn.

    Parameters
    ----------
    surface : pygame.Surface
        `SUPERSAMPLING` times as large as the picture.
    camera : Camera
    pygame : module
        The module pygame, with its submodule `gfxdraw` imported.
    """

    def __init__(self, surface, camera, pygame):
        self.surface = surface
        self.camera = camera
        self.size = surface.get_size()
        self.scale = SUPERSAMPLING
        self.unit = SUPERSAMPLING * max(LEAST_UNIT, self.size[1] / (SUPERSAMPLING * REFERENCE_HEIGHT))
        self._weights = 1 << np.array(surface.get_shifts()[:3])
        self._draw = pygame.draw
        self._filled = pygame.gfxdraw.filled_polygon

    def project(self, points):
        """Project world points (n, 3) [m] to canvas pixels (n, 2) and depths (n,) [m]."""
        return self.camera.project(points, self.size)

    def polygon(self, points, colour, alpha=255):
        """Fill a convex polygon (n, 3) in world coordinates [m], clipped to the field of view.

        `alpha` is its opacity, 0 to 255.
        """
        self.fill(self.camera.project_polygon(points, self.size), colour, alpha)

    def loop(self, points, width, colour):
        """Draw a closed line, `width` units wide, through world points (n, 3) [m]."""
        self.segments(points, np.roll(points, -1, axis=0), width, colour)

    def segments(self, starts, ends, width, colour):
        """Draw lines, `width` units wide, between world points (n, 3) and (n, 3) [m], clipped to the field of view."""
        pixels, depths = self.project(np.concatenate([starts, ends]))
        if self.is_in_sight(pixels, depths):
            self.strokes(pixels[: len(starts)], pixels[len(starts) :], width, colour)
            return
        for segment in np.stack([starts, ends], axis=1):
            pair = self.camera.project_polygon(segment, self.size)
            if len(pair) == 2:
                self.strokes(pair[:1], pair[1:], width, colour)

    def is_in_sight(self, pixels, depths):
        """True if projected points need no clipping: all are in front of the camera and not far outside the picture."""
        return bool(self.are_in_sight(pixels[None], depths[None])[0])

    def are_in_sight(self, pixels, depths):
        """Result (n,) bool of `is_in_sight` for n groups of points, with pixels (n, k, 2) and depths (n, k)."""
        size = np.array(self.size)
        # pixels of points behind the camera are NaN, and comparisons with NaN are False
        is_near = (pixels < 1.5 * size) & (pixels > -0.5 * size)
        return is_near.all(axis=(1, 2)) & (depths > NEAR).all(axis=1)

    def stored(self, colours):
        """sRGB colours (n, 3) int as integers (n,) int64 in the surface's own format, the fastest form to draw with."""
        return colours @ self._weights

    def fill(self, pixels, colour, alpha=255):
        """Fill a convex polygon given in canvas pixels (n, 2); `alpha` is its opacity, 0 to 255."""
        if len(pixels) < 3:
            return
        if alpha == 255:
            self._draw.polygon(self.surface, colour, pixels.tolist())
        else:
            self._filled(self.surface, np.rint(pixels).astype(int).tolist(), (*colour, alpha))

    def fill_faces(self, pixels, corner_getters, colours):
        """Fill convex polygons with one colour each.

        `pixels` (n, 2) are all vertices [canvas pixels]; each of `corner_getters` picks the corners of a polygon from
        them.
        """
        draw, surface, points = self._draw.polygon, self.surface, list(zip(*pixels.T.tolist()))
        for corners, colour in zip(corner_getters, colours):
            draw(surface, colour, corners(points))

    def stroke(self, pixels, width, colour):
        """Draw a line with round joints, `width` units wide, through canvas pixels (n, 2)."""
        self.strokes(pixels[:-1], pixels[1:], width, colour)

    def strokes(self, starts, ends, widths, colours):
        """Draw n lines with round ends between canvas pixels (n, 2) and (n, 2), one after the other.

        `widths` [canvas units] and `colours` hold for all lines, or have one for each: (n,) float and a list of n.
        """
        half = np.broadcast_to(0.5 * self.unit * np.asarray(widths), len(starts))
        colours = colours if isinstance(colours, list) else [colours] * len(starts)
        along = ends - starts
        across = along[:, ::-1] * (half / np.maximum(np.hypot(along[:, 0], along[:, 1]), 1e-9))[:, None] * (-1.0, 1.0)
        quads = np.stack([starts + across, ends + across, ends - across, starts - across], axis=1)
        draw, surface = self._draw, self.surface
        for quad, radius, colour, *joints in zip(
            point_lists(quads), half.tolist(), colours, starts.tolist(), ends.tolist()
        ):
            draw.polygon(surface, colour, quad)
            if radius >= 1.0:
                for joint in joints:
                    draw.circle(surface, colour, joint, radius)

    def disc(self, pixel, radius, colour):
        """Draw a disc with a radius in canvas units around a canvas pixel (2,)."""
        self._draw.circle(self.surface, colour, pixel.tolist(), self.unit * radius)
