"""Real files read here make the circuit that the engine itself compiles from them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from openphase.model.importers.dss_script import read_script

FEEDERS = Path(__file__).resolve().parents[4] / "shared" / "feeders"
IEEE = "electricdss-tst/Version8/Distrib/IEEETestCases"
EPRI = "electricdss-tst/Version8/Distrib/EPRITestCircuits"
SMART_DS = "disco/tests/data/upgrade-models/sb10_p12uhs0_1247_trans_301/p12udt1277/OpenDSS"
MAIN_FILES = [
    f"{IEEE}/4Bus-YY-Bal/4Bus-YY-Bal.DSS",
    f"{IEEE}/4Bus-DY-Bal/4Bus-DY-Bal.DSS",
    f"{IEEE}/4Bus-GrdYD-Bal/4Bus-GrdYD-Bal.DSS",
    f"{IEEE}/13Bus/IEEE13Nodeckt.dss",
    f"{IEEE}/34Bus/ieee34Mod1.dss",
    f"{IEEE}/37Bus/ieee37.dss",
    f"{IEEE}/123Bus/IEEE123Master.dss",
    f"{EPRI}/ckt5/Master_ckt5.dss",
    f"{EPRI}/epri_dpv/K1/Master_NoPV.dss",
    f"{SMART_DS}/Master.dss",
    "Tutorial-DERHostingCapacity-4/Network-CRE21/Master.txt",
]
LEFT_OUT = ("monitor.", "energymeter.")
# What a solution changes, what refers to curves, and matrices that the engine never filled.
NOT_COMPARED = {"WdgCurrents", "Tap", "Taps", "TapNum", "States", "Yearly", "Daily", "Duty"}
UNSET = {"capacitor": {"CMatrix", "FaultRate", "pctPerm"}, "reactor": {"RMatrix", "XMatrix"}}


def fresh_engine() -> Any:
    """Return an engine that nobody else uses, or skip."""
    dss = pytest.importorskip("dss", reason="needs the extra [opendss]").dss.NewContext()
    dss.AllowForms = False
    dss.AllowEditor = False
    dss.AllowChangeDir = False
    return dss


def elements(dss: Any) -> dict[str, dict[str, str]]:
    """Return the properties of every element."""
    circuit = dss.ActiveCircuit
    found = {}
    for name in circuit.AllElementNames:
        circuit.SetActiveElement(name)
        element = circuit.ActiveDSSElement
        skipped = NOT_COMPARED | UNSET.get(name.partition(".")[0].lower(), set())
        names = [n for n in element.AllPropertyNames if n not in skipped]
        found[name.lower()] = {n: element.Properties(n).Val for n in names}
    return found


@pytest.mark.parametrize("file", MAIN_FILES)
def test_the_circuit_is_the_engines_own(file: str) -> None:
    if not FEEDERS.is_dir():
        pytest.skip("needs ../shared/feeders")
    ours, theirs = fresh_engine(), fresh_engine()
    script = read_script(FEEDERS / file)
    for command in script.commands:
        ours.Text.Command = command.text
    theirs.Text.Command = f'compile "{FEEDERS / file}"'
    found, wanted = elements(ours), elements(theirs)
    assert found.keys() == {name for name in wanted if not name.startswith(LEFT_OUT)}
    for name, properties in found.items():
        assert properties == wanted[name], name
    buses, same = ours.ActiveCircuit.AllBusNames, theirs.ActiveCircuit.AllBusNames
    assert sorted(buses) == sorted(same)
    nodes, same = ours.ActiveCircuit.AllNodeNames, theirs.ActiveCircuit.AllNodeNames
    assert sorted(nodes) == sorted(same)
