"""Batches of up to four contacts of the same two bodies, for methods with a linear system.

Two blocks that touch with a face have several contacts. All of them need the same computation, and their effects on the
bodies add up. So a batch does the computation for its contacts at once, one in each lane of `Lanes`. It reads the
bodies' twists once, and sums forces, moments and blocks of the system before it writes them. Lanes that are left over
repeat the last contact with the weight 0.

When an island is prepared, the data of its contacts are copied into the batches. Field f of batch g is
`many.newton.lanes[g, 4 f : 4 f + 4]`, one number for each contact.
"""

from __future__ import annotations

from physics.compiler.decorators import if_given, inlined, kernel
from physics.compiler.simd import (
    LANE_COUNT,
    Lanes,
    lane_sqrt,
    lane_sum,
    larger,
    load_lanes,
    select_lanes,
    smaller,
    store_lanes,
)
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.arrays import NUM_BATCHES
from physics.kernels.multibody.data.contact_set import put_vector
from physics.kernels.multibody.solver.block_lu import find_block_index
from physics.kernels.multibody.solver.contact_operator import apply_body_inv_inertia

# Columns of `many.newton.batch`: first and second body (-1 - k: wall k), index of their off-diagonal blocks, 1 if the
# first body is eliminated before the second; position of the first contact in `many.islands.contacts`, number of
# contacts.
BATCH_BODY_A, BATCH_BODY_B, BATCH_BLOCK, BATCH_IS_A_FIRST, BATCH_START, BATCH_COUNT = range(6)

# Fields of a contact: arms from both bodies, frame, target, μ, W_nn, `ContactSet.step`, weight (1, or 0 in a spare
# lane).
LANE_ARM, LANE_FRAME, LANE_TARGET, LANE_MU, LANE_W_NN, LANE_STEP, LANE_WEIGHT = 0, 6, 15, 18, 19, 20, 21

# Fields of `interior_point`: diagonal of S (normal, tangents), p̂, û.
IPM_UNIT, IPM_IMPULSE, IPM_VELOCITY = 22, 24, 27

# Fields of one iteration of `interior_point`: scaling (w, η), λ, 1/√det λ, direction of slip, residual of û, corrector,
# changes W dp̂ and dû.
(
    IPM_SCALING,
    IPM_LAMBDA,
    IPM_INV_ROOT_DET,
    IPM_SLIP_DIRECTION,
    IPM_RESIDUAL,
    IPM_CORRECTION,
    IPM_IMPULSE_STEP,
    IPM_VELOCITY_STEP,
) = 30, 34, 37, 38, 40, 43, 46, 49

# Fields of `proximal_newton`, which share the memory of those above: impulses q, the best of them, q - ρ u, p(x).
PROX_IMPULSE, PROX_BEST, PROX_ARGUMENT, PROX_PROJECTED = 30, 33, 36, 39


# Compliance γ of a compliant contact. It has memory of `interior_point`, which takes rigid contacts only.
LANE_GIVE = IPM_UNIT


@inlined
def batch_field(g, field, many):
    """Read a field of batch g: four numbers, one for each contact."""
    return load_lanes(many.newton.lanes, g, LANE_COUNT * field)


@inlined
def put_batch_field(g, field, x, many):
    """Write the four numbers x to a field of batch g."""
    store_lanes(many.newton.lanes, g, LANE_COUNT * field, x)


@inlined
def batch_vector(g, field, many):
    """Read a vector of each contact of batch g, from three fields: components of four numbers each."""
    return batch_field(g, field, many), batch_field(g, field + 1, many), batch_field(g, field + 2, many)


@inlined
def put_batch_vector(g, field, a, many):
    """Write the vector a of each contact, with components of four numbers each, to three fields of batch g."""
    put_batch_field(g, field, a[0], many)
    put_batch_field(g, field + 1, a[1], many)
    put_batch_field(g, field + 2, a[2], many)


