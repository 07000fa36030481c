"""Accuracy of a simulation: presets and their settings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, Literal

from physics import validation
from physics.annotations import Preset, SchemeName
from physics.html_table import fields_table
from physics.kernels.flight import integrators
from physics.keywords import known_keywords, nearest_first

# Values of `Accuracy.scheme` and their codes: 0 is time stepping with the exact flow, -1 stepping to a tolerance.
EVENTS = -1
INTEGRATORS: dict[SchemeName, int] = {
    "events": EVENTS,
    "exact": 0,
    "explicit_euler": integrators.EXPLICIT_EULER,
    "semi_implicit_euler": integrators.SEMI_IMPLICIT_EULER,
    "midpoint": integrators.MIDPOINT,
    "rk4": integrators.RK4,
}
SOLVERS = ("sweeps", "sweeps+pivoting")
SLIPS = ("mean", "end")
COLLISIONS = ("simultaneous", "sequential")


@known_keywords
@dataclass(frozen=True)
class Accuracy:
    """All settings of a simulation's accuracy; `Accuracy()` is the preset ``balanced``.

    Parameters
    ----------
    substeps : int
        Parts into which each `dt` is cut.
    scheme : str
        ``events``: smooth motion to `tolerance` between events, each located to rounding. Events are impacts, and the
        times at which contacts begin, end, stick and slip. Where bodies touch each other, contact is compliant, or
        hulls or bodies tied together by springs touch walls, it is time stepping with error control instead. A substep
        is cut into parts,
        each of which agrees with two of half its length, to 100 tolerances of the body's size and speed. Impacts have
        times of their own. Other changes are found by halving, down to 2**-24 of the substep; `StepReport.fallbacks`
        counts those that are not.
        All other schemes are time stepping, and name the integrator of free motion. ``exact``: parabola and free
        rotation to rounding, second order in an applied torque. Textbook schemes, for comparison: ``explicit_euler``,
        ``semi_implicit_euler``, ``midpoint``, ``rk4``. While a body touches a wall each of them takes Moreau's midpoint
        step.
    solver : str
        ``sweeps+pivoting``: contact problems of one wall are solved directly where contacts hold, slide or pivot.
        Others are solved by sweeps over the exact friction cones and Newton's method. Where those leave a residual
        above 1 %, Lemke's method takes over (Dantzig's without friction). A residual above the tolerance is reported as
        unconverged. ``sweeps``: without Lemke's and Dantzig's methods.
    tolerance : float
        Largest residual of a contact problem, relative to its largest free contact speed. With ``events`` also the
        error of one smooth step, relative to the body's size and speed. Where bodies touch each other it is a hundredth
        of the error of a part, and at least 1e-11.
    iterations : int
        Largest number of sweeps per contact problem; one sweep is n contact updates for n contacts. It also limits the
        iterations of the solvers that factor a linear system, for bodies that touch each other. Where one
        factorisation would take longer than ten times this number of sweeps (large piles at ``fast``, while they
        move) only sweeps are used.
    impacts : int
        Largest number of impacts of one body that one substep resolves in time. Further impacts are reported and
        treated as plastic. With ``events`` it counts all events, and the rest of the substep is left out. Where bodies
        touch each other it counts impacts of all of them, in one substep or part.
    slop : float
        Gap within which a feature touches a wall, in bounding radii. Without ``events`` the position of an impact has
        an error of up to one slop. With ``events`` a rebound at most a few slops high is left out, and the slop is at
        least 1e-12 where bodies touch each other, 1e-10 where one moves among fixed ones. `Sleeping` takes motions of
        a few slops, of 1e-12 among fixed bodies, for rest.
    rest_share : float
        Bounce threshold of time stepping: a rebound that would be over within this share of the substep is not made
        (restitution acts as 0). 0 lets every rebound happen.
    slip : str
        Slip that friction opposes in a step of time stepping in which one or two points of a body touch walls.
        ``mean``: the mean of the slips before and after the step, of second order. ``end``: the slip after it, as for
        faces and between bodies. ``end`` is quicker, and of first order where the direction of sliding turns.
    collisions : str
        Law of contacts that collide at the same moment. ``simultaneous``: one contact problem of all of them.
        ``sequential``, with ``events`` or where bodies touch each other: one contact after the other, until none
        approaches. The contact that approaches fastest comes first; among equals the one of the lowest wall and vertex.
        Where this sequence does not end, the remaining contacts collide at once, and the report says so (unconverged,
        or unresolved). These are two laws, not two accuracies: their outcomes differ where several contacts collide.

    Raises
    ------
    ValueError
        A value out of range.
    """

    substeps: int = 1
    scheme: SchemeName = "exact"
    solver: Literal["sweeps", "sweeps+pivoting"] = "sweeps+pivoting"
    tolerance: float = 1e-6
    iterations: int = 200
    impacts: int = 8
    slop: float = 1e-6
    rest_share: float = 0.5
    slip: Literal["mean", "end"] = "mean"
    collisions: Literal["simultaneous", "sequential"] = "simultaneous"

    _repr_html_ = fields_table

    def __post_init__(self) -> None:
        for name in ("substeps", "iterations", "impacts"):
            self._set(name, validation.count(getattr(self, name), f"Accuracy.{name}"))
        for name in ("tolerance", "slop"):
            self._set(name, float(validation.positive(getattr(self, name), (), f"Accuracy.{name}")))
        self._set("rest_share", float(validation.share(self.rest_share, (), "Accuracy.rest_share")))
        for name, known in (("scheme", INTEGRATORS), ("solver", SOLVERS), ("slip", SLIPS), ("collisions", COLLISIONS)):
            validation.one_of(getattr(self, name), known, f"Accuracy.{name}")

    def _set(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)


_BALANCED = Accuracy()
PRESETS: dict[Preset, Accuracy] = {
    "fast": replace(_BALANCED, solver="sweeps", tolerance=1e-3, iterations=20, impacts=4, slop=1e-5, slip="end"),
    "balanced": _BALANCED,
    "precise": replace(_BALANCED, scheme="events", tolerance=1e-10, iterations=2000, impacts=10_000, slop=1e-12),
    "reference": replace(_BALANCED, scheme="events", tolerance=1e-13, iterations=10_000, impacts=100_000, slop=1e-14),
}

AccuracyArgument = Preset | Accuracy | Mapping[str, Any]
"""Type of an argument: a preset, settings, or a mapping of those that differ from ``preset`` (``balanced``)."""


def resolve(accuracy: AccuracyArgument, field: str = "accuracy") -> Accuracy:
    """Make an `Accuracy` from a preset's name or from a mapping of settings; an `Accuracy` is returned unchanged.

    Any other value is a ValueError, whose message calls the argument `field` and lists the presets.
    """
    if isinstance(accuracy, Accuracy):
        return accuracy
    if isinstance(accuracy, Mapping):
        return _from_mapping(accuracy, field)
    known: Any = PRESETS
    return known[validation.one_of(accuracy, PRESETS, field, ", a dict of settings, or a physics.Accuracy(...)")]


def _from_mapping(given: Mapping[str, Any], field: str) -> Accuracy:
    known = ("preset", *(each.name for each in fields(Accuracy)))
    for name in given:
        if name not in known:
            allowed = ", ".join(nearest_first(name, known))
            raise ValueError(f"{field} has {name!r}; allowed are {allowed}")
    settings = dict(given)
    presets: Any = PRESETS
    return replace(
        presets[validation.one_of(settings.pop("preset", "balanced"), PRESETS, f"{field} preset")], **settings
    )
