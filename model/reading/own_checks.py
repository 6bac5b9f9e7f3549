"""A report that says nothing of values beside one that has been reported already."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..errors import KeyPath, Report
from .fields import as_toml
from .table_check import REPORTED

__all__ = ["OwnChecks", "ohm"]


class OwnChecks:
    """Adds to a report where none of the values concerned has been reported yet."""

    def __init__(self, report: Report) -> None:
        self.report = report
        self.faulty = set(report.paths)

    def add(self, path: KeyPath, others: Sequence[str], wanted: str, found: str | None) -> None:
        """Report the value at ``path``, unless it or one of ``others`` beside it is faulty."""
        beside = [(*path[:-1], other) for other in others]
        if self.faulty.isdisjoint([path, *beside]) and not self._unread([path, *beside]):
            self.report.add(path, wanted, found)

    def _unread(self, paths: Sequence[KeyPath]) -> bool:
        """Whether a value is but a stand-in for what could not be read from a table's file."""
        for path in paths:
            value: object = self.report.document
            for part in path:
                if isinstance(part, int):
                    value = value[part] if isinstance(value, list) else None
                else:
                    value = value.get(part) if isinstance(value, Mapping) else None
            if value is REPORTED:
                return True
        return False


def ohm(z: complex) -> str:
    """An impedance as a file has it."""
    return as_toml([z.real, z.imag])
