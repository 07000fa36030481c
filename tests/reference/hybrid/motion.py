"""The motion: smooth contact modes, and the events between them."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from tests.reference.hybrid import body, contact, contact_mode, hits
from tests.reference.hybrid.body import ANGVEL, GAPS, TWIST, VEL, Problem
from tests.reference.hybrid.contact import HOLD, SLIDE
from tests.reference.hybrid.contact_mode import advance, choose, dynamics, margins, project


class Options(NamedTuple):
    """Tolerances. Two sets of them give the error estimate."""

    rtol: float = 1e-13  # of the integrator
    turn: float = 0.05  # of a step [rad]; also the share of the time in which gravity or v cross the body
    zeno: float = 1e-9  # flights shorter than this are not made [s]
    snap: float = 1e-11  # sliding that has become slower than this stops [m/s]
    tiny: float = 1e-12  # normal speed that is rounding [m/s]
    together: float = 1e-12  # impacts within this time are one [s]
    ahead: float = 1e-6  # look ahead that tells what follows when a contact stops to hold or to push [s]

    def max_step(self, problem, y) -> float:
        """Longest step [s]: turns by at most `turn` and moves by at most that share of the body's size."""
        size = problem.radius or np.linalg.norm(problem.points[0])
        pull = np.linalg.norm(problem.gravity + problem.force / problem.mass)
        spin = np.linalg.norm(problem.torque) / np.linalg.eigvalsh(problem.inertia)[0]
        rate = np.linalg.norm(y[ANGVEL]) + np.linalg.norm(y[VEL]) / (4 * size) + np.sqrt(pull / size + spin)
        return self.turn / max(rate, 1e-6)


class Event(NamedTuple):
    """Event of kind impact, touch, release, slip, stick or rest; impulse (normal, tangents) [N s] of impacts."""

    t: float
    kind: str
    contact: list  # [vertex, wall]
    impulse: list


class Result(NamedTuple):
    """Samples (n, 13): position, quaternion, velocity, angular velocity; events; the end.

    `left_out` [s] is the time of the flights not made, flight/(1 - e), added up over the contacts.
    """

    t: np.ndarray
    samples: np.ndarray
    events: list
    y: np.ndarray
    left_out: float


