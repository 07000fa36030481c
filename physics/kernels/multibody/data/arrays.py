"""Scratch memory of one thread for worlds whose bodies touch each other.

`BodiesWorkspace` is a named tuple of groups of arrays, one for each part of a step. Its type does not depend on the
number of bodies, walls or contacts: one compiled kernel serves them all. It is filled anew for every world and every
stage; nothing in it outlives a step.

Shapes are given in these numbers:

========  ==============================================================
bodies    bodies of the world
walls     walls of the world
pairs     `pair_capacity`: pairs of bodies that there is room for
contacts  `contact_capacity`: contacts that there is room for
blocks    `block_capacity`: off-diagonal blocks that there is room for
batches   `batch_capacity`: batches of contacts that there is room for
slots     a power of two, at least twice the contacts
========  ==============================================================

Arrays are of float64; `int` in a shape says int64. Contacts and bodies are referred to by their indices, a wall k among
bodies by -1 - k.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from physics.kernels.multibody.data.hull_tables import Hulls

# Columns of `many.bodies.momenta` in a resting stage: velocities before it, then momenta with its loads.
PRE_LOAD_VELOCITY, LOADED_MOMENTA = 0, 6

# Contacts that two bodies may have at once: a rectangle clipped by another one has up to eight vertices.
PAIR_CONTACTS = 8

# Pairs near each other at once, per body: twelve spheres touch one of their size, and each pair counts for two.
PAIRS_PER_BODY = 8

# Entries of all columns of the broad phase, per body.
ENTRIES_PER_BODY = 4

# Blocks of the linear system of `block_lu` per body: where more are needed Newton's method is left out.
BLOCKS_PER_BODY = 32

# Batches of contacts of one island (`contact_batches`) per body: where more are needed Newton's method is left out,
# too.
BATCHES_PER_BODY = 32

# Entries of `counts`: contacts, pairs, contacts or pairs without room, and batches of the island that is solved.
NUM_CONTACTS, NUM_PAIRS, NUM_DROPPED, NUM_BATCHES, NUM_STOPPING = range(5)

# Of `block_lu`: numbers of a column, velocity and angular velocity with one unused after each, and of a block of six.
COLUMN_SIZE = 8
BLOCK_SIZE = 6 * COLUMN_SIZE

# Numbers of a row of `normal_rows`: five vectors, one unused number after each; and of a row of `visit_rows`, five
# cache lines.
NORMAL_ROW_SIZE = 5 * 4
VISIT_SIZE = 5 * 8

# Numbers of a row of `batch`, and of `lanes`: four for each of the fields in `contact_batches`.
BATCH_SIZE = 6
LANES_SIZE = 4 * 52

# Row of `memory`, one per world: length of the last resting stage [s], its contact count, then `WARM_CONTACT_SIZE`
# numbers for each contact: its id, first and second body (-1 - k: wall k), impulse and point in the world frame.
# Where substeps are refined the last column of all is the next part of one as a share of it (`adaptive_substep`; 0: all
# of it).
WARM_STAGE_LENGTH, WARM_CONTACT_COUNT = range(2)
WARM_HEADER_SIZE = 2
WARM_CONTACT_ID, WARM_BODY_A, WARM_BODY_B, WARM_IMPULSE, WARM_POINT = 0, 1, 2, 3, 6
WARM_CONTACT_SIZE = 9


class WorldSnapshots(NamedTuple):
    """States of a world to which `adaptive_substep` returns, one row for each."""

    state: np.ndarray  # (moments, bodies, STATE_SIZE) states of the bodies
    memory: np.ndarray  # (moments, columns) row of `memory`
    report: np.ndarray  # (moments, REPORT_SIZE) row of the report
    counts: np.ndarray  # (moments, bodies) int, events of each body


class Bodies(NamedTuple):
    """Bodies of the world: parameters, poses and motion."""

    body: np.ndarray  # (bodies,) records: parameters and loads, see `time_stepping.workspace.body_fields`
    state: np.ndarray  # (bodies, STATE_SIZE) columns of `layout`
    rotation: np.ndarray  # (bodies, 9) body frame to world, row by row
    inv_mass: np.ndarray  # (bodies,) 1/mass [1/kg]
    inv_inertia: np.ndarray  # (bodies, 6) inverse inertia, world frame: 00, 01, 02, 11, 12, 22 [1/(kg m²)]
    twist: np.ndarray  # (bodies, 6) velocity and angular velocity, world frame [m/s, rad/s]
    free_twist: np.ndarray  # (bodies, 6) twist without contact impulses [m/s, rad/s]
    momenta: np.ndarray  # (bodies, 12) in a resting stage: `PRE_LOAD_VELOCITY`, `LOADED_MOMENTA`; in
    # `stepping.restitution_energy`: velocity and angular momentum before an impact, then with all of its rebound
    center: np.ndarray  # (bodies, 3) geometric centre, world frame [m]
    box: np.ndarray  # (bodies, 6) lower, then upper corner of the bounding box, motion of the stage included [m]
    touched: np.ndarray  # (bodies,) int, 1: the body is in a contact of this stage
    spin_bound: np.ndarray  # (bodies,) bound of |ω| of a body that may turn far in this stage, else 0 [rad/s]
    lift_work: np.ndarray  # (bodies,) work that `position_correction` does against the loads [J]


class BroadPhase(NamedTuple):
    """Sweep and prune along one axis, and the columns that cut the other two."""

    pairs: np.ndarray  # (pairs, 2) int, bodies whose boxes overlap
    sorted_pairs: np.ndarray  # (pairs, 2) int, scratch: pairs by their second body
    order: np.ndarray  # (bodies,) int, bodies by the lower end of their boxes
    merged: np.ndarray  # (bodies,) int, scratch of the merge sort
    first_entry: np.ndarray  # (bodies + 1,) int, first position of a column in `entry`
    cursor: np.ndarray  # (bodies,) int, position in `entry` at which a column continues
    entry: np.ndarray  # (ENTRIES_PER_BODY * bodies,) int, bodies, column by column


class NarrowPhase(NamedTuple):
    """Scratch for one pair of bodies."""

    simplex: np.ndarray  # (4, 3) of `gjk`: differences of points of the two bodies [m]
    relative_axes: np.ndarray  # (4, 3, 3) of two blocks: rows of `box_sat`, axes of one block in the other
    polygon: np.ndarray  # (2, 16, 3) of two blocks: clipped face in two copies, vertices (x, y, height) [m]
    edge: np.ndarray  # (2, 16, 2) int, edges into and out of each vertex of `polygon`
    hulls: Hulls | None  # tables of convex polyhedra, and scratch for a pair; None in a world without hulls


class ContactSet(NamedTuple):
    """Contact set of a stage, a row for each contact."""

    bodies: np.ndarray  # (contacts, 2) int, first and second body; -1 - k: wall k
    id: np.ndarray  # (contacts,) int, the same while the same features touch
    owner: np.ndarray  # (contacts,) int, body that the normal turns with, -1: none, -2: `PARTED`
    normal: np.ndarray  # (contacts, 3) unit vector out of the second body, in the frame of the owner
    anchor: np.ndarray  # (contacts, 6) points of both bodies from their centres of mass, in their frames [m]
    frame: np.ndarray  # (contacts, 9) rows normal, tangent 1, tangent 2, world frame
    arm: np.ndarray  # (contacts, 6) points of both bodies from their centres of mass, world frame [m]
    gap: np.ndarray  # (contacts,) distance along the normal [m], negative when penetrating
    speed: np.ndarray  # (contacts,) normal velocity before the stage [m/s], negative when approaching
    mu: np.ndarray  # (contacts,) Coulomb coefficient of friction
    restitution: np.ndarray  # (contacts,) coefficient of restitution
    target: np.ndarray  # (contacts, 3) relative velocity that the solver aims at: normal, tangents [m/s]
    impulse: np.ndarray  # (contacts, 3) normal, tangents [N s]
    block: np.ndarray  # (contacts, 9) the contact's own 3 x 3 block of W = J M⁻¹ Jᵀ [1/kg]
    step: np.ndarray  # (contacts,) 1/λ_max of the tangential part of `block` [kg]
    best_impulse: np.ndarray  # (contacts, 3) best impulses of all methods for an island [N s]
    rebound_impulse: np.ndarray  # (contacts, 3) of `stepping.restitution_energy`: with all of the rebound [N s]
    id_table: np.ndarray  # (slots,) int, of `warm_start`: contacts of the last stage by id, open addressing; -1: free


class Sweeps(NamedTuple):
    """Gauss-Seidel sweeps over the contacts of an island."""

    motion: np.ndarray  # (bodies, COLUMN_SIZE) twists during the sweeps, columns of `block_lu` [m/s, rad/s]
    normal_rows: np.ndarray  # (contacts, NORMAL_ROW_SIZE) of `normal_rows`: row of the Jacobian, and M⁻¹ times it
    visit_rows: np.ndarray  # (contacts, VISIT_SIZE) of `contact_rows`: data of the contacts, in visiting order
    visit_bodies: np.ndarray  # (contacts, 2) int, `ContactSet.bodies` in visiting order
    impulse_4_sweeps_ago: np.ndarray  # (contacts, 3) impulses of the visits, for the extrapolation [N s]
    impulse_2_sweeps_ago: np.ndarray  # (contacts, 3) the same, two sweeps later [N s]
    visited: np.ndarray  # (contacts,) int, number of the last visit of a contact
    pushed: np.ndarray  # (bodies,) int, number of the last visit that changed a body's motion


class Islands(NamedTuple):
    """Groups of bodies connected by contacts."""

    parent: np.ndarray  # (bodies,) int, union-find forest: a body of the same island
    of_body: np.ndarray  # (bodies,) int, island of a body, -1: none
    contacts: np.ndarray  # (contacts,) int, contacts, island by island
    first_contact: np.ndarray  # (contacts + 1,) int, first position of an island in `contacts`
    bodies: np.ndarray  # (bodies,) int, bodies, island by island; then in the order of elimination
    first_body: np.ndarray  # (contacts + 1,) int, first position of an island in `bodies`
    group_motion: np.ndarray  # (bodies, 3) of `sleeping`, at the root of a group: largest displacements in the last two
    # windows, in the threshold; 1: a body of the group is not quiet


class LinearSystem(NamedTuple):
    """Sparse system of an island: a 6 x 6 block for each body, and for each touching pair."""

    diagonal: np.ndarray  # (bodies, BLOCK_SIZE) of `block_lu`: block of a body, then its inverse
    lower: np.ndarray  # (blocks, BLOCK_SIZE) blocks below the diagonal, column by column
    upper: np.ndarray  # (blocks, BLOCK_SIZE) blocks right of the diagonal, row by row
    swaps: np.ndarray  # (6,) int, row exchanges of the block that is inverted
    rank: np.ndarray  # (bodies,) int, position of a body in the elimination
    start: np.ndarray  # (bodies,) int, later neighbours of body b: `column[start[b] : stop[b]]`
    stop: np.ndarray  # (bodies,) int
    column: np.ndarray  # (blocks,) int
    neighbour: np.ndarray  # (2 * blocks, 2) int, of `minimum_degree`: linked lists (body, next entry)
    links: np.ndarray  # (1,) int, number of entries in `neighbour`
    head: np.ndarray  # (bodies,) int, first entry of a body's list of neighbours
    degree: np.ndarray  # (bodies,) int, number of neighbours of a body
    mark: np.ndarray  # (bodies,) int, stamp of the bodies that are neighbours
    bucket: np.ndarray  # (bodies,) int, first body of each degree; doubly linked by the next two
    ahead: np.ndarray  # (bodies,) int
    behind: np.ndarray  # (bodies,) int


class Newton(NamedTuple):
    """Iterates of `solver.proximal_newton` and `solver.interior_point`."""

    defect: np.ndarray  # (bodies, COLUMN_SIZE) x - M⁻¹ Jᵀ p(x), columns of `block_lu` [m/s, rad/s]
    before: np.ndarray  # (bodies, 6) twists before a step [m/s, rad/s]
    change: np.ndarray  # (bodies, COLUMN_SIZE) the step, columns of `block_lu` [m/s, rad/s]
    batch: np.ndarray  # (batches, BATCH_SIZE) int, of `contact_batches`: bodies, index of their block, contacts
    lanes: np.ndarray  # (batches, LANES_SIZE) data of the contacts, four of them side by side


class BodiesWorkspace(NamedTuple):
    """Bodies, pairs and contacts of the world that a thread works on."""

    bodies: Bodies
    broadphase: BroadPhase
    narrowphase: NarrowPhase
    contacts: ContactSet
    sweeps: Sweeps
    islands: Islands
    system: LinearSystem
    newton: Newton
    walls: np.ndarray  # (walls, WALL_SIZE) columns of `layout`
    counts: np.ndarray  # (5,) int: `NUM_CONTACTS` and those that follow it above
    settings: np.ndarray  # (1,) record: `bodies_setting_fields`
