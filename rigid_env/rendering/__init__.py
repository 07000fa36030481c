"""Software rendering of a scene into pixels: a `Frame` says what to draw, a `Renderer` draws it.

Knows nothing of physics or Gymnasium environments: frames are made of plain arrays. pygame is imported when
a `Renderer` is made, not before. `rendering.picture` makes frames of a `physics.World`, `rendering.pixels` pixel
observations of one.
"""

from rigid_env.rendering.camera import Camera, fit_camera
from rigid_env.rendering.frame import BodyView, Frame, GoalView, WallView
from rigid_env.rendering.layout import Room, make_room
from rigid_env.rendering.renderer import Renderer

__all__ = ["BodyView", "Camera", "Frame", "GoalView", "Renderer", "Room", "WallView", "fit_camera", "make_room"]
