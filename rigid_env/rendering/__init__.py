"""Software rendering of a scene: a `Frame` has the contents of a picture, and a `Renderer` turns them into pixels.

These classes do not depend on the physics engine or on Gymnasium: frames are made of plain arrays. pygame is imported
when a `Renderer` is made. `rendering.picture` makes frames of a `physics.World`, and `rendering.pixels` makes pixel
observations of one.
"""

from rigid_env.rendering.camera import Camera, fit_camera
from rigid_env.rendering.frame import BodyView, Frame, GoalView, WallView
from rigid_env.rendering.layout import Room, make_room
from rigid_env.rendering.renderer import Renderer

__all__ = ["BodyView", "Camera", "Frame", "GoalView", "Renderer", "Room", "WallView", "fit_camera", "make_room"]
