"""Snapshots of a batch: taking them, and restoring worlds from them, also into other worlds and other batches."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from physics import validation
from physics.kernels.state import layout as at
from physics.scene.needs import is_isotropic
from physics.summary import shown
from physics.undo import Undo
from physics.world import choice
from physics.world.batch import Batch
from physics.world.file_numbers import check_numbers
from physics.world.gusts import reads_time
from physics.world.scene_settings import other_setting
from physics.world.snapshot import KEPT, Snapshot


class Targets(NamedTuple):
    """Worlds of a batch to restore, and for each the world of a snapshot from which it gets its state."""

    worlds: np.ndarray | None  # (k,) indices into the batch; None: all
    source: np.ndarray | None  # (k,) indices into the snapshot; None: its one world, or its worlds in their order
    is_all: bool  # every world of the batch is among them


def capture(world: Batch, worlds, out: Snapshot | None) -> Snapshot:
    """Take a snapshot of the chosen `worlds` of a batch (None: all) into `out`, or into new arrays.

    `World.snapshot` documents arguments and errors.
    """
    chosen = None if worlds is None else choice.world_indices(worlds, world.worlds)
    kept, rows = world.kept(), world.kept_rows()
    actuation = None if world.actuation is None else world.actuation.kept(chosen)
    if chosen is None:
        parts = kept
    else:
        parts = tuple(_by_world(array, n, world.worlds)[chosen] if n else array for array, n in zip(kept, rows))
    if out is None:
        arrays = (part.copy() if part is array else part.reshape(-1, array.shape[-1])
                  for part, array in zip(parts, kept))  # fmt: skip
        return Snapshot(tuple(arrays), world.time, actuation, scene=world.scene_settings)
    count = world.worlds if chosen is None else len(chosen)
    validation.instance(out, Snapshot, "out", "None or a physics.Snapshot")
    if not (_fits(world, out, count) and all(array.flags.writeable for array in out.arrays)):
        raise ValueError(f"out is {out!r}; allowed is a snapshot of this scene, of {count} worlds, that can be written")
    for target, part, array in zip(out.arrays, parts, kept):
        _copy(world, part.reshape(target.shape), target, array is world.memory)
    out.renew(world.time, actuation, world.scene_settings)
    return out


def find_targets(world: Batch, snapshot: Snapshot, worlds, source) -> Targets:
    """Check the arguments of `World.restore`, which documents them; return the worlds to restore and their sources."""
    validation.instance(snapshot, Snapshot, "snapshot", "a physics.Snapshot, as `World.snapshot` gives it")
    is_own = snapshot.scene is world.scene_settings
    if not is_own:
        _check_scene(world, snapshot)
    if (
        worlds is None and source is None and not snapshot.is_read and is_own and _is_alike(world, snapshot)
    ):  # the most frequent
        return Targets(None, None, True)
    chosen = None if worlds is None else choice.world_indices(worlds, world.worlds)
    count = world.worlds if chosen is None else len(chosen)
    held = _world_count(world, snapshot, count)
    if not is_own:
        _check_inertia(world, snapshot)
    if snapshot.is_read:
        check_numbers(world, snapshot)
    if source is None:
        if held not in (1, count):
            raise _other_snapshot(snapshot, count)
        if chosen is not None and held == 1:
            source = np.zeros(count, dtype=np.int64)
    elif np.ndim(source) == 0:
        source = np.full(count, validation.index(source, held, "source"))
    else:
        given, source = source, choice.world_indices(source, held, "source", once=False)
        if len(source) != count:
            raise ValueError(f"source is {shown(given)}; allowed is one index, or {count}, for each world restored")
    return Targets(chosen, source, count == world.worlds)


def reinstate(world: Batch, snapshot: Snapshot, targets: Targets) -> None:
    """Restore the target worlds of a batch from a snapshot; `targets` come from `find_targets`."""
    chosen, source, is_all = targets
    if not is_all and snapshot.time != world.time:
        _check_clock(world, snapshot)
    where = slice(None) if chosen is None else chosen
    for array, value, n in zip(world.kept(), snapshot.arrays, world.kept_rows()):
        if value.shape == array.shape and chosen is None and source is None:
            _copy(world, value, array, array is world.memory)
        elif n:
            rows = _by_world(value, n, snapshot.worlds)
            _by_world(array, n, world.worlds)[where] = rows if source is None else rows[source]
    if world.actuation is not None:
        _reinstate_actuation(world, snapshot, targets)
    if is_all:
        world.time = snapshot.time
    if world.impacts is not None:  # written out: the call takes 3 % of a restore
        world.impacts.forget(world, where)
    if world.recorder is not None:
        world.recorder.changed(where)


def remember(world: Batch) -> Undo:
    """Copy the whole state of a batch; return a function that restores it."""
    before = capture(world, None, None)
    return lambda: reinstate(world, before, Targets(None, None, True))


def _reinstate_actuation(world: Batch, snapshot: Snapshot, targets: Targets) -> None:
    chosen = np.arange(world.worlds) if targets.worlds is None else targets.worlds
    if snapshot.actuation is None:  # the snapshot is of a world without an actuator
        world.actuation.forget(chosen)
        return
    source = np.arange(snapshot.worlds) if targets.source is None else targets.source
    source = np.broadcast_to(source, len(chosen))
    world.actuation.reinstate_worlds(snapshot.actuation, source, chosen)


def _copy(world: Batch, source: np.ndarray, target: np.ndarray, is_memory: bool) -> None:
    """Copy one array between a batch and a snapshot, for all worlds; `is_memory` marks the contact memory."""
    if is_memory and world.plan.contact:
        world.plan.scheme.memory.copy(source, target)
    else:
        target[...] = source


def _by_world(array: np.ndarray, rows: int, worlds: int) -> np.ndarray:
    """View an array with `rows` rows for each world as one row (worlds, rows * columns) for each world."""
    return array.reshape(worlds, rows * array.shape[-1])


def _is_alike(world: Batch, snapshot: Snapshot) -> bool:
    """True if a snapshot's arrays have the shapes of this batch: as many worlds of an equal scene."""
    return _fits(world, snapshot, world.worlds)


