"""Batch of worlds: the arrays and settings on which all parts of `physics.World` work."""

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
    """Interface of the actuators of a batch, as the step uses it; see `physics.world.actuator.Actuation`."""

    actuator: Actuator
    applied: np.ndarray
    output: np.ndarray
    past: np.ndarray | None

    def passed_by(self, load: np.ndarray | None) -> AbstractContextManager[None]:
        """Add a load (worlds, bodies, 6), which bypasses the actuators, to all steps within the ``with`` block."""

    def kept(self, worlds: np.ndarray | None = None) -> Any:
        """Copy the actuators' state of these worlds (indices; None: all): everything that decides later wrenches."""

    def reinstate(self, kept: Any) -> None:
        """Restore the state of all worlds from `kept`, as the method `kept` returned it."""

    def reinstate_worlds(self, kept: Any, source: np.ndarray, worlds: np.ndarray) -> None:
        """Restore the actuators of `worlds` (k,) from the worlds `source` (k,) of a state `kept`."""

    def advance(self, world: Any, calls: list[BoundCall], wrench: np.ndarray, steps: int, dt: float) -> None:
        """Advance a batch by `steps` steps of `dt` [s], with the wrench that the actuators make of the command."""

    def forget(self, worlds: np.ndarray) -> None:
        """Reset the actuators of these worlds (indices): zero output, and no delayed commands."""


