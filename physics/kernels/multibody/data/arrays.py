"""Scratch memory of one thread for worlds whose bodies touch each other.

`BodiesWorkspace` is a named tuple of groups of arrays, one group for each part of a step. Kernels call it `many`. Its
type does not depend on the number of bodies, walls or contacts, so that one compiled kernel serves all of them. The
arrays are filled anew for every world and every stage; no value in them outlives a step.

Shapes are given in these numbers:

========  ==============================================================
bodies    bodies of the world
parts     bodies of the world, and behind them the parts of its compounds
walls     walls of the world
pairs     `pair_capacity`: pairs of bodies that there is room for
contacts  `contact_capacity`: contacts that there is room for
blocks    `block_capacity`: off-diagonal blocks that there is room for
batches   `batch_capacity`: batches of contacts that there is room for
slots     a power of two, at least twice the contacts
========  ==============================================================

Arrays are of float64; `int` in a shape means int64. Contacts and bodies are referred to by their indices. Where a body
is expected, -1 - k stands for wall k, and -1 - walls - b for the fixed body b (`fixed_bodies`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from physics.kernels.multibody.data.hull_tables import Hulls
from physics.kernels.multibody.data.parts import Parts

# First columns of two groups of six in `many.bodies.momenta` during a resting stage: twist before the loads act;
# velocity and angular momentum after the loads have acted.
PRE_LOAD_VELOCITY, LOADED_MOMENTA = 0, 6

# Column of `many.bodies.momenta` during a position correction: energy that the turn of a body has added.
TURN_GAIN = 0

# Contacts that two bodies may have at once: a rectangle clipped by another one has up to eight vertices.
PAIR_CONTACTS = 8

# Contacts of a cylinder: with a wall, two rings with their lowest points; besides the outline of a face, a ring, its
# lowest point and two ends of a line; with another cylinder two of these rings and two crossings of rims.
CYLINDER_WALL_CONTACTS, CYLINDER_FACE_CONTACTS, CYLINDER_PAIR_CONTACTS = 18, 12, 24

# Room for feature numbers of one pair (two bodies, or a body and a wall) in the id of a contact. Pairs with a hull may
# have more features.
FEATURES_PER_PAIR = 512

# Room for near pairs, per body: at most twelve equal spheres touch one, and each pair belongs to two bodies.
PAIRS_PER_BODY = 8

# Room for entries in the grid columns of the broad phase, per body.
ENTRIES_PER_BODY = 4

# Room for off-diagonal blocks of the linear system of `block_lu`, per body. An island that needs more is solved without
# Newton's method.
BLOCKS_PER_BODY = 32

# Room for batches of contacts (`contact_batches`), per body. An island that needs more is solved without Newton's
# method.
BATCHES_PER_BODY = 32

# Earlier torques that Anderson's method combines in `solver.resistance_torques`.
TORQUE_HISTORY = 10

# Entries of `counts`: contacts; near pairs; contacts or pairs without room; batches of the island that is solved;
# contacts of two bodies that would stop them (`contact_set.is_stopping`).
NUM_CONTACTS, NUM_PAIRS, NUM_DROPPED, NUM_BATCHES, NUM_STOPPING = range(5)

# Sizes in `block_lu`: a column holds velocity and angular velocity, an unused number after each; a block has six
# columns.
COLUMN_SIZE = 8
BLOCK_SIZE = 6 * COLUMN_SIZE

# Numbers in a row of `normal_rows` (five vectors, an unused number after each) and of `visit_rows` (five cache lines).
NORMAL_ROW_SIZE = 5 * 4
VISIT_SIZE = 5 * 8

# Numbers in a row of `batch`, and in a row of `lanes`: four, one per contact, for each field of `contact_batches`.
BATCH_SIZE = 6
LANES_SIZE = 4 * 52

# Row of `memory`, one per world: length of the last resting stage [s], its contact count, then `WARM_CONTACT_SIZE`
# numbers for each contact: its id, first and second body (-1 - k: wall k), impulse [N s] and point [m], world frame.
# Under error control the last column is the length of the next part of a substep, as a share of the substep
# (`adaptive_substep`; 0: the whole substep).
WARM_STAGE_LENGTH, WARM_CONTACT_COUNT = range(2)
WARM_HEADER_SIZE = 2
WARM_CONTACT_ID, WARM_BODY_A, WARM_BODY_B, WARM_IMPULSE, WARM_POINT = 0, 1, 2, 3, 6
WARM_CONTACT_SIZE = 9

# Numbers of a torque, which is behind all contacts of a row of `memory` (`warm_torques`).
TORQUE_SIZE = 3


# Numbers in a row of `WorldSnapshots.rates`: acceleration [m/s²], rate of the angular momentum [N m].
RATE_SIZE = 6


class WorldSnapshots(NamedTuple):
    """Saved states of a world to which `adaptive_substep` returns; the first axis is the moment of the copy."""

    state: np.ndarray  # (moments, bodies, STATE_SIZE) states of the bodies
    memory: np.ndarray  # (moments, columns) the world's row of `memory`
    report: np.ndarray  # (moments, REPORT_SIZE) the world's row of the report
    counts: np.ndarray  # (moments, bodies) int, number of events of each body
    rates: np.ndarray | None  # (3, RATE_SIZE) of `stepping.sudden_change`; None unless exactly one body moves


class Bodies(NamedTuple):
    """Bodies of the world: parameters, poses and motion, a row for each body."""

    body: np.ndarray  # (parts,) records: parameters and loads, see `time_stepping.workspace.body_fields`
    state: np.ndarray  # (bodies, STATE_SIZE) states, columns of `state.layout`
    rotation: np.ndarray  # (parts, 9) rotation matrix from body frame to world frame, row by row
    inv_mass: np.ndarray  # (bodies,) 1/mass [1/kg]
    inv_inertia: np.ndarray  # (bodies, 6) inverse inertia, world frame: 00, 01, 02, 11, 12, 22 [1/(kg m²)]
    twist: np.ndarray  # (bodies, 6) velocity and angular velocity, world frame [m/s, rad/s]
    free_twist: np.ndarray  # (bodies, 6) twist without contact impulses [m/s, rad/s]
    momenta: np.ndarray  # (bodies, 12) in a resting stage: `PRE_LOAD_VELOCITY`, `LOADED_MOMENTA`; in
    # `stepping.restitution_energy`: velocity and angular momentum before an impact, then after its full rebound; in
    # `stepping.position_correction`: `TURN_GAIN`
    center: np.ndarray  # (parts, 3) geometric centre, world frame [m]
    box: np.ndarray  # (bodies, 6) lower, then upper corner of the swept box, world frame [m]
    touched: np.ndarray  # (bodies,) int, 1: the body is in a contact of this stage
    spin_bound: np.ndarray  # (bodies,) bound of |ω| if the body may turn far in this stage, else 0 [rad/s]
    lift_work: np.ndarray  # (bodies,) work that `position_correction` does against the loads [J]
    fixed: np.ndarray | None  # (bodies,) int, 1: the body is fixed; None in a world without fixed bodies
    groups: np.ndarray | None  # (bodies + walls, 2) int, group and mask of each; None in a world where all may touch
    capsules: bool | None  # None in a world without capsules
    cylinders: bool | None  # None in a world without cylinders
    parts: Parts | None  # None in a world without compounds


class BroadPhase(NamedTuple):
    """Arrays of the broad phase: sweep and prune along one world axis, grid columns across it."""

    pairs: np.ndarray  # (pairs, 2) int, bodies whose boxes overlap
    sorted_pairs: np.ndarray  # (pairs, 2) int, scratch: pairs sorted by their second body
    order: np.ndarray  # (bodies,) int, bodies sorted by the lower end of their boxes
    merged: np.ndarray  # (bodies,) int, scratch of the merge sort
    first_entry: np.ndarray  # (bodies + 1,) int, position in `entry` at which each grid column begins
    cursor: np.ndarray  # (bodies,) int, position in `entry` at which the search of a grid column continues
    entry: np.ndarray  # (ENTRIES_PER_BODY * bodies,) int, bodies, grid column by grid column


class NarrowPhase(NamedTuple):
    """Scratch of the narrow phase, filled anew for each pair of bodies."""

    simplex: np.ndarray  # (4, 3) of `gjk`: corners of the simplex, world axes [m]
    relative_axes: np.ndarray  # (4, 3, 3) of two blocks: axes of one in the frame of the other (`box_sat`)
    polygon: np.ndarray  # (2, 16, 3) of two blocks: clipped face in two copies, vertices (x, y, height) [m]
    edge: np.ndarray  # (2, 16, 2) int, edges into and out of each vertex of `polygon`
    hulls: Hulls | None  # tables of convex polyhedra, and scratch for a pair; None in a world without hulls


class ContactSet(NamedTuple):
    """Contact set of a stage, a row for each contact."""

    bodies: np.ndarray  # (contacts, 2) int, first and second body; -1 - k: wall k; below: `fixed_bodies`
    id: np.ndarray  # (contacts,) int, contact name: the same while the same features touch
    owner: np.ndarray  # (contacts,) int, part that the normal turns with; -1: none; see `contact_set.PARTED`
    normal: np.ndarray  # (contacts, 3) unit vector out of the second body, in the owner's frame (no owner: world)
    anchor: np.ndarray  # (contacts, 6) contact arms of both bodies, each in its body frame [m]
    frame: np.ndarray  # (contacts, 9) rows normal, tangent 1, tangent 2, world frame
    arm: np.ndarray  # (contacts, 6) contact arms of both bodies, from their centres of mass, world frame [m]
    gap: np.ndarray  # (contacts,) distance along the normal [m], negative when penetrating
    speed: np.ndarray  # (contacts,) normal velocity before the stage [m/s], negative when approaching
    mu: np.ndarray  # (contacts,) Coulomb coefficient of friction
    restitution: np.ndarray  # (contacts,) coefficient of restitution
    target: np.ndarray  # (contacts, 3) relative velocity that the solver aims at: normal, tangents [m/s]
    impulse: np.ndarray  # (contacts, 3) impulse on the first body in the contact frame: normal, tangents [N s]
    block: np.ndarray  # (contacts, 9) the contact's own 3 x 3 block of W = J M⁻¹ Jᵀ [1/kg]
    step: np.ndarray  # (contacts,) 1/λ_max of the tangential part of `block` [kg]
    best_impulse: np.ndarray  # (contacts, 3) best impulses that any method has found for the island [N s]
    rebound_impulse: np.ndarray  # (contacts, 3) of `stepping.restitution_energy`: of the full rebound [N s]
    id_table: np.ndarray  # (slots,) int, of `warm_start`: hash table from id to contact of the last stage; -1: free


class Sweeps(NamedTuple):
    """Scratch of Gauss-Seidel sweeps over the contacts of an island; a visit is the solution of one contact."""

    motion: np.ndarray  # (bodies, COLUMN_SIZE) twists during the sweeps, columns of `block_lu` [m/s, rad/s]
    normal_rows: np.ndarray  # (contacts, NORMAL_ROW_SIZE) of `normal_rows`: rows of J and of M⁻¹ Jᵀ for the normal
    visit_rows: np.ndarray  # (contacts, VISIT_SIZE) of `contact_rows`: contact rows in visiting order
    visit_bodies: np.ndarray  # (contacts, 2) int, `ContactSet.bodies` in visiting order
    impulse_4_sweeps_ago: np.ndarray  # (contacts, 3) impulses in visiting order, for the extrapolation [N s]
    impulse_2_sweeps_ago: np.ndarray  # (contacts, 3) the same, two sweeps later [N s]
    visited: np.ndarray  # (contacts,) int, running number of the last visit of each contact
    pushed: np.ndarray  # (bodies,) int, running number of the last visit that changed the body's motion


class Islands(NamedTuple):
    """Islands: groups of bodies connected by contacts, each with a contact problem of its own."""

    parent: np.ndarray  # (bodies,) int, union-find forest: another body of the same island, or the body itself
    of_body: np.ndarray  # (bodies,) int, island of each body; -1: no contact
    contacts: np.ndarray  # (contacts,) int, indices of contacts, island by island
    first_contact: np.ndarray  # (contacts + 1,) int, position in `contacts` at which each island begins
    bodies: np.ndarray  # (bodies,) int, bodies, island by island; later in the order of elimination
    first_body: np.ndarray  # (contacts + 1,) int, position in `bodies` at which each island begins
    group_motion: np.ndarray  # (bodies, 3) of `sleeping`, at the root of a group: largest displacements of its
    # bodies in the last window and in the one before [bounding radii]; 1: a body of the group is not quiet


class LinearSystem(NamedTuple):
    """Sparse linear system of an island: a 6 x 6 block for each body, and for each touching pair."""

    diagonal: np.ndarray  # (bodies, BLOCK_SIZE) of `block_lu`: diagonal block of each body, then its inverse
    lower: np.ndarray  # (blocks, BLOCK_SIZE) blocks below the diagonal, column by column
    upper: np.ndarray  # (blocks, BLOCK_SIZE) blocks right of the diagonal, row by row
    swaps: np.ndarray  # (6,) int, row exchanges while a block is inverted
    rank: np.ndarray  # (bodies,) int, position of a body in the elimination
    start: np.ndarray  # (bodies,) int, neighbours of b eliminated after it: `column[start[b] : stop[b]]`
    stop: np.ndarray  # (bodies,) int, see `start`
    column: np.ndarray  # (blocks,) int, bodies, see `start`
    neighbour: np.ndarray  # (2 * blocks, 2) int, of `minimum_degree`: linked lists (body, next entry)
    links: np.ndarray  # (1,) int, number of entries in `neighbour`
    head: np.ndarray  # (bodies,) int, first entry of a body's list of neighbours
    degree: np.ndarray  # (bodies,) int, number of neighbours of a body
    mark: np.ndarray  # (bodies,) int, stamp written to the neighbours of one body
    bucket: np.ndarray  # (bodies,) int, first body of each degree, start of a doubly linked list
    ahead: np.ndarray  # (bodies,) int, body before this one in its bucket
    behind: np.ndarray  # (bodies,) int, body after this one in its bucket


class Newton(NamedTuple):
    """Scratch of `solver.proximal_newton` and `solver.interior_point`."""

    defect: np.ndarray  # (bodies, COLUMN_SIZE) residual x - M⁻¹ Jᵀ p(x) of the twists x, columns of `block_lu`
    before: np.ndarray  # (bodies, 6) twists before a Newton step [m/s, rad/s]
    change: np.ndarray  # (bodies, COLUMN_SIZE) Newton step of the twists, columns of `block_lu` [m/s, rad/s]
    batch: np.ndarray  # (batches, BATCH_SIZE) int, columns `BATCH_BODY_A` ... of `contact_batches`
    lanes: np.ndarray  # (batches, LANES_SIZE) data of the contacts, four contacts side by side


class PairMaterials(NamedTuple):
    """Rules and exceptions for the coefficients of two bodies in contact. A pair a < b has the key a * bodies + b."""

    rules: np.ndarray  # (2,) int, indices in `contact_law.materials.RULES` for friction and restitution
    friction_pairs: np.ndarray  # (n,) int, keys of the pairs with a friction of their own, sorted
    friction: np.ndarray  # (n,) Coulomb coefficients of these pairs
    restitution_pairs: np.ndarray  # (m,) int, keys of the pairs with a restitution of their own, sorted
    restitution: np.ndarray  # (m,) coefficients of restitution of these pairs


class StageStart(NamedTuple):
    """Copies of a stage's start, from which `stepping.slip_end` makes it again."""

    state: np.ndarray  # (bodies, STATE_SIZE) states of the bodies
    target: np.ndarray  # (contacts, 3) targets of the contacts [m/s]
    slip: np.ndarray  # (contacts, 3) slip of the first end on the second one, world frame [m/s]


