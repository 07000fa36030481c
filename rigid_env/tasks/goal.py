"""Goal-conditioned tasks: their observations contain the desired and the achieved goal."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from physics import validation
from physics.summary import shown
from rigid_env.tasks.entries import Entry, Observation
from rigid_env.tasks.task import Task

REWARDS = ("sparse", "dense")


class GoalTask(Task):
    """Goal-conditioned task: reward and success depend only on the desired and the achieved goal, two rows of numbers.

    So an algorithm can compute the reward for another desired goal, as hindsight experience replay does. Success does
    not end an episode, since the goal is to be kept.

    A subclass declares `goal_entries`, and defines `desired` and `shortfall`.

    Parameters
    ----------
    reward : {"sparse", "dense"}
        Sparse: 0 where the goal is reached, else -1. Dense: minus the shortfall, which is at most 1 at a reached goal.
    settings
        As of `Task`.

    Attributes
    ----------
    goal_entries : sequence of Entry
        Declared by the subclass: names, units and bounds of a goal's numbers. Their `read` gives the achieved goal.
    achieved_goal, desired_goal : (worlds, numbers) float32
        Goals of the running episodes, updated in place in each control step.

    References
    ----------
    Andrychowicz et al., *Hindsight experience replay*, NeurIPS 2017. Plappert et al., *Multi-goal reinforcement
    learning*, 2018, which has the form of the observation.
    """

    goal_entries: ClassVar[Sequence[Entry]]
    ends_on_success = False
    explanations: ClassVar = {
        "shortfall": "distance from the goal relative to its tolerance: at most 1 where the goal is reached",
        "reward_goal": "reward of achieved and desired goal",
    }

    def __init__(self, worlds: int = 1, *, reward: str = "sparse", **settings):
        self.reward = validation.one_of(reward, REWARDS, "reward")
        self._goals = Observation(self.goal_entries)
        worlds = validation.count(worlds, "worlds")
        self.achieved_goal = np.zeros((worlds, self._goals.size), dtype=np.float32)
        self.desired_goal = np.zeros_like(self.achieved_goal)
        super().__init__(worlds, **settings)

    @property
    def goals(self) -> Observation:
        """Entries of the numbers of a goal."""
        return self._goals

    @abstractmethod
    def desired(self, worlds) -> np.ndarray:
        """Desired goals (n, numbers) of the n worlds, in the units of `goal_entries`, before scaling.

        Observations contain them divided by the entries' scales and clipped to their bounds, as they do achieved goals.
        """

    @abstractmethod
    def shortfall(self, achieved: np.ndarray, desired: np.ndarray) -> np.ndarray:
        """Return the distance of an achieved goal from a desired one, relative to the tolerance.

        Parameters
        ----------
        achieved, desired : (..., numbers) float
            Goals as in observations: scaled and clipped.

        Returns
        -------
        (...,) float64
            0 where the goals are the same, at most 1 where the desired goal counts as reached.
        """

    def compute_reward(self, achieved_goal, desired_goal, info: Any = None) -> np.ndarray:
        """Reward for an achieved goal, given a desired goal.

        Parameters
        ----------
        achieved_goal, desired_goal : (..., numbers) array_like
            Goals as in observations.
        info : anything
            Ignored; Gymnasium's interface for goals passes it.

        Returns
        -------
        (...,) float64

        Raises
        ------
        ValueError
            Goals with a wrong number of entries.
        """
        shortfall = self._shortfall(achieved_goal, desired_goal)
        return np.where(shortfall <= 1.0, 0.0, -1.0) if self.reward == "sparse" else -shortfall

    def compute_terminated(self, achieved_goal, desired_goal, info: Any = None) -> np.ndarray:
        """Tell whether an achieved goal ends the episode, given a desired goal.

        Arguments and errors as of `compute_reward`.

        Returns
        -------
        (...,) bool
            True for reached goals if the class has ``ends_on_success``; else False.
        """
        return (self._shortfall(achieved_goal, desired_goal) <= 1.0) & self.ends_on_success

    def compute_truncated(self, achieved_goal, desired_goal, info: Any = None) -> np.ndarray:
        """Return False for every pair of goals, (...,) bool: only the limit of steps truncates an episode.

        Arguments and errors as of `compute_reward`.
        """
        return np.zeros_like(self._shortfall(achieved_goal, desired_goal), dtype=bool)

    def _shortfall(self, achieved_goal, desired_goal) -> np.ndarray:
        """Call `shortfall` after a check that both goals have the right number of entries."""
        achieved, desired = (np.asarray(goal, dtype=np.float64) for goal in (achieved_goal, desired_goal))
        size = self._goals.size
        for name, goal in (("achieved_goal", achieved), ("desired_goal", desired)):
            if goal.shape[-1:] != (size,):
                raise ValueError(f"{name} has shape {goal.shape}; allowed are {size} numbers along the last axis")
        return self.shortfall(achieved, desired)

    def is_reached(self, achieved_goal, desired_goal) -> np.ndarray:
        """Flags (...,) bool of goals that count as reached, for achieved and desired goals (..., numbers)."""
        achieved, desired = (np.asarray(goal, dtype=np.float64) for goal in (achieved_goal, desired_goal))
        return self.shortfall(achieved, desired) <= 1.0

    # --- functions that a task declares -------------------------------------------------------------------

    def measure(self, worlds):
        """Store the achieved and the desired goals of these worlds, and return the shortfall."""
        rows, goals = worlds.indices, self._goals
        achieved = np.empty((len(worlds), goals.size), dtype=np.float32)
        self._check_goals("achieved", goals.read(worlds, achieved), rows)
        desired = self.desired(worlds)
        self._check_goals("desired", desired, rows)
        self.achieved_goal[rows] = achieved
        self.desired_goal[rows] = np.clip(desired / goals.scales, goals.low, goals.high)
        return {"shortfall": self.shortfall(*self._both(rows))}

    def _check_goals(self, which: str, values: Any, rows: np.ndarray) -> None:
        """Raise a ValueError if goals of worlds `rows` are not finite or of a wrong shape; `which` names them."""
        name, shape = type(self).__name__, (len(rows), self._goals.size)
        if not isinstance(values, np.ndarray) or values.shape != shape or values.dtype.kind not in "fiub":
            given = f"{values.dtype} of shape {values.shape}" if isinstance(values, np.ndarray) else shown(values)
            raise ValueError(
                f"{which} of {name} gave {given}; allowed are numbers of shape {shape}, a row for each world"
            )
        bad = np.argwhere(~np.isfinite(values))
        if len(bad):
            row, column = bad[0]
            what = f"{which} goal {self._goals.names[column]!r} of {name} is {values[row, column]} in world {rows[row]}"
            raise ValueError(f"{what}; allowed are finite numbers")

    def success(self, worlds):
        """Success: the desired goal is reached."""
        return worlds.measured["shortfall"] <= 1.0

    def rewards(self, worlds):
        """Reward by `compute_reward` of the observed goals."""
        rows = worlds.indices
        return {"goal": self.compute_reward(self.achieved_goal[rows], self.desired_goal[rows])}

    def _both(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return self.achieved_goal[rows].astype(np.float64), self.desired_goal[rows].astype(np.float64)

    def own_settings(self):
        """Kind of reward, as a setting that must agree where a state is restored."""
        return {"reward": self.reward}

    def own_arrays(self):
        """Achieved and desired goals, as arrays that belong to the task's state."""
        return {"achieved goal": self.achieved_goal, "desired goal": self.desired_goal}

    def __getstate__(self):
        kept = super().__getstate__()
        del kept["_goals"]
        return kept

    def __setstate__(self, kept):
        self._goals = Observation(self.goal_entries)
        super().__setstate__(kept)
