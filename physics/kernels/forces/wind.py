"""Wind: the velocity of the air, the same everywhere; steady, or with gusts.

A gust is a sum of N waves for each axis i, with phases φ that each world has of its own:

    u_i(t) = U_i + σ √(2/N) Σ_k cos(ω_k t + φ_ik),    ω_k = tan(π (k - ½)/(2N)) / τ,  k = 1 .. N.

U is the mean wind, σ the standard deviation, τ the correlation time. The ω_k cut the spectrum 2τ/π / (1 + (ωτ)²) into N
parts of equal energy. So the variance is exactly σ², and the correlation over a time s is (1/N) Σ cos(ω_k s), which
tends to exp(-s/τ) as N grows. The gust is smooth, so it can be integrated to any tolerance. It is a formula in t, so it
needs no memory.

References
----------
H. L. Dryden, *A review of the statistical theory of turbulence*, Q. Appl. Math. 1, 1943, for the spectrum; the sum of
waves: M. Shinozuka, G. Deodatis, *Simulation of stochastic processes by spectral representation*, Appl. Mech. Rev. 44,
1991.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel

WIND_WAVES = 8  # N

# Columns of the parameters p.
WIND_MEAN = 0  # U [m/s]
WIND_GUST = 3  # σ [m/s]
WIND_TIME_SCALE = 4  # τ [s]
WIND_PHASES = 5  # φ of the N waves of x, then y, then z [rad]
WIND_SIZE = WIND_PHASES + 3 * WIND_WAVES


@inlined
def gust_frequency(k, time_scale):
    """Angular frequency of the wave k = 0 .. N - 1 of a gust [rad/s], for its correlation time τ [s]."""
    return math.tan(0.5 * math.pi * (k + 0.5) / WIND_WAVES) / time_scale


@kernel
def _gust(axis, p, t):
    total = 0.0
    for k in range(WIND_WAVES):
        total += math.cos(gust_frequency(k, p[WIND_TIME_SCALE]) * t + p[WIND_PHASES + WIND_WAVES * axis + k])
    return p[WIND_MEAN + axis] + p[WIND_GUST] * math.sqrt(2.0 / WIND_WAVES) * total


@inlined
def wind(state, p, t):
    """Velocity of the air at the time t [s], world frame [m/s]; it does not depend on the body's state."""
    if p[WIND_GUST] == 0.0:
        return (p[WIND_MEAN], p[WIND_MEAN + 1], p[WIND_MEAN + 2])
    return (_gust(0, p, t), _gust(1, p, t), _gust(2, p, t))
