"""The fit finds what is known, keeps what it has when interrupted, and refuses what it cannot fit."""

import numpy as np
import pytest

from rigid_env.lab.tosses.fit import BOUNDS, Effort, Objective, check_names, fit
from rigid_env.lab.tosses.flight import measure_flight
from rigid_env.lab.tosses.replay import Cube, Recording


def test_fit_finds_the_friction_and_restitution_of_the_engines_own_tosses(made, true_cube):
    effort = Effort(drawn=40, refining=40, disturbed=0)
    objective = Objective(made, Recording(), measure_flight(made), effort)
    told = []
    found = fit(objective, ("friction", "restitution"), effort, told.append)
    assert found.is_complete
    assert found.evaluations == len(told) <= effort.evaluations(2)
    assert found.objective == min(told) == told[-1]
    assert found.cube.friction == pytest.approx(true_cube.friction, abs=1e-3)
    assert found.cube.restitution == pytest.approx(true_cube.restitution, abs=1e-3)
    # the others keep their nominal values
    assert found.cube.side == Cube().side


def test_same_seed_same_fit(made):
    effort = Effort(drawn=4, refining=3, disturbed=1)
    objective = Objective(made, Recording(), measure_flight(made), effort)
    assert fit(objective, ("friction",), effort) == fit(objective, ("friction",), effort)


def test_interrupted_fit_keeps_the_best(made):
    count = 0

    def objective(cube):
        nonlocal count
        count += 1
        if count == 8:
            raise KeyboardInterrupt
        return abs(cube.friction - 0.2)

    found = fit(objective, ("friction",), Effort())
    assert not found.is_complete
    assert found.evaluations == 7
    assert found.objective == abs(found.cube.friction - 0.2)


def test_interrupt_before_the_first_evaluation_goes_on():
    def objective(cube):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fit(objective, ("friction",), Effort())


def test_parameters_stay_in_their_bounds():
    seen = []

    def objective(cube):
        seen.append((cube.friction, cube.table))
        return -cube.friction - cube.table

    found = fit(objective, ("friction", "table"), Effort())
    low, high = np.array([BOUNDS["friction"], BOUNDS["table"]]).T
    assert (np.array(seen) >= low - 1e-15).all()
    assert (np.array(seen) <= high + 1e-15).all()
    np.testing.assert_allclose((found.cube.friction, found.cube.table), high, atol=1e-4)


@pytest.mark.parametrize("names", [(), ("mass",), ("side", "side")])
def test_wrong_names_are_told(names):
    with pytest.raises(ValueError, match="allowed are friction, restitution"):
        check_names(names)
