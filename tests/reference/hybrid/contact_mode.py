"""Smooth motion: which contacts carry, what each does, and the right-hand side while that lasts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.integrate import DOP853

from tests.reference.hybrid import body, contact, slip
from tests.reference.hybrid.body import CLOCK, GAPS, POS, QUAT, TWIST, VEL, Problem
from tests.reference.hybrid.contact import HOLD, OPEN, SLIDE
from tests.reference.hybrid.slip import Turning


class ContactMode(NamedTuple):
    """Contacts that carry, their modes; those that only touch; directions of those whose sliding only begins."""

    active: tuple = ()
    modes: tuple = ()
    idle: tuple = ()
    turning: Turning | None = None

    @property
    def fixed(self) -> list:
        """Contacts whose gap is zero and stays so."""
        return [*self.active, *self.idle]


def assemble(problem: Problem, y, contacts):
    """A (3 n, 3 n) [1/kg], b (3 n,) [m/s²], velocities (n, 3), M⁻¹ Jᵀ (6, 3 n), free acceleration (6,)."""
    J = body.jacobian(problem, y, contacts)
    flat = J.reshape(-1, 6)
    carried = body.inverse_mass(problem, y) @ flat.T
    free = body.free_acceleration(problem, y)
    b = flat @ free + body.convective(problem, y, contacts).ravel()
    return flat @ carried, b, J @ y[TWIST], carried, free


def places(problem: Problem, y, contacts):
    """(n, 2) coordinates of the contacts along the tangents of their wall, from the centre of mass [m]."""
    r = body.arms(problem, y)
    return np.array([problem.frames[problem.wall(c)][1:] @ r[c] for c in contacts]).reshape(-1, 2)


def directions(velocities, turning, clock):
    """(n, 2) of sliding: those of the velocities, or as `slip` has found them."""
    size = np.linalg.norm(velocities[:, 1:], axis=1)
    found = velocities[:, 1:] / np.where(size > 0, size, 1.0)[:, None]
    if turning is not None:
        found[list(turning.which)] = turning.directions(clock)
    return found


def dynamics(problem: Problem, y, mode: ContactMode):
    """(dy/dt, forces (n, 3), A) of a contact mode."""
    rate = np.zeros_like(y)
    rate[POS], rate[QUAT] = y[VEL], body.quaternion_rate(y)
    rate[GAPS] = body.normal_speeds(problem, y)
    rate[GAPS][mode.fixed] = 0.0
    rate[CLOCK] = 1.0
    if not mode.active:
        rate[TWIST] = body.free_acceleration(problem, y)
        return rate, np.zeros((0, 3)), np.zeros((0, 0))
    A, b, u, carried, free = assemble(problem, y, mode.active)
    walls = [problem.wall(c) for c in mode.active]
    d = directions(u, mode.turning, y[CLOCK])
    f = contact.mode_forces(A, b, walls, places(problem, y, mode.active), mode.modes, d, problem.friction)
    rate[TWIST] = free + carried @ f.ravel()
    return rate, f, A


def margins(problem: Problem, y, mode: ContactMode) -> dict:
    """{what ends the contact mode: a number that is positive while it lasts}.

    Keys are ("release", contact), ("slip", None) and ("carry", contact) for an idle contact whose share of the
    normal force, max(0, ℓ), becomes positive.
    """
    if not mode.active:
        return {}
    _, f, A = dynamics(problem, y, mode)
    ends = {("release", c): f[i, 0] for i, c in enumerate(mode.active)}
    if HOLD in mode.modes:
        ends["slip", None] = contact.hold_margin(A, mode.modes, f, problem.friction)
    for c in mode.idle:
        mine = [i for i, other in enumerate(mode.active) if problem.wall(other) == problem.wall(c)]
        place = places(problem, y, [*(mode.active[i] for i in mine), c])
        ends["carry", c] = -contact.extrapolated(place[:-1], f[mine, 0], place[-1])
    return ends


def choose(problem: Problem, y, touching, still, at_rest) -> ContactMode:
    """The contact mode of touching contacts with u_n = 0 at this instant.

    Parameters
    ----------
    touching : list of contacts
    still : float
        Sliding speed below which a contact does not slide [m/s].
    at_rest : container
        Contacts that do not slide whatever rounding, or a look ahead, says of their speed.
    """
    if not touching:
        return ContactMode()
    A, b, u, _, _ = assemble(problem, y, touching)
    slides = [c not in at_rest and np.linalg.norm(row[1:]) > still for c, row in zip(touching, u)]
    given = tuple(row[1:] / np.linalg.norm(row[1:]) if s else None for s, row in zip(slides, u))
    if problem.friction == 0.0:
        given = tuple(np.zeros(2) for _ in touching)
    walls = tuple(problem.wall(c) for c in touching)
    question = contact.Contacts(A, b, problem.friction, walls, places(problem, y, touching), given)
    answer = contact.solve(question)
    idle = contact.idle_pulls(question, answer, max(np.abs(b).max(), 1e-300))
    carry = [i for i, mode in enumerate(answer.modes) if mode != OPEN]
    starts = [k for k, i in enumerate(carry) if answer.modes[i] == SLIDE and given[i] is None]
    begin = [answer.a[carry[k], 1:] for k in starts]
    return ContactMode(
        active=tuple(touching[i] for i in carry),
        modes=tuple(answer.modes[i] for i in carry),
        idle=tuple(touching[i] for i in idle),
        turning=slip.constant(starts, begin) if starts else None,
    )


def with_directions(problem: Problem, y, mode: ContactMode, options) -> ContactMode:
    """The contact mode from the state y on, with the directions in which its contacts start to slide."""
    if mode.turning is None:
        return mode
    y = y.copy()
    y[CLOCK] = 0.0
    starting = [mode.active[k] for k in mode.turning.which]

    def velocities(turning, times):
        trial, now, found = mode._replace(turning=turning), y, []
        for h in np.diff(times, prepend=0.0):
            now = advance(problem, now, trial, h)
            found.append((body.jacobian(problem, now, starting) @ now[TWIST])[:, 1:])
        return np.array(found).transpose(1, 0, 2)

    span = 0.5 * options.max_step(problem, y)
    return mode._replace(turning=slip.collocate(mode.turning, span, velocities))


def integrator(problem: Problem, y, mode: ContactMode, options):
    """SciPy's one-step integrator of the contact mode from local time 0; it ends where sliding has begun."""
    return DOP853(
        lambda t, y: dynamics(problem, y, mode)[0], 0.0, y, mode.turning.span if mode.turning else np.inf,
        rtol=options.rtol, atol=1e-2 * options.rtol, max_step=options.max_step(problem, y),
    )  # fmt: skip


