"""Lanes, four numbers at once, as an LLVM vector; `physics.compiler.simd` defines the meaning of each operation."""

from __future__ import annotations

import operator
from collections.abc import Callable
from functools import partial

from llvmlite import ir
from llvmlite.ir.instructions import InsertElement
from numba.core import cgutils, types, typing
from numba.core.typing.templates import AbstractTemplate, infer_global
from numba.extending import models as data_models
from numba.extending import register_model

from physics.compiler import simd
from physics.compiler.fused import array_elements
from physics.compiler.fused.ablation import is_on
from physics.compiler.fused.folding_builder import WORD, word_constant

_DOUBLE, _INDEX = ir.DoubleType(), ir.IntType(32)

NUMBER_SIZE = 8  # [bytes]


class LanesType(types.Type):
    """Numba type of `Lanes` of four floats."""

    def __init__(self):
        super().__init__("lanes")


class MaskType(types.Type):
    """Numba type of `Lanes` of four truth values."""

    def __init__(self):
        super().__init__("marks")


LANES, MASK = LanesType(), MaskType()


def _model_of(type_: type, one: ir.Type) -> None:
    """Register an LLVM vector of four values of type `one` as the form of values of the Numba type `type_`."""

    @register_model(type_)
    class Model(data_models.PrimitiveModel):
        def __init__(self, manager, type_):
            super().__init__(manager, type_, ir.VectorType(one, simd.LANE_COUNT))


_model_of(LanesType, _DOUBLE)
_model_of(MaskType, ir.IntType(1))


# --- types of results -----------------------------------------------------------------------------------------

_SUMS = {operator.add: "fadd", operator.sub: "fsub", operator.mul: "fmul", operator.truediv: "fdiv"}
_ORDERS = {operator.lt: "<", operator.le: "<=", operator.gt: ">", operator.ge: ">=", operator.eq: "=="}
_BOTH = {operator.and_: "and_", operator.or_: "or_"}
_OF_TWO = (simd.larger, simd.smaller)
_OF_ALL = (simd.lane_sum, simd.max_of_lanes, simd.min_of_lanes)
_OF_EACH = (operator.neg, abs, simd.lane_sqrt)
_ROWS = (simd.load_lanes, simd.store_lanes)
_NAMED = (
    simd.Lanes,
    simd.lane_sqrt,
    simd.select_lanes,
    simd.first_true_lane,
    simd.lane_sums,
    *_OF_TWO,
    *_OF_ALL,
    *_ROWS,
)


def _are_numbers(args) -> bool:
    return all(isinstance(each, types.Number) for each in args)


def _are_lanes(args) -> bool:
    """True if these types are lanes and numbers, with lanes at least once."""
    return LANES in args and all(each is LANES or isinstance(each, types.Number) for each in args)


def _is_place_of_row(args) -> bool:
    """True if these types are a contiguous table of floats and two integers, row and column."""
    return (
        isinstance(args[0], types.Array)
        and (args[0].dtype, args[0].ndim, args[0].layout) == (types.float64, 2, "C")
        and all(isinstance(each, types.Integer) for each in args[1:])
    )


def _result(key, args) -> types.Type | None:
    """Type of the result of the operation `key` for types `args`; None if it is no operation on lanes."""
    if key is simd.Lanes:
        return LANES if len(args) == simd.LANE_COUNT and _are_numbers(args) else None
    if key is simd.select_lanes and args[0] is types.boolean:
        return types.float64 if _are_numbers(args[1:]) else None
    if key is simd.select_lanes:
        return LANES if args[0] is MASK and (_are_lanes(args[1:]) or _are_numbers(args[1:])) else None
    if key is simd.first_true_lane or key is operator.invert:
        return (types.intp if key is simd.first_true_lane else MASK) if args == (MASK,) else None
    if key in _BOTH:
        return MASK if args == (MASK, MASK) else None
    if key in _ROWS:
        result = LANES if key is simd.load_lanes else types.none
        return result if _is_place_of_row(args[:3]) and _are_lanes((LANES, *args[3:])) else None
    if (key is simd.lane_sqrt or key in _OF_TWO) and _are_numbers(args):
        return types.float64
    if key is simd.lane_sums:
        return LANES if len(args) == simd.LANE_COUNT and _are_lanes((LANES, *args)) else None
    if not _are_lanes(args[:2]):
        return None
    if key is operator.getitem or key in _OF_ALL:
        return types.float64
    if key in _ORDERS:
        return MASK
    return LANES if key in _SUMS or key in _OF_TWO or key in _OF_EACH else None


