"""Contacts and impacts of a batch of worlds, as users read them: the part of `World` that tells what touches."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from physics import validation
from physics.keywords import known_keywords
from physics.parallel.exclusive import exclusive
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
    """Part of `World` that reads contacts and impacts."""

    def read_contacts(
        self, worlds: ArrayLike | None = None, rows: int | None = None, body: int | None = None
    ) -> Contacts:
        """Read the resting contacts of many worlds at their last step.

        Parameters
        ----------
        worlds : (n,) int array_like or (worlds,) mask, optional
            Worlds that are read, in this order; None: all.
        rows : int, optional
            Contacts of each world that are shown: those with the largest forces. None: 12 for each body, at most as
            many as there is room for.
        body : int, optional
            Only the contacts of this body, which then is their first one.

        Returns
        -------
        Contacts
            New arrays with a row for each world; see there for units, frames, order and the step that they are of.

        Raises
        ------
        ValueError
            A world or a body that is not there, or rows out of range.
        """
        indices, of = self._chosen(worlds), self._body(body)
        return read_contacts(self, indices, contact_rows(self) if rows is None else _rows(rows), of)

    def read_contact_sums(self, worlds: ArrayLike | None = None) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Read the sums of the resting contacts of each body.

        Parameters
        ----------
        worlds : (n,) int array_like or (worlds,) mask, optional
            Worlds that are read, in this order; None: all.

        Returns
        -------
        force, impulse : (n, bodies, 3) float64
            Sums of `Contacts.force` [N] and of `Contacts.impulse` [N s] of all contacts of each body, world frame.

        Raises
        ------
        ValueError
            A world that is not there.
        """
        indices = self._chosen(worlds)
        force, impulse = (np.empty((len(indices), self.body_count, 3)) for _ in range(2))
        write_contact_forces(self, indices, force)
        write_contact_impulses(self, indices, force, impulse)
        return force, impulse

    @known_keywords
    @exclusive
    def keep_impacts(self, room: int = IMPACT_ROOM) -> None:
        """Keep the impacts of each step from now on, for `read_impacts`; without this a step keeps none.

        States keep their bits. A world that has them already keeps the larger room.

        Parameters
        ----------
        room : int
            Events of a body in one call of a step that there is room for; 104 bytes each. Events are impacts; of the
            scheme ``events`` also contacts that begin, end, stick and slip. `StepReport.left_out` and
            `Impacts.left_out` count those without room.

        Raises
        ------
        ValueError
            `room` is out of range, or a `Stepper` of this world has taken a step: it would not keep them.
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
        self, worlds: ArrayLike | None = None, rows: int | None = None, body: int | None = None
    ) -> Impacts:
        """Read the impacts of many worlds in their last step.

        Parameters
        ----------
        worlds : (n,) int array_like or (worlds,) mask, optional
            Worlds that are read, in this order; None: all.
        rows : int, optional
            Pairs of each world that are shown: those with the largest impulses. None: as many as of `read_contacts`.
        body : int, optional
            Only the pairs of this body, which then is their first one. `Impacts.total` holds all bodies.

        Returns
        -------
        Impacts
            New arrays with a row for each world; see there for units, frames, order and the step that they are of.

        Raises
        ------
        ValueError
            A world or a body that is not there, rows out of range, or a last step whose impacts were not kept:
            `keep_impacts` comes first.
        """
        if self.impacts is None or not self.impacts.is_known:
            raise ValueError(
                "read_impacts() follows a step whose impacts were not kept; allowed is to call "
                "World.keep_impacts() before the step (rollouts keep none)"
            )
        indices, of = self._chosen(worlds), self._body(body)
        return read_impacts(self, self.impacts, indices, contact_rows(self) if rows is None else _rows(rows), of)

    def contacts(self, world: int = 0) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Contact points and forces of one world's last step; `read_contacts` reads many worlds, and tells more.

        Returns
        -------
        points : (n, 3) float64
            World frame [m].
        forces : (n, 3) float64
            On the body, of two bodies on the first one, world frame [N]. Time stepping averages them over the last
            resting stage; the event-driven scheme has those at the end of the step. A stage is the whole step unless
            something was met in it. Then forces times step, impulses of impacts (`read_impacts`) and loads make up
            the change of momentum, but for bodies that were pushed out of walls.
        """
        found = contacts_of_world(self, self._index(world))
        return found.point[0], found.force[0]

    def contact_ends(self, world: int = 0) -> NDArray[np.int64]:
        """(n, 2) int64: body, and other body or -1 - k for wall k, of each of the `contacts` of one world."""
        return contacts_of_world(self, self._index(world)).ends[0]

    def touching(self, world: int = 0) -> set[tuple[int, int]]:
        """(body, wall) of every resting contact with a wall of one world at its last step."""
        return {(int(body), -1 - int(other)) for body, other in self.contact_ends(world) if other < 0}

    def _index(self, world: int) -> int:
        return validation.index(world, self.worlds, "world")

    def _chosen(self, worlds: ArrayLike | None) -> NDArray[np.int64]:
        return np.arange(self.worlds) if worlds is None else choice.world_indices(worlds, self.worlds, once=False)

    def _body(self, body: int | None) -> int:
        return EVERY_BODY if body is None else validation.index(body, self.body_count, "body")


def _rows(rows: int) -> int:
    return validation.count(rows, "rows", least=0, most=MOST_ROWS)
