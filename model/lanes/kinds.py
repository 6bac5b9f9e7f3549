"""The kinds of numbers: lanes of floats, of complex numbers, and of truth values.

Compiled functions take ``RealLanes`` and ``Lanes`` (complex) as they take floats and complex
numbers, so that one source serves both. Code cannot branch on them: comparisons give
``MaskLanes``, by which ``select`` chooses. In memory they are rows of ``WIDTH`` floats, a complex
one two of them, the real part first.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import make_attribute_wrapper, models, register_model

__all__ = [
    "CHOICE",
    "FUSED",
    "LANES",
    "MASK",
    "REAL",
    "VECTOR",
    "WIDTH",
    "WORDS",
    "LanesType",
    "MaskLanesType",
    "Parts",
    "RealLanesType",
    "kind_of",
    "parts_of",
    "spread",
    "whole_of",
]

WIDTH = 8  #: scenarios side by side

VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)
WORDS = ir.VectorType(ir.IntType(64), WIDTH)
CHOICE = ir.VectorType(ir.IntType(1), WIDTH)
FUSED = ("contract",)  #: as in `compiled`: a product may be fused with a sum


class RealLanesType(types.Type):
    """Eight floats."""

    def __init__(self) -> None:
        super().__init__(name="RealLanes")


class LanesType(types.Type):
    """Eight complex numbers."""

    def __init__(self) -> None:
        super().__init__(name="Lanes")


class MaskLanesType(types.Type):
    """Eight truth values."""

    def __init__(self) -> None:
        super().__init__(name="MaskLanes")


REAL, LANES, MASK = RealLanesType(), LanesType(), MaskLanesType()


@register_model(RealLanesType)
class _RealModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, VECTOR)


@register_model(MaskLanesType)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, CHOICE)


@register_model(LanesType)
class _LanesModel(models.StructModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, [("real", REAL), ("imag", REAL)])


make_attribute_wrapper(LanesType, "real", "real")
make_attribute_wrapper(LanesType, "imag", "imag")

Parts = tuple[Any, Any]  #: vectors of the real and imaginary parts; no imaginary part: None


def spread(builder: Any, value: Any) -> Any:
    """A vector with one number in all lanes."""
    nothing = ir.Constant(VECTOR, ir.Undefined)
    first = builder.insert_element(nothing, value, ir.Constant(ir.IntType(32), 0))
    everywhere = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(first, nothing, everywhere)


def parts_of(context: Any, builder: Any, kind: Any, value: Any) -> Parts:
    """Real and imaginary part of a value, as code."""
    if isinstance(kind, RealLanesType):
        return value, None
    if isinstance(kind, LanesType):
        own = cgutils.create_struct_proxy(kind)(context, builder, value)
        return own.real, own.imag
    if isinstance(kind, types.Complex):
        own = context.make_complex(builder, kind, value)
        return spread(builder, own.real), spread(builder, own.imag)
    return spread(builder, value), None


def whole_of(context: Any, builder: Any, parts: Parts) -> Any:
    """The value that has these parts."""
    if parts[1] is None:
        return parts[0]
    own = cgutils.create_struct_proxy(LANES)(context, builder)
    own.real, own.imag = parts
    return own._getvalue()


def kind_of(kind: Any) -> Any:
    """The kind that an operator takes this one as; None: none of ours."""
    if isinstance(kind, RealLanesType | LanesType):
        return kind
    if isinstance(kind, types.Complex):
        return types.complex128
    return types.float64 if isinstance(kind, types.Float | types.Integer) else None
