"""The fidelity report in words, for people and as Markdown."""

from __future__ import annotations

from typing import Any

__all__ = ["report_markdown", "report_text"]

_FATES = ("as_it_is", "approximated", "refused", "dropped", "not_fed", "state_kept")
_Table = tuple[tuple[str, ...], list[tuple[str, ...]]]


def report_text(report: dict[str, Any]) -> list[str]:
    """Return the lines to print; a part of any length stands on one line."""
    lines = [f"feeder {report['feeder']} from {report['file']} ({report['engine']})"]
    lines += ["", *_aligned(_class_table(report)), ""]
    lines += [f"- {sentence}" for sentence in _sentences(report)]
    lines += ["", *_aligned(_voltage_table(report))]
    return lines


def report_markdown(report: dict[str, Any]) -> str:
    """Return the same as a Markdown page."""
    parts = [
        f"# Import of {report['file']}",
        f"Feeder {report['feeder']}, read with {report['engine']}.",
        "## Elements",
        _pipes(_class_table(report)),
        "\n".join(f"- {sentence}" for sentence in _sentences(report)),
        "## Voltages against OpenDSS's own solution",
        "The same taps and capacitor states, controls off. `snap`: each load by its own law; "
        "`direct`: each its nominal admittance. Buses that nothing but capacitance holds to "
        "earth (floating) are compared without their common mode.",
        _pipes(_voltage_table(report)),
    ]
    return "\n\n".join(parts) + "\n"


def _class_table(report: dict[str, Any]) -> _Table:
    head = ("class", *(fate.replace("_", " ") for fate in _FATES))
    rows = [
        (row["class"], *(str(row[fate] or "–") for fate in _FATES)) for row in report["classes"]
    ]
    return head, rows


def _voltage_table(report: dict[str, Any]) -> _Table:
    head: tuple[str, ...] = (
        "loads",
        "largest",
        "at",
        "nodes",
        "floating",
        "dead",
        "range",
        "settled here / there",
    )
    rows: list[tuple[str, ...]] = [
        (
            str(row["mode"]),
            f"{row['largest_pu']:.1e} pu",
            f"{row['bus']} {row['phase']}",
            str(row["nodes"]),
            str(row["floating"]),
            str(row["dead"]),
            f"{row['lowest_pu']:.3f}..{row['highest_pu']:.3f}",
            f"{_yes(row['converged'])} / {_yes(row['opendss_converged'])}",
        )
        for row in report["opendss"]
    ]
    return head, rows


def _yes(flag: bool) -> str:
    return "yes" if flag else "no"


def _sentences(report: dict[str, Any]) -> list[str]:
    """Say everything that is no table."""
    total = report["totals"]
    found = [
        f"{total['buses']} buses, {total['lines']} lines: "
        f"{total['km_three_phase']:.3f} km of three phases, {total['km_two_phase']:.3f} of two, "
        f"{total['km_one_phase']:.3f} of one",
        f"{total['loads']} loads of {total['load_kw']:.1f} kW, of {report['load_kw_of_file']:.1f} "
        f"in the file (load multiplier {report['load_multiplier']:g})",
        f"{total['capacitors']} capacitor banks of {total['capacitor_kvar']:.0f} kvar, "
        f"{total['ders']} DER of {total['der_kw']:.0f} kW, switches: {total['switches_closed']} "
        f"closed, {total['switches_open']} open",
        f"transformer connections: {_counts(total['connections_known'])}; "
        f"unknown: {total['connections_unknown']}",
        f"buses by kV: {_counts(total['buses_by_kv'])}",
    ]
    for name, taps in total["regulators"].items():
        found.append(f"regulator {name} at taps {taps[0]}, {taps[1]}, {taps[2]}")
    found += [_group(row) for row in report["how"]]
    if report["disabled"]:
        found.append(f"{report['disabled']} elements are disabled in the file: not there")
    if report["left_out"]["count"]:
        left_out = report["left_out"]
        first = "; ".join(left_out["first"][:2])
        found.append(f"{left_out['count']} commands or properties of the files left out: {first} …")
    return [*found, *report["notes"]]


def _group(row: dict[str, Any]) -> str:
    """Say what became of a group of elements."""
    more = ", …" if row["count"] > len(row["names"]) else ""
    kw = f", {row['kw']:.1f} kW" if row["kw"] else ""
    how = f": {row['how']}" if row["how"] else ""
    return (
        f"{row['fate']}: {row['count']} {row['class']}{how}{kw} ({', '.join(row['names'])}{more})"
    )


def _counts(counts: dict[str, int]) -> str:
    return ", ".join(f"{count} {name}" for name, count in counts.items()) or "none"


def _aligned(table: _Table) -> list[str]:
    head, rows = table
    widths = [max(len(row[n]) for row in (head, *rows)) for n in range(len(head))]
    return [
        "  ".join(
            cell.ljust(width) if n == 0 else cell.rjust(width)
            for n, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in (head, *rows)
    ]


def _pipes(table: _Table) -> str:
    head, rows = table
    lines = [head, tuple("---" for _ in head), *rows]
    return "\n".join(
        "| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in lines
    )
