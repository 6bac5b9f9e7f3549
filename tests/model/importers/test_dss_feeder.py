"""What an import makes of small circuits, against OpenDSS's own solution of each."""

from __future__ import annotations

import shlex
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest
from dss_circuits import CIRCUITS, EVERY, HEAD, REGULATORS, TAIL, TRUNK, script, unit

from openphase.model.errors import InputError, OpenPhaseError
from openphase.model.importers.dss_engine import start
from openphase.model.importers.dss_feeder import Imported, import_opendss
from openphase.model.importers.fidelity import Difference, differences
from openphase.model.importers.report import fidelity_report
from openphase.model.importers.report_text import report_markdown, report_text
from openphase.model.reading.feeder_file import load_feeder, read_feeder, write_feeder

needs_engine = pytest.mark.usefixtures("engine")

LOOSE = {"open wye open delta": 2e-5, "closed delta": 2e-4}
"""Where OpenDSS's own admittance to earth (1e-6 of a rating) is all that holds a winding."""

FEEDERS = Path(__file__).resolve().parents[4] / "shared" / "feeders"
CASES = FEEDERS / "electricdss-tst/Version8/Distrib/IEEETestCases"
REAL = {
    "13Bus/IEEE13Nodeckt.dss": 1e-6,
    "34Bus/ieee34Mod1.dss": 1e-4,
    "37Bus/ieee37.dss": 1e-6,
    "123Bus/IEEE123Master.dss": 1e-6,
    "4Bus-GrdYD-Bal/4Bus-GrdYD-Bal.DSS": 1e-6,
}


@pytest.fixture
def engine() -> None:
    pytest.importorskip("dss", reason="needs the extra: pip install 'openphase[opendss]'")


def imported(folder: Path, *commands: str, **options: object) -> Imported:
    path = folder / "small.dss"
    path.write_text(script(commands), encoding="utf-8")
    return import_opendss(path, **options)  # type: ignore[arg-type]


def fates(found: Imported) -> Counter[tuple[str, str]]:
    return Counter((row.kind, row.fate) for row in found.findings.rows)


def agree(found: Imported, tolerance: float) -> None:
    for difference in differences(found):
        assert difference.largest_pu < tolerance, difference
        assert difference.converged
        assert difference.opendss_converged


@needs_engine
@pytest.mark.parametrize("name", EVERY)
def test_every_kind_of_element_agrees_with_the_engine(name: str, tmp_path: Path) -> None:
    found = imported(tmp_path, *EVERY[name])
    agree(found, LOOSE.get(name, 1e-6))
    told = {row.element for row in found.findings.rows}
    given = [text.split()[1].lower() for text in EVERY[name] if text.startswith("new ")]
    assert {element for element in given if not element.startswith("linecode.")} <= told


@needs_engine
def test_lines_of_a_file_that_never_solves_have_their_own_matrices(tmp_path: Path) -> None:
    path = tmp_path / "bare.dss"
    own = "new line.own bus1=s bus2=a length=5 units=km r1=0.3 x1=0.4 r0=0.5 x0=1.2"
    wires = "new wiredata.w rac=0.3 gmrac=0.02 gmrunits=ft diam=0.7 radunits=in runits=mi"
    conductors = (f"~ cond={n} wire=w x={n} h=9 units=m" for n in (1, 2, 3))
    geometry = "\n".join(("new linegeometry.g nconds=3 nphases=3", *conductors))
    drawn = "new line.drawn bus1=a bus2=b geometry=g length=2 units=km"
    load = "new load.l bus1=b kv=12.47 kw=800"
    path.write_text("\n".join((*HEAD, own, wires, geometry, drawn, load)), encoding="utf-8")
    found = import_opendss(path)
    agree(found, 1e-6)
    # r1 behind units takes the unit away, so the length gets the usual one
    assert {line.name: line.length_km for line in found.feeder.lines} == {"own": 5.0, "drawn": 2.0}


@needs_engine
@pytest.mark.parametrize("told", ["action=open", "state=open", "normal=open"])
def test_what_a_switch_control_holds_open_is_open(told: str, tmp_path: Path) -> None:
    tie = "new line.tie bus1=m bus2=b switch=y"
    control = f"new swtcontrol.held switchedobj=line.tie switchedterm=1 {told}"
    found = imported(tmp_path, tie, "new line.way bus1=m bus2=b length=1", control)
    assert [switch.closed for switch in found.feeder.switches if switch.name == "tie"] == [False]
    agree(found, 1e-6)


