"""A hostile OpenDSS file can neither leave its folder, nor write, nor run anything.

Every case runs under Python's own audit of what is opened, listed or started: whatever the
file asks for, only its folder is read, and nothing changes anywhere.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from random import Random

import pytest

from openphase.model.errors import InputError
from openphase.model.importers.dss_script import Script, read_script
from openphase.model.importers.dss_tokens import parameters

CIRCUIT = "new circuit.c\nnew linecode.lc\nnew load.l\nnew line.a\n"
SECRET = "user secret-7391 password"
WATCHED = ("open", "os.", "shutil.", "subprocess.", "socket.", "ctypes.", "glob.")

_seen: list[tuple[str, str]] | None = None


def _watch(event: str, arguments: tuple[object, ...]) -> None:
    """Note what is opened, listed or started while a test asks for it."""
    if _seen is not None and event.startswith(WATCHED):
        what = arguments[0] if arguments else ""
        # A number is a file that is open already.
        if not isinstance(what, int):
            _seen.append((event, str(what)))


@pytest.fixture(scope="module", autouse=True)
def _audit() -> None:
    """Watch from now on; an audit hook cannot be taken away, but it then does nothing."""
    b"a".decode("utf-8-sig")  # loads the codec, which is a file too
    sys.addaudithook(_watch)


@contextmanager
def watched() -> Iterator[list[tuple[str, str]]]:
    """Give the list of what happens."""
    global _seen  # noqa: PLW0603 - an audit hook has no other way to speak
    _seen = []
    try:
        yield _seen
    finally:
        _seen = None


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a feeder's folder beside a folder that is none of its business."""
    outside = tmp_path / "outside"
    outside.mkdir()
    (outside / "secret.dss").write_text(SECRET)
    (tmp_path / "secret.dss").write_text(SECRET)
    (tmp_path / "codes.dss").write_text("new linecode.outside\n")
    inside = tmp_path / "feeder"
    (inside / "sub").mkdir(parents=True)
    (inside / "sub" / "plain.dss").write_text("! nothing\n")
    return inside


def read(folder: Path, text: str | bytes) -> Script:
    """Return the script of a main file, having seen that nothing else was touched."""
    main = folder / "main.dss"
    main.write_bytes(text if isinstance(text, bytes) else text.encode())
    before = {p: p.lstat().st_mtime_ns for p in folder.parent.rglob("*")}
    with watched() as seen:
        try:
            return read_script(main)
        finally:
            for event, what in list(seen):
                assert event in ("open", "os.listdir", "os.scandir"), (event, what)
                assert Path(what).is_relative_to(folder), (event, what)
            assert {p: p.lstat().st_mtime_ns for p in folder.parent.rglob("*")} == before


LEAVES_THE_FOLDER = [
    "redirect ../outside/secret.dss",
    "redirect ..\\outside\\secret.dss",
    "redirect sub/../../outside/secret.dss",
    "redirect ./.././outside/secret.dss",
    "redirect sub\\..\\..\\secret.dss",
    "redirect ../secret.dss",
    "redirect ../codes.dss",
    "redirect ../feeder/../secret.dss",
    "redirect /etc/passwd",
    "redirect '//etc/passwd'",
    "redirect !\nredirect ..",
    "redirect \\\\server\\share\\a.dss",
    "redirect C:\\a.dss",
    "redirect c:a.dss",
    "redirect ~/a.dss",
    "redirect /dev/zero",
    "redirect /proc/self/environ",
    "REDIR ../outside/secret.dss",
    "red ../outside/secret.dss",
    "comp ../outside/secret.dss",
    "compile (../outside/secret.dss)",
    "compile {../outside/secret.dss}",
    '"redirect" "../outside/secret.dss"',
    "[redirect] '../outside/secret.dss'",
    "redirect file=../outside/secret.dss",
    "buscoords ../outside/secret.dss",
    "busc /etc/passwd",
    "latlongcoords ..\\outside\\secret.dss",
    "var @f=../outside/secret.dss\nredirect @f",
    "var @c=redirect\n@c ../outside/secret.dss",
    "var @d=..\nvar @f={../outside/secret}\nredirect @f.dss",
    "compile sub/plain.dss\nredirect ../../outside/secret.dss",
    "/* a comment\n*/\nredirect ../outside/secret.dss",
    "redirect link.dss",
    "redirect LINK.DSS",
    "redirect linked/secret.dss",
    "redirect linked\\SECRET.dss",
    "redirect secret.dss",
    "buscoords link.dss",
]


