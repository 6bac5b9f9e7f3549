"""Lines and reactors of an OpenDSS circuit, whose impedances only the engine knows in full."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .dss_engine import Engine, Props, rows_of
from .dss_records import Matrix, RawLine, RawReactor
from .dss_rows import end_of, matrix_of, name_of

__all__ = ["line_reader", "raw_reactor"]

_METRES = {
    "mi": 1609.344,
    "kft": 304.8,
    "km": 1000.0,
    "m": 1.0,
    "ft": 0.3048,
    "in": 0.0254,
    "cm": 0.01,
    "mm": 0.001,
}


def line_reader(engine: Engine) -> Callable[[Props], RawLine]:
    """Return what reads a line's properties."""
    units = {name_of(row): row.get("units") for row in rows_of(engine, "linecode", disabled=True)}
    return partial(_line, engine, units)


def _line(engine: Engine, code_units: dict[str, Any], row: Props) -> RawLine:
    phases = int(row["phases"])
    code = row.get("linecode")
    unit = str(row["units"]).lower()
    if unit not in _METRES and code:
        # a length without a unit is in that of its code
        unit = str(code_units.get(str(code).lower())).lower()
    build = code or row.get("geometry") or row.get("spacing")
    r_ohm, x_ohm = matrix_of(row["rmatrix"]), matrix_of(row["xmatrix"])
    opened = _opened(engine, f"line.{name_of(row)}", phases)
    times = float(engine.circuit.Solution.Frequency) / float(row["basefreq"])
    if times != 1.0 and not any(map(any, opened)):
        r_ohm, x_ohm = _at_frequency(engine, row)
    elif times != 1.0:
        x_ohm = matrix_of((np.array(x_ohm) * times).tolist())
    return RawLine(
        name=name_of(row),
        ends=(end_of(row["bus1"], phases, phases), end_of(row["bus2"], phases, phases)),
        r_ohm=r_ohm,
        x_ohm=x_ohm,
        c_nf=matrix_of(row["cmatrix"]),
        length=float(row["length"]),
        unit_m=_METRES.get(unit),
        build=str(build).lower() if build else None,
        is_switch=bool(row["switch"]),
        opened=opened,
    )


def _at_frequency(engine: Engine, row: Props) -> tuple[Matrix, Matrix]:
    """Return R and X, per unit of length, of a line whose matrices are of another frequency.

    The earth's part of the impedance is not proportional to it, so they come from the line's
    own admittance matrix, in which no conductor may be open.
    """
    size = int(row["phases"])
    y = _own_admittances(engine, f"line.{name_of(row)}")
    own = np.linalg.inv(-y[:size, size:]) / float(row["length"])
    z = np.asarray((own + own.T) / 2.0)
    return matrix_of(z.real), matrix_of(z.imag)


def _opened(engine: Engine, element: str, phases: int) -> tuple[tuple[bool, ...], tuple[bool, ...]]:
    engine.circuit.SetActiveElement(element)
    active = engine.circuit.ActiveCktElement
    near, far = (
        tuple(bool(active.IsOpen(terminal, n + 1)) for n in range(phases)) for terminal in (1, 2)
    )
    return near, far


def _own_admittances(engine: Engine, element: str) -> NDArray[np.complex128]:
    """Return the admittance matrix of an element by itself."""
    engine.circuit.SetActiveElement(element)
    flat = np.asarray(engine.circuit.ActiveCktElement.Yprim, np.float64)
    if flat.size < 8:
        engine.circuit.Solution.BuildYMatrix(0, 1)
        engine.circuit.SetActiveElement(element)
        flat = np.asarray(engine.circuit.ActiveCktElement.Yprim, np.float64)
    y = flat[0::2] + 1j * flat[1::2]
    size = math.isqrt(y.size)
    return y.reshape(size, size)


def raw_reactor(engine: Engine, row: Props) -> RawReactor:
    """Read a reactor, its impedance out of its own admittance matrix: that covers every way."""
    phases = int(row["phases"])
    delta = str(row["conn"]).lower().startswith(("d", "l"))
    own = _own_admittances(engine, f"reactor.{name_of(row)}")[:phases, :phases]
    # a delta's matrix has no inverse; its branches are the same in all of them
    z = np.diag(np.full(phases, -1.0 / own[0, 1])) if delta and phases > 1 else np.linalg.inv(own)
    return RawReactor(
        name=name_of(row),
        ends=(
            end_of(row["bus1"], phases, phases),
            end_of(row["bus2"] or "", phases, phases),
        ),
        delta=delta,
        r_ohm=matrix_of(z.real),
        x_ohm=matrix_of(z.imag),
    )
