"""Rollouts: many steps of every world of a batch, with a wrench for each, and the states along the way."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from physics import validation
from physics.html_table import parts_table
from physics.kernels.state import layout as at
from physics.keywords import known_keywords
from physics.parallel.exclusive import exclusive
from physics.summary import parts_repr, shown
from physics.undo import undo_on_error
from physics.world import batch_arrays, restoring
from physics.world.report import StepReport
from physics.world.rollout_course import Room, run_wrenches
from physics.world.snapshot import Snapshot
from physics.world.world import World

# Columns of a state that a rollout can keep, and the count of numbers of each.
SIZES = {"pos": 3, "quat": 4, "linvel": 3, "angvel": 3}
COLUMNS = tuple(SIZES)

MEBIBYTE = 2**20


@dataclass(frozen=True, eq=False)
class Rollout:
    """States of all worlds of a batch at several times, `samples` of them, as `rollout` returns them.

    Attributes
    ----------
    pos, quat, linvel, angvel : (worlds, samples, bodies, 3|4|3|3) float64 or None
        States in the world frame [m, 1, m/s, rad/s]; None: the argument `columns` did not name this column.
    times : (samples,) float64
        Time of each state [s].
    report_table : (worlds, REPORT_SIZE) float64
        Numbers of the report of all steps, which `report` reads.
    names : tuple of str
        Names of the bodies; "" for a body without a name.
    """

    pos: np.ndarray | None
    quat: np.ndarray | None
    linvel: np.ndarray | None
    angvel: np.ndarray | None
    times: np.ndarray
    report_table: np.ndarray
    names: tuple[str, ...] = ()

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns that the rollout kept, such as ``pos``."""
        return tuple(name for name in COLUMNS if getattr(self, name) is not None)

    @property
    def report(self) -> StepReport:
        """Report of all steps of the rollout together."""
        return StepReport(self.report_table, self.names)

    @property
    def status(self) -> np.ndarray:
        """Gravest outcome of all steps of each world, (worlds,) int64, values of `Status`."""
        return self.report.status

    @property
    def nbytes(self) -> int:
        """Size of all arrays in memory [bytes]."""
        arrays = (*(getattr(self, name) for name in self.columns), self.times, self.report_table)
        return sum(array.nbytes for array in arrays)

    def _as_room(self) -> Room:
        return Room({name: getattr(self, name) for name in self.columns}, self.times, self.report_table)

    __repr__ = parts_repr
    _repr_html_ = parts_table

    def _parts(self) -> tuple[str, ...]:
        first = getattr(self, self.columns[0])
        return (
            f"{len(first)} worlds of {first.shape[2]} bodies", f"{first.shape[1]} states",
            f"t = {self.times[0]:.6g} to {self.times[-1]:.6g} s", *self.columns, f"ok={self.report.ok}",
            f"{self.nbytes / MEBIBYTE:.3g} MiB",
        )  # fmt: skip


@known_keywords
def rollout(
    world: World,
    wrenches: ArrayLike,
    initial: Snapshot | None = None,
    steps: int = 1,
    dt: float | None = None,
    columns: Sequence[str] = COLUMNS,
    every: int = 1,
    out: Rollout | None = None,
) -> Rollout:
    """Step every world with its own sequence of wrenches, and keep the states.

    The results have the same bits as those of `World.step` with one wrench after another. The loop over time runs in
    each thread, over a few worlds at a time. Afterwards the world is in the state of the last step, report and time
    included.

    Parameters
    ----------
    world : World
        Batch of worlds to step.
    wrenches : (worlds, length, bodies, 6) array_like
        Force [N] and torque about the centre of mass [N m], world frame, for each of `length` intervals. A wrench acts
        over `steps` steps. With an actuator the wrenches are its commands. With one body also (worlds, length, 6).
    initial : Snapshot, optional
        Start of the rollout: a snapshot of one world, for all worlds, or of as many worlds. None: the present state.
    steps : int
        Steps with each wrench.
    dt : float, optional
        Length of a step [s]; None: that of the world.
    columns : sequence of str
        Columns of the states to keep, out of ``pos``, ``quat``, ``linvel``, ``angvel``.
    every : int
        A state is kept after every so many wrenches; a divisor of `length`. With ``every=length`` only the last state
        is kept.
    out : Rollout, optional
        Rollout of the same sizes and columns, which is overwritten and returned.

    Returns
    -------
    Rollout
        States of all worlds. With all columns its arrays have worlds * length / every * bodies * 13 numbers of 8
        bytes. Wrenches that are not contiguous float64 are copied. Everything else is small.

    Raises
    ------
    ValueError
        An argument of the wrong shape or out of range, or more states than this machine's memory holds. The world is
        unchanged then.
    RuntimeError
        Another thread is stepping or changing this world.

    Notes
    -----
    Each step is a call from Python if the world has a recorder or an actuator with a delay, or an actuator with a lag
    and `steps` above 1. Where a user's field raises an exception, the world returns to its state before the call.

    Examples
    --------
    >>> world = physics.World(physics.scenes.drop(), worlds=64)
    >>> physics.rollout(world, np.zeros((64, 100, 6)), columns=["pos"], every=100).pos.shape
    (64, 1, 1, 3)
    """
    validation.instance(world, World, "world", "a physics.World")
    return _rollout(world, wrenches, initial, steps, dt, columns, every, out)


