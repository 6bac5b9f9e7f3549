"""OpenDSS files as commands: what is handed over, what is left out, and where files may stand."""

from __future__ import annotations

from pathlib import Path

import pytest

from openphase.model.errors import InputError
from openphase.model.importers.dss_script import Script, read_script

CIRCUIT = "New Circuit.c basekv=12.47\n"


def script_of(folder: Path, text: str, **others: str) -> Script:
    """Return the script of ``text`` as the main file among ``others``."""
    for name, content in others.items():
        path = folder / name.replace("__", "/")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content)
    main = folder / "main.dss"
    main.write_text(text)
    return read_script(main)


def texts(script: Script) -> list[str]:
    """Return the commands as text, without the circuit."""
    return [command.text for command in script.commands if "Circuit" not in command.text]


def test_commands_have_full_words_and_their_place(tmp_path: Path) -> None:
    script = script_of(
        tmp_path,
        "! heading\nclear\nNEW circuit.c\nred more.txt\ncalcv\n",
        **{"more.txt": "new line.L1 a b len=3, phas = 2 ! rest\n\n~ linec=x"},
    )
    found = [(c.file, c.line, c.text) for c in script.commands]
    assert found == [
        ("main.dss", 2, "Clear"),
        ("main.dss", 3, "New Circuit.c"),
        ("more.txt", 1, "New Line.L1 Bus1=a Bus2=b Length=3 Phases=2"),
        ("more.txt", 3, "Edit Line.L1 LineCode=x"),
        ("main.dss", 5, "CalcVoltageBases"),
    ]
    assert script.files == ("main.dss", "more.txt")
    assert script.ignored == ()


@pytest.mark.parametrize(
    ("lines", "wanted"),
    [
        ("edit line.a length=2", ["Edit Line.a Length=2"]),
        ("line.a.length=2 phases=1", ["Edit Line.a Length=2 Phases=1"]),
        ("a.length=2", ["Edit Line.a Length=2"]),
        ("length=2", ["Edit Line.a Length=2"]),
        ("select line.a\nmore length=2", ["Edit Line.a Length=2"]),
        ("new object=line.b like=a", ["New Line.b Like=a"]),
        ("new 'line.b c' units=km", ['New "Line.b c" Units=km']),
        ("~ rmatrix=(1 | 2 3) length=(1 2 +)", ["Edit Line.a RMatrix=(1 | 2 3) Length=(1 2 +)"]),
        ("open line.a 1 2\nclose line.a term=1", ["Open Line.a 1 2", "Close Line.a 1"]),
        ("disable line.a\nenable line.*", ["Disable Line.a", "Enable Line.*"]),
        ("/* c\nnew line.z\n*/ new line.y\nlength=3", ["Edit Line.a Length=3"]),
        ("set maxiter=20 mode=snap", ["Set maxiterations=20", "Set mode=snapshot"]),
        ("solve controlmode=off", ["Set Controlmode=off"]),
        ("setkvbase b kvll=4.16", ["SetkVBase Bus=b kVLL=4.16"]),
        ("var @l=7 @m=[1 2]\nlength=@l", ["Edit Line.a Length=7"]),
        ("var @l=7\nxmatrix=[@l | 0 @l]", ["Edit Line.a XMatrix=[7 | 0 7]"]),
        ("bus1=@l.1", ["Edit Line.a Bus1=@l.1"]),
        ("~ linecode=x,,length=3", ["Edit Line.a LineCode=x"]),
    ],
)
def test_forms_of_the_language(tmp_path: Path, lines: str, wanted: list[str]) -> None:
    script = script_of(tmp_path, f"{CIRCUIT}new line.a\n{lines}\n")
    assert texts(script)[1:] == wanted


def test_what_follows_a_circuit_is_its_sources(tmp_path: Path) -> None:
    script = script_of(tmp_path, CIRCUIT + "~ pu=1.05\n")
    assert [c.text for c in script.commands] == [
        "New Circuit.c BasekV=12.47",
        "Edit Vsource.source pu=1.05",
    ]


def test_a_batch_is_edited_one_by_one(tmp_path: Path) -> None:
    lines = "new load.a1\nnew load.b\nnew load.a2\nbatchedit load.^a.* kw=3 daily=x\n"
    script = script_of(tmp_path, CIRCUIT + lines)
    assert texts(script)[3:] == ["Edit Load.a1 kW=3", "Edit Load.a2 kW=3"]


def test_catalogues_may_be_defined_twice_elements_not(tmp_path: Path) -> None:
    script = script_of(tmp_path, CIRCUIT + "new linecode.x r1=1\nnew linecode.X r1=2\n")
    assert texts(script) == ["New LineCode.x R1=1", "Edit LineCode.X R1=2"]
    with pytest.raises(InputError, match=r"main.dss:3: Load\.X must be defined once"):
        script_of(tmp_path, CIRCUIT + "new load.x\nnew load.X\n")


