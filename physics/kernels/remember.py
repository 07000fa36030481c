"""Numba's two contexts, asked each question once.

To type `a * b` for two floats Numba tries every meaning of `*`, those of arrays, lists and strings as well, and does so
again for each product of each kernel, in every round of inference and once more while lowering: that was a quarter of
the time until the first step. The answer depends on the types alone. Here a context shares all that Numba's own one
holds (and what is registered later), and remembers

- what a built-in function gives for arguments of some types,
- of what type a member of a record or an array is,
- that there is no special way to lower an operation,
- how many bytes a type takes.

Only kernels of ours are compiled in these contexts; others in the same process see Numba's.
"""

from __future__ import annotations

from functools import cache
from typing import ClassVar

from numba.core import types, typing
from numba.core.cpu import CPUContext


class RememberingTyping(typing.Context):
    """What Numba knows of types.

    Parameters
    ----------
    context : numba.core.typing.Context
        Whose knowledge is shared.
    """

    signatures: ClassVar[dict[tuple, typing.Signature]] = {}  # by function and types of its arguments
    members: ClassVar[dict[tuple, types.Type]] = {}  # by type and name

    def __init__(self, context):
        self.__dict__ = context.__dict__

    def resolve_getattr(self, typ, attr):
        """Type of a member; None if there is none."""
        if isinstance(typ, types.Module):  # whose members may be set anew
            return super().resolve_getattr(typ, attr)
        found = self.members.get((typ, attr))
        if found is None:
            found = super().resolve_getattr(typ, attr)
            if found is not None:
                self.members[typ, attr] = found
        return found


@cache
def remembering(context: typing.Context) -> RememberingTyping:
    """The one that remembers for a context: Numba keeps what it compiles of its own by the context it was asked in."""
    return RememberingTyping(context)


def _get_call_type(function, context, args, kws, asked=types.Function.get_call_type):
    """Signature of a built-in function for arguments of these types: `types.Function.get_call_type`."""
    if kws or not isinstance(context, RememberingTyping):
        return asked(function, context, args, kws)
    key = (function, tuple(args))
    found = context.signatures.get(key)
    if found is None:
        found = context.signatures[key] = asked(function, context, args, kws)
    return found


# Where Numba lowers an operation it asks the function itself, past every context that it could be given.
types.Function.get_call_type = _get_call_type


class RememberingTarget(CPUContext):
    """How Numba lowers operations.

    Parameters
    ----------
    context : CPUContext
        Whose knowledge is shared.
    """

    absent: ClassVar[set[tuple]] = set()  # operations without a lowering of their own, and their signatures
    sizes: ClassVar[dict] = {}  # of LLVM types [bytes]

    def __init__(self, context):
        self.__dict__ = context.__dict__

    @property
    def typing_context(self):
        """The context of types that remembers."""
        return remembering(self.__dict__["typing_context"])

    def get_function(self, fn, sig, _firstcall=True):
        """How `fn` is lowered for a signature; raises NotImplementedError if there is no way."""
        key = (fn, sig)
        if key in self.absent:
            raise NotImplementedError(f"No definition for lowering {fn}{sig}")
        try:
            return super().get_function(fn, sig, _firstcall)
        except NotImplementedError:
            self.absent.add(key)
            raise

    def get_abi_sizeof(self, ty):
        """Size of an LLVM type [bytes]: Numba writes and parses a module for each question."""
        size = self.sizes.get(ty)
        if size is None:
            size = self.sizes[ty] = super().get_abi_sizeof(ty)
        return size
