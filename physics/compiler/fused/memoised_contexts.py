"""Numba's two contexts with cached answers.

To type `a * b` for two floats Numba tries every meaning of `*`, those of arrays, lists and strings as well, and does so
again for each product of each kernel, in every round of inference and once more while lowering: that was a quarter of
the time until the first step. The answer depends on the types alone. Here a context shares all that Numba's own one
holds (and what is registered later), and remembers

- what a built-in function gives for arguments of some types,
- of what type a member of a record or an array is,
- how an operation is lowered, or that there is no special way to,
- how many bytes a type takes.

Only kernels of ours are compiled in these contexts; others in the same process see Numba's.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import ClassVar

from numba.core import types, typing
from numba.core.cpu import CPUContext
from numba.core.imputils import user_function
from numba.extending import models, register_model

from physics.compiler.fused import calling_convention
from physics.compiler.fused.ablation import is_on
from physics.compiler.fused.argument_passing import Arguments
from physics.compiler.fused.array_elements import array_in_record, record_in_record
from physics.compiler.fused.folding_builder import KernelBuilder
from physics.compiler.fused.operation_table import lowering_of, signature_of


class _Forgotten(dict):
    """Table that keeps nothing."""

    def __setitem__(self, key, value):
        """Keep nothing."""


def _make_table() -> dict:
    return {} if is_on("memoised_contexts") else _Forgotten()


class MemoisedFunction(types.Function):
    """Built-in function of Numba that caches its signatures: typing asks for each, and lowering once more.

    Parameters
    ----------
    templates : tuple
        Of the function that it stands for in contexts of ours.
    """

    def __init__(self, templates: tuple):
        super().__init__(templates)
        self.signatures = _make_table()

    def augment(self, other):
        """Numba's function with additional templates, kept for all contexts."""
        return types.Function(self.templates).augment(other)

    def get_call_type(self, context, args, kws):
        """Signature for arguments of these types."""
        if kws:
            return super().get_call_type(context, args, kws)
        key = tuple(args)
        found = self.signatures.get(key)
        if found is None:
            found = signature_of(self, context, args) or super().get_call_type(context, args, kws)
            self.signatures[key] = found
        return found


register_model(MemoisedFunction)(models.OpaqueModel)


class MemoisedTyping(typing.Context):
    """Typing context of Numba that caches its answers.

    Parameters
    ----------
    context : numba.core.typing.Context
        Whose knowledge is shared.
    """

    functions: ClassVar[dict[types.Function, MemoisedFunction]] = {}  # by the one of Numba
    members: ClassVar[dict[tuple, types.Type]] = _make_table()  # by type and name

    def __init__(self, context):
        self.__dict__ = context.__dict__

    def _lookup_global(self, gv):
        return self._with_memory(super()._lookup_global(gv))

    def _with_memory(self, type_):
        """`MemoisedFunction` for a built-in function of Numba, any other type as it is."""
        if type(type_) is not types.Function:
            return type_
        ours = self.functions.get(type_)
        if ours is None:
            ours = self.functions[type_] = MemoisedFunction(type_.templates)
        return ours

    def resolve_getattr(self, typ, attr):
        """Type of a member; None if there is none."""
        if isinstance(typ, types.Module):  # whose members may be set anew
            return super().resolve_getattr(typ, attr)
        found = self.members.get((typ, attr))
        if found is None:
            found = self._with_memory(super().resolve_getattr(typ, attr))
            if found is not None:
                self.members[typ, attr] = found
        return found


@cache
def memoised(context: typing.Context) -> MemoisedTyping:
    """Memoised form of a typing context, one for each, since Numba keeps compiled code by context."""
    return MemoisedTyping(context)


