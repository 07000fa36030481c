"""What writes the instructions of a kernel: those that are known beforehand are left out.

Numba hands structures about (an array is one of seven words): puts a word in, takes another out, and leaves it to LLVM
to see that nothing happened. Writing that down, reading it and seeing it was most of the time a kernel took.
"""

from __future__ import annotations

from llvmlite import ir


def _position(indices) -> tuple[int, ...]:
    return (indices,) if isinstance(indices, int) else tuple(indices)


class Elsewhere:
    """A structure in memory that nobody changes while a function runs, of which nothing has been read yet.

    Parameters
    ----------
    address : llvmlite.ir.Value
        Pointer to it.
    """

    def __init__(self, address):
        self.address = address
        self.type = address.type.pointee
        self._members: dict[int, Elsewhere | ir.Value] = {}

    def member(self, builder: ir.IRBuilder, k: int):
        """A member: read at the entry of the function, once, unless it is a structure again."""
        if k not in self._members:
            with builder.goto_entry_block():
                address = builder.gep(self.address, [ir.Constant(ir.IntType(32), n) for n in (0, k)], inbounds=True)
                is_word = not isinstance(address.type.pointee, ir.Aggregate)
                self._members[k] = builder.load(address) if is_word else Elsewhere(address)
        return self._members[k]

    def read(self, builder: ir.IRBuilder):
        """All of it, as a value."""
        return ir.IRBuilder.load(builder, self.address)


class FoldingBuilder(ir.IRBuilder):
    """LLVM's builder for a structure's members, and for products and sums with nothing to compute."""

    def extract_value(self, agg, idx, name=""):
        """A member of a structure: the one that was put in, if that is known."""
        position = _position(idx)
        while isinstance(agg, Elsewhere):
            if not position:
                return agg
            agg, position = agg.member(self, position[0]), position[1:]
        if not position:
            return agg
        while isinstance(agg, ir.InsertValue):
            put = tuple(agg.indices)
            shared = min(len(put), len(position))
            if put[:shared] != position[:shared]:
                agg = agg.aggregate
            elif len(put) <= len(position):
                agg, position = agg.value, position[len(put) :]
                if not position:
                    return agg
            else:  # only part of what is asked for was put in
                break
        if isinstance(agg, ir.Constant) and isinstance(agg.constant, (list, tuple)):
            for k in position:
                if not isinstance(agg.constant, (list, tuple)):
                    break
                agg, position = agg.constant[k], position[1:]
            if not position:
                return agg
        return super().extract_value(agg, position, name)

    def insert_value(self, agg, value, idx, name=""):
        """A structure with one member changed."""
        position = _position(idx)
        agg, value = _as_value(self, agg), _as_value(self, value)
        known = isinstance(agg, ir.Constant) and isinstance(agg.constant, (list, tuple))
        if known and isinstance(value, ir.Constant) and len(position) == 1:
            members = list(agg.constant)
            members[position[0]] = value
            return ir.Constant(agg.type, members)
        return super().insert_value(agg, value, position, name)

    def store(self, value, ptr, align=None):
        """Write a value."""
        return super().store(_as_value(self, value), ptr, align)

    def mul(self, lhs, rhs, name="", flags=()):
        """Product of integers."""
        if _is(lhs, 1):
            return rhs
        if _is(rhs, 1):
            return lhs
        if _is_number(lhs) and _is_number(rhs):
            return ir.Constant(lhs.type, lhs.constant * rhs.constant)
        return super().mul(lhs, rhs, name, flags)

    def add(self, lhs, rhs, name="", flags=()):
        """Sum of integers."""
        if _is(lhs, 0):
            return rhs
        if _is(rhs, 0):
            return lhs
        if _is_number(lhs) and _is_number(rhs):
            return ir.Constant(lhs.type, lhs.constant + rhs.constant)
        return super().add(lhs, rhs, name, flags)


def _as_value(builder, value):
    return value.read(builder) if isinstance(value, Elsewhere) else value


def _is_number(value) -> bool:
    return isinstance(value, ir.Constant) and isinstance(value.constant, int)


def _is(value, number: int) -> bool:
    return _is_number(value) and value.constant == number


def constant_of(value):
    """The integer that a value is known to be, or None."""
    return value.constant if _is_number(value) else None


def slot(builder: ir.IRBuilder, type_: ir.Type):
    """Memory of a variable, for as long as its function runs; what is in it at first is not defined."""
    with builder.goto_entry_block():
        return builder.alloca(type_)
