"""What compiled code does with lanes beside arithmetic: memory, choices, roots, products."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from . import operators as _operators  # noqa: F401
from .kinds import (
    CHOICE,
    LANES,
    MASK,
    REAL,
    VECTOR,
    WIDTH,
    WORDS,
    Parts,
    RealLanesType,
    kind_of,
    parts_of,
    spread,
    whole_of,
)

__all__ = [
    "bits_of",
    "joined",
    "larger",
    "load_real",
    "magnitude_of",
    "mask_of",
    "of_three",
    "of_two",
    "power_of_two",
    "rounded",
    "select",
    "smaller",
    "splat",
    "split_power",
    "square_root",
    "store_real",
]


def lane_code(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function that compiled code calls, given as what it becomes."""
    return cast("Callable[..., Any]", intrinsic(function))


@lane_code
def splat(typing: Any, value: Any) -> Any:
    """One float in all lanes."""

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return spread(builder, args[0])

    return REAL(types.float64), code


@lane_code
def joined(typing: Any, real: Any, imag: Any) -> Any:
    """The complex number of two parts, floats or lanes of them."""
    if isinstance(real, RealLanesType):

        def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            return whole_of(context, builder, (args[0], args[1]))

        return LANES(REAL, REAL), code

    def plain(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        own = context.make_complex(builder, types.complex128)
        own.real, own.imag = args
        return own._getvalue()

    return types.complex128(types.float64, types.float64), plain


def _fused(builder: Any, a: Any, b: Any, c: Any) -> Any:
    """``a b + c``, rounded once."""
    kind = a.type
    name = "llvm.fma.f64" if isinstance(kind, ir.DoubleType) else f"llvm.fma.v{WIDTH}f64"
    code = cgutils.get_or_insert_function(
        builder.module, ir.FunctionType(kind, [kind, kind, kind]), name
    )
    return builder.call(code, (a, b, c))


def _sum_of_products(builder: Any, pairs: Any) -> Parts:
    """Sum of complex products, all but the first product fused with the sum so far."""
    real = imag = None
    for a, b in pairs:
        for x, y in ((a[0], b[0]), (builder.fneg(a[1]) if a[1] is not None else None, b[1])):
            if x is not None and y is not None:
                real = builder.fmul(x, y) if real is None else _fused(builder, x, y, real)
        for x, y in ((a[0], b[1]), (a[1], b[0])):
            if x is not None and y is not None:
                imag = builder.fmul(x, y) if imag is None else _fused(builder, x, y, imag)
    return real, imag


def _plain_parts(context: Any, builder: Any, kind: Any, value: Any) -> Parts:
    """Of a scalar, not spread over lanes."""
    if isinstance(kind, types.Complex):
        own = context.make_complex(builder, kind, value)
        return own.real, own.imag
    return value, None


def _products(args: Any) -> Any:
    """Typing and code of the sum of products of pairs of arguments."""
    kinds = [kind_of(kind) for kind in args]
    wide = any(kind in (REAL, LANES) for kind in kinds)
    take = parts_of if wide else _plain_parts

    def code(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        parts = [take(context, builder, k, v) for k, v in zip(kinds, values, strict=True)]
        pairs = zip(parts[::2], parts[1::2], strict=True)
        found = _sum_of_products(builder, pairs)
        if wide:
            return whole_of(context, builder, found)
        own = context.make_complex(builder, types.complex128)
        own.real, own.imag = found
        return own._getvalue()

    plain = all(kind in (REAL, types.float64) for kind in kinds)
    out = (REAL if plain else LANES) if wide else types.complex128
    return out(*kinds), code


@lane_code
def of_three(typing: Any, a: Any, x: Any, b: Any, y: Any, c: Any, z: Any) -> Any:
    """``a x + b y + c z`` of complex numbers, scalars or lanes."""
    return _products((a, x, b, y, c, z))


@lane_code
def of_two(typing: Any, a: Any, x: Any, b: Any, y: Any) -> Any:
    """``a x + b y``."""
    return _products((a, x, b, y))


def _pointer(context: Any, builder: Any, kind: Any, array: Any, where: Any) -> Any:
    own = context.make_array(kind)(context, builder, array)
    indices = cgutils.unpack_tuple(builder, where, kind.ndim)
    place = cgutils.get_item_pointer(
        context, builder, kind, own, indices, wraparound=False, boundscheck=False
    )
    return builder.bitcast(place, VECTOR.as_pointer())


def _check(array: Any, where: Any) -> bool:
    fits = isinstance(array, types.Array) and array.dtype == types.float64 and array.layout == "C"
    return bool(fits and isinstance(where, types.UniTuple) and where.count == array.ndim)


@lane_code
def load_real(typing: Any, array: Any, where: Any) -> Any:
    """``WIDTH`` floats of an array, along its last axis, from the entry ``where`` on."""
    if not _check(array, where):
        return None

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.load(_pointer(context, builder, sig.args[0], *args), align=8)

    return REAL(array, types.UniTuple(types.intp, array.ndim)), code


@lane_code
def store_real(typing: Any, array: Any, where: Any, value: Any) -> Any:
    """Write them there."""
    if not _check(array, where):
        return None

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        place = _pointer(context, builder, sig.args[0], *args[:2])
        builder.store(args[2], place, align=8)
        return context.get_dummy_value()

    return types.void(array, types.UniTuple(types.intp, array.ndim), REAL), code


@lane_code
def select(typing: Any, mask: Any, one: Any, other: Any) -> Any:
    """``one`` in the lanes of ``mask``, ``other`` elsewhere."""
    kinds = [kind_of(one), kind_of(other)]
    plain = all(kind in (REAL, types.float64) for kind in kinds)

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        a, b = (parts_of(context, builder, k, v) for k, v in zip(kinds, args[1:], strict=True))
        real = builder.select(args[0], a[0], b[0])
        if plain:
            return real
        nothing = ir.Constant(VECTOR, [0.0] * WIDTH)
        imag = (nothing if part is None else part for part in (a[1], b[1]))
        return whole_of(context, builder, (real, builder.select(args[0], *imag)))

    return (REAL if plain else LANES)(MASK, *kinds), code


@lane_code
def larger(typing: Any, one: Any, other: Any) -> Any:
    """The larger of two in every lane."""

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.select(builder.fcmp_ordered(">", *args), *args)

    return REAL(REAL, REAL), code


@lane_code
def smaller(typing: Any, one: Any, other: Any) -> Any:
    """The smaller of two in every lane."""

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.select(builder.fcmp_ordered("<", *args), *args)

    return REAL(REAL, REAL), code


def _by_name(name: str) -> Callable[..., Any]:
    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        kind = ir.FunctionType(VECTOR, [VECTOR])
        full = f"{name}.v{WIDTH}f64"
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, full), args)

    return code


