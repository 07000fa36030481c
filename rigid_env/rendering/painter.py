"""Painter of frames into a picture in memory: calls the stages of drawing in order, and caches unmoving parts."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, replace

import numpy as np

from rigid_env.extras import require
from rigid_env.rendering import palette
from rigid_env.rendering.backdrop import draw_backdrop
from rigid_env.rendering.bodies import draw_bodies
from rigid_env.rendering.camera import NEAR, Camera
from rigid_env.rendering.canvas import REFERENCE_HEIGHT, SUPERSAMPLING, Canvas
from rigid_env.rendering.layout import Room, default_camera, make_room
from rigid_env.rendering.overlays import (
    draw_contacts,
    draw_far_outlines,
    draw_goal,
    draw_near_walls,
    draw_path,
    draw_wrench,
    has_near_walls,
)
from rigid_env.rendering.sensors import draw_sensors
from rigid_env.rendering.shadow_layer import LitWall, ShadowLayer, lit_walls

BODY_STAGES = (draw_path, draw_bodies, draw_sensors)
ARROW_STAGES = (draw_contacts, draw_wrench)
"""Stages of drawing that draw arrows, in order; each is a function of canvas, frame and room."""

LINE_REACH = 3.0
"""[px] Largest distance of a body's outline from the body, in pictures up to 600 px high; it grows with the height."""

SMALL = 20_000
"""Largest number of pixels of a picture that is always drawn whole; finding the part with the bodies would take longer.
"""

KEPT_PIXELS = 5_000_000
"""Largest number of pixels of all cached backdrops together: eight of 960 x 600 px, or 700 of 84 x 84 px."""


@dataclass(frozen=True, eq=False)
class Setting:
    """Unmoving parts of a picture, which are cached.

    Parameters
    ----------
    room : Room
        Part of space that is shown.
    camera : Camera
    backdrop : (height, width, 4) uint8
        Background, floor, walls and goal.
    lit_walls : list of LitWall
        Walls that shadows can fall on.
    pane : pygame.Surface or None
        Walls between camera and scene, a surface of the picture's size with alpha; None: there are none.
    """

    room: Room
    camera: Camera
    backdrop: np.ndarray
    lit_walls: list[LitWall]
    pane: object


