"""Bundles: up to four contacts of the same two bodies, a lane each, for the methods with a linear system.

Two blocks touch with a face, and what is asked of its contacts is the same for each of them; what they do to their
bodies is a sum. So twists are read once for four contacts, and forces, moments and blocks of the system are summed
before anything is written. A lane that is left over repeats the last contact, and weighs nothing.

What is known of contacts is copied here, with the bodies' block of the system, when an island is prepared: field f of a
bundle is `many.lanes[g, 4 f : 4 f + 4]`.
"""

from __future__ import annotations

from physics.kernels.compile.decorators import inlined, kernel
from physics.kernels.compile.simd import WIDTH, Lanes, chosen, larger, put_row, root, row, smaller, total
from physics.kernels.math import quaternion as qt
from physics.kernels.multibody.data.arrays import BUNDLES
from physics.kernels.multibody.data.contact_set import put, vector
from physics.kernels.multibody.solver.block_lu import place_of
from physics.kernels.multibody.solver.contact_operator import turned

# Columns of `many.bundle`: first and second body (b < 0: wall), place of their block, whether the first body is
# eliminated before the second; first contact in `many.queue`, and how many.
FIRST, SECOND, PLACE, IS_FIRST, BEGIN, COUNT = range(6)

# Fields of a contact: arms from both bodies, frame, target, μ, W_nn and step of its block, 1 or 0 for what it weighs.
ARM, FRAME, TARGET, MU, NORMAL, STEP, WEIGHT = 0, 6, 15, 18, 19, 20, 21

# Of `interior_point`: diagonal of S (normal, tangents), p̂, û.
UNIT, INSIDE, SLACK = 22, 24, 27

# What `interior_point` needs while it runs: scaling (w, η), λ, 1/√det λ, direction of slip, what û misses, what is
# added to p̂, changes of both.
SCALING, OWN, INVERSE, SLIP, MISS, EXTRA, CHANGE, SLACK_CHANGE = 30, 34, 37, 38, 40, 43, 46, 49

# What `proximal_newton` needs, in the same place: impulses q, the best of them, q - ρ u, p(x).
IMPULSE, SAVED, AIM, TRIAL = 30, 33, 36, 39


@inlined
def one(g, field, many):
    """A field of bundle g."""
    return row(many.lanes, g, WIDTH * field)


@inlined
def put_one(g, field, x, many):
    """Write a field of bundle g."""
    put_row(many.lanes, g, WIDTH * field, x)


@inlined
def three(g, field, many):
    """Three fields of bundle g: of each contact a vector."""
    return one(g, field, many), one(g, field + 1, many), one(g, field + 2, many)


@inlined
def put_three(g, field, a, many):
    """Write three fields of bundle g."""
    put_one(g, field, a[0], many)
    put_one(g, field + 1, a[1], many)
    put_one(g, field + 2, a[2], many)


@inlined
def frame_of(g, many):
    """Frames of the contacts of bundle g, row by row."""
    n, s, t = three(g, FRAME, many), three(g, FRAME + 3, many), three(g, FRAME + 6, many)
    return (n[0], n[1], n[2], s[0], s[1], s[2], t[0], t[1], t[2])


@inlined
def _bind(g, i, n, many):
    """Copy what is known of the n contacts from place i of the queue on into bundle g."""
    L = many.lanes
    for lane in range(WIDTH):
        k = many.queue[i + min(lane, n - 1)]
        for c in range(6):
            L[g, WIDTH * (ARM + c) + lane] = many.arm[k, c]
        for c in range(9):
            L[g, WIDTH * (FRAME + c) + lane] = many.frame[k, c]
        for c in range(3):
            L[g, WIDTH * (TARGET + c) + lane] = many.target[k, c]
        L[g, WIDTH * MU + lane], L[g, WIDTH * NORMAL + lane] = many.mu[k], many.block[k, 0]
        L[g, WIDTH * STEP + lane], L[g, WIDTH * WEIGHT + lane] = many.step[k], 1.0 if lane < n else 0.0


@kernel
def bundle_contacts(first, last, many):
    """Bundle the contacts `many.queue[first:last]` of an island whose bodies are ordered; whether there was room."""
    count, i = 0, first
    while i < last:
        a, b = many.ends[many.queue[i], 0], many.ends[many.queue[i], 1]
        n = 1
        while n < WIDTH and i + n < last:
            k = many.queue[i + n]
            if many.ends[k, 0] != a or many.ends[k, 1] != b:
                break
            n += 1
        if count == many.bundle.shape[0]:
            return False
        bundle = many.bundle
        bundle[count, FIRST], bundle[count, SECOND], bundle[count, BEGIN], bundle[count, COUNT] = a, b, i, n
        if b >= 0:
            is_first = many.rank[a] < many.rank[b]
            bundle[count, IS_FIRST] = 1 if is_first else 0
            bundle[count, PLACE] = place_of(a, b, many) if is_first else place_of(b, a, many)
        _bind(count, i, n, many)
        count += 1
        i += n
    many.counts[BUNDLES] = count
    return True


