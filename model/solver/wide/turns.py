"""What stands at the upper end of an edge, in lanes: voltages below it are T V."""

from __future__ import annotations

from ...compiled import compiled
from ...lanes.functions import load_real
from ...states import Tree
from ..matrix3 import IDENTITY, Matrix, Vector, load, product, times
from ..turns import transposed
from .rows import add_entry, in_lanes, load_matrix, store_matrix
from .work import Wide

__all__ = ["turn_edge", "turn_of", "turned"]

Row = tuple[Matrix, Matrix, Vector]  #: F, W and x of an edge


@compiled
def turned(tree: Tree, k: int) -> bool:
    """Whether anything does."""
    return bool(tree.regulator[k] >= 0 or tree.transformer[k] >= 0)


@compiled
def turn_of(tree: Tree, wide: Wide, k: int) -> Matrix:
    """T of what stands at the upper end of edge k, as ``turns.turn_of``."""
    row = tree.regulator[k]
    if row < 0:
        return in_lanes(load(tree.turn, tree.transformer[k]))
    t, reference = wide.turn, tree.reference
    store_matrix(t, 0, in_lanes(IDENTITY))
    for i in range(3):
        more = load_real(wide.ratio, (row, i, 0)) - 1.0
        add_entry(t, 0, 4 * i, more)
        if reference[row, i] >= 0:
            add_entry(t, 0, 3 * i + reference[row, i], -more)
    return load_matrix(t, 0)


@compiled
def turn_edge(tree: Tree, wide: Wide, k: int, below: Row) -> Row:
    """Put what stands at the upper end of edge k above the rest of it."""
    t = turn_of(tree, wide, k)
    f, w, x = below
    return product(f, t), product(transposed(t), product(w, t)), times(transposed(t), x)
