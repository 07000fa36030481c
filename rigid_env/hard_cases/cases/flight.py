"""Hard cases without contact: fast spin, the intermediate axis, the parabola."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.special import ellipkm1

import physics
from rigid_env.hard_cases.case import Case, Check, Setting, within
from rigid_env.hard_cases.cases.scenery import EPS, attitude, energy, free, is_finite, none_of_finite

TURN_AT_ONCE = 0.06  # largest turn that the free-rotation flow makes at once [rad]
ROUNDING = math.sqrt(300) * EPS  # rounding of the attitude in it [rad]: some 300 operations, which round at random

MOMENTS = (1.0, 2.0, 3.0)  # moments of inertia of the body that turns about its intermediate axis [kg m²]


def angular_momentum(world, body: physics.Body) -> np.ndarray:
    """Angular momentum (3,) of a body about its centre of mass, world frame [kg m²/s], from its state."""
    R = attitude(world)
    return R @ body.inertia @ R.T @ np.asarray(world.angvel)[0, 0]


def thin_plate(on: Setting) -> Sequence[Check]:
    """A plate 1 x 0.01 x 1 m of 1 kg spins about an oblique axis at 1e3, 1e4 and 1e5 rad/s.

    Its two equal moments I_t make it a symmetric top. L is constant. The plate's axis d precesses about L at Ω =
    |L|/I_t, and the plate turns about d at n = ω_d (1 - I_d/I_t) (Landau and Lifshitz, *Mechanics*, section 33). So the
    attitude is q(t) = turn(L, Ω t) q(0) turn(d, n t).

    Limits: every rotation by 0.06 rad rounds the attitude. So the angle between d and L, and with it the energy, takes
    a random walk of √N roundings in N of these rotations. The limit is ten times this walk, since the roundings of
    equal rotations are not independent. The rates Ω and n depend on the angle between d and L. So the error of the
    attitude is the walk times the whole angle A that the plate has turned, with N = A/0.06. The engine stores L
    unchanged; here it is computed from attitude and angular velocity, which rounds it.
    """
    checks = []
    for spin in (1e3, 1e4, 1e5):
        body = physics.Block((1.0, 0.01, 1.0), 1.0, angvel=(0.6 * spin, 0.8 * spin, 0.0))
        scene = free(body)
        world = on.world(scene)
        momentum, start = angular_momentum(world, body), energy(world, scene)
        world.step(steps=on.steps(on.pick(10.0, 1.0)))
        t, (across, along, _) = world.time, np.diag(body.inertia)
        precession, own = np.linalg.norm(momentum) / across, 0.8 * spin * (1 - along / across)
        turned = (precession + abs(own)) * t
        walk = 10 * ROUNDING * math.sqrt(turned / TURN_AT_ONCE)
        checks.append(none_of_finite(f"numbers that are not finite, {spin:.0e} rad/s", world))
        if not is_finite(world):
            continue
        axis = momentum / np.linalg.norm(momentum)
        truth = Rotation.from_rotvec(math.fmod(precession * t, 2 * math.pi) * axis)
        truth *= Rotation.from_rotvec([0.0, math.fmod(own * t, 2 * math.pi), 0.0])
        error = (Rotation.from_matrix(attitude(world)).inv() * truth).magnitude()
        change = np.linalg.norm(angular_momentum(world, body) - momentum) / np.linalg.norm(momentum)
        checks += [
            Check(f"change of L, {spin:.0e} rad/s", change, 64 * EPS),
            Check(f"change of the energy, {spin:.0e} rad/s", abs(energy(world, scene) / start - 1), walk),
            Check(f"error of the attitude, {spin:.0e} rad/s", error, walk * turned, "rad"),
        ]
    return checks


def _body_rates(world) -> np.ndarray:
    """Angular velocity (3,) of the first body in the body frame [rad/s]."""
    return attitude(world).T @ np.asarray(world.angvel)[0, 0]


def _crossing(world, dt: float, longest: float) -> float:
    """Time [s] at which the body's ω₂ next falls through zero; NaN if it does not within `longest` [s].

    Between two steps ω₂ is interpolated by a cubic whose slopes are those of Euler's equations, I₂ ω̇₂ = (I₃ - I₁) ω₃
    ω₁.
    """

    def look():
        rates = _body_rates(world)
        return rates[1], (MOMENTS[2] - MOMENTS[0]) * rates[2] * rates[0] / MOMENTS[1]

    before, slope = look()
    for _ in range(math.ceil(longest / dt)):
        world.step()
        after, slope_after = look()
        if before > 0 >= after:
            d0, d1, rise = dt * slope, dt * slope_after, after - before
            cubic = np.array([d0 + d1 - 2 * rise, 3 * rise - 2 * d0 - d1, d0, before])
            roots = np.roots(cubic)
            real = roots[np.abs(roots.imag) < 1e-9].real
            share = real[np.argmin(np.abs(real - before / (before - after)))]
            return world.time - (1 - share) * dt
        before, slope = after, slope_after
    return math.nan


def intermediate_axis(on: Setting) -> Sequence[Check]:
    """A body with I = (1, 2, 3) and ω = (0.01, 1, 0.02) flips over twice in the period T = 4 K(k)/ω_p = 33.195 s.

    Landau and Lifshitz, *Mechanics*, section 37, for L² > 2 E I₂: ω_p² = (I₃ - I₂)(L² - 2 E I₁)/(I₁ I₂ I₃) and
    k² = (I₂ - I₁)(2 E I₃ - L²)/((I₃ - I₂)(L² - 2 E I₁)); here k'² = 1 - k² is 1e-3.

    Limit: with K = ln(4/k'), a relative change δ of the energy changes k'² by 4 δ, and T by the share 4 δ/(2 k'²
    ln(4/k')). N steps change the energy by at most 2 ε N, on average by ε N over the run. The cubic that finds both
    ends of the run has the error dt⁴ ω⁗/384 over the rate, which is below dt⁴/100.
    """
    first = np.array([0.01, 1.0, 0.02])
    I = np.array(MOMENTS)
    twice, square = I @ first**2, np.sum((I * first) ** 2)
    width = square - twice * I[0]
    rate = math.sqrt((I[2] - I[1]) * width / np.prod(I))
    left = 1 - (I[1] - I[0]) * (twice * I[2] - square) / ((I[2] - I[1]) * width)
    period = 4 * ellipkm1(left) / rate
    world = on.world(free(physics.Block((1, 1, 1), 1.0, angvel=first, inertia_body=MOMENTS)))
    turns = on.pick(1000, 100)
    start = _crossing(world, on.dt, period)
    world.step(steps=math.floor((turns * period - 1.0) / on.dt))
    end = _crossing(world, on.dt, period)
    found = (end - start) / turns
    share = 4 * EPS * turns * period / on.dt / (2 * left * math.log(4 / math.sqrt(left)))
    limit = share * period + 2 * on.dt**4 / 100 / turns
    return [within(f"period over {2 * turns} flips", found, period, limit, "s")]


def growth_rate(on: Setting) -> Sequence[Check]:
    """About the intermediate axis a small disturbance grows as exp(σ t), σ = ω √((I₂-I₁)(I₃-I₂)/(I₁ I₃)).

    The linear form of Euler's equations is I₁ ω̇₁ = (I₂-I₃) ω ω₃ and I₃ ω̇₃ = (I₁-I₂) ω ω₁ (Goldstein, *Classical
    Mechanics*, section 5.6). Its growing mode has σ ω₁ = (I₂-I₃)/I₁ ω ω₃. The disturbance grows from 1e-6 to 1e-3.
    Limit: the terms left out are of second order, 1e-6 of the rate at the end; rounding at the start is 1e-10 of the
    disturbance.
    """
    I = MOMENTS
    sigma = math.sqrt((I[1] - I[0]) * (I[2] - I[1]) / (I[0] * I[2]))
    small, grown = 1e-6, 1e-3
    start = (small, 1.0, small * sigma * I[0] / (I[1] - I[2]))
    world = on.world(free(physics.Block((1, 1, 1), 1.0, angvel=start, inertia_body=I)))
    world.step(steps=math.floor(math.log(grown / small) / sigma / on.dt))
    found = math.log(abs(_body_rates(world)[0]) / small) / world.time
    return [within("growth rate", found, sigma, grown**2 * sigma, "1/s")]


def parabola(on: Setting) -> Sequence[Check]:
    """The block flies on the parabola x = x₀ + v t + g t²/2, exactly at any step (Galilei, *Two New Sciences*, 1638).

    A uniform field exerts no torque, and the block tumbles meanwhile. Each step rounds numbers of this size a few
    times.
    """
    x, v, g = np.array([1, 2, 3.0]), np.array([4, 5, -6.0]), np.array([0.5, -9.81, 2])
    body = physics.Block((5, 3, 2), 6.0, pos=x, linvel=v, angvel=(0.1, 5.0, 0.1))
    world = on.world(free(body, tuple(g)))
    steps = on.steps(3.0)
    world.step(steps=steps)
    t = world.time
    place, speed = x + v * t + g * t * t / 2, v + g * t
    return [
        Check("error of the place", np.abs(world.pos[0, 0] - place).max(), 4 * steps * EPS * 60, "m"),
        Check("error of the velocity", np.abs(world.linvel[0, 0] - speed).max(), 4 * steps * EPS * 40, "m/s"),
    ]


CASES = (
    Case(
        1, "thin-plate", "thin plate spinning at 1e3 to 1e5 rad/s",
        "L and energy constant to rounding; precession of the symmetric top; nothing but finite numbers",
        thin_plate, peers=True,
    ),
    Case(
        2, "intermediate-axis", "intermediate axis, thousands of flips",
        "period 4 K(k)/ω_p = 33.195 s",
        intermediate_axis, peers=True,
    ),
    Case(
        3, "growth-rate", "linear growth about the intermediate axis",
        "σ = ω √((I₂-I₁)(I₃-I₂)/(I₁ I₃))",
        growth_rate, peers=True,
    ),
    Case(
        4, "parabola", "free flight under gravity",
        "the parabola, to rounding, at any step",
        parabola, peers=True,
    ),
)  # fmt: skip