@pytest.mark.parametrize("lines", LEAVES_THE_FOLDER)
def test_nothing_leaves_the_folder(folder: Path, lines: str) -> None:
    (folder / "link.dss").symlink_to("../outside/secret.dss")
    (folder / "linked").symlink_to("../outside")
    (folder / "secret.dss").symlink_to("../outside/secret.dss")
    with pytest.raises(InputError, match=r"leads out of the folder|is not in the folder") as caught:
        read(folder, f"{CIRCUIT}{lines}\n")
    assert "7391" not in str(caught.value)


def test_from_the_folder_above_only_catalogues_are_read_and_nothing_is_quoted(
    tmp_path: Path,
) -> None:
    folder = tmp_path / "feeder"
    folder.mkdir()
    (folder / "codes.dss").write_text("redirect ../codes.dss")
    (folder / "main.dss").write_text(CIRCUIT + "redirect codes.dss")
    hidden = ["s3cret", "new line.s3cret", "new linecode.a r1=1 s3cret=2", "redirect s3cret.dss"]
    hidden += ["new linecode.x r1=(file=s3cret)", "line.a.length=7391", "set loadmult=3"]
    hidden += ["new linecode.ok r1=1 nphases=7391", "edit linecode.s3cret r1=1", "~ x=1", "clear"]
    for line in hidden:
        (tmp_path / "codes.dss").write_text(line)
        with pytest.raises(InputError) as caught:
            read_script(folder / "main.dss")
        text = str(caught.value)
        assert "s3cret" not in text, line
        assert "7391" not in text, line


RUNS_OR_LOADS = [
    ("doscmd rm -rf .", "is not obeyed"),
    ("DOSC touch x", "is not obeyed"),
    ("cd ..", "is not obeyed"),
    ("connect 1.2.3.4", "is not obeyed"),
    ("newactor", "is not obeyed"),
    ("clone 3", "is not obeyed"),
    ("reduce", "changes the circuit"),
    ("distribute kw=1 file=x.dss", "changes the circuit"),
    ("obfuscate", "changes the circuit"),
    ("new generator.g usermodel=evil.dll", "load a library"),
    ("new generator.g kw=3 userm=evil.dll", "load a library"),
    ("new generator.g\n~ shaftmodel=evil.dll", "load a library"),
    ("new generator.g\ngenerator.g.shaftdata=(x)", "load a library"),
    ("new generator.g " + "1 " * 31, "load a library"),
    ("new pvsystem.p userdata={file=x}", "load a library"),
    ("new storage.s dynadll=evil.so", "load a library"),
    ("new storage.s DYNAD=evil.so", "load a library"),
    ("new capcontrol.k usermodel=evil", "load a library"),
    ("new generator.g1\nbatchedit generator.g. usermodel=x", "load a library"),
    ("new load.m zipv=(file=../outside/secret.dss)", "not name a file"),
    ("new linecode.m rmatrix=[sngfile=/etc/passwd]", "not name a file"),
    ('new linecode.m rmatrix="dblfile = x"', "not name a file"),
    ("new linegeometry.m x={File=x.csv}", "not name a file"),
    ("new transformer.t buses=(name=x)", "must not hold '='"),
    ("set voltagebases=(file=../outside/secret.dss)", "not name a file"),
    ("setkvbase bus=(file=x) kvll=1", "not name a file"),
    ("new 'load.x=(file=y)'", "must not hold '='"),
    ("set element=load.l", "out of sight"),
    ("set class=load", "out of sight"),
    ("set allowduplicates=yes", "rename them"),
    ("set cktmodel=positive", "must be multiphase"),
    ("redirect @lastfile", "engine's own"),
    ("new load.x bus1=@result", "engine's own"),
    ("var @a=@lastexportfile", "engine's own"),
    ("var a=b", "begins with @"),
]


@pytest.mark.parametrize(("lines", "why"), RUNS_OR_LOADS)
def test_nothing_is_run_or_loaded(folder: Path, lines: str, why: str) -> None:
    with pytest.raises(InputError, match=re.escape(why)):
        read(folder, f"{CIRCUIT}{lines}\n")


