"""The feeder and its physics: what it is made of, how it is read, how it is solved.

What stands here is what a feeder is and how to get one; it needs nothing but the standard
library. The solver and the measuring points are modules of their own.
"""

from __future__ import annotations

from .errors import InputError, OpenPhaseError
from .feeder import make_feeder
from .parts import (
    Capacitor,
    Coordinates,
    Der,
    Feeder,
    InlineTransformer,
    Line,
    LineCode,
    Load,
    Place,
    Point,
    Regulator,
    Section,
    Source,
    Switch,
    Transformer,
)
from .reading.feeder_file import (
    dump_feeder,
    feeder_from_toml,
    load_feeder,
    read_feeder,
    shipped_feeders,
    write_feeder,
)

__all__ = [
    "Capacitor",
    "Coordinates",
    "Der",
    "Feeder",
    "InlineTransformer",
    "InputError",
    "Line",
    "LineCode",
    "Load",
    "OpenPhaseError",
    "Place",
    "Point",
    "Regulator",
    "Section",
    "Source",
    "Switch",
    "Transformer",
    "dump_feeder",
    "feeder_from_toml",
    "load_feeder",
    "make_feeder",
    "read_feeder",
    "shipped_feeders",
    "write_feeder",
]