def test_what_describes_no_circuit_is_left_out_and_listed(tmp_path: Path) -> None:
    lines = [
        "new loadshape.d npts=2 mult=(file=../x.csv)",
        "~ csvfile=x.csv",
        "new load.a kw=1 daily=d yearly=(file=x) spectrum=s",
        "new load.b kw=2 daily=d",
        "new monitor.m element=load.a",
        "solve",
        "set datapath=/tmp editor=vi",
    ]
    script = script_of(tmp_path, CIRCUIT + "\n".join(lines))
    assert texts(script) == ["New Load.a kW=1", "New Load.b kW=2"]
    assert script.ignored == (
        "main.dss:2 and 1 more: class loadshape left out: a curve, no part of the circuit",
        "main.dss:4 and 1 more: Load.Daily left out: refers to a curve or asks for a record",
        "main.dss:4: Load.Yearly left out: refers to a curve or asks for a record",
        "main.dss:4: Load.Spectrum left out: refers to a curve or asks for a record",
        "main.dss:6: class monitor left out: only measures or controls",
        "main.dss:7: command Solve left out: only calculates, shows or writes",
        "main.dss:8: option Datapath left out: says nothing about the circuit",
        "main.dss:8: option editor left out: says nothing about the circuit",
    )


def test_coordinates_are_read_and_not_handed_over(tmp_path: Path) -> None:
    lines = "buscoords xy.csv\nlatlongcoords ll.csv\nsetbusxy bus=D x=7 y=8\n"
    others = {"xy.csv": "Bus, X, Y\nA, 1, 2\nB.1.2 3 4 ! c\nN, nan, 1\n", "ll.csv": "C,5,6\nE,1\n"}
    script = script_of(tmp_path, CIRCUIT + lines, **others)
    assert script.coordinates == {"a": (1, 2), "b": (3, 4), "c": (6, 5), "d": (7, 8)}
    assert texts(script) == []


def test_names_of_files_are_meant_as_on_their_writers_machine(tmp_path: Path) -> None:
    others = {
        "Sub__ONE.dss": "redirect ..\\sub\\two.DSS\nredirect three",
        "Sub__Two.dss": "new load.two",
        "Sub__three.dss": "new load.three",
        "four.dss": "new load.four",
    }
    script = script_of(tmp_path, CIRCUIT + "redirect SUB\\one.dss\nredirect four", **others)
    assert texts(script) == ["New Load.two", "New Load.three", "New Load.four"]
    assert script.files == ("main.dss", "Sub/ONE.dss", "Sub/Two.dss", "Sub/three.dss", "four.dss")


def test_compile_moves_the_place_from_which_names_count(tmp_path: Path) -> None:
    others = {"sub__a.dss": "new load.a", "sub__b.dss": "new load.b", "b.dss": "new load.c"}
    moved = script_of(tmp_path, CIRCUIT + "compile sub/a.dss\nredirect b.dss", **others)
    stayed = script_of(tmp_path, CIRCUIT + "redirect sub/a.dss\nredirect b.dss", **others)
    assert texts(moved)[1:] == ["New Load.b"]
    assert texts(stayed)[1:] == ["New Load.c"]


def test_a_catalogue_of_its_own_name_in_the_folder_above_is_read(tmp_path: Path) -> None:
    folder = tmp_path / "feeder"
    folder.mkdir()
    (tmp_path / "Codes.dss").write_text("new linecode.x r1=1\n~ x1=2\n")
    lines = CIRCUIT + "redirect codes.dss"
    script = script_of(folder, lines, **{"codes.dss": "redirect ../Codes.dss"})
    assert texts(script) == ["New LineCode.x R1=1", "Edit LineCode.x X1=2"]
    (folder / "codes.dss").unlink()
    (folder / "Codes.dss").symlink_to("../Codes.dss")
    assert texts(script_of(folder, lines)) == texts(script)


def test_clear_forgets_what_was_before(tmp_path: Path) -> None:
    lines = CIRCUIT + "new load.a\nsetbusxy a 1 2\nclear\nnew circuit.d\nnew load.a\n"
    script = script_of(tmp_path, lines)
    assert [c.text for c in script.commands][2:] == ["Clear", "New Circuit.d", "New Load.a"]
    assert script.coordinates == {}


def test_all_refusals_come_at_once(tmp_path: Path) -> None:
    lines = "foo\nnew line.a bar=1 baz=2\nnew thing.x\nset nothing=1\ncd ..\n"
    with pytest.raises(InputError) as caught:
        script_of(tmp_path, lines + "redirect none.dss")
    assert str(caught.value).splitlines() == [
        "main.dss:1: command 'foo' is not known",
        "main.dss:2: Line: bar is not a known property",
        "main.dss:2: Line: baz is not a known property",
        "main.dss:3: class 'thing' is not known or not read",
        "main.dss:4: option 'nothing' is not known, got '1'",
        "main.dss:5: command CD leaves the circuit's files and is not obeyed",
        "main.dss:6: file 'none.dss' is not in the folder",
        "7 faults",
    ]


def test_a_file_without_a_circuit_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"main\.dss: defines no circuit"):
        script_of(tmp_path, "clear\n! nothing\n")
    with pytest.raises(InputError, match="is not a file"):
        read_script(tmp_path / "none.dss")
    with pytest.raises(InputError, match="is not a file"):
        read_script(tmp_path)
