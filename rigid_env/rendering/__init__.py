"""Software rendering of a scene into pixels: a `Frame` says what to draw, a `Renderer` draws it.

Knows nothing of physics or Gymnasium environments: frames are made of plain arrays. pygame is imported when
a `Renderer` is made, not before.
"""

from rigid_env.rendering.camera import Camera
from rigid_env.rendering.frame import BodyView, Frame, GoalView, WallView
from rigid_env.rendering.renderer import Renderer

__all__ = ["BodyView", "Camera", "Frame", "GoalView", "Renderer", "WallView"]
