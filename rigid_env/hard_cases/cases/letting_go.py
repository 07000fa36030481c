"""Hard cases of moving bodies whose contact ends, or slides and sticks again."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

import physics
from physics.accuracy import resolve
from physics.scene.canonical_scenes import GRAVITY
from rigid_env.hard_cases.case import Case, Check, Setting, none_of, within
from rigid_env.hard_cases.cases.scenery import EPS, FLOOR, laws, on_floor, turned

LEFT = physics.HalfSpace((1, 0, 0))
LOOKS = 400  # number of angles at which a wall's push is evaluated, to find where it changes sign


class Release(NamedTuple):
    """Release of a body from a wall: time [s], angle about z [rad] and its rate [rad/s]."""

    time: float
    angle: float
    rate: float


def _release(square: Callable, push: Callable, start: float, end: float) -> Release:
    """Find the release of a body that starts at the angle `start`: the first zero of a wall's push.

    `push` is the wall's force as a function of the angle, and `square` gives ω². The time is ∫ dθ/ω. A body at rest
    moves as the square root of the angle at first; with θ = start + s² the integrand is smooth.
    """
    angles = np.linspace(start, end, LOOKS)[1:]
    first = next(k for k in range(1, len(angles)) if push(angles[k]) < 0.0)
    angle = brentq(push, angles[first - 1], angles[first], xtol=4 * EPS, rtol=4 * EPS)
    way = 1.0 if end > start else -1.0

    def slowness(s):
        return 2.0 * s / math.sqrt(square(start + way * s * s))

    time, _ = quad(slowness, 0.0, math.sqrt(abs(angle - start)), epsabs=1e-14, epsrel=1e-13)
    return Release(time, angle, way * math.sqrt(square(angle)))


def _released(on: Setting, scene: physics.Scene, duration: float, wall: int) -> list[float]:
    """Times at which the body leaves `wall` in an event-driven simulation [s]."""
    found = physics.simulate(scene, duration, on.accuracy, on.dt)
    return [event.t for event in found.events if event.kind == "release" and event.wall == wall]


def _time_checks(on: Setting, scene: physics.Scene, time: float, end: float, wall: int) -> list[Check]:
    """Check that the body leaves `wall` once, at the right time; there are no checks for time stepping.

    Limit: the wall's push is off by at most ten times the tolerance, in units of the body's weight: some ten steps,
    each accurate to a hundredth of the tolerance, times a factor that amplifies errors. The push decreases by about the
    weight within the time scale of the motion, so the time is off by the same share. 1e-10 s are a million units in the
    last place.
    """
    if not on.is_event_driven:
        return []
    times = _released(on, scene, end, wall)
    limit = max(10 * on.tolerance, 1e-10)
    return [
        none_of("releases that there are not, or more than one", abs(len(times) - 1)),
        within("time of release", times[0] if times else math.nan, time, limit, "s"),
    ]


def lifts_off(on: Setting) -> Sequence[Check]:
    """A smooth ellipsoid, spun up on its flat side, turns over its tip and leaves the floor before it is upright.

    Its half-axes are a along and b up. The height of its centre is y(θ) = √(a² sin²θ + b² cos²θ). No force acts
    sideways, so

        ½ (I + m y'²) ω² + m g y = ½ I ω₀² + m g b,    I = m (a² + b²)/5.

    Where the push of the floor ends, no torque acts, so y'' ω² = -g. From there ω stays, and the centre flies on a
    parabola. Limits: time stepping is of second order in ω₀ dt. The angle is off by (ω₀ dt)² of the whole angle turned,
    the height by half of (ω₀ dt)² a.
    """
    a, b, mass, spin, after = 0.3, 0.15, 2.0, 14.0, 0.05
    inertia, c = mass * (a * a + b * b) / 5, a * a - b * b

    def height(t):
        return math.sqrt((a * math.sin(t)) ** 2 + (b * math.cos(t)) ** 2)

    def slope(t):
        return c * math.sin(2 * t) / (2 * height(t))

    def square(t):
        free = inertia * spin**2 + 2 * mass * GRAVITY * (b - height(t))
        return free / (inertia + mass * slope(t) ** 2)

    def push(t):
        return GRAVITY + (c * math.cos(2 * t) - slope(t) ** 2) / height(t) * square(t)

    found = _release(square, push, 0.0, math.pi / 2)
    body = physics.Ellipsoid((a, b, 0.2), mass, pos=(0, b, 0), angvel=(0, 0, spin))
    scene = on_floor(body)
    world = on.world(scene)
    steps = on.steps(found.time + after)
    world.step(steps=steps)
    t = world.time - found.time
    y = height(found.angle) + slope(found.angle) * found.rate * t - GRAVITY * t * t / 2
    turn = found.angle + found.rate * t
    w, _, _, z = world.quat[0, 0]
    loose = 100 * on.tolerance if on.is_event_driven else (spin * on.dt) ** 2
    return [
        within("height of the centre in the air", world.pos[0, 0, 1], y, loose * a / 2, "m"),
        within("angle in the air", 2 * math.atan2(z, w), turn, loose * turn, "rad"),
        *_time_checks(on, scene, found.time, steps * on.dt, 0),
    ]


def ladder_leaves_wall(on: Setting) -> Sequence[Check]:
    """A smooth ladder slides down between floor and wall, from rest, and leaves the wall before it reaches the floor.

    It has length l, width w and the angle θ from the floor. The ends of its lower side touch floor and wall, so its
    centre is at x = (l cosθ + w sinθ)/2, y = (l sinθ + w cosθ)/2, and

        ½ (I + m (x'² + y'²)) ω² = m g (y₀ - y),    ω' from its derivative.

    The wall pushes with m (x'' ω² + x' ω'). Where this push ends, the centre keeps its sideways velocity. (Without
    width, this is where the top has fallen by a third.)

    Limits: after that, the wall would slow the centre at a growing rate j, so the speed is off by ½ j τ² if the wall
    lets go a time τ late. Time stepping is late by two steps, and until the gap, j τ³/6, is a slop. It is also of
    second order, by the share (ω dt)² of the speed, and each step is solved to the tolerance of it.
    """
    length, width, mass, start, after = 2.0, 0.05, 3.0, 1.2, 0.1
    inertia = mass * (length**2 + width**2) / 12

    def place(t):
        return (length * np.array([math.cos(t), math.sin(t)]) + width * np.array([math.sin(t), math.cos(t)])) / 2

    def slope(t):
        return (length * np.array([-math.sin(t), math.cos(t)]) + width * np.array([math.cos(t), -math.sin(t)])) / 2

    def square(t):
        return 2 * mass * GRAVITY * (place(start) - place(t))[1] / (inertia + mass * slope(t) @ slope(t))

    def push(t):  # per kilogram; x'' = -x, y'' = -y
        bent = -2 * mass * (slope(t) @ place(t))
        spun = -(0.5 * bent * square(t) + mass * GRAVITY * slope(t)[1]) / (inertia + mass * slope(t) @ slope(t))
        return -place(t)[0] * square(t) + slope(t)[0] * spun

    found = _release(square, push, start, 0.05)
    nudge = 1e-5
    jerk = abs(push(found.angle + nudge) - push(found.angle - nudge)) / (2 * nudge) * abs(found.rate)
    speed = slope(found.angle)[0] * found.rate
    body = physics.Block((length, width, 0.4), mass, pos=(*place(start), 0), quat=turned(math.pi - start))
    scene = physics.Scene([body], [FLOOR, LEFT], laws())
    world = on.world(scene)
    steps = on.steps(found.time + after)
    world.step(steps=steps)
    late = 2 * on.dt + (6 * on.slop * math.hypot(length, width, 0.4) / 2 / jerk) ** (1 / 3)
    loose = 100 * on.tolerance * speed
    if not on.is_event_driven:
        loose = 0.5 * jerk * late**2 + ((found.rate * on.dt) ** 2 + on.tolerance) * speed
    x = place(found.angle)[0] + speed * (world.time - found.time)
    return [
        within("sideways speed in the end", world.linvel[0, 0, 0], speed, loose, "m/s"),
        within("place of the centre in the end", world.pos[0, 0, 0], x, loose * world.time, "m"),
        *_time_checks(on, scene, found.time, steps * on.dt, 1),
    ]


# A body that rolls, slips after 0.239 s and sticks again after 0.598 s. The numbers are one of the truths in
# tests/reference/data/restick.json; a test compares them. PLACE (x, z) and ATTITUDE are those at which it sticks.
AXES = (0.22727779264751125, 0.2895599622404196, 0.1729424131088307)
WEIGHS, FRICTION = 1.570155906823083, 0.24320126260951022
START = (-0.6212756411284268, -0.7518774852481933, -0.04282437396923139, 0.21647840056564183)
SPIN = (2.0126875690363013, 3.1278774135026155, 3.9183405151923703)
SLIPS, STICKS = 0.23917529139834529, 0.5975658108460089
PLACE = (-0.4084200409645145, -0.014653387056755516)
ATTITUDE = (0.09177162849913442, -0.28764097420046436, -0.8476806777030572, 0.43620878809637764)


def rolling_start(axes, quat, angvel) -> dict:
    """State of an ellipsoid that rolls on the floor, with its lowest point at rest, as arguments of a body.

    The lowest point is at r = -R D²Rᵀn/|D Rᵀn| from the centre, and v = r x ω.
    """
    w, *v = quat
    R = Rotation.from_quat([*v, w]).as_matrix()
    square = R @ np.diag(np.square(axes)) @ R.T
    r = -square[:, 1] / math.sqrt(square[1, 1])
    return {"pos": (0.0, -r[1], 0.0), "quat": quat, "linvel": tuple(np.cross(r, angvel)), "angvel": angvel}


def sticks_again(on: Setting) -> Sequence[Check]:
    """An ellipsoid rolls until friction no longer holds it, slides for 0.36 s, and sticks again.

    A slip begins with the square of the time, and its direction changes at a rate of 1/|u|: the equations are
    arbitrarily stiff there, and again where the slip ends. The known outcome is a solution of the equations of motion
    by Radau and DOP853, with the time dσ = dt/|u| and the slip u as a part of the state, accurate to 1e-13
    (`tests/reference/restick.py`). Position and attitude are compared at the time at which it sticks.

    Limits: time stepping is of second order in ω dt for both. If friction opposes the slip at the end of a step
    (``slip="end"``), its direction is off by the rotation in half a step. For a slide of the duration t this shifts the
    position by μ g t² times that angle. Event-driven, times are accurate to ten times the tolerance, or to 1e-10, to
    which the slide amplifies rounding.
    """
    body = physics.Ellipsoid(AXES, WEIGHS, **rolling_start(AXES, START, SPIN))
    scene = on_floor(body, 0.0, FRICTION)
    on.world(scene)  # raises UnsupportedError if the engine cannot simulate the scene
    end = physics.simulate(scene, STICKS, on.accuracy, on.dt)
    turn = 2 * math.acos(min(1.0, abs(float(np.dot(end.quat[-1, 0], ATTITUDE)))))
    away = math.hypot(*(end.pos[-1, 0, [0, 2]] - PLACE))
    speed = float(np.linalg.norm(SPIN))
    loose = max(10 * on.tolerance, 1e-10) if on.is_event_driven else (speed * on.dt) ** 2
    shift = loose * max(AXES)
    if not on.is_event_driven and resolve(on.accuracy).slip == "end":
        shift += FRICTION * GRAVITY * (STICKS - SLIPS) ** 2 * 0.5 * speed * on.dt
        loose += shift / min(AXES)
    checks = [Check("place where it sticks", away, shift, "m"), Check("attitude there", turn, loose, "rad")]
    if on.is_event_driven:
        checks += _stick_checks(on, scene)
    return checks


def _stick_checks(on: Setting, scene: physics.Scene) -> list[Check]:
    """Check that the body slips once and sticks once, at the right times, without impacts and releases."""
    found = physics.simulate(scene, STICKS + 0.01, on.accuracy, on.dt)
    times = {kind: [event.t for event in found.events if event.kind == kind] for kind in ("slip", "stick")}
    late = {kind: times[kind][-1] if times[kind] else math.nan for kind in times}
    limit = max(10 * on.tolerance, 1e-10)
    return [
        none_of("impacts and releases", sum(event.kind in ("impact", "release") for event in found.events)),
        within("time at which it slips", late["slip"], SLIPS, limit, "s"),
        within("time at which it sticks again", late["stick"], STICKS, limit, "s"),
    ]


CASES = (
    Case(
        52, "lifts-off", "smooth ellipsoid that turns over its tip", "leaves the floor where y'' ω² = -g", lifts_off,
        peers=True,
    ),
    Case(
        53, "ladder-lets-go", "smooth ladder that slides down a wall",
        "leaves it where the wall would have to pull; its sideways speed stays", ladder_leaves_wall, peers=True,
    ),
    Case(
        54, "sticks-again", "rolling ellipsoid that slips and sticks again",
        "time, place and attitude are those of the equations of motion", sticks_again,
    ),
)  # fmt: skip
