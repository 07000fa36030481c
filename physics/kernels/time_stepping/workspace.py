"""Workspace of one thread, `scratch`: the numbers of one body, and of its contacts with walls, during a step.

The workspace is one NumPy record, so that kernels pass on a single pointer, and the compiler knows every size. It is
filled anew for each body (`body.bind_body`), and no step leaves numbers in it for the next.

Contacts are with walls, so arms and Jacobian rows are those of the body. A wall has zero inverse mass and inverse
inertia, as in the course notes, and adds nothing. Bodies that touch each other have a memory of their own
(`multibody.data.arrays`).
"""

from __future__ import annotations

import numpy as np

from physics.kernels.contact_law.materials import WallMaterials, material_members
from physics.kernels.contact_solver.friction_pyramid import normal_lcp_sizes, pyramid_sizes
from physics.kernels.forces.force_field_dispatch import Term, term_members
from physics.kernels.state import contact_law_dispatch as contact_laws
from physics.kernels.state.layout import SERIES_SIZE, VERTEX_COUNT, WALL_SIZE
from physics.kernels.time_stepping.midpoint_friction import MEAN_SLIP_CONTACTS


def setting_fields() -> list[tuple]:
    """Fields, in the form of `numpy.dtype`, of the numerical settings in a workspace."""
    f, i = np.float64, np.int64
    return [
        ("tolerance", f),  # largest residual of a contact solve, relative to the largest free contact speed
        ("sweeps", i),  # sweeps per solve at most
        ("splits", i),  # cuts of a substep at impacts at most
        ("mean_slip", i),  # most contacts of a stage with friction against their mean slip (`midpoint_friction`)
        ("rest_share", f),  # a rebound that would be over within this share of the substep is plastic
    ]


def body_fields(
    terms: tuple[Term, ...] = (), laws: tuple[str, ...] = (), materials: WallMaterials | None = None
) -> list[tuple]:
    """Fields, in the form of `numpy.dtype`, of a body's record: its parameters and loads (`body.bind_body`).

    `terms` are the scene's force fields, `laws` its contact laws, and `materials` its coefficients at walls; they add
    members.
    """
    f, i = np.float64, np.int64
    return [
        *term_members(terms),  # first: Numba takes a record for another one whose fields are the first of its own
        *contact_laws.law_members(laws),
        *material_members(materials),
        ("relative_slop", f),  # gap within which a feature touches, in bounding radii; `bind_body` only reads this one
        ("i", i),
        ("world", i),
        ("shape", i),
        ("mass", f),  # [kg]
        ("J", f, (3,)),  # inverse principal moments [1/(kg m²)]
        ("series", f, (SERIES_SIZE,)),  # of the free rotation
        ("principal", f, (4,)),  # quaternion, principal frame to body frame
        ("center", f, (3,)),  # of the block, from the centre of mass, body frame [m]; not set unless `offset_frame`
        ("dims", f, (3,)),  # half edges, semi-axes, or the radius three times [m]
        ("radius", f),  # of the bounding sphere [m]
        ("slop", f),  # [m]
        ("mu", f),  # Coulomb coefficient
        ("restitution", f),
        ("free_acceleration", f, (3,)),  # of the centre of mass without contact [m/s²]
        ("torque", f, (3,)),  # about the centre of mass [N m]
        ("acceleration", f),  # bound for any point of the body without contact [m/s²]
    ]


def _scene_fields(wall_count: int) -> list[tuple]:
    """Fields, in the form of `numpy.dtype`, of the walls, and of the number of features of a body."""
    f, i = np.float64, np.int64
    return [
        ("features", i),  # contact features of a body, 8 or 1
        ("feature_bits", i),  # log2(features)
        ("walls", f, (max(wall_count, 1), WALL_SIZE)),  # columns of `layout`
    ]


def _stage_fields() -> list[tuple]:
    """Fields, in the form of `numpy.dtype`, that one stage, or one solve, leaves for the next."""
    f, i = np.float64, np.int64
    return [
        ("mode", i),  # the direct solve to try first, then the one that solved it (`sliding_patch.TRY_STICKING` ...)
        ("residual_limit", f),  # residual allowed beside the tolerance [m/s]: see `midpoint_step.rest_residual`
        ("target_error_limit", f),  # allowed error of the targets of sticking contacts [m/s]: see `sticking`
        ("is_last", i),  # 1 in the last stage a substep may have: the set has all features that would pass a wall
    ]


