"""A pinhole camera: world points to pixels and depths, and clipping to the field of view."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import radians, tan

import numpy as np

from rigid_env.rendering.geometry import clip_polygon

NEAR = 0.1
"""[m]. Nothing nearer than this is drawn; keeps the division by depth well away from zero."""

GUARD = 1.5
"""Polygons are clipped to this many times the picture's extent: out of sight, yet within 16-bit pixels."""


@dataclass(frozen=True)
class Camera:
    """A pinhole camera.

    Parameters
    ----------
    eye, target, up : (3,) tuple of float
        [m], world frame. The camera is at `eye`, sees `target` in the middle of the picture, and `up` points
        upwards in it (not along the line of sight).
    fov_y : float
        [deg]. Vertical field of view.
    """

    eye: tuple[float, float, float]
    target: tuple[float, float, float] = (0.0, 0.0, 0.0)
    up: tuple[float, float, float] = (0.0, 1.0, 0.0)
    fov_y: float = 30.0

    @cached_property
    def basis(self):
        """(3, 3) float64. Rows: right, up and forward, unit vectors in the world frame."""
        forward = np.subtract(self.target, self.eye)
        forward = forward / np.linalg.norm(forward)
        right = np.cross(forward, self.up)
        right = right / np.linalg.norm(right)
        return np.array([right, np.cross(right, forward), forward])

    def focal(self, height):
        """Focal length [px] for a picture `height` pixels high."""
        return 0.5 * height / tan(0.5 * radians(self.fov_y))

    def to_camera(self, points):
        """World points in the camera's frame.

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
        """Pixels and depths of world points.

        Parameters
        ----------
        points : (n, 3) float
            [m], world frame.
        size : (width, height)
            [px].

        Returns
        -------
        pixels : (n, 2) float64
            [px]. x to the right, y down, (0, 0) the picture's upper left corner. Of no meaning where
            depth ≤ 0.
        depth : (n,) float64
            [m]. Along the line of sight.
        """
        local = self.to_camera(points)
        return self._to_pixels(local, size), local[:, 2]

    def project_polygon(self, polygon, size):
        """Pixels of a convex polygon (or a segment), clipped to near plane and field of view.

        Parameters
        ----------
        polygon : (n, 3) float
            [m], world frame, vertices in order; n = 2 is a segment.
        size : (width, height)
            [px].

        Returns
        -------
        (k, 2) float64
            [px]. k = 0 if none of it is in sight.
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
        """Direction of the ray through the middle of every pixel, with depth 1.

        Parameters
        ----------
        size : (width, height)
            [px].

        Returns
        -------
        (height, width, 3) float32
            World frame: eye + depth · ray is what the pixel sees.
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
    """Nearest camera that looks along a direction and has all points in sight.

    A point has the coordinates x across the picture and s along the line of sight. The eye is at x = c, a distance d
    back. The point is in sight if |x - c| ≤ t (s + d), with t the tangent of half the field of view. All points are if
    max(x - t s) - t d ≤ c ≤ min(x + t s) + t d. So d is at least (max(x - t s) - min(x + t s)) / (2t), and with this d
    one c is left, in the middle. Upwards the same holds; the larger d is taken.

    Parameters
    ----------
    points : (n, 3) float
        [m], world frame.
    direction : (3,) float
        Where the camera looks to, world frame.
    size : (width, height)
        [px].
    fov_y : float
        [deg]. Vertical field of view.
    margin : float
        Part of the picture left free on each side.
    up : (3,) float

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
