"""Type inference: the types of the variables and calls of a kernel."""

from __future__ import annotations

from numba.core import ir
from numba.core.errors import NumbaWarning, TypingError, WarningsFixer
from numba.core.typeinfer import ConstraintNetwork, TypeInferer

from physics.compiler.fused.ablation import is_on


def infer_types(state) -> None:
    """Infer the types of variables, of the result and of calls, and write them into the state of a compilation.

    Parameters
    ----------
    state : numba.core.compiler.StateDict
        State of the compilation, changed.

    Raises
    ------
    numba.core.errors.TypingError
        A type cannot be found; the message names the line.
    """
    code, context = state.func_ir, state.typingctx
    warnings = WarningsFixer(NumbaWarning)
    inference = TypeInferer(context, code, warnings)
    if is_on("type_inference"):
        inference.constraints = _Network()
    with context.callstack.register(state.targetctx.target, inference, state.func_id, state.args), warnings:
        for k, (name, type_) in enumerate(zip(code.arg_names, state.args, strict=True)):
            inference.seed_argument(name, k, type_)
        inference.build_constraint()
        inference.propagate()
        state.typemap, state.return_type, state.calltypes = inference.unify()


class _Network(ConstraintNetwork):
    """Network of type constraints in which a constraint is checked again only if a type in it has changed.

    Numba checks all constraints again and again until a round changes nothing: two rounds for most kernels.
    """

    def __init__(self):
        super().__init__()
        self._about: list[list[str]] = []  # for each constraint, names of variables (and of attributes)
        self._seen: list[list | None] = []  # types of these variables after the last check of the constraint

    def append(self, constraint):
        """Add a constraint, and note the variables in it."""
        super().append(constraint)
        self._about.append(sorted(set(_names(vars(constraint).values()))))
        self._seen.append(None)

    def propagate(self, typeinfer):
        """Check each constraint once; return a list of errors, such as types that are not known yet."""
        wrong = []
        for k, constraint in enumerate(self.constraints):
            if self._seen[k] == self._types(k, typeinfer.typevars):
                continue
            try:
                constraint(typeinfer)
                self._seen[k] = self._types(k, typeinfer.typevars)
            except TypingError as error:
                wrong.append(TypingError(str(error), loc=constraint.loc, highlighting=False))
        return wrong

    def _types(self, k: int, variables) -> list:
        return [variables[name].type for name in self._about[k] if name in variables]


def _names(values) -> list[str]:
    """Names of all variables in `values`, nested lists, tuples and dictionaries included; strings count as names."""
    found = []
    for each in values:
        if isinstance(each, ir.Var):
            found.append(each.name)
        elif isinstance(each, str):
            found.append(each)
        elif isinstance(each, (list, tuple)):
            found += _names(each)
        elif isinstance(each, dict):
            found += _names(each.values())
    return found
