"""What a field's own range cannot say: values of a study together, and with its feeder."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence

from ...model.errors import InputError, KeyPath, Report
from ...model.load_regions import load_regions, measurable
from ...model.parts import Feeder
from ...model.reading.fields import as_toml, did_you_mean
from .correlations import SCALARS, contradicting, scalar_of
from .parts import Study
from .values import as_table

__all__ = ["check_against_feeder", "check_together", "is_faulty", "try_grid"]

_EARTHED = ("Yg/Yg", "Yg/D")
"""Connections whose winding on the feeder is connected to its neutral."""

_NEEDS = {"thevenin": ("z1_ohm",), "generator": ("z1_ohm", "z2_ohm")}
"""What a DER must have in the feeder file to be drawn as this."""


def is_faulty(path: KeyPath, report: Report) -> bool:
    """Tell whether a value, or anything inside it, has been reported."""
    return any(found[: len(path)] == path for found in report.paths)


def _written(path: tuple[str, str], report: Report) -> str | None:
    """Return a value as the user wrote it, None where it is left out."""
    table, key = path
    row = report.document.get(table)
    return as_toml(row[key]) if isinstance(row, Mapping) and key in row else None


def try_grid(grid: Callable[[], object], path: KeyPath, found: str, report: Report) -> None:
    """Report what a grid of settings says against being made."""
    try:
        grid()
    except InputError as error:
        report.add(path, error.faults[0].wanted, found)


# ---- by itself ----


def check_together(study: Study, report: Report) -> None:
    """Check the values of a study against each other; what is faulty already is left alone."""
    _check_counts(study, report)
    _check_measured(study, report)
    _check_groups(study, report)
    _check_correlations(study, report)
    _check_device(study, report)
    path: KeyPath = ("certificate", "confidence")
    if study.certificate.confidence == 1.0 and not is_faulty(path, report):
        report.add(path, "must be < 1", "1.0")
    path = ("events", "without")
    if "open_phase" in study.events.without:
        found = study.events.without.index("open_phase")
        report.add((*path, found), "cannot be left out: it is what must trip", "'open_phase'")


def _check_counts(study: Study, report: Report) -> None:
    """No more units are Yg/D than are named."""
    draw = study.transformers
    most = draw.yg_d_count.support[1]
    if most > len(draw.yg_d) and not is_faulty(("transformers",), report):
        path = ("transformers", "yg_d_count")
        rule = f"must not exceed the {len(draw.yg_d)} units named by yg_d"
        report.add(path, rule, _written(path, report))


def _check_measured(study: Study, report: Report) -> None:
    """Every place is measured once."""
    names = [item.point for item in study.measured]
    for index, name in enumerate(names):
        path: KeyPath = ("measured", index, "point")
        if name in names[:index] and not is_faulty(path, report):
            report.add(path, "must be measured once", repr(name))


def _check_groups(study: Study, report: Report) -> None:
    """Groups differ in name, and take the place of the one state of the network."""
    names = [group.name for group in study.groups]
    for index, name in enumerate(names):
        path: KeyPath = ("groups", index, "name")
        if name in names[:index] and not is_faulty(path, report):
            report.add(path, "must be the only group of that name", repr(name))
    path = ("network", "closed")
    if study.groups and study.network.closed is not None and not is_faulty(path, report):
        rule = "must be left out where there are groups: each says what is closed in it"
        report.add(path, rule, as_toml(study.network.closed))


def _check_correlations(study: Study, report: Report) -> None:
    """Correlations are between two quantities that vary, once each, and possible together."""
    seen: list[set[str]] = []
    for index, item in enumerate(study.correlations):
        path: KeyPath = ("correlations", index)
        if is_faulty(path, report):
            continue
        if set(item.between) in seen:
            report.add(path, "must be the only one between its two quantities")
        for place, name in enumerate(item.between):
            if not _varies(study, name) and not _is_faulty_scalar(name, report):
                rule = "must be a quantity that varies in this study"
                report.add((*path, "between", place), rule, repr(name))
        seen.append(set(item.between))
    if not is_faulty(("correlations",), report):
        impossible = [study.correlations[index] for index in contradicting(study.correlations)]
        if impossible:
            pairs = ", ".join(f"{' with '.join(c.between)} at {c.rank:g}" for c in impossible)
            rule = f"must be possible together, unlike {pairs}, and 0 where nothing is said"
            report.add(("correlations",), rule)


def _varies(study: Study, name: str) -> bool:
    distribution = scalar_of(study, name) if name in SCALARS else None
    return distribution is not None and distribution.support[0] < distribution.support[1]


def _is_faulty_scalar(name: str, report: Report) -> bool:
    return is_faulty(tuple(name.split(".")), report)


def _check_device(study: Study, report: Report) -> None:
    """Every grid of settings can be made."""
    device = study.device
    grids = {"i_set": device.i_grid, "z_set_ohm": device.z_grid, "v_set_pct": device.v_grid_pu}
    for key, grid in grids.items():
        if not is_faulty(("device", key), report):
            try_grid(grid, ("device", key), as_toml(as_table(device)[key]), report)


# ---- with its feeder ----


def check_against_feeder(study: Study, feeder: Feeder, report: Report) -> None:
    """Check that what the study names is in the feeder, and can be what the study makes of it."""
    _check_transformers(study, feeder, report)
    _check_ders(study, feeder, report)
    _check_places(study, feeder, report)
    switches = [switch.name for switch in feeder.switches]
    points = [point.name for point in feeder.points]
    _check_names(study.network.closed or (), switches, "switch", ("network", "closed"), report)
    states: list[tuple[KeyPath, Sequence[str], Sequence[str]]] = [
        (("groups", index), group.closed or (), group.opened)
        for index, group in enumerate(study.groups)
    ]
    for name in ("tie_switching", "transfer"):
        for index, state in enumerate(getattr(study.events, name).states):
            place = ("events", name, "states", index)
            states.append((place, state.closed or (), state.opened))
    for path, closed, opened in states:
        _check_names(closed, switches, "switch", (*path, "closed"), report)
        _check_names(opened, points, "measuring point", (*path, "opened"), report)


def _check_places(study: Study, feeder: Feeder, report: Report) -> None:
    """Every measured place is one of the feeder's, and sees loads that no other sees."""
    known = measurable(feeder)
    for index, item in enumerate(study.measured):
        if item.point not in known:
            rule = (
                "must be a measuring point of the feeder, or its source's bus"
                f"{did_you_mean(item.point, known)}"
            )
            report.add(("measured", index, "point"), rule, repr(item.point))
    names = [item.point for item in study.measured]
    if not set(names) <= set(known):
        return
    for name in load_regions(feeder, names).in_loop:
        path = ("measured", names.index(name), "point")
        report.add(path, "must not lie in a closed loop: it does not see all of its load", name)