@inlined
def batch_frames(g, many):
    """Contact frames of the contacts of batch g, row by row: nine entries of four numbers each."""
    n, s, t = (
        batch_vector(g, LANE_FRAME, many),
        batch_vector(g, LANE_FRAME + 3, many),
        batch_vector(g, LANE_FRAME + 6, many),
    )
    return (n[0], n[1], n[2], s[0], s[1], s[2], t[0], t[1], t[2])


@if_given("many.compliance")
def _fill_give(g, lane, k, many):
    many.newton.lanes[g, LANE_COUNT * LANE_GIVE + lane] = many.compliance.give[k]


@inlined
def _fill_batch(g, i, n, many):
    """Copy the data of the n contacts from position i of `many.islands.contacts` on into batch g."""
    L = many.newton.lanes
    for lane in range(LANE_COUNT):
        k = many.islands.contacts[i + min(lane, n - 1)]
        for c in range(6):
            L[g, LANE_COUNT * (LANE_ARM + c) + lane] = many.contacts.arm[k, c]
        for c in range(9):
            L[g, LANE_COUNT * (LANE_FRAME + c) + lane] = many.contacts.frame[k, c]
        for c in range(3):
            L[g, LANE_COUNT * (LANE_TARGET + c) + lane] = many.contacts.target[k, c]
        L[g, LANE_COUNT * LANE_MU + lane], L[g, LANE_COUNT * LANE_W_NN + lane] = (
            many.contacts.mu[k],
            many.contacts.block[k, 0],
        )
        _fill_give(g, lane, k, many)
        L[g, LANE_COUNT * LANE_STEP + lane], L[g, LANE_COUNT * LANE_WEIGHT + lane] = (
            many.contacts.step[k],
            1.0 if lane < n else 0.0,
        )


@kernel
def batch_contacts(first, last, many):
    """Sort the contacts `many.islands.contacts[first:last]` of an island into batches; return False if room is short.

    The bodies of the island must be ordered for elimination (`minimum_degree.order_elimination`).
    """
    count, i = 0, first
    while i < last:
        a, b = many.contacts.bodies[many.islands.contacts[i], 0], many.contacts.bodies[many.islands.contacts[i], 1]
        n = 1
        while n < LANE_COUNT and i + n < last:
            k = many.islands.contacts[i + n]
            if many.contacts.bodies[k, 0] != a or many.contacts.bodies[k, 1] != b:
                break
            n += 1
        if count == many.newton.batch.shape[0]:
            return False
        batch = many.newton.batch
        (
            batch[count, BATCH_BODY_A],
            batch[count, BATCH_BODY_B],
            batch[count, BATCH_START],
            batch[count, BATCH_COUNT],
        ) = a, b, i, n
        if b >= 0:
            is_first = many.system.rank[a] < many.system.rank[b]
            batch[count, BATCH_IS_A_FIRST] = 1 if is_first else 0
            batch[count, BATCH_BLOCK] = find_block_index(a, b, many) if is_first else find_block_index(b, a, many)
        _fill_batch(count, i, n, many)
        count += 1
        i += n
    many.counts[NUM_BATCHES] = count
    return True


@inlined
def gather_batch(g, rows, many):
    """Read the vectors of the contacts of batch g from an array with a row for each contact of the set."""
    i, n = many.newton.batch[g, BATCH_START], many.newton.batch[g, BATCH_COUNT]
    j, k = many.islands.contacts[i], many.islands.contacts[i + min(1, n - 1)]
    l, m = many.islands.contacts[i + min(2, n - 1)], many.islands.contacts[i + n - 1]
    return (
        Lanes(rows[j, 0], rows[k, 0], rows[l, 0], rows[m, 0]),
        Lanes(rows[j, 1], rows[k, 1], rows[l, 1], rows[m, 1]),
        Lanes(rows[j, 2], rows[k, 2], rows[l, 2], rows[m, 2]),
    )


@inlined
def scatter_batch(g, a, rows, many):
    """Write the vectors a of the contacts of batch g to an array with a row for each contact of the set."""
    i, n = many.newton.batch[g, BATCH_START], many.newton.batch[g, BATCH_COUNT]
    for lane in range(n):
        put_vector(rows, many.islands.contacts[i + lane], 0, (a[0][lane], a[1][lane], a[2][lane]))


