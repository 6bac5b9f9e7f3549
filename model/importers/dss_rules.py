"""What of an OpenDSS file reaches the engine: what is named here as kept, nothing else.

Three lists of what does not: left out because it says nothing about the circuit, refused
because the circuit would not be the file's without it, refused because it is dangerous.
"""

from __future__ import annotations

from .dss_words import PROPERTIES, word_list

__all__ = [
    "CLASSES",
    "CLASSES_LEFT_OUT",
    "COMMANDS_LEFT_OUT",
    "COMMANDS_REFUSED",
    "LARGEST",
    "LIBRARY_CLASSES",
    "LIBRARY_COMMANDS",
    "MAX_NAME_CHARS",
    "OPTIONS_KEPT",
    "OPTIONS_REFUSED",
    "PROPERTIES_LEFT_OUT",
    "PROPERTIES_REFUSED",
    "WITHOUT_MODEL",
]

MAX_NAME_CHARS = 200

CLASSES: dict[str, str] = {name.lower(): name for name in PROPERTIES}
"""Classes that are handed over, by their name in lower case."""

LIBRARY_CLASSES = frozenset(
    word_list("LineCode WireData CNData TSData LineSpacing LineGeometry XfmrCode")
)
"""Classes of catalogues: they describe conductors and transformers, no circuit."""

CLASSES_LEFT_OUT: dict[str, str] = dict.fromkeys(
    word_list("loadshape tshape priceshape xycurve growthshape tcc_curve spectrum dynamicexp"),
    "a curve, no part of the circuit",
) | dict.fromkeys(
    word_list("""monitor energymeter sensor invcontrol expcontrol storagecontroller gendispatcher
    upfccontrol espvlcontrol"""),
    "only measures or controls",
)

WITHOUT_MODEL = tuple(word_list("isource vccs fault upfc indmach012 autotrans vsconverter"))
"""Classes that the engine is given, for what they carry, but no part of a feeder stands for."""

PROPERTIES_LEFT_OUT = frozenset(
    word_list("""yearly daily duty growth spectrum tyearly tdaily tduty cvrcurve effcurve p-tcurve
    rcurve lcurve losscurve bp1 bp2 filter fusecurve phasefast phasedelayed groundfast grounddelayed
    phasecurve groundcurve overvoltcurve undervoltcurve doc_phasecurveinner controlsignal
    dynamiceq dynout debugtrace eventlog""")
)
"""References to curves that are left out, and records that the engine would write."""

PROPERTIES_REFUSED = frozenset(
    word_list("usermodel userdata shaftmodel shaftdata dynadll dynadata")
)
"""Properties that load a library into the engine."""

COMMANDS_REFUSED: dict[str, str] = dict.fromkeys(
    ["CD", "DOScmd", "Connect", "Disconnect", "NewActor", "Clone"],
    "leaves the circuit's files and is not obeyed",
) | dict.fromkeys(
    word_list("""MakePosSeq Reduce Distribute Estimate Reconductor Rephase SetLoadAndGenKV Obfuscate
    Remove"""),
    "changes the circuit in a way that is not read; write the changed circuit out first",
)
"""Commands without which the circuit would be another, or that are dangerous."""

COMMANDS_LEFT_OUT: dict[str, str] = {
    "Allocateloads": "loads keep the allocation factors that the files give them",
    "GISCoords": "the engine does not obey it either",
    "Uuids": "names elements for other programs",
    "Fileedit": "opens an editor",
    "Formedit": "opens an editor",
}
"""Why commands are left out that do more than calculate, show or write."""

LIBRARY_COMMANDS = frozenset(["New", "Edit", "More", "M", "~"])
"""Commands that define catalogues."""

OPTIONS_KEPT = frozenset(
    word_list(
        """Frequency Tolerance MaxIterations Loadmult Normvminpu Normvmaxpu Emergvminpu
    Emergvmaxpu Genmult Voltagebases Algorithm Controlmode Allocationfactors Basefrequency
    Maxcontroliter Cfactors DefaultBaseFrequency EarthModel MinIterations
    LongLineCorrection""".lower()
    )
)
"""Options that say something about the circuit or how it is solved."""

OPTIONS_REFUSED: dict[str, str] = dict.fromkeys(
    ["type", "element", "class", "object", "circuit"],
    "selects an element out of sight; use 'select class.name'",
) | {
    "allowduplicates": "makes elements of one name; rename them",
}

LARGEST: dict[str, int] = {
    "phases": 12,
    "nphases": 12,
    "nconds": 60,
    "cond": 60,
    "windings": 20,
    "wdg": 20,
    "winding": 20,
    "tapwinding": 20,
    "numsteps": 1_000,
    "seasons": 1_000,
    "shots": 20,
    "numfast": 20,
    "k": 10_000,
    "maxiterations": 10_000,
    "miniterations": 10_000,
    "maxcontroliter": 10_000,
}
"""Largest whole number of what sizes the engine's memory or loops: too much ends the process."""
