"""Passing of large tuples between kernels by address.

The workspace of bodies that touch is a tuple of a hundred arrays, of seven words each. Numba passes each word as an
argument of its own, so that four in five instructions of such a step would only take this tuple apart or put it
together. Here a call passes one address, from which a kernel reads the members that it needs.
"""

from __future__ import annotations

import sys

from llvmlite import ir
from numba.core import types
from numba.core.datamodel.packer import ArgPacker, _flatten, _Unflattener

from physics.compiler.fused.ablation import is_on
from physics.compiler.fused.folding_builder import FoldingBuilder, StructInMemory, make_struct, stack_slot

# A tuple of more words than this is passed by its address.
FEW_WORDS = 64 if is_on("argument_passing") else sys.maxsize


class Arguments(ArgPacker):
    """Packer of the arguments of a call between kernels: as Numba's, but large tuples are passed by address.

    Parameters
    ----------
    models : numba.core.datamodel.DataModelManager
        Numba's models of data types.
    fe_args : sequence of numba.types.Type
        Types of the arguments.
    """

    def __init__(self, models, fe_args):
        # Numba's own constructor would take large tuples apart, too.
        self._fe_args, self._nargs = fe_args, len(fe_args)
        self._dm_args = [_argument_model(models.lookup(each)) for each in fe_args]
        self._addresses = [address for model in self._dm_args for address in _addresses_of(model)]
        words = [model.get_argument_type() for model in self._dm_args]
        self._unflattener = _Unflattener(words)
        self._be_args = list(_flatten(words))

    def assign_names(self, args, names):
        """Name the arguments of an LLVM function, and mark addresses of tuples as neither aliased nor null."""
        super().assign_names(args, names)
        for word in args:
            if isinstance(word.type, ir.PointerType) and word.type in self._addresses:
                for attribute in ("noalias", "nonnull"):
                    word.add_attribute(attribute)


# For each model of Numba, by its identity: the model itself, which is thereby kept alive, and the model of an argument.
_ARGUMENT_MODELS: dict[int, tuple] = {}


def _argument_model(model):
    """Model of an argument, cached: `_ByAddress` or `_ByMembers` for a model of a large tuple, else `model` itself."""
    known = _ARGUMENT_MODELS.get(id(model))
    if known is None:
        known = _ARGUMENT_MODELS[id(model)] = model, _choose_model(model) if _is_large(model) else model
    return known[1]


def _choose_model(model):
    return _ByMembers(model) if isinstance(model.fe_type, types.Tuple) else _ByAddress(model)


def _is_large(model) -> bool:
    if not isinstance(model.fe_type, types.BaseTuple):
        return False
    return sum(1 for _ in _flatten([model.get_argument_type()])) > FEW_WORDS


class _ByAddress:
    """Model of an argument for tuples that are passed by address."""

    def __init__(self, model):
        self._type = model.get_value_type()

    def get_argument_type(self) -> ir.Type:
        return self._type.as_pointer()

    def as_argument(self, builder, value):
        """Address to pass for a tuple: the tuple's own if it has one, else the address of a copy on the stack."""
        if isinstance(value, StructInMemory):
            return value.address
        address = stack_slot(builder, self._type)
        builder.store(value, address)
        return address

    def from_argument(self, builder, address):
        return StructInMemory(address) if isinstance(builder, FoldingBuilder) else builder.load(address)


class _ByMembers:
    """Model of an argument for tuples without names: each member is passed as if it were an argument itself.

    Such a tuple is made for a call. To pass its address, it would be written to memory first.
    """

    def __init__(self, model):
        self._type, self.members = model.get_value_type(), [_argument_model(each) for each in model._models]

    def get_argument_type(self) -> tuple:
        return tuple(each.get_argument_type() for each in self.members)

    def as_argument(self, builder, value):
        values = (builder.extract_value(value, k) for k in range(len(self.members)))
        return tuple(each.as_argument(builder, member) for each, member in zip(self.members, values, strict=True))

    def from_argument(self, builder, words):
        found = [each.from_argument(builder, word) for each, word in zip(self.members, words, strict=True)]
        return make_struct(builder, self._type, found)


def _addresses_of(model) -> list[ir.Type]:
    """Types of the addresses among the words of an argument with this model."""
    if isinstance(model, _ByMembers):
        return [address for each in model.members for address in _addresses_of(each)]
    return [model.get_argument_type()] if isinstance(model, _ByAddress) else []
