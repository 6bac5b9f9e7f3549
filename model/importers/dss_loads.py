"""Loads, capacitor banks and generation out of an OpenDSS circuit."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace

from ..parts import Capacitor, Der, Load, LoadConnection, Place
from .dss_live import Node, load_kw
from .dss_names import Names, letters
from .dss_neutrals import Neutrals
from .dss_records import RawCapacitor, RawLoad, RawPlant
from .dss_stars import Ray, Star, floating_neutral
from .findings import Findings

__all__ = ["LoadWork", "capacitor_of", "der_of", "law_of", "loads_of"]

_Branch = tuple[int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadWork:
    """What every load needs to be converted, and the stars found on the way."""

    load_mult: float
    live: Collection[Node]
    neutrals: Neutrals
    buses: Names
    names: Names
    findings: Findings
    stars: defaultdict[Node, list[Star]] = field(default_factory=lambda: defaultdict(list))


def law_of(raw: RawLoad) -> tuple[Load, str]:
    """Return a load that has nothing but the law of the file's, and what is approximated in it.

    Law by OpenDSS's model number: 1 power, 2 impedance, 3 power with Q an impedance, 4 own
    exponents, 5 current, 6 and 7 power with a fixed Q, 8 shares.
    """
    exponents = {1: (0.0, 0.0), 2: (2.0, 2.0), 3: (0.0, 2.0), 4: raw.cvr, 5: (1.0, 1.0)}
    p, q = {**exponents, 6: (0.0, 0.0), 7: (0.0, 2.0), 8: (2.0, 2.0)}.get(raw.model, (0.0, 0.0))
    how = ""
    if raw.model in (6, 7):
        how = "models 6 and 7 beyond their voltage range"
    if raw.model not in range(1, 9):
        how = f"model {raw.model} taken as constant power"
    low = raw.v_min_pu if raw.v_min_pu > 0.0 else 0.01
    law = Load(
        name="",
        transformer=None,
        place=None,
        connection="wye",
        kw=0.0,
        power_factor=1.0,
        exponent=p,
        exponent_q=None if q == p else q,
        v_min_pu=low,
        v_max_pu=raw.v_max_pu if raw.v_max_pu > low else None,
        v_low_pu=raw.v_low_pu if 0.0 < raw.v_low_pu < low else None,
    )
    if raw.model == 2:
        return replace(law, v_min_pu=0.7, v_max_pu=None, v_low_pu=None), how
    if raw.model == 8:
        shares = raw.zipv
        if len(shares) > 6 and shares[6] > 0.0:
            how = "its cut-off voltage is left out"
        z, i, s, zq, iq, sq = shares[:6]
        law = replace(law, zip=(z, i, s, zq, iq, sq))
    if raw.model in (3, 4):
        # beyond their range they go on as constant power, whatever their law is within
        law = replace(law, edge_exponent=0.0)
    return law, how


def loads_of(raw: RawLoad, work: LoadWork) -> list[Load]:
    """Return what a load becomes, without its branches that nothing feeds.

    Branches to a neutral that nothing earths are put among the work's stars instead.
    """
    findings = work.findings
    kw = load_kw(raw, work.load_mult)
    kvar = raw.kvar * (1.0 if raw.fixed or raw.model in (6, 7) else work.load_mult)
    if kw == 0.0 and kvar == 0.0:
        findings.add("load", raw.name, "as it is", "left out: no power")
        return []
    if kw < 0.0:
        findings.add("load", raw.name, "refused", "negative power: generation", kw=kw)
        return []
    law, how = law_of(raw)
    if law.zip is not None:
        kw, kvar, law = _normal_zip(law, kw, kvar)
    hows = [how] if how else []
    branches, branch_kv = _branches(raw)
    if not all(pair[0] in (1, 2, 3) for pair in branches):
        findings.add("load", raw.name, "refused", "it has a branch on no phase", kw=kw)
        return []
    share = 1.0 / len(branches)
    neutral = floating_neutral(raw, [q for _, q in branches], work.neutrals)
    if neutral is None and any(q > 3 for _, q in branches):
        hows.append("its neutral conductor is taken as earthed")
        branches = [(p, 0 if q > 3 else q) for p, q in branches]
    fed = [
        pair
        for pair in branches
        if all((raw.end.bus, node) in work.live for node in pair if node in (1, 2, 3))
    ]
    if not fed:
        findings.add("load", raw.name, "not fed", kw=kw)
        return []
    if len(fed) < len(branches):
        hows.append("without the phases that nothing feeds")
    if neutral is not None:
        rays = tuple(Ray(phase=p, kva=complex(kw, kvar) * share, kv=branch_kv) for p, _ in fed)
        work.stars[neutral].append(Star(load=raw, law=law, rays=rays, hows=tuple(hows), kw=kw))
        return []
    rows = [
        replace(
            law,
            name=work.names.of(raw.name if n == 0 else f"{raw.name}_{n + 1}"),
            place=Place(bus=work.buses.of(raw.end.bus)),
            connection=connection,
            phases=phases,
            kw=kw * share * count,
            kvar=kvar * share * count,
            branch_kv=branch_kv,
        )
        for n, (connection, phases, count) in enumerate(_groups(fed))
    ]
    fate = "approximated" if hows else "as it is"
    findings.add("load", raw.name, fate, "; ".join(hows) or f"model {raw.model}", kw=kw)  # type: ignore[arg-type]
    return rows


def _normal_zip(law: Load, kw: float, kvar: float) -> tuple[float, float, Load]:
    """Move what the shares do not sum up to into the power."""
    assert law.zip is not None
    p, q = sum(law.zip[:3]), sum(law.zip[3:])
    z, i, s, zq, iq, sq = (
        (
            *(share / p for share in law.zip[:3]),
            *(share / q for share in law.zip[3:]),
        )
        if p and q
        else law.zip
    )
    return kw * (p or 1.0), kvar * (q or 1.0), replace(law, zip=(z, i, s, zq, iq, sq))


def _branches(raw: RawLoad) -> tuple[list[_Branch], float]:
    """Return the nodes of each branch, a phase first, and its nominal voltage."""
    nodes = raw.end.nodes
    kv = raw.kv
    if raw.delta:
        if raw.phases == 1:
            pairs = [(nodes[0], nodes[1])]
        elif raw.phases == 2:
            pairs = [(nodes[0], nodes[1]), (nodes[1], nodes[2])]
        else:
            pairs = [(nodes[n], nodes[(n + 1) % raw.phases]) for n in range(raw.phases)]
    else:
        kv = raw.kv / 3.0**0.5 if raw.phases > 1 else raw.kv
        pairs = [(node, nodes[raw.phases]) for node in nodes[: raw.phases]]
    return [pair if pair[0] in (1, 2, 3) else pair[::-1] for pair in pairs], kv


def _groups(branches: Sequence[_Branch]) -> list[tuple[LoadConnection, str, int]]:
    """Return connection, phases and number of branches of the rows that make them all."""
    rows: list[tuple[LoadConnection, str, int]] = []
    earthed = [p for p, q in branches if q == 0]
    across = [pair for pair in branches if pair[1] != 0]
    if earthed and len(set(earthed)) == len(earthed):
        rows.append(("wye", letters(earthed), len(earthed)))
    else:
        rows += [("wye", letters([p]), 1) for p in earthed]
    if {frozenset(pair) for pair in across} == {frozenset(s) for s in ((1, 2), (2, 3), (1, 3))}:
        rows.append(("delta", "abc", 3))
    else:
        rows += [("delta", letters(pair), 1) for pair in across]
    return rows


def capacitor_of(
    raw: RawCapacitor, live: Collection[Node], buses: Names, names: Names, findings: Findings
) -> list[Capacitor]:
    """Return what a capacitor bank becomes: the steps that are in."""
    kvar = sum(step for step, state in zip(raw.kvar, raw.states, strict=False) if state)
    kv, nodes, far = raw.kv, raw.end.nodes, raw.far
    if raw.delta:
        pairs = [(nodes[n], nodes[(n + 1) % len(nodes)]) for n in range(raw.phases)]
    else:
        kv = kv / 3.0**0.5 if raw.phases > 1 else kv
        pairs = list(zip(nodes, far.nodes, strict=True))
        floating = all(node > 3 for node in far.nodes) and far.bus == raw.end.bus
        if floating and raw.phases == 3:
            # equal capacitances in an unearthed star are a delta's
            kv, pairs = raw.kv, [(nodes[n], nodes[(n + 1) % 3]) for n in range(3)]
    if far.bus not in ("", raw.end.bus) and any(far.nodes):
        findings.add("capacitor", raw.name, "refused", "it stands in series")
        return []
    if not all(node in (0, 1, 2, 3) for pair in pairs for node in pair):
        findings.add("capacitor", raw.name, "refused", "it is connected to a neutral")
        return []
    if kvar <= 0.0:
        findings.add("capacitor", raw.name, "state kept", "switched off: left out")
        return []
    fed = [pair for pair in pairs if all((raw.end.bus, n) in live for n in pair if n > 0)]
    if not fed:
        findings.add("capacitor", raw.name, "not fed")
        return []
    hows = ["without its series R and L"] if raw.damped else []
    if len(fed) < len(pairs):
        hows.append("without the phases that nothing feeds")
    fate = "approximated" if hows else "as it is"
    findings.add("capacitor", raw.name, fate, "; ".join(hows))  # type: ignore[arg-type]
    return [
        Capacitor(
            name=names.of(raw.name if n == 0 else f"{raw.name}_{n + 1}"),
            place=Place(bus=buses.of(raw.end.bus)),
            connection=connection,
            kvar=kvar * count / len(pairs),
            phases=phases,
            branch_kv=kv,
        )
        for n, (connection, phases, count) in enumerate(_groups(fed))
    ]


def der_of(
    raw: RawPlant, live: Collection[Node], buses: Names, names: Names, findings: Findings
) -> list[Der]:
    """Return the distributed generation that a three-phase plant is."""
    if raw.kw < 0.0:
        findings.add(raw.kind, raw.name, "refused", "it charges: give a load instead")
        return []
    if raw.kw == 0.0:
        findings.add(raw.kind, raw.name, "state kept", "delivers nothing: left out")
        return []
    if not any((raw.end.bus, node) in live for node in raw.end.nodes):
        findings.add(raw.kind, raw.name, "not fed")
        return []
    if raw.phases != 3 or not all((raw.end.bus, node) in live for node in (1, 2, 3)):
        findings.add(raw.kind, raw.name, "refused", f"{raw.phases}-phase generation")
        return []
    if raw.kind == "generator" and raw.model == 3:
        findings.add(raw.kind, raw.name, "refused", "it holds its voltage (model 3)")
        return []
    factor = raw.kw / (raw.kw**2 + raw.kvar**2) ** 0.5
    findings.add(raw.kind, raw.name, "approximated", "constant power of the positive sequence")
    return [
        Der(
            name=names.of(raw.name),
            transformer=None,
            place=Place(bus=buses.of(raw.end.bus)),
            kw=raw.kw,
            power_factor=factor if raw.kvar >= 0.0 else -factor,
            model="constant_power",
            z1_ohm=None,
            z2_ohm=None,
            z0_ohm=None,
        )
    ]
