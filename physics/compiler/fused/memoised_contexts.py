"""Numba's two contexts, for types and for lowering, with cached answers.

To type `a * b` for two floats Numba tries every meaning of `*`, those of arrays, lists and strings included. It does so
again for each product of each kernel, in every round of inference and while lowering. That would take a quarter of the
time until the first step, although the answer depends on the types alone. The contexts here share everything that is
registered with Numba's own contexts, now or later, and remember

- the type of the result of a built-in function, for the types of its arguments,
- the type of a member of a record or an array,
- the lowering of an operation, or that there is none,
- the size of a type in bytes.

Only kernels of this package are compiled in these contexts; other functions in the same process use Numba's.
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
    """Dictionary that stays empty, for use without caching."""

    def __setitem__(self, key, value):
        """Ignore the value."""


def _make_table() -> dict:
    return {} if is_on("memoised_contexts") else _Forgotten()


class MemoisedFunction(types.Function):
    """Type of a built-in function, as Numba's, but it caches the signatures of calls.

    Parameters
    ----------
    templates : tuple
        Templates of the function of Numba that it replaces in these contexts.
    """

    def __init__(self, templates: tuple):
        super().__init__(templates)
        self.signatures = _make_table()

    def augment(self, other):
        """Make Numba's own type of the function, with the templates of `other` added."""
        return types.Function(self.templates).augment(other)

    def get_call_type(self, context, args, kws):
        """Signature of a call with arguments of these types, cached."""
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
    """Typing context that shares the state of one of Numba's contexts, and caches its answers.

    Parameters
    ----------
    context : numba.core.typing.Context
        Context of Numba with which it shares its state.
    """

    functions: ClassVar[dict[types.Function, MemoisedFunction]] = {}  # by the function type of Numba
    members: ClassVar[dict[tuple, types.Type]] = _make_table()  # by type and name

    def __init__(self, context):
        self.__dict__ = context.__dict__

    def _lookup_global(self, gv):
        return self._with_memory(super()._lookup_global(gv))

    def _with_memory(self, type_):
        """Replace the type of a built-in function of Numba by its `MemoisedFunction`; return other types unchanged."""
        if type(type_) is not types.Function:
            return type_
        ours = self.functions.get(type_)
        if ours is None:
            ours = self.functions[type_] = MemoisedFunction(type_.templates)
        return ours

    def resolve_getattr(self, typ, attr):
        """Type of the member `attr` of a value of type `typ`, cached; None if it has no such member."""
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
    """Memoised form of a typing context of Numba: always the same object, as Numba keeps compiled code by context."""
    return MemoisedTyping(context)


class MemoisedTarget(CPUContext):
    """Target context for kernels: it lowers operations by `operation_table`, else as Numba does, and caches lowerings.

    Parameters
    ----------
    context : CPUContext
        Context of Numba with which it shares its state.
    """

    lowerings: ClassVar[dict[tuple, Callable]] = _make_table()  # by operation, signature, error model, index checks
    absent: ClassVar[dict[tuple, bool]] = _make_table()  # operations without a lowering, and their signatures
    asked: ClassVar[dict] = _make_table()  # operations for which Numba's registries have been searched
    sizes: ClassVar[dict] = _make_table()  # sizes of LLVM types [bytes]

    def __init__(self, context):
        self.__dict__ = context.__dict__

    @classmethod
    def forget(cls, fn) -> None:
        """Forget the cached lowerings of calls of `fn`."""
        for key in [key for key in cls.lowerings if key[0] == fn]:
            del cls.lowerings[key]

    @property
    def typing_context(self):
        """Typing context that belongs to this context, with cached answers."""
        return memoised(self.__dict__["typing_context"])

    def mangler(self, name, types, *, abi_tags=(), uid=None):
        """Name of the symbol of a compiled function; that of a shared kernel (`uid` 0) is the same in all processes.

        Numba's names of record types contain numbers that differ between processes. A shared kernel's name leaves types
        out, since the digest among `abi_tags` identifies them (`dispatcher`).
        """
        return super().mangler(name, () if uid == 0 else types, abi_tags=abi_tags, uid=uid)

    def get_function(self, fn, sig, _firstcall=True):
        """Return the function that lowers `fn` for a signature, cached; raise NotImplementedError if there is none."""
        # Functions that Numba compiles for itself have another error model.
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
        """Return Numba's lowering of `fn` for a signature; Numba's registries are searched only once for each `fn`."""
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
        """Calling convention of kernels, see `calling_convention`."""
        return calling_convention.ValueCallConv(self)

    def declare_function(self, module, fndesc):
        """Declare the function that `fndesc` describes in an LLVM module that defines or calls it."""
        if calling_convention.returns_value(fndesc):
            return calling_convention.declare_value_function(self, module, fndesc)
        return super().declare_function(module, fndesc)

    def get_arg_packer(self, fe_args):
        """Packer of the arguments of a call, for arguments of these types; see `argument_passing`."""
        return Arguments(self.data_model_manager, fe_args)

    if is_on("array_elements"):

        def get_getattr(self, typ, attr):
            """Return the function that lowers the read of the member `attr` of a value of type `typ`."""
            member = typ.typeof(attr) if isinstance(typ, types.Record) else None
            if isinstance(member, types.NestedArray):
                return array_in_record
            if isinstance(member, types.Record):
                return record_in_record
            return super().get_getattr(typ, attr)

    def pair_first(self, builder, val, ty):
        """Read the value from `val`, the LLVM pair (value, is valid) that an iterator's step returns."""
        return builder.extract_value(val, 0)

    def pair_second(self, builder, val, ty):
        """Read the validity from `val`, the LLVM pair (value, is valid) that an iterator's step returns."""
        return builder.extract_value(val, 1)

    def insert_user_function(self, func, fndesc, libs=()):
        """Register a compiled function by its entry point `func`, so that calls of it can be lowered."""

        def call(context, builder, sig, args):
            is_kernel = isinstance(builder, KernelBuilder) and not isinstance(fndesc.restype, types.Optional)
            if is_kernel or calling_convention.returns_value(fndesc):
                return calling_convention.call_value_function(context, builder, fndesc, args)
            return numbas_call(context, builder, sig, args)

        numbas_call = user_function(fndesc, libs)
        call.signature, call.libs = fndesc.argtypes, tuple(libs)
        self._defns[func].append(call, call.signature)

    def get_abi_sizeof(self, ty):
        """Size of an LLVM type [bytes], cached, since Numba writes and parses an LLVM module to find it."""
        size = self.sizes.get(ty)
        if size is None:
            size = self.sizes[ty] = super().get_abi_sizeof(ty)
        return size


def _bind_lowering(lower: Callable, context: MemoisedTarget, fn, sig) -> Callable:
    """Bind a lowering of `operation_table` to context and signature, in the form that Numba calls.

    If it returns NotImplemented, Numba's own lowering takes its place.
    """

    def lowered(builder, args, loc=None):
        value = lower(context, builder, sig, args)
        return context.numba_function(fn, sig)(builder, args) if value is NotImplemented else value

    return lowered