@needs_engine
def test_what_to_drop_can_be_pasted_into_a_shell(tmp_path: Path) -> None:
    names = ("my cap", "it's", "a[1]", "a$(b)", "a;b")
    with pytest.raises(InputError) as caught:
        imported(tmp_path, *(f'new "capacitor.{n}" bus1=m bus2=b kvar=9 kv=12' for n in names))
    drops = shlex.split(str(caught.value).partition("; --drop ")[2])
    assert drops[::2] == [f"capacitor.{name}" for name in names]


@needs_engine
@pytest.mark.parametrize(("file", "tolerance"), REAL.items())
def test_real_feeders_agree_with_the_engine(file: str, tolerance: float) -> None:
    if not CASES.exists():
        pytest.skip("needs ../shared/feeders")
    found = import_opendss(CASES / file)
    assert not found.findings.of("refused")
    assert not found.findings.of("not fed")
    agree(found, tolerance)


@needs_engine
@pytest.mark.parametrize("pu", [0.42, 0.6, 0.92, 1.2])
def test_every_load_model_agrees_at_every_voltage(pu: float, tmp_path: Path) -> None:
    models = [
        f"model={model} {more}"
        for model, more in (
            (1, ""),
            (2, ""),
            (3, ""),
            (4, "cvrwatts=0.8 cvrvars=3"),
            (5, ""),
            (8, "zipv=(0.3 0.3 0.4 0.2 0.5 0.3 0)"),
        )
    ]
    limits = "vminpu=0.9 vmaxpu=1.1 vlowpu=0.5"
    loads = [
        command
        for n, model in enumerate(models)
        for command in (
            f"new line.l{n} bus1=m bus2=b{n} r1=2 x1=6 r0=3 x0=9 c1=0 c0=0 length=1 units=km",
            f"new load.w{n} bus1=b{n}.1 phases=1 kv=7.2 kw=150 kvar=60 {model} {limits}",
            f"new load.d{n} bus1=b{n}.2.3 conn=delta phases=1 kv=12.47 kw=150 kvar=60 "
            f"{model} {limits}",
        )
    ]
    path = tmp_path / "loads.dss"
    source = HEAD[2].replace("pu=1.02", f"pu={pu}")
    path.write_text("\n".join((*HEAD[:2], source, *TRUNK, *loads, *TAIL)), encoding="utf-8")
    found = import_opendss(path)
    assert fates(found)["load", "approximated"] == 0
    agree(found, 1e-6)


@needs_engine
def test_regulators_keep_the_taps_of_the_file(tmp_path: Path) -> None:
    (three,) = imported(tmp_path, *REGULATORS["three"]).feeder.regulators
    assert (three.name, three.phases, three.taps) == ("r", "abc", (8, -2, 1))
    assert three.step_pct == 0.625
    assert not three.gang
    (delta,) = imported(tmp_path, *REGULATORS["open delta"]).feeder.regulators
    assert (delta.phases, delta.reference, delta.taps) == ("ac", "b", (8, 0, 4))
    assert delta.jumper_ohm == 1e-3
    (gang,) = imported(tmp_path, *REGULATORS["gang"]).feeder.regulators
    assert (gang.taps, gang.gang) == ((6, 6, 6), True)
    assert not imported(tmp_path, *REGULATORS["closed delta"]).feeder.regulators


@needs_engine
def test_a_tap_changer_becomes_a_regulator_behind_its_transformer(tmp_path: Path) -> None:
    feeder = imported(tmp_path, *REGULATORS["tap changer"]).feeder
    (unit_row,), (regulator,) = feeder.inline_transformers, feeder.regulators
    assert unit_row.to_bus == regulator.from_bus
    assert (regulator.to_bus, regulator.taps, regulator.gang) == ("b", (-7, -7, -7), True)
    assert unit_row.to_tap == 1.0


@needs_engine
def test_taps_and_capacitor_states_may_be_other_than_the_files(tmp_path: Path) -> None:
    commands = (*REGULATORS["three"], *CIRCUITS["capacitors"])
    found = imported(
        tmp_path,
        *commands,
        taps={"r1": {"2": 1.0125}},
        capacitor_states={"steps": [0, 0, 0], "off": [1]},
    )
    assert found.feeder.regulators[0].taps == (2, 0, 0)
    assert {bank.name: bank.kvar for bank in found.feeder.capacitors}["off"] == pytest.approx(900)
    assert "steps" not in {bank.name for bank in found.feeder.capacitors}
    agree(found, 1e-6)


