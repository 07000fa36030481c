"""Lowering of array elements, and of arrays in records, to as few LLVM instructions as possible.

To read `a[i, j]`, Numba copies the array's seven words to memory, reads shape and strides from the copy, and multiplies
these even for an array of known size. The optimiser would remove all of that. Here these instructions are not written.
Accesses that are no single elements are left to Numba.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable

from llvmlite import ir
from numba.core import cgutils, types, typing

from physics.compiler.fused.ablation import is_on
from physics.compiler.fused.folding_builder import (
    NO_SIGNED_WRAP,
    KernelBuilder,
    known_integer,
    make_struct,
    word_constant,
)

_ITEM_SIZE, _DATA, _SHAPE, _STRIDES = 3, 4, 5, 6  # positions of the members of Numba's structure of an array

_COUNTS_FROM_FRONT = is_on("indices_from_front")


def _lengths(builder, array_type, array, member, known) -> list:
    """Lengths of the axes of an array, or its strides [bytes], as LLVM values; constants if the type fixes them.

    `member` is `_SHAPE` or `_STRIDES`; `known` reads the same from a type of fixed size.
    """
    if isinstance(array_type, types.NestedArray):
        return [word_constant(length) for length in known(array_type)]
    return [builder.extract_value(array, (member, axis)) for axis in range(array_type.ndim)]


def _from_front(context, builder, index, type_, length):
    """Index as a word that counts from the front of an axis of this length; a negative one counts from the end.

    In kernels only literals may be negative: a test of each index would take 6 % of the time of a heap. In users'
    functions, which are not lowered with `KernelBuilder`, every index may be negative.
    """
    index = context.cast(builder, index, type_, types.intp if type_.signed else types.uintp)
    known = known_integer(index)
    is_from_front = known >= 0 if known is not None else _COUNTS_FROM_FRONT and isinstance(builder, KernelBuilder)
    if is_from_front or not type_.signed:
        return index
    return builder.select(builder.icmp_signed("<", index, word_constant(0)), builder.add(index, length), index)


def element_pointer(context, builder, array_type, array, index_types, indices):
    """Pointer to an element of an array; under NUMBA_BOUNDSCHECK=1 an index outside its axis raises IndexError.

    `array` and `indices` are LLVM values, `array_type` and `index_types` their Numba types.
    """
    shape = _lengths(builder, array_type, array, _SHAPE, lambda known: known.shape)
    data = builder.extract_value(array, _DATA)
    from_front = []
    for axis, (index, type_, length) in enumerate(zip(indices, index_types, shape, strict=True)):
        from_front.append(_from_front(context, builder, index, type_, length))
        if context.enable_boundscheck:
            cgutils.do_boundscheck(context, builder, from_front[axis], length, axis)
    if array_type.layout == "C":
        place = from_front[0]
        for index, length in zip(from_front[1:], shape[1:], strict=True):
            place = builder.add(builder.mul(place, length, flags=NO_SIGNED_WRAP), index, flags=NO_SIGNED_WRAP)
        return builder.gep(data, [place], inbounds=True)
    strides = _lengths(builder, array_type, array, _STRIDES, lambda known: known.strides)
    offset = word_constant(0)
    for index, stride in zip(from_front, strides, strict=True):
        offset = builder.add(offset, builder.mul(index, stride))
    return cgutils.pointer_add(builder, data, offset)


def _indices(builder, index_type, index) -> tuple[tuple, list]:
    """Types and LLVM values of the single indices in `a[index]`, where `index` is a number or a tuple."""
    if isinstance(index_type, types.BaseTuple):
        return tuple(index_type.types), [builder.extract_value(index, k) for k in range(len(index_type))]
    return (index_type,), [index]


def _is_element(array_type, index_type) -> bool:
    """True if these types of array and index make `a[index]` a single element, not a view."""
    if not isinstance(array_type, types.Array) or array_type.layout not in "CA":
        return False
    each = index_type.types if isinstance(index_type, types.BaseTuple) else (index_type,)
    return len(each) == array_type.ndim and all(isinstance(one, types.Integer) for one in each)


def _read(context, builder, sig, args):
    """Lower the read of an element, `a[index]`."""
    place = element_pointer(context, builder, sig.args[0], args[0], *_indices(builder, sig.args[1], args[1]))
    return context.unpack_value(builder, sig.args[0].dtype, place, None if sig.args[0].aligned else 1)


def _write(context, builder, sig, args):
    """Lower the write of an element, `a[index] = value`."""
    array_type, index_type, value_type = sig.args
    value = context.cast(builder, args[2], value_type, array_type.dtype)
    place = element_pointer(context, builder, array_type, args[0], *_indices(builder, index_type, args[1]))
    context.pack_value(builder, array_type.dtype, value, place, None if array_type.aligned else 1)


def _reshape(context, builder, sig, args):
    """Lower `a.reshape(shape)` of a contiguous array, without a check that the count of elements is the same.

    Under NUMBA_BOUNDSCHECK=1, and in users' functions, it returns NotImplemented: Numba's lowering checks the count.
    """
    if context.enable_boundscheck or not isinstance(builder, KernelBuilder):
        return NotImplemented
    array, shape = args
    model = context.get_value_type(sig.return_type)
    lengths = [builder.extract_value(shape, k) for k in range(sig.return_type.ndim)]
    strides = [builder.extract_value(array, _ITEM_SIZE)]
    for length in reversed(lengths[1:]):
        strides.insert(0, builder.mul(strides[0], length, flags=NO_SIGNED_WRAP))
    kept = [builder.extract_value(array, k) for k in range(_SHAPE)]
    axes = [make_struct(builder, model.elements[_SHAPE], each) for each in (lengths, strides)]
    return make_struct(builder, model, [*kept, *axes])


def array_in_record(context, builder, record_type, record, name):
    """Lower the read of a record's field that is an array: all words of the array but its address are constants."""
    field = record_type.typeof(name)
    data = cgutils.get_record_member(
        builder, record, record_type.offset(name), context.get_data_type(field.dtype)
    )  # fmt: skip
    model = context.get_value_type(field)
    lengths = [
        ir.Constant.literal_array([word_constant(each) for each in axes]) for axes in (field.shape, field.strides)
    ]
    owner = [ir.Constant(each, None) for each in model.elements[:2]]
    return make_struct(
        builder, model, [*owner, word_constant(math.prod(field.shape)), word_constant(field.size), data, *lengths]
    )


