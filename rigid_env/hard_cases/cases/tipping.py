"""Hard cases of tipping: on an incline, by a push, balance on an edge and on a vertex, rocking."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import physics
from physics.scene.canonical_scenes import GRAVITY, MASS, SIZE
from rigid_env.hard_cases.case import Case, Check, Setting, none_of, within
from rigid_env.hard_cases.cases.scenery import (
    EPS,
    angle_to,
    attitude,
    block,
    energy,
    on_floor,
    tilt_about_z,
    turned,
    wrench,
)

ROUGH = 2.0  # friction coefficient for cases in which a body must tip without sliding
TRUTH = 1e-11  # relative tolerance of DOP853 for the equations of motion


def pendulum(angle: float, rate: float, duration: float) -> float:
    """Angle from the vertical after `duration` [s] of a body that tips from rest at `angle`: φ̈ = rate² sinφ."""
    run = solve_ivp(
        lambda t, y: (y[1], rate * rate * math.sin(y[0])), (0.0, duration), (angle, 0.0), "DOP853", rtol=TRUTH,
        atol=1e-3 * TRUTH * abs(angle),
    )  # fmt: skip
    return float(run.y[0, -1])


def _slack(on: Setting, rate: float, duration: float) -> float:
    """Allowed relative error, after `duration` [s], of an angle that grows at `rate` [1/s].

    The midpoint step replaces e^(λh) by (1 + λh/2)/(1 - λh/2) or, with positions drifting on either side of it, by
    exp(2 asinh(λh/2)). This corresponds to the rates λ (1 + (λh)²/12) and λ (1 - (λh)²/24). After the time T an angle
    is off by at most (λh)² λT/12, and by (λh)²/2 for the first step, in which only the velocity changes. For the
    event-driven scheme the limit is a hundred steps of the tolerance each.
    """
    if on.is_event_driven:
        return 100 * on.tolerance
    h = rate * on.dt
    return h * h * (rate * duration / 12 + 0.5)


def tips_on_incline(on: Setting) -> Sequence[Check]:
    """The block stands upright on a rough incline: it tips over its lower edge iff tanθ > b/h.

    The case runs 1 % below and above. Above the limit the block rotates about the edge like an inverted pendulum of the
    length R = √(b² + h²): φ̈ = λ² sinφ, λ² = m g R/I. It starts where the line of its weight passes the edge by θ -
    atan(b/h).
    """
    b, h, time = SIZE[1] / 2, SIZE[0] / 2, 1.5
    upright, reach = turned(math.pi / 2), math.hypot(b, h)
    rate = math.sqrt(MASS * GRAVITY * reach / (block().inertia[2, 2] + MASS * reach * reach))
    found = []
    for share in (0.99, 1.01):
        angle = math.atan(share * b / h)
        pull = (-GRAVITY * math.sin(angle), -GRAVITY * math.cos(angle), 0.0)
        world = on.world(on_floor(block((0, h, 0), quat=upright), friction=ROUGH, gravity=pull))
        world.step(steps=on.steps(time))
        found.append(angle_to(world, upright))
    beyond = angle - math.atan(b / h)
    truth = pendulum(beyond, rate, world.time) - beyond
    # Settling within a slop may rotate the block before it starts to tip: the same share of `beyond`.
    limit = (_slack(on, rate, world.time) + 4 * on.slop * reach / b / beyond) * (truth + beyond)
    return [
        Check("turn, tanθ 1 % below b/h", found[0], 4 * on.slop * reach / b, "rad"),
        within("turn after 1.5 s, 1 % above", found[1], truth, limit, "rad"),
    ]


def tips_when_pushed(on: Setting) -> Sequence[Check]:
    """The block is pushed at height z: it tips before sliding iff μ > b/z.

    The push is 1 % above the smaller of two limits: sliding starts at F = μ m g, tipping about the far edge at F z = m
    g b. A sliding block has a = F/m - μ g. A block
    that has tipped by α about the edge has I_e α̈ = F y + F (z - h) - m g x. Here F acts at the centre with the
    additional moment F (z - h), and the centre is at (x, y) = (b cosα - h sinα, h cosα + b sinα) from the edge.
    """
    half_width, h, time = SIZE[0] / 2, SIZE[1] / 2, 1.0
    z, weight = 2.9, MASS * GRAVITY
    bound = half_width / z
    turn, way = {}, {}
    for share in (0.97, 1.03):
        mu = share * bound
        force = 1.01 * min(mu, bound) * weight
        world = on.world(on_floor(block(), friction=mu))
        load = wrench((force, 0, 0), (0, 0, -force * (z - h)))
        for _ in range(on.steps(time)):
            world.step(load)
        turn[share], way[share] = -tilt_about_z(world), world.pos[0, 0, 0]
        if share < 1:
            slide = 0.5 * (force / MASS - mu * GRAVITY) * world.time**2
    tip = _pushed_over(force, z, world.time)
    edge = block().inertia[2, 2] + MASS * (half_width**2 + h**2)
    rate = math.sqrt(weight * math.hypot(half_width, h) / edge)
    loose = (2 * on.tolerance * GRAVITY + 64 * EPS) * world.time**2
    settled = 4 * on.slop * math.hypot(half_width, h) / half_width
    return [
        within("way after 1 s, μ 3 % below b/z: slides", way[0.97], slide, loose, "m"),
        Check("turn, μ 3 % below b/z", abs(turn[0.97]), settled, "rad"),
        within("turn after 1 s, μ 3 % above: tips", turn[1.03], tip, _slack(on, rate, time) * tip + settled, "rad"),
    ]


def _pushed_over(force: float, z: float, duration: float) -> float:
    """Tipping angle after `duration` [s] of the block pushed with `force` [N] at height z [m], integrated [rad]."""
    b, h = SIZE[0] / 2, SIZE[1] / 2
    inertia = block().inertia[2, 2] + MASS * (b * b + h * h)

    def motion(t, state):
        c, s = math.cos(state[0]), math.sin(state[0])
        x, y = b * c - h * s, h * c + b * s
        return state[1], (force * (y + z - h) - MASS * GRAVITY * x) / inertia

    return float(solve_ivp(motion, (0, duration), (0.0, 0.0), "DOP853", rtol=TRUTH, atol=1e-15).y[0, -1])


def on_edge(on: Setting) -> Sequence[Check]:
    """A cube of edge a stands on its edge, θ₀ from balance: θ̈ = λ² sinθ, λ² = 3 g/(2√2 a), and it always falls.

    About the edge I = (2/3) m a², and the centre is at R = a/√2. From 1e-4 and 1e-2 rad the angle grows by cosh(λT).
    From ten offsets up to 40 degrees the cube must lie on a face in the end, within the slop.
    """
    a, mass = 1.0, 1.0
    rate = math.sqrt(3 * GRAVITY / (2 * math.sqrt(2) * a))
    checks = []
    for offset in (1e-4, 1e-2):
        duration = math.floor(math.acosh(0.3 / offset) / rate / on.dt) * on.dt
        world = on.world(on_floor(_cube_on_edge(offset, a, mass), friction=ROUGH))
        world.step(steps=round(duration / on.dt))
        found = tilt_about_z(world) - math.pi / 4
        truth = pendulum(offset, rate, world.time)
        limit = (_slack(on, rate, world.time) + 4 * on.slop / offset) * truth
        checks.append(within(f"angle grown from {offset:g} rad", found, truth, limit, "rad"))
    stands = 0
    for degrees in (0.01, 1, 5, 13, 20, 26, 32, 35, 38, 40):
        world = on.world(on_floor(_cube_on_edge(math.radians(degrees), a, mass), friction=ROUGH))
        world.step(steps=on.steps(10.0))
        flat = abs(math.remainder(tilt_about_z(world), math.pi / 2))
        stands += flat > 8 * on.slop + 1e-9 or np.abs(world.angvel[0, 0]).max() > 1e-6
    return [*checks, none_of("offsets, 0.01 to 40 degrees, from which it lies on no face after 10 s", stands)]


def _cube_on_edge(offset: float, a: float, mass: float, **start) -> physics.Block:
    angle = math.pi / 4 + offset
    return physics.Block(
        (a, a, a), mass, pos=(0, 0.5 * a * (math.sin(angle) + math.cos(angle)), 0), quat=turned(angle), **start
    )


def on_vertex(on: Setting) -> Sequence[Check]:
    """A cube stands on a vertex: after a drop it gets no spin, in balance it stays, after a nudge it falls.

    The normal force passes through the centre. So there is no moment but that of rounding, ε a, which grows by cosh(λT)
    once the cube stands. About the vertex I = (11/12) m a² perpendicular to the diagonal, and the centre is at R =
    (√3/2) a: λ² = m g R/I. Nudged by 1e-3 rad about a horizontal axis, the angle grows by cosh(λT) as long as it is
    small; then the cube falls on a face.
    """
    a, mass, nudge = 1.0, 1.0, 1e-3
    reach = math.sqrt(3) / 2 * a
    rate = math.sqrt(mass * GRAVITY * reach / (11 / 12 * mass * a * a))
    time = on.steps(1.5) * on.dt
    spin = 0.0
    dropped = on.world(on_floor(_cube_on_vertex(0.0, a, mass, 1.0), 0.5, ROUGH))
    for _ in range(on.steps(1.2)):  # three or four bounces, the first after 0.45 s
        dropped.step()
        spin = max(spin, np.abs(dropped.angvel[0, 0]).max())
    still = on.world(on_floor(_cube_on_vertex(0.0, a, mass), 0.0, ROUGH))
    still.step(steps=round(time / on.dt))
    nudged = on.world(on_floor(_cube_on_vertex(nudge, a, mass), 0.0, ROUGH))
    nudged.step(steps=round(time / on.dt))
    diagonal = attitude(nudged) @ np.ones(3) / math.sqrt(3)
    angle = math.acos(min(1.0, abs(diagonal[1])))
    truth = pendulum(nudge, rate, time)
    limit = (_slack(on, rate, time) + 4 * on.slop / nudge) * truth
    nudged.step(steps=on.steps(10.0))
    down = np.abs(attitude(nudged)[1]).max()
    return [
        # Rounded contact points of size a give e v m a ε each of some bounces; I = m a²/6.
        Check("spin after bounces on the vertex", spin, 200 * EPS * math.sqrt(2 * GRAVITY) / a, "rad/s"),
        Check("turn of the balanced cube", angle_to(still, _upright()), 64 * EPS * math.cosh(rate * time), "rad"),
        within("angle of the nudged cube after 1.5 s", angle, truth, limit, "rad"),
        none_of("after 10 s more it lies on no face", abs(down - 1) > 1e-6),
    ]


def _upright() -> tuple:
    """Quaternion (4,), w first, of the attitude with the body's diagonal (1, 1, 1) along world y."""
    axis = np.cross((1, 1, 1), (0, 1, 0))
    return turned(math.acos(1 / math.sqrt(3)), axis)


