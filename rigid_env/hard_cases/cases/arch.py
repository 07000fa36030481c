"""Hard case of a semicircular arch of wedge stones: the thickness at which it stands, by limit analysis."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.optimize import linprog

import physics
from rigid_env.hard_cases.case import Case, Check, Setting, at_least, none_of
from rigid_env.hard_cases.cases import stacks

FRICTION = 0.8  # stones would slide on each other only below about 0.4, so the arch fails by hinges
WIDTH, DENSITY = 0.25, 1000.0  # width of the arch along z [m], density of the stones [kg/m³]

# Accuracy of the linear program, and share of an arch's weight that may lack support.
SOLVED = 1e-7

# Share by which the tested arches are thicker or thinner than the limit.
NEAR = 0.005

# Displacement of a stone beyond which the arch counts as fallen, about one thickness [m].
FALLEN = 0.1


def joints(stones: int, thickness: float) -> np.ndarray:
    """Inner and outer end of each joint (stones + 1, 2, 2) of an arch of mean radius 1 m above y = 0 [m]."""
    angles = np.linspace(0.0, np.pi, stones + 1)
    rays = np.column_stack([np.cos(angles), np.sin(angles)])
    rays[[0, -1], 1] = 0.0
    return np.array([1 - thickness / 2, 1 + thickness / 2])[None, :, None] * rays[:, None, :]


def arch(stones: int, thickness: float) -> physics.Scene:
    """Scene with an arch of wedge stones, one between each pair of neighbouring joints, on a floor y = 0."""
    ends, bodies = joints(stones, thickness), []
    for here, there in pairwise(ends):
        outline = [*here, *there[::-1]]
        points = [(x, y, z) for x, y in outline for z in (-WIDTH / 2, WIDTH / 2)]
        stone = physics.Hull(points, 1.0)
        bodies.append(physics.Hull(points, DENSITY * stone.polyhedron.volume, pos=stone.centroid))
    return stacks.pile(bodies, FRICTION)


def least_thickness(stones: int) -> float:
    """Least ratio of thickness to radius for which the arch stands, to 1e-7: the zero of `missing_force`."""
    low, high = 0.05, 0.2
    while high - low > SOLVED:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if missing_force(stones, middle) > SOLVED else (low, middle)
    return high


def missing_force(stones: int, thickness: float) -> float:
    """Least sum of helping forces that holds the arch, as a share of its weight; 0 if it stands without help.

    It is the solution of the linear program of limit analysis. Contact forces at both ends of every joint push and obey
    Coulomb's law. Together with the weight, and with helping forces and moments of any sign, they keep every stone in
    equilibrium. The sum of the sizes of the helping forces and moments is minimised. The engine is not used: area and
    centroid of a stone follow from its outline by the shoelace formula.
    """
    ends = joints(stones, thickness)
    A = np.zeros((3 * stones, 4 * (stones + 1)))
    cone = np.zeros((4 * (stones + 1), 4 * (stones + 1)))
    for j, pair in enumerate(ends):
        tangent = (pair[1] - pair[0]) / np.linalg.norm(pair[1] - pair[0])
        normal = np.array([-tangent[1], tangent[0]])  # towards stone j, away from stone j - 1
        for k, arm in enumerate(pair):
            column = 4 * j + 2 * k
            cone[column : column + 2, column : column + 2] = [[-FRICTION, 1], [-FRICTION, -1]]
            for c, way in enumerate((normal, tangent)):
                row = np.array([*way, arm[0] * way[1] - arm[1] * way[0]])
                if j < stones:
                    A[3 * j : 3 * j + 3, column + c] = row
                if j > 0:
                    A[3 * j - 3 : 3 * j, column + c] = -row
    weight = np.array([_weight(np.array([*a, *b[::-1]])) for a, b in pairwise(ends)])
    b = np.column_stack([np.zeros(stones), weight[:, 0], weight[:, 0] * weight[:, 1]]).ravel() / weight[:, 0].sum()
    help_ = np.eye(3 * stones)
    costs = np.r_[np.zeros(A.shape[1]), np.ones(6 * stones)]
    bounds = [(0, None), (None, None)] * (2 * (stones + 1)) + [(0, None)] * (6 * stones)
    rows = np.hstack([cone, np.zeros((len(cone), 6 * stones))])
    return float(
        linprog(
            costs, A_ub=rows, b_ub=np.zeros(len(rows)), A_eq=np.hstack([A, help_, -help_]), b_eq=b, bounds=bounds
        ).fun
    )


def _weight(outline: np.ndarray) -> tuple[float, float]:
    """Area and x of the centroid of a polygon (n, 2), by the shoelace formula."""
    x, y = outline.T
    cross = x * np.roll(y, -1) - y * np.roll(x, -1)
    return cross.sum() / 2, ((x + np.roll(x, -1)) * cross).sum() / (3 * cross.sum())


def arches(setting: Setting) -> list[Check]:
    """Arches of 7, 15 and 51 stones, 0.5 % thicker and 0.5 % thinner than the limit for their number of stones.

    Masonry of stiff stones that do not slide stands if and only if forces inside it can balance its weight [1]. A
    linear program (`missing_force`) decides whether they can [2]. A semicircular arch fails by hinges at five joints.
    With few stones there may be no joint at the best place for a hinge, so the limit of thickness/radius is lower:
    0.0957 for 7 stones, 0.1061 for 15, 0.1074 for 51, and 0.1075 for thinner and thinner stones [3].

    Limit for a standing arch, after a minute: each of the n + 1 joints may open or close by one slop at one end. This
    turns everything above the joint, within 2 m, by the slop over the thickness.

    Limit for a falling arch: the least sum of helping forces is m times the weight. By duality it is the power of the
    weight in a mechanism in which no part is faster than 1 (m/s, rad/s). The kinetic energy of this mechanism is at
    most M: the stones' moments of inertia add 1 % to ½ M (1² + 1²). So its acceleration is at least m g/2.1, and it
    grows. Within the time T some stone moves by ½ (m g/2.1) T², here a thickness. The run ends at the first whole
    second after that, before the stones lie in a heap. A quick run has 7 and 15 stones.

    References
    ----------
    .. [1] J. Heyman, *The stone skeleton*, Int. J. Solids Struct. 2, 1966.
    .. [2] R. K. Livesley, *Limit analysis of structures formed from rigid blocks*, IJNME 12, 1978.
    .. [3] M. Milankovitch, *Theorie der Druckkurven*, Z. Math. Phys. 55, 1907 (for radial joints, 0.1075).
    """
    checks = []
    for stones in setting.pick((7, 15, 51), (7, 15)):
        limit = least_thickness(stones)
        for share in (1 + NEAR, 1 - NEAR):
            thickness = share * limit
            what = f"{stones} stones, {abs(share - 1):.1%} {'above' if share > 1 else 'below'} the limit"
            scene = arch(stones, thickness)
            world = setting.world(scene)
            if share > 1:
                moved, wrong, _ = stacks.settle(setting, world, setting.pick(60.0, 5.0))
                slop = setting.slop * max(float(body.bounding_radius(body.dimensions)) for body in scene.bodies)
                most = (stones + 1) * slop / thickness * 2.0 if setting.is_ours else stacks.STANDING * thickness
                checks.append(Check(f"{what}: moved", moved, most, "m"))
                if setting.is_ours:
                    checks.append(none_of(f"{what}: seconds with a contact problem above its tolerance", wrong))
            else:
                time = np.sqrt(2 * FALLEN / (missing_force(stones, thickness) * stacks.G / 2.1))
                moved = stacks.settle(setting, world, float(time), FALLEN)[0]
                checks.append(at_least(f"{what}: moved within {time:.0f} s", moved, FALLEN, "m"))
    return checks


COARSE = (
    "its tolerance, a thousandth, is not much finer than the 0.5 % by which the forces fit into the stones: 15 stones "
    "slowly give way"
)

CASES = (
    Case(32, "arch", "a semicircular arch of wedge stones",
         "stands iff thickness/radius > 0.1075 (of 7 stones 0.0957, by limit analysis)", arches, peers=True,
         faults={"fast": COARSE}),
)  # fmt: skip
