"""Fixed bodies, which no step moves. The member `fixed` of `bodies` is None if the scene has no fixed body."""

from __future__ import annotations

from physics.compiler.decorators import if_given, inlined


@if_given("bodies.fixed", False)
def is_fixed(b, bodies):
    """True if body b is fixed."""
    return bodies.fixed[b] == 1


@inlined
def clear_loads(body):
    """Clear the loads in the record of a fixed body: neither gravity nor a wrench moves it."""
    for c in range(3):
        body.free_acceleration[c] = body.torque[c] = 0.0
    body.acceleration = 0.0