def _cube_on_vertex(nudge: float, a: float, mass: float, height: float = 0.0) -> physics.Block:
    w, x, y, z = _upright()
    upright = Rotation.from_quat([x, y, z, w])
    attitude = Rotation.from_rotvec([0, 0, nudge]) * upright
    x, y, z, w = attitude.as_quat()
    lowest = np.abs(attitude.as_matrix()[1]).sum() * 0.5 * a
    return physics.Block((a, a, a), mass, pos=(0, lowest + height, 0), quat=(w, x, y, z))


def housner(on: Setting) -> Sequence[Check]:
    """A block released on one of its edges rocks, e = 0: ω⁺/ω⁻ = 1 - (3/2) sin²α, T = (4/p) acosh(1/(1 - θ₀/α)).

    Housner, *The behavior of inverted pendulum structures during earthquakes*, Bull. Seism. Soc. Am. 53, 1963. This T
    is for small α; here θ̈ = -p² sin(α - θ) with p² = 3 g/(4 R) is integrated. The block passes θ = 0 after a quarter
    of the first period, then after half of the second. The amplitude θ₁ of the second obeys cos(α - θ₁) - cosα =
    (ω⁺/ω⁻)² (cos(α - θ₀) - cosα). The ratio follows from angular momentum about the new edge, which the impact keeps.

    The ratio is measured by the energy above that of standing, which is proportional to ω². Times are measured by the
    parabola through the last angle, θ + ω τ - p² sin(α - θ) τ²/2, with an error of p² dt³/6.
    """
    b, h = 0.25, 1.0
    alpha, reach = math.atan(b / h), math.hypot(b, h)
    p2, start = 3 * GRAVITY / (4 * reach), 0.5 * math.atan(b / h)
    scene = on_floor(physics.Block((2 * b, 2 * h, 1.0), 1.0, pos=_on_edge(start, b, h), quat=turned(start)), 0.0, ROUGH)
    world = on.world(scene)
    ratio = 1 - 1.5 * math.sin(alpha) ** 2
    apex = alpha - math.acos(math.cos(alpha) + ratio**2 * (math.cos(alpha - start) - math.cos(alpha)))
    first = _time_to_upright(start, alpha, p2)
    second = first + 2 * _time_to_upright(apex, alpha, p2)
    times, energies = [], [energy(world, scene) - GRAVITY * h]
    while len(times) < 2 and world.time < 2 * second:
        angle, rate, t = tilt_about_z(world), world.angvel[0, 0, 2], world.time
        world.step()
        if angle * tilt_about_z(world) < 0:
            times.append(t + _to_zero(abs(angle), abs(rate), p2 * math.sin(alpha - abs(angle))))
            world.step()
            energies.append(energy(world, scene) - GRAVITY * h)
    times += [math.nan] * (2 - len(times))
    found = math.sqrt(energies[1] / energies[0]) if len(energies) > 1 else math.nan
    loose = 100 * on.tolerance if on.is_event_driven else p2 * on.dt**2
    seen = p2 * on.dt**3 / 6
    return [
        within("time to the first impact", times[0], first, loose * first + seen, "s"),
        within("ω⁺/ω⁻", found, ratio, loose),
        within("time to the second impact", times[1], second, loose * second + seen, "s"),
    ]


