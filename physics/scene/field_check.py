"""Checks of a user's force field before a step: its class, its numbers, and everything that its functions read.

A kernel neither checks the bounds of arrays nor handles exceptions, so a user's function is checked beforehand. It is
compiled alone, for the types of argument that a step passes, and the result is examined. The step uses the same
compiled function, so that nothing is compiled twice.
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

# Example of a first argument of a user's function: a body at rest in the origin.
_STATE = FieldState(
    ZERO, ZERO, ZERO, (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), ZERO, ZERO, 1.0, 0, (1.0, 1.0, 1.0)
)

# Forms of the value that a user's function returns, as words of a message.
LOAD = "((fx, fy, fz), (tx, ty, tz)): force [N] and torque about the centre of mass [N m]"
AIR = "(vx, vy, vz): velocity of the air [m/s]"
ENERGY = "one number: potential energy [J]"


def check_class(kind: type, base: type) -> None:
    """Raise a ValueError if the numbers of a field class would not reach its function.

    `Field.columns` collects the fields of a dataclass. A class that declares fields or an ``__init__`` without the
    decorator of a dataclass is refused, unless it has a `columns` of its own.

    Parameters
    ----------
    kind : type
        A subclass of `base`.
    base : type
        `physics.Field`.
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
    """Value of the dataclass field `name` of a force field, as float64 (n,); ValueError unless all are finite."""
    value, what = getattr(effect, name), f"{type(effect).__name__}.{name}"
    try:
        return validation.finite(value, np.shape(value), what).ravel()
    except ValueError:
        raise ValueError(f"{what} is {value!r}; allowed are finite numbers, and arrays of them") from None


def numbers_of(effect, body: int, worlds: np.ndarray) -> np.ndarray:
    """Call `effect.columns(body, worlds)` of a force field and check its result.

    Returns
    -------
    (n,) or (k, n) float64
        The field's n numbers for this body: the same for all worlds, or a row for each of the k `worlds`.

    Raises
    ------
    ValueError
        The result is not an array of finite numbers in one of these shapes.
    """
    name, found = f"{type(effect).__name__}.columns", effect.columns(body, worlds)
    try:
        numbers = np.asarray(found, dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"{name} gives {found!r}; allowed are numbers in shape (n,) or (worlds, n)") from None
    if numbers.ndim not in (1, 2) or (numbers.ndim == 2 and len(numbers) != len(worlds)):
        raise ValueError(f"{name} gives shape {numbers.shape}; allowed is (n,) or ({len(worlds)}, n): a row per world")
    return validation.finite(numbers, numbers.shape, name)


def check_function(name: str, function: Callable, form: str, size: int, numbers: str) -> bool:
    """Check a user's function ``(state, p, t)``; return whether a call of it may raise an exception.

    Parameters
    ----------
    name : str
        Name of the function for messages, ``Class.function``.
    function : kernel
        The function, made by `physics.field_function`.
    form : str
        Form of the value that it must return: `LOAD`, `AIR` or `ENERGY`.
    size : int
        Length of its argument p, the numbers of the field.
    numbers : str
        Description of the numbers in p, for messages.

    Raises
    ------
    ValueError
        The function takes other arguments, cannot be compiled, returns another form, or reads beyond the end of p.
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
    """Describe, for messages, the `size` numbers that the functions of a field class `kind` get as p.

    `base` is `physics.Field`.
    """
    if kind.columns is base.columns:
        names = ", ".join(each.name for each in fields(kind))
        return f"the fields of {kind.__name__}, {names}" if names else f"{kind.__name__} has no fields"
    return f"{kind.__name__}.columns gives {size}"
