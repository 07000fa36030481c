"""Allocate the workspace of a world whose bodies touch each other: its capacities, and its groups of arrays.

Capacities grow with the numbers of bodies, walls and contacts. The report counts contacts and pairs without room.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from physics.kernels.contact_law.materials import WallMaterials
from physics.kernels.forces.force_field_dispatch import Term
from physics.kernels.multibody.data.arrays import (
    BATCH_SIZE,
    BATCHES_PER_BODY,
    BLOCK_SIZE,
    BLOCKS_PER_BODY,
    COLUMN_SIZE,
    CYLINDER_FACE_CONTACTS,
    CYLINDER_PAIR_CONTACTS,
    CYLINDER_WALL_CONTACTS,
    ENTRIES_PER_BODY,
    LANES_SIZE,
    NORMAL_ROW_SIZE,
    PAIR_CONTACTS,
    PAIRS_PER_BODY,
    RATE_SIZE,
    TORQUE_HISTORY,
    TORQUE_SIZE,
    VISIT_SIZE,
    WARM_CONTACT_SIZE,
    WARM_HEADER_SIZE,
    Bodies,
    BodiesWorkspace,
    BroadPhase,
    Compliance,
    ContactSet,
    DrivenBodies,
    ForetoldTwists,
    Islands,
    LinearSystem,
    LoneBody,
    NarrowPhase,
    Newton,
    PairMaterials,
    Resistance,
    StageStart,
    Sweeps,
    WorldSnapshots,
)
from physics.kernels.multibody.data.hull_tables import clipped_face_capacity, make_hulls
from physics.kernels.multibody.data.parts import ActingBodies, Part, make_parts, write_part_records
from physics.kernels.state.contact_law_dispatch import LAW_ROLLING, LAW_SPIN, LAW_STIFFNESS
from physics.kernels.state.layout import REPORT_SIZE, STATE_SIZE, VERTEX_COUNT
from physics.kernels.time_stepping.workspace import body_fields, setting_fields


def bodies_setting_fields() -> list[tuple]:
    """Fields of the record `settings`: numerical settings, and instructions of the present stage to the solver.

    Returns (name, type) tuples for `numpy.dtype`.
    """
    f, i = np.float64, np.int64
    return [
        *setting_fields(),
        ("residual_limit", f),  # largest residual, besides the tolerance [m/s]: `stepping.midpoint_step.rest_residual`
        ("half_load_speed", f),  # error control: least speed that loads give a body in half a substep [m/s]; else 0
        ("substep", f),  # length of the substep [s]; under error control of the present part of it
        ("load_speed", f),  # largest speed that the loads of a resting stage give a body [m/s], else 0
        ("is_resting_stage", i),  # 1: solve of a resting stage without error control; 0: any other solve
        ("meet", i),  # 1: bodies touch each other; 2: moving bodies touch only fixed ones; 0: walls only
        ("is_sequential", i),  # 1: colliding contacts are resolved one after the other
        ("is_error_controlled", i),  # 1: steps have an error tolerance
    ]


def contact_capacity(bodies: int, walls: int, polyhedra: Sequence = (), cylinders: bool | None = None) -> int:
    """Largest number of contacts in a world with these numbers of bodies and walls.

    `polyhedra` are the bodies as `make_hulls` takes them; empty if the world has no hulls. Parts of compounds count as
    bodies. `cylinders` says whether some of them are cylinders.
    """
    corners = max([VERTEX_COUNT, *(len(body.vertices) for body in polyhedra if body is not None)])
    of_pair = max(PAIR_CONTACTS, clipped_face_capacity(polyhedra))
    if cylinders:
        corners, of_pair = max(corners, CYLINDER_WALL_CONTACTS), of_pair + CYLINDER_FACE_CONTACTS
        of_pair = max(of_pair, CYLINDER_PAIR_CONTACTS)
    return bodies * walls * corners + pair_capacity(bodies) * of_pair


def pair_capacity(bodies: int) -> int:
    """Number of near pairs that the workspace of a world with this number of bodies has room for."""
    return max(1, min(bodies * (bodies - 1) // 2, PAIRS_PER_BODY * bodies))


def block_capacity(bodies: int) -> int:
    """Number of off-diagonal blocks that the linear system of a world with this number of bodies has room for."""
    return min(max(1, bodies * (bodies - 1) // 2), BLOCKS_PER_BODY * bodies)


def batch_capacity(bodies: int, contacts: int) -> int:
    """Number of contact batches that there is room for, in a world with these numbers of bodies and contacts."""
    return max(1, min(contacts, BATCHES_PER_BODY * bodies))


def warm_start_size(
    bodies: int,
    walls: int,
    polyhedra: Sequence = (),
    refined: bool = False,
    laws: tuple[str, ...] = (),
    cylinders: bool | None = None,
) -> int:
    """Number of columns of a world's row of `memory`, the warm start (`arrays.WARM_CONTACT_ID`, ...).

    `bodies`, `polyhedra` and `cylinders` are as in `contact_capacity`. `refined` says that substeps have error control,
    which keeps one number more. `laws` are those of the scene: rolling and spin friction keep a torque for each
    contact.
    """
    room = contact_capacity(bodies, walls, polyhedra, cylinders)
    return WARM_HEADER_SIZE + warm_contact_size(laws) * room + int(refined)


def warm_contact_size(laws: tuple[str, ...] = ()) -> int:
    """Number of columns of `memory` for each contact, in a scene with these laws: its torque and its depth included."""
    return WARM_CONTACT_SIZE + TORQUE_SIZE * has_torques(laws) + (LAW_STIFFNESS in laws)


def has_torques(laws: tuple[str, ...]) -> bool:
    """True if rolling or spin friction is among the laws."""
    return LAW_ROLLING in laws or LAW_SPIN in laws


def make_bodies_workspace(
    bodies: int,
    walls: np.ndarray,
    terms: tuple[Term, ...] = (),
    polyhedra: Sequence = (),
    fixed: np.ndarray | None = None,
    *,
    groups: np.ndarray | None = None,
    materials: tuple[WallMaterials | None, PairMaterials | None] = (None, None),
    motion_columns: int = 0,
    **settings: float,
) -> BodiesWorkspace:
    """Allocate scratch memory for worlds of `bodies` bodies that touch each other.

    Parameters
    ----------
    bodies : int
        Number of bodies of a world.
    walls : array (walls, WALL_SIZE)
        Columns of `state.layout`; copied.
    terms : tuple of Term
        Force fields of the scene, which add fields to the record of a body.
    polyhedra : sequence
        The bodies as `make_hulls` takes them; empty if the world has no hulls.
    fixed : array (bodies,) int64, optional
        1 for each fixed body, 0 for others; copied. None: no body is fixed.
    groups : array (bodies + walls, 2) int64, optional
        Collision group and mask of each body, then of each wall; copied. None: all may touch.
    capsules : True or None
        Whether some bodies or parts are capsules.
    cylinders : True or None
        Whether some bodies or parts are cylinders.
    parts : sequence of Part
        Parts of the compounds, sorted by their bodies; `polyhedra` has a row for each of them, behind the bodies.
    materials : tuple of two
        Layout of the coefficients at walls, None: those of a body act at all of them; rules and exceptions for two
        bodies, None: the default rules.
    motion_columns : int
        Columns of a prescribed motion (`flight.prescribed_motion`); 0: no body has one.
    laws : tuple of str
        Contact laws of the scene (`state.contact_law_dispatch.LAWS`), which add fields to the record of a body.
    grain : Grain or None
        Axes of friction with two coefficients; None: it has one coefficient.
    lone : True or None
        Whether exactly one body moves, and it can touch fixed bodies.
    slip_ends : bool
        Whether stages end where slips end (`stepping.slip_end`).
    foretold : bool
        Whether stages foretell the twists of several bodies (`stepping.foretold_twists`).
    even : bool
        Whether loads are shared evenly (`solver.even_loads`).
    settings : float
        Fields of `bodies_setting_fields`, by name, and `relative_slop`, the gap within which features touch, in
        bounding radii. By default bodies touch each other (`meet` is 1).
    """
    parts, capsules, cylinders = (settings.pop(name, None) for name in ("parts", "capsules", "cylinders"))
    parts = parts or ()
    contacts = contact_capacity(bodies + len(parts), len(walls), polyhedra, cylinders)
    laws = settings.pop("laws", ())
    fields = body_fields(terms, laws, materials[0])
    made = _make_bodies(bodies, fields, materials[0], settings.pop("relative_slop"), fixed, groups, parts)
    acting = ActingBodies(made.body[:bodies], made.state, made.touched, made.fixed)
    return BodiesWorkspace(
        bodies=made._replace(capsules=capsules, cylinders=cylinders, parts=make_parts(bodies, parts, contacts, acting)),
        broadphase=_make_broad_phase(bodies),
        narrowphase=_make_narrow_phase(polyhedra),
        contacts=_make_contacts(contacts),
        sweeps=_make_sweeps(bodies, contacts),
        islands=_make_islands(bodies, contacts),
        system=_make_linear_system(bodies, block_capacity(bodies)),
        newton=_make_newton(bodies, batch_capacity(bodies + len(parts), contacts)),
        walls=walls.copy(),
        materials=materials[1],
        driven=_make_driven(bodies, contacts, motion_columns),
        stage_start=_make_stage_start(bodies, contacts) if settings.pop("slip_ends", None) else None,
        lone=_make_lone(contacts) if settings.pop("lone", None) else None,
        foretold=_make_foretold(bodies) if settings.pop("foretold", None) else None,
        even=np.zeros(0) if settings.pop("even", None) else None,
        resistance=_make_resistance(bodies, contacts) if has_torques(laws) else None,
        grain=settings.pop("grain", None),
        compliance=_make_compliance(bodies, contacts) if LAW_STIFFNESS in laws else None,
        counts=np.zeros(5, np.int64),
        settings=_make_settings({"meet": 1, **settings}),
    )


def _make_bodies(
    bodies: int,
    fields: list[tuple],
    materials: WallMaterials | None,
    relative_slop: float,
    fixed: np.ndarray | None,
    groups: np.ndarray | None,
    parts: Sequence[Part],
) -> Bodies:
    records = np.zeros(bodies + len(parts), np.dtype(fields))
    records["relative_slop"] = relative_slop
    write_part_records(records, bodies, parts)
    if materials is not None:
        materials.write(records)
    return Bodies(
        body=records,
        state=np.zeros((bodies, STATE_SIZE)),
        rotation=np.zeros((len(records), 9)),
        inv_mass=np.zeros(bodies),
        inv_inertia=np.zeros((bodies, 6)),
        twist=np.zeros((bodies, 6)),
        free_twist=np.zeros((bodies, 6)),
        momenta=np.zeros((bodies, 12)),
        center=np.zeros((len(records), 3)),
        box=np.zeros((bodies, 6)),
        touched=np.zeros(bodies, np.int64),
        spin_bound=np.zeros(bodies),
        lift_work=np.zeros(bodies),
        fixed=None if fixed is None else fixed.copy(),
        groups=None if groups is None else groups.copy(),
        capsules=None,
        cylinders=None,
        parts=None,
    )


def _make_broad_phase(bodies: int) -> BroadPhase:
    i = np.int64
    return BroadPhase(
        pairs=np.zeros((pair_capacity(bodies), 2), i),
        sorted_pairs=np.zeros((pair_capacity(bodies), 2), i),
        order=np.arange(bodies, dtype=i),
        merged=np.zeros(bodies, i),
        first_entry=np.zeros(bodies + 1, i),
        cursor=np.zeros(bodies, i),
        entry=np.zeros(ENTRIES_PER_BODY * bodies, i),
    )


def _make_narrow_phase(polyhedra: Sequence) -> NarrowPhase:
    return NarrowPhase(
        simplex=np.zeros((4, 3)),
        relative_axes=np.zeros((4, 3, 3)),
        polygon=np.zeros((2, 16, 3)),
        edge=np.zeros((2, 16, 2), np.int64),
        hulls=make_hulls(polyhedra) if polyhedra else None,
    )


def _make_contacts(contacts: int) -> ContactSet:
    i = np.int64
    return ContactSet(
        bodies=np.zeros((contacts, 2), i),
        id=np.zeros(contacts, i),
        owner=np.zeros(contacts, i),
        normal=np.zeros((contacts, 3)),
        anchor=np.zeros((contacts, 6)),
        frame=np.zeros((contacts, 9)),
        arm=np.zeros((contacts, 6)),
        gap=np.zeros(contacts),
        speed=np.zeros(contacts),
        mu=np.zeros(contacts),
        restitution=np.zeros(contacts),
        target=np.zeros((contacts, 3)),
        impulse=np.zeros((contacts, 3)),
        block=np.zeros((contacts, 9)),
        step=np.zeros(contacts),
        best_impulse=np.zeros((contacts, 3)),
        rebound_impulse=np.zeros((contacts, 3)),
        id_table=np.full(1 << (2 * contacts - 1).bit_length(), -1, i),
    )


def _make_sweeps(bodies: int, contacts: int) -> Sweeps:
    i = np.int64
    return Sweeps(
        motion=np.zeros((bodies, COLUMN_SIZE)),
        normal_rows=np.zeros((contacts, NORMAL_ROW_SIZE)),
        visit_rows=np.zeros((contacts, VISIT_SIZE)),
        visit_bodies=np.zeros((contacts, 2), i),
        impulse_4_sweeps_ago=np.zeros((contacts, 3)),
        impulse_2_sweeps_ago=np.zeros((contacts, 3)),
        visited=np.zeros(contacts, i),
        pushed=np.zeros(bodies, i),
    )


def _make_islands(bodies: int, contacts: int) -> Islands:
    i = np.int64
    return Islands(
        parent=np.zeros(bodies, i),
        of_body=np.zeros(bodies, i),
        contacts=np.zeros(contacts, i),
        first_contact=np.zeros(contacts + 1, i),
        bodies=np.zeros(bodies, i),
        first_body=np.zeros(contacts + 1, i),
        group_motion=np.zeros((bodies, 3)),
    )


def _make_linear_system(bodies: int, blocks: int) -> LinearSystem:
    i = np.int64
    return LinearSystem(
        diagonal=np.zeros((bodies, BLOCK_SIZE)),
        lower=np.zeros((blocks, BLOCK_SIZE)),
        upper=np.zeros((blocks, BLOCK_SIZE)),
        swaps=np.zeros(6, i),
        rank=np.zeros(bodies, i),
        start=np.zeros(bodies, i),
        stop=np.zeros(bodies, i),
        column=np.zeros(blocks, i),
        neighbour=np.zeros((2 * blocks, 2), i),
        links=np.zeros(1, i),
        head=np.zeros(bodies, i),
        degree=np.zeros(bodies, i),
        mark=np.zeros(bodies, i),
        bucket=np.zeros(bodies, i),
        ahead=np.zeros(bodies, i),
        behind=np.zeros(bodies, i),
    )


def _make_newton(bodies: int, batches: int) -> Newton:
    return Newton(
        defect=np.zeros((bodies, COLUMN_SIZE)),
        before=np.zeros((bodies, 6)),
        change=np.zeros((bodies, COLUMN_SIZE)),
        batch=np.zeros((batches, BATCH_SIZE), np.int64),
        lanes=np.zeros((batches, LANES_SIZE)),
    )


def _make_driven(bodies: int, contacts: int, columns: int) -> DrivenBodies | None:
    if not columns:
        return None
    return DrivenBodies(
        columns=np.zeros((bodies, columns)),
        clock=np.zeros(2),
        velocity=np.zeros((contacts, 3)),
        target=np.zeros((contacts, 3)),
        gain=np.zeros(contacts),
        work=np.zeros(1),
    )


def _make_stage_start(bodies: int, contacts: int) -> StageStart:
    return StageStart(np.zeros((bodies, STATE_SIZE)), np.zeros((contacts, 3)), np.zeros((contacts, 3)))


def _make_foretold(bodies: int) -> ForetoldTwists:
    return ForetoldTwists(np.zeros((bodies, 6)), *(np.zeros((bodies, 3)) for _ in range(3)), np.zeros(1))


def _make_lone(contacts: int) -> LoneBody:
    i = np.int64
    return LoneBody(
        follow=np.zeros((contacts, 3)),
        later=np.zeros((1, 6)),
        substep=np.zeros(1),
        impacts=np.zeros(1, i),
        slow=np.zeros(1, i),
        suspect=np.zeros(1, i),
    )


def _make_resistance(bodies: int, contacts: int) -> Resistance:
    i = np.int64
    return Resistance(
        torque=np.zeros((contacts, 3)),
        error=np.zeros((contacts, 3)),
        answer=np.zeros(contacts),
        push=np.zeros(contacts),
        count=np.zeros(bodies, i),
        loaded=np.zeros((bodies, 6)),
        torque_change=np.zeros((TORQUE_HISTORY + 1, contacts, 3)),
        error_change=np.zeros((TORQUE_HISTORY + 1, contacts, 3)),
        equations=np.zeros((TORQUE_HISTORY, TORQUE_HISTORY + 1)),
        share=np.zeros(TORQUE_HISTORY),
        order=np.zeros(TORQUE_HISTORY, i),
    )


def _make_compliance(bodies: int, contacts: int) -> Compliance:
    rows = [np.zeros(contacts) for _ in range(6)]
    sums = [np.zeros(bodies) for _ in range(3)]
    return Compliance(*rows, np.zeros((contacts, 2)), *sums, last_drift=np.zeros(1), switch=np.zeros(1))


def _make_settings(settings: dict[str, float]) -> np.ndarray:
    record = np.zeros(1, np.dtype(bodies_setting_fields()))
    record["residual_limit"] = np.inf
    for name, value in settings.items():
        record[name] = value
    return record


def make_snapshots(bodies: int, memory: int, lone: bool | None = None) -> WorldSnapshots:
    """Storage for copies of a world at several moments.

    `bodies` is the number of its bodies, `memory` the number of columns of its row of `memory` (`warm_start_size`).
    `lone` is True if exactly one body moves, among fixed ones, and else None.
    """
    moments = 4 if lone else 3
    return WorldSnapshots(
        np.zeros((moments, bodies, STATE_SIZE)),
        np.zeros((moments, memory)),
        np.zeros((moments, REPORT_SIZE)),
        np.zeros((moments, bodies), np.int64),
        np.zeros((3, RATE_SIZE)) if lone else None,
    )
