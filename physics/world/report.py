"""Report of a step for each world: residuals, counts, penetration and status, so that no failure stays silent."""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from physics.compiler.decorators import entry_kernel, kernel
from physics.html_table import parts_table
from physics.kernels.state import layout as at
from physics.scene.body_names import body_label


class Solver(IntEnum):
    """Strongest method for contact problems that a step needed, as in `StepReport.solver`."""

    NONE = at.METHOD_NONE
    DIRECT = at.METHOD_DIRECT
    SWEEPS = at.METHOD_SWEEPS
    PIVOTING = at.METHOD_PIVOTING
    NEWTON = at.METHOD_NEWTON


class Status(IntEnum):
    """Outcome of a world's step, as in `StepReport.status`; `message` explains it."""

    OK = 0
    UNRESOLVED = 1
    UNCONVERGED = 2
    FAULT = 3
    LEFT_OUT = 4
    OVERLAP = 5
    COARSE = 6

    @property
    def message(self) -> str:
        """Explanation of the status in words, and advice."""
        return _MESSAGES[self]

    @staticmethod
    def severity(status: int) -> int:
        """Rank of a status by its gravity, 0 for OK; of several, `StepReport.status` shows the one of highest rank."""
        return _GRAVITY.index(status)


_MESSAGES = {
    Status.OK: "every contact problem met its tolerance",
    Status.UNRESOLVED: (
        "more impacts in one substep than Accuracy.impacts, or more turns than can be followed: the rest of the "
        "substep was plastic or coarse; raise impacts or substeps if it matters"
    ),
    Status.UNCONVERGED: (
        "a contact problem kept a residual above Accuracy.tolerance, an error of about that share of the contact "
        "speed; where that matters raise Accuracy.iterations or substeps, else loosen the tolerance"
    ),
    Status.FAULT: (
        "a body's loads or its new state were not finite, or beyond 1e100, and its old state was kept; look at the "
        "wrench and parameters of this world, and shorten the step"
    ),
    Status.COARSE: (
        "an effect changes too much within a step to be followed (a spring, a fluid or a lift that swings by more than "
        "a radian, or a field of your own): its details are not right; shorten dt, raise Accuracy.substeps, or weaken "
        "the effect"
    ),
    Status.LEFT_OUT: (
        "more bodies were near each other than there is room for, and contacts were left out; spread the bodies, or "
        "give the scene fewer. Where impacts are kept, some of them may have had no room; raise that of "
        "World.keep_impacts"
    ),
    Status.OVERLAP: (
        "bodies were put where they overlap deeply, and are lifted apart without speed; put them further apart if that "
        "was not meant"
    ),
}


_GRAVITY = (
    Status.OK, Status.UNRESOLVED, Status.UNCONVERGED, Status.COARSE, Status.OVERLAP, Status.LEFT_OUT, Status.FAULT,
)  # fmt: skip

# Plain integers for the kernel below: Numba reads these from a module, and no enums.
_UNRESOLVED, _UNCONVERGED, _FAULT = int(Status.UNRESOLVED), int(Status.UNCONVERGED), int(Status.FAULT)
_LEFT_OUT, _OVERLAP, _COARSE = int(Status.LEFT_OUT), int(Status.OVERLAP), int(Status.COARSE)


@entry_kernel
def gravest(table, status):
    """Write the `Status` of each row of a report `table` (worlds, REPORT_SIZE) into `status` (worlds,) int64."""
    for world in range(table.shape[0]):
        status[world] = 0
        if table[world, at.FAULTS] > 0.0:
            status[world] = _FAULT
        elif table[world, at.CONTACTS_LEFT_OUT] > 0.0:
            status[world] = _LEFT_OUT
        elif table[world, at.OVERLAP] > 0.0:
            status[world] = _OVERLAP
        elif table[world, at.UNRESOLVED_MOTION] > 0.0:
            status[world] = _COARSE
        elif table[world, at.UNCONVERGED] > 0.0:
            status[world] = _UNCONVERGED
        elif table[world, at.UNRESOLVED] > 0.0:
            status[world] = _UNRESOLVED


