"""Lines with some of their conductors open, against OpenDSS's own solution of each."""

from __future__ import annotations

from pathlib import Path

import pytest
from dss_circuits import script

from openphase.model.errors import InputError
from openphase.model.importers.dss_feeder import Imported, import_opendss
from openphase.model.importers.fidelity import differences

pytestmark = pytest.mark.usefixtures("engine")

LINES = (
    "new line.l1 bus1=m bus2=b linecode=oh length=2 units=mi",
    "new line.l2 bus1=b bus2=c linecode=oh length=2 units=mi",
)
RING = (*LINES, "new line.l3 bus1=m bus2=c linecode=oh length=1 units=mi")
DELTA = "new load.d bus1=c phases=3 kv=12.47 conn=delta kw=900 pf=0.9"
WYE = "new load.w bus1=b phases=3 kv=12.47 kw=300 pf=0.95"
BANK = (
    "new transformer.t windings=2 buses=[c d] conns=[wye delta] kvs=[12.47 0.48] kvas=[500 500]",
    "~ xhl=5",
    "new load.g bus1=d phases=3 conn=delta kv=0.48 kw=200 pf=0.9",
)
LATERAL = (
    "new line.l4 bus1=b.1 bus2=e.1 phases=1 r1=1 x1=2 r0=1 x0=2 c1=3 c0=3 length=2 units=km",
    "new load.e bus1=e.1 phases=1 kv=7.2 kw=100",
)
OPEN = {
    "back-fed over a delta load": (*LINES, DELTA, "open line.l1 2 1"),
    "told by names": (*LINES, DELTA, "open line.l1 term=2 cond=1"),
    "back-fed over a transformer": (*LINES, *BANK, "open line.l2 1 3"),
    "two of three": (*LINES, DELTA, WYE, "open line.l1 1 2", "open line.l1 1 3"),
    "at both ends": (*LINES, DELTA, WYE, "open line.l1 1 2", "open line.l1 2 3"),
    "a lateral behind it": (*LINES, DELTA, *LATERAL, "open line.l1 1 1"),
    "capacitors behind it": (
        *LINES,
        DELTA,
        "new capacitor.k bus1=c kv=12.47 kvar=300",
        "open line.l2 1 1",
    ),
    "charging alone": (*LINES, "open line.l1 1 1"),
    "beside an open end": (*RING, DELTA, WYE, "open line.l2 1", "open line.l2 2 3"),
}


@pytest.fixture
def engine() -> None:
    pytest.importorskip("dss", reason="needs the extra: pip install 'openphase[opendss]'")


def imported(folder: Path, *commands: str) -> Imported:
    path = folder / "open.dss"
    path.write_text(script(commands), encoding="utf-8")
    return import_opendss(path)


def largest(found: Imported) -> float:
    rows = differences(found)
    assert all(row.converged and row.opendss_converged for row in rows)
    return max(row.largest_pu for row in rows)


@pytest.mark.parametrize("name", OPEN)
def test_what_hangs_behind_an_open_conductor_stays(name: str, tmp_path: Path) -> None:
    found = imported(tmp_path, *OPEN[name])
    assert {row.fate for row in found.findings.rows} == {"as it is"}
    assert all(len(line.phases) == 3 for line in found.feeder.lines if line.name != "l4")
    assert largest(found) < 1e-6


def test_an_open_conductor_is_two_switches_of_which_one_is_open(tmp_path: Path) -> None:
    found = imported(tmp_path, *OPEN["back-fed over a delta load"])
    switches = {switch.name: switch for switch in found.feeder.switches}
    assert {name: (s.phases, s.closed) for name, s in switches.items()} == {
        "l1_a": ("a", False),
        "l1_bc": ("bc", True),
    }
    assert {(s.from_bus, s.to_bus) for s in switches.values()} == {("b_l1", "b")}
    assert any("line l1 is open in a" in note for note in found.findings.notes)


def test_a_loop_that_closes_over_the_closed_conductors_is_refused_by_name(tmp_path: Path) -> None:
    found = imported(tmp_path, *RING, DELTA, WYE, "open line.l1 1 2")
    with pytest.raises(
        InputError, match="the loop over the switch 'm'–'m_l1' must close over a line"
    ):
        differences(found)


def test_a_line_through_which_no_fed_conductor_passes_is_not_fed(tmp_path: Path) -> None:
    first = "new line.l1 bus1=m.1 bus2=b.1 phases=1 r1=1 x1=2 r0=1 x0=2 length=2 units=km"
    found = imported(tmp_path, first, LINES[1], DELTA, "open line.l2 1 1")
    assert [row.element for row in found.findings.of("not fed")] == ["line.l2", "load.d"]
    assert largest(found) < 1e-6


@pytest.mark.parametrize(
    ("commands", "opened"),
    [
        (("state=[open closed closed]",), {"f_a", "f_bc"}),
        (("normal=[open closed closed]",), {"f"}),
        (("state=[closed closed closed]", "open line.l1 1 3"), {"f_c", "f_ab"}),
        (("state=[closed closed open]", "open line.l1 2 1"), {"f_ab", "f_c", "l1_bc", "l1_a"}),
    ],
)
def test_a_fuse_has_the_state_of_the_conductors_that_it_stands_in(
    commands: tuple[str, ...], opened: set[str], tmp_path: Path
) -> None:
    fuse, *more = commands
    told = f"new fuse.f monitoredobj=line.l1 monitoredterm=1 {fuse}"
    found = imported(tmp_path, *LINES, DELTA, WYE, told, *more)
    assert {switch.name for switch in found.feeder.switches} == opened
    (how,) = (row.how for row in found.findings.rows if row.kind == "fuse")
    phases = sorted(s.phases for s in found.feeder.switches if not s.closed and s.name[0] == "f")
    assert how == (f"a switch, open in {', '.join(phases[0])}" if phases else "a switch, closed")
    assert largest(found) < 1e-6


def test_an_open_neutral_conductor_is_no_return_path(tmp_path: Path) -> None:
    code = (
        "new linecode.four nphases=4 units=km",
        "~ rmatrix=(0.5 | 0.1 0.5 | 0.1 0.1 0.5 | 0.1 0.1 0.1 0.6)",
        "~ xmatrix=(1.0 | 0.4 1.0 | 0.4 0.4 1.0 | 0.4 0.4 0.4 1.1)",
        "new line.l1 bus1=m.1.2.3.0 bus2=b.1.2.3.0 phases=4 linecode=four length=2 units=km",
        "new load.z bus1=b.1 phases=1 kv=7.2 kw=500",
    )
    found = imported(tmp_path, *code, WYE, "open line.l1 1 4")
    (how,) = (row.how for row in found.findings.rows if row.element == "line.l1")
    assert how == "its neutral conductor is open: left out"
    assert largest(found) < 1e-6
    assert largest(imported(tmp_path, *code, WYE)) < 1e-6


@pytest.mark.parametrize(
    ("element", "share"), [("transformer.t", "200.0 kW"), ("load.w", "300.0 kW")]
)
def test_other_elements_with_some_conductors_open_are_refused(
    element: str, share: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match="some of its conductors are open") as refused:
        imported(tmp_path, *LINES, WYE, *BANK, f"open {element} 1 1")
    assert share in str(refused.value)
    assert f"--drop {element}" in str(refused.value)
