"""Scratch memory of one thread for worlds whose bodies touch each other.

A named tuple of arrays: its type does not depend on how many bodies, walls or contacts there are, so that one
compiled kernel serves them all. It is filled anew for every world and every stage; nothing in it outlives a step.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from physics.kernels.forces.force_field_dispatch import Term
from physics.kernels.multibody.data.hull_tables import Hulls, clipped_face_capacity, make_hulls
from physics.kernels.state.layout import REPORT_SIZE, STATE_SIZE, VERTEX_COUNT
from physics.kernels.time_stepping.workspace import body_fields, setting_fields

# Columns of `many.momenta` in a resting stage: velocities before it, then momenta with its loads.
PRE_LOAD_VELOCITY, LOADED_MOMENTA = 0, 6

# Contacts that two bodies may have at once: a rectangle clipped by another one has up to eight vertices.
PAIR_CONTACTS = 8

# Pairs near each other at once, per body: twelve spheres touch one of their size, and each pair counts for two.
PAIRS_PER_BODY = 8

# Entries of all columns of the broad phase, per body.
ENTRIES_PER_BODY = 4

# Blocks of the linear system of `block_lu` per body: where more are needed Newton's method is left out.
BLOCKS_PER_BODY = 32

# Bundles of contacts of one island (`contact_batches`) per body: where more are needed Newton's method is left out,
# too.
BATCHES_PER_BODY = 32

# `counts`: contacts, pairs, contacts or pairs for which there was no room, and bundles of the island that is solved.
NUM_CONTACTS, NUM_PAIRS, NUM_DROPPED, NUM_BATCHES = range(4)

# Of `block_lu`: numbers of a column, velocity and angular velocity with one unused after each, and of a block of six.
COLUMN_SIZE = 8
BLOCK_SIZE = 6 * COLUMN_SIZE

# Numbers of a row of `normal_rows`: five vectors, one unused number after each; and of one of `visit`, five lines of a
# cache.
NORMAL_ROW_SIZE = 5 * 4
VISIT_SIZE = 5 * 8

# Numbers of a row of `bundle`, and of `lanes`: four for each of the fields in `contact_batches`.
BATCH_SIZE = 6
LANES_SIZE = 4 * 52

# Row of `memory`, one per world: length of the last resting stage [s], its contact count, then `WARM_CONTACT_SIZE`
# numbers for each contact: its name, first and second body (-1 - k: wall k), impulse and point in the world frame.
# Where substeps are refined the last column of all is the next part of one as a share of it (`adaptive_substep`; 0: all
# of it).
WARM_STAGE_LENGTH, WARM_CONTACT_COUNT = range(2)
WARM_HEADER_SIZE = 2
WARM_CONTACT_ID, WARM_BODY_A, WARM_BODY_B, WARM_IMPULSE, WARM_POINT = 0, 1, 2, 3, 6
WARM_CONTACT_SIZE = 9


class WorldSnapshots(NamedTuple):
    """A world at moments to which `adaptive_substep` comes back, one row for each."""

    now: np.ndarray  # states of the bodies, (moments, bodies, STATE_SIZE)
    memory: np.ndarray  # row of `memory`
    report: np.ndarray  # row of the report
    counts: np.ndarray  # events of each body


class BodiesWorkspace(NamedTuple):
    """Bodies, pairs and contacts of the world that a thread is at; shapes in `make_bodies_workspace`."""

    bodies: np.ndarray  # records: parameters and loads, see `workspace.body_fields`
    now: np.ndarray  # states, columns of `layout`
    rotation: np.ndarray  # body frame to world, row by row
    lightness: np.ndarray  # 1/mass [1/kg]
    turning: np.ndarray  # inverse inertia in the world frame: 00, 01, 02, 11, 12, 22 [1/(kg m²)]
    twist: np.ndarray  # velocity and angular velocity, world frame [m/s, rad/s]
    place: np.ndarray  # geometric centre, world frame [m]
    box: np.ndarray  # lower, then upper corner of the box along the world axes, motion of the stage included [m]
    touched: np.ndarray  # 1: the body is in a contact of this stage
    spin: (
        np.ndarray
    )  # of `conservative_advancement`: bound of |ω| of a body that may turn far in this stage, else 0 [rad/s]
    simplex: np.ndarray  # of `gjk`: differences of points of two bodies [m]
    order: np.ndarray  # bodies by the lower end of their boxes
    merged: np.ndarray  # scratch of sorting; then places of the bodies in `order`
    first_entry: np.ndarray  # of `columns`: where the bodies of a column begin in `entry`, and where to go on
    cursor: np.ndarray
    entry: np.ndarray
    walls: np.ndarray  # columns of `layout`
    pairs: np.ndarray  # bodies whose boxes overlap
    counts: np.ndarray
    ends: np.ndarray  # first and second body of a contact; -1 - k: wall k
    name: np.ndarray  # of a contact, the same while the same features touch
    owner: np.ndarray  # body that the normal turns with, -1: none
    normal: np.ndarray  # out of the second body, in the frame of its owner
    anchor: np.ndarray  # points of first and second body, in their frames, from their centres of mass [m]
    frame: np.ndarray  # normal, tangent 1, tangent 2, world frame
    arm: np.ndarray  # points of first and second body from their centres of mass, world frame [m]
    gap: np.ndarray  # [m], negative when penetrating
    speed: np.ndarray  # normal velocity before the stage [m/s], negative when approaching
    mu: np.ndarray  # Coulomb coefficient
    bounce: np.ndarray  # coefficient of restitution
    target: np.ndarray  # velocity aimed at: normal, tangents [m/s]
    impulse: np.ndarray  # normal, tangents [N s]
    step: np.ndarray  # 1/λ_max of the tangential part of its block [kg]
    block: np.ndarray  # the contact's own 3 x 3 of W = J M⁻¹ Jᵀ [1/kg]
    rows: np.ndarray  # of `normal_rows`: the normal's row of the Jacobian of a contact, and M⁻¹ times it
    visit: np.ndarray  # of `contact_rows`: what visits of contacts read, in the order of the visits
    side: np.ndarray  # their bodies, as `ends`
    motion: np.ndarray  # twists while contacts are swept, columns of `block_lu`
    settled: np.ndarray  # of `gauss_seidel`: impulses of visits as they were four sweeps ago, and two sweeps ago [N s]
    trend: np.ndarray
    visited: np.ndarray  # of sweeps: number of the last visit of a contact, of the last push of a body
    pushed: np.ndarray
    table: np.ndarray  # places of names in the last stage's contacts: open addressing
    mix: np.ndarray  # of a pair of blocks: axes of one in the other, and absolute values
    polygon: np.ndarray  # of a pair of blocks: clipped face, two copies of (x, y, height)
    edge: np.ndarray  # of a pair of blocks: edges into and out of each vertex of it
    free: np.ndarray  # twists without contact impulses [m/s, rad/s]
    parent: np.ndarray  # of `islands`: a body of the same island, and the number of a body's island
    island: np.ndarray
    first_contact: np.ndarray  # where the contacts and bodies of an island begin in `queue` and `order`
    first_body: np.ndarray
    queue: np.ndarray  # contacts, island by island
    neighbour: np.ndarray  # of `minimum_degree`: linked lists of bodies that touch a body, (body, next entry)
    links: np.ndarray  # how many entries those have
    head: np.ndarray  # first entry of a body
    degree: np.ndarray  # its length
    mark: np.ndarray
    bucket: np.ndarray  # linked lists of bodies of one degree
    ahead: np.ndarray
    behind: np.ndarray
    rank: np.ndarray  # place of a body in the elimination
    start: np.ndarray  # later neighbours of a body: `column[start : stop]`
    stop: np.ndarray
    column: np.ndarray
    diagonal: np.ndarray  # of `block_lu`: the linear system
    lower: np.ndarray
    upper: np.ndarray
    swaps: np.ndarray
    rebound: np.ndarray  # of `restitution_energy`: impulses with all of the rebound [N s]
    best: np.ndarray  # best impulses met by all methods for an island [N s]
    defect: np.ndarray  # of `proximal_newton`: x - M⁻¹ Jᵀ p(x), columns of `block_lu` [m/s, rad/s]
    before: np.ndarray  # twists before a Newton step
    change: np.ndarray  # the step, columns of `block_lu`
    bundle: np.ndarray  # of `contact_batches`: bodies, place of their block, contacts
    lanes: np.ndarray  # what `proximal_newton` and `interior_point` know of contacts
    momenta: (
        np.ndarray
    )  # of `restitution_energy`: velocity and angular momentum before an impact, then with all of its rebound
    hulls: Hulls | None  # tables of convex polyhedra, and a pair of them in place; None where there is no hull
    settings: np.ndarray  # one record: see `workspace.setting_fields`


def contact_capacity(bodies: int, walls: int, polyhedra: Sequence = ()) -> int:
    """Contacts that a world of so many bodies and walls has room for; `polyhedra` are those of `make_hulls`."""
    corners = max([VERTEX_COUNT, *(len(body.vertices) for body in polyhedra if body is not None)])
    return bodies * walls * corners + pair_capacity(bodies) * max(PAIR_CONTACTS, clipped_face_capacity(polyhedra))


def pair_capacity(bodies: int) -> int:
    """Pairs near each other that a world of so many bodies has room for."""
    return max(1, min(bodies * (bodies - 1) // 2, PAIRS_PER_BODY * bodies))


def warm_start_size(bodies: int, walls: int, polyhedra: Sequence = (), refined: bool = False) -> int:
    """Columns of `memory` of one world; of one whose substeps are refined the last one is for the length of a part."""
    return WARM_HEADER_SIZE + WARM_CONTACT_SIZE * contact_capacity(bodies, walls, polyhedra) + int(refined)


def make_bodies_workspace(
    bodies: int,
    walls: np.ndarray,
    terms: tuple[Term, ...] = (),
    polyhedra: Sequence = (),
    *,
    meet=True,
    in_turn=False,
    in_time=False,
    relative_slop: float,
    **settings: float,
) -> BodiesWorkspace:
    """Scratch for worlds of `bodies` bodies among `walls` ((walls, WALL_SIZE)), in fields, with numerical settings.

    `polyhedra` are those of `make_hulls`, empty where there is no hull. `meet` says whether bodies touch each other, or
    walls only; `in_turn` whether contacts that collide do so one after the other; `in_time` whether steps have an error
    tolerance.
    """
    f, i, nb = np.float64, np.int64, bodies
    pairs, n = pair_capacity(bodies), contact_capacity(bodies, len(walls), polyhedra)
    floats, ints = ("still", "half", "load"), ("rests", "meet", "in_turn", "in_time")
    fields = [*setting_fields(), *((name, f) for name in floats), *((name, i) for name in ints)]
    record = np.zeros(1, np.dtype(fields))
    record["still"], record["meet"], record["in_turn"], record["in_time"] = np.inf, meet, in_turn, in_time
    for name, value in settings.items():
        record[name] = value
    rows = np.zeros(nb, np.dtype(body_fields(terms)))
    rows["relative_slop"] = relative_slop
    blocks = min(max(1, nb * (nb - 1) // 2), BLOCKS_PER_BODY * nb)
    bundles = max(1, min(n, BATCHES_PER_BODY * nb))
    table = 1 << (2 * n - 1).bit_length()
    return BodiesWorkspace(
        bodies=rows, now=np.zeros((nb, STATE_SIZE)), rotation=np.zeros((nb, 9)), lightness=np.zeros(nb),
        turning=np.zeros((nb, 6)), twist=np.zeros((nb, 6)), place=np.zeros((nb, 3)), box=np.zeros((nb, 6)),
        touched=np.zeros(nb, i), spin=np.zeros(nb), simplex=np.zeros((4, 3)),
        order=np.arange(nb, dtype=i), merged=np.zeros(nb, i),
        first_entry=np.zeros(nb + 1, i), cursor=np.zeros(nb, i), entry=np.zeros(ENTRIES_PER_BODY * nb, i),
        walls=walls.copy(),
        pairs=np.zeros((pairs, 2), i), counts=np.zeros(4, i), ends=np.zeros((n, 2), i), name=np.zeros(n, i),
        owner=np.zeros(n, i), normal=np.zeros((n, 3), f), anchor=np.zeros((n, 6)), frame=np.zeros((n, 9)),
        arm=np.zeros((n, 6)), gap=np.zeros(n), speed=np.zeros(n), mu=np.zeros(n), bounce=np.zeros(n),
        target=np.zeros((n, 3)), impulse=np.zeros((n, 3)), step=np.zeros(n), block=np.zeros((n, 9)),
        rows=np.zeros((n, NORMAL_ROW_SIZE)), motion=np.zeros((nb, COLUMN_SIZE)), visit=np.zeros((n, VISIT_SIZE)),
        side=np.zeros((n, 2), i),
        settled=np.zeros((n, 3)), trend=np.zeros((n, 3)), visited=np.zeros(n, i), pushed=np.zeros(nb, i),
        table=np.full(table, -1, i), mix=np.zeros((4, 3, 3)), polygon=np.zeros((2, 16, 3)),
        edge=np.zeros((2, 16, 2), i), free=np.zeros((nb, 6)), parent=np.zeros(nb, i), island=np.zeros(nb, i),
        first_contact=np.zeros(n + 1, i), first_body=np.zeros(n + 1, i), queue=np.zeros(n, i),
        neighbour=np.zeros((2 * blocks, 2), i), links=np.zeros(1, i), head=np.zeros(nb, i), degree=np.zeros(nb, i),
        mark=np.zeros(nb, i), bucket=np.zeros(nb, i), ahead=np.zeros(nb, i), behind=np.zeros(nb, i),
        rank=np.zeros(nb, i), start=np.zeros(nb, i), stop=np.zeros(nb, i), column=np.zeros(blocks, i),
        diagonal=np.zeros((nb, BLOCK_SIZE)), lower=np.zeros((blocks, BLOCK_SIZE)), upper=np.zeros((blocks, BLOCK_SIZE)),
        swaps=np.zeros(6, i), rebound=np.zeros((n, 3)), best=np.zeros((n, 3)), defect=np.zeros((nb, COLUMN_SIZE)),
        before=np.zeros((nb, 6)), change=np.zeros((nb, COLUMN_SIZE)), bundle=np.zeros((bundles, BATCH_SIZE), i),
        lanes=np.zeros((bundles, LANES_SIZE)), momenta=np.zeros((nb, 12)),
        hulls=make_hulls(polyhedra) if polyhedra else None, settings=record,
    )  # fmt: skip


def make_snapshots(bodies: int, memory: int) -> WorldSnapshots:
    """Room for a world of so many bodies and columns of `memory` at three moments."""
    return WorldSnapshots(
        np.zeros((3, bodies, STATE_SIZE)),
        np.zeros((3, memory)),
        np.zeros((3, REPORT_SIZE)),
        np.zeros((3, bodies), np.int64),
    )