class _Run:
    """One simulation; the state of the loop and what it records."""

    def __init__(self, problem, y, options):
        self.problem, self.y, self.options = problem, y, options
        self.t, self.left_out, self.events = 0.0, 0.0, []

    def record(self, kind, contacts, impulses=None):
        for i, c in enumerate(contacts):
            impulse = [] if impulses is None else [float(p) for p in impulses[i]]
            self.events.append(Event(float(self.t), kind, self.problem.name(c), impulse))

    # Impacts

    def impacts(self, touching):
        """Impacts until no touching contact approaches; returns the contacts that were at rest after them."""
        for _ in range(100):
            speeds = body.normal_speeds(self.problem, self.y)
            if all(speeds[c] >= -self.options.tiny for c in touching):
                return
            self.impact(touching, speeds)
        raise RuntimeError(f"contacts still approach after 100 impacts at t = {self.t}")

    def impact(self, touching, speeds):
        """Newton's and Coulomb's laws at one instant; bounces that would be too short are made plastic."""
        approach = np.array([speeds[c] < -self.options.tiny for c in touching])
        restitution = np.where(approach, self.problem.restitution, 0.0)
        while True:
            y, p = collide(self.problem, self.y, touching, restitution)
            short = self.short_flights(y, touching, restitution)
            if not short:
                break
            for i, flight in short.items():
                self.left_out += flight / (1.0 - restitution[i])
                restitution[i] = 0.0
        self.y = y
        hit = [i for i in range(len(touching)) if approach[i] or p[i, 0] > 0]
        self.record("impact", [touching[i] for i in hit], p[hit])

    def short_flights(self, y, touching, restitution):
        """{i: flight time} of bounces shorter than the threshold, 2 u_n⁺/|a_n| with all that acts after the impact."""
        if not np.any((restitution > 0) & (restitution < 1)):
            return {}
        speeds = body.normal_speeds(self.problem, y)
        rest = [c for c in touching if abs(speeds[c]) <= self.options.tiny]
        after = choose(self.problem, y, rest, self.options.snap, ())
        rate = dynamics(self.problem, y, after)[0]
        J = body.jacobian(self.problem, y, touching)[:, 0]
        a = J @ rate[TWIST] + body.convective(self.problem, y, touching)[:, 0]
        flights = {}
        for i, c in enumerate(touching):
            if 0 < restitution[i] < 1 and speeds[c] > self.options.tiny and a[i] < 0:
                flights[i] = -2 * speeds[c] / a[i]
        return {i: flight for i, flight in flights.items() if flight < self.options.zeno}

    # Smooth motion

    def settle(self, touching, at_rest=(), ahead=None):
        """The contact mode from here: impacts first, then forces; `ahead` is an old one that is just ending."""
        self.impacts(touching)
        speeds = body.normal_speeds(self.problem, self.y)
        candidates = [c for c in touching if abs(speeds[c]) <= self.options.tiny]
        y = self.y
        if ahead is not None:
            y = advance(self.problem, y, ahead, self.options.ahead)
        now = choose(self.problem, y, candidates, self.options.snap, at_rest)
        self.y = project(self.problem, self.y, now)
        return contact_mode.with_directions(self.problem, self.y, now, self.options)

    def slip_rates(self, y, now):
        """(contacts, speeds, d speed/dt) of the contacts that slide and do not only begin to."""
        begin = now.turning.which if now.turning else ()
        slides = [c for k, (c, mode) in enumerate(zip(now.active, now.modes)) if mode == SLIDE and k not in begin]
        if not slides or self.problem.friction == 0.0:
            return [], np.zeros(0), np.zeros(0)
        J = body.jacobian(self.problem, y, slides)
        u = (J @ y[TWIST])[:, 1:]
        rate = dynamics(self.problem, y, now)[0]
        a = (J @ rate[TWIST] + body.convective(self.problem, y, slides))[:, 1:]
        speed = np.linalg.norm(u, axis=1)
        return slides, speed, np.sum(u * a, axis=1) / np.maximum(speed, 1e-300)

    def cap(self, y, now):
        """Half the time after which a sliding contact would stop: the stop is approached from outside [s]."""
        _, speed, rate = self.slip_rates(y, now)
        times = [s / -r for s, r in zip(speed, rate) if r < 0]
        return 0.5 * min(times, default=np.inf)

    def smooth(self, now, duration, sample):
        """Integrate until an event or until `duration`; returns what ended it: (kind, contacts)."""
        solver = contact_mode.integrator(self.problem, self.y, now, self.options)
        begin, longest = self.t, solver.max_step
        while True:
            t0, y0 = solver.t, solver.y.copy()
            solver.max_step = min(longest, self.cap(y0, now))
            solver.step()
            if solver.status == "failed":
                raise RuntimeError(f"integrator failed at t = {begin + solver.t}, {now}")
            kind, contacts, h = self.first_end(now, y0, solver)
            h = min(h, duration - begin - t0)
            over = h >= duration - begin - t0
            sample(begin + t0, h, y0, now)
            if kind is None and not over:
                continue
            self.t = begin + t0 + h
            self.y = advance(self.problem, y0, now, h)
            return ("end", []) if over else (kind, contacts)

    def first_end(self, now, y0, solver):
        """(kind, contacts, h): the first event within the solver's last step, h after its start; or None."""
        width = solver.t - solver.t_old
        dense = solver.dense_output()

        def state(h):
            return advance(self.problem, y0, now, h)

        found = [(None, [], width)]
        hit = hits.first_hit(self.problem, self.options, now, dense, solver, state)
        if hit is not None:
            found.append(("impact", *hit))
        found.extend(self.first_margins(now, dense, solver, state, min(h for *_, h in found)))
        slides, speed, _ = self.slip_rates(solver.y, now)
        if solver.status == "finished":
            found.append(("begun", [], width))
        if len(speed) and speed.min() < self.options.snap:
            stopped = [c for c, s in zip(slides, speed) if s < 1e2 * self.options.snap]
            found.append(("stick", stopped, width))
        # Of two at the end of the step the one that says more.
        return min(found, key=lambda end: (end[2], end[0] is None))

    def first_margins(self, now, dense, solver, state, limit):
        """Ends [(kind, contacts, h)] at which a force leaves its cone, sampled four times per step."""
        if not now.active:
            return []
        width = solver.t - solver.t_old
        for left, right in itertools.pairwise(QUARTERS):
            if left * width > limit:
                break
            y = solver.y if right == 1.0 else dense(solver.t_old + right * width)
            broken = [key for key, value in margins(self.problem, y, now).items() if value < 0]
            ends = [self.margin_end(key, now, left * width, right * width, state) for key in broken]
            if ends:
                return ends
        return []

    def margin_end(self, key, now, left, right, state):
        def margin(h):
            return margins(self.problem, state(h), now)[key]

        kind, c = key
        contacts = [] if c is None else [c]
        if margin(left) <= 0.0:
            return kind, contacts, left
        return kind, contacts, brentq(margin, left, right, xtol=1e-15, rtol=1e-14)