class Batch(Exclusive):
    """Many worlds of one scene, as arrays with rows for all of them; base of `World`.

    Attributes
    ----------
    scene : Scene
        Description of the bodies, walls and effects.
    accuracy : Accuracy
        Settings of the simulation.
    plan : Plan
        Effects and settings for which the kernels are compiled.
    scene_settings : dict of str to str
        Settings of the scene that no array holds; see `physics.world.scene_settings`.
    worlds, body_count, threads : int
        Number of worlds of the batch, of bodies of a world, and of threads that share a step.
    names : tuple of str
        Names of the bodies; "" for a body without a name.
    dt, time : float
        Length of a step, and time since the start [s].
    pos, quat, linvel, angvel : (worlds, bodies, 3|4|3|3) float64
        Read-only views of `state` in the world frame, refreshed in place by every step; copy them to keep them. PyTorch
        writes into read-only memory: ``torch.tensor`` makes a copy that is safe, ``torch.from_numpy`` does not.
    state : (worlds * bodies, STATE_SIZE) float64
        States of all bodies, a row for each; columns in `physics.kernels.state.layout`.
    params : (worlds * bodies, PARAM_SIZE + columns of fields and laws) float64
        Physical parameters of all bodies, a row for each; columns in `physics.kernels.state.layout`.
    gravity : (worlds, 3) float64
        Acceleration of gravity in each world [m/s²].
    walls : (walls, WALL_SIZE) float64
        Normal, tangents and offset of each wall.
    shapes : (bodies,) int64
        Codes of the bodies' shapes.
    memory : (worlds * bodies or worlds, columns) float64
        Contacts and impulses of the last resting stage, the warm start of the next one.
    sleep : (worlds * bodies or 0, SLEEP_SIZE) float64
        State of sleep of each body; no rows if bodies do not sleep in the scene.
    report_table : (worlds, REPORT_SIZE) float64
        Numbers of the last step's report, which `World.report` reads.
    event_log, event_counts : (worlds * bodies, room, EVENT_SIZE) float64, (worlds * bodies,) int64
        Events of the last kernel call, and their number for each body; see `World.make_event_room`.
    impacts : KeptImpacts or None
        Impacts of the last step, if `World.keep_impacts` asks for them.
    is_plain : bool
        Whether a step is the kernel call alone: no field or motion needs the time, and no impacts are kept.
    is_bound : bool
        Whether a `Stepper` has bound the arrays, so that they must not be replaced.
    actuation : ActuatorState or None
        State of the actuators.
    team : Team
        Threads that share the worlds.
    scratch, motions : list
        Workspaces of each thread: of a step, and of the event-driven scheme or of error control.
    recorder : StepListener or None
        Object that is notified of every step; see `physics.Recorder`.
    telling : int or None
        Identifier of the thread that is notifying the recorder now; None if no thread is.
    is_in_use : bool
        Whether a thread is in a method that changes or copies the world. Such a method raises RuntimeError while
        another thread is in one: a world belongs to one thread at a time.
    is_torn : bool
        Whether another thread was in such a method when this process was forked.
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
    _queries: Any  # `QueryCalls`, or None before the first query
    _regions: Any  # list of sensors' regions, or None before the first question about them
    recorder: StepListener | None
    telling: int | None
    is_torn: bool

    if TYPE_CHECKING:  # of `World`

        def advance(self, calls: Any, wrench: np.ndarray, steps: int, dt: float) -> None: ...

        def _make_event_room(self, room: int) -> None: ...

    def make(self, calls: list[BoundCall], duration: float) -> None:
        """Make kernel calls, which advance all worlds by `duration` [s], and add that to the batch's time."""
        if self.is_plain:
            self.team.run(calls)
        else:
            self._make_with_more(calls)
        self.time += duration

    def _make_with_more(self, calls: list[BoundCall]) -> None:
        """Make kernel calls; set the time of fields and motions before them, and keep the impacts after them."""
        if self.plan.fields or self.plan.motion_columns:
            self._make_with_time(calls)
        else:
            self.team.run(calls)
        if self.impacts is not None:
            self.impacts.note(self)

    def continue_step(self) -> None:
        """Count the next kernel call as a part of the last step, so that `World.read_impacts` reads both calls."""
        if self.impacts is not None:
            self.impacts.go_on(self)

    def forget_impacts(self, chosen: np.ndarray | slice = slice(None)) -> None:
        """Forget the impacts of the `chosen` worlds, after their state was changed from outside."""
        if self.impacts is not None:
            self.impacts.forget(self, chosen)

    def _make_with_time(self, calls: list[BoundCall]) -> None:
        """Set the time of the kernels, and make calls; an exception in a user's field is reworded to name its class."""
        for k in range(len(self.scratch)):
            self.clock_of(k)[:] = self.time
        try:
            self.team.run(calls)
        except Exception as error:
            raise raised(error, self.plan.fields)  # noqa: B904 (it has a cause already)

    def clock_of(self, k: int) -> np.ndarray:
        """View (n,) of the times at the start of a call [s] that fields and motions read in thread `k`; maybe empty."""
        if self.plan.fields:
            return np.atleast_1d(body_records(self.scratch[k])["call_start"])
        if self.plan.motion_columns:
            return self.scratch[k].driven.clock[:1]
        return np.zeros(0)

    def no_wrench(self) -> NDArray[np.float64]:
        """Make an array of zero wrenches (worlds, bodies, 6) float64."""
        return np.zeros((self.worlds, self.body_count, 6))

    def kept(self) -> tuple[np.ndarray, ...]:
        """Arrays of the batch (no copies) that a snapshot copies, in the order of `KEPT`."""
        return _KEPT(self) if self.plan.sleeping else _KEPT_AWAKE(self)

    def kept_rows(self) -> tuple[int, ...]:
        """Number of rows per world of each array in `kept()`; 0 for an unused array, which has one row in all."""
        bodies = self.body_count
        memory = self.plan.scheme.memory.rows_per_world(bodies) if self.plan.contact else 0
        return (bodies, bodies, 1, memory, 1, bodies) if self.plan.sleeping else (bodies, bodies, 1, memory, 1)

    def sleep_of_kernel(self) -> Sleep | None:
        """Record with the array and settings of sleep, as kernels take it; None if bodies do not sleep in the scene."""
        if not self.plan.sleeping:
            return None
        effect: Any = self.scene.effect(Sleeping)
        slop = self.plan.scheme.acting(self.accuracy).slop
        return Sleep(self.sleep, effect.slops * slop, effect.time or 0.0)
