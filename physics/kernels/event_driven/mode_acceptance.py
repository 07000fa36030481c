"""Steps of a regime whose guards of force say nothing: the search for the regime judges them, after each.

Where contacts are more than the body's motion needs, their forces can be shared out in many ways, of which the linear
system takes one. That one may leave a cone, or pull, where others hold: the guard ends the regime and the search finds
the same one again. Then these guards are not heeded for it. After every step the regime is looked for, and the step is
taken back and made shorter when the acceleration has jumped in it: then another regime had begun before its end.
"""

from __future__ import annotations

from physics.kernels.compile.decorators import inlined, kernel
from physics.kernels.event_driven.contact_candidates import ASKS, ASKS_SLIDING, GOES_BACK, MOVES, RESTS
from physics.kernels.event_driven.extrapolated_midpoint import put_state, start_step
from physics.kernels.event_driven.workspace import SIZE, START, L, V

# The first such step in look-aheads, its growth after each that holds, and its share after each that does not: slips
# begin with no acceleration, so that one found a look-ahead late, 1e-5 of the body's time, is off by the square of it.
FIRST = 64.0
GROWTH = 4.0
SHORTER = 0.25

# Change of acceleration that is none, in weights.
SAME = 1.0e-6

NONE = 0


@inlined
def name_of_regime(motion):
    """A number for which contacts act and which of them hold."""
    name = 1
    for j in range(motion.count):
        name = 131 * name + 2 * motion.slot[j] + motion.holds[j]
    return name


@inlined
def is_heeded(motion):
    """True if the guards of force say something of this regime."""
    return motion.unheeded == NONE or name_of_regime(motion) != motion.unheeded


@inlined
def distrust(nearest, motion):
    """The guards of force are not heeded for this regime any more."""
    motion.unheeded = name_of_regime(motion)
    motion.trust = FIRST * nearest


@kernel
def has_jumped(what, y, tilted, work, motion):
    """True if the step that led to y went too far: what the body does there does not go on from what it did."""
    if what in (RESTS, ASKS, ASKS_SLIDING):
        return False
    if what != MOVES:
        return True
    put_state(motion, START, y)
    motion.step = motion.ahead
    start_step(motion.ahead, tilted, work, motion)
    for c in range(V, SIZE):
        unit = motion.weight / work.mass if c < L else motion.weight * work.radius
        if abs(motion.first_rate[c] - motion.end_rate[c]) > SAME * unit:
            return True
    return False


@kernel
def judge(what, watched, y, tilted, work, motion):
    """Judge the regime at y; GOES_BACK where the watched step that led there was too long, and no mere look-ahead."""
    if watched > motion.nearest and has_jumped(what, y, tilted, work, motion):
        return GOES_BACK
    return what
