"""Renderer: draws frames into arrays of pixels, with text, and optionally in a window."""

from __future__ import annotations

import numpy as np

from rigid_env.rendering import palette
from rigid_env.rendering.camera_argument import as_camera, as_switch
from rigid_env.rendering.painter import Painter, import_pygame

MODES = ("rgb_array", "human")

FONT_SIZE = 15
"""[px] Size of the font in a picture 600 px high; it grows with the height."""


class Renderer:
    """Draws frames in software, into an array or also in a window.

    Parameters
    ----------
    width, height : int
        Size of the picture [px].
    mode : {"rgb_array", "human"}
        "human" shows the pictures in a window too, at most `fps` a second. "rgb_array" opens no
        window and needs no display.
    fps : float
        Most pictures per second in the window [1/s].
    title : str
        Title of the window.
    camera : Camera, mapping or None
        A mapping has the parameters of a `Camera`, ``{"eye": (0, 8, 20)}``. None chooses a camera that has the whole
        room between the walls in view. It depends on the walls and the bodies' sizes; without walls also on the
        bodies' positions in the first frame drawn.
    bounds : pair of (3,) float, optional
        Lower and upper corner of a box that is in view, too, on sides of the room without a wall [m].
    arrows : bool
        False leaves out contact points and the arrows of forces and torques.
    text : bool
        False leaves out the text.

    Raises
    ------
    gymnasium.error.DependencyNotInstalled
        If pygame is missing.
    ValueError
        On an unknown mode, a size that is not positive, or a camera with impossible parameters.
    """

    def __init__(
        self, width=960, height=600, mode="rgb_array", fps=40, title="rigid-env", camera=None, bounds=None, *,
        arrows=True, text=True,
    ):  # fmt: skip
        if mode not in MODES:
            raise ValueError(f"mode must be one of {MODES}, not {mode!r}")
        if width < 1 or height < 1:
            raise ValueError(f"width and height must be positive, not {width} x {height}")
        self._pygame = import_pygame()
        self.width, self.height, self.mode, self.fps, self.title = int(width), int(height), mode, fps, title
        camera, arrows = as_camera(camera), as_switch(arrows, "arrows")
        self._painter = Painter((self.width, self.height), camera, bounds=bounds, arrows=arrows)
        self._has_text = text
        self._font = self._window = self._clock = None
        self._is_closed = False

    @property
    def is_open(self):
        """True while a window is open; False before the first frame and after the user has closed the window."""
        return self._window is not None

    def draw(self, frame):
        """Draw a frame; in the mode "human" also show it in the window, at most `fps` pictures per second.

        Parameters
        ----------
        frame : Frame

        Returns
        -------
        (height, width, 3) uint8
            New array: sRGB, the top row first.

        Raises
        ------
        RuntimeError
            After `close`.
        """
        if self._is_closed:
            raise RuntimeError("this Renderer is closed; make a new one")
        self._painter.paint(frame)
        if self._has_text:
            self._draw_text(frame.text)
        if self.mode == "human":
            self._show()
        pixels = np.empty((self.height, self.width, 3), dtype=np.uint8)
        self._painter.copy_to(pixels)
        return pixels

    def camera(self, frame):
        """Camera with which `draw` draws this frame; its `project(points, (width, height))` gives pixels."""
        return self._painter.setting(frame).camera

    def close(self):
        """Close the window, if there is one; after that, `draw` raises an error, and `close` does nothing."""
        self._is_closed = True
        self._close_window()

    def _draw_text(self, lines):
        if not lines:
            return
        if self._font is None:
            self._font = _load_font(self._pygame, max(8, round(FONT_SIZE * self.height / 600)))
        if not self._font:
            return
        rows = [self._font.render(line, True, palette.TEXT) for line in lines]
        pad, pitch = self._font.get_height() // 2, self._font.get_linesize() + 2
        size = (max(r.get_width() for r in rows) + 2 * pad, pitch * len(rows) + 2 * pad - 2)
        panel = self._pygame.Surface(size, self._pygame.SRCALPHA, 32)
        box = panel.get_rect()
        self._pygame.draw.rect(panel, (255, 255, 255, 200), box, border_radius=pad)
        self._pygame.draw.rect(panel, (*palette.WALL_OUTLINE, 90), box, width=1, border_radius=pad)
        for i, row in enumerate(rows):
            panel.blit(row, (pad, pad + i * pitch))
        self._painter.picture.blit(panel, (pad, pad))

    def _show(self):
        pygame = self._pygame
        if self._clock is None:
            pygame.display.init()
            self._window = pygame.display.set_mode((self.width, self.height))
            pygame.display.set_caption(self.title)
            self._clock = pygame.time.Clock()
        if self._window is None:
            return
        self._window.blit(self._painter.picture, (0, 0))
        pygame.display.flip()
        if any(event.type == pygame.QUIT for event in pygame.event.get()):
            self._close_window()
            return
        self._clock.tick(self.fps)

    def _close_window(self):
        if self._window is not None:
            self._window = None
            self._pygame.display.quit()


def _load_font(pygame, size):
    """pygame's default font, `size` pixels high, or False if pygame was built without fonts; text is then left out."""
    try:
        pygame.font.init()
        return pygame.font.Font(None, round(1.45 * size))
    except (ImportError, NotImplementedError):  # what pygame raises for a module it was built without
        return False
