"""Checks of a user's field before anything moves: its class, its numbers, and all that its functions read.

A kernel has no exceptions and asks for no bounds. A user's function is compiled alone first, for the types that it
is called with later, so that nothing is compiled twice; what Numba made of it is then looked through.
"""

from __future__ import annotations

import inspect
from collections import Counter
from dataclasses import dataclass, field, fields

import numba
import numpy as np
from numba.core import ir, types
from numba.core.dispatcher import Dispatcher

from physics import validation
from physics.kernels.forces.force_field_state import ZERO, FieldState
from physics.parallel.bound_call import compiling
from physics.scene.field_errors import at, not_compiled, placed

NUMBERS = types.Array(types.float64, 1, "C")  # of p
ARGUMENTS = (numba.typeof(FieldState(ZERO, ZERO, ZERO, (0.0,) * 9, ZERO, ZERO, 1.0, 0, ZERO)), NUMBERS, types.float64)

# What a function may return, by name.
LOAD = "((fx, fy, fz), (tx, ty, tz)): force [N] and torque about the centre of mass [N m]"
AIR = "(vx, vy, vz): velocity of the air [m/s]"
ENERGY = "one number: potential energy [J]"

# Statements that raise nothing, and operations that only do through a value that is looked at where it is made.
_PLAIN = (ir.Assign, ir.Del, ir.Jump, ir.Branch, ir.Return)
_SAFE = ("binop", "inplace_binop", "unary", "getattr", "build_tuple", "cast", "phi", "null", "getiter", "iternext",
         "pair_first", "pair_second")  # fmt: skip


def check_class(kind: type, base: type) -> None:
    """Refuse a class with values that `columns` would not find: one that was to be a dataclass, and is none.

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
    """A field of a dataclass as float64 (n,), all finite; ValueError if it holds something else."""
    value, what = getattr(effect, name), f"{type(effect).__name__}.{name}"
    try:
        return validation.finite(value, np.shape(value), what).ravel()
    except ValueError:
        raise ValueError(f"{what} is {value!r}; allowed are finite numbers, and arrays of them") from None


def numbers_of(effect, body: int, worlds: np.ndarray) -> np.ndarray:
    """`effect.columns(body, worlds)` as float64 (n,) or (k, n), all finite; ValueError if it is something else."""
    name, found = f"{type(effect).__name__}.columns", effect.columns(body, worlds)
    try:
        numbers = np.asarray(found, dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"{name} gives {found!r}; allowed are numbers in shape (n,) or (worlds, n)") from None
    if numbers.ndim not in (1, 2) or (numbers.ndim == 2 and len(numbers) != len(worlds)):
        raise ValueError(f"{name} gives shape {numbers.shape}; allowed is (n,) or ({len(worlds)}, n): a row per world")
    return validation.finite(numbers, numbers.shape, name)


@dataclass
class _Reader:
    """Looks through a function of a field and all that it calls.

    Attributes
    ----------
    name : str
        ``Class.function``.
    size : int
        Length of p.
    numbers : str
        What p holds, for messages.
    may_raise : bool
        Whether some call may raise an exception.
    """

    name: str
    size: int
    numbers: str
    may_raise: bool = False
    read_already: set = field(default_factory=set)

    def read(self, function: Dispatcher, made, own: set[str]) -> None:
        """Look through what Numba made of a function; `own` are the arguments that are p."""
        about = made.type_annotation
        if (made.library, frozenset(own)) in self.read_already:
            return
        self.read_already.add((made.library, frozenset(own)))
        statements = [each for block in about.blocks.values() for each in block.body]
        self.may_raise |= not all(isinstance(each, _PLAIN) for each in statements)
        assigned = [each for each in statements if isinstance(each, ir.Assign)]
        own = _also_called(own, assigned)
        is_sized = any(_asks_for_size(each.value, own) for each in assigned)
        for each in statements:
            if isinstance(each, (ir.SetItem, ir.StaticSetItem)) and each.target.name in own:
                self._refuse("writes to p; allowed is to read it", function, each.loc)
        for each in assigned:
            if isinstance(each.value, ir.Expr) and each.value.op not in _SAFE:
                self._look_at(each.value, function, made, own, is_sized)

    def _look_at(self, expr: ir.Expr, function: Dispatcher, made, own: set[str], is_sized: bool) -> None:
        types_of = made.type_annotation.typemap
        if expr.op == "call":
            self._look_at_call(expr, function, made, own)
        elif expr.op in ("static_getitem", "exhaust_iter") and isinstance(types_of[expr.value.name], types.BaseTuple):
            pass  # checked by Numba
        elif expr.op == "static_getitem" and isinstance(expr.index, slice):
            pass
        elif expr.op == "static_getitem" and expr.value.name in own and isinstance(expr.index, int) and not is_sized:
            if not -self.size <= expr.index < self.size:
                last = f"p[0] to p[{self.size - 1}]" if self.size > 1 else "p[0]" if self.size else "none"
                self._refuse(f"reads p[{expr.index}]; allowed is {last}: {self.numbers}", function, expr.loc)
        else:
            self.may_raise = True

    def _look_at_call(self, expr: ir.Expr, function: Dispatcher, made, own: set[str]) -> None:
        about = made.type_annotation
        callee, sig = about.typemap[expr.func.name], about.calltypes[expr]
        handed = sig.args
        if not isinstance(callee, types.Dispatcher):
            self.may_raise |= any(isinstance(each, types.Array) for each in handed)
            return
        called = callee.dispatcher
        if not called.targetoptions.get("boundscheck"):
            if any(isinstance(each, types.Array) for each in handed):
                self._refuse(
                    f"hands an array to {called.py_func.__name__}, which does not check its indices; allowed are "
                    "functions under @physics.field_function",
                    function, expr.loc,
                )  # fmt: skip
            self.may_raise |= not (called.py_func.__module__ or "").startswith("physics.kernels.")
            return
        if not hasattr(called, "as_part"):  # Numba's own
            self.may_raise = True
            return
        names = inspect.signature(called.py_func).parameters
        theirs = {name for name, given in zip(names, expr.args) if given.name in own}
        self.read(called, called.as_part(tuple(handed)), theirs)

    def _refuse(self, what: str, function: Dispatcher, loc: ir.Loc) -> None:
        raise ValueError(placed(f"{self.name} {what}", at(function, loc)))


def _also_called(own: set[str], assigned: list[ir.Assign]) -> set[str]:
    """Names of p: those given, and what is assigned once, from one of them."""
    found, times = set(own), Counter(each.target.name for each in assigned)
    for each in assigned:
        if isinstance(each.value, ir.Var) and each.value.name in found and times[each.target.name] == 1:
            found.add(each.target.name)
    return found


def _asks_for_size(value, own: set[str]) -> bool:
    """True if this may be p's length: an index that is written down may stand behind a question."""
    if not isinstance(value, ir.Expr):
        return False
    if value.op == "getattr":
        return value.value.name in own
    return value.op == "call" and any(each.name in own for each in value.args) and len(value.args) == 1


