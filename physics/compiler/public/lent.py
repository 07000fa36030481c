"""Lending of the arguments of a step to the kernels below it, with large named tuples passed by address.

Numba passes a tuple word by word; the workspace of bodies that touch is a hundred arrays of seven words each. Here such
a tuple is written to memory once, and kernels get its address. A member that is a named tuple is again an address.
"""

from __future__ import annotations

from functools import cache

from numba import types
from numba.extending import intrinsic, models, overload_attribute, register_model

from physics.compiler.public.reference_counts import WITH_COUNTS

# A named tuple of more words than this, about three arrays, is passed by its address. With 64 words compilation and
# step of the block take longer. The workspace of bodies that touch, passed word by word, took 528 CPU seconds to
# compile.
MANY_WORDS = 16


class LentGroup(types.Type):
    """Numba type of a named tuple that is passed by its address.

    Parameters
    ----------
    group : numba.types.BaseTuple
        Type of the named tuple.
    """

    def __init__(self, group):
        self.group = group
        super().__init__(f"lent({group})")


def member_type(group, name: str):
    """Type of the member `name` of a named tuple of the type `group`, which may be a `LentGroup`."""
    if isinstance(group, LentGroup):
        member = group.group.types[group.group.fields.index(name)]
        return LentGroup(member) if hasattr(member, "fields") and isinstance(member, types.BaseTuple) else member
    return group.types[group.fields.index(name)]


@register_model(LentGroup)
class _LentModel(models.PrimitiveModel):
    def __init__(self, manager, type_):
        super().__init__(manager, type_, manager.lookup(type_.group).get_value_type().as_pointer())


@cache
def _reader(k: int):
    """Make the Numba function (group) that reads member number `k` of a lent named tuple."""

    @intrinsic
    def read(typing_context, group):
        result = member_type(group, group.group.fields[k])

        def lower(context, builder, sig, args):
            place = builder.gep(args[0], [_index(context, 0), _index(context, k)], inbounds=True)
            return place if isinstance(sig.return_type, LentGroup) else builder.load(place)

        return result(group), lower

    return read


@cache
def _declare_member(name: str) -> None:
    """Register with Numba that a lent named tuple may have a member `name`, which kernels can read."""

    # Without reference counts a function may return an array only if the array is one of its arguments.
    @overload_attribute(LentGroup, name, strict=False, jit_options=WITH_COUNTS)
    def read_member(group):
        if name not in group.group.fields:
            return None
        read = _reader(group.group.fields.index(name))
        return lambda group: read(group)


def declare_members(value) -> None:
    """Register the members of all named tuples in `value`, nested ones included, for `lend`.

    It must be called before a kernel is compiled for these arguments.
    """
    if isinstance(value, tuple):
        for name in getattr(value, "_fields", ()):
            _declare_member(name)
        for each in value:
            declare_members(each)


def _index(context, k: int):
    return context.get_constant(types.int32, k)


def _words(type_) -> int:
    """Approximate number of words of a value of this type."""
    if isinstance(type_, types.BaseTuple):
        return sum(map(_words, type_))
    return 5 + 2 * type_.ndim if isinstance(type_, types.Array) else 1


def _is_large(type_) -> bool:
    return isinstance(type_, types.BaseTuple) and hasattr(type_, "fields") and _words(type_) > MANY_WORDS


@intrinsic
def lend(typing_context, arguments):
    """Lend a tuple of arguments to other kernels: large named tuples in it become addresses.

    The result is valid while the lending kernel runs.
    """
    result = types.Tuple([LentGroup(each) if _is_large(each) else each for each in arguments])

    def lower(context, builder, sig, args):
        members = []
        for k, type_ in enumerate(sig.args[0]):
            value = builder.extract_value(args[0], k)
            if _is_large(type_):
                with builder.goto_entry_block():
                    place = builder.alloca(value.type)
                builder.store(value, place)
                value = place
            members.append(value)
        return context.make_tuple(builder, sig.return_type, members)

    return result(arguments), lower