@needs_engine
def test_fuses_and_open_lines_come_in_as_switches(tmp_path: Path) -> None:
    found = imported(tmp_path, *CIRCUITS["switches and fuses"])
    switches = {switch.name: switch for switch in found.feeder.switches}
    assert {name: switch.closed for name, switch in switches.items()} == {
        "f1": True,
        "r1": True,
        "open": False,
    }
    assert switches["f1"].phases == "b"
    lines = {line.name: line for line in found.feeder.lines}
    assert switches["f1"].from_bus == "b"
    assert switches["f1"].to_bus == lines["lat"].from_bus
    assert switches["r1"].from_bus == lines["tie"].to_bus
    assert switches["open"].to_bus == "m"
    assert lines["open"].to_bus == switches["open"].from_bus


@pytest.mark.parametrize(
    ("more", "closed"),
    [("action=open", False), ("normal=open", False), ("action=open lock=yes", True)],
)
@needs_engine
def test_a_switch_control_opens_what_the_engine_opens(
    more: str, closed: bool, tmp_path: Path
) -> None:
    found = imported(
        tmp_path,
        "new line.l1 bus1=m bus2=b linecode=oh length=1 units=mi",
        "new line.l2 bus1=m bus2=b linecode=oh length=2 units=mi",
        "new load.l bus1=b phases=3 kv=12.47 kw=900",
        f"new swtcontrol.sw switchedobj=line.l1 switchedterm=2 {more}",
    )
    assert [switch.closed for switch in found.feeder.switches] == [closed]
    assert max(row.largest_pu for row in differences(found)) < 1e-6


@needs_engine
def test_matrices_of_another_frequency_take_the_earth_with_them(tmp_path: Path) -> None:
    found = imported(
        tmp_path,
        "new linecode.fifty nphases=3 r1=.3 x1=.6 r0=.6 x0=1.8 c1=3 c0=2 units=km basefreq=50",
        "new line.l1 bus1=m bus2=b linecode=fifty length=9 units=km",
        "new load.l bus1=b.1 phases=1 kv=7.2 kw=900",
    )
    assert max(row.largest_pu for row in differences(found)) < 1e-6


@needs_engine
def test_capacitors_between_two_phases_agree(tmp_path: Path) -> None:
    found = imported(
        tmp_path,
        "new capacitor.one bus1=m.3.1 phases=1 conn=delta kv=12.47 kvar=100",
        "new capacitor.two bus1=m.2 bus2=m.3 phases=1 kv=12.47 kvar=70",
        "new capacitor.three bus1=m.1.2.3 phases=2 conn=delta kv=12.47 kvar=90",
    )
    agree(found, 1e-6)


@needs_engine
def test_generation_takes_the_multiplier_and_what_charges_is_refused(tmp_path: Path) -> None:
    plants = [f"new generator.{name} bus1=m kv=12.47 kw=500 pf=0.9" for name in ("v", "f")]
    found = imported(tmp_path, *plants, "edit generator.f status=fixed", "set genmult=0.4")
    assert [(der.name, der.kw) for der in found.feeder.ders] == [("v", 200.0), ("f", 500.0)]
    with pytest.raises(InputError, match="it charges"):
        imported(tmp_path, "new storage.s bus1=m kv=12.47 kwrated=90 kwhrated=200 state=charging")


@pytest.mark.parametrize(
    ("more", "wanted"),
    [("bus2=s.4.4.4", "bus2 must be earth"), ("sequence=neg", "sequence must be pos")],
)
@needs_engine
def test_a_source_that_the_model_does_not_have_is_refused(
    more: str, wanted: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=wanted):
        imported(tmp_path, f"edit vsource.source {more}")


@needs_engine
def test_lines_of_different_phases_between_two_buses_become_one(tmp_path: Path) -> None:
    found = imported(tmp_path, *CIRCUITS["lines side by side"])
    line = next(line for line in found.feeder.lines if line.name == "a")
    assert sorted(line.phases) == ["a", "b", "c"]
    assert {line.name for line in found.feeder.lines} == {"trunk", "a"}


@needs_engine
def test_what_nothing_feeds_is_left_out_and_counted(tmp_path: Path) -> None:
    found = imported(tmp_path, *CIRCUITS["dead phases"])
    assert [row.element for row in found.findings.of("not fed")] == ["load.island"]
    assert found.findings.of("not fed")[0].kw == 500
    load = next(load for load in found.feeder.loads if load.name == "l")
    assert load.phases == "ab"
    assert load.kw == pytest.approx(200)