def _check_names(
    names: Sequence[str], known: Collection[str], what: str, path: KeyPath, report: Report
) -> None:
    """Every name is that of something the feeder has."""
    for index, name in enumerate(names):
        if name not in known:
            rule = f"must be a {what} of the feeder{did_you_mean(name, known)}"
            report.add((*path, index), rule, repr(name))


def _check_transformers(study: Study, feeder: Feeder, report: Report) -> None:
    """The units are the feeder's, and may be Yg/D, as what is unknown may be what it is drawn."""
    units = {unit.name: unit for unit in feeder.transformers}
    path: KeyPath = ("transformers", "yg_d")
    named = study.transformers.yg_d
    _check_names(named, units, "transformer", path, report)
    for index, name in enumerate(named):
        if name in units and units[name].leakage_pu == 0.0:
            rule = "must have leakage, or as Yg/D it would short the zero sequence to earth"
            report.add((*path, index), rule, repr(name))
    if feeder.source.wires != 3:
        return
    if named:
        rule = "must be empty: with three wires there is no neutral for a Yg winding"
        report.add(path, rule, as_toml(named))
    unknown = study.transformers.unknown
    earthed = [name for name in _EARTHED if unknown is not None and name in unknown.values]
    if earthed:
        rule = "must not be one with a Yg winding, for which three wires have no neutral"
        report.add(("transformers", "unknown"), rule, " and ".join(map(repr, earthed)))


def _check_ders(study: Study, feeder: Feeder, report: Report) -> None:
    """Every DER has the impedances of the models it may be."""
    models = study.ders.model
    for model in () if models is None else models.values:
        for key in _NEEDS.get(model, ()):
            lacking = [der.name for der in feeder.ders if getattr(der, key) is None]
            if lacking:
                rule = f"may be {model!r} only if every DER has {key}, which is missing from"
                report.add(("ders", "model"), f"{rule} {', '.join(map(repr, lacking))}")
