"""Arrays of a batch of worlds, shared by the parts of a `World`."""

from __future__ import annotations

from contextlib import AbstractContextManager
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from physics.accuracy import Accuracy
from physics.kernels.state.sleeping import Sleep
from physics.kernels.time_stepping.workspace import body_records
from physics.parallel.bound_call import BoundCall
from physics.parallel.exclusive import Exclusive
from physics.parallel.team import Team
from physics.plan.plan import Plan
from physics.scene.effects import Actuator, Sleeping
from physics.scene.field_errors import raised
from physics.scene.scene import Scene
from physics.world.snapshot import KEPT
from physics.world.step_listener import StepListener

if TYPE_CHECKING:
    from physics.world.impacts import KeptImpacts

_KEPT, _KEPT_AWAKE = attrgetter(*KEPT), attrgetter(*KEPT[:-1])


class ActuatorState(Protocol):
    """Interface of a batch's actuators; see `physics.world.actuator`."""

    actuator: Actuator
    applied: np.ndarray
    output: np.ndarray
    past: np.ndarray | None

    def passed_by(self, load: np.ndarray | None) -> AbstractContextManager[None]:
        """Add a load past the actuator in the steps of a block."""

    def kept(self, worlds: np.ndarray | None = None) -> Any:
        """Copy all that decides the coming wrenches, of some worlds or all."""

    def reinstate(self, kept: Any) -> None:
        """Restore the state when `kept` was taken."""

    def reinstate_worlds(self, kept: Any, source: np.ndarray, worlds: np.ndarray) -> None:
        """Restore worlds from those of `source` in `kept`."""

    def advance(self, world: Any, calls: list[BoundCall], wrench: np.ndarray, steps: int, dt: float) -> None:
        """Make steps with the wrench that the actuators let through."""

    def forget(self, worlds: np.ndarray) -> None:
        """Drop all commands that these worlds were given."""


