"""Builders of a kernel's LLVM instructions, which leave out instructions whose results are known.

In Numba many values are structures; an array has seven words. Numba inserts words into them and extracts others, and
leaves it to LLVM to find that nothing is computed. Most of the compile time of a kernel would go into writing, reading
and removing such instructions.
"""

from __future__ import annotations

from llvmlite import ir
from numba.core import cgutils

from physics.compiler.fused.ablation import is_on

WORD = ir.IntType(64)
NO_SIGNED_WRAP = ("nsw",)  # LLVM's promise that a result fits into a word, as all indices and numbers of ranges do


def _position(indices) -> tuple[int, ...]:
    return (indices,) if isinstance(indices, int) else tuple(indices)


class StructInMemory:
    """Structure in read-only memory, whose members are read only when they are needed.

    Parameters
    ----------
    address : llvmlite.ir.Value
        Pointer to the structure.
    """

    def __init__(self, address):
        self.address = address
        self.type = address.type.pointee
        self._members: dict[int, StructInMemory | ir.Value] = {}

    def member(self, builder: ir.IRBuilder, k: int):
        """Return member number `k`: an LLVM value that is read at the entry of the function, or a `StructInMemory`."""
        if k not in self._members:
            with builder.goto_entry_block():
                address = builder.gep(self.address, [ir.Constant(ir.IntType(32), n) for n in (0, k)], inbounds=True)
                is_word = not isinstance(address.type.pointee, ir.Aggregate)
                self._members[k] = builder.load(address) if is_word else StructInMemory(address)
        return self._members[k]

    def read(self, builder: ir.IRBuilder):
        """Read the whole structure as one LLVM value."""
        return ir.IRBuilder.load(builder, self.address)


def member_type(type_: ir.Type, k: int) -> ir.Type:
    """LLVM type of member number `k` of a structure of this type."""
    return type_.gep(ir.Constant(ir.IntType(32), k))


class StructByMembers:
    """Structure known by its members; it becomes one LLVM value only where the whole is needed.

    Parameters
    ----------
    type_ : llvmlite.ir.Type
        Type of the structure.
    members : sequence
        A value or structure for each member; None for an undefined member.
    """

    def __init__(self, type_: ir.Type, members):
        self.type = type_
        self._members = tuple(members)

    def member(self, builder: ir.IRBuilder, k: int):
        """Return member number `k`, as an LLVM value or a structure."""
        return ir.Constant(member_type(self.type, k), ir.Undefined) if self._members[k] is None else self._members[k]

    def changed(self, builder: ir.IRBuilder, value, position: tuple[int, ...]):
        """Copy of the structure in which the member at `position` is `value`; `position` may lead into a member."""
        k, *within = position
        if within:
            value = builder.insert_value(self.member(builder, k), value, within)
        return StructByMembers(self.type, (*self._members[:k], value, *self._members[k + 1 :]))

    def read(self, builder: ir.IRBuilder):
        """Build the whole structure as one LLVM value."""
        members = [_as_value(builder, self.member(builder, k)) for k in range(len(self._members))]
        whole = ir.Constant(self.type, [m if _is_constant(m) else ir.Constant(m.type, ir.Undefined) for m in members])
        for k, member in enumerate(members):
            if not _is_constant(member):
                whole = ir.IRBuilder.insert_value(builder, whole, member, k)
        return whole


def make_struct(builder: ir.IRBuilder, type_: ir.Type, members):
    """Make a structure of these members: a `StructByMembers` for a `FoldingBuilder`, else an LLVM value."""
    structure = StructByMembers(type_, members)
    return structure if isinstance(builder, FoldingBuilder) else structure.read(builder)


def _is_constant(value) -> bool:
    return isinstance(value, ir.Constant)


def _split_constant(value):
    """Constant structure as `StructByMembers`; any other value unchanged."""
    if not _is_constant(value) or not isinstance(value.type, ir.Aggregate):
        return value
    known = value.constant if isinstance(value.constant, (list, tuple)) else None
    if known is None and value.constant is not ir.Undefined:
        return value
    return StructByMembers(value.type, known or [None] * len(value.type))


class KernelBuilder(ir.IRBuilder):
    """LLVM's builder of instructions, which rounds a product in a sum together with the sum (`fused_multiply_add`)."""

    if is_on("fused_products"):

        def fadd(self, lhs, rhs, name="", flags=()):
            """Write the sum of two floats or lanes; if one is a product it is fused, and of two products the second."""
            left, right = _factors(lhs), _factors(rhs)
            if right:
                return fused_multiply_add(self, *right, lhs)
            return fused_multiply_add(self, *left, rhs) if left else super().fadd(lhs, rhs, name, flags)

        def fsub(self, lhs, rhs, name="", flags=()):
            """Write the difference of two floats or lanes; a single product in it is fused.

            Of two products none is fused, so that the difference of equal products is exactly 0.
            """
            left, right = _factors(lhs), _factors(rhs)
            if bool(left) == bool(right):
                return super().fsub(lhs, rhs, name, flags)
            return (
                fused_multiply_add(self, self.fneg(right[0]), right[1], lhs)
                if right
                else fused_multiply_add(self, *left, self.fneg(rhs))
            )