@lane_code
def square_root(typing: Any, value: Any) -> Any:
    """In every lane."""
    return REAL(REAL), _by_name("llvm.sqrt")


@lane_code
def rounded(typing: Any, value: Any) -> Any:
    """To the nearest whole number."""
    return REAL(REAL), _by_name("llvm.rint")


@lane_code
def magnitude_of(typing: Any, value: Any) -> Any:
    """Without the sign."""
    return REAL(REAL), _by_name("llvm.fabs")


def _word(value: int) -> Any:
    return ir.Constant(WORDS, [value] * WIDTH)


@lane_code
def power_of_two(typing: Any, value: Any) -> Any:
    """``2**value`` of whole numbers from -1022 to 1023."""

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        whole = builder.fptosi(args[0], WORDS)
        word = builder.shl(builder.add(whole, _word(1023)), _word(52))
        return builder.bitcast(word, VECTOR)

    return REAL(REAL), code


@lane_code
def split_power(typing: Any, value: Any) -> Any:
    """Positive numbers as ``m * 2**n``, m from 1 to 2: the tuple (m, n)."""

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        word = builder.bitcast(args[0], WORDS)
        whole = builder.sub(builder.lshr(word, _word(52)), _word(1023))
        tail = builder.or_(builder.and_(word, _word((1 << 52) - 1)), _word(1023 << 52))
        pair = builder.bitcast(tail, VECTOR), builder.sitofp(whole, VECTOR)
        return context.make_tuple(builder, sig.return_type, pair)

    return types.UniTuple(REAL, 2)(REAL), code


@lane_code
def bits_of(typing: Any, mask: Any) -> Any:
    """A mask as a number, bit 0 for the first lane."""

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.zext(builder.bitcast(args[0], ir.IntType(WIDTH)), ir.IntType(64))

    return types.int64(MASK), code


@lane_code
def mask_of(typing: Any, bits: Any) -> Any:
    """The mask of such a number."""

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.bitcast(builder.trunc(args[0], ir.IntType(WIDTH)), CHOICE)

    return MASK(types.int64), code
