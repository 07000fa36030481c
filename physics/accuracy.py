"""Accuracy of a simulation: presets and their knobs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

from physics import validation
from physics.annotations import Preset, Scheme
from physics.html_table import fields_table
from physics.kernels.flight import integrators
from physics.keywords import known_keywords

# Values of `Accuracy.scheme` and their codes: 0 is time stepping with the exact flow, -1 stepping to a tolerance.
EVENTS = -1
INTEGRATORS: dict[Scheme, int] = {
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
    """Every knob of a simulation; `Accuracy()` is the preset ``balanced``.

    Parameters
    ----------
    substeps : int
        Parts into which each `dt` is cut.
    scheme : str
        ``events``: smooth motion to `tolerance` between events, each located to rounding (impacts, and where contacts
        begin, end, stick and slip). Where bodies touch each other, or hulls or bodies tied together by springs touch
        walls, it is time stepping with an error instead: a substep is cut into parts, each of which agrees with two of
        half its length, to 100 tolerances of the body's size and speed; impacts are met in time, what else changes is
        found by halving, down to 2**-24 of the substep (what that leaves is counted as `StepReport.fallbacks`).
        Otherwise time stepping, and how free motion is integrated: ``exact`` (parabola
        and free rotation to rounding; second order in an applied torque), or a textbook scheme to compare with:
        ``explicit_euler``, ``semi_implicit_euler``, ``midpoint``, ``rk4``; while a body touches a wall Moreau's
        midpoint step is used whichever it is.
    solver : str
        ``sweeps+pivoting``: contact problems of one wall are solved directly where they hold, slide or pivot, else by
        sweeps over the exact friction cones and Newton's method, and by Lemke (Dantzig without friction) where those
        leave a residual above 1 %. What stays above the tolerance is reported as unconverged.
        ``sweeps``: without that last resort.
    tolerance : float
        Largest residual of a contact problem, relative to its largest free contact speed; with ``events`` also the
        error of one smooth step, relative to the body's size and speed (where bodies touch each other a hundredth of
        that of a part, and no less than 1e-11).
    iterations : int
        Sweeps per contact problem at most (as many visits of contacts as there are contacts are one), and as many
        iterations with a linear system, of bodies that touch each other. Where that system would take more time than
        ten times those sweeps (large piles at ``fast``, while they move) there are sweeps only.
    impacts : int
        Impacts (with ``events`` all events) of one body that one substep resolves in time; more are reported and
        treated as plastic (with ``events`` the rest of the substep is left out). Where bodies touch each other: of all
        of them, in one substep or part.
    slop : float
        Gap within which a feature touches a wall, and (but with ``events``) error of the place of an impact, in
        bounding radii. With ``events`` a rebound no higher than a few slops is not made; where bodies touch each other
        it is no less than 1e-12 there.
    rest_share : float
        Bounce threshold of time stepping: a rebound that would be over within this share of the substep is not made
        (restitution acts as 0). 0 lets every rebound happen.
    slip : str
        What friction opposes in a step of time stepping in which one or two points of a body touch walls. ``mean``: the
        mean of their slip before and after the step, of second order. ``end``: their slip after it, as for faces and
        between bodies: quicker, and of first order where the direction of sliding turns.
    collisions : str
        What happens to contacts that collide at the same moment. ``simultaneous``: one contact problem of all of them.
        ``sequential``, with ``events`` or where bodies touch each other: one after the other, the one that approaches
        fastest first (of equals the one of the lowest wall and vertex), until none approaches; where that has no end in
        sight, the rest at once, reported (unconverged, or unresolved). Two laws, not two accuracies: where several
        contacts collide they have other outcomes.

    Raises
    ------
    ValueError
        A value out of range.
    """

    substeps: int = 1
    scheme: Scheme = "exact"
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


def resolve(accuracy: Preset | Accuracy, field: str = "accuracy") -> Accuracy:
    """The `Accuracy` of a preset's name, or the one given; `field` is what messages call it."""
    if isinstance(accuracy, Accuracy):
        return accuracy
    known: Any = PRESETS
    return known[validation.one_of(accuracy, PRESETS, field, ", or a physics.Accuracy(...)")]
