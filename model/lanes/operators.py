"""Arithmetic and comparisons of lanes, with one another and with scalars."""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from numba.core import types
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin

from .kinds import (
    FUSED,
    LANES,
    MASK,
    REAL,
    LanesType,
    Parts,
    RealLanesType,
    kind_of,
    parts_of,
    whole_of,
)

__all__: list[str] = []  # what is here is known to the compiler by being imported


def _add(builder: Any, a: Parts, b: Parts) -> Parts:
    real = builder.fadd(a[0], b[0], flags=FUSED)
    if a[1] is None or b[1] is None:
        return real, a[1] if b[1] is None else b[1]
    return real, builder.fadd(a[1], b[1], flags=FUSED)


def _subtract(builder: Any, a: Parts, b: Parts) -> Parts:
    real = builder.fsub(a[0], b[0], flags=FUSED)
    if b[1] is None:
        return real, a[1]
    if a[1] is None:
        return real, builder.fneg(b[1])
    return real, builder.fsub(a[1], b[1], flags=FUSED)


def _multiply(builder: Any, a: Parts, b: Parts) -> Parts:
    def product(x: Any, y: Any) -> Any:
        return builder.fmul(x, y, flags=FUSED)

    if a[1] is None or b[1] is None:
        other = a[1] if b[1] is None else b[1]
        factor = b[0] if b[1] is None else a[0]
        return product(a[0], b[0]), None if other is None else product(other, factor)
    real = builder.fsub(product(a[0], b[0]), product(a[1], b[1]), flags=FUSED)
    return real, builder.fadd(product(a[0], b[1]), product(a[1], b[0]), flags=FUSED)


def _divide(builder: Any, a: Parts, b: Parts) -> Parts:
    imag = None if a[1] is None else builder.fdiv(a[1], b[0], flags=FUSED)
    return builder.fdiv(a[0], b[0], flags=FUSED), imag


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


def _register_arithmetic(op: Any, of: Callable[[Any, Parts, Parts], Parts]) -> None:
    class Typing(AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            if len(args) != 2 or not any(isinstance(a, RealLanesType | LanesType) for a in args):
                return None
            one, other = map(kind_of, args)
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
        one, other = (parts_of(context, builder, k, v) for k, v in zip(sig.args, args, strict=True))
        return whole_of(context, builder, of(builder, one, other))

    return lower


def _register_comparison(op: Any, sign: str) -> None:
    class Typing(AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            if len(args) != 2 or not any(isinstance(a, RealLanesType) for a in args):
                return None
            one, other = map(kind_of, args)
            if one not in (REAL, types.float64) or other not in (REAL, types.float64):
                return None
            return signature(MASK, one, other)

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        one, other = (parts_of(context, builder, k, v) for k, v in zip(sig.args, args, strict=True))
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
class _NegTyping(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        kind = args[0]
        return signature(kind, kind) if isinstance(kind, RealLanesType | LanesType) else None


def _lower_neg(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    real, imag = parts_of(context, builder, sig.args[0], args[0])
    turned = None if imag is None else builder.fneg(imag)
    return whole_of(context, builder, (builder.fneg(real), turned))


lower_builtin(operator.neg, REAL)(_lower_neg)
lower_builtin(operator.neg, LANES)(_lower_neg)


def _register_mask(op: Any, name: str) -> None:
    class Typing(AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            return signature(MASK, MASK, MASK) if args == (MASK, MASK) else None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return getattr(builder, name)(*args)

    infer_global(op)(Typing)
    lower_builtin(op, MASK, MASK)(lower)


_register_mask(operator.and_, "and_")
_register_mask(operator.or_, "or_")