def _contact_fields(walls: int, n: int, laws: tuple[str, ...]) -> list[tuple]:
    """Fields, in the form of `numpy.dtype`, of up to n contacts: contact set, contact problem, results of a solve.

    `walls` is the number of walls, `laws` are the scene's contact laws.
    """
    f, i = np.float64, np.int64
    contact_set = [
        ("mask", i, (walls,)),  # bit k: feature k of the body is in the contact set of this wall
        ("vertices", f, (2, VERTEX_COUNT)),  # gap [m] and normal velocity [m/s] of each vertex at one wall
        ("slot", i, (n,)),  # wall * features + feature, the stable name of a contact
        ("gap", f, (n,)),  # [m], negative when penetrating
        *[("end_gap", f, (n,))] * (contact_laws.LAW_STIFFNESS in laws),  # gap at the end of a stage [m] (`compliance`)
        ("speed", f, (n,)),  # normal velocity before the stage [m/s], negative when approaching
        ("widest", f),  # largest gap of them all, 0 if there is none above a wall [m]
        ("approach", f),  # fastest approach of them all, 0 if none does [m/s]
    ]
    problem = [
        ("arm", f, (n, 3)),  # contact point relative to the centre of mass, world frame [m]
        ("target", f, (n, 3)),  # contact velocity aimed at (normal, tangents) [m/s]
        ("held_target", f, (MEAN_SLIP_CONTACTS, 2)),  # tangents of contacts that hold (`midpoint_friction`) [m/s]
        ("friction", f, (n,)),  # Coulomb coefficient
        ("frame", f, (3 * n, 3)),  # directions normal, tangent 1, tangent 2 of each contact
        ("angular", f, (3 * n, 3)),  # angular Jacobian rows arm x direction [m]
        ("response", f, (3 * n, 3)),  # I⁻¹ (arm x direction) [1/(kg m)]
        ("delassus", f, (3 * n, 3 * n)),  # W = J M⁻¹ Jᵀ [1/kg]
        ("bias", f, (3 * n,)),  # b of u = W p + b [m/s]
    ]
    outputs = [
        ("impulse", f, (3 * n,)),  # p, before a solve the warm start [N s]
        ("velocity", f, (3 * n,)),  # u, of iterative solves [m/s]
        ("rebound", f, (3 * n,)),  # p of an impact with all of its rebound, where there is less energy [N s]
    ]
    return contact_set + problem + outputs


def _solver_fields(n: int) -> list[tuple]:
    """Fields, in the form of `numpy.dtype`, of the contact solvers' own numbers for n contacts."""
    float_size, int_size = np.maximum(pyramid_sizes(n), normal_lcp_sizes(n)).tolist()
    f, i = np.float64, np.int64
    return [
        ("saved", f, (3 * n,)),  # impulses of the sweeps, kept while the fallback tries [N s]
        ("change", f, (3 * n,)),  # of p in the last sweep [N s]
        ("active", i, (n,)),  # of a direct solve: contacts that push, flags (`sticking`) or a list (`sliding_patch`)
        ("normal", f, (n,)),  # of a direct solve: normal impulse, negative where the contact is open [N s]
        ("across", f, (n, 2)),  # of `sticking`: tangential impulse [N s]
        ("twist", f, (6,)),  # of `contact_solver.proximal_newton`: change of (v, ω) [m/s, rad/s]
        ("start", f, (6,)),
        ("defect", f, (6,)),
        ("newton", f, (6, 7)),
        ("trial", f, (3 * n,)),  # [N s]
        ("local", f, (n, 12)),  # see `contact_solver.gauss_seidel.invert_contact_blocks`
        ("fallback_float", f, (float_size,)),
        ("fallback_int", i, (int_size,)),
    ]


def workspace_dtype(
    wall_count: int,
    features: int,
    terms: tuple[Term, ...] = (),
    laws: tuple[str, ...] = (),
    materials: WallMaterials | None = None,
) -> np.dtype:
    """Record type of a workspace for bodies with `features` contact features (8 or 1) at `wall_count` walls.

    `terms` are the scene's force fields, `laws` its contact laws, and `materials` its coefficients at walls.
    """
    n = max(wall_count * features, 1)
    groups = {
        "settings": setting_fields(),
        "scene": _scene_fields(wall_count),
        "body": body_fields(terms, laws, materials),
        "stage": _stage_fields(),
        "contacts": _contact_fields(max(wall_count, 1), n, laws),
        "solver": _solver_fields(n),
    }
    return np.dtype([(name, np.dtype(fields)) for name, fields in groups.items()])


def make_workspace(
    walls: np.ndarray,
    features: int,
    terms: tuple[Term, ...] = (),
    laws: tuple[str, ...] = (),
    materials: WallMaterials | None = None,
    **settings: float,
) -> np.ndarray:
    """Make a workspace, an array of one record, for the given walls (walls, WALL_SIZE), features, fields and laws.

    `materials` describes coefficients at walls. `settings` are numbers of `setting_fields`, or of a body's record such
    as `relative_slop`.
    """
    scratch = np.zeros(1, workspace_dtype(len(walls), features, terms, laws, materials))
    scene = scratch["scene"]
    scene["features"], scene["feature_bits"] = features, features.bit_length() - 1
    if len(walls):
        scene["walls"][0] = walls
    scratch["stage"]["residual_limit"] = np.inf
    if materials is not None:
        materials.write(scratch["body"])
    for name, value in settings.items():
        scratch["settings" if name in scratch.dtype["settings"].names else "body"][name] = value
    return scratch


def body_records(scratch) -> np.ndarray:
    """Records of bodies (`body_fields`) in a workspace, in a `LinkedWorld`, or in a `BodiesWorkspace`."""
    if isinstance(scratch, np.ndarray):
        return scratch["body"]
    return getattr(scratch, "bodies", scratch).body