class Painter:
    """Draws frames into a picture in memory.

    Parameters
    ----------
    size : (width, height)
        Size of the picture [px].
    camera : Camera or None
        None takes `layout.default_camera`.
    room : Room or None
        Part of space that is shown; None makes one for each frame, by `layout.make_room`. The walls are always the
        frame's.
    bounds : pair of (3,) float or None
        Corners of a box that is in view, too, as of `layout.make_room`.
    arrows : bool
        Whether contacts, forces and torques are drawn.

    Attributes
    ----------
    picture : pygame.Surface
        Picture of the last frame; the next `paint` overwrites it.

    Raises
    ------
    gymnasium.error.DependencyNotInstalled
        If pygame is missing.
    """

    def __init__(self, size, camera=None, room=None, bounds=None, arrows=True):
        self._pygame = import_pygame()
        self.size = size
        self._camera, self._room, self._bounds = camera, room, bounds
        self._has_arrows, self._stages = arrows, BODY_STAGES + (ARROW_STAGES if arrows else ())
        self._line_reach = LINE_REACH * max(1.0, size[1] / REFERENCE_HEIGHT)
        self._memory, self.picture = self._surface(size, "RGBX")
        _, self._canvas = self._surface((SUPERSAMPLING * size[0], SUPERSAMPLING * size[1]), "RGBX")
        self._shadows = ShadowLayer(size, self._pygame)
        self._settings = OrderedDict()
        self._backdrop = (None, None)  # key and pixels of the last one without a goal

    def _surface(self, size, layout):
        """Make an array (height, width, 4) uint8, and a surface on the same memory.

        `layout` is the order of the colour channels; surfaces with equal orders are blended ten times as fast.
        """
        memory = np.zeros((size[1], size[0], 4), dtype=np.uint8)
        return memory, self._pygame.image.frombuffer(memory, size, layout)

    def paint(self, frame):
        """Draw a `Frame` on `picture`."""
        setting = self.setting(frame)
        np.copyto(self._memory, setting.backdrop)
        if frame.bodies:
            self._shadows.draw(self.picture, setting.camera, setting.lit_walls, frame)
        box = self._box(frame, setting.camera)
        if box:
            canvas = self._enlarged(setting.camera, box)
            for stage in self._stages:
                stage(canvas, frame, setting.room)
            self._reduce(box)
        if setting.pane is not None:
            self.picture.blit(setting.pane, (0, 0))

    def copy_to(self, out):
        """Copy the picture into a contiguous (height, width, 3) uint8 array."""
        self._pygame.image.frombuffer(out, self.size, "RGB").blit(self.picture, (0, 0))

    def setting(self, frame):
        """Unmoving parts of a frame's picture, cached for later frames with the same walls, shapes and goal."""
        key = self._key(frame)
        setting = self._settings.get(key)
        if setting is None:
            setting = self._settings[key] = self._make_setting(frame)
            while len(self._settings) > max(1, KEPT_PIXELS // (self.size[0] * self.size[1])):
                self._settings.popitem(last=False)
        self._settings.move_to_end(key)
        return setting

    def _key(self, frame):
        goal = frame.goal
        axis = () if goal is None or goal.axis is None else tuple(goal.axis.tolist())
        place = goal and (goal.pos is not None and (*goal.pos.tolist(), goal.radius, goal.reached, axis))
        return *self._room_key(frame), place

    def _room_key(self, frame):
        walls = tuple((*wall.normal.tolist(), wall.offset) for wall in frame.walls)
        shapes = () if self._room else tuple((body.kind, *body.dimensions.tolist()) for body in frame.bodies)
        return walls, shapes

    def _make_setting(self, frame):
        if self._room:
            room = replace(self._room, walls=frame.walls)
        else:
            room = make_room(frame.walls, frame.bodies, self._bounds)
        camera = self._camera or default_camera(room, self.size)
        if self._backdrop[0] != self._room_key(frame):
            self._backdrop = self._room_key(frame), draw_backdrop(camera, self.size, room)
        self._memory[..., :3] = self._backdrop[1]
        canvas = self._enlarged(camera)
        draw_far_outlines(canvas, room)
        draw_goal(canvas, frame.goal, room)
        self._reduce()
        lit = lit_walls(camera, self._shadows.size, room, self._pygame)
        return Setting(room, camera, self._memory.copy(), lit, self._make_pane(camera, room))

    def _make_pane(self, camera, room):
        if not has_near_walls(camera, room):
            return None
        _, large = self._surface(self._canvas.get_size(), "RGBA")
        large.fill((*palette.HALO, 0))
        draw_near_walls(Canvas(large, camera, self._pygame), room)
        _, pane = self._surface(self.size, "RGBA")
        return self._pygame.transform.smoothscale(large, self.size, pane)

    def _box(self, frame, camera):
        """Rectangle [px] outside of which the stages draw nothing, a `pygame.Rect`.

        A point at most r away from a point at depth z and lateral offset x, both along the camera's axes, is at most
        f r √(1 + (x/z)²) / (z - r) away from it in the picture, where f is the focal length.
        """
        whole = self._pygame.Rect((0, 0), self.size)
        has_lines = len(frame.path) > 1 or bool(frame.sensors) or (self._has_arrows and frame.has_arrows)
        if self.size[0] * self.size[1] < SMALL or has_lines:
            return whole
        if not frame.bodies:
            return self._pygame.Rect(0, 0, 0, 0)
        poses, focal = frame.poses, camera.focal(self.size[1])
        pixels, depths = camera.project(poses.pos, self.size)
        nearest = (depths - poses.radius)[:, None]
        if nearest.min() < NEAR:
            return whole
        slopes = (pixels - 0.5 * np.array(self.size)) / focal
        reach = focal * poses.radius[:, None] * np.sqrt(1.0 + slopes**2) / nearest + self._line_reach
        low, high = np.floor((pixels - reach).min(axis=0)), np.ceil((pixels + reach).max(axis=0))
        return whole.clip((*low.tolist(), *(high - low).tolist()))

    def _enlarged(self, camera, box=None):
        """Copy the picture, or its part in `box`, onto the canvas at the canvas's scale; returns a `Canvas`."""
        small, large = self._parts(box)
        self._pygame.transform.scale(small, large.get_size(), large)
        return Canvas(self._canvas, camera, self._pygame)

    def _reduce(self, box=None):
        """Copy the canvas, or its part for `box`, back to the picture; each pixel is the mean of its canvas pixels."""
        small, large = self._parts(box)
        self._pygame.transform.smoothscale(large, small.get_size(), small)

    def _parts(self, box):
        if box is None:
            return self.picture, self._canvas
        return self.picture.subsurface(box), self._canvas.subsurface([SUPERSAMPLING * length for length in box])


def import_pygame():
    """Import pygame and its module `gfxdraw`; if it is missing, the error names the extra that installs it."""
    require("render", "pygame", purpose="rendering")
    import pygame
    import pygame.gfxdraw

    return pygame