WRITES = """
save circuit dir=../outside
sav class=load file=x
export voltages ../outside/x.csv
exp summary x.csv
show voltages
plot profile
dump
dump debug
fileedit main.dss
formedit load.l
cvrtloadshapes type=sng
uuids ../outside/secret.dss
summary
closedi
comparecases a b
di_plot x
yearlycurves a
alignfile ../outside/secret.dss
visualize what=voltages element=line.a
_showcontrolqueue
exportoverloads
sample
help
set datapath=../outside
set recorder=yes
set editor=/bin/sh
set log=yes
set querylog=yes
set casename=../x demandinterval=yes diverbose=yes
set registryupdate=yes
set dssvisualizationtool=/bin/sh
new monitor.m element=line.a
monitor.m.action=save
new energymeter.m element=line.a
new regcontrol.r debugtrace=yes eventlog=yes
new generator.g debugtrace=yes dynamiceq=x
new relay.r debugt=y
new loadshape.s csvfile=../outside/secret.dss
new loadshape.t action=dblsave mult=(file=/etc/passwd)
new tcc_curve.t c_array=(file=/etc/passwd)
new xycurve.x csvfile=/etc/passwd
new spectrum.s csvfile=/etc/passwd
new storagecontroller.s
new dynamicexp.d
""".strip().splitlines()


@pytest.mark.parametrize("line", WRITES)
def test_nothing_is_written(folder: Path, line: str) -> None:
    lines = [line]
    if line.startswith("monitor"):
        lines = ["new monitor.m", line]
    script = read(folder, CIRCUIT + "\n".join(lines) + "\n")
    handed = [c.text for c in script.commands[4:]]
    assert all(re.fullmatch(r"New (RegControl|Generator|Relay)\.\w", text) for text in handed)
    assert any(":5" in text or ":6" in text for text in script.ignored)


ENDLESS = {
    "itself": ("redirect main.dss", "in a circle"),
    "each other": ("redirect b.dss", "in a circle"),
    "by another name": ("redirect SUB\\..\\Main.dss", "in a circle"),
    "by a link": ("redirect again.dss", "in a circle"),
    "deep": ("redirect d0.dss", "files deep"),
    "wide": ("redirect w0.dss", "at most"),
    "a pipe": ("redirect pipe.dss", "no ordinary file"),
    "a folder": ("redirect sub", "no ordinary file"),
    "a circle of links": ("redirect circle.dss", "folder|cannot be read"),
    "no name": ("redirect ..", "leads out"),
    "the folder": ("redirect ./", "no file name"),
    "a long name": ("redirect " + "x" * 5_000, "no file name"),
}


