"""Hard cases of effects that are too fast for a step: drag that stops a body within it, a spring stiff as a rod."""

from __future__ import annotations

import math
from collections.abc import Sequence

import physics
from physics.scene.canonical_scenes import GRAVITY
from rigid_env.hard_cases.case import Case, Check, Setting, none_of, within


def balloon(on: Setting) -> Sequence[Check]:
    """A balloon of 3 g and radius 0.14 m is thrown at 40 m/s: x = ln(1 + k v₀ t)/k, v = v₀/(1 + k v₀ t), k = ½ρCπr²/m.

    This solves m v' = -½ρCπr² v² (Rayleigh). With h λ = 2 h k v₀ = 4.7 at a step of 10 ms, the explicit midpoint rule
    would reverse and amplify the velocity. So the engine divides a step into parts that begin at h λ = ¼ and grow by
    half. Each part has v' = v/(1 + h k v), which is exact, and x = h (v + v')/2 with a relative error of (h k v)²/12.
    Limit: this is 1/768 of the first part's path, more for later parts, and at most 5 % for all of them.
    """
    radius, mass, v = 0.14, 0.003, 40.0
    drag = physics.Drag()
    k = 0.5 * drag.density * drag.coefficient * math.pi * radius**2 / mass
    scene = physics.Scene([physics.Sphere(radius, mass, linvel=(v, 0, 0))], effects=[drag])
    world = on.world(scene)
    before, faster, troubles = v, 0, 0
    for _ in range(on.steps(1.0)):
        report = world.step()
        troubles += not report.ok
        faster += not 0.0 < world.linvel[0, 0, 0] < before
        before = world.linvel[0, 0, 0]
    share = 1e-8 if on.is_event_driven else 0.05
    way, speed = math.log1p(k * v * world.time) / k, v / (1 + k * v * world.time)
    return [
        within("way after 1 s", world.pos[0, 0, 0], way, share * way, "m"),
        within("speed after 1 s", world.linvel[0, 0, 0], speed, share * speed, "m/s"),
        none_of("steps that make it faster, or turn it round", faster),
        none_of("steps with a report that is not OK", troubles),
    ]


def rod_like_spring(on: Setting) -> Sequence[Check]:
    """A pendulum on a spring of Ω = 3000 rad/s, released at 0.1 rad, swings like one on a rod, and gains no energy.

    The period of a pendulum is 2π √(l/g) (1 + θ₀²/16 + ...). No step of time stepping resolves this spring, and the
    report must say so. The force uses the mean of the lengths before and after a step (Gonzalez's discrete gradient),
    so that the spring keeps the energy. Limit: the midpoint rule swings with tan(hω'/2) = hω/2, too slowly by the share
    (hω)²/12. Half a step may be lost at the first and at the last crossing, since the spring's length oscillates.
    """
    length, mass, theta = 1.0, 1.0, 0.1
    rate = math.sqrt(GRAVITY / length)
    ball = physics.Sphere(0.05, mass, pos=(length * math.sin(theta), -length * math.cos(theta), 0))
    spring = physics.Spring(stiffness=9e6, length=length)
    scene = physics.Scene([ball], effects=[physics.Gravity((0, -GRAVITY, 0)), spring])
    world = on.world(scene)
    start, gain, untold, crossings, before = physics.diagnose(world).energy[0, 0], -math.inf, 0, [], ball.pos[0]
    for k in range(on.steps(on.pick(10.0, 5.0))):
        untold += world.step().ok and not on.is_event_driven
        gain = max(gain, physics.diagnose(world).energy[0, 0] - start)
        now = world.pos[0, 0, 0]
        if before > 0 >= now:
            crossings.append((k + 1 - now / (now - before)) * on.dt)
        before = now
    period = (crossings[-1] - crossings[0]) / (len(crossings) - 1)
    true = 2 * math.pi / rate * (1 + theta**2 / 16)
    loose = (rate * on.dt) ** 2 / 12 * true + on.dt * (rate * on.dt) ** 2 + 1e-3 * true
    depth = mass * GRAVITY * length * (1 - math.cos(theta))
    return [
        within("period", period, true, loose, "s"),
        Check("energy gained, by that of the swing", gain / depth, 1e-6 if on.is_event_driven else 1e-2),
        none_of("steps that do not say that the spring is not resolved", untold),
    ]


CASES = (
    Case(48, "balloon", "3 g balloon thrown at 40 m/s", "x = ln(1 + k v₀ t)/k; no step makes it faster", balloon),
    Case(
        49, "rod-like-spring", "pendulum on a spring that no step resolves",
        "swings with 2π √(l/g), gains no energy, and the report says so", rod_like_spring,
    ),
)  # fmt: skip
