"""Every contact solver on the same problems, time against residual: ``python -m benchmarks.solvers [--json FILE]``.

Two tables. Linear complementarity problems (no friction): sweeps, Dantzig's and Lemke's methods. Contacts with
Coulomb's law: sweeps over the bodies' twists, Newton's method, the interior-point method, all of them as `many.solve`
takes them in turn (the default), and on the dense matrix W = J M⁻¹ Jᵀ sweeps and Lemke's method with a pyramid of eight
directions in place of the cone. All start from no impulses. The residual is the natural-map residual of
`physics.kernels.contact_solver.gauss_seidel`, relative to the largest velocity without impulses, measured here on what
each returns.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from benchmarks import machine, problems
from physics.compiler.decorators import kernel
from physics.kernels.contact_solver.friction_pyramid import solve_pyramid_lcp
from physics.kernels.contact_solver.gauss_seidel import cone_sweeps, invert_contact_blocks, normal_sweeps
from physics.kernels.lcp.dantzig import dantzig, dantzig_sizes
from physics.kernels.lcp.lemke import lemke, lemke_sizes
from physics.kernels.lcp.scaling_and_certificate import LCP_SOLVED
from physics.kernels.multibody.solver.contact_operator import assemble_contact_blocks, max_contact_residual
from physics.kernels.multibody.solver.gauss_seidel import sweep_contacts
from physics.kernels.multibody.solver.interior_point import interior_point_contacts
from physics.kernels.multibody.solver.islands import find_islands
from physics.kernels.multibody.solver.proximal_newton import (
    MIN_NEWTON_STEPS,
    RESTING_BUDGET,
    newton_contacts,
    prepare_system,
)
from physics.kernels.multibody.solver.solve import NEWTON_RHO, clear_all_impulses, solve_contacts
from physics.kernels.state import layout as at
from physics.kernels.time_stepping.workspace import make_workspace
from rigid_env.lab.measure.machine import write_json
from rigid_env.terminal import Column, Table, make_console, number_columns

LIMIT = 1000  # sweeps, steps or iterations
PIVOTS = 10_000
TOLERANCE = 1e-6  # tolerance of the residual
FEATURES = 8  # contacts of one wall in a workspace
MOST_DENSE = 60  # contacts for which Lemke's method is given a matrix: ten unknowns each
SAMPLES, QUICK_SAMPLES = 7, 1
SAMPLE_TIME = 0.02  # of one sample at least [s]

CHAIN, SWEEPS, NEWTON, INTERIOR = range(4)


@dataclass(frozen=True)
class Outcome:
    """Outcome of one solver on one problem.

    Attributes
    ----------
    problem, solver : str
    contacts : int
        Or unknowns.
    iterations : int
        Sweeps, steps or pivots.
    residual : float or None
        Relative; None of a method that says that it found no solution, or returns what is no number.
    seconds : float
        Of one solve, median [s].
    """

    problem: str
    solver: str
    contacts: int
    iterations: int
    residual: float | None
    seconds: float


def timed(solve: Callable[[int], object], samples: int) -> float:
    """Median time of one solve [s]; `solve` makes as many as it is told."""
    solve(1)
    start, times = time.perf_counter(), []
    solve(1)
    count = max(1, int(SAMPLE_TIME / (time.perf_counter() - start))) if samples > 1 else 1
    for _ in range(samples):
        start = time.perf_counter()
        solve(count)
        times.append((time.perf_counter() - start) / count)
    return float(np.median(times))


# --- without friction --------------------------------------------------------------------------------------------


def _complementarity_solvers(
    problem: problems.Complementarity,
) -> dict[str, Callable[[], tuple[bool, int, np.ndarray]]]:
    """Solvers by name: () -> (whether one was found, iterations, z)."""
    M, q, n = problem.M, problem.q, len(problem.q)
    z = np.zeros(n)
    scratch = make_workspace(np.zeros((-(-n // FEATURES), at.WALL_SIZE)), FEATURES)[0]
    scratch["contacts"]["delassus"][:n, :n], scratch["contacts"]["bias"][:n] = M, q

    def sweeps():
        scratch["contacts"]["impulse"][:n] = 0.0
        count, _ = normal_sweeps(n, TOLERANCE * np.abs(q).max(), LIMIT, scratch["contacts"])
        return True, count, scratch["contacts"]["impulse"][:n]

    def pivots(method, sizes):
        shape, length = sizes(n)
        floats, integers = np.zeros(shape), np.zeros(length, dtype=np.int64)

        def solve():
            status, count = method(M, q, z, floats, integers, PIVOTS)
            return status == LCP_SOLVED, count, z

        return solve

    found = {"sweeps": sweeps, "Lemke": pivots(lemke, lemke_sizes)}
    if np.array_equal(M, M.T):
        found["Dantzig"] = pivots(dantzig, dantzig_sizes)
    return found


def without_friction(problem: problems.Complementarity, samples: int) -> list[Outcome]:
    """Every solver of linear complementarity problems on one."""
    outcomes = []
    for name, solve in _complementarity_solvers(problem).items():
        is_found, count, z = solve()
        with np.errstate(over="ignore", invalid="ignore"):  # sweeps may diverge where M is not symmetric
            residual = np.abs(np.minimum(z, problem.M @ z + problem.q)).max() / np.abs(problem.q).max()

        def often(times, solve=solve):
            for _ in range(times):
                solve()

        seconds = timed(often, samples)
        kept = float(residual) if is_found and np.isfinite(residual) else None
        outcomes.append(Outcome(problem.name, name, len(z), int(count), kept, seconds))
    return outcomes


# --- with friction -----------------------------------------------------------------------------------------------


@kernel
def _solve_island(method, part, residual, goal, limit, many):
    """Iterations of one method for one island; -1 where its linear system finds no room."""
    if method == SWEEPS:
        return sweep_contacts(part[0], part[1], True, residual, goal, limit, many)[0]
    if prepare_system(part, limit, RESTING_BUDGET, MIN_NEWTON_STEPS, many) < MIN_NEWTON_STEPS:
        return -1
    if method == INTERIOR:
        return interior_point_contacts(part, residual, goal, limit, many)
    return newton_contacts(part, True, residual, goal, limit, NEWTON_RHO[0], many)[0]


@kernel
def solve_bodies(method, times, n, twists, limit, many):
    """Solve so often from no impulses: (iterations or -1, relative residual) of the last time."""
    count, worst = 0, 0.0
    for _ in range(times):
        for b in range(twists.shape[0]):
            for c in range(6):
                many.bodies.twist[b, c] = many.bodies.free_twist[b, c] = twists[b, c]
        for k in range(n):
            many.islands.contacts[k] = k
        clear_all_impulses(n, many)
        if method == CHAIN:
            count, worst, _ = solve_contacts(n, True, many)
            continue
        scale, count = assemble_contact_blocks(n, many), 0
        for i in range(find_islands(n, many)):
            part = (
                many.islands.first_contact[i],
                many.islands.first_contact[i + 1],
                many.islands.first_body[i],
                many.islands.first_body[i + 1],
            )
            residual = max_contact_residual(part[0], part[1], True, many)
            more = _solve_island(method, part, residual, many.settings[0].tolerance * scale, limit, many)
            if more < 0:
                return -1, 1.0
            count = max(count, more)
        worst = max_contact_residual(0, n, True, many) / scale
    return count, worst


def _dense_scratch(problem: problems.Frictional):
    """A workspace with W, b and μ of a problem."""
    n, (J, inverse, b) = problem.count, problem.dense()
    scratch = make_workspace(np.zeros((-(-n // FEATURES), at.WALL_SIZE)), FEATURES)[0]
    scratch["contacts"]["delassus"][: 3 * n, : 3 * n], scratch["contacts"]["bias"][: 3 * n] = J @ inverse @ J.T, b
    scratch["contacts"]["friction"][:n] = problem.many.contacts.mu[:n]
    return scratch


def _residual_of_impulses(problem: problems.Frictional, p: np.ndarray) -> float:
    """Relative residual of impulses (3 n,), by the same kernel for all."""
    many, n = problem.many, problem.count
    many.bodies.twist[:], many.contacts.impulse[:n] = problem.twists, 0.0
    scale = assemble_contact_blocks(n, many)
    many.bodies.twist[:], many.contacts.impulse[:n] = problem.twists, p.reshape(n, 3)
    assemble_contact_blocks(n, many)
    return max_contact_residual(0, n, True, many) / scale


def with_friction(problem: problems.Frictional, samples: int) -> list[Outcome]:
    """Every solver of contacts with friction on one problem."""
    n, many, outcomes = problem.count, problem.many, []
    many.settings["tolerance"], many.settings["sweeps"], many.settings["residual_limit"] = TOLERANCE, LIMIT, np.inf
    for name, method in (("in turn", CHAIN), ("sweeps", SWEEPS), ("Newton", NEWTON), ("interior point", INTERIOR)):
        count, residual = solve_bodies(method, 1, n, problem.twists, LIMIT, many)
        if count < 0:
            continue
        seconds = timed(lambda k, m=method: solve_bodies(m, k, n, problem.twists, LIMIT, many), samples)
        outcomes.append(Outcome(problem.name, name, n, int(count), float(residual), seconds))
    if n > MOST_DENSE:
        return outcomes
    scratch = _dense_scratch(problem)
    goal = TOLERANCE * np.abs(scratch["contacts"]["bias"][: 3 * n]).max()

    def sweeps():
        scratch["contacts"]["impulse"][:] = scratch["solver"]["change"][:] = 0.0
        invert_contact_blocks(n, scratch)
        return cone_sweeps(n, scratch["contacts"]["friction"], goal, LIMIT, scratch)[0]

    def pyramid():
        scratch["contacts"]["impulse"][:] = 0.0
        W, b, mu, p = (scratch["contacts"][name] for name in ("delassus", "bias", "friction", "impulse"))
        floats, index = scratch["solver"]["fallback_float"], scratch["solver"]["fallback_int"]
        return solve_pyramid_lcp(W, b, mu, n, p, floats, index, PIVOTS)[1]

    for name, solve in (("sweeps, dense", sweeps), ("Lemke, pyramid", pyramid)):
        count = solve()
        residual = _residual_of_impulses(problem, np.array(scratch["contacts"]["impulse"][: 3 * n]))
        seconds = timed(lambda k, s=solve: [s() for _ in range(k)], samples)
        outcomes.append(Outcome(problem.name, name, n, int(count), float(residual), seconds))
    return outcomes


# --- all of them -------------------------------------------------------------------------------------------------


def table(title: str, outcomes: list[Outcome]) -> Table:
    """One row for each outcome."""
    contacts = Column("contacts", is_number=True)
    found = Table(["problem", contacts, "solver", *number_columns("iterations", "residual", "µs")], title)
    last = ""
    for o in outcomes:
        name, last = (o.problem if o.problem != last else ""), o.problem
        residual = "none found" if o.residual is None else f"{o.residual:.1e}"
        found.add_row(
            name, str(o.contacts) if name else "", o.solver, str(o.iterations), residual, f"{1e6 * o.seconds:.1f}"
        )
    return found


def main(
    json: Annotated[Path | None, typer.Option(help="Where to write the result.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Only see that it runs.")] = False,
) -> None:
    """Run every contact solver on the same problems and print time against residual."""
    console, samples = make_console(), QUICK_SAMPLES if quick else SAMPLES
    console.print(machine.headline())
    tables: dict[str, list[Outcome]] = {"linear complementarity": [], "Coulomb friction": []}
    with console.status("solving") as status:
        for problem in (*problems.textbook(), *problems.random_complementarity()):
            tables["linear complementarity"] += without_friction(problem, samples)
        for make in (problems.piles, problems.hard):
            for problem in make():
                status.update(problem.name)
                tables["Coulomb friction"] += with_friction(problem, samples)
    for title, outcomes in tables.items():
        console.print(table(title, outcomes))
    if json is not None:
        kept = {title: [asdict(o) for o in outcomes] for title, outcomes in tables.items()}
        write_json(json, {"name": "solvers", "is_quick": quick, "tolerance": TOLERANCE, **kept})


if __name__ == "__main__":
    typer.run(main)