@exclusive
def _rollout(world: World, wrenches, initial, steps, dt, columns, every, out) -> Rollout:
    wrenches = _wrenches(world, wrenches)
    length = wrenches.shape[1]
    steps = validation.count(steps, "steps")
    dt = world.dt if dt is None else float(validation.positive(dt, (), "dt"))
    every = validation.count(every, "every")
    if length % every:
        raise ValueError(f"every is {every}; allowed are divisors of {length}, the number of wrenches of a world")
    shapes: dict[str, tuple[int, ...]] = {
        name: (world.worlds, length // every, world.body_count, SIZES[name]) for name in _columns(columns)
    }
    targets = None if initial is None else restoring.find_targets(world, initial, None, None)
    found = _room(world, shapes) if out is None else _checked(out, world.names, shapes)
    with undo_on_error(restoring.remember(world) if world.plan.may_raise else None):
        if targets is not None:
            restoring.reinstate(world, initial, targets)
        run_wrenches(world, wrenches, found._as_room(), steps, dt, every)
    return found


def _wrenches(world: World, wrenches: ArrayLike) -> np.ndarray:
    """Check `wrenches`, which must be finite; return them as contiguous float64 (worlds, length, bodies, 6)."""
    worlds, bodies = world.worlds, world.body_count
    allowed = f"({worlds}, length, {bodies}, 6)" + (f" or ({worlds}, length, 6)" if bodies == 1 else "")
    array = validation.floats(wrenches, "wrenches", f"are numbers in shape {allowed}")
    if array.ndim == 3 and bodies == 1:
        array = array[:, :, None]
    if array.ndim != 4 or array.shape[1] == 0 or (len(array), *array.shape[2:]) != (worlds, bodies, 6):
        raise ValueError(f"wrenches has shape {np.shape(wrenches)}; allowed is {allowed}, with a length of at least 1")
    return np.ascontiguousarray(validation.finite(array, array.shape, "wrenches"))


def _columns(columns: Sequence[str]) -> list[str]:
    """Check the names of the columns to keep, each at most once; return them as a list."""
    names = list(columns) if isinstance(columns, Iterable) and not isinstance(columns, str) else [columns]
    for name in names:
        validation.one_of(name, COLUMNS, "columns", " and lists of these")
    if not names or len(set(names)) < len(names):
        raise ValueError(f"columns is {shown(columns)}; allowed are some of {', '.join(COLUMNS)}, each once")
    return names


def _room(world: World, shapes: dict[str, tuple[int, ...]]) -> Rollout:
    """Make a rollout with empty arrays of these shapes; ValueError where this machine's memory is too small."""
    samples = next(iter(shapes.values()))[1]
    needed = 8 * (sum(int(np.prod(shape, dtype=object)) for shape in shapes.values()) + samples)
    memory = batch_arrays.machine_memory()
    message = (
        f"the states of {samples} moments in {world.worlds} worlds need {needed / 2**30:.3g} GiB, and this machine has "
        f"{memory / 2**30:.3g} GiB of memory; allowed are fewer: raise `every`, or keep fewer `columns`"
    )
    if needed > memory:
        raise ValueError(message)
    try:
        arrays = {name: np.empty(shapes[name]) if name in shapes else None for name in COLUMNS}
        table = np.zeros((world.worlds, at.REPORT_SIZE))
        return Rollout(**arrays, times=np.empty(samples), report_table=table, names=world.names)
    except MemoryError:
        raise ValueError(message) from None


def _checked(out: Rollout, names: tuple[str, ...], shapes: dict[str, tuple[int, ...]]) -> Rollout:
    """Return the user's rollout `out`; ValueError unless it has arrays of these shapes and these names of bodies."""
    validation.instance(out, Rollout, "out", "None or a physics.Rollout")
    arrays = {name: getattr(out, name) for name in out.columns}
    is_ours = all(array.flags.c_contiguous and array.flags.writeable for array in arrays.values())
    if {name: array.shape for name, array in arrays.items()} != shapes or not is_ours:
        raise ValueError(f"out is {out!r}; allowed is one that `rollout` has made, with {shapes}")
    if out.names != names:
        raise ValueError(
            f"out is a rollout of bodies with the names {out.names!r}; allowed are those of world, {names!r}"
        )
    return out
