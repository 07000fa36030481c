"""Flight of a body in stiff fields: a flight cut into parts that begin short and grow.

Damping at the rate λ changes the velocity during a few times 1/λ; afterwards λ may still be as large, as it is for
linear drag. So the first part has a fixed share of 1/λ, and each next part is longer by a constant factor. The local
error of a part is a share of the remaining velocity, which falls faster than the parts grow. A flight of length h with
λ h = 10¹² takes 72 parts. The last allowed part is the rest of the flight, by an implicit step; the velocity is
negligible by then.
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

# First part of a flight, in units of 1/λ; growth from part to part; largest number of parts.
_FIRST_PART = 0.25
_PART_GROWTH = 1.5
_MAX_PARTS = 72

# Largest number of iterations of Newton's method for loads that agree with the end of a part. The iteration has
# converged when its last change is this share of the loads; up to the second share its result is used nevertheless.
_NEWTON_ROUNDS = 12
_CONVERGED = 1.0e-12
_NEARLY_CONVERGED = 1.0e-3


@kernel
def implicit_flight(y, h, flight, body):
    """State after a flight of h [s] from y under loads that agree with its end (discrete gradients).

    Newton's method finds the loads A from those that act at first: A' = A + (1 + M⁻¹ Z)⁻¹ (A(y, end) - A). If it does
    not converge, the first loads are kept. The loads found act on the body afterwards.
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
    """State after a flight of h [s] from y, which is cut into parts if its force fields are stiff.

    Otherwise the state is `end`, the result of the flight under held loads. The present time of the body is the same
    afterwards; the caller advances it.
    """
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