class DrivenBodies(NamedTuple):
    """Prescribed motions of fixed bodies, and their part in contacts; see `driven_bodies`."""

    columns: np.ndarray  # (bodies, ...) motion of each body, columns of `flight.prescribed_motion`
    clock: np.ndarray  # (2,) time of the world at the start of the call, and now [s]
    velocity: np.ndarray  # (contacts, 3) velocity of the second end, world frame; 0 unless it is driven [m/s]
    target: np.ndarray  # (contacts, 3) during a solve: targets relative to the driven ends [m/s]
    gain: np.ndarray  # (contacts,) what its normal component gains from the middle of a stage to the end [m/s]
    work: np.ndarray  # (1,) work on the other bodies in the present stage, impacts left out [J]


class LoneBody(NamedTuple):
    """Numbers of the only moving body of a world with fixed bodies."""

    follow: np.ndarray  # (contacts, 3) velocity of the contact point along its edge (`clipped_points`) [m/s]
    later: np.ndarray  # (1, 6) twist that is foretold for the end of a stage (`stepping.lone_stage`) [m/s, rad/s]
    substep: np.ndarray  # (1,) length of the substep under error control, else 0 [s]
    impacts: np.ndarray  # (1,) int, impacts in the present part
    slow: np.ndarray  # (1,) int, 1: the body is slow in the present stage (`data.lone_body`)
    suspect: np.ndarray  # (1,) int, place in the substep up to which a sudden change may be (`stepping.lone_part`)