def record_in_record(context, builder, record_type, record, name):
    """Lower the read of a record's field that is a record: its address."""
    inner = context.get_data_type(record_type.typeof(name))
    return cgutils.get_record_member(builder, record, record_type.offset(name), inner)


def signature(key, context, args) -> typing.Signature | None:
    """Signature of the operation `key` for types `args` if it is `a[index]` or `a[index] = number` of an element."""
    if key is operator.getitem and _is_element(*args):
        return typing.signature(args[0].dtype, args[0], _as_words(args[1]))
    if key is operator.setitem and _is_element(*args[:2]) and args[0].mutable:
        value = types.unliteral(args[2])
        if isinstance(value, types.Number) and isinstance(args[0].dtype, types.Number):
            return typing.signature(types.none, args[0], _as_words(args[1]), value)
    return None


def _as_words(index: types.Type) -> types.Type:
    """Type of an index, a number or a tuple, with 64-bit words in place of all its numbers."""
    if isinstance(index, types.BaseTuple):
        return types.BaseTuple.from_types(tuple(map(_as_words, index.types)))
    return types.intp if index.signed else types.uintp


def lowering(key, sig: typing.Signature) -> Callable | None:
    """Return the function that lowers the operation `key` if it reads or writes an element or reshapes, else None."""
    if key is operator.getitem and _is_element(*sig.args):
        return _read
    if key is operator.setitem and _is_element(*sig.args[:2]):
        return _write
    if key == "array.reshape" and sig.recvr.layout == "C" and len(sig.args) == 1:
        return _reshape if isinstance(sig.args[0], types.UniTuple) else None
    return None