class Batch(Exclusive):
    """Many worlds of one scene as arrays.

    Attributes
    ----------
    scene, accuracy, plan : Scene, Accuracy, Plan
        What is simulated, and how.
    scene_settings : dict of str to str
        Settings of the scene that no array holds; see `physics.world.scene_settings`.
    worlds, body_count, threads : int
        Size of the batch, bodies of a world, threads that share a step.
    names : tuple of str
        Of the bodies; "" for one without a name.
    dt, time : float
        Step, and time since the start [s].
    pos, quat, linvel, angvel : (worlds, bodies, 3|4|3|3) float64
        Read-only views in the world frame, refreshed in place by every step; copy them to keep them. PyTorch writes
        into read-only memory: ``torch.tensor`` makes a copy that is safe, ``torch.from_numpy`` does not.
    state : (worlds * bodies, STATE_SIZE) float64
        The array behind them, for kernels that read it; columns in `physics.kernels.state.layout`.
    params : (worlds * bodies, PARAM_SIZE + columns of fields and laws) float64
        Physical parameters; columns likewise.
    gravity : (worlds, 3) float64
        [m/s²].
    walls : (walls, WALL_SIZE) float64
        Normal, tangents and offset of each wall.
    shapes : (bodies,) int64
        Codes of the bodies' shapes.
    memory : (worlds * bodies or worlds, columns) float64
        Contacts and impulses of the last resting stage: the next one's warm start.
    sleep : (worlds * bodies or 0, SLEEP_SIZE) float64
        What is known of bodies that may sleep.
    report_table : (worlds, REPORT_SIZE) float64
        The array behind `World.report`.
    event_log, event_counts : (worlds * bodies, room, EVENT_SIZE) float64, (worlds * bodies,) int64
        Events of the last call; see `World.make_event_room`.
    impacts : KeptImpacts or None
        Impacts of a step of several calls, where a user asks for them: `World.keep_impacts`.
    is_plain : bool
        A call is the kernel alone: no field is told the time, and no impact is kept.
    is_bound : bool
        A `Stepper` has bound the arrays.
    actuation : ActuatorState or None
        State of the actuators.
    team : Team
        The threads.
    scratch, motions : list
        Working memory of each thread: of a step, and of the event-driven scheme or of error control.
    recorder : StepListener or None
        What is told of every step; see `physics.Recorder`.
    telling : int or None
        The thread that tells the recorder of its step.
    is_in_use : bool
        Whether a thread is in a method that changes or copies the world. Such a method raises RuntimeError while
        another thread is in one: a world belongs to one thread at a time.
    is_torn : bool
        Whether another thread was in one when this process was forked.
    """

    scene: Scene
    accuracy: Accuracy
    plan: Plan
    scene_settings: dict[str, str]
    worlds: int
    body_count: int
    threads: int
    names: tuple[str, ...]
    dt: float
    time: float
    pos: NDArray[np.float64]
    quat: NDArray[np.float64]
    linvel: NDArray[np.float64]
    angvel: NDArray[np.float64]
    state: NDArray[np.float64]
    params: NDArray[np.float64]
    gravity: NDArray[np.float64]
    walls: NDArray[np.float64]
    shapes: NDArray[np.int64]
    memory: NDArray[np.float64]
    sleep: NDArray[np.float64]
    report_table: NDArray[np.float64]
    event_log: NDArray[np.float64]
    event_counts: NDArray[np.int64]
    impacts: KeptImpacts | None
    is_plain: bool
    is_bound: bool
    actuation: ActuatorState | None
    team: Team
    scratch: list
    motions: list
    recorder: StepListener | None
    telling: int | None
    is_torn: bool

    if TYPE_CHECKING:  # of `World`

        def advance(self, calls: Any, wrench: np.ndarray, steps: int, dt: float) -> None: ...

        def _make_event_room(self, room: int) -> None: ...

    def make(self, calls: list[BoundCall], duration: float) -> None:
        """Make the kernel calls of a time [s]."""
        if self.is_plain:
            self.team.run(calls)
        else:
            self._make_with_more(calls)
        self.time += duration

    def _make_with_more(self, calls: list[BoundCall]) -> None:
        """Make the calls, and what belongs to them."""
        if self.plan.fields:
            self._make_with_fields(calls)
        else:
            self.team.run(calls)
        if self.impacts is not None:
            self.impacts.note(self)

    def continue_step(self) -> None:
        """Let the next call go on with the step of the last one: `World.read_impacts` tells the impacts of both."""
        if self.impacts is not None:
            self.impacts.go_on(self)

    def forget_impacts(self, chosen: np.ndarray | slice = slice(None)) -> None:
        """Forget the impacts of some worlds, whose state is not that of their last step any more."""
        if self.impacts is not None:
            self.impacts.forget(self, chosen)

    def _make_with_fields(self, calls: list[BoundCall]) -> None:
        """Tell fields the time, and make the calls; an exception of a field then names its class."""
        for scratch in self.scratch:
            body_records(scratch)["call_start"] = self.time
        try:
            self.team.run(calls)
        except Exception as error:
            raise raised(error, self.plan.fields)  # noqa: B904 (it has a cause already)

    def no_wrench(self) -> NDArray[np.float64]:
        """Zeros (worlds, bodies, 6) float64 for wrenches."""
        return np.zeros((self.worlds, self.body_count, 6))

    def kept(self) -> tuple[np.ndarray, ...]:
        """The arrays themselves that a snapshot copies, in the order of `KEPT`."""
        return _KEPT(self) if self.plan.sleeping else _KEPT_AWAKE(self)

    def kept_rows(self) -> tuple[int, ...]:
        """Number of a world's rows in each of the `kept` arrays; 0 for an unused array with one row for all worlds."""
        bodies = self.body_count
        memory = self.plan.scheme.memory.rows_per_world(bodies) if self.plan.contact else 0
        return (bodies, bodies, 1, memory, 1, bodies) if self.plan.sleeping else (bodies, bodies, 1, memory, 1)

    def sleep_of_kernel(self) -> Sleep | None:
        """Sleep record for the step; None if no body may sleep."""
        if not self.plan.sleeping:
            return None
        effect: Any = self.scene.effect(Sleeping)
        return Sleep(self.sleep, effect.slops * self.accuracy.slop, effect.time or 0.0)