QUARTERS = np.linspace(0.0, 1.0, 5)


def collide(problem: Problem, y, touching, restitution):
    """(y⁺, impulses (n, 3)) of one impact with a coefficient of restitution per contact."""
    A, _, u, carried, _ = contact_mode.assemble(problem, y, touching)
    b = u.copy()
    b[:, 0] += restitution * np.minimum(u[:, 0], 0.0)  # u_n⁺ - goal, goal = -e u_n⁻
    given = tuple(np.zeros(2) if problem.friction == 0.0 else None for _ in touching)
    walls = tuple(problem.wall(c) for c in touching)
    question = contact.Contacts(A, b.ravel(), problem.friction, walls, contact_mode.places(problem, y, touching), given)
    p = contact.solve(question).f
    after = y.copy()
    after[TWIST] += carried @ p.ravel()
    return after, p


def simulate(problem: Problem, y, duration, sample_times=(), options=None) -> Result:
    """The motion over `duration` [s] from the state y of `body.start`.

    Raises
    ------
    RuntimeError
        Where the laws have no answer, or events do not end.
    """
    run = _Run(problem, np.array(y, float), options or Options())
    times = np.asarray(sample_times, float)
    samples = np.full((len(times), 13), np.nan)
    samples[times <= 0.0] = y[:13]

    def sample(t, h, y, now):
        for k in np.flatnonzero((times > t) & (times <= t + h)):
            samples[k] = advance(problem, y, now, times[k] - t)[:13]

    touching = [c for c in range(problem.contact_count) if y[GAPS][c] <= 1e-12]
    run.y[GAPS][touching] = 0.0
    now = run.settle(touching)
    for _ in range(100_000):
        if is_at_rest(run, now):
            run.record("rest", now.active[:1])
            samples[times > run.t] = run.y[:13]
            break
        kind, contacts = run.smooth(now, duration, sample)
        if kind == "end":
            samples[times >= duration] = run.y[:13]
            break
        now = follow(run, now, kind, contacts)
    else:
        raise RuntimeError(f"100 000 events by t = {run.t}")
    samples[:, 3:7] /= np.linalg.norm(samples[:, 3:7], axis=1, keepdims=True)
    return Result(times, samples, run.events, run.y, float(run.left_out))


def follow(run, now, kind, contacts):
    """The contact mode after an event."""
    held = [c for c, mode in zip(now.active, now.modes) if mode == HOLD]
    if kind == "impact":
        run.y[GAPS][contacts] = 0.0
        if np.all(body.normal_speeds(run.problem, run.y)[contacts] >= -run.options.tiny):
            run.record("touch", contacts)
        return run.settle([*now.fixed, *contacts])
    if kind == "begun":
        return now._replace(turning=None)
    if kind == "stick":
        run.record("stick", contacts)
        modes = tuple(HOLD if c in contacts else mode for c, mode in zip(now.active, now.modes))
        run.y = project(run.problem, run.y, now._replace(modes=modes))
        return run.settle(now.fixed, at_rest=[*held, *contacts])
    following = run.settle(now.fixed, at_rest=held, ahead=now)
    if kind == "slip":
        contacts = [c for c, m in zip(following.active, following.modes) if c in held and m == SLIDE]
    if kind == "release":
        contacts = [c for c in now.active if c not in following.fixed] or contacts
    if kind != "carry":
        run.record(kind, contacts)
    return following


def is_at_rest(run, now) -> bool:
    """Test whether nothing moves nor will: no velocity, no acceleration."""
    if not now.active or (SLIDE in now.modes and run.problem.friction > 0.0):
        return False
    speed = np.abs(run.y[TWIST]).max()
    return bool(speed <= 1e-13 and np.abs(dynamics(run.problem, run.y, now)[0][TWIST]).max() <= 1e-11)
