"""Dispatch to the fields that a kernel is compiled for, by the *type* of a body's record.

A scene's fields are members of the record of each body: one marker per kind of field, `load_drag_1x3` for one `Drag` of
three columns. Numba compiles a kernel per type of its arguments, so that a record without markers has kernels without
fields, and one with them is found in the disk cache by its markers, from any process. A user's own field is marked
with a digest of its source: an edit is another type.

Its kernel is chosen by the type of the record (`physics.compiler.decorators.by_type`), and nothing is passed for it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

from physics.compiler.decorators import by_type, members, runtime_kernel, when
from physics.kernels.forces.force_field_state import ZERO
from physics.kernels.math.quaternion import dot
from physics.kernels.math.vector import plus

# First word of a marker: what the field's function gives, a (force, torque) or the velocity of the air.
LOAD, AIR = "load", "air"


class Term(NamedTuple):
    """A kind of field in a scene.

    Attributes
    ----------
    marker : str
        Member of a body's record.
    function : dispatcher
        (state, parameters, time) -> (force, torque), or -> velocity of the air.
    energy : dispatcher or None
        (state, parameters, time) -> potential energy [J].
    size : int
        Columns of one field.
    count : int
        Fields of this kind.
    is_linked : bool
        Whether its loads depend on other bodies, too.
    rates : dispatcher or None
        (state, parameters, inverse moments, step) -> the three rates of `implicit_loads`; None of a user's field.
    mean : dispatcher or None
        (states in the middle, at the start and at the end, parameters, time) -> the load of a discrete gradient; None:
        that of the middle.
    soften : dispatcher or None
        (acceleration and torque, step, principal axes, state, parameters, inverse moments) -> the same, as the
        implicit step would have them; None of a field whose loads depend neither on place nor on velocity.
    """

    marker: str
    function: Callable
    energy: Callable | None
    size: int
    count: int
    is_linked: bool = False
    rates: Callable | None = None
    soften: Callable | None = None
    mean: Callable | None = None


_KNOWN: dict[str, Term] = {}


def register_terms(terms: tuple[Term, ...]) -> None:
    """Register terms before a kernel is compiled for a record that holds their markers."""
    _KNOWN.update((term.marker, term) for term in terms)


def term_members(terms: tuple[Term, ...]) -> list[tuple]:
    """Members of a body's record for these terms; none without terms."""
    if not terms:
        return []
    columns = sum(term.count * term.size for term in terms)
    is_linked = any(term.is_linked for term in terms)
    return [
        ("held_acceleration", float, (3,)),  # of gravity and wrench [m/s²]
        ("held_torque", float, (3,)),  # of the wrench [N m]
        ("call_start", float),  # time at the start of the call [s]
        ("now", float),  # of the stage [s]
        ("is_felt", int),  # 1: some field was not zero since this was set to 0
        ("is_textbook", int),  # 1: a textbook scheme moves the body
        ("is_stiff", int),  # 1: loads of the stage are those of an implicit step (`implicit_loads`)
        ("is_coarse", int),  # 1: a field was not resolved by some stage of this call
        ("is_put_back", int),  # 1: some stage of this call was given up, and the body put back at its start
        ("rate", float),  # fastest damping or turning of the stage [1/s]
        ("damping", float),  # fastest damping [1/s]
        ("columns", float, (max(columns, 1),)),  # parameters of all fields, in the order of the markers
        *((term.marker, float) for term in terms),
        *([("middle", float, (13,))] if is_linked else []),  # state in the middle of the stage: x, q, v, L
        ("stage_start", float, (13,)),  # of many bodies: state at the start of a stiff stage
        ("stage_energy", float),  # of the first of many bodies: their potential energy then [J]
    ]


def _markers(names) -> list[str]:
    return [name for name in names if name.split("_")[0] in (LOAD, AIR)]


def if_declared(otherwise=None):
    """Make a kernel of a function whose last argument is a body; without fields it only returns `otherwise`.

    A function for `otherwise` is called instead. That is inlined: nothing is left of it.
    """
    return when(lambda *types: bool(_markers(members(types[-1]))), otherwise)


def if_user_field(otherwise=None):
    """Make a kernel like `if_declared`, for scenes with a user's field, which does not tell its rates."""
    return when(lambda *types: _has_unknown(members(types[-1])), otherwise)


