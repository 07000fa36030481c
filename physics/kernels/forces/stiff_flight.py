"""Flight in fields that are stiff: a step cut into parts that begin short and grow.

Damping changes a velocity during a few times 1/λ, and λ may stay as large afterwards, as it does for linear drag. So
the first part is a share of 1/λ, and each next one is longer by a constant factor. Local errors are a share of the
remaining velocity, which falls faster than parts grow. λ h = 10¹² takes 72 parts. The last allowed part takes the rest
of the step, by an implicit step, when the velocity is negligible.
"""

from __future__ import annotations

from physics.compiler.decorators import kernel
from physics.kernels.flight.free_flight import integrate_flight
from physics.kernels.forces.energy_budget import limit_energy_gain
from physics.kernels.forces.field_loads import acting_loads, apply_total_loads, load_bound
from physics.kernels.forces.force_field_dispatch import if_declared
from physics.kernels.forces.held_loads import advance_clock, hold_loads, set_now, time_now
from physics.kernels.forces.resolution_limits import newton_load_change
from physics.kernels.math.vector import plus

# First part of a step, in 1/λ; growth from part to part; parts.
_FIRST_PART = 0.25
_PART_GROWTH = 1.5
_MAX_PARTS = 72

# Rounds of Newton's method for loads that agree with the end of a part, the share of the loads at which they count as
# settled, and the one up to which they are better than those of one round.
_NEWTON_ROUNDS = 12
_CONVERGED = 1.0e-12
_NEARLY_CONVERGED = 1.0e-3


@kernel
def implicit_flight(y, h, flight, body):
    """Flight over h from y under loads that agree with its end: discrete gradients, by Newton's method from held loads.

    A' = A + (1 + M⁻¹ Z)⁻¹ (A(y, end) - A). If the iteration does not settle, the loads of the first step are kept.
    """
    start = acting_loads(body)
    size, loads = load_bound(start, body), start
    for _ in range(_NEWTON_ROUNDS):
        end = integrate_flight(y, h, flight, body)
        change = newton_load_change(y, end, loads, h, flight.gyroscopic, flight.offset_frame, body)
        loads = plus(loads[0], change[0]), plus(loads[1], change[1])
        apply_total_loads(loads, body)
        if load_bound(change, body) <= _CONVERGED * size:
            break
    if not load_bound(change, body) <= _NEARLY_CONVERGED * size:
        apply_total_loads(start, body)
    return integrate_flight(y, h, flight, body)


def _as_it_is(end, y, h, flight, body):
    return end


@if_declared(_as_it_is)
def subdivide_stiff_flight(end, y, h, flight, body):
    """State `end` of a flight over h from y under held loads; stiff flights are made in parts."""
    if body.is_stiff == 0:
        return end
    start, left, part = time_now(body), h, 0.0
    for k in range(_MAX_PARTS):
        hold_loads(y, left, flight.gyroscopic, flight.offset_frame, body)
        part = _PART_GROWTH * part
        if body.rate > 0.0:
            part = max(part, _FIRST_PART / body.rate)
        if not 0.0 < part < left or k == _MAX_PARTS - 1:
            part = left
        if part < left:
            hold_loads(y, part, flight.gyroscopic, flight.offset_frame, body)
        if body.is_stiff == 1:
            end = implicit_flight(y, part, flight, body)
        else:
            end = integrate_flight(y, part, flight, body)
        y = limit_energy_gain(y, end, part, True, flight.offset_frame, body)
        left -= part
        advance_clock(part, body)
        if not left > 0.0:
            break
    set_now(start, body)
    return y