class ForetoldTwists(NamedTuple):
    """Numbers of several moving bodies under error control, see `stepping.foretold_twists`."""

    twist: np.ndarray  # (bodies, 6) twists foretold for the end of a stage [m/s, rad/s]
    push: np.ndarray  # (bodies, 3) impulse of the warm start on each body [N s]
    turn: np.ndarray  # (bodies, 3) its moment [kg m²/s]
    before: np.ndarray  # (bodies, 3) impulse on each body in the stage before [N s]
    substep: np.ndarray  # (1,) length of the substep [s]


class Resistance(NamedTuple):
    """Scratch of `solver.resistance_torques`: torques at the contacts of round bodies."""

    torque: np.ndarray  # (contacts, 3) angular impulse on the first body, world frame [kg m²/s]
    error: np.ndarray  # (contacts, 3) error of the torque, G(T) - T
    answer: np.ndarray  # (contacts,) 1/ρ [1/(kg m²)]; 0: no torque at this contact
    push: np.ndarray  # (contacts,) normal impulse that limits the torque [N s]
    count: np.ndarray  # (bodies,) int, contacts of each body with a torque
    loaded: np.ndarray  # (bodies, 6) twists without impulses and torques [m/s, rad/s]
    torque_change: np.ndarray  # (history + 1, contacts, 3) changes between solves; the last row: the latest torques
    error_change: np.ndarray  # (history + 1, contacts, 3) the same of errors
    equations: np.ndarray  # (history, history + 1) normal equations, right sides in the last column
    share: np.ndarray  # (history,) their solution
    order: np.ndarray  # (history,) int, scratch


