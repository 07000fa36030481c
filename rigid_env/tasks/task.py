"""Base class of tasks: their declaration, and the batch of worlds that runs them."""

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
from rigid_env.tasks.actions import ActionTable
from rigid_env.tasks.arguments import BatchArguments, ControlArguments, takes
from rigid_env.tasks.declaration import Declaration
from rigid_env.tasks.declaration_checks import check_class, check_views, checked_limit, refuse_same_keys
from rigid_env.tasks.distribution import Distribution
from rigid_env.tasks.disturbances import Disturbances, Push
from rigid_env.tasks.draws import Draws, check_draws
from rigid_env.tasks.entries import Observation
from rigid_env.tasks.functions import Functions
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
"""Names of attributes left out of copies: machine code, and functions of the class."""


@dataclass(frozen=True)
class _Arguments(ControlArguments, BatchArguments):
    draws: Mapping[str, Any] | None = field(default=None, kw_only=True)


class Task(Starts):
    """A batch of worlds of one scene, and the task set in them. Subclass it to set one of your own.

    A subclass declares the attributes below, and defines the functions that it needs of `place`, `begin`, `update`,
    `success`, `failure`, `rewards` and `measure`. They are NumPy functions of `Worlds`, arrays with one row for each
    world, and are called once in a control step. docs/tasks.md builds one from nothing.

    Parameters
    ----------
    worlds : int
        Size of the batch.
    accuracy : str, physics.Accuracy or mapping
        As of `physics.World`.
    effects : sequence of physics effects
        Added to the scene's; one of the same class replaces the scene's. What is drawn cannot be replaced. Each is an
        object or plain data as in a scene file, such as ``{"kind": "Drag", "coefficient": 0.2}``.
    draws : mapping, optional
        Distributions in place of the task's own of the same names; a number is fixed, a pair (low, high) uniform.
    frame_skip : int
        Physics steps per control step, with the action held.
    dt : float
        Physics step [s].
    dump_faults : str or Path, optional
        Folder for the last control steps of a world whose state did not stay finite; ``rigid-env replay`` takes them
        again. See `physics.Recorder`, which then keeps a copy of them all.
    threads : int
        Threads that share a step.

    Attributes
    ----------
    scene : physics.Scene
        Declared by the subclass.
    actions : sequence of Wrench, Force and Impulse
        Declared: who is acted upon and how.
    observation : sequence of Entry, or mapping of str to such
        Declared: `rigid_env.observe` has the usual ones. A mapping has the entries that each agent sees; the agents are
        those of `actions`.
    draws : mapping of str to Distribution, number or pair
        Declared: what each episode draws. ``mass``, ``size``, ``radius`` of spheres, ``friction``, ``restitution`` and
        ``gravity`` are given to the world (``mass[1]``: to body 1 alone), the rest is for the task's functions.
    memory : mapping of str to int
        Declared: numbers per world that functions keep from step to step, and how many each; zeros at the start.
    disturbances : sequence of Push and Gust
        Declared: what happens to bodies at random times.
    max_episode_steps : int or None
        Declared: control steps after which Gymnasium truncates an episode.
    ends_on_success : bool
        Declared: False lets an episode go on.
    world : physics.World
    generators : list of numpy.random.Generator or None
        One per world: an episode does not depend on the batch it runs in.
    drawn : dict of str to (worlds,) or (worlds, k) float64
        Values of the running episodes.
    obs : (worlds, entries) float32
    outcome : (worlds, 3 + infos) float64
        Reward, success, failure and the numbers of `info_names`, of the last step.
    status : (worlds,) int64
        Values of `physics.Status`, of the last step; OK at the start of an episode.

    Raises
    ------
    ValueError
        Naming the field, the value and what is allowed.
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
        self._table = ActionTable(self.actions, self.world.body_count)
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
        self.limits = np.zeros((worlds, len(self._table.vectors)))

    # --- the batch ----------------------------------------------------------------------------------------

    @property
    def worlds(self) -> int:
        """Size of the batch."""
        return self.world.worlds

    @property
    def drawn(self) -> dict[str, NDArray[np.float64]]:
        """Values of the running episodes, by name."""
        return self.episodes.now

    @property
    def distributions(self) -> dict[str, Distribution]:
        """Distributions of the episodes' draws, by name."""
        return self.episodes.distributions

    @property
    def wrench(self) -> NDArray[np.float64]:
        """Wrench (worlds, bodies, 6) float64 commanded by the last action: force [N], torque [N m], world frame."""
        return self._advance.wrench

    @property
    def load(self) -> NDArray[np.float64]:
        """Load (worlds, bodies, 6) float64: `wrench` plus the gusts of the last step."""
        return self.wrench if self.disturbed is None else self.wrench + self.disturbed.load

    @property
    def control_dt(self) -> float:
        """Time between two actions [s]."""
        return self.frame_skip * self.world.dt

    @property
    def steps(self) -> NDArray[np.int64]:
        """(worlds,) int64. Control steps since each episode began."""
        return self.clock - self._began

    @property
    def action_size(self) -> int:
        """Numbers of an action."""
        return self._table.size

    @property
    def has_impulses(self) -> bool:
        """True if an action may contain an impulse."""
        return self._advance.kick is not self._advance.wrench

    @cached_property
    def rollout_loop(self) -> RolloutLoop:
        """Loop of a compiled task's rollouts, made with the first rollout."""
        return RolloutLoop(self.world, self.wrench, self.frame_skip, self.world.dt)

    @cached_property
    def rollout_observers(self) -> list[BoundCall]:
        """Calls that observe the worlds that each thread of that loop has stepped."""
        return [self.observer(taken) for taken in self.rollout_loop.taken]

    @property
    def action_vectors(self) -> list:
        """Forces, torques and impulses made from an action's numbers, in their order."""
        return self._table.vectors

    def lines(self, world: int) -> tuple[str, ...]:
        """Lines of text for pictures of one world: the numbers that the task measures."""
        values = self.outcome[world, col.INFO :].tolist()
        return tuple(f"{name} {value:.2f}" for name, value in zip(self.measures, values))

    def inv_mass(self, world: int, body: int) -> float:
        """Inverse mass of one body [1/kg]."""
        return float(self.world.params[world * self.world.body_count + body, at.INV_MASS])

    @property
    def action_text(self) -> str:
        """Vectors of an action, in words."""
        return ", ".join(vector.text for vector in self._table.vectors)

    @property
    def agents(self) -> dict[str, np.ndarray]:
        """Numbers of an action that belong to each agent."""
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
            Actions of the wrong shape or not finite, or a function of the task that gives what it may not. Nothing has
            changed then.
        """
        self.apply(shaped(actions, self.action.shape, "actions"))

    def apply(self, actions: np.ndarray) -> None:
        """Take a `step` with an array of the right shape; the axis of a single world may be missing."""
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
        """Restore the state before the last control step, after a start that raised an error."""
        if self._undo is not None:
            self._undo.undo()

    def not_finite(self, world: int) -> ValueError:
        """Error for an action in `given` that is not finite, with its world."""
        return ValueError(f"action of world {world} is {self.given[world].tolist()}; allowed are finite numbers")

    def act(self) -> None:
        """Advance the worlds by one control step, under the actions in `given`."""
        bad = self._write_wrenches(*self._write_arguments)
        if bad >= 0:
            raise self.not_finite(bad)
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
        """Bind machine code and views of arrays, which belong to this process."""
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
        """Arrays that decide the future of episodes, apart from the world's, by name; each has a row for each world."""
        return {**self.kept_arrays, "steps": self.steps}

    @cached_property
    def settings_of_state(self) -> dict[str, Any]:
        """Settings that must agree where a state is restored, by name."""
        return state_settings(self)

    def own_settings(self) -> dict[str, Any]:
        """Settings of a kind of tasks that decide the future of episodes, by name; a state needs equal ones.

        They need not include scene, actions and time.
        """
        return {}

    def own_arrays(self) -> dict[str, np.ndarray]:
        """Further arrays of a kind of tasks that a step renews, by name, with a row for each world."""
        return {}

    def set_outcome(self, outcome: np.ndarray) -> None:
        """Take an array for outcomes, once the number of their numbers is known."""
        self.outcome = self.kept_arrays["outcome"] = outcome

    def adopt(self, rows: np.ndarray, steps: np.ndarray) -> None:
        """Take over the number of control steps (n,) of the episodes in worlds `rows`."""
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
        """Return the kernel that observes the worlds of a list, such as a thread has stepped."""
        arguments = (taken, self.world.state, self.record, self.world.walls, self.action, self.obs, self.outcome)
        compiled_task: Any = self.compiled
        return bound_alike(None, compiled_task, *arguments)


def shaped(given: ArrayLike, shape: tuple[int, ...], name: str) -> np.ndarray:
    """Return actions as an array of this shape.

    Raises
    ------
    ValueError
        Parts of different lengths, or another shape; tells the argument's `name`.
    """
    try:
        array = np.asarray(given)
    except ValueError:  # parts of different lengths
        raise ValueError(f"{name} is {reprlib.repr(given)}; allowed is shape {shape}") from None
    if array.shape != shape:
        shown = f" ({reprlib.repr(array.item())})" if array.ndim == 0 else ""
        raise ValueError(f"{name} has shape {array.shape}{shown}; allowed is shape {shape}")
    return array
