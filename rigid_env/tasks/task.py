"""Base class of tasks: a declaration, and the batch of worlds in which it runs."""

from __future__ import annotations

import reprlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

import physics
from physics import validation
from physics.kernels.state import layout as at
from physics.parallel.bound_call import BoundCall, bound_alike, compiled
from physics.world.report import gravest
from physics.world.rollout_loop import RolloutLoop
from rigid_env.tasks import layout as col
from rigid_env.tasks.action_table import ActionTable, drive_bodies
from rigid_env.tasks.arguments import BatchArguments, ControlArguments, takes
from rigid_env.tasks.declaration import Declaration
from rigid_env.tasks.declaration_checks import check_class, check_views, checked_limit, refuse_same_keys
from rigid_env.tasks.distribution import Distribution
from rigid_env.tasks.disturbances import Disturbances, Push
from rigid_env.tasks.draws import Draws, check_draws
from rigid_env.tasks.entries import Observation
from rigid_env.tasks.functions import Functions
from rigid_env.tasks.meanings import check_explanations
from rigid_env.tasks.options import require_known
from rigid_env.tasks.replacing import checked_effects
from rigid_env.tasks.starts import Starts, distributions_of
from rigid_env.tasks.state_settings import state_settings
from rigid_env.tasks.step_undo import StepUndo
from rigid_env.tasks.steps import Steps
from rigid_env.tasks.wrenches import write_wrenches

OF_PROCESS = (
    "_undo", "_functions", "_write_arguments", "_write_wrenches", "kept_arrays", "observed", "rollout_loop",
    "rollout_observers",
)  # fmt: skip
"""Attributes that a copy or a pickled task leaves out and makes anew: machine code, and functions of the class."""


@dataclass(frozen=True)
class _Arguments(ControlArguments, BatchArguments):
    draws: Mapping[str, Any] | None = field(default=None, kw_only=True)


