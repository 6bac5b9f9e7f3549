"""What an import found and did, element by element; the fidelity report is made of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

__all__ = ["Fate", "Finding", "Findings"]

Fate = Literal["as it is", "approximated", "refused", "dropped", "not fed", "state kept"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """What became of an element of the file, and how or why."""

    kind: str
    name: str
    fate: Fate
    how: str = ""
    kw: float = 0.0  #: load that it carries, or that goes with it

    @property
    def element(self) -> str:
        """The name to give to ``--drop``."""
        return f"{self.kind}.{self.name}"


@dataclass(slots=True, kw_only=True)
class Findings:
    """Collects findings, and sentences on the whole circuit."""

    rows: list[Finding] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def add(self, kind: str, name: str, fate: Fate, how: str = "", *, kw: float = 0.0) -> None:
        """Note what became of an element."""
        self.rows.append(Finding(kind=kind, name=name, fate=fate, how=how, kw=kw))

    def note(self, sentence: str) -> None:
        """Note something that holds for the circuit."""
        self.notes.append(sentence)

    def of(self, fate: Fate) -> list[Finding]:
        """Return the findings of one fate."""
        return [row for row in self.rows if row.fate == fate]
