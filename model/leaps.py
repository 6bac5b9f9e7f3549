"""Buses that nothing varies on, passed by in one leap: exactly, and only while nobody looks.

A chain of plain edges is four matrices between its two ends, whatever its lines are built like
and whatever constant shunts its buses have: capacitors, charging, twigs behind which nothing
hangs. An event there needs the buses, and gets them back for that scenario.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .network import Network
from .states import Probes, Tree

__all__ = ["why_solved", "with_leaps"]

Complex = NDArray[np.complex128]
Int = NDArray[np.int64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Chain:
    """Plain edges in a row."""

    end: int  #: the node below them
    above: int  #: the node above them
    inner: list[int]  #: nodes between, upwards
    matrices: Complex  #: (4, 3, 3) A, B, C, D


def with_leaps(network: Network, probes: Probes) -> Network:
    """The same network with every leap that ``probes`` allow; no others may be used with it.

    What is seen agrees with the network as it was to rounding.
    """
    tree = network.tree
    plain = _plain(tree, probes)
    bare = plain & ~_busy(tree, probes)
    dry, hung_s = _dry(tree, bare)
    passable = _passable(tree, plain, bare, dry)
    roots = _roots(tree, dry, passable)
    chains = _chains(tree, dry, passable, hung_s)
    twigs = [_twig(tree, k, hung_s[k]) for k in roots]
    passed, leap = _numbers(tree, dry, roots, chains)
    region_from, region_node = _regions(passed, leap, len(roots) + len(chains))
    above = [*tree.parent[roots], *(chain.above for chain in chains)]
    matrices = [*twigs, *(chain.matrices for chain in chains)]
    leaping = tree._replace(
        passed=passed,
        leap=leap,
        twigs=len(roots),
        leap_from=np.array(above, np.int64),
        leap_chain=np.array(matrices, np.complex128).reshape(-1, 4, 3, 3),
        region_from=region_from,
        region_node=region_node,
        lone_phase=_lone_phases(tree, chains),
    )
    return replace(network, tree=leaping)


def _plain(tree: Tree, probes: Probes) -> Flags:
    """(B,) edges that are a constant impedance and nothing else, at which nobody looks.

    Above a regulator the voltages are what its taps make of those below; loose modes depend on
    all that hangs below them; a loop leads elsewhere.
    """
    count = tree.parent.size
    plain = (tree.regulator[:count] < 0) & (tree.transformer[:count] < 0)
    plain &= ~tree.in_loop & (np.diff(tree.loose_from) == 0)
    plain[0] = False
    plain[probes.i_edge[probes.i_edge < count]] = False
    return np.asarray(plain)


def _busy(tree: Tree, probes: Probes) -> Flags:
    """(B,) nodes that somebody looks at, or with more on them than constant shunts."""
    busy = np.zeros(tree.parent.size, np.bool_)
    for nodes in (tree.unit_node, tree.branch_node, tree.fork, tree.tail, probes.v_node):
        busy[nodes] = True
    return busy


def _dry(tree: Tree, bare: Flags) -> tuple[Flags, Complex]:
    """(B,) the nodes of twigs; (B, 3, 3) each node's shunt with the twigs that hang on it."""
    dry, hung_s = bare.copy(), tree.shunt_s.copy()
    for k in range(dry.size - 1, 0, -1):
        parent = tree.parent[k]
        if dry[k]:
            hung_s[parent] += _seen_from_above(tree.z_ohm[k], hung_s[k])
        else:
            dry[parent] = False
    return dry, hung_s


def _seen_from_above(z_ohm: Complex, y_s: Complex) -> Complex:
    """``y_s`` behind a series impedance."""
    return np.asarray(y_s @ np.linalg.inv(np.eye(3) + z_ohm @ y_s))


def _passable(tree: Tree, plain: Flags, bare: Flags, dry: Flags) -> Flags:
    """(B,) bare nodes between two plain edges, besides which there are only twigs."""
    lower = np.flatnonzero(~dry)
    lower = lower[lower > 0]
    wet = np.bincount(tree.parent[lower], minlength=dry.size)
    passable = bare & (wet == 1)
    passable[tree.parent[lower[~plain[lower]]]] = False
    return np.asarray(passable)


def _roots(tree: Tree, dry: Flags, passable: Flags) -> Int:
    """The first node of every twig that hangs on a node which stays."""
    above = tree.parent
    return np.flatnonzero(dry & ~dry[above] & ~passable[above])


