"""Checks of a user's field before a step: its class, its numbers, and all that its functions read.

A kernel has no exceptions and asks for no bounds. A user's function is compiled alone first, for the types that it
is called with later, so that nothing is compiled twice; what Numba made of it is then looked through.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import fields

import numpy as np

from physics import validation
from physics.compiler.decorators import backend, plain_function
from physics.compiler.user_function import NUMBER, FaultyFunctionError, in_words
from physics.kernels.forces.force_field_state import ZERO, FieldState
from physics.parallel.bound_call import compiling
from physics.scene.field_errors import at, not_compiled, placed

# A body at rest in the origin.
_STATE = FieldState(
    ZERO, ZERO, ZERO, (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), ZERO, ZERO, 1.0, 0, (1.0, 1.0, 1.0)
)

# What a function may return, by name.
LOAD = "((fx, fy, fz), (tx, ty, tz)): force [N] and torque about the centre of mass [N m]"
AIR = "(vx, vy, vz): velocity of the air [m/s]"
ENERGY = "one number: potential energy [J]"


def check_class(kind: type, base: type) -> None:
    """Refuse a class with values that `columns` would miss: one that lacks the decorator of a dataclass.

    Parameters
    ----------
    kind : type
        A subclass of `base`.
    base : type
        `physics.Field`.

    Raises
    ------
    ValueError
    """
    if kind.columns is not base.columns:
        return
    for each in kind.__mro__[: kind.__mro__.index(base)]:
        if not issubclass(each, base) or "__dataclass_fields__" in vars(each):
            continue
        named = [name for name, type_ in inspect.get_annotations(each).items() if "ClassVar" not in str(type_)]
        if named or "__init__" in vars(each):
            has = f"has the fields {', '.join(named)}" if named else "has an __init__ of its own"
            raise ValueError(
                f"{each.__name__} {has} and is not a dataclass: its function would get no numbers; allowed is a class "
                "under @dataclass(frozen=True), or with a method `columns` that gives the numbers"
            )


def numbers_in(effect, name: str) -> np.ndarray:
    """Field of a dataclass as float64 (n,), all finite; ValueError otherwise."""
    value, what = getattr(effect, name), f"{type(effect).__name__}.{name}"
    try:
        return validation.finite(value, np.shape(value), what).ravel()
    except ValueError:
        raise ValueError(f"{what} is {value!r}; allowed are finite numbers, and arrays of them") from None


def numbers_of(effect, body: int, worlds: np.ndarray) -> np.ndarray:
    """Numbers of `effect.columns(body, worlds)` as float64 (n,) or (k, n), all finite; ValueError otherwise."""
    name, found = f"{type(effect).__name__}.columns", effect.columns(body, worlds)
    try:
        numbers = np.asarray(found, dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"{name} gives {found!r}; allowed are numbers in shape (n,) or (worlds, n)") from None
    if numbers.ndim not in (1, 2) or (numbers.ndim == 2 and len(numbers) != len(worlds)):
        raise ValueError(f"{name} gives shape {numbers.shape}; allowed is (n,) or ({len(worlds)}, n): a row per world")
    return validation.finite(numbers, numbers.shape, name)


def check_function(name: str, function: Callable, form: str, size: int, numbers: str) -> bool:
    """Check a user's function for the types of its arguments; return whether a call may raise an exception.

    Parameters
    ----------
    name : str
        ``Class.function``.
    function : kernel
    form : str
        `LOAD`, `AIR` or `ENERGY`.
    size : int
        Length of p.
    numbers : str
        The numbers in p, for messages.

    Raises
    ------
    ValueError
        It takes other arguments, cannot be compiled, returns something else, or reads what p does not have.
    """
    arguments = _STATE, np.zeros(size), 0.0
    taken = inspect.signature(plain_function(function))
    try:
        taken.bind(*arguments)
    except TypeError:
        what = f"{name} takes {taken}; allowed is (state, p, t): state of the body, numbers of the field, time [s]"
        raise ValueError(placed(what, at(function))) from None
    try:
        with compiling():
            found = backend.examine(function, arguments, numbers)
    except FaultyFunctionError as fault:
        raise ValueError(placed(f"{name} {fault.what}", at(fault.function, fault.line))) from None
    except Exception as error:
        raise not_compiled(name, function, error) from error
    if not _fits(found.returned, form):
        what = f"{name} returns {in_words(found.returned)}; allowed is {form}"
        raise ValueError(placed(what, at(function, found.line)))
    return found.may_raise


def _fits(returned: str | tuple, form: str) -> bool:
    if form == ENERGY:
        return returned == NUMBER
    vector = (NUMBER, NUMBER, NUMBER)
    return returned == (vector if form == AIR else (vector, vector))


def describe(kind: type, base: type, size: int) -> str:
    """Describe the columns of p in words."""
    if kind.columns is base.columns:
        names = ", ".join(each.name for each in fields(kind))
        return f"the fields of {kind.__name__}, {names}" if names else f"{kind.__name__} has no fields"
    return f"{kind.__name__}.columns gives {size}"
