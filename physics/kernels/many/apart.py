"""What overlaps is pushed apart: positions only, no velocity changes.

The displacements of the bodies solve the frictionless contact problem whose targets are depths instead of velocities:
the least displacement, in the metric of mass, that brings every contact of the set back to half a slop. A quarter of
overlap therefore comes apart without speed.
"""

from __future__ import annotations

from physics.kernels import quaternion as qt
from physics.kernels.body import read_state, write_state
from physics.kernels.compiler import inlined, kernel
from physics.kernels.many.contacts import pair_slop, plus, put, refresh, vector
from physics.kernels.many.place import place_body
from physics.kernels.many.sweeps import assemble, residual_of, sweep_contacts

# Share of the depth beyond half a slop that one stage takes back: turning makes the whole of it overshoot.
APART_SHARE = 0.5

# Error of the displacements, relative to the largest depth, and sweeps for it at most.
APART_ERROR = 1.0e-3
APART_SWEEPS = 50


@inlined
def _aim_apart(n, many):
    """Displacements asked for along the normals [m]; whether there is any: something deeper than its slop."""
    is_deep = False
    for k in range(n):
        slop, gap = pair_slop(many.ends[k, 0], many.ends[k, 1], many), many.gap[k]
        goal = -max(gap, 0.0)
        if gap < -slop:
            goal, is_deep = -APART_SHARE * (gap + 0.5 * slop), True
        put(many.target, k, 0, (goal, 0.0, 0.0))
        put(many.impulse, k, 0, (0.0, 0.0, 0.0))
    return is_deep


@inlined
def _displace(b, many):
    """Move and turn body b by what `many.twist` says."""
    x, q, v, L = read_state(many.now, b)
    turn = qt.exponential(vector(many.twist, b, 3))
    x = plus(x, 1.0, vector(many.twist, b, 0))
    write_state(many.now, b, (x, qt.normalise(qt.multiply(turn, q)), v, L))


@kernel
def push_apart(n, tilted, many):
    """Move the bodies of the n contacts apart where they overlap by more than the slop."""
    for b in range(many.now.shape[0]):
        if many.touched[b] == 1:
            place_body(b, tilted, many)
    refresh(many)
    if not _aim_apart(n, many):
        return
    for b in range(many.now.shape[0]):
        put(many.twist, b, 0, (0.0, 0.0, 0.0))
        put(many.twist, b, 3, (0.0, 0.0, 0.0))
    goal = APART_ERROR * assemble(n, many)
    sweep_contacts(0, n, None, residual_of(0, n, None, many), goal, APART_SWEEPS, many)
    for b in range(many.now.shape[0]):
        if many.touched[b] == 1:
            _displace(b, many)