@pytest.mark.parametrize("case", ENDLESS)
def test_reading_ends(folder: Path, case: str) -> None:
    (folder / "b.dss").write_text("redirect sub\\c.dss")
    (folder / "sub" / "c.dss").write_text("redirect ../b.dss")
    (folder / "again.dss").symlink_to("main.dss")
    (folder / "circle.dss").symlink_to("circle.dss")
    os.mkfifo(folder / "pipe.dss")
    for n in range(60):
        (folder / f"d{n}.dss").write_text(f"redirect d{n + 1}.dss")
    for n in range(30):
        (folder / f"w{n}.dss").write_text(f"redirect w{n + 1}.dss\n" * 8)
    (folder / "w30.dss").write_text("")
    lines, why = ENDLESS[case]
    with pytest.raises(InputError, match=why):
        read(folder, CIRCUIT + lines)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (b"new circuit.c\x00\nnew load.a\x00b\n", "no text file: byte 0 in line 2"),
        (b"new circuit.c\nnew load.a\x1b[2J\n", "no text file: byte 27 in line 2"),
        (b"\x7fELF" + bytes(range(256)) * 40, "no text file"),
        (b"\xff\xfe" + "new circuit.c".encode("utf-16-le"), "no text file"),
        (b"PK\x03\x04" + bytes(500), "no text file"),
        (b"\n" * 600_000, "at most 500,000 lines"),
        (b"x\n" * 300, "is not known"),
        (b"new circuit.c\n" + b"!" * (65 * 2**20), "larger than"),
        (b"new circuit.c\nnew load." + b"n" * 300, "1 to 200 characters"),
        (b"new circuit.c\nnew load.", "1 to 200 characters"),
        (b"new circuit.c\nnew load.a zipv=[" + b"1 " * 30_000 + b"]", "at most 20,000"),
        (b"new circuit.c\nnew circuit.d", "must be the only one"),
        (b"new circuit.c\nnew solution.s", "is not known"),
        (b"new circuit.c\nnew line.a phases=99999999999999999999", "whole number"),
        (b"new circuit.c\nnew line.a phases=(1000 1000 *)", "whole number"),
        (b"new circuit.c\nnew transformer.a windings=1000", "from 0 to 20"),
        (b"new circuit.c\nnew transformer.a windings=-1", "from 0 to 20"),
        (b"new circuit.c\nnew linegeometry.a ncond=1e9", "from 0 to 60"),
        (b"new circuit.c\nnew capacitor.a numsteps=nan", "from 0 to 1,000"),
        (b"new circuit.c\nnew line.a bus1=b.99999999999", "nodes from 0 to 99"),
        (b"new circuit.c\nnew line.a bus1=b" + b".1" * 50, "at most 20 nodes"),
        (b"new circuit.c\nnew load.a kv=1e999", "must be finite"),
        (b"new circuit.c\nnew load.a zipv=[1 0 -Inf 0]", "must be finite"),
        (b"new circuit.c\nset loadmult=nan", "must be finite"),
        (b"new circuit.c\nset maxiter=1000000000", "from 0 to 10,000"),
        (b"new circuit.c\nopen load.x 1", "is not defined"),
        (b"new circuit.c\nnew load.x\nopen load.x 1;2", "terminal and conductor"),
        (b"new circuit.c\nbatchedit load.(a+)+$ kw=1", "must be plainer"),
        (b"new circuit.c\nbatchedit load.[ kw=1", "is not one"),
        (b"new circuit.c\nbatchedit load..*.*.*.*.* kw=1", "must be plainer"),
        (b"~ kw=3", "must follow an element"),
        (b"kw=3", "belongs to no element"),
        (b"edit load.x kw=3", "is not defined"),
        ("ｒedirect x".encode(), "is not known"),
        ("new circuit.c\nnew lo\u0430d.x".encode(), "is not known or not read"),
    ],
)
def test_nonsense_is_refused(folder: Path, text: bytes, why: str) -> None:
    with pytest.raises(InputError, match=why):
        read(folder, text)


def test_odd_letters_and_names_do_no_harm(folder: Path) -> None:
    script = read(folder, "new circuit.c\nnew load.nan \u212aw=1e300 bus1=inf\n")
    assert script.commands[-1].text == "New Load.nan kW=1e300 Bus1=inf"


def test_messages_show_no_control_characters(folder: Path) -> None:
    with pytest.raises(InputError) as caught:
        read(folder, "a\u202eb\u2028c \u009b31m\n")
    assert all(c.isprintable() or c == "\n" for c in str(caught.value))


def test_so_many_faults_are_enough(folder: Path) -> None:
    with pytest.raises(InputError) as caught:
        read(folder, "".join(f"foo{n}\n" for n in range(5_000)))
    assert len(caught.value.faults) == 100


WORDS = """
new edit ~ redirect compile var save @v set solve line load linecode transformer circuit .
. a b kw bus1 rmatrix usermodel file = = = ( ) [ ] { } " ' ! // /* */ ../x.dss 1 -3 @v @result
daily batchedit * mode snap \\ / | , %
"""


def test_whatever_the_lines_are_only_plain_commands_come_out(folder: Path) -> None:
    """Lines of random words: what is handed over has full words and no ``=`` in a value."""
    rng = Random(3)
    words = WORDS.split()
    beginnings = ["", "~ ", "edit line.a ", "new load.x ", "new linecode.x ", "var @v=", "line.a."]
    handed = 0
    for _ in range(1_500):
        line = rng.choice(beginnings)
        line += "".join(rng.choice(words) + rng.choice(["", " "]) for _ in range(rng.randrange(7)))
        try:
            commands = read_script_of(folder, CIRCUIT + line).commands[4:]
        except InputError:
            continue
        for command in commands:
            handed += 1
            first, *rest = parameters(command.text)
            assert first.value in ("New", "Edit", "Set", "Clear", "Open", "Close")
            assert "\n" not in command.text
            for parameter in rest:
                assert "=" not in parameter.value
                assert parameter.name.lower() not in ("usermodel", "daily")
                assert re.split(r"[.^]", parameter.value)[0] != "@result"
    assert handed > 200


def read_script_of(folder: Path, text: str) -> Script:
    """Return the script of a main file."""
    (folder / "main.dss").write_text(text)
    return read_script(folder / "main.dss")
