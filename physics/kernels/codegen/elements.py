"""Elements of arrays, arrays of records, and loops, in as few instructions as they need.

Numba lowers them by way of memory: to read `a[i, j]` it writes the array's seven words into a place of its own, reads
shapes and strides from there, and multiplies those of an array whose size is known. The optimiser leaves nothing of
it; here it is not written in the first place. What is not met below is Numba's.
"""

from __future__ import annotations

import math
import operator

from llvmlite import ir
from numba.core import cgutils, types

from physics.kernels.codegen.builder import FoldingBuilder, constant_of, slot

WORD = ir.IntType(64)
INSIDE = ("nsw",)  # no index and no number of a range is beyond what a word holds
DATA, SHAPE, STRIDES = 4, 5, 6  # members of an array


def _word(value: int) -> ir.Constant:
    return ir.Constant(WORD, value)


def _lengths(builder, array_type, array, member, known) -> list:
    """Shape or strides [bytes] of an array, as constants where its type has them."""
    if isinstance(array_type, types.NestedArray):
        return [_word(length) for length in known(array_type)]
    return [builder.extract_value(array, (member, axis)) for axis in range(array_type.ndim)]


def _from_front(context, builder, index, type_, length):
    """An index as a word, counted from the front of an axis.

    In kernels only a literal counts from the end: to ask of each index whether it is negative takes 6 % of a heap's
    time. Functions of users, which are not written with our builder, may count as they like.
    """
    index = context.cast(builder, index, type_, types.intp if type_.signed else types.uintp)
    known = constant_of(index)
    is_from_front = known >= 0 if known is not None else isinstance(builder, FoldingBuilder)
    if is_from_front or not type_.signed:
        return index
    return builder.select(builder.icmp_signed("<", index, _word(0)), builder.add(index, length), index)


def _pointer(context, builder, array_type, array, index_types, indices):
    """Where an element is; under NUMBA_BOUNDSCHECK=1 an index outside its axis raises IndexError."""
    shape = _lengths(builder, array_type, array, SHAPE, lambda known: known.shape)
    data = builder.extract_value(array, DATA)
    from_front = []
    for axis, (index, type_, length) in enumerate(zip(indices, index_types, shape, strict=True)):
        from_front.append(_from_front(context, builder, index, type_, length))
        if context.enable_boundscheck:
            cgutils.do_boundscheck(context, builder, from_front[axis], length, axis)
    if array_type.layout == "C":
        place = from_front[0]
        for index, length in zip(from_front[1:], shape[1:], strict=True):
            place = builder.add(builder.mul(place, length, flags=INSIDE), index, flags=INSIDE)
        return builder.gep(data, [place], inbounds=True)
    strides = _lengths(builder, array_type, array, STRIDES, lambda known: known.strides)
    offset = _word(0)
    for index, stride in zip(from_front, strides, strict=True):
        offset = builder.add(offset, builder.mul(index, stride))
    return cgutils.pointer_add(builder, data, offset)


def _indices(builder, index_type, index) -> tuple[tuple, list]:
    """Types and values of the indices in `a[index]`."""
    if isinstance(index_type, types.BaseTuple):
        return tuple(index_type.types), [builder.extract_value(index, k) for k in range(len(index_type))]
    return (index_type,), [index]


def _is_element(array_type, index_type) -> bool:
    """`a[index]` is one element, not a view."""
    if not isinstance(array_type, types.Array) or array_type.layout not in "CA":
        return False
    each = index_type.types if isinstance(index_type, types.BaseTuple) else (index_type,)
    return len(each) == array_type.ndim and all(isinstance(one, types.Integer) for one in each)


def _read(context, builder, sig, args):
    place = _pointer(context, builder, sig.args[0], args[0], *_indices(builder, sig.args[1], args[1]))
    return context.unpack_value(builder, sig.args[0].dtype, place, None if sig.args[0].aligned else 1)


def _write(context, builder, sig, args):
    array_type, index_type, value_type = sig.args
    value = context.cast(builder, args[2], value_type, array_type.dtype)
    place = _pointer(context, builder, array_type, args[0], *_indices(builder, index_type, args[1]))
    context.pack_value(builder, array_type.dtype, value, place, None if array_type.aligned else 1)


def _range(context, builder, sig, args):
    """`range(stop)` or `range(start, stop)`."""
    start, stop = args if len(args) == 2 else (_word(0), args[0])
    state = ir.Constant(context.get_value_type(sig.return_type), [_word(0), _word(0), _word(1)])
    return builder.insert_value(builder.insert_value(state, start, 0), stop, 1)


def _iterate(context, builder, sig, args):
    """An iterator over a range: where its next number is, the end, the step, and where the count of those left is."""
    start, stop, step = (builder.extract_value(args[0], k) for k in range(3))
    if constant_of(step) != 1:
        return context.numba_function("getiter", sig)(builder, args)
    members = slot(builder, WORD), stop, step, slot(builder, WORD)
    builder.store(start, members[0])
    builder.store(builder.sub(stop, start), members[3])  # none is left if it is negative
    iterator = ir.Constant(context.get_value_type(sig.return_type), ir.Undefined)
    for k, member in enumerate(members):
        iterator = builder.insert_value(iterator, member, k)
    return iterator


def _next(context, builder, sig, args):
    """The next number, and whether there is one."""
    following, step, left = (builder.extract_value(args[0], k) for k in (0, 2, 3))
    number, count = builder.load(following), builder.load(left)
    builder.store(builder.add(number, step, flags=INSIDE), following)
    builder.store(builder.sub(count, _word(1), flags=INSIDE), left)
    pair = ir.Constant(context.get_value_type(sig.return_type), ir.Undefined)
    valid = builder.icmp_signed(">", count, _word(0))
    return builder.insert_value(builder.insert_value(pair, number, 0), valid, 1)


def array_in_record(context, builder, record_type, record, name):
    """An array that is a field of a record: all of it is known, but for where it is."""
    field = record_type.typeof(name)
    data = cgutils.get_record_member(
        builder, record, record_type.offset(name), context.get_data_type(field.dtype)
    )  # fmt: skip
    model = context.get_value_type(field)
    members = [ir.Constant(each, None) for each in model.elements]
    members[2] = _word(math.prod(field.shape))
    members[3] = _word(field.size)
    for member, lengths in ((SHAPE, field.shape), (STRIDES, field.strides)):
        members[member] = ir.Constant.literal_array([_word(length) for length in lengths])
    return builder.insert_value(ir.Constant(model, members), data, DATA)


def lowering_of(function, sig):
    """How to lower `function` for a signature, or None where Numba's way is taken.

    Parameters
    ----------
    function : types.Function or str
    sig : typing.Signature

    Returns
    -------
    Callable, optional
        Of a context, a builder, the signature and the values of the arguments.
    """
    args = sig.args
    if function == "getiter":
        return _iterate if args == (types.range_state64_type,) else None
    if function == "iternext":
        return _next if args == (types.range_iter64_type,) else None
    key = getattr(function, "typing_key", None)
    if key is range:
        return _range if len(args) < 3 and sig.return_type == types.range_state64_type else None
    if key is operator.getitem:
        return _read if _is_element(*args) else None
    if key is operator.setitem:
        return _write if _is_element(*args[:2]) else None
    return None