REFUSED = (
    "new vsource.second basekv=12.47 bus1=far r1=1 x1=1 r0=1 x0=1",
    "new isource.harm bus1=m phases=3 amps=0",
    "new line.l1 bus1=m bus2=b linecode=oh length=1 units=mi",
    "new capacitor.series bus1=b bus2=c phases=3 kv=12.47 kvar=9000",
    "new load.behind bus1=c phases=3 kv=12.47 kw=350 pf=0.9",
    "new generator.roof bus1=m.1 phases=1 kv=7.2 kw=5 pf=1",
    "new line.turn bus1=b.1.2.3 bus2=d.2.3.1 linecode=oh length=1 units=mi",
    "new load.turned bus1=d phases=3 kv=12.47 kw=150 pf=0.9",
)
DROPPED = (
    "vsource.second",
    "isource.harm",
    "capacitor.series",
    "generator.roof",
    "line.turn",
)


@needs_engine
def test_refusals_come_all_at_once_with_their_load_and_how_to_drop_them(tmp_path: Path) -> None:
    with pytest.raises(InputError) as refused:
        imported(tmp_path, *REFUSED)
    text = str(refused.value)
    for element in DROPPED:
        assert f"--drop {element}" in text
    series = next(line for line in text.splitlines() if "'series'" in line)
    assert "350.0 kW" in series
    assert "series" in series
    together = next(line for line in text.splitlines() if "together" in line)
    assert "500.0 kW" in together  # behind the capacitor and behind the turned line


@needs_engine
def test_elements_of_every_class_that_hold_no_numbers_come_at_once(tmp_path: Path) -> None:
    with pytest.raises(InputError) as refused:
        imported(
            tmp_path,
            "new load.l bus1=m kv=12.47 kw=3 vminpu=(1 0 /)",
            "new transformer.t windings=2 buses=[m b] kvs=[12.47 4.16] %noloadloss=(1 0 /)",
        )
    text = str(refused.value)
    assert "load 'l' must hold finite numbers" in text
    assert "transformer 't' must hold finite numbers" in text


@needs_engine
def test_dropping_what_was_refused_is_enough(tmp_path: Path) -> None:
    found = imported(tmp_path, *REFUSED, drop=DROPPED)
    assert [row.element for row in found.findings.of("dropped")] == list(DROPPED)
    assert {load.name for load in found.feeder.loads} == {"la", "lb", "lc"}
    assert any("500.0 kW" in note for note in found.findings.notes)
    agree(found, 1e-6)


@needs_engine
def test_dropping_what_is_not_there_is_refused_with_what_is_near(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"--drop must be an element.*line\.trunk"):
        imported(tmp_path, drop=["line.trunc"])


@needs_engine
def test_lengths_without_a_unit_are_given_one_and_it_is_said(tmp_path: Path) -> None:
    found = imported(
        tmp_path,
        "new linecode.bare nphases=3 r1=0.05 x1=0.14 r0=0.1 x0=0.4 c1=0 c0=0",
        "new line.l1 bus1=m bus2=b linecode=bare length=2",
    )
    line = next(line for line in found.feeder.lines if line.name == "l1")
    assert line.length_km == pytest.approx(2 * 0.3048)
    assert any("without a unit" in note for note in found.findings.notes)
    agree(found, 1e-6)


@needs_engine
def test_the_feeder_file_written_is_the_feeder(tmp_path: Path) -> None:
    found = imported(tmp_path, *CIRCUITS["switches and fuses"], *REGULATORS["three"][:6])
    path = tmp_path / "small.toml"
    write_feeder(found.feeder, path)
    assert read_feeder(path) == found.feeder
    assert load_feeder(str(tmp_path / "small.dss")) == found.feeder


@needs_engine
def test_the_report_says_the_same_as_page_and_as_text(tmp_path: Path) -> None:
    found = imported(tmp_path, *REFUSED, drop=DROPPED)
    report = fidelity_report(found, differences(found))
    assert report["totals"]["load_kw"] == pytest.approx(650)
    assert report["load_kw_of_file"] == pytest.approx(650 + 350 + 150)
    for text in ("\n".join(report_text(report)), report_markdown(report)):
        assert "dropped" in text
        assert "snap" in text
        assert "direct" in text


@needs_engine
def test_a_wrong_feeder_does_not_agree(tmp_path: Path) -> None:
    """The comparison can fail: a leakage 1 % off shows."""
    found = imported(tmp_path, unit("delta wye"), "new load.x bus1=b phases=3 kv=4.16 kw=900")
    (row,) = found.feeder.inline_transformers
    off = replace(row, leakage_pu=row.leakage_pu * 1.01)
    wrong = replace(found, feeder=replace(found.feeder, inline_transformers=(off,)))
    worst: Difference = max(differences(wrong), key=lambda difference: difference.largest_pu)
    assert worst.largest_pu > 1e-5


def test_without_the_extra_it_says_which(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "dss", None)
    with pytest.raises(OpenPhaseError, match=r"openphase\[opendss\]"):
        start((), "small.dss")
