r"""The folder of an OpenDSS file: the only place that is read, and only ordinary text files.

Names are looked up as those who wrote the files meant them: ``\\`` separates like ``/``, and
upper and lower case do not matter.
"""

from __future__ import annotations

import os
import re
import stat
from dataclasses import dataclass, field
from pathlib import Path

__all__ = ["Folder", "NotReadError", "TextFile"]

_CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f]")
_DRIVE = re.compile(r"^[A-Za-z]:")
_LINE_END = re.compile(r"\r\n|\n|\r")
_SHOWN_CHARS = 80


class NotReadError(Exception):
    """A file is not read; the text says why and never quotes the file."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TextFile:
    """A file that may be read.

    Parameters
    ----------
    path
        The file itself, links followed.
    label
        Its name in messages: relative to the folder.
    directory
        The place in the folder from which names in this file count, as its parts.
    beside
        Whether it stands beside the folder and may hold catalogues only.
    """

    path: Path
    label: str
    directory: tuple[str, ...]
    beside: bool


@dataclass(slots=True, kw_only=True)
class Folder:
    """A folder out of which nothing is read.

    One way leads out of it: a file, or a link, that points to a file of its own name in the
    folder above. So collections share their line codes. What is read that way may only
    define catalogues.

    Parameters
    ----------
    root
        The folder, links followed.
    max_file_bytes, max_bytes
        Largest size of a file, and of all files together, each counted as often as read.
    bytes_read
        What was read so far.
    """

    root: Path
    max_file_bytes: int
    max_bytes: int
    bytes_read: int = 0
    _entries: dict[Path, dict[str, list[str]]] = field(default_factory=dict)

    def find(self, name: str, directory: tuple[str, ...], naming: str = "") -> TextFile:
        """Return the file that ``name`` means when written in a file of ``directory``.

        Parameters
        ----------
        name
            The name as written.
        directory
            The place from which it counts, as parts below the root.
        naming
            The file in which it is written, as parts below the root joined by ``/``.

        Raises
        ------
        NotReadError
            If there is no such file, or it may not be read.
        """
        parts = self._below_root(name, directory, naming)
        for last in (parts[-1], *([f"{parts[-1]}.dss"] if "." not in parts[-1] else [])):
            path = self._existing((*parts[:-1], last))
            if path is not None:
                break
        else:
            raise NotReadError("is not in the folder")
        target = Path(os.path.realpath(path))
        beside = not target.is_relative_to(self.root)
        if beside and (target.parent, target.name) != (self.root.parent, path.name):
            raise NotReadError("leads out of the folder")
        label = f"../{target.name}" if beside else path.relative_to(self.root).as_posix()
        place = () if beside else path.parent.relative_to(self.root).parts
        return TextFile(path=target, label=label, directory=place, beside=beside)

    def read_lines(self, file: TextFile) -> list[str]:
        """Return the lines of a file.

        Raises
        ------
        NotReadError
            If it is no ordinary text file or too large.
        """
        try:
            # No link may take the file's place meanwhile, and a pipe must not make us wait.
            flags = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
            handle = os.open(file.path, flags)
        except OSError as error:
            raise NotReadError(f"cannot be read: {error.strerror}") from None
        status = os.fstat(handle)
        if not stat.S_ISREG(status.st_mode):
            os.close(handle)
            raise NotReadError("is no ordinary file")
        with os.fdopen(handle, "rb") as stream:
            if status.st_size > self.max_file_bytes:
                raise NotReadError(f"is larger than {self.max_file_bytes:,} bytes")
            data = stream.read(self.max_file_bytes)
        self.bytes_read += len(data)
        if self.bytes_read > self.max_bytes:
            raise NotReadError(f"makes all files together larger than {self.max_bytes:,} bytes")
        return _lines(data)

    def _below_root(self, name: str, directory: tuple[str, ...], naming: str) -> tuple[str, ...]:
        """Return ``name`` as parts below the root."""
        text = name.replace("\\", "/")
        if not text or len(text) > 1_000 or _CONTROL.search(text):
            raise NotReadError("is no file name")
        if text.startswith(("/", "~")) or _DRIVE.match(text):
            raise NotReadError("leads out of the folder")
        parts = list(directory)
        for part in text.split("/"):
            if part == "..":
                if not parts:
                    return self._beside(text, naming)
                parts.pop()
            elif part not in ("", "."):
                parts.append(part)
        if not parts:
            raise NotReadError("is no file name")
        return tuple(parts)

    def _beside(self, text: str, naming: str) -> tuple[str, ...]:
        """Return the parts of a file of the naming file's own name in the folder above."""
        if text.removeprefix("./").lower() != f"../{naming}".lower():
            raise NotReadError("leads out of the folder")
        return ("..", naming)

    def _existing(self, parts: tuple[str, ...]) -> Path | None:
        """Return the path of what ``parts`` mean whatever their case, None if there is none."""
        path = self.root
        if parts[0] == "..":
            path, parts = self.root.parent, parts[1:]
        for part in parts:
            found = self._names(path).get(part.lower(), [])
            if part not in found:
                if len(found) > 1:
                    shown = ", ".join(sorted(found))[:_SHOWN_CHARS]
                    raise NotReadError(f"may be any of {shown}")
                if not found:
                    return None
            path /= part if part in found else found[0]
        return path

    def _names(self, directory: Path) -> dict[str, list[str]]:
        """Return what a directory holds, by name in lower case."""
        if directory not in self._entries:
            names: dict[str, list[str]] = {}
            # A directory that is a link may lead anywhere: it is not even listed.
            if directory == self.root.parent or Path(os.path.realpath(directory)).is_relative_to(
                self.root
            ):
                try:
                    for name in (entry.name for entry in directory.iterdir()):
                        names.setdefault(name.lower(), []).append(name)
                except OSError:
                    names = {}
            self._entries[directory] = names
        return self._entries[directory]


def _lines(data: bytes) -> list[str]:
    """Return the lines of a text file's bytes."""
    data = data.removesuffix(b"\x1a")  # how old editors ended a file
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    lines = _LINE_END.split(text)
    if _CONTROL.search(text):
        # Some programs leave a zero byte at a line's end; anything else is no text.
        lines = [line.rstrip("\x00") for line in lines]
        for number, line in enumerate(lines, start=1):
            if found := _CONTROL.search(line):
                raise NotReadError(f"is no text file: byte {ord(found.group())} in line {number}")
    return lines
