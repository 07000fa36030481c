"""Base of the tasks: the batch of worlds, starts, actions, and the order of stages in a control step."""

from __future__ import annotations

import reprlib
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import ClassVar

import numpy as np
from gymnasium.utils import seeding

import physics
from physics import validation
from physics.parallel.bound_call import bound
from physics.parallel.team import listed
from physics.world.report import gravest
from rigid_env.tasks import layout as col
from rigid_env.tasks import start
from rigid_env.tasks.area import Area
from rigid_env.tasks.entries import Entry
from rigid_env.tasks.kernels import AXES, wrenches
from rigid_env.tasks.options import START_OPTIONS, read_options, read_parameter
from rigid_env.tasks.parameters import DRAW_COUNT, LENGTHS, Parameters
from rigid_env.tasks.replacing import checked_effects, refuse_replaced, replaced
from rigid_env.tasks.values import EpisodeValues

FORCE_SHARE = 0.9
"""Longest force over the block's weight m g: less than 1, so that the agent cannot fly."""

TORQUE_SHARE = 0.5
"""Longest torque over m g times the longest half edge. To tip the block a torque alone must exceed m g times
the half edge that the centre has to pass over: this one tips the 5 x 3 x 2 m block when that is its shortest,
and is too weak for the others without the force's help, momentum, or a wall."""

GOAL_DRAWS = 2  # uniform numbers per episode for the goal; a task may leave some unused
DRAWS = col.START_SIZE + GOAL_DRAWS + DRAW_COUNT


