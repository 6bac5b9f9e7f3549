"""Read OpenDSS files into commands that are safe to hand to an engine.

A .dss file is a program: it can read and write files anywhere, start others and load
libraries. So none is handed over. The files are read here, inside their own folder, and each
line is taken apart and written anew from what was understood of it. What describes the
circuit goes on; what only calculates, shows or records is left out and listed; anything else
is refused, all refusals at once.
"""

from __future__ import annotations

import os
import shlex
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from ..errors import Fault, InputError
from .dss_choices import fits
from .dss_folder import Folder, NotReadError, TextFile
from .dss_notes import Place
from .dss_obey import obey
from .dss_rules import CLASSES, WITHOUT_MODEL
from .dss_state import Command, State

__all__ = ["Command", "Script", "read_script"]

MAX_DEPTH = 40
MAX_FILES = 5_000
MAX_LINES = 500_000
MAX_FILE_BYTES = 64 * 2**20
MAX_BYTES = 128 * 2**20


@dataclass(frozen=True, slots=True, kw_only=True)
class Script:
    """The circuit of an OpenDSS file and the files it names.

    Parameters
    ----------
    commands
        To be handed to the engine one after the other.
    coordinates
        x and y of buses, by their name in lower case.
    ignored
        What was left out, with its place and why.
    files
        The files that were read, relative to the folder, in the order of their first use.
    """

    commands: tuple[Command, ...]
    coordinates: dict[str, tuple[float, float]]
    ignored: tuple[str, ...]
    files: tuple[str, ...]


def read_script(path: Path, *, drop: Collection[str] = ()) -> Script:
    """Return the commands of an OpenDSS file and of the files it names.

    Nothing outside of the file's folder is read, but for catalogues such as line codes in a
    file of the folder above to which one of the same name in the folder points. Nothing is
    written and nothing is run.

    Parameters
    ----------
    path
        The main file.
    drop
        Elements that will be left out: where lines are refused, elements of classes without a
        model are told with them, but for these.

    Raises
    ------
    InputError
        If any line of any file is refused.
    """
    main = Path(os.path.realpath(path))
    if not main.is_file():
        raise InputError.single(str(path), "", None, "is not a file")
    folder = Folder(root=main.parent, max_file_bytes=MAX_FILE_BYTES, max_bytes=MAX_BYTES)
    file = TextFile(path=main, label=main.name, directory=(), beside=False)
    state = State()
    reader = _Reader(folder=folder, state=state, open_files=[], files={}, lines=0)
    reader.read(file, Place(main.name, None))
    if not state.has_circuit and not state.notes.faults:
        state.notes.refuse(Place(main.name, None), "", "defines no circuit")
    if state.notes.faults:
        _tell_classes(state, main.name, drop)
    state.notes.raise_if_any()
    return Script(
        commands=tuple(state.commands),
        coordinates=state.coordinates,
        ignored=state.notes.left_out(),
        files=tuple(reader.files),
    )


def _tell_classes(state: State, file: str, drop: Collection[str]) -> None:
    """Add to refused lines what an import would refuse next."""
    for kind in WITHOUT_MODEL:
        names = [
            name
            for name in state.names.get(CLASSES[kind], {})
            if not any(fits(f"{kind}.{name}", pattern) for pattern in drop)
        ]
        if names:
            drops = " ".join(f"--drop {shlex.quote(f'{kind}.{name}')}" for name in names)
            rule = f"cannot be imported: a class that has no model; {drops}"
            shown = ", ".join(map(repr, names[:5]))
            more = f" and {len(names) - 5} more" if len(names) > 5 else ""
            fault = Fault(source=file, line=None, where=f"{kind} {shown}{more}", wanted=rule)
            state.notes.faults.append(fault)


@dataclass(slots=True, kw_only=True)
class _Reader:
    """Reads files that name files."""

    folder: Folder
    state: State
    open_files: list[Path]
    files: dict[str, int]
    lines: int

    def read(self, file: TextFile, place: Place) -> None:
        """Obey the lines of ``file``, which was named at ``place``."""
        notes = self.state.notes
        if file.path in self.open_files:
            notes.refuse(place, f"file {file.label!r}", "names itself in a circle")
            return
        if len(self.open_files) >= MAX_DEPTH:
            notes.refuse(place, f"file {file.label!r}", f"stands more than {MAX_DEPTH} files deep")
            return
        self.files[file.label] = self.files.get(file.label, 0) + 1
        try:
            lines = self.folder.read_lines(file)
        except NotReadError as error:
            notes.refuse(place, f"file {file.label!r}", str(error))
            return
        self.lines += len(lines)
        if self.lines > MAX_LINES or sum(self.files.values()) > MAX_FILES:
            wanted = f"must have at most {MAX_LINES:,} lines in {MAX_FILES:,} files"
            notes.refuse(place, "the circuit", wanted)
            raise InputError(notes.faults)
        before = self.state.directory
        self.open_files.append(file.path)
        self.state.directory = file.directory
        self._obey(file, lines)
        self.state.directory = before
        self.open_files.pop()

    def _obey(self, file: TextFile, lines: list[str]) -> None:
        """Obey lines, but for comments between lines that begin with /* and hold */."""
        in_comment = False
        for number, line in enumerate(lines, start=1):
            in_comment = in_comment or line.startswith("/*")
            if in_comment:
                in_comment = "*/" not in line
                continue
            place = Place(file.label, number, file.beside)
            named = obey(self.state, place, line)
            if named is None:
                continue
            try:
                found = self.folder.find(named.name, self.state.directory, file.label)
                if named.coordinates_swapped is None:
                    self.read(found, place)
                    if named.moves:
                        self.state.directory = found.directory
                elif found.beside:
                    raise NotReadError("leads out of the folder")
                else:
                    rows = self.folder.read_lines(found)
                    self.state.take_coordinates(rows, swapped=named.coordinates_swapped)
            except NotReadError as error:
                self.state.notes.refuse(place, f"file {named.name!r}", str(error))