class Grain(NamedTuple):
    """Axes of friction with two coefficients, see `grain`."""

    axis: np.ndarray  # (3,) unit vector or 0, of two bodies without an axis of their own, world frame
    body_axis: np.ndarray  # (bodies, 3) unit vectors, or 0 for bodies without an axis, body frames


class Compliance(NamedTuple):
    """Numbers of compliant contacts in a stage, see `stepping.compliant_stage`."""

    give: np.ndarray  # (contacts,) compliance γ on the diagonal of W, in the normal row; 0 outside a solve [1/kg]
    unpaid: np.ndarray  # (contacts,) depth at the start of the stage that no force has caused; it does not push [m]
    start_gap: np.ndarray  # (contacts,) gap at the start of the stage, unpaid depth left out, as below [m]
    coast_gap: np.ndarray  # (contacts,) gap at its end, without the velocities after the impulses [m]
    start_speed: np.ndarray  # (contacts,) rate of the gap at the start of the stage [m/s]
    end_gap: np.ndarray  # (contacts,) gap at its end, as the contact problem foretells it [m]
    plain: np.ndarray  # (contacts, 2) normal target [m/s] and `coast_gap` [m] of bodies that do not turn
    mobility: np.ndarray  # (bodies,) sum of W_nn over the contacts of each body [1/kg]
    paid: np.ndarray  # (bodies,) sum of the squares of the depths of each body's contacts that forces have caused [m²]
    found: np.ndarray  # (bodies,) the same of the depths at the start of the stage [m²]
    last_drift: np.ndarray  # (1,) length of the last drift of the stage [s]
    switch: np.ndarray  # (1,) error of the present part by pushes that begin or end, `stepping.spring_switches`


