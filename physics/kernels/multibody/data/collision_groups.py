"""Collision groups in kernels: bit masks decide which bodies and walls may touch. Scenes without groups lack them."""

from __future__ import annotations

from physics.compiler.decorators import if_given


@if_given("many.bodies.groups", True)
def share_group(b, end, many):
    """True if the groups and masks of body b and of an end let them touch; the end is a body, or -1 - k for wall k."""
    row = end if end >= 0 else many.bodies.state.shape[0] - 1 - end
    groups = many.bodies.groups
    return (groups[b, 0] & groups[row, 1]) != 0 and (groups[b, 1] & groups[row, 0]) != 0