def _has_unknown(names: list[str]) -> bool:
    return any(_KNOWN[name].rates is None for name in _markers(names) if name.startswith(LOAD))


def iterate_terms(body, kind: str) -> Iterator[tuple[Term, int, int]]:
    """Each field of this kind in a body's record: its term, first and last column."""
    first = 0
    for marker in _markers(members(body)):
        term = _KNOWN[marker]
        for _ in range(term.count):
            if marker.startswith(kind):
                yield term, first, first + term.size
            first += term.size


def _sum(kind: str, start: Callable, chosen: Callable, add: Callable):
    """Make a kernel (state, t, body) that adds up chosen functions of a body's fields."""

    def total(state, t, body):
        result = start
        for term, first, last in iterate_terms(body, kind):
            if chosen(term) is not None:
                result = add(runtime_kernel(result), chosen(term), first, last)
        return result

    return by_type(total)


def _no_load(state, t, body):
    return ZERO, ZERO


def _no_air(state, t, body):
    return ZERO


def _of_middle(function):
    """Adapter of a field's function to the middle one of a stage's three states."""

    def load(states, p, t):
        return function(states[0], p, t)

    return load


def _no_energy(state, t, body):
    return 0.0


def _add_load(before, function, first, last):
    def add(state, t, body):
        F, T = before(state, t, body)
        f, m = function(state, body.columns[first:last], t)
        return plus(F, f), plus(T, m)

    return add


def _no_rates(state, h, body):
    return ZERO


def _add_rates(before, function, first, last):
    def add(state, h, body):
        return plus(before(state, h, body), function(state, body.columns[first:last], body.J, h))

    return add


def _add_supply(before, function, first, last):
    def add(state, t, body):
        F, T = function(state, body.columns[first:last], t)
        return before(state, t, body) + max(dot(F, state.v) + dot(T, state.w), 0.0)

    return add


def _add_number(before, function, first, last):
    def add(state, t, body):
        return before(state, t, body) + function(state, body.columns[first:last], t)

    return add


def _add_vector(before, function, first, last):
    def add(state, t, body):
        return plus(before(state, t, body), function(state, body.columns[first:last], t))

    return add


total_load = _sum(LOAD, _no_load, lambda term: term.function, _add_load)
total_own_load = _sum(LOAD, _no_load, lambda term: None if term.is_linked else term.function, _add_load)
total_linked_load = _sum(LOAD, _no_load, lambda term: term.function if term.is_linked else None, _add_load)
total_air = _sum(AIR, _no_air, lambda term: term.function, _add_vector)
total_energy = _sum(LOAD, _no_energy, lambda term: term.energy, _add_number)
total_rates = _sum(LOAD, _no_rates, lambda term: term.rates, _add_rates)
total_conservative_load = _sum(
    LOAD, _no_load, lambda term: term.function if term.energy is not None else None, _add_load
)
total_supplied_power = _sum(LOAD, _no_energy, lambda term: term.function if term.energy is None else None, _add_supply)
total_user_load = _sum(LOAD, _no_load, lambda term: term.function if term.rates is None else None, _add_load)


def _mean_load(states, t, body):
    """Mean load of all fields over a stage, by discrete gradients, from `states` at its middle, start and end."""
    result = _no_load
    for term, first, last in iterate_terms(body, LOAD):
        mean = runtime_kernel(_of_middle(term.function)) if term.mean is None else term.mean
        result = _add_load(runtime_kernel(result), mean, first, last)
    return result


total_mean_load = by_type(_mean_load, _mean_load)


def _as_it_is(loads, h, R, state, body):
    return loads


def _then_soften(before, function, first, last):
    def soften(loads, h, R, state, body):
        return function(before(loads, h, R, state, body), h, R, state, body.columns[first:last], body.J)

    return soften


def _softened(loads, h, R, state, body):
    """Acceleration and torque softened by the implicit step over h, one field after the other."""
    result = _as_it_is
    for term, first, last in iterate_terms(body, LOAD):
        if term.soften is not None:
            result = _then_soften(runtime_kernel(result), term.soften, first, last)
    return result


soften_loads = by_type(_softened, _softened)
