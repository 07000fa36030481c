"""Colours of pictures, the direction of the light, and the shading of surfaces."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

BACKGROUND_TOP = (243, 246, 250)
BACKGROUND_BOTTOM = (221, 228, 238)
FLOOR = (252, 253, 254)
WALL = (188, 203, 224)
GRID = (150, 165, 186)
WALL_OUTLINE = (124, 141, 168)
SHADOW = (38, 50, 78)

BODIES = ((58, 118, 222), (238, 150, 60), (46, 160, 140), (150, 104, 208))
"""Colours of bodies without a colour of their own, taken in turn."""

CONTACT = (222, 52, 60)
PATH = (92, 140, 220)
APPLIED_FORCE = (245, 136, 24)
TORQUE = (136, 72, 210)
GOAL = (14, 156, 178)
GOAL_REACHED = (34, 172, 92)
SENSOR = (206, 72, 152)
HALO = (255, 255, 255)
TEXT = (44, 54, 74)

LIGHT = np.array([0.50, 1.0, 0.42]) / np.linalg.norm([0.50, 1.0, 0.42])
"""Unit vector towards the light, world frame: from the right, above and the viewer's side."""

SUN = 0.80
"""Strength of the directional light from `LIGHT`, in linear intensity."""

SKY, GROUND = 0.46, 0.26
"""Ambient light on a face whose normal points straight up, and straight down, in linear intensity."""

GLOSS, SHININESS = 0.16, 24.0
"""Strength and exponent of the highlight (Blinn 1977)."""


def to_linear(colour):
    """Convert sRGB values 0..255 to linear intensities 0..1 (IEC 61966-2-1), in the same shape."""
    c = np.asarray(colour, dtype=np.float64) / 255.0
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def to_srgb(intensity):
    """Convert linear intensities, clipped to 0..1, to sRGB values 0..255 as int, in the same shape."""
    i = np.clip(intensity, 0.0, 1.0)
    c = np.where(i <= 0.0031308, 12.92 * i, 1.055 * i ** (1.0 / 2.4) - 0.055)
    return np.rint(255.0 * c).astype(np.int64)


_LINEAR = to_linear(np.arange(256))
_SRGB_STEPS = 65535
_SRGB = to_srgb(np.arange(_SRGB_STEPS + 1) / _SRGB_STEPS)
"""Table of sRGB values, since powers are slow; neighbours differ by at most 255 · 12.92 / 65535 = 0.05 levels."""


def shade(colours, normals, towards_eye):
    """Colours of flat faces in the light: Lambert's law, ambient light that is stronger from above, and a highlight.

    Parameters
    ----------
    colours : (n, 3) or (3,) float
        Surface colours, sRGB, 0..255; rounded here.
    normals : (n, 3) float
        Outward unit normals, world frame.
    towards_eye : (n, 3) float
        Unit vectors from the faces to the camera, world frame.

    Returns
    -------
    (n, 3) int64
        sRGB, 0..255.
    """
    lambert = np.maximum(normals @ LIGHT, 0.0)
    ambient = GROUND + (SKY - GROUND) * 0.5 * (1.0 + normals[:, 1])
    half = LIGHT + towards_eye
    half /= np.maximum(np.sqrt(np.sum(half * half, axis=1, keepdims=True)), 1e-12)
    highlight = GLOSS * np.maximum(np.sum(normals * half, axis=1), 0.0) ** SHININESS
    albedo = _LINEAR[np.rint(colours).astype(np.intp)]
    lit = albedo * (ambient + SUN * lambert)[:, None] + (highlight * (lambert > 0.0))[:, None]
    return _SRGB[np.rint(_SRGB_STEPS * np.minimum(lit, 1.0)).astype(np.intp)]


@lru_cache(maxsize=256)
def mix(colour, other, part):
    """Mix two sRGB colours: `part` (0 to 1) of `other`, and the rest of `colour`; returns a tuple of int."""
    return tuple(round((1.0 - part) * a + part * b) for a, b in zip(colour, other))
