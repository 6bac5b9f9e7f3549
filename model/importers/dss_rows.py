"""Elements of an OpenDSS circuit, each out of the properties that the engine tells of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from .dss_engine import Props
from .dss_records import (
    End,
    Matrix,
    OtherElement,
    RawCapacitor,
    RawGuard,
    RawLoad,
    RawPlant,
    RawSource,
    RawTapControl,
    RawTransformer,
    Winding,
)

__all__ = [
    "end_of",
    "matrix_of",
    "name_of",
    "raw_capacitor",
    "raw_guard",
    "raw_load",
    "raw_other",
    "raw_plant",
    "raw_source",
    "raw_tap_control",
    "raw_transformer",
]


def end_of(text: str, conductors: int, phases: int) -> End:
    """Return the terminal that ``bus.1.2.3`` means: phases by default, then earth.

    Examples
    --------
    >>> end_of("671.3.1", 2, 1)
    End(bus='671', nodes=(3, 1))
    >>> end_of("B", 4, 3)
    End(bus='b', nodes=(1, 2, 3, 0))
    """
    bus, *given = text.strip().lower().split(".")
    nodes = [int(node) for node in given if node.strip()][:conductors]
    nodes += [n + 1 if n < phases else 0 for n in range(len(nodes), conductors)]
    return End(bus=bus, nodes=tuple(nodes))


def name_of(row: Props) -> str:
    """Return an element's name in lower case."""
    return str(row["Name"] if "Name" in row else row["name"]).lower()


def _complex(pair: Sequence[float]) -> complex:
    return complex(pair[0], pair[1])


def matrix_of(rows: Any) -> Matrix:
    """Return a matrix of the engine's as plain numbers."""
    return tuple(tuple(float(value) for value in row) for row in rows)


def raw_source(row: Props) -> RawSource:
    """Read a Vsource, an ideal one with the little impedance that it has."""
    phases = int(row["phases"])
    ideal = str(row["model"]).lower() == "ideal"
    ohms = float(row["basekv"]) ** 2 / float(row["basemva"])
    z1, z2, z0 = (_complex(row[key]) for key in ("z1", "z2", "z0"))
    if ideal:
        z1 = z2 = z0 = _complex(row["puzideal"]) * ohms
    return RawSource(
        name=name_of(row),
        end=end_of(row["bus1"], phases, phases),
        earthed=not row["bus2"] or not any(end_of(row["bus2"], phases, phases).nodes),
        sequence=str(row["sequence"]).lower(),
        phases=phases,
        kv_ll=float(row["basekv"]),
        pu=float(row["pu"]),
        angle_deg=float(row["angle"]),
        z1_ohm=z1,
        z2_ohm=z2,
        z0_ohm=z0,
    )


def raw_transformer(row: Props) -> RawTransformer:
    """Read a transformer of any number of windings."""
    phases = int(row["phases"])
    across = [float(value) for value in row["xscarray"]] + [0.0, 0.0]
    return RawTransformer(
        name=name_of(row),
        phases=phases,
        windings=tuple(_winding(row, n, phases) for n in range(len(row["kvs"]))),
        # what counts: xhl, xht and xlt may tell a default that the engine does not use
        x_pct=(across[0], across[1], across[2]),
        imag_pct=float(row["%imag"]),
        noload_pct=float(row["%noloadloss"]),
        euro=str(row["leadlag"]).lower() in {"lead", "euro"},
        bank=str(row["bank"]).lower(),
    )