class BodiesWorkspace(NamedTuple):
    """Scratch memory of one thread for the world that it advances: bodies, pairs, contacts and solver."""

    bodies: Bodies
    broadphase: BroadPhase
    narrowphase: NarrowPhase
    contacts: ContactSet
    sweeps: Sweeps
    islands: Islands
    system: LinearSystem
    newton: Newton
    walls: np.ndarray  # (walls, WALL_SIZE) columns of `state.layout`
    materials: PairMaterials | None  # None: the default rules, and no exceptions
    driven: DrivenBodies | None  # None: the scene declares no motion
    stage_start: StageStart | None  # None: stages do not end where slips end
    lone: LoneBody | None  # None unless exactly one body moves, among fixed ones
    foretold: ForetoldTwists | None  # None without error control, or if a lone body moves, or contact is compliant
    even: np.ndarray | None  # (0,) a switch: loads are shared evenly (`solver.even_loads`); None without error control
    resistance: Resistance | None  # None: the scene declares neither rolling nor spin friction
    grain: Grain | None  # None: the scene has no friction with two coefficients
    compliance: Compliance | None  # None: contact is rigid
    counts: np.ndarray  # (5,) int, counters: columns `NUM_CONTACTS` to `NUM_STOPPING` above
    settings: np.ndarray  # (1,) record with the fields of `allocation.bodies_setting_fields`
