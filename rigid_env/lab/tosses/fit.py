"""Fit the cube's parameters to measured tosses, one set of parameters for all tosses.

The fit minimises the mean over tosses and frames of the position error in cube widths plus half the rotation error in
radians: a rotation by θ moves the middle of a face by θ/2 cube widths. In some tosses a tiny change decides on which
face the cube lands, so this mean jumps with the parameters. Therefore it is averaged over the measured start and some
starts disturbed by the measurement's noise (`flight.disturb`), which are the same in every evaluation.

The search draws points in the box of the parameters, then runs Nelder and Mead's simplex from the best of them.
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

# Range in which each parameter is searched.
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
FIRST_SIMPLEX = 0.08  # edges of the first simplex, in widths of the box


@dataclass(frozen=True)
class Effort:
    """Number of evaluations in a search.

    Parameters
    ----------
    drawn : int
        Points drawn, per parameter.
    refining : int
        Evaluations of each simplex, per parameter.
    disturbed : int
        Disturbed starts per toss, in addition to the measured one.
    seed : int
        Seed of the drawn points and of the disturbances.
    """

    drawn: int = 60
    refining: int = 30
    disturbed: int = 3
    seed: int = 1

    def evaluations(self, parameters: int) -> int:
        """Largest number of evaluations for this number of parameters."""
        return parameters * (self.drawn + REFINED * self.refining)


QUICK = Effort(drawn=2, refining=1, disturbed=0)


@dataclass(frozen=True)
class Fit:
    """Result of a fit.

    Attributes
    ----------
    cube : Cube
        Best parameters.
    names : tuple of str
        Parameters that were fitted; the others were given.
    objective : float
        Mean error that the fit minimises, see the module [cube widths].
    evaluations : int
        Number of evaluations of the objective.
    is_complete : bool
        False if the search was interrupted; `cube` is the best until then.
    """

    cube: Cube
    names: tuple[str, ...]
    objective: float
    evaluations: int
    is_complete: bool

    def to_dict(self) -> dict:
        """Result as a dict for JSON."""
        return {
            "parameters": vars(self.cube), "fitted": list(self.names), "objective": self.objective,
            "evaluations": self.evaluations, "is_complete": self.is_complete,
        }  # fmt: skip


def check_names(names) -> tuple[str, ...]:
    """Check names of parameters to fit, and return them as a tuple.

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
        Tosses to fit, and no others.
    recording : Recording
        Measurement model of their recorded numbers.
    flight : Flight
        Noise that was measured from the same tosses.
    effort : Effort
    accuracy : str
        Preset of the replays.
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
        """Mean error of the replays with these parameters [cube widths]."""
        poses, _ = replay(self._lengths, self._starts(cube), cube, self.accuracy, self.threads)
        return mean_error(compare(self._measured, poses, self._offsets))

    def _starts(self, cube: Cube) -> Starts:
        begin = starts(self.tosses, cube, self.recording)
        rng = np.random.default_rng(self.effort.seed)
        every = [begin, *(disturb(begin, self.flight, rng) for _ in range(self.effort.disturbed))]
        return Starts(*(np.concatenate(parts) for parts in zip(*(vars(one).values() for one in every))))


class _Search:
    """Function of a point in the unit box that evaluates the objective there, and remembers the best point."""

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
        """Evaluate random points, then refine the best ones by the simplex method."""
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
    """Search the parameters `names` for which `objective` is smallest; other parameters are those of `nominal`.

    ``tick`` is called with the best value so far after each evaluation. Ctrl-C ends the search; the best result so far
    is returned, marked as incomplete. Before the end of the first evaluation there is no result, and the interrupt is
    raised.
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