def signature(key, context, args) -> typing.Signature | None:
    """Signature of the operation `key` for types `args`; None if it is no operation on lanes."""
    args = tuple(map(types.unliteral, args))
    result = _result(key, args)
    if result is None:
        return None
    number = types.intp if key is operator.getitem else types.float64
    if key in _ROWS:
        return typing.signature(result, args[0], types.intp, types.intp, *args[3:])
    return typing.signature(result, *(number if isinstance(each, types.Number) else each for each in args))


class _Named(AbstractTemplate):
    """Numba template of a function of `simd` that kernels call by name; `signature` gives its types."""

    def generic(self, args, kws):
        return signature(self.key, self.context, args)


for _function in _NAMED:
    infer_global(_function)(type(f"Of_{_function.__name__}", (_Named,), {"key": _function}))


# --- lowering -------------------------------------------------------------------------------------------------


def _spread(builder, value):
    """Repeat a number four times, as lanes; return lanes unchanged."""
    if isinstance(value.type, ir.VectorType):
        return value
    nothing = ir.Constant(ir.VectorType(value.type, simd.LANE_COUNT), ir.Undefined)
    first = builder.insert_element(nothing, value, _INDEX(0))
    return builder.shuffle_vector(
        first, nothing, ir.Constant(ir.VectorType(_INDEX, simd.LANE_COUNT), [0] * simd.LANE_COUNT)
    )


def _alike(builder, values) -> list:
    """Convert all values to lanes if one of them is lanes; else return them unchanged."""
    has_lanes = any(isinstance(each.type, ir.VectorType) for each in values)
    return [_spread(builder, each) for each in values] if has_lanes else list(values)


def _make(context, builder, sig, args):
    """Lower `Lanes(a, b, c, d)`: put four numbers into a vector."""
    made = ir.Constant(context.get_value_type(LANES), ir.Undefined)
    for k, value in enumerate(args):
        made = builder.insert_element(made, value, _INDEX(k))
    return made


def _compute(name, context, builder, sig, args):
    return getattr(builder, name)(*_alike(builder, args))


def _compare(order, context, builder, sig, args):
    return builder.fcmp_ordered(order, *_alike(builder, args))


def _choose(context, builder, sig, args):
    if sig.args[0] is types.boolean:
        return builder.select(context.cast(builder, args[0], types.boolean, types.boolean), *args[1:])
    return builder.select(*_alike(builder, args))


def _one_of_two(order, context, builder, sig, args):
    """Lower `larger` (`order` is ``>``) or `smaller` (``<``) of two lanes or numbers."""
    x, y = _alike(builder, args)
    return builder.select(builder.fcmp_ordered(order, y, x), y, x)


def _negate(context, builder, sig, args):
    return builder.fneg(args[0])


def _not(context, builder, sig, args):
    return builder.not_(args[0])


def _call(name, context, builder, sig, args):
    """Lower an operation to LLVM's function `name`, such as ``sqrt``, for lanes or for a number."""
    type_ = args[0].type
    width = f"v{simd.LANE_COUNT}" if isinstance(type_, ir.VectorType) else ""
    function = cgutils.get_or_insert_function(
        builder.module, ir.FunctionType(type_, [type_]), f"llvm.{name}.{width}f64"
    )
    return builder.call(function, args)


def _place_of_row(context, builder, sig, args):
    """Pointer to four neighbouring numbers of a table, from table[row, column] on."""
    if context.enable_boundscheck:
        array_elements.element_pointer(
            context, builder, sig.args[0], args[0], sig.args[1:3], [args[1], _last(builder, args[2])]
        )
    place = array_elements.element_pointer(context, builder, sig.args[0], args[0], sig.args[1:3], args[1:3])
    return builder.bitcast(place, context.get_value_type(LANES).as_pointer())


def _last(builder, first):
    """Column of the last of four numbers that begin at column `first`."""
    return builder.add(first, word_constant(simd.LANE_COUNT - 1))


def _read_row(context, builder, sig, args):
    """Lower `load_lanes`, without assuming an address divisible by 32: a table may begin at any number."""
    return builder.load(_place_of_row(context, builder, sig, args), align=NUMBER_SIZE)


def _write_row(context, builder, sig, args):
    """Lower `store_lanes`: write four neighbouring numbers of a table, at an address divisible by 8 only."""
    builder.store(_spread(builder, args[3]), _place_of_row(context, builder, sig, args), align=NUMBER_SIZE)
    return context.get_dummy_value()


