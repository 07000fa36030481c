"""Pass arguments of many words between kernels by address.

The scratch of many bodies is a tuple of a hundred arrays, seven words each. Numba passes each word as an argument of
its own. Four in five of all instructions written for a step of bodies took that tuple apart or put it together. Here a
call passes one address, from which a kernel reads the members that it needs.
"""

from __future__ import annotations

import sys

from llvmlite import ir
from numba.core import types
from numba.core.datamodel.packer import ArgPacker, _flatten, _Unflattener

from physics.compiler.fused.ablation import is_on
from physics.compiler.fused.folding_builder import FoldingBuilder, StructInMemory, stack_slot

# A tuple of more is handed on by its address.
FEW_WORDS = 64 if is_on("argument_passing") else sys.maxsize


class Arguments(ArgPacker):
    """Numba's arguments of a call, except large tuples.

    Parameters
    ----------
    models : numba.core.datamodel.DataModelManager
    fe_args : sequence of numba.types.Type
    """

    def __init__(self, models, fe_args):
        # Numba's own constructor would take large tuples apart, too.
        self._fe_args, self._nargs = fe_args, len(fe_args)
        self._dm_args = [_argument_model(models.lookup(each)) for each in fe_args]
        self._addresses = [model.get_argument_type() for model in self._dm_args if isinstance(model, _ByAddress)]
        words = [model.get_argument_type() for model in self._dm_args]
        self._unflattener = _Unflattener(words)
        self._be_args = list(_flatten(words))

    def assign_names(self, args, names):
        """Name the words, and mark addresses as read-only."""
        super().assign_names(args, names)
        for word in args:
            if isinstance(word.type, ir.PointerType) and word.type in self._addresses:
                for attribute in ("noalias", "nonnull"):
                    word.add_attribute(attribute)


# By the identity of a model of Numba's: the model itself, which so lives as long, and the one of an argument.
_ARGUMENT_MODELS: dict[int, tuple] = {}


def _argument_model(model):
    """`_ByAddress` for the model of a large tuple, any other model as it is; answers are cached."""
    known = _ARGUMENT_MODELS.get(id(model))
    if known is None:
        known = _ARGUMENT_MODELS[id(model)] = model, _ByAddress(model) if _is_large(model) else model
    return known[1]


def _is_large(model) -> bool:
    if not isinstance(model.fe_type, types.BaseTuple):
        return False
    return sum(1 for _ in _flatten([model.get_argument_type()])) > FEW_WORDS


class _ByAddress:
    """Model of a tuple argument that is passed as its address."""

    def __init__(self, model):
        self._type = model.get_value_type()

    def get_argument_type(self) -> ir.Type:
        return self._type.as_pointer()

    def as_argument(self, builder, value):
        """Address of a value: its present one if it was passed by address itself."""
        if isinstance(value, StructInMemory):
            return value.address
        address = stack_slot(builder, self._type)
        builder.store(value, address)
        return address

    def from_argument(self, builder, address):
        return StructInMemory(address) if isinstance(builder, FoldingBuilder) else builder.load(address)
