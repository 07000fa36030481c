"""Lend the arguments of a step to the kernels below it: large groups by address.

Numba hands a tuple on word by word: the scratch of many bodies is a hundred arrays of seven words each. Here such a
group is put in memory once, and kernels are handed its address. A member that is a group is again an address.
"""

from __future__ import annotations

from functools import cache

from numba import types
from numba.extending import intrinsic, models, overload_attribute, register_model

from physics.compiler.public.reference_counts import WITH_COUNTS

# Words of a group above which it is handed on by its address: three arrays. With 64 the block takes longer to compile,
# and a step longer; the scratch of many bodies, word by word, took 528 CPU seconds to compile.
MANY_WORDS = 16


class LentGroup(types.Type):
    """Type of the address of a named tuple.

    Parameters
    ----------
    group : numba.types.BaseTuple
    """

    def __init__(self, group):
        self.group = group
        super().__init__(f"lent({group})")


def member_type(group, name: str):
    """Type of a member of a named tuple, or of a lent one."""
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
    """Make the intrinsic (group) that reads member k."""

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
    """Let kernels read the member `name` of any group with one."""

    # Without counts a function may not return an array, unless it was handed it.
    @overload_attribute(LentGroup, name, strict=False, jit_options=WITH_COUNTS)
    def read_member(group):
        if name not in group.group.fields:
            return None
        read = _reader(group.group.fields.index(name))
        return lambda group: read(group)


def declare_members(value) -> None:
    """Let kernels read the members of all named tuples among arguments, before one is compiled for them."""
    if isinstance(value, tuple):
        for name in getattr(value, "_fields", ()):
            _declare_member(name)
        for each in value:
            declare_members(each)


def _index(context, k: int):
    return context.get_constant(types.int32, k)


def _words(type_) -> int:
    """Approximate number of words of a value."""
    if isinstance(type_, types.BaseTuple):
        return sum(map(_words, type_))
    return 5 + 2 * type_.ndim if isinstance(type_, types.Array) else 1


def _is_large(type_) -> bool:
    return isinstance(type_, types.BaseTuple) and hasattr(type_, "fields") and _words(type_) > MANY_WORDS


@intrinsic
def lend(typing_context, arguments):
    """Lend a tuple of arguments; it is valid while the lending kernel runs."""
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
