"""Batch of independent worlds of one scene: its state, its step, and changes of it by a user."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from threading import get_ident

import numpy as np
from numpy.typing import ArrayLike, NDArray

from physics import validation
from physics.accuracy import PRESETS, AccuracyArgument, resolve
from physics.html_table import parts_table
from physics.kernels.forces.force_field_dispatch import register_terms
from physics.kernels.state import layout as at
from physics.kernels.state.sleeping import SLEEP_GROUP, SLEEP_SIZE
from physics.kernels.time_stepping.event_log import EVENT_SIZE
from physics.keywords import known_keywords
from physics.parallel.bound_call import BoundCall
from physics.parallel.exclusive import exclusive, in_use, watch
from physics.parallel.team import Team
from physics.plan.plan import make_plan
from physics.scene.body_names import body_names
from physics.scene.effects import Actuator, Friction, RollingFriction, SpinFriction
from physics.scene.force_field import Field
from physics.scene.motion import Motion
from physics.scene.parts import SHAPE_CODES
from physics.scene.scene import Scene
from physics.summary import counted
from physics.undo import undo_on_error
from physics.world import batch_arrays, parameters, restoring, rollback, setters
from physics.world.actuator import Actuation
from physics.world.queries import Querying
from physics.world.query_calls import QueryCalls
from physics.world.report import StepReport
from physics.world.scene_settings import scene_settings
from physics.world.set_once import with_attributes_set_once
from physics.world.snapshot import Snapshot
from physics.world.step_length import warn_of_long_steps
from physics.world.stepper import kernel_calls, retime
from physics.world.touching import Touching


@with_attributes_set_once
@known_keywords
class World(Touching, Querying):
    """Batch of independent worlds of one scene, which are stepped together.

    A world gives the same bits whatever the batch size, its place in the batch and the number of threads.

    Parameters
    ----------
    scene : Scene
        Description of bodies, walls and effects.
    worlds : int
        Number of worlds of the batch.
    dt : float
        Length of a step [s].
    accuracy : str, Accuracy or mapping
        ``fast``, ``balanced``, ``precise``, ``reference``, a `physics.Accuracy`, or a mapping of its settings that
        differ from the preset under the key ``preset`` (``balanced``), such as ``{"tolerance": 1e-3}``.
    threads : int
        Threads that share a step, at most as many as processors. Each takes worlds of its own range first, then of the
        ranges of others. Threads wait without sleeping between steps that follow each other within 0.3 ms.

    Attributes
    ----------
    pos, quat, linvel, angvel : (worlds, bodies, 3|4|3|3) float64
        Read-only views in the world frame, refreshed in place by every step; copy them to keep them. PyTorch writes
        into read-only memory: ``torch.tensor`` makes a copy that is safe, ``torch.from_numpy`` does not. NumPy refuses
        ``world.pos[0, 0, 0] = 3`` with "assignment destination is read-only": change them by `set_state`.
    time : float
        Time since the start [s].

    An assignment to one of these arrays raises an AttributeError that names `set_state`, and likewise for others.
    `physics.world.batch.Batch` documents all other attributes.

    Raises
    ------
    ValueError
        A parameter out of range, a body that starts deep inside a wall, or two bodies that touch each other and start
        with their centres in the same place. Bodies that overlap otherwise are lifted apart, and the report of the
        first step says so (`Status.OVERLAP`).
    """

    def __init__(
        self,
        scene: Scene,
        worlds: int = 1,
        dt: float = 0.01,
        accuracy: AccuracyArgument = "balanced",
        threads: int = 1,
    ) -> None:
        validation.instance(scene, Scene, "scene", "a physics.Scene")
        self.scene = scene
        self.worlds = validation.count(worlds, "worlds")
        self.dt = float(validation.positive(dt, (), "dt"))
        self.accuracy = resolve(accuracy)
        self.threads = validation.count(threads, "threads")
        self.plan = make_plan(scene, self.accuracy)
        self.scene_settings = scene_settings(scene)
        self.body_count = len(scene.bodies)
        self.names = body_names(scene)
        self.time = 0.0
        self.recorder = self.impacts = None
        batch_arrays.check_room(self.worlds, self.body_count, self.plan)
        if self.plan.contact:
            warn_of_long_steps(scene, self.dt)
        self._allocate()
        batch_arrays.fill(self)
        setters.check_place(self, self.state, self.params, np.arange(self.worlds), "scene")

    # --- memory ------------------------------------------------------------------------------------------------

    def _allocate(self) -> None:
        rows = self.worlds * self.body_count
        self.state = np.zeros((rows, at.STATE_SIZE))
        self.params = np.zeros((rows, at.PARAM_SIZE + self.plan.columns))
        self.gravity = np.zeros((self.worlds, 3))
        friction = self.scene.effect(Friction)
        along = friction.directions(len(self.scene.walls)) if friction else None
        self.walls = parameters.wall_table(self.scene.walls, along)
        self.memory = np.zeros(self.plan.scheme.memory.shape(self.scene, self.plan, self.worlds))
        self.sleep = np.zeros((rows if self.plan.sleeping else 0, SLEEP_SIZE))
        self.report_table = np.zeros((self.worlds, at.REPORT_SIZE))
        self.event_counts = np.zeros(rows, dtype=np.int64)
        self._make_event_room(0)
        self.shapes = np.array([SHAPE_CODES[body.kind] for body in self.scene.bodies])
        actuator = self.scene.effect(Actuator)
        self.actuation = None if actuator is None else Actuation(actuator, (self.worlds, self.body_count, 6))
        self._prepare_threads()
        self._bind_views()

    def _prepare_threads(self) -> None:
        self.is_free, self.is_torn = True, False
        self.telling = None  # identifier of the thread that is notifying the recorder
        watch(self)
        self.team = Team(self.threads, self.worlds)
        register_terms(self.plan.terms)
        self._may_raise = self.plan.may_raise
        self.is_plain = not self.plan.fields and not self.plan.motion_columns and self.impacts is None
        self.is_bound = False
        self.scratch = [
            self.plan.scheme.make_scratch(self.scene, self.plan, self.walls, self.accuracy)
            for _ in range(self.team.size)
        ]
        self.motions = [
            self.plan.scheme.make_motion(self.scene, self.plan, self.accuracy) for _ in range(self.team.size)
        ]
        self._queries: QueryCalls | None = None  # made at the first query
        self._regions: list | None = None  # of sensors, likewise
        self._wrench = self.no_wrench()
        self._calls: list[BoundCall] = []
        self._bound_for: tuple | None = None  # steps and dt for which `_calls` are bound

    @exclusive
    def make_event_room(self, room: int) -> None:
        """Make room for `room` events of each body in the log of a kernel call, for `simulate`; at first there is none.

        Events go to `event_log` (worlds * bodies, room, EVENT_SIZE), with columns in
        `physics.kernels.time_stepping.event_log`. Their number goes to `event_counts` (worlds * bodies,) int64, and
        includes events without room. The room that `keep_impacts` made is never reduced. A `Stepper` must be made
        after this call.
        """
        self._make_event_room(room if self.impacts is None else max(room, self.impacts.room))

    def _make_event_room(self, room: int) -> None:
        self.event_log = np.zeros((len(self.event_counts), room, EVENT_SIZE))
        self._bound_for = None

    def _bind_views(self) -> None:
        table = self.state.reshape(self.worlds, self.body_count, at.STATE_SIZE)
        self.pos, self.quat, self.linvel, self.angvel = (
            table[:, :, first : first + size]
            for first, size in ((at.POS, 3), (at.QUAT, 4), (at.LINVEL, 3), (at.ANGVEL, 3))
        )
        for view in (self.pos, self.quat, self.linvel, self.angvel):
            view.flags.writeable = False

    # --- stepping ----------------------------------------------------------------------------------------------

    def step(self, wrench: ArrayLike | None = None, steps: int = 1, dt: float | None = None) -> StepReport:
        """Advance every world by `steps` steps of `dt`.

        Parameters
        ----------
        wrench : (worlds, bodies, 6) array_like, optional
            Force [N] and torque about the centre of mass [N m], world frame, constant during the call. None: no wrench.
            (bodies, 6): the same for all worlds. With one body also (6,), the same for all worlds, and (worlds, 6).
            With several bodies two axes are always (bodies, 6), whatever the number of worlds.
        steps : int
            Number of steps.
        dt : float, optional
            Length of a step for this call [s]; None: that of the world.

        Returns
        -------
        StepReport
            Report of all these steps together.

        Raises
        ------
        ValueError
            A wrench of the wrong shape or not finite, or steps or dt out of range. The worlds are unchanged then.
        RuntimeError
            Another thread is stepping or changing this world.
        """
        if self.is_free:
            self.is_free = False
        else:
            raise in_use(self)
        try:
            return self._step(wrench, steps, dt)
        finally:
            self.is_free = True

    def _step(self, wrench: ArrayLike | None, steps: int, dt: float | None) -> StepReport:
        if wrench is None:
            self._wrench.fill(0.0)
        else:
            validation.take_finite(wrench, self._wrench, "wrench")
        steps = validation.count(steps, "steps")
        dt = self.dt if dt is None else float(validation.positive(dt, (), "dt"))
        if self._bound_for is None:
            self._calls = kernel_calls(self, self._wrench, steps, dt)
        elif (steps, dt) != self._bound_for:
            retime(self, self._calls, steps, dt)
        self._bound_for = (steps, dt)
        self.advance(self._calls, self._wrench, steps, dt)
        return self.report

    def advance(self, calls: list[BoundCall], wrench: np.ndarray, steps: int, dt: float) -> None:
        """Advance all worlds by `steps` steps of `dt` [s] with prepared kernel calls (`stepper.kernel_calls`).

        Recorder and actuator take part: `wrench` (worlds, bodies, 6) is the command. If a user's field raises an
        exception, the worlds return to the state before. A `Stepper` makes its kernel call without this function where
        that is the whole step (`stepper._is_all`).
        """
        if self._may_raise:
            with undo_on_error(rollback.remember(self)):
                self._make_steps(calls, wrench, steps, dt)
        elif self.recorder is None and self.actuation is None:  # saves one Python call, 3 % of a step
            self.make(calls, steps * dt)
        else:
            self._make_steps(calls, wrench, steps, dt)
        if self.recorder is not None:
            self._tell(self.recorder.after)

    def _make_steps(self, calls: list[BoundCall], wrench: np.ndarray, steps: int, dt: float) -> None:
        if self.recorder is not None:
            self._tell(self.recorder.before, wrench, steps, dt)
        if self.actuation is None:
            self.make(calls, steps * dt)
        else:
            self.actuation.advance(self, calls, wrench, steps, dt)

    def _tell(self, message: Callable[..., None], *arguments) -> None:
        """Call a method `message` of the recorder, during which it may take snapshots of this world."""
        self.telling = get_ident()
        try:
            message(*arguments)
        finally:
            self.telling = None

    @property
    def report(self) -> StepReport:
        """Report of the last step, whether `step`, a `Stepper` or a rollout made it; a copy."""
        return StepReport(self.report_table.copy(), self.names)

    # --- changing ----------------------------------------------------------------------------------------------

    @known_keywords
    @exclusive
    def set_state(
        self,
        pos: ArrayLike | None = None,
        quat: ArrayLike | None = None,
        linvel: ArrayLike | None = None,
        angvel: ArrayLike | None = None,
        worlds: ArrayLike | None = None,
    ) -> None:
        """Set the state of bodies; None keeps the old values.

        Parameters
        ----------
        pos, quat, linvel, angvel : (k, bodies, 3|4|3|3) array_like, optional
            Position of the centre of mass [m], attitude (w, x, y, z), velocity [m/s] and angular velocity [rad/s],
            world frame, for k worlds. (bodies, 3|4|3|3): the same for all of them. With one body the axis of bodies
            may be left out: (3,) for all worlds alike, (k, 3) a row for each. With several bodies two axes are always
            (bodies, 3), even if k is the same number. A quaternion of norm 1 within 1e-4 is normalised.
        worlds : (k,) int array_like, optional
            Indices of the worlds to change; None: all. Their contact memory and the memory of their actuators are
            cleared.

        Raises
        ------
        ValueError
            A wrong shape, a number that is not finite, no unit quaternion, a world that does not exist or is named
            twice, a body deep inside a wall, or two bodies that can touch with their centres in the same place.
            Nothing has changed then.
        """
        setters.set_state(self, pos, quat, linvel, angvel, worlds)

    @known_keywords
    @exclusive
    def set_parameters(
        self,
        mass: ArrayLike | None = None,
        size: ArrayLike | None = None,
        inertia_body: ArrayLike | None = None,
        friction: ArrayLike | None = None,
        restitution: ArrayLike | None = None,
        wall_friction: ArrayLike | None = None,
        wall_restitution: ArrayLike | None = None,
        gravity: ArrayLike | None = None,
        effects: Sequence[Field | Friction | RollingFriction | SpinFriction] | None = None,
        worlds: ArrayLike | None = None,
    ) -> None:
        """Give worlds their own physical parameters; None keeps the old values.

        Parameters
        ----------
        mass, friction, restitution : (), (k,) or (k, bodies) array_like, optional
            Masses [kg] and coefficients of the bodies of k worlds. A single axis of length k has a number for each
            world; one of another length must be (bodies,), for all worlds alike. With a `Friction` of two coefficients
            `friction` is the first, and the second changes by the same factor. Coefficients of bodies and walls that
            touch are combined by the rules of `Friction` and `Contact`.
        wall_friction, wall_restitution : (), (k,) or (k, walls) array_like, optional
            Coefficients of the walls of k worlds, as for bodies; nan: a wall has none of its own, and the body's acts.
            The scene must have a `HalfSpace` with such a coefficient. If all its walls have equal ones, they must be
            equal in each world, too.
        size : (3,), (k, 3) or (k, bodies, 3) array_like, optional
            Full edges of a block, twice the semi-axes of an ellipsoid, three equal diameters of a sphere; of a capsule
            or cylinder diameter, whole length, diameter [m]. The size of a hull or compound cannot change: only twice
            its `dimensions` is accepted. Position and velocity stay, and so does the `center` of a block, in metres.
        inertia_body : (3, 3), (k, 3, 3) or (k, bodies, 3, 3) array_like, optional
            Inertia tensor about the centre of mass, body frame [kg m²]. None: a change of mass or size sets the tensor
            of uniform density; if the scene's body has an `inertia_body`, or is a hull or compound, its tensor is
            scaled with the mass instead.
        gravity : (3,) or (k, 3) array_like, optional
            Acceleration of gravity, world frame [m/s²].
        effects : sequence of effects, optional
            Force fields that replace the scene's fields of the same class; also `Friction`, `RollingFriction` and
            `SpinFriction`. Of `Spring` and `Push` all must be given, in the scene's order. Springs between two bodies
            count as a class of their own.
        worlds : (k,) int array_like, optional
            Indices of the worlds to change; None: all.

        Raises
        ------
        ValueError
            A value out of range, an effect that the scene does not declare, or a new size that reaches deep
            into a wall. Nothing has changed then.
        """
        numbers = (mass, size, inertia_body, friction, restitution, wall_friction, wall_restitution, effects)
        setters.set_parameters(self, {**dict(zip(setters.PARAMETERS, numbers)), "gravity": gravity}, worlds)

    @known_keywords
    @exclusive
    def set_motion(
        self,
        body: int | str,
        motion: Motion | None = None,
        velocity: ArrayLike | None = None,
        spin: ArrayLike | None = None,
        surface_velocity: ArrayLike | None = None,
        worlds: ArrayLike | None = None,
    ) -> None:
        """Give a fixed body a prescribed motion from now on, in all worlds or in some.

        Parameters
        ----------
        body : int or str
            Index or name of a body with ``fixed=True``.
        motion : Motion, optional
            Motion, the same in these worlds; ``Motion()`` stands still. The body jumps to the start of a table. A table
            has at most as many times as the longest one of the scene.
        velocity, spin, surface_velocity : (3,) or (k, 3) array_like, optional
            Numbers of a steady motion instead of `motion`, as in `Motion`, for all k worlds alike or for each; None
            keeps the old ones. A table ends.
        worlds : (k,) int array_like, optional
            Indices of the worlds to change, or a mask; None: all.

        Raises
        ------
        ValueError
            A body that is not fixed or not in the scene, a scene without a motion, both or neither of a motion and
            numbers, a wrong shape, a number that is not finite, a table that is too long, or a world that does not
            exist. Nothing has changed then.
        """
        setters.set_motion(self, body, motion, (velocity, spin, surface_velocity), worlds)

    # --- keeping and looking -----------------------------------------------------------------------------------

    @known_keywords
    @exclusive
    def snapshot(self, worlds: ArrayLike | None = None, out: Snapshot | None = None) -> Snapshot:
        """Copy the whole state of worlds, warm starts included; after `restore` they continue bit for bit.

        Parameters
        ----------
        worlds : (k,) int array_like, optional
            Indices of the worlds to copy, or a mask; None: all.
        out : Snapshot, optional
            Snapshot of k worlds, which is overwritten and returned: faster where snapshots are taken often.

        Raises
        ------
        ValueError
            A world that does not exist or is named twice, or `out` of another size. Nothing has changed then.
        """
        return restoring.capture(self, worlds, out)

    @known_keywords
    def restore(
        self, snapshot: Snapshot, worlds: ArrayLike | None = None, source: ArrayLike | int | None = None
    ) -> None:
        """Set worlds to the state in a snapshot; they then continue bit for bit like the worlds that were copied.

        Parameters
        ----------
        snapshot : Snapshot
            Snapshot of any batch of this scene, from `World.snapshot`.
        worlds : (k,) int array_like, optional
            Indices of the worlds of this batch to change, each once, or a mask; None: all.
        source : (k,) int array_like or int, optional
            Index within the snapshot of the world from which each gets its state; an index may repeat, and an int is
            for all. None: the snapshot has one world, for all of them, or k worlds, in this order.

        Raises
        ------
        ValueError
            `snapshot` is no `Snapshot`, or one of another scene; indices are out of range or of another count; or
            only some worlds would be restored, from another time than that of the batch, in a scene with a field that
            may change with time. Nothing has changed then.

        Notes
        -----
        All worlds of a batch have the same `time`. It becomes that of the snapshot if all worlds are restored, and
        stays otherwise. Commands that a delayed actuator still holds keep their age.
        """
        self.restore_targets(snapshot, restoring.find_targets(self, snapshot, worlds, source))

    def restore_targets(self, snapshot: Snapshot, targets: restoring.Targets) -> None:
        """Restore worlds as `restore` does, without its checks: `targets` come from `restoring.find_targets`."""
        if self.is_torn and targets.is_all:
            self.is_free, self.is_torn = True, False  # the thread that was in a step does not exist in this process
        self._restore(snapshot, targets)

    @exclusive
    def _restore(self, snapshot: Snapshot, targets: restoring.Targets) -> None:
        restoring.reinstate(self, snapshot, targets)

    @property
    def asleep(self) -> NDArray[np.bool_]:
        """Mask (worlds, bodies) bool, True for bodies that sleep; a new array. See `physics.Sleeping`."""
        if not self.plan.sleeping:
            return np.zeros((self.worlds, self.body_count), dtype=np.bool_)
        return self.sleep[:, SLEEP_GROUP].reshape(self.worlds, self.body_count) > 0.0

    @exclusive
    def __getstate__(self):
        kept = dict(vars(self))
        views = ("pos", "quat", "linvel", "angvel")
        flags = ("is_torn", "telling", "is_plain", "is_bound")
        for name in (
            "plan",
            "team",
            "scratch",
            "motions",
            "_queries",
            "_regions",
            "_wrench",
            "_calls",
            "_bound_for",
            *flags,
            *views,
        ):
            del kept[name]
        for name in ("is_free", "_user"):  # of `Exclusive`: a copy is free
            kept.pop(name, None)
        return kept

    def __setstate__(self, kept):
        vars(self).update(kept)
        self.plan = make_plan(self.scene, self.accuracy)  # it holds compiled functions of fields
        self._prepare_threads()
        self._bind_views()

    def __repr__(self) -> str:
        return f"World({', '.join(self._parts())})"

    def _repr_html_(self) -> str:
        scene = self.scene
        bodies, effects = (counted(type(each).__name__ for each in items) for items in (scene.bodies, scene.effects))
        preset = next((name for name, each in PRESETS.items() if each == self.accuracy), repr(self.accuracy))
        rows = ("bodies", bodies), ("walls", f"{len(scene.walls)}"), ("effects", effects), ("accuracy", preset)
        return parts_table(self, *rows)

    def _parts(self) -> tuple[str, ...]:
        return f"{self.worlds} worlds of {self.body_count} bodies", f"dt={self.dt}", f"time={self.time:.6g} s"
