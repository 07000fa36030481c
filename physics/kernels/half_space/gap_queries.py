"""Compute gaps, contact points and spring energies of states without a step, and angular momenta from velocities.

`rows` are indices world * body_count + body of the arrays `state` and `params` (`physics.kernels.state.layout`).
"""

from __future__ import annotations

from physics.compiler.decorators import entry_kernel, kernel
from physics.kernels.half_space import support_function as geo
from physics.kernels.math import quaternion as qt
from physics.kernels.state import layout as at


@kernel
def principal_matrix(state, params, i):
    """Rotation matrix (9 scalars, row by row) from the principal frame of the body in row i to the world."""
    q = (state[i, at.QUAT], state[i, at.QUAT + 1], state[i, at.QUAT + 2], state[i, at.QUAT + 3])
    p = at.PRINCIPAL
    return qt.to_matrix(qt.multiply(q, (params[i, p], params[i, p + 1], params[i, p + 2], params[i, p + 3])))


@entry_kernel
def write_angular_momenta(rows, state, params):
    """Write angular momenta L = R I Rᵀ ω [kg m²/s] into the given rows of `state`, from their angular velocities ω.

    That of a fixed body is 0.
    """
    for k in range(rows.shape[0]):
        i = rows[k]
        w = (state[i, at.ANGVEL], state[i, at.ANGVEL + 1], state[i, at.ANGVEL + 2])
        L = (0.0, 0.0, 0.0)
        if params[i, at.INV_MASS] != 0.0 and (w[0] != 0.0 or w[1] != 0.0 or w[2] != 0.0):
            R = principal_matrix(state, params, i)
            m = qt.transposed_matvec(R, w)
            j = at.INV_INERTIA
            L = qt.matvec(R, (m[0] / params[i, j], m[1] / params[i, j + 1], m[2] / params[i, j + 2]))
        state[i, at.ANGMOM], state[i, at.ANGMOM + 1], state[i, at.ANGMOM + 2] = L


@entry_kernel
def deepest_gaps(rows, state, params, shapes, walls, gaps, which):
    """Find the smallest gap of each given row over all walls; hulls, capsules and cylinders are not supported.

    Written are `gaps` (len(rows),) [m] and `which` (len(rows),), the index of the wall, or -1 without walls.
    """
    for k in range(rows.shape[0]):
        i = rows[k]
        x = (state[i, at.POS], state[i, at.POS + 1], state[i, at.POS + 2])
        R = qt.to_matrix((state[i, at.QUAT], state[i, at.QUAT + 1], state[i, at.QUAT + 2], state[i, at.QUAT + 3]))
        d = (params[i, at.DIMENSIONS], params[i, at.DIMENSIONS + 1], params[i, at.DIMENSIONS + 2])
        c = at.CENTER
        r = qt.matvec(R, (params[i, c], params[i, c + 1], params[i, c + 2]))
        center = (x[0] + r[0], x[1] + r[1], x[2] + r[2])
        shape = shapes[i % shapes.shape[0]]
        gaps[k], which[k] = 1.0e300, -1
        for w in range(walls.shape[0]):
            n = (walls[w, at.WALL_NORMAL], walls[w, at.WALL_NORMAL + 1], walls[w, at.WALL_NORMAL + 2])
            gap = (
                qt.dot(n, center) - walls[w, at.WALL_OFFSET] - geo.support(shape, d, geo.scaled_normal(shape, d, R, n))
            )
            if gap < gaps[k]:
                gaps[k], which[k] = gap, w


@entry_kernel
def contact_spring_energies(state, params, shapes, walls, column, energies):
    """Write the energy of the contact springs of every row into `energies` (rows,) [J].

    Each feature with a gap g < 0 to a wall stores ½ k g². The stiffness k [N/m] is in column `column` of `params`.
    """
    for i in range(state.shape[0]):
        shape, energies[i] = shapes[i % shapes.shape[0]], 0.0
        point = (0.0, 0.0, 0.0)
        for w in range(walls.shape[0]):
            n = (walls[w, at.WALL_NORMAL], walls[w, at.WALL_NORMAL + 1], walls[w, at.WALL_NORMAL + 2])
            for feature in range(at.VERTEX_COUNT if shape == at.BLOCK else 1):
                point = feature_point(state, params, shape, n, i, feature)
                gap = min(qt.dot(n, point) - walls[w, at.WALL_OFFSET], 0.0)
                energies[i] += 0.5 * params[i, column] * gap * gap


@kernel
def feature_point(state, params, shape, n, i, feature):
    """World position [m] of a feature of row i at a wall of normal n.

    A block's features are its vertices 0 to 7. A sphere or an ellipsoid has the feature 0, its lowest point along n.
    """
    R = qt.to_matrix((state[i, at.QUAT], state[i, at.QUAT + 1], state[i, at.QUAT + 2], state[i, at.QUAT + 3]))
    d = (params[i, at.DIMENSIONS], params[i, at.DIMENSIONS + 1], params[i, at.DIMENSIONS + 2])
    if shape == at.BLOCK:
        b, c = geo.vertex_arm(d, R, feature), at.CENTER
        m = qt.matvec(R, (params[i, c], params[i, c + 1], params[i, c + 2]))
        r = (m[0] + b[0], m[1] + b[1], m[2] + b[2])
    else:
        r = geo.support_arm(shape, d, R, n, geo.scaled_normal(shape, d, R, n))
    return (state[i, at.POS] + r[0], state[i, at.POS + 1] + r[1], state[i, at.POS + 2] + r[2])


@entry_kernel
def contact_point(state, params, shapes, walls, i, wall, feature, out):
    """Write the world position [m] of a feature of row i at the given wall into `out` (3,), by `feature_point`."""
    n = (walls[wall, at.WALL_NORMAL], walls[wall, at.WALL_NORMAL + 1], walls[wall, at.WALL_NORMAL + 2])
    out[0], out[1], out[2] = feature_point(state, params, shapes[i % shapes.shape[0]], n, i, feature)