def _twig(tree: Tree, root: int, hung_s: Complex) -> Complex:
    """(4, 3, 3) of a twig, into which no current goes but its own."""
    one, none = np.eye(3), np.zeros((3, 3))
    return np.array([one, none, _seen_from_above(tree.z_ohm[root], hung_s), one])


def _chains(tree: Tree, dry: Flags, passable: Flags, hung_s: Complex) -> list[_Chain]:
    """Every chain, by its end node; each passable node is in one."""
    ends = np.flatnonzero(~dry & ~passable)
    return [_chain(tree, int(k), passable, hung_s) for k in ends if k and passable[tree.parent[k]]]


def _chain(tree: Tree, end: int, passable: Flags, hung_s: Complex) -> _Chain:
    """Climb from ``end`` to the first node that stays.

    From  V_up = A V + B I,  I_up = C V + D I  just below a node with the shunt Y, under an edge
    of the impedance Z, to the upper end of that edge:

        C += Y A,  D += Y B,  A += Z C,  B += Z D.

    Where an edge lacks a phase its Z is zero, no current flows and the voltage is carried on.
    """
    one = np.eye(3, dtype=np.complex128)
    a, b, c, d = one, tree.z_ohm[end], np.zeros_like(one), one
    inner: list[int] = []
    node = int(tree.parent[end])
    while passable[node]:
        inner.append(node)
        c, d = c + hung_s[node] @ a, d + hung_s[node] @ b
        a, b = a + tree.z_ohm[node] @ c, b + tree.z_ohm[node] @ d
        node = int(tree.parent[node])
    return _Chain(end=end, above=node, inner=inner, matrices=np.array([a, b, c, d]))


def _numbers(tree: Tree, dry: Flags, roots: Int, chains: list[_Chain]) -> tuple[Int, Int]:
    """(B,) the leap that passes each node by, and the leap that ends there; -1: none."""
    passed, leap = np.full((2, dry.size), -1, np.int64)
    passed[roots] = np.arange(roots.size)
    for q, chain in enumerate(chains, roots.size):
        passed[chain.inner] = q
        leap[chain.end] = q
    for k in np.flatnonzero(dry):  # parents first
        if passed[k] < 0:
            passed[k] = passed[tree.parent[k]]
    return passed, leap


def _regions(passed: Int, leap: Int, leaps: int) -> tuple[Int, Int]:
    """Where each leap's nodes start, and the nodes: what it passes by and its end."""
    of = np.maximum(passed, leap)
    nodes = np.flatnonzero(of >= 0)[::-1]
    region_node = nodes[np.argsort(of[nodes], kind="stable")]
    sizes = np.bincount(of[nodes], minlength=leaps)
    return np.concatenate([np.zeros(1, np.int64), np.cumsum(sizes)]), region_node


def _lone_phases(tree: Tree, chains: list[_Chain]) -> Int:
    """(B,) ``Tree.lone_phase``, -1 at the end of a chain that has more phases further up."""
    lone = tree.lone_phase.copy()
    for chain in chains:
        if np.any(tree.phases[chain.inner] != tree.phases[chain.end]):
            lone[chain.end] = -1
    return lone


def why_solved(network: Network, probes: Probes) -> dict[str, int]:
    """How many nodes no leap of ``network`` passes by, by the first reason that holds for each.

    ``loads``: loads, machines or transformers hang there; ``points``: a probe looks there;
    ``forks``: the network forks there; ``others``: the source, loops, and either side of
    regulators, in-line transformers and edges that do not bring all phases.
    """
    tree = network.tree
    count = tree.parent.size
    kept = np.flatnonzero(tree.passed < 0)
    above = np.where(tree.leap >= 0, np.append(tree.leap_from, -1)[tree.leap], tree.parent)
    ways_down = np.bincount(above[kept[kept > 0]], minlength=count)
    tree_edges = probes.i_edge[(probes.i_edge > 0) & (probes.i_edge < count)]
    chords = probes.i_edge[probes.i_edge >= count] - count
    reasons = {
        "loads": (tree.unit_node, tree.branch_node),
        "points": (
            *(probes.v_node, tree_edges, tree.parent[tree_edges]),
            *(tree.tail[chords], tree.fork[chords]),
        ),
        "forks": (np.flatnonzero(ways_down > 1),),
        "others": (np.arange(count),),
    }
    left = tree.passed < 0
    found: dict[str, int] = {}
    for reason, places in reasons.items():
        here = np.unique(np.concatenate(places))
        found[reason] = int(left[here].sum())
        left[here] = False
    return found