def _winding(row: Props, n: int, phases: int) -> Winding:
    r_neutral = float(row["rneut"][n])
    steps = max(int(row["numtaps"][n]), 1)
    return Winding(
        end=end_of(row["buses"][n], phases + 1, phases),
        delta=str(row["conns"][n]).lower().startswith("d"),
        kv=float(row["kvs"][n]),
        kva=float(row["kvas"][n]),
        r_pct=float(row["%rs"][n]),
        tap=float(row["taps"][n]),
        tap_step=(float(row["maxtap"][n]) - float(row["mintap"][n])) / steps,
        most_taps=max(steps // 2, 1),
        neutral_ohm=complex(r_neutral, float(row["xneut"][n])) if r_neutral >= 0.0 else None,
    )


def raw_load(row: Props) -> RawLoad:
    """Read a load."""
    phases = int(row["phases"])
    delta = str(row["conn"]).lower().startswith(("d", "l"))
    conductors = phases if delta and phases > 2 else phases + 1
    return RawLoad(
        name=name_of(row),
        end=end_of(row["bus1"], conductors, phases),
        phases=phases,
        delta=delta,
        kv=float(row["kv"]),
        kw=float(row["kw"]),
        kvar=float(row["kvar"]),
        model=int(row["model"]),
        cvr=(float(row["cvrwatts"]), float(row["cvrvars"])),
        zipv=tuple(float(value) for value in row["zipv"]),
        v_min_pu=float(row["vminpu"]),
        v_max_pu=float(row["vmaxpu"]),
        v_low_pu=float(row["vlowpu"]),
        fixed=str(row["status"]).lower() != "variable",
        neutral_earthed=float(row["rneut"]) >= 0.0,
    )


def raw_capacitor(row: Props, frequency_hz: float) -> RawCapacitor:
    """Read a capacitor bank."""
    phases = int(row["phases"])
    delta = str(row["conn"]).lower().startswith(("d", "l"))
    kv = float(row["kv"])
    branch_kv = kv / 3.0**0.5 if phases > 1 and not delta else kv
    # microfarads are what counts: the engine makes them of kvar in its own way
    kvar_of_uf = 2.0e-3 * math.pi * frequency_hz * branch_kv**2 * phases
    conductors = phases + 1 if delta and phases < 3 else phases
    return RawCapacitor(
        name=name_of(row),
        end=end_of(row["bus1"], conductors, phases),
        far=end_of(row["bus2"] or "", phases, phases),
        phases=phases,
        delta=delta,
        kv=kv,
        kvar=tuple(float(f"{kvar_of_uf * float(value):.12g}") for value in row["cuf"]),
        states=tuple(int(value) for value in row["states"]),
        damped=any(float(value) != 0.0 for key in ("r", "xl") for value in row[key]),
    )


def raw_plant(kind: str, row: Props, *, gen_mult: float) -> RawPlant:
    """Read a generator, PV system or storage, with what it delivers in the snapshot."""
    kw, kvar = float(row["kw"]) if "kw" in row else 0.0, float(row["kvar"])
    if kind == "pvsystem":
        made = float(row["pmpp"]) * float(row["irradiance"]) * float(row["%pmpp"]) / 100.0
        kw = min(made, float(row["kva"]))
    if kind == "generator" and str(row["status"]).lower() != "fixed":
        kw, kvar = kw * gen_mult, kvar * gen_mult
    phases = int(row["phases"])
    return RawPlant(
        kind=kind,
        name=name_of(row),
        end=end_of(row["bus1"], phases + 1, phases),
        phases=phases,
        kw=kw,
        kvar=kvar,
        model=int(row["model"]),
    )


def raw_guard(kind: str, row: Props) -> RawGuard:
    """Read what opens and closes a terminal of another element."""
    # a relay or recloser that names nothing to switch, switches what it watches
    return RawGuard(
        kind=kind,
        name=name_of(row),
        element=str(row["switchedobj"] or row.get("monitoredobj") or "").lower(),
        terminal=int(row["switchedterm"]),
    )


def raw_tap_control(row: Props) -> RawTapControl:
    """Read which winding a RegControl taps."""
    return RawTapControl(
        name=name_of(row),
        transformer=str(row["transformer"]).lower().rpartition(".")[2],
        winding=int(row["tapwinding"]),
    )


def raw_other(kind: str, row: Props) -> OtherElement:
    """Read where an element stands that nothing else is known of."""
    phases = int(row.get("phases") or 3)
    texts = [row[key] for key in ("bus1", "bus2") if row.get(key)] or list(row.get("buses") or ())
    ends = tuple(end_of(text, phases, phases) for text in texts)
    return OtherElement(kind=kind, name=name_of(row), ends=ends)
