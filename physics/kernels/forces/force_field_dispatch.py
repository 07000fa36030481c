"""Choose the kernels of a scene's force fields by the *type* of a body's record.

The record of each body has a member for each kind of field in the scene, a *marker*: `load_drag_1x3` stands for one
`Drag` with three columns of parameters. A marker's name tells the compiler which field it is; its value is not used.
Numba compiles a kernel for each type of its arguments. So a record without markers gets kernels without fields, and a
record with markers finds its kernels in the disk cache, from any process. The marker of a user's own field has a digest
of its source, so an edited field has another type. Kernels are chosen by `physics.compiler.decorators.by_type`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

from physics.compiler.decorators import by_type, members, runtime_kernel, when
from physics.kernels.forces.force_field_state import ZERO
from physics.kernels.math.quaternion import dot
from physics.kernels.math.vector import plus

# First word of a marker: the field's function returns (force, torque), or the velocity of the air.
LOAD, AIR = "load", "air"


class Term(NamedTuple):
    """One kind of force field in a scene, with its kernels; `state` is a `FieldState` in all of them.

    Attributes
    ----------
    marker : str
        Name of the member of a body's record that declares the field.
    function : dispatcher
        Load of the field: (state, parameters, time) -> (force, torque); of wind the velocity of the air.
    energy : dispatcher or None
        Potential energy [J]: (state, parameters, time) -> float. None for a field without one.
    size : int
        Number of parameters (columns) of one field.
    count : int
        Number of fields of this kind in the scene.
    is_linked : bool
        True if the loads also depend on other bodies.
    rates : dispatcher or None
        Rates (λ, Ω², γ) of `implicit_loads`: (state, parameters, inverse moments, step). None for a user's field.
    mean : dispatcher or None
        Load over a whole stage, a discrete gradient: ((states in the middle, at start, at end), parameters, time) ->
        (force, torque). None: the load in the middle.
    soften : dispatcher or None
        Softened loads of `implicit_loads`: ((acceleration, torque), step, principal axes, state, parameters, inverse
        moments) -> (acceleration, torque). None for a field whose loads depend neither on place nor on velocity.
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
    """Register a scene's terms under their markers, before a kernel is compiled for a record with these markers."""
    _KNOWN.update((term.marker, term) for term in terms)


def term_members(terms: tuple[Term, ...]) -> list[tuple]:
    """Fields, in the form of `numpy.dtype`, that a body's record has for these terms; none without terms."""
    if not terms:
        return []
    columns = sum(term.count * term.size for term in terms)
    is_linked = any(term.is_linked for term in terms)
    return [
        ("held_acceleration", float, (3,)),  # of gravity and wrench [m/s²]
        ("held_torque", float, (3,)),  # of the wrench [N m]
        ("call_start", float),  # time at the start of the call [s]
        ("now", float),  # of the stage [s]
        ("is_felt", int),  # 1: some field was nonzero since this flag was cleared
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
    """Decorate a kernel, whose last argument is a body's record, that is called only in scenes with force fields.

    In other scenes `otherwise` takes its place: a function is called with the same arguments and inlined, any other
    value is returned.
    """
    return when(lambda *types: bool(_markers(members(types[-1]))), otherwise)


def if_user_field(otherwise=None):
    """Decorate a kernel like `if_declared`, for scenes with a user's own field, which has no `rates`."""
    return when(lambda *types: _has_unknown(members(types[-1])), otherwise)


def _has_unknown(names: list[str]) -> bool:
    return any(_KNOWN[name].rates is None for name in _markers(names) if name.startswith(LOAD))


def iterate_terms(body, kind: str) -> Iterator[tuple[Term, int, int]]:
    """Yield (term, first, last) for each field of a kind, LOAD or AIR, in a body's record or in the type of one.

    The field's parameters are `body.columns[first:last]`.
    """
    first = 0
    for marker in _markers(members(body)):
        term = _KNOWN[marker]
        for _ in range(term.count):
            if marker.startswith(kind):
                yield term, first, first + term.size
            first += term.size


def _sum(kind: str, start: Callable, chosen: Callable, add: Callable):
    """Make a kernel (state, t, body) that adds up a function of each of a body's fields.

    Parameters
    ----------
    kind : str
        LOAD or AIR.
    start : function (state, t, body)
        The sum's first value, zero.
    chosen : function (term)
        Returns the function of a term, or None for a term that is left out.
    add : function (before, function, first, last)
        Makes the function that adds a field, with its columns first to last, to the sum `before`.
    """

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
    """Make a function like `Term.mean` of a field's `function`, which it calls with the state in the stage's middle."""

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
    """Force and torque of all fields over a stage, by discrete gradients, from states at its middle, start and end.

    The arguments of the resulting kernel are these three states, a time t [s] and a body's record.
    """
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
    """Soften the loads (acceleration, torque) of a stage of length h by all fields of a body, one after the other.

    R is the matrix of the principal axes, `state` a `FieldState` (`implicit_loads`).
    """
    result = _as_it_is
    for term, first, last in iterate_terms(body, LOAD):
        if term.soften is not None:
            result = _then_soften(runtime_kernel(result), term.soften, first, last)
    return result


soften_loads = by_type(_softened, _softened)
