"""What reading an OpenDSS file has to say: faults, and what was left out, each with its place."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..errors import Fault, InputError

__all__ = ["MAX_FAULTS", "Notes", "Place"]

MAX_FAULTS = 100
"""With so many faults reading stops: more would help nobody."""

_SHOWN_CHARS = 60


@dataclass(frozen=True, slots=True)
class Place:
    """A line of a file; of a secret one, nothing is quoted."""

    file: str
    line: int | None
    secret: bool = False


@dataclass(slots=True)
class Notes:
    """Collects faults, and what was left out, the latter once a file with its number."""

    faults: list[Fault] = field(default_factory=list)
    _left_out: dict[tuple[str, str, str], list[int]] = field(default_factory=dict)

    def refuse(self, place: Place, where: str, wanted: str, found: str | None = None) -> None:
        """Note that something in a line is not accepted.

        Raises
        ------
        InputError
            If there are too many faults to go on.
        """
        if place.secret:
            where, found = "a line", None
        self.faults.append(
            Fault(
                source=place.file,
                line=place.line,
                where=_shortened(where),
                wanted=wanted,
                found=None if found is None else repr(_shortened(found)),
            )
        )
        if len(self.faults) >= MAX_FAULTS:
            raise InputError(self.faults)

    def leave_out(self, place: Place, what: str, why: str) -> None:
        """Note that something in a line is left out."""
        key = (place.file, _shortened(what), why)
        self._left_out.setdefault(key, []).append(place.line or 0)

    def left_out(self) -> tuple[str, ...]:
        """Return what was left out as text, in the order in which it was met."""
        texts = []
        for (file, what, why), lines in self._left_out.items():
            more = f" and {len(lines) - 1:,} more" if len(lines) > 1 else ""
            texts.append(f"{file}:{lines[0]}{more}: {what} left out: {why}")
        return tuple(texts)

    def raise_if_any(self) -> None:
        """Raise all faults there are.

        Raises
        ------
        InputError
            If there is any.
        """
        if self.faults:
            raise InputError(self.faults)


def _shortened(text: str) -> str:
    """Return ``text`` fit for a message."""
    plain = "".join(c if c.isprintable() else "\ufffd" for c in text[: _SHOWN_CHARS + 1])
    return plain if len(text) <= _SHOWN_CHARS else plain[:_SHOWN_CHARS] + "…"