def advance(problem: Problem, y, mode: ContactMode, h):
    """y after h: one step of DOP853, h within a step that its error control has accepted."""
    if h <= 0.0:
        return y.copy()
    stages = []
    for row in DOP853.A[: DOP853.n_stages]:
        moved = y + h * sum((a * k for a, k in zip(row, stages) if a != 0.0), np.zeros_like(y))
        stages.append(dynamics(problem, moved, mode)[0])
    return y + h * sum(c * k for c, k in zip(DOP853.B, stages))


def project(problem: Problem, y, mode: ContactMode, restart_above=1e-6):
    """Remove drift: gaps and velocities that are zero, by the least change in the mass metric; |q| = 1.

    The gaps carried along are exact for contacts that have just left the wall; beyond `restart_above` [m]
    they are taken from position and attitude again.
    """
    y = y.copy()
    y[QUAT] /= np.linalg.norm(y[QUAT])
    inverse = body.inverse_mass(problem, y)
    fixed = mode.fixed
    if fixed:
        J = body.jacobian(problem, y, fixed)
        move = _least(inverse, J[:, 0], -body.gaps(problem, y)[fixed])
        y[POS] += move[:3]
        y[QUAT] += body.quaternion_rate(np.concatenate([y[:10], move[3:]]))
        y[QUAT] /= np.linalg.norm(y[QUAT])
        modes = [*mode.modes, *(SLIDE for _ in mode.idle)]
        J = body.jacobian(problem, y, fixed).reshape(-1, 6)[contact.constrained_rows(modes)]
        y[TWIST] += _least(inverse, J, -J @ y[TWIST])
    fresh = body.gaps(problem, y)
    far = y[GAPS] > restart_above
    y[GAPS][far] = fresh[far]
    y[GAPS][fixed] = 0.0
    y[CLOCK] = 0.0
    return y


def _least(inverse, J, target):
    """The least M-norm move d with J d = target."""
    return inverse @ J.T @ np.linalg.lstsq(J @ inverse @ J.T, target, rcond=contact.RANK)[0]
