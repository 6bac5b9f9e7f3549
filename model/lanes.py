"""Eight scenarios side by side: numbers of compiled code that fill a processor's vector.

``RealLanes`` and ``Lanes`` (complex) are kinds of numbers that compiled functions take as they
take floats and complex numbers, so that one source serves both. Code cannot branch on them:
comparisons give ``MaskLanes``, by which ``select`` chooses. In memory they are rows of ``WIDTH``
floats, a complex one two of them, the real part first.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import (
    intrinsic,
    lower_builtin,
    make_attribute_wrapper,
    models,
    register_model,
)

__all__ = [
    "WIDTH",
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

WIDTH = 8  #: scenarios side by side

_VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)
_WORDS = ir.VectorType(ir.IntType(64), WIDTH)
_CHOICE = ir.VectorType(ir.IntType(1), WIDTH)
_FUSED = ("contract",)  #: as in `compiled`: a product may be fused with a sum


class RealLanesType(types.Type):  # type: ignore[misc]
    """Eight floats."""

    def __init__(self) -> None:
        super().__init__(name="RealLanes")


class LanesType(types.Type):  # type: ignore[misc]
    """Eight complex numbers."""

    def __init__(self) -> None:
        super().__init__(name="Lanes")


class MaskLanesType(types.Type):  # type: ignore[misc]
    """Eight truth values."""

    def __init__(self) -> None:
        super().__init__(name="MaskLanes")


REAL, LANES, MASK = RealLanesType(), LanesType(), MaskLanesType()


@register_model(RealLanesType)
class _RealModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)


@register_model(MaskLanesType)
class _MaskModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _CHOICE)


@register_model(LanesType)
class _LanesModel(models.StructModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, [("real", REAL), ("imag", REAL)])


make_attribute_wrapper(LanesType, "real", "real")
make_attribute_wrapper(LanesType, "imag", "imag")

Parts = tuple[Any, Any]  #: vectors of the real and imaginary parts; no imaginary part: None


def _fill(builder: Any, value: Any) -> Any:
    """A vector with one number in all lanes."""
    nothing = ir.Constant(_VECTOR, ir.Undefined)
    first = builder.insert_element(nothing, value, ir.Constant(ir.IntType(32), 0))
    everywhere = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(first, nothing, everywhere)


def _parts(context: Any, builder: Any, kind: Any, value: Any) -> Parts:
    if isinstance(kind, RealLanesType):
        return value, None
    if isinstance(kind, LanesType):
        own = cgutils.create_struct_proxy(kind)(context, builder, value)
        return own.real, own.imag
    if isinstance(kind, types.Complex):
        own = context.make_complex(builder, kind, value)
        return _fill(builder, own.real), _fill(builder, own.imag)
    return _fill(builder, value), None


def _whole(context: Any, builder: Any, parts: Parts) -> Any:
    if parts[1] is None:
        return parts[0]
    own = cgutils.create_struct_proxy(LANES)(context, builder)
    own.real, own.imag = parts
    return own._getvalue()


def _add(builder: Any, a: Parts, b: Parts) -> Parts:
    real = builder.fadd(a[0], b[0], flags=_FUSED)
    if a[1] is None or b[1] is None:
        return real, a[1] if b[1] is None else b[1]
    return real, builder.fadd(a[1], b[1], flags=_FUSED)


def _subtract(builder: Any, a: Parts, b: Parts) -> Parts:
    real = builder.fsub(a[0], b[0], flags=_FUSED)
    if b[1] is None:
        return real, a[1]
    if a[1] is None:
        return real, builder.fneg(b[1])
    return real, builder.fsub(a[1], b[1], flags=_FUSED)


def _multiply(builder: Any, a: Parts, b: Parts) -> Parts:
    def product(x: Any, y: Any) -> Any:
        return builder.fmul(x, y, flags=_FUSED)

    if a[1] is None or b[1] is None:
        other = a[1] if b[1] is None else b[1]
        factor = b[0] if b[1] is None else a[0]
        return product(a[0], b[0]), None if other is None else product(other, factor)
    real = builder.fsub(product(a[0], b[0]), product(a[1], b[1]), flags=_FUSED)
    return real, builder.fadd(product(a[0], b[1]), product(a[1], b[0]), flags=_FUSED)


def _divide(builder: Any, a: Parts, b: Parts) -> Parts:
    imag = None if a[1] is None else builder.fdiv(a[1], b[0], flags=_FUSED)
    return builder.fdiv(a[0], b[0], flags=_FUSED), imag


_SCALARS = (types.float64, types.complex128)
_PAIRS = [
    *((one, other) for one in (REAL, LANES) for other in (REAL, LANES, *_SCALARS)),
    *((one, other) for one in _SCALARS for other in (REAL, LANES)),
]
_ARITHMETIC: dict[Any, Callable[[Any, Parts, Parts], Parts]] = {
    operator.add: _add,
    operator.iadd: _add,
    operator.sub: _subtract,
    operator.isub: _subtract,
    operator.mul: _multiply,
    operator.imul: _multiply,
    operator.truediv: _divide,
}
_COMPARED = {
    operator.lt: "<",
    operator.le: "<=",
    operator.gt: ">",
    operator.ge: ">=",
    operator.eq: "==",
    operator.ne: "!=",
}


def _own(kind: Any) -> Any:
    """The kind that an operator takes this one as; None: none of ours."""
    if isinstance(kind, RealLanesType | LanesType):
        return kind
    if isinstance(kind, types.Complex):
        return types.complex128
    return types.float64 if isinstance(kind, types.Float | types.Integer) else None


def _register_arithmetic(op: Any, of: Callable[[Any, Parts, Parts], Parts]) -> None:
    class Typing(AbstractTemplate):  # type: ignore[misc]
        def generic(self, args: Any, kws: Any) -> Any:
            if len(args) != 2 or not any(isinstance(a, RealLanesType | LanesType) for a in args):
                return None
            one, other = map(_own, args)
            if one is None or other is None:
                return None
            plain = one in (REAL, types.float64) and other in (REAL, types.float64)
            if op is operator.truediv and other not in (REAL, types.float64):
                return None
            return signature(REAL if plain else LANES, one, other)

    infer_global(op)(Typing)
    for pair in _PAIRS:
        lower_builtin(op, *pair)(_lowered(of))


def _lowered(of: Callable[[Any, Parts, Parts], Parts]) -> Callable[..., Any]:
    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        one, other = (_parts(context, builder, k, v) for k, v in zip(sig.args, args, strict=True))
        return _whole(context, builder, of(builder, one, other))

    return lower


def _register_comparison(op: Any, sign: str) -> None:
    class Typing(AbstractTemplate):  # type: ignore[misc]
        def generic(self, args: Any, kws: Any) -> Any:
            if len(args) != 2 or not any(isinstance(a, RealLanesType) for a in args):
                return None
            one, other = map(_own, args)
            if one not in (REAL, types.float64) or other not in (REAL, types.float64):
                return None
            return signature(MASK, one, other)

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        one, other = (_parts(context, builder, k, v) for k, v in zip(sig.args, args, strict=True))
        compare = builder.fcmp_unordered if sign == "!=" else builder.fcmp_ordered
        return compare(sign, one[0], other[0])

    infer_global(op)(Typing)
    for pair in ((REAL, REAL), (REAL, types.float64), (types.float64, REAL)):
        lower_builtin(op, *pair)(lower)


for _op, _of in _ARITHMETIC.items():
    _register_arithmetic(_op, _of)
for _op, _sign in _COMPARED.items():
    _register_comparison(_op, _sign)


@infer_global(operator.neg)
class _NegTyping(AbstractTemplate):  # type: ignore[misc]
    def generic(self, args: Any, kws: Any) -> Any:
        kind = args[0]
        return signature(kind, kind) if isinstance(kind, RealLanesType | LanesType) else None


def _lower_neg(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    real, imag = _parts(context, builder, sig.args[0], args[0])
    turned = None if imag is None else builder.fneg(imag)
    return _whole(context, builder, (builder.fneg(real), turned))


lower_builtin(operator.neg, REAL)(_lower_neg)
lower_builtin(operator.neg, LANES)(_lower_neg)


def _register_mask(op: Any, name: str) -> None:
    class Typing(AbstractTemplate):  # type: ignore[misc]
        def generic(self, args: Any, kws: Any) -> Any:
            return signature(MASK, MASK, MASK) if args == (MASK, MASK) else None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return getattr(builder, name)(*args)

    infer_global(op)(Typing)
    lower_builtin(op, MASK, MASK)(lower)


_register_mask(operator.and_, "and_")
_register_mask(operator.or_, "or_")


@intrinsic  # type: ignore[untyped-decorator]
def splat(typing: Any, value: Any) -> Any:
    """One float in all lanes."""

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return _fill(builder, args[0])

    return REAL(types.float64), code


@intrinsic  # type: ignore[untyped-decorator]
def joined(typing: Any, real: Any, imag: Any) -> Any:
    """The complex number of two parts, floats or lanes of them."""
    if isinstance(real, RealLanesType):

        def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            return _whole(context, builder, (args[0], args[1]))

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
    kinds = [_own(kind) for kind in args]
    wide = any(kind in (REAL, LANES) for kind in kinds)
    take = _parts if wide else _plain_parts

    def code(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        parts = [take(context, builder, k, v) for k, v in zip(kinds, values, strict=True)]
        pairs = zip(parts[::2], parts[1::2], strict=True)
        found = _sum_of_products(builder, pairs)
        if wide:
            return _whole(context, builder, found)
        own = context.make_complex(builder, types.complex128)
        own.real, own.imag = found
        return own._getvalue()

    plain = all(kind in (REAL, types.float64) for kind in kinds)
    out = (REAL if plain else LANES) if wide else types.complex128
    return out(*kinds), code


@intrinsic  # type: ignore[untyped-decorator]
def of_three(typing: Any, a: Any, x: Any, b: Any, y: Any, c: Any, z: Any) -> Any:
    """``a x + b y + c z`` of complex numbers, scalars or lanes."""
    return _products((a, x, b, y, c, z))


@intrinsic  # type: ignore[untyped-decorator]
def of_two(typing: Any, a: Any, x: Any, b: Any, y: Any) -> Any:
    """``a x + b y``."""
    return _products((a, x, b, y))


def _pointer(context: Any, builder: Any, kind: Any, array: Any, where: Any) -> Any:
    own = context.make_array(kind)(context, builder, array)
    indices = cgutils.unpack_tuple(builder, where, kind.ndim)
    place = cgutils.get_item_pointer(
        context, builder, kind, own, indices, wraparound=False, boundscheck=False
    )
    return builder.bitcast(place, _VECTOR.as_pointer())


def _check(array: Any, where: Any) -> bool:
    fits = isinstance(array, types.Array) and array.dtype == types.float64 and array.layout == "C"
    return bool(fits and isinstance(where, types.UniTuple) and where.count == array.ndim)


@intrinsic  # type: ignore[untyped-decorator]
def load_real(typing: Any, array: Any, where: Any) -> Any:
    """``WIDTH`` floats of an array, along its last axis, from the entry ``where`` on."""
    if not _check(array, where):
        return None

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.load(_pointer(context, builder, sig.args[0], *args), align=8)

    return REAL(array, types.UniTuple(types.intp, array.ndim)), code


@intrinsic  # type: ignore[untyped-decorator]
def store_real(typing: Any, array: Any, where: Any, value: Any) -> Any:
    """Write them there."""
    if not _check(array, where):
        return None

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        place = _pointer(context, builder, sig.args[0], *args[:2])
        builder.store(args[2], place, align=8)
        return context.get_dummy_value()

    return types.void(array, types.UniTuple(types.intp, array.ndim), REAL), code


@intrinsic  # type: ignore[untyped-decorator]
def select(typing: Any, mask: Any, one: Any, other: Any) -> Any:
    """``one`` in the lanes of ``mask``, ``other`` elsewhere."""
    kinds = [_own(one), _own(other)]
    plain = all(kind in (REAL, types.float64) for kind in kinds)

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        a, b = (_parts(context, builder, k, v) for k, v in zip(kinds, args[1:], strict=True))
        real = builder.select(args[0], a[0], b[0])
        if plain:
            return real
        nothing = ir.Constant(_VECTOR, [0.0] * WIDTH)
        imag = (nothing if part is None else part for part in (a[1], b[1]))
        return _whole(context, builder, (real, builder.select(args[0], *imag)))

    return (REAL if plain else LANES)(MASK, *kinds), code


@intrinsic  # type: ignore[untyped-decorator]
def larger(typing: Any, one: Any, other: Any) -> Any:
    """The larger of two in every lane."""

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.select(builder.fcmp_ordered(">", *args), *args)

    return REAL(REAL, REAL), code


@intrinsic  # type: ignore[untyped-decorator]
def smaller(typing: Any, one: Any, other: Any) -> Any:
    """The smaller of two in every lane."""

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.select(builder.fcmp_ordered("<", *args), *args)

    return REAL(REAL, REAL), code


def _by_name(name: str) -> Callable[..., Any]:
    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        kind = ir.FunctionType(_VECTOR, [_VECTOR])
        full = f"{name}.v{WIDTH}f64"
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, full), args)

    return code


@intrinsic  # type: ignore[untyped-decorator]
def square_root(typing: Any, value: Any) -> Any:
    """In every lane."""
    return REAL(REAL), _by_name("llvm.sqrt")


@intrinsic  # type: ignore[untyped-decorator]
def rounded(typing: Any, value: Any) -> Any:
    """To the nearest whole number."""
    return REAL(REAL), _by_name("llvm.rint")


@intrinsic  # type: ignore[untyped-decorator]
def magnitude_of(typing: Any, value: Any) -> Any:
    """Without the sign."""
    return REAL(REAL), _by_name("llvm.fabs")


def _word(value: int) -> Any:
    return ir.Constant(_WORDS, [value] * WIDTH)


@intrinsic  # type: ignore[untyped-decorator]
def power_of_two(typing: Any, value: Any) -> Any:
    """``2**value`` of whole numbers from -1022 to 1023."""

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        whole = builder.fptosi(args[0], _WORDS)
        word = builder.shl(builder.add(whole, _word(1023)), _word(52))
        return builder.bitcast(word, _VECTOR)

    return REAL(REAL), code


@intrinsic  # type: ignore[untyped-decorator]
def split_power(typing: Any, value: Any) -> Any:
    """Positive numbers as ``m * 2**n``, m from 1 to 2: the tuple (m, n)."""

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        word = builder.bitcast(args[0], _WORDS)
        whole = builder.sub(builder.lshr(word, _word(52)), _word(1023))
        tail = builder.or_(builder.and_(word, _word((1 << 52) - 1)), _word(1023 << 52))
        pair = builder.bitcast(tail, _VECTOR), builder.sitofp(whole, _VECTOR)
        return context.make_tuple(builder, sig.return_type, pair)

    return types.UniTuple(REAL, 2)(REAL), code


@intrinsic  # type: ignore[untyped-decorator]
def bits_of(typing: Any, mask: Any) -> Any:
    """A mask as a number, bit 0 for the first lane."""

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.zext(builder.bitcast(args[0], ir.IntType(WIDTH)), ir.IntType(64))

    return types.int64(MASK), code


@intrinsic  # type: ignore[untyped-decorator]
def mask_of(typing: Any, bits: Any) -> Any:
    """The mask of such a number."""

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.bitcast(builder.trunc(args[0], ir.IntType(WIDTH)), _CHOICE)

    return MASK(types.int64), code
