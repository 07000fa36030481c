"""Fit the cube's parameters to measured tosses, one set of parameters for all.

The fit minimises the mean over tosses and frames of the position error in cube widths plus half the rotation error in
radians: a turn by θ moves the middle of a face by θ/2 cube widths. Which face a cube lands on hangs on a hair in some
tosses, so that this mean jumps with the parameters; it is therefore averaged over the start as measured and some starts
disturbed by the measurement's noise (`flight.disturb`), the same ones in every evaluation.

The search: points drawn in the box of the parameters, then Nelder and Mead's simplex from the best of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from rigid_env.lab.tosses.data import Tosses
from rigid_env.lab.tosses.flight import Flight, disturb
from rigid_env.lab.tosses.metric import Errors, compare
from rigid_env.lab.tosses.replay import Cube, Recording, Starts, replay, starts

# Where each parameter is searched.
BOUNDS = {
    "friction": (0.05, 0.4),
    "restitution": (0.0, 0.6),
    "side": (0.095, 0.110),  # [m]
    "inertia": (0.0005, 0.0020),  # [kg m²]
    "gravity": (9.0, 10.0),  # [m/s²]
    "table": (-0.004, 0.004),  # [m]
    "heavy_x": (-0.010, 0.010),  # [m]
    "heavy_y": (-0.010, 0.010),  # [m]
    "heavy_z": (-0.010, 0.010),  # [m]
}

NOMINAL = Cube()

REFINED = 3  # points from which the simplex starts
FIRST_SIMPLEX = 0.08  # its first edges, in widths of the box


@dataclass(frozen=True)
class Effort:
    """Effort of a search.

    Parameters
    ----------
    drawn : int
        Points drawn, per parameter.
    refining : int
        Evaluations of each simplex, per parameter.
    disturbed : int
        Disturbed starts per toss, beside the measured one.
    seed : int
    """

    drawn: int = 60
    refining: int = 30
    disturbed: int = 3
    seed: int = 1

    def evaluations(self, parameters: int) -> int:
        """Largest number of evaluations for so many parameters."""
        return parameters * (self.drawn + REFINED * self.refining)


QUICK = Effort(drawn=2, refining=1, disturbed=0)


@dataclass(frozen=True)
class Fit:
    """The best parameters found.

    Attributes
    ----------
    cube : Cube
    names : tuple of str
        Of the parameters that were fitted; the others have their nominal values, or those the fit was given.
    objective : float
        See the module [cube widths].
    evaluations : int
    is_complete : bool
        False: interrupted; `cube` is the best until then.
    """

    cube: Cube
    names: tuple[str, ...]
    objective: float
    evaluations: int
    is_complete: bool

    def to_dict(self) -> dict:
        """For JSON."""
        return {
            "parameters": vars(self.cube), "fitted": list(self.names), "objective": self.objective,
            "evaluations": self.evaluations, "is_complete": self.is_complete,
        }  # fmt: skip


def check_names(names) -> tuple[str, ...]:
    """Names of parameters to fit, each once.

    Raises
    ------
    ValueError
        An unknown name, one given twice, or none.
    """
    names = tuple(names)
    if not names or len(set(names)) < len(names) or set(names) - set(BOUNDS):
        raise ValueError(f"parameters to fit are {', '.join(names)!r}; allowed are {', '.join(BOUNDS)}, each once")
    return names


def mean_error(errors: Errors) -> float:
    """Mean error of one replay, which the fit minimises [cube widths]."""
    position, rotation = errors.per_toss()
    return float(position.mean() + 0.5 * np.radians(rotation).mean())


class Objective:
    """Objective of the fit, as a function of the parameters.

    Parameters
    ----------
    tosses : Tosses
        Those to fit, and no others.
    recording : Recording
    flight : Flight
        Measured from the same tosses.
    effort : Effort
    accuracy : str
    threads : int
    """

    def __init__(self, tosses: Tosses, recording: Recording, flight: Flight, effort: Effort, accuracy="balanced",
                 threads: int = 1):  # fmt: skip
        self.tosses, self.recording, self.flight, self.effort = tosses, recording, flight, effort
        self.accuracy, self.threads = accuracy, threads
        self._measured = np.tile(recording.lengths(tosses.states), (effort.disturbed + 1, 1))
        self._lengths = np.tile(tosses.lengths, effort.disturbed + 1)
        self._offsets = np.concatenate(([0], np.cumsum(self._lengths)))

    def __call__(self, cube: Cube) -> float:
        """Mean error [cube widths]."""
        poses, _ = replay(self._lengths, self._starts(cube), cube, self.accuracy, self.threads)
        return mean_error(compare(self._measured, poses, self._offsets))

    def _starts(self, cube: Cube) -> Starts:
        begin = starts(self.tosses, cube, self.recording)
        rng = np.random.default_rng(self.effort.seed)
        every = [begin, *(disturb(begin, self.flight, rng) for _ in range(self.effort.disturbed))]
        return Starts(*(np.concatenate(parts) for parts in zip(*(vars(one).values() for one in every))))


class _Search:
    """Evaluates points of the unit box and remembers the best."""

    def __init__(self, objective: Callable[[Cube], float], names: tuple[str, ...], tick: Callable[[float], None],
                 nominal: Cube):  # fmt: skip
        self.objective, self.names, self.tick, self.nominal = objective, names, tick, nominal
        self.low, self.high = np.array([BOUNDS[name] for name in names]).T
        self.best, self.cube, self.count = np.inf, nominal, 0

    def __call__(self, point: np.ndarray) -> float:
        values = self.low + np.clip(point, 0.0, 1.0) * (self.high - self.low)
        cube = replace(self.nominal, **dict(zip(self.names, values.tolist())))
        found = self.objective(cube)
        self.count += 1
        if found < self.best:
            self.best, self.cube = found, cube
        self.tick(self.best)
        return found

    def run(self, effort: Effort) -> None:
        """Draw points at random, then refine the best."""
        size = len(self.names)
        points = np.random.default_rng(effort.seed).random((size * effort.drawn, size))
        order = np.argsort([self(point) for point in points], kind="stable")
        for start in points[order[:REFINED]]:
            simplex = np.vstack([start, start + FIRST_SIMPLEX * np.where(start < 0.5, 1.0, -1.0) * np.eye(size)])
            options = {"initial_simplex": simplex, "maxfev": size * effort.refining, "xatol": 1e-4, "fatol": 1e-6}
            minimize(self, start, method="Nelder-Mead", bounds=[(0.0, 1.0)] * size, options=options)


def fit(
    objective: Callable[[Cube], float],
    names: tuple[str, ...],
    effort: Effort,
    tick: Callable[[float], None] = lambda best: None,
    nominal: Cube = NOMINAL,
) -> Fit:
    """Search the parameters `names` with the least `objective`; ``tick`` gets the best so far after each evaluation.

    Other parameters are those of `nominal`.

    Ctrl-C ends the search; the best so far is returned, marked as incomplete. Before the end of the first evaluation
    there is no result, and the interrupt is raised.
    """
    search = _Search(objective, check_names(names), tick, nominal)
    is_complete = True
    try:
        search.run(effort)
    except KeyboardInterrupt:
        if not search.count:
            raise
        is_complete = False
    return Fit(search.cube, search.names, search.best, search.count, is_complete)
