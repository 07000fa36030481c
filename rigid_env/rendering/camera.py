"""Pinhole camera: projects world points to pixels and depths, and clips polygons to the field of view."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import radians, tan

import numpy as np

from rigid_env.rendering.geometry import clip_polygon

NEAR = 0.1
"""[m] Smallest depth that is drawn; it keeps the division by depth away from zero."""

GUARD = 1.5
"""Extent to which polygons are clipped, in extents of the picture: beyond its border, but within 16-bit coordinates."""


@dataclass(frozen=True)
class Camera:
    """Pinhole camera with a position, a direction and a field of view.

    Parameters
    ----------
    eye, target, up : (3,) tuple of float
        [m], world frame. The camera is at `eye`, sees `target` in the middle of the picture, and `up` points
        upwards in it (not along the line of sight).
    fov_y : float
        Vertical field of view [deg].
    """

    eye: tuple[float, float, float]
    target: tuple[float, float, float] = (0.0, 0.0, 0.0)
    up: tuple[float, float, float] = (0.0, 1.0, 0.0)
    fov_y: float = 30.0

    @cached_property
    def basis(self):
        """Axes of the camera (3, 3) float64: rows right, up and forward, unit vectors in the world frame."""
        forward = np.subtract(self.target, self.eye)
        forward = forward / np.linalg.norm(forward)
        right = np.cross(forward, self.up)
        right = right / np.linalg.norm(right)
        return np.array([right, np.cross(right, forward), forward])

    def focal(self, height):
        """Focal length [px] for a picture `height` pixels high."""
        return 0.5 * height / tan(0.5 * radians(self.fov_y))

    def to_camera(self, points):
        """Convert world points to the camera's frame.

        Parameters
        ----------
        points : (..., 3) float
            [m], world frame.

        Returns
        -------
        (..., 3) float64
            [m]. Along right, up and forward; the last is the depth.
        """
        return (np.asarray(points, dtype=np.float64) - self.eye) @ self.basis.T

    def project(self, points, size):
        """Project world points to pixels and depths.

        Parameters
        ----------
        points : (n, 3) float
            [m], world frame.
        size : (width, height)
            Size of the picture [px].

        Returns
        -------
        pixels : (n, 2) float64
            [px]. x to the right, y down, (0, 0) the picture's upper left corner. NaN where depth ≤ 0.
        depth : (n,) float64
            Distance along the line of sight [m].
        """
        local = self.to_camera(points)
        return self._to_pixels(local, size), local[:, 2]

    def project_polygon(self, polygon, size):
        """Project a convex polygon or a segment to pixels, after clipping it to the near plane and the field of view.

        Parameters
        ----------
        polygon : (n, 3) float
            Vertices in order, world frame [m]; n = 2 is a segment.
        size : (width, height)
            Size of the picture [px].

        Returns
        -------
        (k, 2) float64
            [px]. k = 0 if no part is in view.
        """
        local = clip_polygon(self.to_camera(polygon), (0.0, 0.0, 1.0), NEAR)
        width, height = size
        slope_y = GUARD * tan(0.5 * radians(self.fov_y))
        slope_x = slope_y * width / height
        for side in ((1.0, 0.0, slope_x), (-1.0, 0.0, slope_x), (0.0, 1.0, slope_y), (0.0, -1.0, slope_y)):
            if len(local) == 0:
                break
            local = clip_polygon(local, side, 0.0)
        return self._to_pixels(local, size)

    def rays(self, size):
        """Rays through the middles of all pixels, with depth 1.

        Parameters
        ----------
        size : (width, height)
            Size of the picture [px].

        Returns
        -------
        (height, width, 3) float32
            World frame: the pixel sees the points eye + depth · ray.
        """
        width, height = size
        focal = self.focal(height)
        x = (np.arange(width) + 0.5 - 0.5 * width) / focal
        y = (0.5 * height - np.arange(height) - 0.5) / focal
        right, up, forward = self.basis.astype(np.float32)
        x, y = x.astype(np.float32), y.astype(np.float32)
        return forward + x[None, :, None] * right + y[:, None, None] * up

    def _to_pixels(self, local, size):
        width, height = size
        depth = np.where(local[:, 2] > 0.0, local[:, 2], np.nan)
        scale = self.focal(height) / depth
        return np.stack([0.5 * width + scale * local[:, 0], 0.5 * height - scale * local[:, 1]], axis=1)


def fit_camera(points, direction, size, fov_y=30.0, margin=0.06, up=(0.0, 1.0, 0.0)):
    """Nearest camera that looks in a direction and has all points in view.

    A point has the coordinates x across the picture and s along the line of sight. The eye is at x = c, a distance d
    back. The point is in view if |x - c| ≤ t (s + d), with t the tangent of half the field of view. All points are in
    view if max(x - t s) - t d ≤ c ≤ min(x + t s) + t d. So d is at least (max(x - t s) - min(x + t s)) / (2t). For this
    d, only one c is possible: the middle. The same holds for the vertical coordinate; the larger d is taken.

    Parameters
    ----------
    points : (n, 3) float
        [m], world frame.
    direction : (3,) float
        Line of sight, world frame.
    size : (width, height)
        Size of the picture [px].
    fov_y : float
        Vertical field of view [deg].
    margin : float
        Share of the picture that stays empty on each side.
    up : (3,) float
        Upward direction of the picture, world frame.

    Returns
    -------
    Camera
    """
    points = np.asarray(points, dtype=np.float64)
    direction = np.asarray(direction, dtype=np.float64) / np.linalg.norm(direction)
    origin = points.mean(axis=0)
    basis = Camera(tuple(origin), tuple(origin + direction), tuple(up)).basis
    x, y, s = basis @ (points - origin).T
    t_y = (1.0 - 2.0 * margin) * tan(0.5 * radians(fov_y))
    t_x = t_y * size[0] / size[1]
    centre, back = [], []
    for coordinate, t in ((x, t_x), (y, t_y)):
        upper, lower = np.max(coordinate - t * s), np.min(coordinate + t * s)
        back.append((upper - lower) / (2.0 * t))
        centre.append(0.5 * (upper + lower))
    distance = max(*back, NEAR - float(np.min(s)))
    eye = origin + centre[0] * basis[0] + centre[1] * basis[1] - distance * basis[2]
    return Camera(tuple(eye.tolist()), tuple((eye + distance * basis[2]).tolist()), tuple(up), fov_y)
