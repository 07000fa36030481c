"""Hard cases of rolling: a sphere that starts to roll, a disk on its rim, an ellipsoid that rolls and rocks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

import physics
from physics.kernels.time_stepping import event_log
from physics.scene.canonical_scenes import GRAVITY
from rigid_env.hard_cases.case import Case, Check, Setting, UnsupportedError, none_of, within
from rigid_env.hard_cases.cases.scenery import (
    EPS,
    attitude,
    boxed,
    energy,
    of_last_step,
    on_floor,
    turned,
)


def rolling(on: Setting) -> Sequence[Check]:
    """A sphere starts with the speed v₀ without spin; from t = 2 v₀/(7 μ g) on it rolls at 5 v₀/7.

    m v̇ = -μ m g and (2/5) m r² ω̇ = μ m g r until v = ω r (Goldsmith, *Impact*; any text on mechanics). Friction is
    constant until then, so only the step in which sliding ends is not exact, in position by μ g dt². A velocity is
    reached to the tolerance of a contact problem. The angular momentum about the ground is (7/5) m v r when it rolls.
    """
    v, mu, radius = 5.0, 0.2, 1.0
    # The floor is one of six walls; the other five are far away. So case 8, a sphere in a box, uses the same kernel.
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
    """A disk rolls on its rim while its centre stands still: Ω² sinα = 4 g/a, and no energy is gained.

    In the steady motion, ω = Ω sinα e, where e points up the disk's slope, without spin about the disk's axis. L = (m
    a²/4) ω turns at Ω, so that Ω (m a²/4) Ω sinα cosα = m g a cosα (Moffatt, *Euler's disk and its finite-time
    singularity*, Nature 404, 2000). A flat ellipsoid with a disk's inertia replaces the disk. Its lowest point is that
    of the rim to (c/a)² cot²α/2, 1e-6.

    Limits: time stepping is of second order in Ω dt per turn. The slope may change by (Ω dt)²/4 in each turn, and Ω
    with it. The contact point stands still, so work on the disk is of the order of the square of that.
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


class Ellipse(NamedTuple):
    """Upright section of an ellipsoid that is turned by θ about its axis z, with half-axes a and b [m].

    `height` is H(θ), the height of its centre above a floor that it touches.
    """

    a: float
    b: float  # half-axis that is vertical at θ = 0

    def height(self, angle):
        """Height of the centre, H = √(a² sin²θ + b² cos²θ) [m]."""
        return math.hypot(self.a * math.sin(angle), self.b * math.cos(angle))

    def slope(self, angle):
        """Derivative of the height, H' = (a² - b²) sinθ cosθ/H [m/rad]."""
        return (self.a**2 - self.b**2) * math.sin(angle) * math.cos(angle) / self.height(angle)

    def body(self, angle: float = 0.0, lift: float = 0.0, spin: float = 0.0) -> physics.Ellipsoid:
        """Ellipsoid of 1 kg, turned by `angle` about z [rad], with its lowest point `lift` above the floor [m].

        `spin` is its angular velocity about z [rad/s], at which it rolls: its lowest point is at rest.
        """
        height = self.height(angle)
        return physics.Ellipsoid(
            (self.a, self.b, 0.4), 1.0, pos=(0, height + lift, 0), quat=turned(angle),
            linvel=(-spin * height, spin * self.slope(angle), 0), angvel=(0, 0, spin),
        )  # fmt: skip


