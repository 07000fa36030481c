"""Volume and centre of the part of a cylinder or capsule below a plane, by quadrature over slices across its axis.

The slice at the place y of the axis is a disk of radius ρ(y). The plane is at the height n_y y + d below the disk's
centre (d: at y = 0), and cuts the disk along a chord. Let s be the depth of its centre, divided by ρ √(1 - n_y²) and
clamped to [-1, 1]. The wet segment has the area and the moment about the centre, against the normal in the slice,

    ρ² (acos(-s) + s √(1 - s²)),    ⅔ ρ³ (1 - s²)^{3/2}.

Both have a kink of the power 3/2 where the plane enters or leaves the disks. The axis is cut there, which leaves at
most three pieces of each cylinder or half sphere. With y = m + w sin φ the kinks are smooth in φ, so that Gauss's rule
converges quickly in each piece: `tests/physics/test_fields_of_shapes.py` holds it to 1e-9 m³ for bodies of a metre.
"""

from __future__ import annotations

import math

import numpy as np

from physics.compiler.decorators import inlined, kernel

# Gauss's rule of so many nodes on [-π/2, π/2].
NODES = 24
_X, _W = np.polynomial.legendre.leggauss(NODES)
_TURN = tuple((0.5 * math.pi * _X).tolist())
_WEIGHT = tuple((0.5 * math.pi * _W).tolist())


@inlined
def _disk(y, bulge, r):
    """Radius of the disk at the place y from the centre of a half sphere (`bulge` 1) or of a cylinder (0) [m]."""
    return math.sqrt(max(r * r - bulge * y * y, 0.0))


@kernel
def _piece(begin, end, bulge, r, n_y, d):
    """Volume, its moments along the axis and against the normal across it, of the slices from `begin` to `end`.

    The places are those of `_disk`; d is the height of the disk's centre above the plane at the place 0 [m].
    """
    volume = along = across = 0.0
    middle, half, flat = 0.5 * (begin + end), 0.5 * (end - begin), math.sqrt(max(1.0 - n_y * n_y, 0.0))
    for k in range(NODES):
        y = middle + half * math.sin(_TURN[k])
        weight, rho, depth = half * math.cos(_TURN[k]) * _WEIGHT[k], _disk(y, bulge, r), -(n_y * y + d)
        reach = rho * flat
        s = max(-1.0, min(1.0, depth / reach)) if reach > 0.0 else (1.0 if depth > 0.0 else -1.0)
        root = math.sqrt(1.0 - s * s)
        area = weight * rho * rho * (math.acos(-s) + s * root)
        volume, along = volume + area, along + area * y
        across += weight * rho * rho * rho * 2.0 / 3.0 * root * root * root
    return volume, along, across


@inlined
def _kinks(bulge, r, n_y, d):
    """Places at which the plane enters and leaves the disks, in order; both far away if it does neither [m].

    They solve (n_y y + d)² = (1 - n_y²) ρ². With a = n_y² of a cylinder, and 1 of a sphere, the roots are
    (-n_y d ± √q)/a, where q is (1 - n_y²) n_y² r² or (1 - n_y²) (r² - d²).
    """
    flat = max(1.0 - n_y * n_y, 0.0)
    a, q = n_y * n_y, flat * n_y * n_y * r * r
    if bulge > 0.0:
        a, q = 1.0, flat * (r * r - d * d)
    if not a > 0.0 or q < 0.0:
        return -math.inf, -math.inf
    return (-n_y * d - math.sqrt(q)) / a, (-n_y * d + math.sqrt(q)) / a


@kernel
def _section(begin, end, bulge, r, n_y, d):
    """Sum of `_piece` over the pieces of [begin, end] that the kinks part."""
    first, second = _kinks(bulge, r, n_y, d)
    volume = along = across = 0.0
    low = begin
    for k in range(3):
        high = end
        if k == 0:
            high = min(max(first, begin), end)
        elif k == 1:
            high = min(max(second, begin), end)
        if high > low:
            v, a, c = _piece(low, high, bulge, r, n_y, d)
            volume, along, across, low = volume + v, along + a, across + c, high
    return volume, along, across


@kernel
def wet_revolution(r, half, has_caps, n, height):
    """Volume of the part below a plane of a cylinder, or a capsule, and the centre of that part.

    Parameters
    ----------
    r, half : float
        Radius, and half the length of the cylinder without caps, along y [m].
    has_caps : bool
        True for a capsule, whose ends are half spheres.
    n : tuple of 3 floats
        Normal of the plane, up, in body axes.
    height : float
        Height of the body's centre above the plane [m].

    Returns
    -------
    volume : float
        Volume of the part below the plane [m³].
    centre : tuple of 3 floats
        Its centre relative to the body's, in body axes [m]; zero if the volume is zero.
    """
    volume, along, across = _section(-half, half, 0.0, r, n[1], height)
    if has_caps:
        for end in (-1.0, 1.0):
            begin, stop = (-r, 0.0) if end < 0.0 else (0.0, r)
            v, a, c = _section(begin, stop, 1.0, r, n[1], height + n[1] * end * half)
            volume, along, across = volume + v, along + a + end * half * v, across + c
    if not volume > 0.0:
        return 0.0, (0.0, 0.0, 0.0)
    flat = math.sqrt(n[0] * n[0] + n[2] * n[2])
    s = -across / (volume * flat) if flat > 0.0 else 0.0
    return volume, (s * n[0], along / volume, s * n[2])
