"""Calls of query kernels, prepared once for a batch of worlds and made often."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from physics.kernels.parallel.work_stealing import make_ranges, make_taken_lists
from physics.kernels.queries.query_scratch import QueriedBodies, QueryScratch, RoundKinds, make_query_scratch
from physics.kernels.state.groups import WorkQueue
from physics.parallel.bound_call import BoundCall, bound_alike
from physics.scene.parts import part_list, with_parts
from physics.scene.polyhedra import every_polyhedron
from physics.world.batch import Batch

# Places of the arguments of a query kernel: queue, worlds, bodies, scratch, then the question and its answer.
_QUEUE, _INDICES, _QUESTION = 0, 1, 4

# Solid of a capsule, which has no polyhedron: its axis is a segment. It calls for kernels that know capsules.
CAPSULE = "capsule"

# Different polyhedra for which scratch and calls are kept; a further one clears all.
MOST_SOLIDS = 16


class QueryCalls:
    """Prepared calls of query kernels, with the scratch memory of each thread.

    A query kernel takes (queue, indices, bodies, scratch) and a question. It answers the question for each place k
    of `indices` that it takes from the queue, where the world `indices[k]` is asked.

    Parameters
    ----------
    world : Batch
        Batch whose arrays are bound. The object holds no reference to the batch.
    """

    def __init__(self, world: Batch):
        self._bodies = QueriedBodies(world.state, world.params, world.shapes)
        self._solids, self._walls = every_polyhedron(world.scene.bodies), world.walls
        kinds = {body.kind for body in with_parts(world.scene.bodies)}
        self._kinds = RoundKinds("capsule" in kinds or None, "cylinder" in kinds or None)
        self._parts = part_list(world.scene.bodies)
        self._team, self._all = world.team, np.arange(world.worlds)
        self._scratch: dict[int, tuple[Any, list[QueryScratch]]] = {}
        self._calls: dict[tuple, list[BoundCall]] = {}
        self._bound: dict[tuple, tuple] = {}  # questions to which the calls are bound

    def ask(self, kernel: Callable, indices: np.ndarray | None, *question, solid: Any = None) -> None:
        """Answer a question about the worlds `indices`.

        All worlds (None) are shared by the threads of the batch; the calling thread alone takes a choice of worlds. The
        types of the `question` must be the same in each call with the same kernel. `solid` is the polyhedron of a shape
        in the question, `CAPSULE` for a capsule, None for another round shape.
        """
        is_all = indices is None
        if indices is None:
            queues, places = self._team.queues, self._all
        else:
            queues, places = [_queue_of(len(indices))], indices
        key, same = (kernel, is_all, id(solid)), _contents(question)
        scratches = self._scratch_for(solid)
        if key not in self._calls:
            bodies = scratches[0].bodies  # on whose types the kernel depends
            types = bodies.capsules, bodies.cylinders, bodies.parts is None
            self._calls[key] = [
                bound_alike(types, kernel, queue, places, self._bodies, scratch, *question)
                for queue, scratch in zip(queues, scratches)
            ]
        elif self._bound[key] != same:
            for call in self._calls[key]:
                for k, argument in enumerate(question, _QUESTION):
                    call.put(k, argument)
        self._bound[key] = same
        calls = self._calls[key]
        if is_all:
            self._team.run(calls)
        elif len(places):
            calls[0].put(_QUEUE, queues[0])
            calls[0].put(_INDICES, places)
            calls[0]()

    def _scratch_for(self, solid: Any) -> list[QueryScratch]:
        """Scratch memory of each thread, with room for a shape besides the bodies; the solid is kept for its `id`."""
        if id(solid) not in self._scratch:
            if len(self._scratch) == MOST_SOLIDS:
                for kept in (self._scratch, self._calls, self._bound):
                    kept.clear()
            kinds = self._kinds._replace(capsules=True) if solid is CAPSULE else self._kinds
            solids = [*self._solids, None if solid is CAPSULE else solid]
            bodies = len(self._solids) - len(self._parts)
            made = [make_query_scratch(bodies, self._walls, solids, kinds, self._parts) for _ in range(self._team.size)]
            self._scratch[id(solid)] = solid, made
        return self._scratch[id(solid)][1]


def _queue_of(count: int) -> WorkQueue:
    """Queue of `count` places, for one thread."""
    return WorkQueue(make_ranges(1, count, count), make_taken_lists(1, count)[0])


def _contents(value):
    """Key of a question: its numbers, and address and shape of each of its arrays. Equal keys share a bound call."""
    if isinstance(value, tuple):
        return tuple(map(_contents, value))
    return (value.ctypes.data, value.shape) if isinstance(value, np.ndarray) else value
