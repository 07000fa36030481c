"""Examine a user's function in the form that Numba makes of it: its result, and all that it reads.

A kernel has no exceptions and no checks of bounds; a user's function may have both. So it is first compiled alone, for
the types of its later calls, so that nothing is compiled twice. Then its code is examined.
"""

from __future__ import annotations

import inspect
from collections import Counter
from dataclasses import dataclass, field

import numba
from numba.core import ir, types
from numba.core.dispatcher import Dispatcher

from physics.compiler.user_function import ARRAY, NONE, NUMBER, Examined, FaultyFunctionError, entries, in_words

# Statements that raise nothing, and operations that only do through a value that is looked at where it is made.
_PLAIN = (ir.Assign, ir.Del, ir.Jump, ir.Branch, ir.Return)
_SAFE = ("binop", "inplace_binop", "unary", "getattr", "build_tuple", "cast", "phi", "null", "getiter", "iternext",
         "pair_first", "pair_second")  # fmt: skip


@dataclass
class _Reader:
    """Reader of a field's function and of all that it calls.

    Attributes
    ----------
    size : int
        Length of p.
    numbers : str
        What p holds, for messages.
    may_raise : bool
        Whether some call may raise an exception.
    """

    size: int
    numbers: str
    may_raise: bool = False
    read_already: set = field(default_factory=set)

    def read(self, function: Dispatcher, made, own: set[str]) -> None:
        """Read Numba's form of a function; `own` are the arguments that are p."""
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
                allowed = f"allowed is {entries(self.size)}: {self.numbers}"
                self._refuse(f"reads p[{expr.index}]; {allowed}", function, expr.loc)
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
        raise FaultyFunctionError(what, function, (loc.filename, loc.line))


def _also_called(own: set[str], assigned: list[ir.Assign]) -> set[str]:
    """Names of p: the given ones, and variables assigned once from one of them."""
    found, times = set(own), Counter(each.target.name for each in assigned)
    for each in assigned:
        if isinstance(each.value, ir.Var) and each.value.name in found and times[each.target.name] == 1:
            found.add(each.target.name)
    return found


def _asks_for_size(value, own: set[str]) -> bool:
    """True if this may be p's length, so that a constant index may stand behind a test."""
    if not isinstance(value, ir.Expr):
        return False
    if value.op == "getattr":
        return value.value.name in own
    return value.op == "call" and any(each.name in own for each in value.args) and len(value.args) == 1


def form_of(type_: types.Type) -> str | tuple:
    """Form of values of a type (`compiler.user_function`)."""
    if isinstance(type_, (types.Integer, types.Float, types.Boolean)):
        return NUMBER
    if isinstance(type_, types.BaseTuple):
        return tuple(map(form_of, type_.types))
    if isinstance(type_, types.Optional):
        return f"{in_words(form_of(type_.type))}, or None"
    if isinstance(type_, types.NoneType):
        return NONE
    return ARRAY if isinstance(type_, types.Array) else str(type_)


def examine(function: Dispatcher, arguments: tuple, numbers: str) -> Examined:
    """Compile a user's function, and read it and all that it calls.

    Parameters
    ----------
    function : kernel
    arguments : tuple
        State, numbers p and time, as it is called with.
    numbers : str
        The numbers in p, in words.

    Raises
    ------
    FaultyFunctionError
        It reads what p does not have, writes to p, or hands p to a function that does not check.
    Exception
        In Numba's words: it cannot be compiled.
    """
    made = function.as_part(tuple(map(numba.typeof, arguments)))
    blocks = made.type_annotation.blocks.values()
    returns = [each.loc for block in blocks for each in block.body if isinstance(each, ir.Return)]
    reader = _Reader(len(arguments[1]), numbers)
    reader.read(function, made, {list(inspect.signature(function.py_func).parameters)[1]})
    line = (returns[0].filename, returns[0].line) if len(returns) == 1 else None
    return Examined(form_of(made.signature.return_type), line, reader.may_raise)
