"""Pixel observations: pictures of worlds that are written into the caller's arrays."""

from __future__ import annotations

import numpy as np

from physics import World
from rigid_env.extras import require
from rigid_env.rendering.camera_argument import CameraArgument, as_camera, as_switch
from rigid_env.rendering.frame import Frame
from rigid_env.rendering.layout import Room
from rigid_env.rendering.painter import Painter
from rigid_env.rendering.picture import world_frame


class PixelObserver:
    """Draws pictures of worlds into arrays, without text, and by default without arrows.

    One observer draws any number of worlds. The picture depends only on the frame: equal states give equal pixels,
    whatever was drawn before. No window or display is needed. A pickled observer keeps its settings, and draws the same
    pictures; pygame's surfaces and cached backdrops are made anew.

    Parameters
    ----------
    width, height : int
        Size of the picture [px].
    camera : Camera or mapping, optional
        None looks into the room, see `Renderer`.
    room : Room, optional
        Part of space that is shown, see `make_room`. None chooses one for each frame, from its walls and the bodies'
        sizes. Worlds with other sizes are then seen from another place, and the first picture of each takes time for a
        new backdrop.
    arrows : bool
        Whether contact points and the arrows of forces and torques are drawn.

    Raises
    ------
    ValueError
        On a size that is not positive, or a camera with impossible parameters.
    gymnasium.error.DependencyNotInstalled
        If pygame is missing.

    Examples
    --------
    >>> import numpy as np, physics
    >>> from rigid_env.rendering.pixels import PixelObserver
    >>> world = physics.World(physics.scenes.drop(), worlds=4)
    >>> pictures = np.zeros((4, 84, 84, 3), np.uint8)
    >>> observer = PixelObserver(84, 84)
    >>> for index in range(4):
    ...     _ = observer.observe_world(world, index, pictures[index])
    """

    def __init__(
        self, width: int, height: int, camera: CameraArgument = None, *, room: Room | None = None, arrows: bool = False
    ):
        for name, value in (("width", width), ("height", height)):
            if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 1:
                raise ValueError(f"{name} is {value!r}; allowed are integers of at least 1")
        require("render", "pygame", purpose="pixel observations")
        self.width, self.height = int(width), int(height)
        self._camera, self._room, self._arrows = as_camera(camera), room, as_switch(arrows, "arrows")
        self._painter: Painter | None = None

    @property
    def shape(self) -> tuple[int, int, int]:
        """Shape of a picture: (height, width, 3)."""
        return self.height, self.width, 3

    def observe(self, frame: Frame, out: np.ndarray | None = None) -> np.ndarray:
        """Draw a frame.

        Parameters
        ----------
        frame : Frame
        out : (height, width, 3) uint8, optional
            Array that the picture is written into, contiguous in memory, such as a part of a batch. None makes a new
            one.

        Returns
        -------
        (height, width, 3) uint8
            `out`: sRGB, the top row first.

        Raises
        ------
        ValueError
            If `out` has another shape or type. Or if the frame has no walls, and the observer neither camera nor room,
            so that no point of view is defined. Nothing has been written then.
        """
        out = np.empty(self.shape, dtype=np.uint8) if out is None else self._checked(out)
        if not frame.walls and self._camera is None and self._room is None:
            raise ValueError("frame has no walls; allowed is one with walls, or an observer with a camera or a room")
        if self._painter is None:
            self._painter = Painter((self.width, self.height), self._camera, self._room, arrows=self._arrows)
        self._painter.paint(frame)
        self._painter.copy_to(out)
        return out

    def observe_world(self, world: World, index: int = 0, out: np.ndarray | None = None) -> np.ndarray:
        """Draw one world of a batch, as a frame from `world_frame`; errors as of `observe`.

        Parameters
        ----------
        world : World
        index : int
            Index of the world in its batch.
        out : (height, width, 3) uint8, optional
            As of `observe`.

        Returns
        -------
        (height, width, 3) uint8
        """
        return self.observe(world_frame(world, index, arrows=self._arrows), out)

    def _checked(self, out: np.ndarray) -> np.ndarray:
        if not isinstance(out, np.ndarray) or out.shape != self.shape or out.dtype != np.uint8:
            found = f"{out.dtype} {out.shape}" if isinstance(out, np.ndarray) else type(out).__name__
            raise ValueError(f"out is {found}; allowed is a uint8 array {self.shape}")
        if not (out.flags.c_contiguous and out.flags.writeable):
            raise ValueError("out is not contiguous or not writeable; allowed is an array that is both")
        return out

    def __getstate__(self):
        return {**vars(self), "_painter": None}