class MemoisedTarget(CPUContext):
    """Target context that lowers operations in Numba's way, or in fewer instructions for kernels.

    Parameters
    ----------
    context : CPUContext
        Whose knowledge is shared.
    """

    lowerings: ClassVar[dict[tuple, Callable]] = _make_table()  # by operation, signature, and what is an error
    absent: ClassVar[dict[tuple, bool]] = _make_table()  # operations without a lowering, and their signatures
    asked: ClassVar[dict] = _make_table()  # operations for which Numba has looked through its registries
    sizes: ClassVar[dict] = _make_table()  # of LLVM types [bytes]

    def __init__(self, context):
        self.__dict__ = context.__dict__

    @classmethod
    def forget(cls, fn) -> None:
        """Drop the lowered calls of `fn`."""
        for key in [key for key in cls.lowerings if key[0] == fn]:
            del cls.lowerings[key]

    @property
    def typing_context(self):
        """Typing context with cached answers."""
        return memoised(self.__dict__["typing_context"])

    def mangler(self, name, types, *, abi_tags=(), uid=None):
        """Name of a symbol; that of a shared kernel (`uid` 0) is the same in all processes.

        Numba names a record type by a number that counts the types of the process. The digest among `abi_tags` tells
        the types (`dispatcher`), so that the name can do without them.
        """
        return super().mangler(name, () if uid == 0 else types, abi_tags=abi_tags, uid=uid)

    def get_function(self, fn, sig, _firstcall=True):
        """Return the function that lowers `fn` for a signature; raise NotImplementedError if there is none."""
        # What Numba compiles for itself has an error model of its own.
        key = fn, sig, type(self.error_model), self.enable_boundscheck
        lowering = self.lowerings.get(key)
        if lowering is None:
            lower = lowering_of(fn, sig)
            if lower is None:
                lowering = self.numba_function(fn, sig, _firstcall)
            else:
                lowering = _bind_lowering(lower, self, fn, sig)
            self.lowerings[key] = lowering
        return lowering

    def numba_function(self, fn, sig, is_first=True):
        """Return Numba's lowering of `fn`; its registries are searched once for each `fn`, not for each signature."""
        if (fn, sig) in self.absent:
            raise NotImplementedError(f"No definition for lowering {fn}{sig}")
        is_new = is_first and fn not in self.asked
        self.asked[fn] = True
        try:
            return super().get_function(fn, sig, is_new)
        except NotImplementedError:
            self.absent[fn, sig] = True
            raise

    @property
    def call_conv(self):
        """Calling convention of functions."""
        return calling_convention.ValueCallConv(self)

    def declare_function(self, module, fndesc):
        """Declare a function in a module that defines or calls it."""
        if calling_convention.returns_value(fndesc):
            return calling_convention.declare_value_function(self, module, fndesc)
        return super().declare_function(module, fndesc)

    def get_arg_packer(self, fe_args):
        """Packer of the words of a call's arguments."""
        return Arguments(self.data_model_manager, fe_args)

    if is_on("array_elements"):

        def get_getattr(self, typ, attr):
            """Return the function that reads a member of a value."""
            member = typ.typeof(attr) if isinstance(typ, types.Record) else None
            if isinstance(member, types.NestedArray):
                return array_in_record
            if isinstance(member, types.Record):
                return record_in_record
            return super().get_getattr(typ, attr)

    def pair_first(self, builder, val, ty):
        """Lower the value of an iterator's step."""
        return builder.extract_value(val, 0)

    def pair_second(self, builder, val, ty):
        """Lower the test whether an iterator's step has a value."""
        return builder.extract_value(val, 1)

    def insert_user_function(self, func, fndesc, libs=()):
        """Register the entry point and the calls of a kernel."""

        def call(context, builder, sig, args):
            is_kernel = isinstance(builder, KernelBuilder) and not isinstance(fndesc.restype, types.Optional)
            if is_kernel or calling_convention.returns_value(fndesc):
                return calling_convention.call_value_function(context, builder, fndesc, args)
            return numbas_call(context, builder, sig, args)

        numbas_call = user_function(fndesc, libs)
        call.signature, call.libs = fndesc.argtypes, tuple(libs)
        self._defns[func].append(call, call.signature)

    def get_abi_sizeof(self, ty):
        """Size of an LLVM type [bytes], cached: Numba writes and parses a module for each answer."""
        size = self.sizes.get(ty)
        if size is None:
            size = self.sizes[ty] = super().get_abi_sizeof(ty)
        return size


def _bind_lowering(lower: Callable, context: MemoisedTarget, fn, sig) -> Callable:
    """Bind one of our lowerings in the form that Numba calls."""

    def lowered(builder, args, loc=None):
        value = lower(context, builder, sig, args)
        return context.numba_function(fn, sig)(builder, args) if value is NotImplemented else value

    return lowered
