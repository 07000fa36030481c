"""Examination of a user's function in Numba's intermediate code: the form of its result, and everything that it reads.

A kernel neither raises exceptions nor checks indices; a user's function may do both. So it is compiled alone before a
step, for the types of arguments of its later calls, which use the same code. Then its intermediate code is examined.
"""

from __future__ import annotations

import inspect
from collections import Counter
from dataclasses import dataclass, field

import numba
from numba.core import ir, types
from numba.core.dispatcher import Dispatcher

from physics.compiler.user_function import ARRAY, NONE, NUMBER, Examined, FaultyFunctionError, entries, in_words

# Statements that never raise an exception; operations that raise one only because of a value whose origin is examined.
_PLAIN = (ir.Assign, ir.Del, ir.Jump, ir.Branch, ir.Return)
_SAFE = ("binop", "inplace_binop", "unary", "getattr", "build_tuple", "cast", "phi", "null", "getiter", "iternext",
         "pair_first", "pair_second")  # fmt: skip


@dataclass
class _Reader:
    """Examiner of a field's function and of all functions that it calls.

    Attributes
    ----------
    size : int
        Length of p, the argument with the numbers of the field.
    numbers : str
        Description of the numbers in p, for messages.
    may_raise : bool
        Whether some statement examined so far may raise an exception.
    read_already : set
        Functions that have been examined, each with the names of its arguments that are p.
    """

    size: int
    numbers: str
    may_raise: bool = False
    read_already: set = field(default_factory=set)

    def read(self, function: Dispatcher, made, own: set[str]) -> None:
        """Examine a function, given Numba's result `made` of its compilation; `own` are its arguments that are p.

        FaultyFunctionError if it writes to p, reads beyond its end, or passes an array to an unchecked function.
        """
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
            pass  # Numba has checked the index
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
        if not hasattr(called, "as_part"):  # a function under `numba.njit`
            self.may_raise = True
            return
        names = inspect.signature(called.py_func).parameters
        theirs = {name for name, given in zip(names, expr.args) if given.name in own}
        self.read(called, called.as_part(tuple(handed)), theirs)

    def _refuse(self, what: str, function: Dispatcher, loc: ir.Loc) -> None:
        raise FaultyFunctionError(what, function, (loc.filename, loc.line))


def _also_called(own: set[str], assigned: list[ir.Assign]) -> set[str]:
    """Names of variables that refer to p: the names `own`, and variables assigned only once, from one of them."""
    found, times = set(own), Counter(each.target.name for each in assigned)
    for each in assigned:
        if isinstance(each.value, ir.Var) and each.value.name in found and times[each.target.name] == 1:
            found.add(each.target.name)
    return found


def _asks_for_size(value, own: set[str]) -> bool:
    """True if a value may be computed from p's length; a test of the length may then guard a constant index."""
    if not isinstance(value, ir.Expr):
        return False
    if value.op == "getattr":
        return value.value.name in own
    return value.op == "call" and any(each.name in own for each in value.args) and len(value.args) == 1


def form_of(type_: types.Type) -> str | tuple:
    """Form of the values of a Numba type, in the words of `compiler.user_function`, such as `NUMBER`."""
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
    """Compile a user's function, and examine it and all functions that it calls.

    Parameters
    ----------
    function : kernel
        The function ``(state, p, t)``, made by `user_kernel`.
    arguments : tuple
        Example of its arguments: state of a body, numbers p of the field, and time.
    numbers : str
        Description of the numbers in p, for messages.

    Returns
    -------
    Examined
        Form of the result, line of the return, and whether a call may raise an exception.

    Raises
    ------
    FaultyFunctionError
        The function reads beyond the end of p, writes to p, or passes an array to a function that does not check
        indices.
    Exception
        Numba's exception if the function cannot be compiled.
    """
    made = function.as_part(tuple(map(numba.typeof, arguments)))
    blocks = made.type_annotation.blocks.values()
    returns = [each.loc for block in blocks for each in block.body if isinstance(each, ir.Return)]
    reader = _Reader(len(arguments[1]), numbers)
    reader.read(function, made, {list(inspect.signature(function.py_func).parameters)[1]})
    line = (returns[0].filename, returns[0].line) if len(returns) == 1 else None
    return Examined(form_of(made.signature.return_type), line, reader.may_raise)
