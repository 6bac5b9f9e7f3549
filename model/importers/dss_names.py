"""Names of an OpenDSS circuit as a feeder file can hold them."""

from __future__ import annotations

from dataclasses import dataclass, field

__all__ = ["Names", "clean", "letters"]


def clean(name: str) -> str:
    """Return a name without what a feeder's names cannot hold.

    Examples
    --------
    >>> clean("l(r:p12-p13)")
    'l(r_p12-p13)'
    """
    kept = "".join("_" if letter == ":" or not letter.isprintable() else letter for letter in name)
    kept = kept.strip() or "_"
    return kept[:-2] + "_" + kept[-1] if kept.endswith((".p", ".q")) else kept


def letters(nodes: tuple[int, ...] | list[int]) -> str:
    """Return the phases of nodes 1, 2, 3.

    Examples
    --------
    >>> letters((3, 1))
    'ca'
    """
    return "".join("abc"[node - 1] for node in nodes)


@dataclass(slots=True, kw_only=True)
class Names:
    """Gives names of one kind out, each once, and remembers whose they are."""

    given: dict[str, str] = field(default_factory=dict)  #: by what the file calls it
    taken: set[str] = field(default_factory=set)

    def of(self, name: str) -> str:
        """Return the feeder's name for one of the file."""
        if name not in self.given:
            self.given[name] = self.new(clean(name))
        return self.given[name]

    def new(self, wanted: str) -> str:
        """Return a name that nothing has yet, as near to the wanted one as may be."""
        name, count = wanted, 2
        while name in self.taken:
            name, count = f"{wanted}-{count}", count + 1
        self.taken.add(name)
        return name

    @property
    def changed(self) -> dict[str, str]:
        """What had to be called otherwise."""
        return {old: new for old, new in self.given.items() if old != new}
