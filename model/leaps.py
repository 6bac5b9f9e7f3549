"""Buses that nothing hangs on, passed by in one leap: exactly, and only while nobody looks.

A chain of lines through such buses is one line with an impedance of its own and a shunt at
either end, as long as its lines are built alike; a twig, behind which nothing hangs at all, is a
shunt. An event there needs the buses, and gets them back for that scenario.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .network import Network
from .states import Probes, Tree

__all__ = ["with_leaps"]

Complex = NDArray[np.complex128]

SYMMETRIC = 1e-9  #: a chain more asymmetric than this stays as it is: it would cost 1e-11 pu


def with_leaps(network: Network, probes: Probes) -> Network:
    """The same network with every leap that ``probes`` allow; no others may be used with it.

    What is seen agrees with the network as it was to rounding.
    """
    tree = network.tree
    bare = _bare(tree, probes)
    fields: dict[str, Any] = {name: getattr(tree, name).copy() for name in ("passed", "leap")}
    twigs, up = _twigs(tree, bare)
    above: list[int] = []
    for k, root in twigs.items():
        if k == root:
            above.append(int(tree.parent[k]))
        fields["passed"][k] = list(up).index(root)
    up_all = list(up.values())
    count = len(above)
    z = [np.zeros((3, 3), np.complex128)] * count
    low = list(z)
    open_to = _passable(tree, bare)
    for k in range(1, tree.parent.size):
        if open_to[k] or k in twigs or not open_to[tree.parent[k]] or _seen(k, probes):
            continue
        inner, made = _chain(tree, k, open_to, probes)
        if inner:
            fields["passed"][inner] = len(above)
            fields["leap"][k] = len(above)
            above.append(tree.parent[inner[-1]])
            z.append(made[0])
            up_all.append(made[1])
            low.append(made[2])
    fields["leap_from"] = np.array(above, np.int64)
    fields["twigs"] = count
    for name, of in (("leap_z_ohm", z), ("leap_up_s", up_all), ("leap_low_s", low)):
        fields[name] = np.array(of, np.complex128).reshape(-1, 3, 3)
    return replace(network, tree=tree._replace(**fields))


def _seen(edge: int, probes: Probes) -> bool:
    return bool((probes.i_edge == edge).any())


def _bare(tree: Tree, probes: Probes) -> NDArray[np.bool_]:
    """(B,) nodes below a plain edge, with nothing on them but charging, that nobody looks at."""
    count = tree.parent.size
    bare = (tree.regulator[:count] < 0) & (tree.transformer[:count] < 0)
    bare &= ~tree.in_loop & (np.diff(tree.loose_from) == 0) & ~_capacitors(tree)
    seen = probes.i_edge[probes.i_edge < count]
    for busy in (tree.unit_node, tree.branch_node, tree.fork, tree.tail, probes.v_node, seen):
        bare[busy] = False
    bare[0] = False
    return np.asarray(bare)


def _twigs(tree: Tree, bare: NDArray[np.bool_]) -> tuple[dict[int, int], dict[int, Complex]]:
    """The root of the twig that each of its nodes belongs to, and each root's admittance."""
    count = tree.parent.size
    dry, y = bare.copy(), tree.shunt_s.copy()
    for k in range(count - 1, 0, -1):
        parent = tree.parent[k]
        if dry[k]:
            y[k] = y[k] @ np.linalg.inv(np.eye(3) + tree.z_ohm[k] @ y[k])
            y[parent] += y[k]
        else:
            dry[parent] = False
    root: dict[int, int] = {}
    for k in range(1, count):
        if dry[k]:
            root[k] = root.get(int(tree.parent[k]), k)
    return root, {k: y[k] for k in root if root[k] == k}


def _passable(tree: Tree, bare: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(B,) bare nodes between two plain edges."""
    count = tree.parent.size
    passable = bare & (np.bincount(tree.parent[1:], minlength=count) == 1)
    for k in range(1, count):
        turned = tree.regulator[k] >= 0 or tree.transformer[k] >= 0
        if turned or tree.loose_from[k + 1] > tree.loose_from[k] or tree.in_loop[k]:
            passable[tree.parent[k]] = False
    return np.asarray(passable)


def _capacitors(tree: Tree) -> NDArray[np.bool_]:
    """(B,) nodes with more of a shunt than their edges' charging."""
    charging = np.zeros_like(tree.shunt_s)
    count = tree.parent.size
    np.add.at(charging, tree.parent[1:], tree.end_y_s[1:count])
    charging[1:] += tree.end_y_s[1:count]
    for c in range(tree.tail.size):
        for node in (tree.tail[c], tree.fork[c]):
            charging[node] += tree.end_y_s[count + c]
    scale = np.abs(charging).max(axis=(1, 2))
    return np.asarray(np.abs(tree.shunt_s - charging).max(axis=(1, 2)) > 1e-12 * scale)


def _chain(
    tree: Tree, k: int, passable: NDArray[np.bool_], probes: Probes
) -> tuple[list[int], tuple[Complex, Complex, Complex]]:
    """Nodes passed by above node k, nearest first, and the chain's Z and end shunts."""
    nothing = np.zeros((3, 3), np.complex128)
    inner: list[int] = []
    made = (tree.z_ohm[k], nothing, nothing)
    node = int(tree.parent[k])
    while passable[node] and tree.phases[node] == tree.phases[k] and not _seen(node, probes):
        joined = _joined(tree.z_ohm[node], tree.shunt_s[node], made)
        if joined is None:
            break
        inner.append(node)
        made = joined
        node = int(tree.parent[node])
    return inner, made


def _joined(
    z_above: Complex, shunt: Complex, below: tuple[Complex, Complex, Complex]
) -> tuple[Complex, Complex, Complex] | None:
    """One line of two with ``shunt`` between them; None where no line is like that.

    With Y that shunt and the upper one of the line below, V_above = A V + B I has
    B = Z1 + Z2 + Z1 Y Z2, which must be symmetric to be an impedance; the shunts are then
    B^-1 Z2 Y above, and B^-1 Z1 Y more than it had below.
    """
    z, up, low = below
    there = np.flatnonzero((np.abs(z_above) + np.abs(z)).max(axis=1) > 0.0)
    y = shunt + up
    if not there.size:
        return z, np.zeros((3, 3), np.complex128), low + y
    pick = np.ix_(there, there)
    z1, z2, between = z_above[pick], z[pick], y[pick]
    b = z1 + z2 + z1 @ between @ z2
    if np.abs(b - b.T).max() > SYMMETRIC * np.abs(b).max():
        return None
    series, above, under = (np.zeros((3, 3), np.complex128) for _ in range(3))
    series[pick] = b
    above[pick] = np.linalg.solve(b, z2 @ between)
    under[pick] = low[pick] + np.linalg.solve(b, z1 @ between)
    return series, above, under
