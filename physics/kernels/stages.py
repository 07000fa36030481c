"""The two contact stages of a substep: impact (velocities jump) and touch (Moreau's midpoint step)."""

from __future__ import annotations

from physics.kernels import layout as at
from physics.kernels import quaternion as qt
from physics.kernels.body import angular_velocity, principal_attitude
from physics.kernels.compiler import inlined, kernel
from physics.kernels.contact import aim_impact, aim_rest, place_arms
from physics.kernels.flight import drift
from physics.kernels.resist import aim_tangential, resist_turning, without_gain
from physics.kernels.slide import SLIDE
from physics.kernels.solve import PIVOTING, solve_contacts

# Row of `memory`: length of the last resting stage [s], its contact count, which direct solve worked last
# (`slide.HOLD`, `SLIDE`, `PIVOT` + slot), the slots of its contacts, then the impulses of all slots, zero where
# there is no contact.
STAGE_LENGTH, CONTACT_COUNT, MODE = range(3)
MEMORY_HEAD = 3


def memory_size(slots: int) -> int:
    """Columns of `memory` for bodies with `slots` possible contacts."""
    return MEMORY_HEAD + 4 * slots


@inlined
def load_warm_start(n, width, memory, i, h, work):
    """Impulses of the last resting stage, by slot, scaled to a stage of length h."""
    first = MEMORY_HEAD + work.slot.shape[0]
    scale = 0.0
    if memory[i, STAGE_LENGTH] > 0.0:
        scale = h / memory[i, STAGE_LENGTH]
    for k in range(n):
        base = first + 3 * work.slot[k]
        for c in range(width):
            work.impulse[width * k + c] = memory[i, base + c] * scale


@inlined
def store_warm_start(n, width, memory, i, h, work):
    """Keep the impulses of this resting stage by slot; what no longer touches is forgotten."""
    first = MEMORY_HEAD + work.slot.shape[0]
    for k in range(int(memory[i, CONTACT_COUNT])):
        base = first + 3 * int(memory[i, MEMORY_HEAD + k])
        for c in range(3):
            memory[i, base + c] = 0.0
    memory[i, STAGE_LENGTH] = h
    memory[i, CONTACT_COUNT] = n
    for k in range(n):
        memory[i, MEMORY_HEAD + k] = work.slot[k]
        base = first + 3 * work.slot[k]
        for c in range(width):
            memory[i, base + c] = work.impulse[width * k + c]


@inlined
def note_solve(report, world, residual, sweeps, method, tolerance):
    """Add one contact solve to the world's report."""
    report[world, at.SOLVES] += 1.0
    report[world, at.ITERATIONS] += sweeps
    report[world, at.RESIDUAL] = max(report[world, at.RESIDUAL], residual)
    report[world, at.SOLVER] = max(report[world, at.SOLVER], float(method))
    if method == PIVOTING:
        report[world, at.FALLBACKS] += 1.0
    if not residual <= tolerance:
        report[world, at.UNCONVERGED] += 1.0


@kernel
def impact(n, y, h, friction, smooth, tilted, pivots, report, work):
    """State after the impulses of the contacts that approach; unchanged when none does."""
    x, q, v, L = y
    bounce_speed = work.rest_share * work.acceleration * h
    if work.restitution > 0.0:
        bounce_speed /= work.restitution
    if not aim_impact(n, bounce_speed, work.slop / h, 1.0 / h, work):
        return y
    place_arms(n, qt.to_matrix(q), tilted, work)
    aim_tangential(n, bounce_speed, y, tilted, work)
    for k in range(3 * n):
        work.impulse[k] = 0.0
    R = qt.to_matrix(principal_attitude(q, work, tilted))
    work.mode = SLIDE
    solved = solve_contacts(n, friction, smooth, pivots, v, L, R, work)
    solved = without_gain(n, friction, smooth, pivots, v, L, solved, R, work)
    v, L, residual, sweeps, method = resist_turning(n, friction, smooth, pivots, v, L, solved, R, work)
    note_solve(report, work.world, residual, sweeps, method, work.tolerance)
    return x, q, v, L


@kernel
def touch(n, y, h, friction, smooth, gyroscopic, tilted, pivots, memory, report, work):
    """State after Moreau's midpoint step over h with the n contacts of the set."""
    x, q, v, L = y
    a, torque = work.free_acceleration, work.torque
    half = 0.5 * h
    w = angular_velocity(q, L, work, tilted)
    x = (x[0] + half * v[0], x[1] + half * v[1], x[2] + half * v[2])
    q = drift(q, L, work, half, gyroscopic, tilted)
    place_arms(n, qt.to_matrix(q), tilted, work)
    aim_rest(n, w, h, work)
    width = 3
    if friction is None:
        width = 1
    load_warm_start(n, width, memory, work.i, h, work)
    v = (v[0] + h * a[0], v[1] + h * a[1], v[2] + h * a[2])
    L = (L[0] + h * torque[0], L[1] + h * torque[1], L[2] + h * torque[2])
    R = qt.to_matrix(principal_attitude(q, work, tilted))
    work.mode = int(memory[work.i, MODE])
    solved = solve_contacts(n, friction, smooth, pivots, v, L, R, work)
    v, L, residual, sweeps, method = resist_turning(n, friction, smooth, pivots, v, L, solved, R, work)
    memory[work.i, MODE] = work.mode
    note_solve(report, work.world, residual, sweeps, method, work.tolerance)
    store_warm_start(n, width, memory, work.i, h, work)
    x = (x[0] + half * v[0], x[1] + half * v[1], x[2] + half * v[2])
    q = drift(q, L, work, half, gyroscopic, tilted)
    return x, q, v, L
