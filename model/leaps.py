"""Buses that nothing varies on, passed by in one leap: exactly, and only while nobody looks.

A chain of edges is a two-port between its two ends, whatever its lines are built like, with the
transformers in it and with whatever constant shunts its buses have: capacitors, charging, twigs
behind which nothing hangs. An event there needs the buses, and gets them back for that scenario.
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
    """Constant edges in a row."""

    end: int  #: the node below them
    above: int  #: the node above them
    inner: list[int]  #: nodes between, upwards
    matrices: Complex  #: (3, 3, 3) T, Z, Y


def with_leaps(network: Network, probes: Probes) -> Network:
    """The same network with every leap that ``probes`` allow; no others may be used with it.

    What is seen agrees with the network as it was to rounding.
    """
    tree = network.tree
    constant = _constant(tree, probes)
    bare = constant & ~_busy(tree, probes)
    dry, hung_s = _dry(tree, bare)
    passable = _passable(tree, constant, bare, dry)
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
        leap_chain=np.array(matrices, np.complex128).reshape(-1, 3, 3, 3),
        region_from=region_from,
        region_node=region_node,
        lone_phase=_lone_phases(tree, chains),
    )
    return replace(network, tree=leaping)


def _constant(tree: Tree, probes: Probes) -> Flags:
    """(B,) edges that are the same in every scenario, at which nobody looks.

    The taps of regulators are not; loose modes depend on all that hangs below them; a loop leads
    elsewhere.
    """
    count = tree.parent.size
    constant = (tree.regulator[:count] < 0) & ~tree.in_loop & (np.diff(tree.loose_from) == 0)
    constant[0] = False
    constant[probes.i_edge[probes.i_edge < count]] = False
    return np.asarray(constant)


def _turn(tree: Tree, k: int) -> Complex:
    """(3, 3) T of a constant edge."""
    row = tree.transformer[k]
    return np.asarray(tree.turn[row] if row >= 0 else np.eye(3, dtype=np.complex128))


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
            hung_s[parent] += _seen_from_above(tree, k, hung_s[k])
        else:
            dry[parent] = False
    return dry, hung_s


def _seen_from_above(tree: Tree, k: int, y_s: Complex) -> Complex:
    """``y_s`` behind edge k."""
    turn = _turn(tree, k)
    return np.asarray(turn.T @ y_s @ np.linalg.inv(np.eye(3) + tree.z_ohm[k] @ y_s) @ turn)


def _passable(tree: Tree, constant: Flags, bare: Flags, dry: Flags) -> Flags:
    """(B,) bare nodes between two constant edges, besides which there are only twigs."""
    lower = np.flatnonzero(~dry)
    lower = lower[lower > 0]
    wet = np.bincount(tree.parent[lower], minlength=dry.size)
    passable = bare & (wet == 1)
    passable[tree.parent[lower[~constant[lower]]]] = False
    return np.asarray(passable)


def _roots(tree: Tree, dry: Flags, passable: Flags) -> Int:
    """The first node of every twig that hangs on a node which stays."""
    above = tree.parent
    return np.flatnonzero(dry & ~dry[above] & ~passable[above])


def _twig(tree: Tree, root: int, hung_s: Complex) -> Complex:
    """(3, 3, 3) of a twig, at whose end nothing is."""
    nothing = np.zeros((3, 3))
    return np.array([nothing, nothing, _seen_from_above(tree, root, hung_s)])


def _chains(tree: Tree, dry: Flags, passable: Flags, hung_s: Complex) -> list[_Chain]:
    """Every chain, by its end node; each passable node is in one."""
    ends = np.flatnonzero(~dry & ~passable)
    return [_chain(tree, int(k), passable, hung_s) for k in ends if k and passable[tree.parent[k]]]


def _chain(tree: Tree, end: int, passable: Flags, hung_s: Complex) -> _Chain:
    """Climb from ``end`` to the first node that stays.

    Two-ports  V_low = T V_up - Z I_low,  I_up = T' I_low + Y V_up  exist also where T has no
    inverse. A node's shunt below an edge T1, Z1 adds to Y, and past the edge, with
    G = (I + Z1 Y)^-1,

        Z += T G Z1 T',  Y <- T1' Y G T1,  T <- T G T1.

    Where a line lacks a phase its Z is zero, no current flows and the voltage is carried on.
    """
    one = np.eye(3)
    t, z, y = _turn(tree, end), tree.z_ohm[end], np.zeros((3, 3), np.complex128)
    inner: list[int] = []
    node = int(tree.parent[end])
    while passable[node]:
        inner.append(node)
        z1, t1 = tree.z_ohm[node], _turn(tree, node)
        y = y + hung_s[node]
        g = np.linalg.inv(one + z1 @ y)
        z, y, t = z + t @ g @ z1 @ t.T, t1.T @ y @ g @ t1, t @ g @ t1
        node = int(tree.parent[node])
    return _Chain(end=end, above=node, inner=inner, matrices=np.array([t, z, y]))


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
    """(B,) ``Tree.lone_phase``, -1 at the end of a chain that other phases take part in."""
    lone = tree.lone_phase.copy()
    for chain in chains:
        a = tree.lone_phase[chain.end]
        turn, _, shunt_s = chain.matrices
        others = np.arange(3) != a
        if turn[a, others].any() or shunt_s[others].any() or shunt_s[:, others].any():
            lone[chain.end] = -1
    return lone


def why_solved(network: Network, probes: Probes) -> dict[str, int]:
    """How many nodes no leap of ``network`` passes by, by the first reason that holds for each.

    ``loads``: loads, machines or transformers hang there; ``points``: a probe looks there;
    ``forks``: the network forks there; ``others``: the source, loops, and either side of
    regulators, ungrounded windings and edges that do not bring all phases.
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
