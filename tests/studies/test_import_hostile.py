"""``openphase import`` of files that are broken or mean harm: it ends and says why.

A small circuit is changed at random, in ways that people and programs get files wrong; and
given what ends the engine's own process.
"""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest

from openphase.model.errors import InputError
from openphase.model.importers.dss_feeder import import_opendss
from openphase.studies.cli import main

pytest.importorskip("dss", reason="needs the extra [opendss]")

CIRCUIT = """
clear
new circuit.small basekv=66 pu=1.02 mvasc3=800 mvasc1=700
new linecode.three nphases=3 r1=0.2 x1=0.4 r0=0.5 x0=1.2 c1=10 c0=6 units=km
new linecode.one nphases=1 rmatrix=[0.4] xmatrix=[0.6] cmatrix=[8] units=km
new transformer.sub windings=2 buses=[sourcebus m] conns=[delta wye] kvs=[66 11] kvas=[9000 9000]
~ xhl=8 %rs=[0.5 0.5]
new transformer.ra phases=1 windings=2 buses=[m.1 n.1] kvs=[6.35 6.35] kvas=[2000 2000] xhl=0.1
new transformer.rb phases=1 windings=2 buses=[m.2 n.2] kvs=[6.35 6.35] kvas=[2000 2000] xhl=0.1
new transformer.rc phases=1 windings=2 buses=[m.3 n.3] kvs=[6.35 6.35] kvas=[2000 2000] xhl=0.1
new regcontrol.ca transformer=ra winding=2 vreg=122 band=2 ptratio=52
new line.l1 bus1=n bus2=b linecode=three length=3 units=km
new line.l2 bus1=b.2 bus2=c.2 linecode=one length=2 units=km
new line.l3 bus1=b bus2=d linecode=three length=4 units=km
new load.q bus1=c.2 phases=1 kv=6.35 kw=80 pf=0.95 model=1
new load.w bus1=d phases=3 conn=delta kv=11 kw=300 kvar=100 model=2 daily=x
new capacitor.k bus1=d phases=3 kv=11 kvar=150
set voltagebases=[66 11]
calcvoltagebases
solve
""".strip()
VALUES = "0 -1 1e30 1e-30 (1 0 /) abc 1 2 4 [1 2 3] yes b.3.2.1 b.1.1.1 z.2 wye delta kft 1e9"


def import_small(folder: Path, text: str, *options: str) -> int:
    """Run the verb on a file, and return its exit code; nothing but what was asked for appears."""
    (folder / "small.dss").write_text(text)
    code = main(["import", str(folder / "small.dss"), "-o", str(folder / "out.toml"), *options])
    names = {path.name for path in folder.iterdir()}
    assert names <= {"small.dss", "out.toml"}
    assert ("out.toml" in names) == (code == 0)
    return code


def changed(rng: Random) -> str:
    """Return the circuit with a few things wrong."""
    lines = CIRCUIT.splitlines()
    for _ in range(rng.randrange(1, 4)):
        n = rng.randrange(2, len(lines))
        words = lines[n].split(" ")
        k = rng.randrange(len(words))
        what = rng.randrange(6)
        if what == 0:
            del lines[n]
        elif what == 1:
            lines.insert(rng.randrange(2, len(lines)), lines[n])
        elif what == 2:
            words[k] = words[k][: rng.randrange(len(words[k]) + 1)]
            lines[n] = " ".join(words)
        else:
            name = words[k].partition("=")[0]
            words[k] = f"{name}={rng.choice(VALUES.split(' '))}"
            lines[n] = " ".join(words)
    return "\n".join(lines)


def test_the_small_circuit_is_imported(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert import_small(tmp_path, CIRCUIT) == 0
    assert "small" in capsys.readouterr().out


def outcome(folder: Path, text: str) -> str:
    """Return why a file is refused, or how many lines its feeder has; nothing is written."""
    (folder / "small.dss").write_text(text)
    try:
        said = str(len(import_opendss(folder / "small.dss").feeder.lines))
    except InputError as error:
        said = str(error)
    assert [path.name for path in folder.iterdir()] == ["small.dss"]
    return said


@pytest.mark.parametrize("seed", range(12))
def test_changed_files_are_imported_or_refused(tmp_path: Path, seed: int) -> None:
    assert outcome(tmp_path, changed(Random(seed)))


@pytest.mark.parametrize(
    "lines",
    [
        "new linegeometry.g nconds=3 nphases=3\n~ cond=1 x=1 h=9 units=m",
        "new reactor.r bus1=b rmatrix=[1 | 1 1 | 1 1 1]",
        "new reactor.r bus1=b phases=3 rmatrix=(1 | 1 | 1) xmatrix=(0)",
        "new regcontrol.r transformer=sub winding=0",
        "new transformer.t phases=12 buses=[d e] kvs=[11 1]",
        "regcontrol.ca.delay=(1 0 /)",
        "load.q.kw=(1 0 /)",
        "transformer.sub.kvs=[(1 0 /) 11]",
        "new vsource.second bus1=d basekv=11",
        "line.l1.length=(0 0 /)",
    ],
)
def test_what_the_engine_cannot_bear_ends_neither_us_nor_in_a_traceback(
    tmp_path: Path, lines: str
) -> None:
    assert outcome(tmp_path, f"{CIRCUIT}\n{lines}\n")


@pytest.mark.parametrize(
    ("lines", "why"),
    [
        ("redirect ../other.dss", "leads out of the folder"),
        ("new generator.g bus1=d usermodel=evil.so", "load a library"),
        ("doscmd touch evil", "not obeyed"),
        ("new load.x zipv=(file=../other.dss)", "not name a file"),
        ("foo", "not known"),
        ("redirect small.dss", "in a circle"),
    ],
)
def test_harm_is_refused_by_the_verb(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], lines: str, why: str
) -> None:
    (tmp_path / "other.dss").write_text("secret")
    folder = tmp_path / "feeder"
    folder.mkdir()
    assert import_small(folder, f"{CIRCUIT}\n{lines}\n") == 2
    said = capsys.readouterr()
    assert why in said.err
    assert "secret" not in said.err + said.out
    assert sorted(path.name for path in tmp_path.iterdir()) == ["feeder", "other.dss"]


def test_what_would_write_or_show_is_left_out_by_the_verb(tmp_path: Path) -> None:
    lines = (
        "save circuit dir=x\nexport voltages y.csv\nshow powers\nset datapath=..\nplot profile\n"
    )
    traced = "regcontrol.ca.debugtrace=yes\nset recorder=yes\nnew monitor.m element=line.l1\n"
    folder = tmp_path / "feeder"
    folder.mkdir()
    assert import_small(folder, f"{CIRCUIT}\n{lines}{traced}") == 0
    assert [path.name for path in tmp_path.iterdir()] == ["feeder"]