class Task(ABC):
    """A batch of worlds with one block each, and the task set in them.

    Subclasses say what a goal is (`_set_goals`), and observe with one compiled kernel (`_kernel`).

    Parameters
    ----------
    worlds : int
        Size of the batch.
    accuracy : str or physics.Accuracy
    walls : {"three", "corner"}
        Layout, see `Area`.
    half_width : float
        Half the width of the floor that starts and goals are drawn from, and of the three-wall box [m].
    mass, size, friction, restitution, gravity : number or pair
        Block's mass [kg] and edges (three numbers) [m], coefficients against the walls, strength of gravity
        along -y [m/s²]. A pair (low, high) is drawn from uniformly in each episode of each world.
    effects : sequence of physics effects
        Added to gravity, contact and friction; one of the same class replaces the task's, and the limits of the action
        follow its gravity. What is drawn from a range cannot be replaced.
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
    world : physics.World
    generators : list of numpy.random.Generator or None
        One per world: an episode does not depend on the batch it runs in.
    values : EpisodeValues
        Parameters of the running episodes.
    record : (worlds, RECORD_SIZE) float64
    obs : (worlds, entries) float32
    outcome : (worlds, OUTCOME_SIZE) float64
        Of the last step, renewed in place.
    status : (worlds,) int64
        Values of `physics.Status`, of the last step, renewed in place; OK at the start of an episode.

    Raises
    ------
    ValueError
        Naming the field, the value and what is allowed.
    """

    observation: ClassVar[tuple[Entry, ...]]
    goal_options: ClassVar[dict[str, str]]
    error_name: ClassVar[str]

    def __init__(
        self,
        worlds: int = 1,
        *,
        accuracy="balanced",
        walls="three",
        half_width=10.0,
        mass=6.0,
        size=(5.0, 3.0, 2.0),
        friction=0.5,
        restitution=0.2,
        gravity=9.81,
        effects=(),
        frame_skip=5,
        dt=0.005,
        dump_faults=None,
        threads=1,
    ):
        self.area = Area(walls, half_width)
        self.parameters = Parameters(mass=mass, size=size, friction=friction, restitution=restitution, gravity=gravity)
        self.area.check_room(self.parameters["size"].high)
        self.frame_skip = validation.count(frame_skip, "frame_skip")
        self.effects = checked_effects(effects, self.parameters.randomised)
        self.world = physics.World(self._scene(), worlds=worlds, dt=dt, accuracy=accuracy, threads=threads)
        self.generators: list[np.random.Generator | None] = [None] * worlds
        self.record = np.zeros((worlds, col.RECORD_SIZE))
        self.obs = np.zeros((worlds, len(self.observation)), dtype=np.float32)
        self.outcome = np.zeros((worlds, col.OUTCOME_SIZE))
        self.status = np.zeros(worlds, dtype=np.int64)
        self._advance = physics.Stepper(self.world, self.frame_skip, then=self._observer)
        if dump_faults is not None:
            physics.Recorder(self.world, folder=dump_faults)
        self._actions = np.zeros((worlds, AXES))
        self.values = EpisodeValues(self.parameters, worlds)
        self._note_parameters(np.arange(worlds), self.values.now)

    @property
    def worlds(self) -> int:
        """Size of the batch."""
        return self.world.worlds

    @property
    def wrench(self) -> np.ndarray:
        """(worlds, 1, 6) float64, applied in the last step: force [N], torque [N m], world frame."""
        return self._advance.wrench

    @property
    def control_dt(self) -> float:
        """Time between two actions [s]."""
        return self.frame_skip * self.world.dt

    def _scene(self) -> physics.Scene:
        """The block at the middle of the area, lifted clear of the floor, with the middles of all ranges."""
        middle = {field: span.middle for field, span in self.parameters.ranges.items()}
        own = [
            physics.Gravity((0.0, -float(middle["gravity"][0]), 0.0)),
            physics.Contact(restitution=float(middle["restitution"][0])),
            physics.Friction(float(middle["friction"][0])),
        ]
        given = {type(effect) for effect in self.effects}
        size, mass = self.parameters.scene_size, float(middle["mass"][0])
        return physics.Scene(
            bodies=[physics.Block(size=tuple(size), mass=mass, pos=self._lifted(size[None]))],
            walls=self.area.half_spaces,
            effects=[*(effect for effect in own if type(effect) not in given), *self.effects],
        )

    @property
    def own_parameters(self) -> tuple[str, ...]:
        """Parameters that episodes may differ in: all that `effects` leave to the task."""
        taken = replaced(self.effects)
        return tuple(field for field in LENGTHS if field not in taken)

    # --- episodes -----------------------------------------------------------------------------------------

    def seed(self, world: int, seed: int | None) -> int:
        """Give one world a new generator, as `gymnasium.Env.reset` does; returns the seed."""
        self.generators[world], used = seeding.np_random(seed)
        return used

    def begin(self, rows: np.ndarray, options: dict | None = None) -> None:
        """Start a new episode in the worlds `rows`.

        Parameters
        ----------
        rows : (n,) int64
            Worlds.
        options : dict, optional
            Fix what is otherwise drawn, each for all `rows` or one per row: ``place`` (2,) x and z of the
            centre [m], ``yaw`` () [rad], ``face`` () the face that is down, the parameters of the block (`LENGTHS`),
            and the task's own.

        Raises
        ------
        TypeError, ValueError
            An option that is unknown or out of range. Nothing has changed then, the generators included.
        """
        chosen = read_options(options, self.option_kinds, len(rows), self.area)
        refuse_replaced(self.effects, chosen, "options ")
        marks = [self.generators[world].bit_generator.state for world in rows] if chosen else []
        shares = np.array([self.generators[world].random(DRAWS) for world in rows])
        starts, goals = shares[:, : col.START_SIZE], shares[:, col.START_SIZE : col.START_SIZE + GOAL_DRAWS]
        values = self.values.draw(rows, shares[:, col.START_SIZE + GOAL_DRAWS :], chosen)
        start.choose(self.area, starts, values["size"], chosen)
        pos, quat = start.poses(starts, values["size"])
        if chosen:
            try:
                start.check(self.world, rows, pos, quat, values)
            except ValueError:
                for world, mark in zip(rows, marks):
                    self.generators[world].bit_generator.state = mark
                raise
        self.values.begin(rows, values, chosen)
        start.place(self.world, rows, pos, quat, self.values.changed(values), self._lifted)
        self._note_parameters(rows, values)
        record = self.record[rows]
        self._set_goals(record, goals, starts, values["size"], chosen)
        self.record[rows] = record
        self.wrench[rows] = 0.0
        self.status[rows] = physics.Status.OK
        self._kernel(listed(rows), self.world.state, self.record, self.world.walls, None, self.obs, self.outcome)

    @property
    def option_kinds(self) -> dict[str, str]:
        """Options of `begin`, and the kind of each (`options.READERS`)."""
        return {**START_OPTIONS, **self.goal_options}

    def _lifted(self, size: np.ndarray) -> tuple[float, float, float]:
        """A place where blocks of edges `size` (n, 3), and of any in the range, are clear of all walls [m]."""
        c = self.area.centre
        longest = max(np.linalg.norm(self.parameters["size"].high), np.linalg.norm(size, axis=1).max())
        return (c, float(longest), c)

    def _note_parameters(self, rows: np.ndarray, values: dict[str, np.ndarray]) -> None:
        given = next((effect for effect in self.effects if isinstance(effect, physics.Gravity)), None)
        gravity = values["gravity"] if given is None else float(np.linalg.norm(given.acceleration))
        weight = values["mass"] * gravity
        half = 0.5 * values["size"]
        self.record[rows, col.FORCE_LIMIT] = FORCE_SHARE * weight
        self.record[rows, col.TORQUE_LIMIT] = TORQUE_SHARE * weight * half.max(axis=1)
        self.record[rows, col.HALF : col.HALF + 3] = half

    def hold(self, field: str, value) -> None:
        """Give a parameter of every world a value from now on, in this episode and all later ones.

        Parameters
        ----------
        field : {"mass", "size", "friction", "restitution", "gravity"}
        value : array_like or None
            One for all worlds or one for each; None: draw it again from the next episode on.

        Raises
        ------
        ValueError
            Out of range, or a size that reaches deep into a wall where the block is. Nothing has changed then.
        """
        refuse_replaced(self.effects, (field,))
        if value is not None:
            value = read_parameter(field, field, value, self.worlds, self.area)
            start.change(self.world, field, value)
        self.values.hold(field, value)
        self._note_parameters(np.arange(self.worlds), self.values.now)

    # --- control steps ------------------------------------------------------------------------------------

    def step(self, actions) -> None:
        """Hold the wrenches of `actions` for `frame_skip` physics steps, then observe.

        Parameters
        ----------
        actions : (worlds, 6) array_like
            Clipped to ±1; see `wrenches`.

        Raises
        ------
        ValueError
            Actions of the wrong shape or not finite; nothing has moved then.
        """
        try:
            actions = np.asarray(actions)
        except ValueError:  # rows of different lengths
            raise ValueError(f"actions is {reprlib.repr(actions)}; allowed is shape {self._actions.shape}") from None
        if actions.shape != self._actions.shape:
            raise ValueError(f"actions has shape {actions.shape}; allowed is shape {self._actions.shape}")
        if actions.dtype.kind not in "fiub":
            raise ValueError(f"actions is {reprlib.repr(actions.tolist())}; allowed are numbers")
        self._actions[...] = actions
        bad = wrenches(self._actions, self.record, self.wrench)
        if bad >= 0:
            raise ValueError(f"action of world {bad} is {self._actions[bad].tolist()}; allowed are finite numbers")
        self._advance()
        gravest(self.world.report_table, self.status)

    def _observer(self, taken: np.ndarray) -> Callable[[], object]:
        """Return the kernel that observes the worlds that a thread has stepped."""
        world = self.world
        return bound(
            self._kernel, taken, world.state, self.record, world.walls, self._actions, self.obs, self.outcome
        )  # fmt: skip

    # --- what a task is -----------------------------------------------------------------------------------

    @abstractmethod
    def _set_goals(self, record, shares, starts, size, options) -> None:
        """Write goals of new episodes into `record` (n, RECORD_SIZE); take what they use out of `options`."""

    _kernel: ClassVar