def _totals(context, builder, sig, args):
    """Lower `lane_sums`: add the halves of two vectors at a time, then the halves of the results."""
    a, b, c, d = (_spread(builder, each) for each in args)

    def joined(x, y, first, second):
        parts = [
            builder.shuffle_vector(x, y, ir.Constant(ir.VectorType(_INDEX, simd.LANE_COUNT), which))
            for which in (first, second)
        ]
        return builder.fadd(*parts)

    x, y = joined(a, b, (0, 1, 4, 5), (2, 3, 6, 7)), joined(c, d, (0, 1, 4, 5), (2, 3, 6, 7))
    return joined(x, y, (0, 2, 4, 6), (1, 3, 5, 7))


def _halves(builder, value, join: Callable):
    """Combine all four lanes of a value to one number: `join` combines both halves, then the two lanes that remain."""
    for width in (2, 1):
        nothing = ir.Constant(value.type, ir.Undefined)
        parts = [
            builder.shuffle_vector(
                value, nothing, ir.Constant(ir.VectorType(_INDEX, width), [k + start for k in range(width)])
            )
            for start in (0, width)
        ]
        value = join(*parts)
    return builder.extract_element(value, _INDEX(0))


def _total(context, builder, sig, args):
    return _halves(builder, args[0], builder.fadd)


def _extreme(order, context, builder, sig, args):
    """Lower `max_of_lanes` (`order` is ``>``) or `min_of_lanes` (``<``)."""
    return _halves(builder, args[0], lambda x, y: builder.select(builder.fcmp_ordered(order, y, x), y, x))


def _first(context, builder, sig, args):
    """Lower `first_true_lane`: the four truth values become the bits of a number, whose trailing zeros are counted."""
    bits = builder.bitcast(args[0], ir.IntType(simd.LANE_COUNT))
    place = builder.cttz(builder.zext(bits, WORD), ir.IntType(1)(0))
    return builder.select(builder.icmp_unsigned("==", bits, bits.type(0)), word_constant(-1), place)


def _read(context, builder, sig, args):
    """Lower `x[k]`, one number of lanes."""
    return builder.extract_element(args[0], args[1])


def _lane(builder, value, k: int):
    """Lane number `k` of a value: the number that was inserted there if it is known, else read by an instruction."""
    made = value
    while isinstance(made, InsertElement):
        made, number, place = made.operands
        if place.constant == k:
            return number
    return builder.extract_element(value, _INDEX(k))


def _each_lane(lower: Callable, context, builder, sig, args):
    """Lower an operation on lanes as four operations on numbers, used if the optimisation `simd_types` is off.

    `lower` lowers the operation on numbers.
    """
    if sig.return_type not in (LANES, MASK):
        return lower(context, builder, sig, args)
    made = ir.Constant(context.get_value_type(sig.return_type), ir.Undefined)
    for k in range(simd.LANE_COUNT):
        numbers = [_lane(builder, each, k) if isinstance(each.type, ir.VectorType) else each for each in args]
        made = builder.insert_element(made, lower(context, builder, sig, numbers), _INDEX(k))
    return made


_OF_EACH_LANE = {
    simd.select_lanes: _choose,
    simd.lane_sqrt: partial(_call, "sqrt"),
    simd.larger: partial(_one_of_two, ">"),
    simd.smaller: partial(_one_of_two, "<"),
    abs: partial(_call, "fabs"),
    operator.neg: _negate,
    operator.invert: _not,
    **{key: partial(_compute, name) for key, name in (_SUMS | _BOTH).items()},
    **{key: partial(_compare, order) for key, order in _ORDERS.items()},
}
_LOWERINGS = {
    simd.Lanes: _make,
    simd.first_true_lane: _first,
    simd.load_lanes: _read_row,
    simd.store_lanes: _write_row,
    simd.lane_sums: _totals,
    simd.lane_sum: _total,
    simd.max_of_lanes: partial(_extreme, ">"),
    simd.min_of_lanes: partial(_extreme, "<"),
    operator.getitem: _read,
    **{key: lower if is_on("simd_types") else partial(_each_lane, lower) for key, lower in _OF_EACH_LANE.items()},
}


def lowering(key, sig: typing.Signature) -> Callable | None:
    """Return the function that lowers the operation `key` if it is one on lanes, else None."""
    is_ours = key in _NAMED or LANES in sig.args or MASK in sig.args
    return _LOWERINGS.get(key) if is_ours else None