def _fits(world: Batch, snapshot: Snapshot, count: int) -> bool:
    """True if the arrays of a snapshot have the types and shapes of `count` worlds of this batch's scene."""
    kept, arrays = world.kept(), snapshot.arrays
    if len(arrays) != len(kept):
        return False
    for array, value, rows in zip(kept, arrays, world.kept_rows()):
        if not isinstance(value, np.ndarray) or value.dtype != array.dtype:
            return False
        if value.shape != (rows * count if rows else len(array), array.shape[1]):
            return False
    return world.actuation is None or _fits_actuation(snapshot.actuation, count * world.body_count)


def _fits_actuation(actuation: tuple | None, rows: int) -> bool:
    if actuation is None:
        return True
    output, late = actuation
    return all(np.shape(table) == (rows, 6) for table in (output, *(command for _, command in late)))


def _world_count(world: Batch, snapshot: Snapshot, count: int) -> int:
    """Number of worlds in a snapshot; ValueError if its arrays do not fit the scene. `count` is for the message."""
    if any(getattr(value, "dtype", None) != np.float64 for value in snapshot.arrays):
        raise ValueError(f"snapshot is {snapshot!r}; allowed are arrays of 64-bit numbers, as they were taken")
    held = snapshot.worlds if len(snapshot.arrays) == len(world.kept()) else 0
    if not _fits(world, snapshot, held):
        raise _other_snapshot(snapshot, count)
    return held


def _check_scene(world: Batch, snapshot: Snapshot) -> None:
    """Raise a ValueError if a snapshot's scene differs from this one in settings that no array holds."""
    other = None if snapshot.scene is None else other_setting(world.scene_settings, snapshot.scene)
    if other is not None:
        name, ours, theirs = other
        raise ValueError(
            f"snapshot is of another scene, whose {name} are {shown(theirs)}; allowed is one of this scene, whose "
            f"{name} are {shown(ours)}"
        )


def _check_inertia(world: Batch, snapshot: Snapshot) -> None:
    """Raise a ValueError if the kernel of the scene cannot compute the rotation of a snapshot's bodies."""
    plan, rows = world.plan, snapshot.arrays[KEPT.index("params")]
    moving = rows[rows[:, at.INV_MASS] > 0.0]
    is_odd = not plan.gyroscopic and not is_isotropic(1.0 / moving[:, at.INV_INERTIA : at.INV_INERTIA + 3]).all()
    if not plan.offset_frame:
        is_odd |= bool(rows[:, at.CENTER : at.CENTER + 3].any())
        is_odd |= bool(plan.gyroscopic and rows[:, at.PRINCIPAL + 1 : at.PRINCIPAL + 4].any())
    if is_odd:
        raise ValueError(
            f"snapshot is {snapshot!r}, with inertias or centres of mass that the kernel of this scene leaves out; "
            "allowed are such as its bodies have: give a body of the scene such a size, inertia_body or center"
        )


def _other_snapshot(snapshot: Snapshot, count: int) -> ValueError:
    sizes = "1 world" if count == 1 else f"1 world or of {count} worlds"
    return ValueError(
        f"snapshot is {snapshot!r}, of another scene or batch size; allowed is one of this scene, of {sizes}, or of "
        "any number with `source`, which names those to take"
    )


def _check_clock(world: Batch, snapshot: Snapshot) -> None:
    """Raise a ValueError if a field or a motion depends on time, as worlds of one batch cannot have different times.

    It is called when only some worlds are restored, from a snapshot of another time.
    """
    if reads_time(world.plan, world.params) or reads_time(world.plan, snapshot.arrays[KEPT.index("params")]):
        raise ValueError(
            f"snapshot is of time {snapshot.time!r} s, and the batch of time {world.time!r} s, in a scene with a field "
            "or a motion that may change with time; allowed is to restore all worlds, or a snapshot of the same time "
            "(dataclasses.replace(snapshot, time=world.time), if the time does not matter)"
        )
