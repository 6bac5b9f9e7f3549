"""What can go wrong, said so that a user can put it right.

Input is never refused one fault at a time: checks add to a `Report`, which raises a
single `InputError` with every fault found.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import ClassVar, TypeVar

__all__ = ["Fault", "Gathered", "InputError", "KeyPath", "Locator", "OpenPhaseError", "Report"]

_T = TypeVar("_T")

KeyPath = tuple[str | int, ...]
"""A value's place in a document: ``("lines", 2, "length_km")``, arrays counted from 0."""

Locator = Callable[[KeyPath], int | None]
"""Gives the line number of a key path, None where it is unknown."""


class OpenPhaseError(Exception):
    """Root of every error this package raises on purpose."""

    exit_code: ClassVar[int] = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """One thing wrong with the input.

    Parameters
    ----------
    source
        The file, or whatever else the input came from; may be empty.
    line
        Line number counted from 1, None where there is none.
    where
        What is at fault, such as ``lines 'R2-R3': length_km``; may be empty.
    wanted
        The rule, so that it reads on from `where`: ``must be > 0``.
    found
        The offending value as the user wrote it, None where the rule says it all.

    Examples
    --------
    >>> where, wanted = "source: kv_ll", "must be > 0"
    >>> print(Fault(source="a.toml", line=7, where=where, wanted=wanted, found="-12.0"))
    a.toml:7: source: kv_ll must be > 0, got -12.0
    """

    source: str
    line: int | None
    where: str
    wanted: str
    found: str | None = None

    def __str__(self) -> str:
        place = self.source if self.line is None else f"{self.source}:{self.line}"
        rule = " ".join(part for part in (self.where, self.wanted) if part)
        got = "" if self.found is None else f", got {self.found}"
        return f"{place}: {rule}{got}" if place else f"{rule}{got}"


class InputError(OpenPhaseError):
    """The input is at fault; ``faults`` holds everything that is wrong with it.

    As text: one fault a line, then their number where there are several.
    """

    exit_code: ClassVar[int] = 2

    def __init__(self, faults: Iterable[Fault]) -> None:
        self.faults: tuple[Fault, ...] = tuple(faults)
        super().__init__(self.faults)

    @classmethod
    def single(cls, source: str, where: str, found: str | None, wanted: str) -> InputError:
        """Return the error for one fault that has no line, such as that of an argument.

        Examples
        --------
        >>> print(InputError.single("", "--jobs", "0", "must be > 0"))
        --jobs must be > 0, got 0
        """
        return cls([Fault(source=source, line=None, where=where, wanted=wanted, found=found)])

    def __str__(self) -> str:
        lines = [str(fault) for fault in self.faults]
        if len(lines) > 1:
            lines.append(f"{len(lines)} faults")
        return "\n".join(lines)


@dataclass(slots=True)
class Gathered:
    """Collects the faults of several inputs, so that those of all are told at once.

    Examples
    --------
    >>> gathered = Gathered()
    >>> def refuse() -> None:
    ...     raise InputError.single("", "--jobs", "0", "must be > 0")
    >>> gathered.of(refuse), gathered.of(lambda: 3)
    (None, 3)
    >>> gathered.raise_if_any()
    Traceback (most recent call last):
    openphase.model.errors.InputError: --jobs must be > 0, got 0
    """

    faults: list[Fault] = field(default_factory=list)

    def of(self, work: Callable[[], _T]) -> _T | None:
        """Return what ``work`` returns; None where it refuses its input, and keep why."""
        try:
            return work()
        except InputError as error:
            self.faults += error.faults
            return None

    def raise_if_any(self) -> None:
        """Raise InputError with all faults so far, if there are any."""
        if self.faults:
            raise InputError(self.faults)


def _unknown_line(path: KeyPath) -> None:
    """Locate nothing: the document was not read from a file."""


@dataclass(slots=True, kw_only=True)
class Report:
    """Collects the faults of one document.

    Parameters
    ----------
    source
        Name of the document in messages.
    document
        The document as nested tables; names in it make the messages readable.
    locate
        Gives the line of a key path.
    elsewhere
        Source and locator of those tables of the document that stand in files of their own.
    faults, paths
        What was found so far, and the key path of each fault.
    """

    source: str
    document: Mapping[str, object]
    locate: Locator = _unknown_line
    elsewhere: Mapping[str, tuple[str, Locator]] = field(default_factory=dict)
    faults: list[Fault] = field(default_factory=list)
    paths: list[KeyPath] = field(default_factory=list)

    def add(self, path: KeyPath, wanted: str, found: str | None = None) -> None:
        """Note that the value at ``path`` breaks the rule ``wanted``."""
        own = (self.source, self.locate)
        source, locate = self.elsewhere.get(str(path[0]), own) if path else own
        self.paths.append(path)
        self.faults.append(
            Fault(
                source=source,
                line=locate(path),
                where=describe_path(path, self.document),
                wanted=wanted,
                found=found,
            )
        )

    def raise_if_any(self) -> None:
        """Raise the faults file by file in the order of their lines, those without one last.

        Raises
        ------
        InputError
            If there is any fault.
        """
        if self.faults:
            files = [self.source, *(source for source, _ in self.elsewhere.values())]
            order = [(files.index(f.source), f.line is None, f.line or 0) for f in self.faults]
            ranked = sorted(range(len(order)), key=order.__getitem__)
            raise InputError(self.faults[n] for n in ranked)


def describe_path(path: KeyPath, document: Mapping[str, object]) -> str:
    """Return a key path as people read it, rows by their name where they have one.

    Examples
    --------
    >>> describe_path(("lines", 0, "length_km"), {"lines": [{"name": "R1-R2"}]})
    "lines 'R1-R2': length_km"
    >>> describe_path(("sections", 1), {"sections": [{}, {}]})
    'sections #2'
    >>> describe_path(("source", "kv_ll"), {})
    'source: kv_ll'
    """
    table: object = document
    text = ""
    for part in path:
        if isinstance(part, int):
            table = table[part] if isinstance(table, list) and part < len(table) else None
            name = table.get("name") if isinstance(table, Mapping) else None
            text += f" {name!r}" if isinstance(name, str) and name else f" #{part + 1}"
        else:
            table = table.get(part) if isinstance(table, Mapping) else None
            text += f": {part}" if text else part
    return text
