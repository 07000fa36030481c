"""Hard cases of rolling: a sphere that starts to roll, a disk on its rim."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

import physics
from physics.scenes import GRAVITY
from rigid_env.hard_cases.case import Case, Check, Setting, within
from rigid_env.hard_cases.scenery import (
    EPS,
    attitude,
    boxed,
    energy,
    of_last_step,
    on_floor,
    turned,
)


def rolling(on: Setting) -> Sequence[Check]:
    """A sphere set down sliding at v₀ rolls from t = 2 v₀/(7 μ g) on, at 5 v₀/7, and stays so.

    m v̇ = -μ m g and (2/5) m r² ω̇ = μ m g r until v = ω r (Goldsmith, *Impact*; any text on mechanics). Friction is
    constant until then: only the step in which sliding ends is not exact, in place by μ g dt², as a velocity is hit to
    the tolerance of a contact problem. Angular momentum about the ground is (7/5) m v r throughout.
    """
    v, mu, radius = 5.0, 0.2, 1.0
    # The floor is one wall of six, the others too far to be met: the step of the sphere in a box (case 8).
    sphere = physics.Sphere(radius, 1.0, pos=(0, radius, 0), linvel=(v, 0, 0))
    scene = boxed(sphere, (1e3, 1e3, 1e3), 0.0, mu, (0, -GRAVITY, 0), origin=(0, 1e3, 0))
    world = on.world(scene)
    t = 2 * v / (7 * mu * GRAVITY)
    world.step(steps=on.steps(t) + 2)
    rolls, end = world.linvel[0, 0, 0], 4.0
    world.step(steps=on.steps(end) - on.steps(t) - 2)
    place = v * t - mu * GRAVITY * t * t / 2 + 5 * v / 7 * (world.time - t)
    tight = max(10 * on.tolerance, 64 * EPS) * v
    return [
        within("speed when rolling", rolls, 5 * v / 7, tight, "m/s"),
        Check("change of it afterwards", abs(world.linvel[0, 0, 0] - rolls), tight, "m/s"),
        Check("slip afterwards", abs(world.linvel[0, 0, 0] + radius * world.angvel[0, 0, 2]), tight, "m/s"),
        within("place at 4 s", world.pos[0, 0, 0], place, of_last_step(on, mu) + end * tight, "m"),
    ]


def euler_disk(on: Setting) -> Sequence[Check]:
    """A disk rolls on its rim about its centre, which stands still: Ω² sinα = 4 g/a; nothing makes it grow.

    Steady: with e up the disk's slope, ω = Ω sinα e, no spin about the axis; L = (m a²/4) ω turns at Ω, so that
    Ω (m a²/4) Ω sinα cosα = m g a cosα (Moffatt, *Euler's disk and its finite-time singularity*, Nature 404, 2000). A
    flat ellipsoid with a disk's inertia stands for it: its lowest point is that of the rim to (c/a)² cot²α/2, 1e-6.
    Time stepping is of second order in Ω dt, per turn: the slope may change by (Ω dt)²/4 in each, and Ω with it; the
    contact point stands still, so that nothing does work on the disk but by the square of that.
    """
    a, flat, mass, alpha = 1.0, 1e-3, 1.0, math.radians(40.0)
    omega = math.sqrt(4 * GRAVITY / (a * math.sin(alpha)))
    c, s = math.cos(alpha), math.sin(alpha)
    up = np.array([c, s, 0.0])  # of the slope: the disk's axis, body y, is turned about z by alpha
    body = physics.Ellipsoid(
        (a, flat * a, a), mass, pos=(0, a * math.hypot(s, flat * c), 0), quat=turned(alpha),
        angvel=omega * s * up, inertia_body=mass * a * a * np.array([0.25, 0.5, 0.25]),
    )  # fmt: skip
    scene = on_floor(body, 0.0, 2.0)
    world = on.world(scene)
    start, gain, lean = energy(world, scene), -math.inf, 0.0
    turns = on.pick(20, 3)
    for _ in range(on.steps(turns * 2 * math.pi / omega)):
        world.step()
        gain = max(gain, energy(world, scene) / start - 1)
        lean = max(lean, abs(math.acos(min(1.0, abs(attitude(world)[1, 1]))) - alpha))
    axis = attitude(world)[:, 1]
    heading = math.atan2(axis[2], axis[0])
    expected = math.pi - omega * world.time  # the axis leans to -x at first, and turns about y from z to x
    phase = abs(math.remainder(heading - expected, 2 * math.pi)) / (omega * world.time)
    loose = 100 * on.tolerance + flat**2 if on.is_event_driven else (omega * on.dt) ** 2 / 4
    return [
        Check(f"energy gained in {turns} turns, by energy", gain, loose**2 * turns + 4 * on.tolerance),
        Check("change of the slope", lean, loose * turns + flat**2, "rad"),
        Check("error of Ω, by Ω", phase, loose * turns),
    ]


CASES = (
    Case(12, "rolling", "sliding sphere starts to roll", "5v₀/7 from t = 2v₀/(7μg) on", rolling, peers=True),
    Case(43, "euler-disk", "Euler's disk without dissipation", "Ω² sinα = 4g/a, does not grow", euler_disk),
)  # fmt: skip