class Task(Starts):
    """A batch of worlds of one scene, with a task of reinforcement learning in them; subclass it to write your own.

    A subclass declares the attributes below. Of the functions `place`, `begin`, `update`, `success`, `failure`,
    `rewards` and `measure` it defines those that it needs. These are NumPy functions of `Worlds`, arrays with one row
    for each world, and are called once in a control step. docs/tasks.md builds a task from nothing.

    Parameters
    ----------
    worlds : int
        Size of the batch.
    accuracy : str, physics.Accuracy or mapping
        Name of a preset, or settings; as of `physics.World`.
    effects : sequence of physics effects
        Effects that are added to the scene's; one of the same class replaces the scene's. An effect must not fix a
        parameter that is drawn. Each is an object or plain data as in a scene file, such as
        ``{"kind": "Drag", "coefficient": 0.2}``.
    draws : mapping, optional
        Distributions in place of the task's own of the same names; a number is fixed, a pair (low, high) uniform.
    frame_skip : int
        Physics steps per control step, with the action held.
    dt : float
        Physics step [s].
    dump_faults : str or Path, optional
        Folder for recordings: when a world's state is no longer finite, its last control steps are written there, and
        ``rigid-env replay`` repeats them. `physics.Recorder` copies each control step for it.
    threads : int
        Threads that share a step.

    Attributes
    ----------
    scene : physics.Scene
        Declared by the subclass.
    actions : sequence of Wrench, Force, Impulse and Drive
        Declared: how the numbers of an action act on which bodies.
    observation : sequence of Entry, or mapping of str to such
        Declared: `rigid_env.observe` has the usual entries. A mapping has the entries that each agent sees; the agents
        are those of `actions`.
    draws : mapping of str to Distribution, number or pair
        Declared: values that each episode draws. ``mass``, ``size``, ``radius`` of spheres, ``friction``,
        ``restitution`` and ``gravity`` are written into the world (``mass[1]``: of body 1 alone); the task's functions
        use the others.
    memory : mapping of str to int
        Declared: names of the numbers that functions keep from step to step, each with its count per world. They are
        zero at the start of an episode.
    disturbances : sequence of Push and Gust
        Declared: impulses and forces on bodies at random times.
    max_episode_steps : int or None
        Declared: control steps after which Gymnasium truncates an episode.
    ends_on_success : bool
        Declared: False lets an episode continue after success.
    explanations : mapping of str to str
        Declared: explanations of measures, draws and terms of the reward, for documentation; see `Declaration`.
    world : physics.World
        All worlds of the batch.
    generators : list of numpy.random.Generator or None
        One for each world, so that an episode does not depend on the batch that it runs in.
    drawn : dict of str to (worlds,) or (worlds, k) float64
        Drawn values of the running episodes.
    obs : (worlds, entries) float32
        Observations after the last step.
    outcome : (worlds, 3 + infos) float64
        Reward, success, failure and the numbers of `info_names`, of the last step.
    status : (worlds,) int64
        Values of `physics.Status`, of the last step; OK at the start of an episode.

    Raises
    ------
    ValueError
        The message names the field, its value and what is allowed.
    """

    @takes(_Arguments)
    def __init__(self, given: _Arguments) -> None:
        self.frame_skip = validation.count(given.frame_skip, "frame_skip")
        checked_limit(self.max_episode_steps, f"max_episode_steps of {type(self).__name__}")
        distributions = distributions_of(self.declared_draws(), given.draws)
        varied = [name for name, each in distributions.items() if not each.is_fixed]
        self.effects = checked_effects(given.effects, varied)
        scene = self._scene(distributions)
        self.world = physics.World(scene, given.worlds, given.dt, given.accuracy, given.threads)
        check_draws(type(self).__name__, distributions, self.world)
        self._check_starts()
        bodies = self.world.scene.bodies
        self._own_starts = {
            name: np.array([getattr(body, name) for body in bodies]) for name in ("pos", "quat", "linvel", "angvel")
        }
        self.generators: list[np.random.Generator | None] = [None] * self.worlds
        self.episodes = Draws(distributions, self.worlds)
        self.episodes.varying |= self._unlike_scene()
        self._table = ActionTable(self.actions, self.world.scene.bodies)
        self.observed = Observation(self.observation)
        check_views(type(self).__name__, self.observed.views, self.agents)
        self.clock, self._began = 0, np.zeros(self.worlds, dtype=np.int64)
        self._allocate()
        disturbances = self.disturbances if isinstance(self.disturbances, (list, tuple)) else (self.disturbances,)
        self._advance = Steps(
            self.world, self.frame_skip, self._table.has_impulses, any(isinstance(each, Push) for each in disturbances),
            self.observer if self.compiled else None,
        )  # fmt: skip
        if given.dump_faults is not None:
            physics.Recorder(self.world, folder=given.dump_faults)
        self.disturbed = Disturbances(disturbances, self) if disturbances else None
        self._note_parameters(np.arange(self.worlds))
        self.outcome = np.zeros((self.worlds, col.INFO + len(self.measures) + len(self.terms)))
        self._prepare()
        self._functions = None if self.compiled else Functions(self)
        self._undo = self._keeper()
        self.info_names = (*self.measures, *(f"reward_{term}" for term in self.terms))
        refuse_same_keys(type(self).__name__, self.info_names, self.drawn)
        check_explanations(self, (*self.info_names, *self.drawn))

    def __init_subclass__(cls, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        check_class(cls, Task, Declaration)

    def _allocate(self) -> None:
        worlds, bodies = self.worlds, self.world.body_count
        size = worlds, self._table.size
        self.action, self.previous_action, self.given = (np.zeros(size) for _ in range(3))
        require_known(self.memory, self.memory, "memory")
        self.memory_arrays = {
            name: np.zeros(worlds if validation.count(size, f"memory {name}") == 1 else (worlds, size))
            for name, size in self.memory.items()
        }
        self.record = np.zeros((worlds, self.record_size))
        self.obs = np.zeros((worlds, self.observed.size), dtype=np.float32)
        self.status = np.zeros(worlds, dtype=np.int64)
        self.weights = np.zeros((worlds, bodies))
        self.limits = np.zeros((worlds, len(self._table.loads)))

    # --- the batch ----------------------------------------------------------------------------------------

    @property
    def worlds(self) -> int:
        """Number of worlds in the batch."""
        return self.world.worlds

    @property
    def drawn(self) -> dict[str, NDArray[np.float64]]:
        """Drawn values of the running episodes, by name: (worlds,) or (worlds, k) each."""
        return self.episodes.now

    @property
    def distributions(self) -> dict[str, Distribution]:
        """Distributions that episodes draw from, by name."""
        return self.episodes.distributions

    @property
    def wrench(self) -> NDArray[np.float64]:
        """Wrench (worlds, bodies, 6) float64 commanded by the last action: force [N], torque [N m], world frame."""
        return self._advance.wrench

    @property
    def load(self) -> NDArray[np.float64]:
        """Load (worlds, bodies, 6) float64 on the bodies: `wrench` plus the gusts of the last control step."""
        return self.wrench if self.disturbed is None else self.wrench + self.disturbed.load

    @property
    def control_dt(self) -> float:
        """Time between two actions [s]."""
        return self.frame_skip * self.world.dt

    @property
    def steps(self) -> NDArray[np.int64]:
        """Control steps (worlds,) int64 since each world's episode began."""
        return self.clock - self._began

    @property
    def action_size(self) -> int:
        """Length of an action."""
        return self._table.size

    @property
    def is_driving(self) -> bool:
        """True if actions set the motions of driven bodies."""
        return bool(self._table.drives)

    @property
    def has_impulses(self) -> bool:
        """True if an action may contain an impulse."""
        return self._advance.kick is not self._advance.wrench

    @cached_property
    def rollout_loop(self) -> RolloutLoop:
        """Loop that runs rollouts of a compiled task in machine code; the first rollout makes it."""
        return RolloutLoop(self.world, self.wrench, self.frame_skip, self.world.dt)

    @cached_property
    def rollout_observers(self) -> list[BoundCall]:
        """Calls that observe worlds in `rollout_loop`: one for each thread, for the worlds that it has stepped."""
        return [self.observer(taken) for taken in self.rollout_loop.taken]

    @property
    def action_vectors(self) -> list:
        """Forces, torques, impulses, velocities and spins that an action sets, in the order of its numbers."""
        return self._table.vectors

    def lines(self, world: int) -> tuple[str, ...]:
        """Lines of text beside pictures of one world: the measures of the task after the last step."""
        values = self.outcome[world, col.INFO :].tolist()
        return tuple(f"{name} {value:.2f}" for name, value in zip(self.measures, values))

    def inv_mass(self, world: int, body: int) -> float:
        """Inverse mass of one body in one world [1/kg]."""
        return float(self.world.params[world * self.world.body_count + body, at.INV_MASS])

    @property
    def action_text(self) -> str:
        """Description in words of the vectors that an action sets."""
        return ", ".join(vector.text for vector in self._table.vectors)

    @property
    def agents(self) -> dict[str, np.ndarray]:
        """Indices of the action's numbers that each agent chooses, by the agent's name."""
        return self._table.agents

    # --- control steps ------------------------------------------------------------------------------------

    def step(self, actions: ArrayLike) -> None:
        """Hold actions for `frame_skip` physics steps, then observe.

        Parameters
        ----------
        actions : (worlds, action_size) array_like
            Clipped to ±1; see `rigid_env.tasks.actions`.

        Raises
        ------
        ValueError
            Actions of the wrong shape or not finite, or a wrong result of a function of the task. Nothing has changed
            then.
        """
        self.apply(shaped(actions, self.action.shape, "actions"))

    def apply(self, actions: np.ndarray) -> None:
        """Do the work of `step` for an array of the right shape; for a single world, its axis may be missing."""
        if actions.dtype.kind not in "fiub":
            raise ValueError(f"actions is {reprlib.repr(actions.tolist())}; allowed are numbers")
        if self._functions is not None:
            self._functions.step(actions)
            return
        if self._undo is not None:
            self._undo.keep()
        self.given[...] = actions
        self.act()

    def _keeper(self) -> StepUndo | None:
        if self._functions is not None:
            return self._functions.undo
        return StepUndo(self) if self.may_fail else None

    def undo_step(self) -> None:
        """Restore the state before the last control step, after the start of a new episode has raised an error."""
        if self._undo is not None:
            self._undo.undo()

    def not_finite(self, world: int) -> ValueError:
        """Make the error for an action of a world that is not finite."""
        return ValueError(f"action of world {world} is {self.given[world].tolist()}; allowed are finite numbers")

    def act(self) -> None:
        """Advance the worlds by one control step under the actions in the array `given`, without observing them."""
        bad = self._write_wrenches(*self._write_arguments)
        if bad >= 0:
            raise self.not_finite(bad)
        if self._table.drives:
            drive_bodies(self.world, self._table.drives, self.given)
        advance = self._advance
        if self.disturbed is None:
            advance.advance()
        else:
            advance.advance_disturbed(*self.disturbed.act())
        gravest(self.world.report_table, self.status)
        if advance.has_first:
            advance.note_first(self.status)
        self.clock += 1

    def _prepare(self) -> None:
        """Make the objects that cannot be pickled: kernels bound to arrays, and the dict of arrays for states."""
        table, advance = self._table, self._advance
        self.wrench_arguments = (
            self.action, table.table, table.points, self.limits, self.world.state, advance.wrench, advance.kick
        )  # fmt: skip
        self._write_arguments = self.given, *self.wrench_arguments
        self._write_wrenches = compiled(write_wrenches, self._write_arguments)
        self.kept_arrays: dict[str, Any] = {
            "action": self.action, "previous action": self.previous_action, "record": self.record, "obs": self.obs,
            "outcome": self.outcome, "status": self.status, "wrench": self.wrench, "weights": self.weights,
            "limits": self.limits, **({} if self.disturbed is None else self.disturbed.arrays),
            **self.own_arrays(),
            **{f"drawn {name}": array for name, array in self.drawn.items()},
            **{f"memory {name}": array for name, array in self.memory_arrays.items()},
        }  # fmt: skip

    def state_arrays(self) -> dict[str, np.ndarray]:
        """Arrays of the task, without those of the world, that decide the future of episodes; a row per world."""
        return {**self.kept_arrays, "steps": self.steps}

    @cached_property
    def settings_of_state(self) -> dict[str, Any]:
        """Settings that a state and the task that restores it must share, by name."""
        return state_settings(self)

    def own_settings(self) -> dict[str, Any]:
        """Further settings that a state and the task that restores it must share, by name; subclasses override it.

        Scene, actions and time steps are compared anyway.
        """
        return {}

    def own_arrays(self) -> dict[str, np.ndarray]:
        """Further arrays that a control step changes, by name, a row for each world; subclasses override it."""
        return {}

    def set_outcome(self, outcome: np.ndarray) -> None:
        """Replace the array `outcome`, once the first call of the task's functions has shown its number of columns."""
        self.outcome = self.kept_arrays["outcome"] = outcome

    def adopt(self, rows: np.ndarray, steps: np.ndarray) -> None:
        """Set the control steps (n,) that the episodes in worlds `rows` have taken, after a state was restored."""
        self._began[rows] = self.clock - steps

    def __getstate__(self):
        kept = dict(vars(self))
        for name in OF_PROCESS:
            kept.pop(name, None)
        return kept

    def __setstate__(self, kept):
        vars(self).update(kept)
        self.observed = Observation(self.observation)
        self._prepare()
        self._functions = None if self.compiled else Functions(self, is_first=False)
        self._undo = self._keeper()

    def observer(self, taken: np.ndarray) -> BoundCall:
        """Return a prepared call of the task's kernel, which observes the worlds listed in `taken`.

        `taken` is a list of worlds as in `physics.kernels.parallel.work_stealing`, such as those that a thread has
        stepped.
        """
        arguments = (taken, self.world.state, self.record, self.world.walls, self.action, self.obs, self.outcome)
        compiled_task: Any = self.compiled
        return bound_alike(None, compiled_task, *arguments)


def shaped(given: ArrayLike, shape: tuple[int, ...], name: str) -> np.ndarray:
    """Convert actions to an array, and check its shape.

    Raises
    ------
    ValueError
        Parts of different lengths, or a shape other than `shape`; the message contains the argument's `name`.
    """
    try:
        array = np.asarray(given)
    except ValueError:  # parts of different lengths
        raise ValueError(f"{name} is {reprlib.repr(given)}; allowed is shape {shape}") from None
    if array.shape != shape:
        shown = f" ({reprlib.repr(array.item())})" if array.ndim == 0 else ""
        raise ValueError(f"{name} has shape {array.shape}{shown}; allowed is shape {shape}")
    return array
