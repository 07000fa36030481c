"""Impacts and their impulses in the last step of a batch of worlds, read from the log of events."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from physics.compiler.decorators import kernel
from physics.html_table import parts_table
from physics.kernels.state import layout as at
from physics.kernels.time_stepping import event_log as ev
from physics.schemes.contact_memory import call
from physics.schemes.contacts import EVERY_BODY, Strongest, keep_strongest
from physics.summary import parts_repr
from physics.world.batch import Batch

IMPACT_ROOM = 256
"""Default number of events for which the log has room, for each body and kernel call."""


class Impacts(NamedTuple):
    """Impacts of n worlds in the last step: a row for each pair of bodies, or body and wall, that collided.

    The last step is the last call of `World.step` or of a `Stepper`, with all its steps and substeps; in an environment
    it is the last control step. Impulses of resting contacts are left out: `physics.Contacts` has them. An approach so
    slow that a resting stage stops it counts as a resting contact.

    A world with more pairs than rows shows the pairs with the largest impulses; of equal ones, the first. Pairs are
    in the order of their first bodies, then of their first impacts. Rows without a pair are zero. Between a reset or
    a restored snapshot and the next step there are no impacts.

    Attributes
    ----------
    count : (n,) int64
        Pairs that collided; this exceeds the number of rows where some pairs have no row.
    point : (n, rows, 3) float64
        Mean of the points of the pair's impacts, weighted by the sizes of their impulses, world frame [m].
    impulse : (n, rows, 3) float64
        Sum of the impulses of the pair's impacts on the first body, world frame [N s]. The other body gets the
        opposite impulse.
    hits : (n, rows) int64
        Number of impacts of the pair.
    ends : (n, rows, 2) int64
        Index of the first body; index of the other body, or -1 - k for wall k.
    total : (n, bodies, 3) float64
        Sum of the impulses of all impacts on each body, those without a row included, world frame [N s].
    left_out : (n,) int64
        Events for which the log had no room, and whose impulses are missing. `World.keep_impacts` makes more room.
    """

    count: np.ndarray
    point: np.ndarray
    impulse: np.ndarray
    hits: np.ndarray
    ends: np.ndarray
    total: np.ndarray
    left_out: np.ndarray

    __repr__ = parts_repr
    _repr_html_ = parts_table

    def _parts(self) -> tuple[str, ...]:
        return (
            f"worlds={len(self.count)}", f"rows={self.ends.shape[1]}", f"pairs={self.count.sum()}",
            f"left_out={self.left_out.sum()}",
        )  # fmt: skip


class _Pairs(NamedTuple):
    """Workspace with the pairs that collided in one world, in the order of `Impacts`."""

    ends: np.ndarray  # (pairs, 2) int64
    hits: np.ndarray  # (pairs,) int64
    impulse: np.ndarray  # (pairs, 3), on the first body [N s]
    moment: np.ndarray  # (pairs, 3), sum of points times weights [m N s]
    weight: np.ndarray  # (pairs,), sum of the sizes of impulses [N s]


class _Log(NamedTuple):
    """Events of all kernel calls of a step; each body's events of one call follow those of the call before."""

    events: np.ndarray  # (worlds * bodies, room of all calls, EVENT_SIZE)
    counts: np.ndarray  # (worlds * bodies, calls) int64, events of each call
    starts: np.ndarray  # (calls,) int64, first row of each call
    room: int  # rows for a body's events in one call


class KeptImpacts:
    """Events of all kernel calls of the last step; the log of a batch holds those of the last call only.

    Parameters
    ----------
    room : int
        Events for which the log has room, for each body and call.
    is_known : bool
        Initial value of the attribute.

    Attributes
    ----------
    is_known : bool
        Whether the impacts of the last step are kept, or no step has been made since the states were set.
    """

    def __init__(self, room: int, is_known: bool):
        self.room, self.is_known = room, is_known
        self._goes_on = False
        self._earlier: list[tuple[np.ndarray, np.ndarray]] = []  # events and counts of earlier calls of the step

    def note(self, world: Batch) -> None:
        """Record that a kernel call was made; its events without room are added to the batch's report."""
        if not self._goes_on:
            self._earlier = []
        self.is_known, self._goes_on = True, False
        room = world.event_log.shape[1]
        if world.event_counts.max() > room:
            missing = np.maximum(world.event_counts - room, 0).reshape(world.worlds, -1).sum(axis=1)
            world.report_table[:, at.CONTACTS_LEFT_OUT] += missing

    def go_on(self, world: Batch) -> None:
        """Copy the events of the last call, since the next call belongs to the same step."""
        counts = world.event_counts
        self._earlier.append((world.event_log[:, : int(counts.max())].copy(), counts.copy()))
        self._goes_on = True

    def forget(self, world: Batch, chosen: np.ndarray | slice) -> None:
        """Forget the impacts of the `chosen` worlds, whose states were changed from outside."""
        for counts in (world.event_counts, *(counts for _, counts in self._earlier)):
            counts.reshape(world.worlds, -1)[chosen] = 0
        self.is_known = self.is_known or type(chosen) is slice or len(chosen) == world.worlds

    def log(self, world: Batch) -> _Log:
        """Join the events of all calls of the last step."""
        room = world.event_log.shape[1]
        if not self._earlier:
            return _Log(world.event_log, world.event_counts[:, None], np.zeros(1, np.int64), room)
        now = world.event_log[:, : int(world.event_counts.max())], world.event_counts
        events, counts = zip(*self._earlier, now)
        starts = np.cumsum([0, *(each.shape[1] for each in events[:-1])])
        return _Log(np.concatenate(events, axis=1), np.stack(counts, axis=1), starts, room)