@inlined
def _point_velocity(b, r, t, spin):
    """Velocities v + ω x r of body b at four points with arms r, from twists t with ω from column `spin` on [m/s]."""
    m = qt.cross(row_vector(t, b, spin), r)
    return (t[b, 0] + m[0], t[b, 1] + m[1], t[b, 2] + m[2])


@inlined
def batch_velocity(g, t, spin, many):
    """Relative velocities at the contacts of batch g, in their frames, for the bodies' twists t [m/s].

    In t, ω begins at column `spin`.
    """
    a, b = many.newton.batch[g, BATCH_BODY_A], many.newton.batch[g, BATCH_BODY_B]
    u = _point_velocity(a, batch_vector(g, LANE_ARM, many), t, spin)
    if b >= 0:
        v = _point_velocity(b, batch_vector(g, LANE_ARM + 3, many), t, spin)
        u = (u[0] - v[0], u[1] - v[1], u[2] - v[2])
    return qt.matvec(batch_frames(g, many), u)


@inlined
def batch_velocity_error(g, many):
    """Velocities at the contacts of batch g minus their targets, in their frames [m/s]."""
    u, t = batch_velocity(g, many.bodies.twist, 3, many), batch_vector(g, LANE_TARGET, many)
    return (u[0] - t[0], u[1] - t[1], u[2] - t[2])


@inlined
def _apply_body_impulse(b, f, m, sign, t, spin, many):
    """Change the twist of body b in t, with ω from column `spin` on, by sign times the impulse f and moment m.

    f and m are in the world frame [N s, N m s].
    """
    w, s = apply_body_inv_inertia(b, m, many), sign * many.bodies.inv_mass[b]
    put_vector(t, b, 0, (t[b, 0] + s * f[0], t[b, 1] + s * f[1], t[b, 2] + s * f[2]))
    put_vector(t, b, spin, (t[b, spin] + sign * w[0], t[b, spin + 1] + sign * w[1], t[b, spin + 2] + sign * w[2]))


@inlined
def _sum_lanes(a):
    return (lane_sum(a[0]), lane_sum(a[1]), lane_sum(a[2]))


@inlined
def apply_batch_impulse(g, p, t, spin, many):
    """Change the twists t of both bodies of batch g by the contacts' impulses p, given in their frames [N s].

    In t, ω begins at column `spin`.
    """
    on, a, b = batch_field(g, LANE_WEIGHT, many), many.newton.batch[g, BATCH_BODY_A], many.newton.batch[g, BATCH_BODY_B]
    p = qt.transposed_matvec(batch_frames(g, many), (on * p[0], on * p[1], on * p[2]))
    f = _sum_lanes(p)
    _apply_body_impulse(a, f, _sum_lanes(qt.cross(batch_vector(g, LANE_ARM, many), p)), 1.0, t, spin, many)
    if b >= 0:
        _apply_body_impulse(b, f, _sum_lanes(qt.cross(batch_vector(g, LANE_ARM + 3, many), p)), -1.0, t, spin, many)


@inlined
def planar_length(x, y):
    """Length √(x² + y²) of the vectors (x, y)."""
    return lane_sqrt(x * x + y * y)


@inlined
def project_on_disks(x, y, limit):
    """Vectors (x, y), shortened to the length `limit` if they are longer."""
    size = planar_length(x, y)
    s = select_lanes(size > limit, limit / size, 1.0)
    return s * x, s * y


@inlined
def batch_residuals(g, p, u, many):
    """Natural-map residuals of the contacts of batch g, for impulses p and velocity errors u [m/s].

    They are those of `contact_operator.natural_map_residual`.
    """
    step, mu = batch_field(g, LANE_STEP, many), batch_field(g, LANE_MU, many)
    x, y = project_on_disks(p[1] - step * u[1], p[2] - step * u[2], mu * larger(p[0], 0.0))
    tangential = planar_length(p[1] - x, p[2] - y) / step
    return larger(abs(smaller(u[0], p[0] * batch_field(g, LANE_W_NN, many))), tangential)
