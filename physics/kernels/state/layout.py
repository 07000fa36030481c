"""Columns of the arrays that the kernels share, by name: state, parameters, walls and report.

State and parameters have one contiguous row per (world, body), so that a step reads a body from a few cache lines.
The index `i` of a row is world * body_count + body.
"""

from __future__ import annotations

# Number of coefficients of the series s and d of the free rotation: each has two terms of first, three of second and
# four of third order in |m|² and 2E (`flight.free_rotation`).
SERIES_SIZE = 18

# --- state (rows, STATE_SIZE): what evolves -------------------------------------------------------------------
POS = 0  # position of the centre of mass, world frame [m]
QUAT = 3  # unit quaternion (w, x, y, z), body to world
LINVEL = 7  # linear velocity, world frame [m/s]
ANGMOM = 10  # angular momentum about the centre of mass, world frame [kg m²/s]
ANGVEL = 13  # angular velocity, world frame [rad/s]: derived, refreshed at the end of a step
STATE_SIZE = 16

# --- parameters (rows, PARAM_SIZE): numbers that may differ between worlds -------------------------------------
INV_MASS = 0  # [1/kg]
INV_INERTIA = 1  # inverse principal moments [1/(kg m²)]
DIMENSIONS = (
    4  # half edges of a block, semi-axes of an ellipsoid, radius (three times) of a sphere, else half extents [m]
)
RADIUS = 7  # of the bounding sphere about the centre of mass [m]
FRICTION = 8  # Coulomb coefficient against the walls
RESTITUTION = 9  # normal coefficient against the walls
PRINCIPAL = 10  # unit quaternion, principal frame to body frame
SERIES = 14  # coefficients of the free-rotation series
CENTER = SERIES + SERIES_SIZE  # geometric centre of a block from its centre of mass, body frame [m]
PARAM_SIZE = CENTER + 3

# --- walls (walls, WALL_SIZE) ----------------------------------------------------------------------------------
WALL_NORMAL = 0  # unit normal, into the free side
WALL_TANGENT_1 = 3
WALL_TANGENT_2 = 6  # normal, tangent 1, tangent 2: right-handed
WALL_OFFSET = 9  # free side: normal·x >= offset [m]
WALL_SIZE = 10

# --- shapes ----------------------------------------------------------------------------------------------------
BLOCK = 0
SPHERE = 1
ELLIPSOID = 2
HULL = 3  # corners are in the tables `many.hulls`
CAPSULE = 4
COMPOUND = 5  # its parts are in the table `many.bodies.parts`
CYLINDER = 6

# Contact features of a block at a wall: its eight vertices. Spheres and ellipsoids have one, their lowest point.
VERTEX_COUNT = 8

# Numbers of a state, or accelerations, above this limit [SI] are a fault; products of three smaller ones are finite.
OVERFLOW_LIMIT = 1.0e100

# --- report (worlds, REPORT_SIZE) ------------------------------------------------------------------------------
PENETRATION = 0  # worst depth met [m]
RESIDUAL = 1  # worst natural-map residual accepted, relative to the free contact speed
ITERATIONS = 2  # sweeps, all solves together
SOLVES = 3  # contact problems solved
FALLBACKS = 4  # of these, by the pivoting fallback
UNCONVERGED = 5  # of these, with a residual above the tolerance
FAULTS = 6  # bodies whose new state was not finite or beyond `OVERFLOW_LIMIT` (their old state was kept)
SPLITS = 7  # impacts that split a substep
UNRESOLVED = 8  # substeps with more impacts than allowed: the rest was treated as plastic
SOLVER = 9  # the strongest method needed: METHOD_NONE and so on
CONTACTS_LEFT_OUT = 10  # contacts and near pairs for which there was no room
OVERLAP = 11  # deepest overlap of two bodies that were placed into each other [m], 0 where it is small
FIRST_FAULTY = 12  # 1 + the first body at fault, 0: none
UNRESOLVED_MOTION = 13  # bodies that moved in fields which the step does not resolve
DRIVEN_WORK = 14  # work of driven bodies on the others [J]
REPORT_SIZE = 15

# Methods that solve contact problems, weakest first.
METHOD_NONE, METHOD_DIRECT, METHOD_SWEEPS, METHOD_PIVOTING, METHOD_NEWTON = range(5)