@kernel
def _pair(a, other, first, count, pairs):
    """Index in `pairs` of the pair of body `a` and `other` (a body, or -1 - wall).

    Pairs of body `a` are at `first` to `count` - 1. A new pair is written at `count`, with zero sums.
    """
    for k in range(first, count):
        if pairs.ends[k, 1] == other:
            return k
    pairs.ends[count, 0], pairs.ends[count, 1] = a, other
    pairs.hits[count], pairs.weight[count] = 0, 0.0
    for c in range(3):
        pairs.impulse[count, c] = pairs.moment[count, c] = 0.0
    return count


@kernel
def _add(i, row, k, events, pairs):
    """Add the impact in row `row` of the events of body `i` of the batch to the sums of pair `k`."""
    size = 0.0
    for c in range(3):
        size += events[i, row, ev.EVENT_IMPULSE + c] * events[i, row, ev.EVENT_IMPULSE + c]
    size = math.sqrt(size)
    pairs.hits[k] += 1
    pairs.weight[k] += size
    for c in range(3):
        pairs.impulse[k, c] += events[i, row, ev.EVENT_IMPULSE + c]
        pairs.moment[k, c] += size * events[i, row, ev.EVENT_POINT + c]


@kernel
def _collect(n, world, log, pairs, out):
    """Collect the pairs of a world that collided into `pairs`; return their number.

    The totals of its bodies, and the events without room, go to row `n` of `out`, an `Impacts`.
    """
    bodies, count = out.total.shape[1], 0
    for a in range(bodies):
        i, first = world * bodies + a, count
        for part in range(log.starts.shape[0]):
            held = min(log.counts[i, part], log.room)
            out.left_out[n] += log.counts[i, part] - held
            for row in range(log.starts[part], log.starts[part] + held):
                if log.events[i, row, ev.EVENT_KIND] != ev.KIND_IMPACT:
                    continue
                wall, b = int(log.events[i, row, ev.EVENT_WALL]), int(log.events[i, row, ev.EVENT_OTHER])
                k = _pair(a, b if b >= 0 else -1 - wall, first, count, pairs)
                count = max(count, k + 1)
                _add(i, row, k, log.events, pairs)
                for c in range(3):
                    out.total[n, a, c] += log.events[i, row, ev.EVENT_IMPULSE + c]
                    if b >= 0:
                        out.total[n, b, c] -= log.events[i, row, ev.EVENT_IMPULSE + c]
    return count


@kernel
def _read(indices, body, log, pairs, strongest, out):
    """Read the impacts of the worlds `indices` from `log` into `out`, an `Impacts`.

    With a `body` other than `EVERY_BODY` only its pairs are read, with it as their first body.
    """
    for n in range(indices.shape[0]):
        found, kept = _collect(n, indices[n], log, pairs, out), 0
        for k in range(found):
            if body == EVERY_BODY or pairs.ends[k, 0] == body or pairs.ends[k, 1] == body:
                size = pairs.impulse[k, 0] ** 2 + pairs.impulse[k, 1] ** 2 + pairs.impulse[k, 2] ** 2
                out.count[n] += 1
                kept = keep_strongest(kept, k, size, strongest)
        for row in range(kept):
            k, sign = strongest.place[row], 1.0
            a, b = pairs.ends[k, 0], pairs.ends[k, 1]
            if b >= 0 and b == body:
                a, b, sign = b, a, -1.0
            out.ends[n, row, 0], out.ends[n, row, 1], out.hits[n, row] = a, b, pairs.hits[k]
            for c in range(3):
                out.impulse[n, row, c] = sign * pairs.impulse[k, c]
                out.point[n, row, c] = pairs.moment[k, c] / pairs.weight[k]


def read_impacts(world: Batch, kept: KeptImpacts, indices: np.ndarray, rows: int, body: int = EVERY_BODY) -> Impacts:
    """Read the impacts of the worlds `indices` (n,) int64 in the last step, of one body or of `EVERY_BODY`.

    `rows` is the number of rows of the result for each world; `World.read_impacts` tells more.
    """
    n, bodies, log = len(indices), world.body_count, kept.log(world)
    out = Impacts(
        np.zeros(n, np.int64), np.zeros((n, rows, 3)), np.zeros((n, rows, 3)), np.zeros((n, rows), np.int64),
        np.zeros((n, rows, 2), np.int64), np.zeros((n, bodies, 3)), np.zeros(n, np.int64),
    )  # fmt: skip
    most = int(log.counts.sum())  # events of all worlds, at least as many as pairs in one world
    pairs = _Pairs(
        np.empty((most, 2), np.int64), np.empty(most, np.int64), np.empty((most, 3)), np.empty((most, 3)),
        np.empty(most),
    )  # fmt: skip
    strongest = Strongest(np.empty(rows, np.int64), np.empty(rows))
    call(_read, np.ascontiguousarray(indices, np.int64), int(body), log, pairs, strongest, out)
    return out
