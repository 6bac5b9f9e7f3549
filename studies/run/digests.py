"""What a run was made from, as hashes: resuming and comparing need the same."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Sequence
from dataclasses import fields, replace
from importlib import metadata, resources
from typing import Any

from ... import __version__
from ...detector.criteria import Settings
from ...model.parts import Feeder, Section
from ...model.reading.feeder_file import feeder_content
from ..spec.study_file import Study, dump_population, dump_study, resolved
from .engine import BLOCK
from .ledger import Attempt

__all__ = [
    "code_digest",
    "digest",
    "feeder_digest",
    "manifest",
    "population_digest",
    "settings_digest",
]

LIBRARIES = ("numpy", "scipy", "numba")


def digest(*texts: str) -> str:
    """SHA-256 of texts."""
    return hashlib.sha256("\0".join(texts).encode("utf-8")).hexdigest()


def feeder_digest(feeder: Feeder) -> str:
    """SHA-256 of a feeder, whatever it is called and in whatever order its parts are listed."""
    tables: dict[str, Any] = {
        field.name: tuple(sorted(getattr(feeder, field.name), key=_listed_by))
        for field in fields(feeder)
        if isinstance(getattr(feeder, field.name), tuple)
    }
    return digest(feeder_content(replace(feeder, name="any", **tables)))


def _listed_by(part: object) -> tuple[str, str]:
    if isinstance(part, Section):
        return part.local, part.remote
    return str(getattr(part, "name", "")), ""


def population_digest(feeder: Feeder, study: Study) -> str:
    """SHA-256 of what decides which scenarios there are, however it is written or called."""
    own = resolved(study, feeder)
    return digest(feeder_content(replace(feeder, name="any")), dump_population(own))


def settings_digest(given: Sequence[Sequence[Settings | None]]) -> str:
    """SHA-256 of a sheet: its settings by group and terminal."""
    return digest(*(repr(own) for group in given for own in group))


def code_digest() -> str:
    """SHA-256 of the package's sources: blocks of one code are never mixed with another's."""
    root = resources.files(__package__.partition(".")[0])
    with resources.as_file(root) as folder:
        rooms = ("model", "detector", "optimise", "studies")
        files = sorted(path for room in rooms for path in (folder / room).rglob("*.py"))
        return digest(*(path.read_text(encoding="utf-8") for path in files))


def manifest(
    command: tuple[str, ...], feeder: Feeder, study: Study, attempt: Attempt
) -> dict[str, object]:
    """What a run was made from; ``command`` is the verb with its inputs."""
    return {
        "command": [*command, "--seed", attempt.seed, "--scenarios", attempt.scenarios],
        "openphase": __version__,
        "code_sha256": code_digest(),
        "python": platform.python_version(),
        "libraries": {name: metadata.version(name) for name in LIBRARIES},
        "feeder_sha256": digest(feeder_content(feeder)),
        "study_sha256": digest(dump_study(study)),
        "population_sha256": population_digest(feeder, study),
        "seed": attempt.seed,
        "scenarios": attempt.scenarios,
        "attempt": attempt.number,
        "block": BLOCK,
    }