def check_function(name: str, function: Dispatcher, form: str, size: int, numbers: str) -> bool:
    """Check a user's function, compiled for what it will be called with; whether a call of it may raise an exception.

    Parameters
    ----------
    name : str
        ``Class.function``.
    function : dispatcher
    form : str
        `LOAD`, `AIR` or `ENERGY`.
    size : int
        Length of p.
    numbers : str
        What p holds, for messages.

    Raises
    ------
    ValueError
        It takes other arguments, cannot be compiled, returns something else, or reads what p does not have.
    """
    taken = inspect.signature(function.py_func)
    try:
        taken.bind(*ARGUMENTS)
    except TypeError:
        what = f"{name} takes {taken}; allowed is (state, p, t): state of the body, numbers of the field, time [s]"
        raise ValueError(placed(what, at(function))) from None
    try:
        with compiling():
            made = function.as_part(ARGUMENTS)
    except Exception as error:
        raise not_compiled(name, function, error) from error
    _check_result(name, function, made, form)
    reader = _Reader(name, size, numbers)
    reader.read(function, made, {list(taken.parameters)[1]})
    return reader.may_raise


def _check_result(name: str, function: Dispatcher, made, form: str) -> None:
    given = made.signature.return_type
    if form == LOAD:
        fits = isinstance(given, types.BaseTuple) and len(given) == 2 and all(map(_is_vector, given.types))
    else:
        fits = _is_vector(given) if form == AIR else _is_number(given)
    if not fits:
        blocks = made.type_annotation.blocks.values()
        returns = [each.loc for block in blocks for each in block.body if isinstance(each, ir.Return)]
        what = f"{name} returns {_in_words(given)}; allowed is {form}"
        raise ValueError(placed(what, at(function, returns[0] if len(returns) == 1 else None)))


def _is_number(type_: types.Type) -> bool:
    return isinstance(type_, (types.Integer, types.Float, types.Boolean))


def _is_vector(type_: types.Type) -> bool:
    return isinstance(type_, types.BaseTuple) and len(type_) == 3 and all(map(_is_number, type_.types))


def _in_words(type_: types.Type) -> str:
    if _is_number(type_):
        return "a number"
    if isinstance(type_, types.BaseTuple):
        if type_.types and all(map(_is_number, type_.types)):
            return f"a tuple of {len(type_)} numbers"
        return f"({', '.join(map(_in_words, type_.types))})"
    if isinstance(type_, types.Optional):
        return f"{_in_words(type_.type)}, or None"
    if isinstance(type_, types.NoneType):
        return "None"
    return "an array" if isinstance(type_, types.Array) else str(type_)


def describe(kind: type, base: type, size: int) -> str:
    """Describe the columns of p in words."""
    if kind.columns is base.columns:
        names = ", ".join(each.name for each in fields(kind))
        return f"the fields of {kind.__name__}, {names}" if names else f"{kind.__name__} has no fields"
    return f"{kind.__name__}.columns gives {size}"
