"""`make bench`: the engine, its parts and its memory, and other engines on the same scenarios.

Every run is a process of its own, one after the other, each on one core. This process
imports nothing large: on Linux a child's peak memory begins with its parent's.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import textwrap
from importlib import metadata
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
REPEATS = 3
TARGETS_S = {"constant": 12.0, "sampled": 30.0}  #: per 10⁶ scenarios, one process
TITLES = {"constant": "constant impedance", "sampled": "sampled exponents"}
PARTS = ("draw", "noise", "solve before", "solve after", "measure + evidence", "verdict")
LIBRARIES = ("numpy", "scipy", "numba", "llvmlite", "dss-python", "power-grid-model")
SMALL = 100_000  #: scenarios of the small run, to see that memory does not grow
TIMES_WANTED = 25  #: on mixed events, against OpenDSS's fastest driving
GROWTH_MB = 20.0  #: what the allocator may keep

Result = dict[str, Any]


def main() -> int:
    asked = _arguments()
    result: Result = {"machine": _machine()}
    _print_machine(result["machine"])
    result["engine"] = {loads: _engine(loads, asked.scenarios) for loads in TARGETS_S}
    _print_engine(result["engine"])
    result["memory"] = _memory(asked.scenarios, result["engine"])
    print(_memory_line(result["memory"]))
    result["startup"] = _startup()
    print(_startup_line(result["startup"]))
    if not asked.no_peers:
        result["peers"] = _run("run_peers.py")
        _print_peers(result["peers"])
        result["feeders"] = _run("run_feeders.py")
        _print_feeders(result["feeders"])
    result["machine"]["load_at_end"] = _load()
    print(_load_line(result["machine"]))
    if asked.json:
        asked.json.write_text(json.dumps(result, indent=2, ensure_ascii=False) + "\n", "utf-8")
    return int(asked.check and not _passed(result))


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Measure the engine.")
    parser.add_argument("--scenarios", type=_count, default=1_000_000, metavar="N")
    parser.add_argument("--no-peers", action="store_true", help="only the engine")
    parser.add_argument("--check", action="store_true", help="fail where a target is missed")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all figures there too")
    return parser.parse_args()


def _count(text: str) -> int:
    """A number of scenarios; 1e6 is one too."""
    value = float(text)
    if not value >= 1 or value != int(value):
        raise argparse.ArgumentTypeError("must be a whole number >= 1")
    return int(value)


def _run(script: str, *words: str, **environment: str) -> Any:
    """Run a script of this folder on one core; returns what it printed."""
    one = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    done = subprocess.run(
        [sys.executable, str(HERE / script), *words],
        env=os.environ | one | environment,
        stdout=subprocess.PIPE,
        check=True,
    )
    return json.loads(done.stdout)


# ---- what is measured ----


def _machine() -> Result:
    try:
        info = Path("/proc/cpuinfo").read_text("utf-8")
    except OSError:
        info = ""
    models = [line.partition(":")[2].strip() for line in info.splitlines() if "model name" in line]
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return {
        "cpu": models[0] if models else platform.processor() or platform.machine(),
        "cores_usable": usable,
        "cores_used": 1,
        "load_at_start": _load(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "versions": {name: _version(name) for name in ("openphase", *LIBRARIES)},
    }


def _load() -> float | None:
    """Processes that wanted a core during the last minute, where the system tells."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else None


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _engine(loads: str, scenarios: int) -> Result:
    """The run of median time, of three; all three draw and answer the same."""
    runs = [_run("run_engine.py", loads, str(scenarios)) for _ in range(REPEATS)]
    run: Result = sorted(runs, key=lambda own: own["seconds"])[REPEATS // 2]
    run["all_seconds"] = [own["seconds"] for own in runs]
    run["seconds_per_million"] = run["seconds"] * 1e6 / run["scenarios"]
    run["target_s"] = TARGETS_S[loads]
    return run


def _memory(scenarios: int, engine: Result) -> Result:
    small = _run("run_engine.py", "sampled", str(min(SMALL, scenarios)))
    large = engine["sampled"]
    return {
        "scenarios": [small["scenarios"], large["scenarios"]],
        "peak_mb": [small["peak_mb"], large["peak_mb"]],
        "grows": large["peak_mb"] - small["peak_mb"] > GROWTH_MB,
    }


def _startup() -> Result:
    """Compiled anew into an empty cache, then from that cache."""
    with tempfile.TemporaryDirectory() as cache:
        anew = _run("run_startup.py", NUMBA_CACHE_DIR=cache)
        cached = [_run("run_startup.py", NUMBA_CACHE_DIR=cache) for _ in range(REPEATS)]
    return {
        "import_numba_s": statistics.median(own["import_numba_s"] for own in cached),
        "first_call_s": anew["first_call_s"],
        "first_call_cached_s": statistics.median(own["first_call_s"] for own in cached),
    }


def _passed(result: Result) -> bool:
    engine = result["engine"].values()
    fast = all(own["seconds_per_million"] <= own["target_s"] for own in engine)
    return fast and not result["memory"]["grows"]


# ---- what is printed ----


def _print_machine(machine: Result) -> None:
    print(f"{machine['cpu']}, {machine['system']}")
    print(f"{machine['cores_used']} core used of {machine['cores_usable']} usable")
    known = [f"{name} {version}" for name, version in machine["versions"].items() if version]
    print(f"Python {machine['python']}; {', '.join(known)}\n")


def _load_line(machine: Result) -> str:
    start, end, cores = (machine[key] for key in ("load_at_start", "load_at_end", "cores_usable"))
    if start is None or end is None:
        return ""
    busy = "; the machine was SHARED: trust ratios only" if max(start, end - 1.0) > cores else ""
    return f"\nLoad of the machine: {start:.1f} before, {end:.1f} at the end (1 is this run){busy}"


def _print_engine(engine: Result) -> None:
    blocks = next(iter(engine.values()))["blocks"]
    total = sum(blocks.values())
    mix = ", ".join(f"{name} {count / total:.0%}" for name, count in blocks.items())
    count = next(iter(engine.values()))["scenarios"]
    print(
        f"The engine on the paper's feeder: {count:,} scenarios, one process, median of {REPEATS}"
    )
    print(textwrap.fill(f"({mix})", 100) + "\n")
    columns = list(engine.values())
    print(_row("seconds per 10⁶ scenarios", [TITLES[loads] for loads in engine]))
    for part in PARTS:
        print(_row(f"  {part}", [_s(own["parts"][part], own) for own in columns]))
    print(_row("  in all", [_s(own["seconds"], own) for own in columns]))
    print(_row("target", [f"{own['target_s']:.1f}" for own in columns]))
    ratios = [f"{own['seconds_per_million'] / own['target_s']:.2f}" for own in columns]
    print(_row("time / target", ratios))
    for frame in ("before", "after"):
        passes = [f"{own['passes'][f'solve {frame}']:.2f}" for own in columns]
        print(_row(f"passes per solve, {frame}", passes))
    print(_row("peak memory, MB", [f"{own['peak_mb']:.0f}" for own in columns]))


def _row(title: str, cells: list[str]) -> str:
    return f"{title:<30}" + "".join(f"{cell:>22}" for cell in cells)


def _s(seconds: float, own: Result) -> str:
    return f"{seconds * 1e6 / own['scenarios']:.2f}"


def _memory_line(memory: Result) -> str:
    small, large = (
        f"{peak:.0f} MB at {count:,}"
        for peak, count in zip(memory["peak_mb"], memory["scenarios"], strict=True)
    )
    verdict = "GROWS" if memory["grows"] else "does not grow"
    return f"\nMemory {verdict}: {small} scenarios, {large} (sampled exponents)"


def _startup_line(startup: Result) -> str:
    return (
        f"numba: import {startup['import_numba_s']:.2f} s; first solve "
        f"{startup['first_call_s']:.1f} s when it compiles, "
        f"{startup['first_call_cached_s']:.2f} s from its cache on disk\n"
    )


def _print_peers(peers: Result) -> None:
    print("Pre-and-post solves of a broken conductor per second: constant impedance, the same")
    print(f"scenarios, one core, median of {REPEATS}, {peers['nodes']} three-phase nodes.")
    print("Windings are as in the file. openphase and the numpy ladder make their transformers'")
    print("shunts in the measured time; other peers get them ready-made: as entries of the matrix,")
    print(
        "as shunts (power-grid-model), as wye and delta loads (OpenDSS). Grids are made before.\n"
    )
    own = peers["rows"][0]["per_s"]
    print(f"{'':<24}{'scenarios/s':>12}{'openphase is':>16}{'largest gap, pu (allowed)':>30}")
    for row in peers["rows"]:
        if "why" in row:
            print(f"{row['title']:<24}{row['why']}")
            continue
        gap = f"{row['gap_pu']:.0e} ({row['tolerance_pu']:g})" if row["gap_pu"] else ""
        times = f"{own / row['per_s']:.1f} × as fast" if gap else ""
        print(f"{row['title']:<24}{row['per_s']:>12,.0f}{times:>16}{gap:>30}")


def _print_feeders(feeders: Result) -> None:
    print("\nMixed events on real feeders, pre-and-post solves per second of processor time,")
    print(f"engines in turns, one core, median of {REPEATS}; wanted: {TIMES_WANTED} × as fast.\n")
    if "why" in feeders:
        print(feeders["why"])
        return
    print(f"{'':<46}{'scenarios/s':>12}{'openphase is':>16}{'gap, pu':>10}{'not conv.':>11}")
    for row in feeders["rows"]:
        loads = "linear loads" if row["linear"] else "loads by their laws"
        print(f"{row['feeder'] + ', ' + loads:<46}{row['per_s']:>12,.0f}")
        for title, peer in row["peers"].items():
            if "why" in peer:
                print(f"  {'OpenDSS, ' + title:<44}{peer['why']}")
                continue
            times = f"{row['per_s'] / peer['per_s']:.1f} × as fast"
            cells = f"{times:>16}{peer['gap_pu']:>10.0e}{peer['not_converged']:>11}"
            print(f"  {'OpenDSS, ' + title:<44}{peer['per_s']:>12,.0f}{cells}")


if __name__ == "__main__":
    sys.exit(main())
