"""Drawing of bodies with viser: bodies of one shape share a node, so a picture takes few messages for many bodies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rigid_env.rendering import Frame, palette
from rigid_env.rendering.frame import body_colour
from rigid_env.viewer.scenery import Placement, vivid
from rigid_env.viewer.shapes import Part, parts, shape_key

ASLEEP = (176, 182, 192)
"""RGB colour that the colour of a sleeping body is mixed with."""

ASLEEP_SHARE = 0.72
"""Share of `ASLEEP` in the colour of a sleeping body."""

GHOST_OPACITY = 0.32


@dataclass(frozen=True, eq=False)
class _Batch:
    """Solids of one shape: their indices in `Frame.solids`, and each part of the shape with its node of the scene."""

    members: np.ndarray
    is_hull: bool
    nodes: list[tuple[Part, object]]


class Bodies:
    """Solid bodies in viser's scene, or translucent ones for the ghost; compounds as their convex parts.

    Parameters
    ----------
    scene : viser.SceneApi
    root : str
        Name of the parent node.
    placement : Placement
        Scale and origin of the drawing.
    is_ghost : bool
        True draws translucent bodies without rims and shadows.
    added : callable, optional
        Called with each new node and the indices of the bodies in it.
    """

    def __init__(
        self, scene, root: str, placement: Placement, is_ghost: bool = False, added: Callable | None = None
    ):  # fmt: skip
        self._scene, self._root, self._placement = scene, root, placement
        self._is_ghost, self._added = is_ghost, added
        self._keys, self._batches, self._owners = None, [], np.zeros(0, dtype=int)

    def show(self, frame: Frame, is_asleep=None) -> None:
        """Move the bodies to their poses in a `Frame`; sleeping bodies, flagged in `is_asleep` (bodies,), are paler."""
        bodies, self._owners = frame.solids.bodies, frame.owners
        keys = [shape_key(body) for body in bodies]
        count = len(bodies)
        colours = np.array([body_colour(body, k) for k, body in enumerate(bodies)]).reshape(count, 3)
        if is_asleep is not None and np.any(is_asleep):
            is_asleep = np.asarray(is_asleep)[self._owners]
            colours[is_asleep] = np.rint((1.0 - ASLEEP_SHARE) * colours[is_asleep] + ASLEEP_SHARE * np.array(ASLEEP))
        pos, size, quat = (
            np.array([getattr(body, name) for body in bodies]).reshape(count, width)
            for name, width in (("pos", 3), ("dimensions", 3), ("quat", 4))
        )
        drawn = self._placement.drawn(pos), (self._placement.scale * size).astype(np.float32), quat.astype(np.float32)
        if keys != self._keys:
            self.clear()
            self._add(keys, *drawn, colours)
        for batch in self._batches:
            self._move(batch, *drawn, colours)

    def clear(self) -> None:
        """Remove all bodies from viser's scene."""
        for batch in self._batches:
            for _, node in batch.nodes:
                node.remove()
        self._keys, self._batches = None, []

    def _add(self, keys, pos, size, quat, colours) -> None:
        groups: dict = {}
        for index, key in enumerate(keys):
            groups.setdefault(key, []).append(index)
        for number, (key, members) in enumerate(groups.items()):
            members = np.array(members)
            batch = _Batch(members, isinstance(key, tuple), [])
            shown = [part for part in parts(key) if not (part.is_rim and self._is_ghost)]
            for place, part in enumerate(shown):
                node = self._scene.add_batched_meshes_simple(
                    f"{self._root}/{number}.{place}", part.vertices, part.faces, quat[members], pos[members],
                    batched_scales=self._sizes(batch, size), batched_colors=_shade(colours[members], part),
                    flat_shading=part.is_flat, lod="off", opacity=GHOST_OPACITY if self._is_ghost else None,
                    cast_shadow=not (self._is_ghost or part.is_rim), receive_shadow=False,
                )  # fmt: skip
                batch.nodes.append((part, node))
                if self._added is not None:
                    self._added(node, self._owners[members])
            self._batches.append(batch)
        self._keys = keys

    def _move(self, batch: _Batch, pos, size, quat, colours) -> None:
        """Set the poses, sizes and colours of one batch; viser sends only arrays that have changed."""
        pos, quat, colours = pos[batch.members], quat[batch.members], colours[batch.members]
        sizes = self._sizes(batch, size)
        for part, node in batch.nodes:
            node.batched_positions, node.batched_wxyzs, node.batched_scales = pos, quat, sizes
            node.batched_colors = _shade(colours, part)

    def _sizes(self, batch: _Batch, size: np.ndarray) -> np.ndarray:
        """Factors (members, 3) that stretch the shape of a batch along its axes."""
        if batch.is_hull:
            return np.full((len(batch.members), 3), self._placement.scale, dtype=np.float32)
        return size[batch.members]


def _shade(colours: np.ndarray, part: Part) -> np.ndarray:
    """Colours (n, 3) uint8 of one part of n bodies, from the colours of the bodies."""
    return vivid(colours + part.lightening * (np.array(palette.HALO) - colours))
