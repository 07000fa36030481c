"""Prepared entries of kernels, which read their arguments from memory, so that machine code can make the call.

A call from Python passes two dozen arguments to a kernel. It reads seven words of each array from a Python object, and
only one thread at a time runs Python. So a kernel that returns nothing has a second entry, which takes the address of
all these words. They are written once (`physics.parallel.bound_call`), in the order of the arguments: for an array the
words of Numba's structure, for a tuple those of its members. The entry returns Numba's status, which is not 0 if the
kernel raised an exception; the address of the exception is then written to memory.
"""

from __future__ import annotations

from llvmlite import ir
from numba.core import types
from numba.core.callconv import excinfo_ptr_t

from physics.compiler.fused.folding_builder import (
    WORD,
    FoldingBuilder,
    StructInMemory,
    kernel_builder,
    make_struct,
    word_constant,
)

WORD_SIZE = 8  # [bytes]
STATUS_TYPE = ir.IntType(32)
ENTRY_TYPE = ir.FunctionType(STATUS_TYPE, [WORD.as_pointer(), excinfo_ptr_t.as_pointer()])


def _word_count(context, type_: types.Type) -> int:
    """Number of words of an argument of this type. Each number takes a word of its own."""
    if isinstance(type_, types.BaseTuple):
        return sum(_word_count(context, member) for member in type_.types)
    return -(-context.get_abi_sizeof(context.get_value_type(type_)) // WORD_SIZE)


def _is_made_of_words(context, type_: types.Type) -> bool:
    """True if the words of an argument of this type are also its LLVM structure, member by member.

    Truth values differ: each has a word, but in a structure one of them may follow another after a byte.
    """
    if not isinstance(type_, types.BaseTuple):
        return True
    form, place = context.get_value_type(type_), 0
    for k, member in enumerate(type_.types):
        if isinstance(form, ir.ArrayType):  # of a tuple whose members are alike
            begin = k * context.get_abi_sizeof(form.element)
        else:
            begin = form.get_element_offset(context.target_data, k)
        if begin != WORD_SIZE * place or not _is_made_of_words(context, member):
            return False
        place += _word_count(context, member)
    return True


def _read(context, builder, words: ir.Value, type_: types.Type, place: int) -> tuple:
    """Read an argument of this type from the words that begin at number `place`.

    Returns the LLVM value or structure, and the number of the word after it. A tuple whose words are its structure is
    not copied: kernels read its members where they are.
    """
    form = context.get_value_type(type_)
    if isinstance(type_, types.BaseTuple) and not _is_made_of_words(context, type_):
        members = []
        for member in type_.types:
            value, place = _read(context, builder, words, member, place)
            members.append(value)
        return make_struct(builder, form, members), place
    address = builder.bitcast(builder.gep(words, [word_constant(place)]), form.as_pointer())
    is_read_later = isinstance(form, ir.Aggregate) and isinstance(builder, FoldingBuilder)
    value = StructInMemory(address) if is_read_later else builder.load(address)
    return value, place + _word_count(context, type_)


def write_prepared_entry(context, library, about) -> None:
    """Add the prepared entry of the kernel that `about` describes to its code library, if it returns nothing."""
    if about.restype != types.none:
        return
    module = context.create_module("ready")
    kernel = context.declare_function(module, about)
    entry = ir.Function(module, ENTRY_TYPE, about.llvm_cfunc_wrapper_name)
    builder = kernel_builder(entry.append_basic_block())
    values, place = [], 0
    for type_ in about.argtypes:
        value, place = _read(context, builder, entry.args[0], type_, place)
        values.append(value)
    status, _ = context.call_conv.call_function(builder, kernel, about.restype, about.argtypes, values)
    with builder.if_then(status.is_error):
        builder.store(status.excinfoptr, entry.args[1])
        builder.ret(status.code)
    builder.ret(STATUS_TYPE(0))
    library.add_ir_module(module)