def rolls_without_impact(on: Setting) -> Sequence[Check]:
    """An ellipsoid rolls, rocks and lands: it has an impact where it meets the floor, and no other.

    It has half-axes a = 0.5 m and b = 0.3 m across its axis of rotation, and I = m (a² + b²)/5. Its centre is at the
    height H(θ), with θ = 0 when it lies flat. The floor pushes with N = m (g + d²H/dt²) = m (g + H'θ̈ + H''θ̇²). On a
    smooth floor the energy ½ (I + m H'²) θ̇² + m g H is kept, so θ̈ = -(m H'H''θ̇² + m g H')/(I + m H'²) and

        N = m I (g + H''θ̇²)/(I + m H'²).

    Four runs:

    - Released at rest at θ = 0.5, it rocks with N >= 0.65 m g.
    - Dropped at this angle from 0.05 m with e = 0, it lands after √(2h/g) with one impact. Then θ̇ = -H' v/(I/m + H'²),
      and it rocks with N >= 0.63 m g.
    - On a rough floor it rolls over and over, upright at 1 rad/s: with r² = H² + H'² from its centre to the contact,
      (I + m r²) θ̈ = -m H'((H + H'')θ̇² + g), N >= 0.76 m g and friction is at most 0.29 N.
    - Bouncing flat from 1 m with e = 1/2 it hits at √(2h/g) (1, 2, 5/2, ...) = √(2h/g) (3 - 2/2^k), each time with the
      impulse m (1 + e) times its speed.

    As long as N > 0, contact never breaks, so there is no impact. `tests/physics/test_rolling_ellipsoid.py` computes
    these N. Limit: an impact is made within half a slop of the floor, and the error of one bounce grows by 1/e to the
    next.
    """
    ellipse, seconds = Ellipse(0.5, 0.3), on.pick(4.0, 2.0)
    if not on.is_ours:
        raise UnsupportedError("events are not told by this engine")
    upright = ellipse.body(math.pi / 2, spin=1.0)
    rocks = _impacts(on, on_floor(ellipse.body(0.5), 0.5, 0.0), seconds)
    rolls = _impacts(on, on_floor(upright, 0.5, 2.0), seconds)
    lands = _impacts(on, on_floor(ellipse.body(0.5, lift=0.05), 0.0, 0.0), seconds)
    bounces = _impacts(on, on_floor(ellipse.body(lift=1.0), 0.5, 0.0), 1.7)
    speed, loose = math.sqrt(2 * GRAVITY), 8 * (on.slop * 0.5 + on.tolerance)
    first = [*bounces[:3], *[(math.nan, math.nan)] * (3 - len(bounces))]
    return [
        none_of("impacts while it rocks on a smooth floor", len(rocks)),
        none_of("impacts while it rolls on a rough floor", len(rolls)),
        none_of("impacts of one landing but one", abs(len(lands) - 1)),
        within("time of the landing", lands[0][0] if lands else math.nan, math.sqrt(0.1 / GRAVITY), loose, "s"),
        *(
            within(f"time of bounce {k + 1}", t, math.sqrt(2 / GRAVITY) * (3 - 2 * 0.5**k), loose, "s")
            for k, (t, _) in enumerate(first)
        ),
        *(
            within(f"impulse of bounce {k + 1}", p, 1.5 * speed * 0.5**k, 16 * loose, "N s")
            for k, (_, p) in enumerate(first)
        ),
    ]


def _impacts(on: Setting, scene: physics.Scene, seconds: float) -> list[tuple[float, float]]:
    """Time [s] and impulse [N s] of each impact of the body in a scene, within `seconds`."""
    world, found = on.world(scene), []
    world.make_event_room(64)
    for k in range(on.steps(seconds)):
        world.step()
        for event in world.event_log[0, : world.event_counts[0]]:
            if event[event_log.EVENT_KIND] == event_log.KIND_IMPACT:
                found.append(
                    (
                        k * on.dt + event[event_log.EVENT_TIME],
                        float(np.linalg.norm(event[event_log.EVENT_IMPULSE : event_log.EVENT_IMPULSE + 3])),
                    )
                )
    return found


CASES = (
    Case(12, "rolling", "sliding sphere starts to roll", "5v₀/7 from t = 2v₀/(7μg) on", rolling, peers=True),
    Case(
        55, "rolling-ellipsoid", "an ellipsoid rolls and rocks: is anything hit?",
        "no impact while the push is positive; one of each landing", rolls_without_impact,
    ),
    Case(43, "euler-disk", "Euler's disk without dissipation", "Ω² sinα = 4g/a, does not grow", euler_disk),
)  # fmt: skip