@inlined
def gather(g, rows, many):
    """Vectors of the contacts of bundle g from an array with a row for each contact."""
    i, n = many.bundle[g, BEGIN], many.bundle[g, COUNT]
    j, k = many.queue[i], many.queue[i + min(1, n - 1)]
    l, m = many.queue[i + min(2, n - 1)], many.queue[i + n - 1]
    return (
        Lanes(rows[j, 0], rows[k, 0], rows[l, 0], rows[m, 0]),
        Lanes(rows[j, 1], rows[k, 1], rows[l, 1], rows[m, 1]),
        Lanes(rows[j, 2], rows[k, 2], rows[l, 2], rows[m, 2]),
    )


@inlined
def scatter(g, a, rows, many):
    """Write vectors of the contacts of bundle g to an array with a row for each contact."""
    i, n = many.bundle[g, BEGIN], many.bundle[g, COUNT]
    for lane in range(n):
        put(rows, many.queue[i + lane], 0, (a[0][lane], a[1][lane], a[2][lane]))


@inlined
def _point_velocity(b, r, t, spin):
    """v + ω x r of body b for points r."""
    m = qt.cross(vector(t, b, spin), r)
    return (t[b, 0] + m[0], t[b, 1] + m[1], t[b, 2] + m[2])


@inlined
def velocity_along(g, t, spin, many):
    """Relative velocities of the contacts of bundle g in their frames for twists t, ω from column `spin` [m/s]."""
    a, b = many.bundle[g, FIRST], many.bundle[g, SECOND]
    u = _point_velocity(a, three(g, ARM, many), t, spin)
    if b >= 0:
        v = _point_velocity(b, three(g, ARM + 3, many), t, spin)
        u = (u[0] - v[0], u[1] - v[1], u[2] - v[2])
    return qt.matvec(frame_of(g, many), u)


@inlined
def velocity_missed(g, many):
    """u of the contacts of bundle g less their targets."""
    u, t = velocity_along(g, many.twist, 3, many), three(g, TARGET, many)
    return (u[0] - t[0], u[1] - t[1], u[2] - t[2])


@inlined
def _push_one(b, f, m, sign, t, spin, many):
    """Change the twist of body b in t by an impulse and a moment."""
    w, s = turned(b, m, many), sign * many.lightness[b]
    put(t, b, 0, (t[b, 0] + s * f[0], t[b, 1] + s * f[1], t[b, 2] + s * f[2]))
    put(t, b, spin, (t[b, spin] + sign * w[0], t[b, spin + 1] + sign * w[1], t[b, spin + 2] + sign * w[2]))


@inlined
def _sums(a):
    return (total(a[0]), total(a[1]), total(a[2]))


@inlined
def push(g, p, t, spin, many):
    """Change the twists t of both bodies by impulses of the contacts of bundle g, given in their frames [N s]."""
    on, a, b = one(g, WEIGHT, many), many.bundle[g, FIRST], many.bundle[g, SECOND]
    p = qt.transposed_matvec(frame_of(g, many), (on * p[0], on * p[1], on * p[2]))
    f = _sums(p)
    _push_one(a, f, _sums(qt.cross(three(g, ARM, many), p)), 1.0, t, spin, many)
    if b >= 0:
        _push_one(b, f, _sums(qt.cross(three(g, ARM + 3, many), p)), -1.0, t, spin, many)


@inlined
def length(x, y):
    """√(x² + y²)."""
    return root(x * x + y * y)


@inlined
def on_disks(x, y, limit):
    """(x, y), shortened to `limit` where it is longer."""
    size = length(x, y)
    s = chosen(size > limit, limit / size, 1.0)
    return s * x, s * y


@inlined
def misses(g, p, u, many):
    """Natural-map residuals of the contacts of bundle g for impulses p and velocities u; see `contact_operator`."""
    step, mu = one(g, STEP, many), one(g, MU, many)
    x, y = on_disks(p[1] - step * u[1], p[2] - step * u[2], mu * larger(p[0], 0.0))
    tangential = length(p[1] - x, p[2] - y) / step
    return larger(abs(smaller(u[0], p[0] * one(g, NORMAL, many))), tangential)