def _to_zero(angle: float, rate: float, slowing: float) -> float:
    """Time τ at which angle - rate τ - slowing τ²/2 is 0 [s]."""
    return 2 * angle / (rate + math.sqrt(rate * rate + 2 * slowing * angle))


def _time_to_upright(angle: float, alpha: float, p2: float) -> float:
    """Quarter of the period of a rocking block released at `angle` [s]; `alpha` and `p2` are α and p² of `housner`."""

    def is_upright(t, y):
        return y[0]

    is_upright.terminal = True
    run = solve_ivp(
        lambda t, y: (y[1], -p2 * math.sin(alpha - y[0])), (0, 100), (angle, 0.0), "DOP853", rtol=TRUTH, atol=1e-14,
        events=is_upright,
    )  # fmt: skip
    return float(run.t_events[0][0])


def _on_edge(theta: float, b: float, h: float) -> tuple[float, float, float]:
    """Centre (3,) of a block with half edges b and h [m], rotated by `theta` about its lower left edge at (-b, 0)."""
    c, s = math.cos(theta), math.sin(theta)
    return (-b + b * c - h * s, b * s + h * c, 0.0)


CASES = (
    Case(18, "tips-on-incline", "upright on an incline", "tips iff tanθ > b/h", tips_on_incline, peers=True),
    Case(19, "tips-when-pushed", "pushed at height z", "tips before sliding iff μ > b/z", tips_when_pushed),
    Case(
        21, "on-edge", "cube on its edge, offset θ₀", "θ grows with λ² = 3g/(2√2 a); it falls from any offset",
        on_edge, peers=True,
    ),
    Case(22, "on-vertex", "cube on a vertex", "symmetric it stays so; nudged it falls", on_vertex, peers=True),
    Case(
        23, "rocking-block", "rocking block (Housner)", "ω⁺/ω⁻ = 1 - (3/2)sin²α; times of impacts", housner,
        peers=True,
    ),
)  # fmt: skip
