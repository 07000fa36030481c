"""Contacts and impacts of a batch of worlds, as users read them: methods of `World`."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from physics import validation
from physics.keywords import known_keywords
from physics.parallel.exclusive import exclusive
from physics.scene.body_names import body_index
from physics.schemes.contacts import EVERY_BODY, Contacts
from physics.world import choice
from physics.world.batch import Batch
from physics.world.contacts import (
    contact_rows,
    contacts_of_world,
    read_contacts,
    write_contact_forces,
    write_contact_impulses,
)
from physics.world.impacts import IMPACT_ROOM, Impacts, KeptImpacts, read_impacts

MOST_ROWS = 65_536


class Touching(Batch):
    """Base of `World` with the methods that read contacts and impacts."""

    def read_contacts(
        self, worlds: ArrayLike | None = None, rows: int | None = None, body: int | str | None = None
    ) -> Contacts:
        """Read the resting contacts of many worlds in their last step.

        Parameters
        ----------
        worlds : (n,) int array_like or (worlds,) mask, optional
            Indices of the worlds to read, in this order; None: all.
        rows : int, optional
            Largest number of contacts for each world; a world with more shows those with the largest forces. None: 12
            for each body, limited by the room of the contact memory.
        body : int or str, optional
            Index or name of a body: only its contacts are read, with it as their first body.

        Returns
        -------
        Contacts
            New arrays with a row for each world; `Contacts` documents units, frames and order.

        Raises
        ------
        ValueError
            A world or a body that does not exist, or `rows` out of range.
        """
        indices, of = self._chosen(worlds), self._body(body)
        return read_contacts(self, indices, contact_rows(self) if rows is None else _rows(rows), of)

    def read_contact_sums(self, worlds: ArrayLike | None = None) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Read the sums of the forces and impulses of all resting contacts of each body in the last step.

        Parameters
        ----------
        worlds : (n,) int array_like or (worlds,) mask, optional
            Indices of the worlds to read, in this order; None: all.

        Returns
        -------
        force, impulse : (n, bodies, 3) float64
            Sums of `Contacts.force` [N] and of `Contacts.impulse` [N s] of all contacts of each body, world frame.

        Raises
        ------
        ValueError
            A world that does not exist.
        """
        indices = self._chosen(worlds)
        force, impulse = (np.empty((len(indices), self.body_count, 3)) for _ in range(2))
        write_contact_forces(self, indices, force)
        write_contact_impulses(self, indices, force, impulse)
        return force, impulse

    @known_keywords
    @exclusive
    def keep_impacts(self, room: int = IMPACT_ROOM) -> None:
        """Keep the impacts of each step from now on, for `read_impacts`; without this call a step keeps none.

        The bits of the states do not depend on it. A second call can only enlarge the room.

        Parameters
        ----------
        room : int
            Number of events for which there is room, for each body and kernel call; an event takes 104 bytes. Events
            are impacts; with the scheme ``events`` also contacts that begin, end, stick and slip. `StepReport.left_out`
            and `Impacts.left_out` count events without room.

        Raises
        ------
        ValueError
            `room` is out of range, or a `Stepper` of this world has taken a step; its calls could not keep impacts.
        """
        room = validation.count(room, "room")
        if self.impacts is not None and self.impacts.room >= room:
            return
        if self.is_bound:
            raise ValueError(
                f"keep_impacts(room={room}) comes after a Stepper of this world has taken a step, and would not reach "
                "it; allowed is to call it before, or to make an environment with impacts=N"
            )
        self.impacts = KeptImpacts(room, is_known=self.time == 0.0)
        self._make_event_room(room)
        self.is_plain = False

    def read_impacts(
        self, worlds: ArrayLike | None = None, rows: int | None = None, body: int | str | None = None
    ) -> Impacts:
        """Read the impacts of many worlds in their last step.

        Parameters
        ----------
        worlds : (n,) int array_like or (worlds,) mask, optional
            Indices of the worlds to read, in this order; None: all.
        rows : int, optional
            Largest number of pairs for each world; a world with more shows those with the largest impulses. None: as
            many as in `read_contacts`.
        body : int or str, optional
            Index or name of a body: only its pairs are read, with it as their first body. `Impacts.total` covers all
            bodies.

        Returns
        -------
        Impacts
            New arrays with a row for each world; `Impacts` documents units, frames and order.

        Raises
        ------
        ValueError
            A world or a body that does not exist, `rows` out of range, or a last step whose impacts were not kept,
            since `keep_impacts` was not called before it.
        """
        if self.impacts is None or not self.impacts.is_known:
            raise ValueError(
                "read_impacts() follows a step whose impacts were not kept; allowed is to call "
                "World.keep_impacts() before the step (rollouts keep none)"
            )
        indices, of = self._chosen(worlds), self._body(body)
        return read_impacts(self, self.impacts, indices, contact_rows(self) if rows is None else _rows(rows), of)

    def contacts(self, world: int = 0) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Points and forces of the resting contacts in the last step of one world; `read_contacts` reads many worlds.

        Returns
        -------
        points : (n, 3) float64
            Contact points, world frame [m].
        forces : (n, 3) float64
            Forces on the body, or on the first of two bodies, world frame [N]. Time stepping averages them over the
            last resting stage; the event-driven scheme has those at the end of the step. A resting stage is the whole
            step unless an impact cuts the step. In an uncut step forces times step, impulses of impacts
            (`read_impacts`) and loads add up to the change of momentum, except for bodies pushed out of walls.
        """
        found = contacts_of_world(self, self._index(world))
        return found.point[0], found.force[0]

    def contact_ends(self, world: int = 0) -> NDArray[np.int64]:
        """Bodies of each of the `contacts` of one world, (n, 2) int64: first body; other body, or -1 - k for wall k."""
        return contacts_of_world(self, self._index(world)).ends[0]

    def touching(self, world: int = 0) -> set[tuple[int, int]]:
        """Pairs (body, wall) that have a resting contact in the last step of one world, as indices."""
        return {(int(body), -1 - int(other)) for body, other in self.contact_ends(world) if other < 0}

    def _index(self, world: int) -> int:
        return validation.index(world, self.worlds, "world")

    def _chosen(self, worlds: ArrayLike | None) -> NDArray[np.int64]:
        return np.arange(self.worlds) if worlds is None else choice.world_indices(worlds, self.worlds, once=False)

    def _body(self, body: int | str | None) -> int:
        if isinstance(body, str):
            return body_index(body, "body", self.scene)
        return EVERY_BODY if body is None else validation.index(body, self.body_count, "body")


def _rows(rows: int) -> int:
    return validation.count(rows, "rows", least=0, most=MOST_ROWS)
