"""Solvers on the same problems: what each must make of those that theory decides. No test asserts a time."""

import json

import pytest
import typer
from typer.testing import CliRunner

from benchmarks import problems, solvers

PIVOTING = ("Dantzig", "Lemke")


@pytest.mark.parametrize(
    "problem", [*problems.textbook(), *problems.random_complementarity()], ids=lambda problem: problem.name
)
def test_pivoting_solves_what_has_a_solution_and_says_so_of_what_has_none(problem):
    outcomes = {o.solver: o for o in solvers.without_friction(problem, samples=1)}
    for name in set(outcomes) & set(PIVOTING):
        if problem.is_feasible:
            # Rounding of M z, n terms each no larger than q for these: below 1e-12 with room for ten times more.
            assert outcomes[name].residual <= 1e-12
        else:
            assert outcomes[name].residual is None
    if not problem.is_feasible:
        assert outcomes["sweeps"].residual > solvers.TOLERANCE


@pytest.mark.exhaustive
def test_the_default_solves_what_sweeps_do_not():
    """1,000,000 kg on 1 kg: sweeps contract by 1 - 1e-6 each."""
    problem = next(p for p in problems.hard() if p.name == "1,000,000 kg on 1 kg")
    outcomes = {o.solver: o for o in solvers.with_friction(problem, samples=1)}
    assert outcomes["in turn"].residual <= solvers.TOLERANCE
    assert outcomes["sweeps"].residual > solvers.TOLERANCE
    assert outcomes["sweeps"].iterations == solvers.LIMIT
    # The same residual whichever kernel measures it: Lemke's solution, all contacts holding, is one of the cone's.
    assert outcomes["Lemke, pyramid"].residual <= solvers.TOLERANCE


@pytest.mark.exhaustive
def test_a_run_writes_what_it_found(tmp_path, monkeypatch):
    monkeypatch.setattr(problems, "hard", lambda: iter(()))
    monkeypatch.setattr(problems, "piles", lambda: iter((problems.pile(0, 2, 4, 0.2),)))
    app = typer.Typer()
    app.command()(solvers.main)
    found = CliRunner().invoke(app, ["--quick", "--json", str(tmp_path / "s.json")])
    assert found.exit_code == 0, found.output
    kept = json.loads((tmp_path / "s.json").read_text())
    assert len({o["solver"] for o in kept["Coulomb friction"]}) == 6
    assert all(o["seconds"] > 0 for o in kept["Coulomb friction"] + kept["linear complementarity"])
