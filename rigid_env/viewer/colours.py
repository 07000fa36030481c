"""Colours of `rendering.palette` as viser has to be told them."""

from __future__ import annotations

import numpy as np

SATURATION = 1.6
"""Exponent by which the weaker channels of a colour are made weaker: viser's tone mapping pales every colour."""


def vivid(colours) -> np.ndarray:
    """Colours (..., 3) sRGB, 0..255, richer in proportion; grey stays grey; uint8."""
    colours = np.asarray(colours, dtype=float)
    strongest = np.maximum(colours.max(axis=-1, keepdims=True), 1.0)
    return np.rint(strongest * (colours / strongest) ** SATURATION).astype(np.uint8)
