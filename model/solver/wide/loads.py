"""What loads draw at the voltages across them, in lanes."""

from __future__ import annotations

from ...compiled import compiled, compiled_apart
from ...lanes.functions import bits_of, joined, larger, load_real, select, smaller, splat
from ...states import Tree
from ..assemble import Real
from .powers import power
from .work import ALL, Wide

__all__ = ["branch_admittance", "load_admittance"]


@compiled
def load_admittance(tree: Tree, wide: Wide, n: int, v_pu: float, floor_pu: float) -> complex:
    """Admittances of one winding or branch of load n at the voltages across it."""
    nominal = load_real(wide.load_scale, (n, 0)) * complex(tree.load_y_s[n])
    exponent = load_real(wide.exponent, (n, 0))
    by_law = bits_of(exponent < 0.0)
    if by_law == ALL:
        if tree.law_linear[n]:
            return nominal
        real, imag = law_factors(tree.law, wide.law_same[n], n, v_pu)
        return joined(nominal.real * real, nominal.imag * imag)
    if bits_of(exponent == 2.0) == ALL:
        return nominal
    factor = power(larger(v_pu, splat(floor_pu)), exponent - 2.0)
    if by_law == 0:
        return nominal * factor
    real = imag = splat(1.0)
    if not tree.law_linear[n]:
        real, imag = law_factors(tree.law, wide.law_same[n], n, v_pu)
    own = exponent < 0.0
    real, imag = select(own, real, factor), select(own, imag, factor)
    return joined(nominal.real * real, nominal.imag * imag)


@compiled
def branch_admittance(tree: Tree, wide: Wide, p: int, v_pu: float, floor_pu: float) -> complex:
    """Admittances of all loads of branch p; those of one exponent take its power once."""
    total = joined(splat(0.0), splat(0.0))
    held, last, factor = larger(v_pu, splat(floor_pu)), splat(2.0), splat(1.0)
    for at in range(tree.branch_first[p], tree.branch_first[p + 1]):
        n = tree.branch_load[at]
        exponent = load_real(wide.exponent, (n, 0))
        if bits_of(exponent < 0.0) != 0:
            total = total + load_admittance(tree, wide, n, v_pu, floor_pu)
            continue
        if bits_of(exponent == last) != ALL:
            factor, last = power(held, exponent - 2.0), exponent
        nominal = load_real(wide.load_scale, (n, 0)) * complex(tree.load_y_s[n])
        total = total + nominal * factor
    return total


@compiled_apart
def law_factors(law: Real, same: bool, n: int, v_pu: float) -> tuple[float, float]:
    """Conductance and susceptance over their nominal values, as ``assemble.law_factors``.

    ``same``: the law has the same for both.
    """
    least, most, low, beyond = law[n, 10], law[n, 11], law[n, 12], law[n, 13]
    v = smaller(larger(v_pu, splat(least)), splat(most))
    real = part_factor(law, n, 0, v)
    imag = real if same else part_factor(law, n, 5, v)
    under, over = v_pu < least, v_pu > most
    if beyond >= 0.0 and bits_of(under | over) != 0:
        real = select(under, splat(least ** (beyond - 2.0)), real)
        real = select(over, splat(most ** (beyond - 2.0)), real)
        imag = select(under, splat(least ** (beyond - 2.0)), imag)
        imag = select(over, splat(most ** (beyond - 2.0)), imag)
    if low > 0.0 and bits_of(under) != 0:
        part = (v_pu - low) / (least - low)
        real = select(under, (low + (least * real - low) * part) / v_pu, real)
        imag = select(under, (low + (least * imag - low) * part) / v_pu, imag)
        ended = v_pu <= low
        real, imag = select(ended, splat(1.0), real), select(ended, splat(1.0), imag)
    return real, imag


@compiled
def part_factor(law: Real, n: int, at: int, v: float) -> float:
    """Of the active (0) or reactive (5) part, within the limits."""
    over = 1.0 / v
    factor = law[n, at] + over * (law[n, at + 1] + over * law[n, at + 2])
    if law[n, at + 4] != 0.0:
        factor = factor + law[n, at + 4] * power(v, splat(law[n, at + 3] - 2.0))
    return factor