class FoldingBuilder(KernelBuilder):
    """`KernelBuilder` that knows structures by their members, and computes with constants while it writes."""

    def extract_value(self, agg, idx, name=""):
        """Read a member of a structure: return the inserted value if it is known, else emit an instruction."""
        position = _position(idx)
        agg = _split_constant(agg)
        while position and isinstance(agg, (StructInMemory, StructByMembers)):
            agg, position = _split_constant(agg.member(self, position[0])), position[1:]
        return super().extract_value(agg, position, name) if position else agg

    def insert_value(self, agg, value, idx, name=""):
        """Copy of a structure in which the member at `idx` is `value`."""
        agg = _split_constant(agg)
        if isinstance(agg, StructByMembers):
            return agg.changed(self, value, _position(idx))
        return super().insert_value(_as_value(self, agg), _as_value(self, value), _position(idx), name)

    def store(self, value, ptr, align=None):
        """Write the instruction that stores a value, possibly a structure, at the address `ptr`."""
        return super().store(_as_value(self, value), ptr, align)

    def call(self, fn, args, *more, **named):
        """Write the instruction that calls the LLVM function `fn` with the values `args`."""
        return super().call(fn, [_as_value(self, each) for each in args], *more, **named)

    def select(self, cond, lhs, rhs, *more, **named):
        """Write the instruction that chooses `lhs` if `cond` is true, else `rhs`."""
        return super().select(cond, _as_value(self, lhs), _as_value(self, rhs), *more, **named)

    def ret(self, value):
        """Write the instruction that returns a value from the function."""
        return super().ret(_as_value(self, value))

    def mul(self, lhs, rhs, name="", flags=()):
        """Return the product of two integers: a known value if both are constants or one is 1, else an instruction."""
        if _is(lhs, 1):
            return rhs
        if _is(rhs, 1):
            return lhs
        if _is_number(lhs) and _is_number(rhs):
            return ir.Constant(lhs.type, lhs.constant * rhs.constant)
        return super().mul(lhs, rhs, name, flags)

    def add(self, lhs, rhs, name="", flags=()):
        """Return the sum of two integers: a known value if both are constants or one is 0, else an instruction."""
        if _is(lhs, 0):
            return rhs
        if _is(rhs, 0):
            return lhs
        if _is_number(lhs) and _is_number(rhs):
            return ir.Constant(lhs.type, lhs.constant + rhs.constant)
        return super().add(lhs, rhs, name, flags)


def kernel_builder(block: ir.Block) -> KernelBuilder:
    """Make the builder of a kernel's instructions, which writes at the end of a block."""
    return FoldingBuilder(block) if is_on("folding_builder") else KernelBuilder(block)


def _factors(value) -> tuple:
    """Factors of a value that is a product of 64-bit floats or lanes; an empty tuple for other values."""
    is_product = isinstance(value, ir.Instruction) and value.opname == "fmul"
    return tuple(value.operands) if is_product and value.type != ir.FloatType() else ()


def fused_multiply_add(builder, a, b, c):
    """Write a b + c, rounded once, for floats or lanes: an instruction with the same bits on every processor.

    LLVM could choose the instruction itself (its flag `contract`). But it would fuse in one kernel and not in another,
    depending on the rest of the kernel.
    """
    width = f"v{c.type.count}" if isinstance(c.type, ir.VectorType) else ""
    type_ = ir.FunctionType(c.type, [c.type] * 3)
    return builder.call(cgutils.get_or_insert_function(builder.module, type_, f"llvm.fma.{width}f64"), (a, b, c))


def _as_value(builder, value):
    return value.read(builder) if isinstance(value, (StructInMemory, StructByMembers)) else value


def _is_number(value) -> bool:
    return isinstance(value, ir.Constant) and isinstance(value.constant, int)


def _is(value, number: int) -> bool:
    return _is_number(value) and value.constant == number


def word_constant(value: int) -> ir.Constant:
    """LLVM constant of a 64-bit word."""
    return ir.Constant(WORD, value)


def known_integer(value):
    """Value of an LLVM integer constant; None for any other LLVM value."""
    return value.constant if _is_number(value) else None


def stack_slot(builder: ir.IRBuilder, type_: ir.Type):
    """Reserve uninitialised memory for a value of this type on the stack of the function; return its address."""
    with builder.goto_entry_block():
        return builder.alloca(type_)