@kernel
def add_rows(first, end, total, table):
    """Add rows `first` to `end` - 1 of the report `table` of a step to `total`, the report of earlier steps.

    Both are (worlds, REPORT_SIZE). Counts are added; of other columns the larger number stays.
    """
    for world in range(first, end):
        for c in range(at.REPORT_SIZE):
            if c in (at.PENETRATION, at.RESIDUAL, at.SOLVER, at.OVERLAP, at.FIRST_FAULTY):
                total[world, c] = max(total[world, c], table[world, c])
            else:
                total[world, c] += table[world, c]


@entry_kernel
def add_report(total, table):
    """Add the report of a step, `table`, to that of earlier steps, `total`; both are (worlds, REPORT_SIZE).

    For each world counts are added, and of other columns the larger number stays (`add_rows`).
    """
    add_rows(0, table.shape[0], total, table)


class StepReport:
    """Report of one `World.step`; every property is an array with a number for each world.

    Attributes
    ----------
    penetration : (worlds,) float64
        Largest depth of a contact [m].
    residual : (worlds,) float64
        Largest residual of a contact problem that was accepted, relative to the free contact speed (see
        `physics.kernels.contact_solver.gauss_seidel`).
    iterations : (worlds,) int64
        Sweeps and Newton steps of the contact solvers.
    solves : (worlds,) int64
        Contact problems; under error control those of refused parts of a substep are counted, too.
    fallbacks : (worlds,) int64
        Contact problems on which pivoting methods were tried, after others had failed. With the scheme ``events``:
        small leaps of first order, and parts of the shortest length whose error exceeds the tolerance.
    unconverged : (worlds,) int64
        Contact problems with a residual above the tolerance.
    impacts : (worlds,) int64
        Impacts that cut a substep.
    unresolved : (worlds,) int64
        Substeps with more impacts than `Accuracy.impacts`.
    faults : (worlds,) int64
        Bodies whose loads or new state were not finite, or beyond 1e100.
    left_out : (worlds,) int64
        Contacts and near pairs of bodies for which there was no room. In a world that keeps impacts
        (`World.keep_impacts`) also events for which there was no room.
    coarse : (worlds,) int64
        Bodies that moved in fields which the step does not resolve.
    overlap : (worlds,) float64
        Deepest overlap of two bodies at the start of the step [m], where a user put them into each other by more than
        a hundredth of the smaller one's bounding radius; else 0.
    fault_body : (worlds,) int64
        Index of the first body that `faults` counts; -1: none. Where a fault made a whole world keep its old state,
        it is the first body with the fault.
    driven_work : (worlds,) float64
        Work that bodies with a prescribed motion did on the others, through contacts [J].
    """

    __slots__ = ("_names", "_table")

    def __init__(self, table: np.ndarray, names: tuple[str, ...] = ()):
        self._table, self._names = table, names  # of the bodies, for messages

    if TYPE_CHECKING:

        @property
        def penetration(self) -> NDArray[np.float64]: ...

        @property
        def residual(self) -> NDArray[np.float64]: ...

        @property
        def iterations(self) -> NDArray[np.int64]: ...

        @property
        def solves(self) -> NDArray[np.int64]: ...

        @property
        def fallbacks(self) -> NDArray[np.int64]: ...

        @property
        def unconverged(self) -> NDArray[np.int64]: ...

        @property
        def impacts(self) -> NDArray[np.int64]: ...

        @property
        def unresolved(self) -> NDArray[np.int64]: ...

        @property
        def faults(self) -> NDArray[np.int64]: ...

        @property
        def left_out(self) -> NDArray[np.int64]: ...

        @property
        def coarse(self) -> NDArray[np.int64]: ...

        @property
        def overlap(self) -> NDArray[np.float64]: ...

        @property
        def fault_body(self) -> NDArray[np.int64]: ...

        @property
        def driven_work(self) -> NDArray[np.float64]: ...

    else:
        penetration = property(lambda self: self._table[:, at.PENETRATION])
        residual = property(lambda self: self._table[:, at.RESIDUAL])
        iterations = property(lambda self: self._table[:, at.ITERATIONS].astype(np.int64))
        solves = property(lambda self: self._table[:, at.SOLVES].astype(np.int64))
        fallbacks = property(lambda self: self._table[:, at.FALLBACKS].astype(np.int64))
        unconverged = property(lambda self: self._table[:, at.UNCONVERGED].astype(np.int64))
        impacts = property(lambda self: self._table[:, at.SPLITS].astype(np.int64))
        unresolved = property(lambda self: self._table[:, at.UNRESOLVED].astype(np.int64))
        faults = property(lambda self: self._table[:, at.FAULTS].astype(np.int64))
        left_out = property(lambda self: self._table[:, at.CONTACTS_LEFT_OUT].astype(np.int64))
        coarse = property(lambda self: self._table[:, at.UNRESOLVED_MOTION].astype(np.int64))
        overlap = property(lambda self: self._table[:, at.OVERLAP])
        fault_body = property(lambda self: self._table[:, at.FIRST_FAULTY].astype(np.int64) - 1)
        driven_work = property(lambda self: self._table[:, at.DRIVEN_WORK])

    @property
    def solver(self) -> NDArray[np.int64]:
        """Strongest method that a contact problem of the step needed, (worlds,) int64, values of `Solver`."""
        return self._table[:, at.SOLVER].astype(np.int64)

    @property
    def status(self) -> NDArray[np.int64]:
        """Gravest outcome of the step, (worlds,) int64, values of `Status`."""
        status = np.empty(len(self._table), dtype=np.int64)
        gravest(self._table, status)
        return status

    @property
    def ok(self) -> bool:
        """True if the results of all worlds can be trusted to the tolerance.

        All contact problems met their tolerances, no contact was left out, states stayed finite, fields were resolved,
        and no body was put deep into another. Worlds with `Status.UNRESOLVED` alone are accepted.
        """
        return not (self._table[:, at.UNCONVERGED : at.FAULTS + 1].any() or self._table[:, at.CONTACTS_LEFT_OUT].any()
                    or self._table[:, at.OVERLAP].any() or self._table[:, at.UNRESOLVED_MOTION].any())  # fmt: skip

    def messages(self) -> dict[int, str]:
        """Messages for the worlds whose status is not OK, by the index of the world."""
        status, told = self.status, {}
        for w in np.flatnonzero(status).tolist():
            told[w] = Status(int(status[w])).message
            if status[w] == Status.FAULT:
                told[w] = f"body {body_label(int(self.fault_body[w]), self._names)}: {told[w]}"
            elif status[w] == Status.OVERLAP:
                told[w] += f" (the deepest overlap is {self.overlap[w]:.3g} m)"
            elif status[w] == Status.UNCONVERGED:
                told[w] += (
                    f" ({self.unconverged[w]} of {self.solves[w]} problems, worst residual {self.residual[w]:.2g})"
                )
        return told

    def __repr__(self) -> str:
        return f"StepReport({', '.join(self._parts())})"

    _repr_html_ = parts_table

    def _parts(self) -> tuple[str, ...]:
        counts = np.bincount(self.status, minlength=len(Status)).tolist()
        bad = [f"{Status(k).name.lower()} in {count} worlds" for k, count in enumerate(counts) if k and count]
        why = f" ({', '.join(bad)})" if bad else ""
        return (
            f"worlds={len(self._table)}", f"ok={self.ok}{why}", f"penetration={self.penetration.max():.3g} m",
            f"residual={self.residual.max():.3g}", f"iterations={self.iterations.sum()}",
        )  # fmt: skip
