"""The house rules: directions, packaging, pins, and a quick front door.

Rules about source files are functions from a folder to its faults. Each is held against
this repository, and against a small folder in which it is broken.
"""

import ast
import importlib.metadata
import json
import os
import re
import subprocess
import sys
import sysconfig
import tomllib
from pathlib import Path

import pytest

import openphase
from openphase.studies.cli import VERBS

ROOT = Path(__file__).parents[1]
ROOMS = ("model", "detector", "optimise", "studies")  # imports point leftwards only
NOT_PACKAGED = {"benchmarks", "build", "dist", "docs", "notebooks", "runs", "tests"}
LONGEST_FILE = 450


# --- reading the tree ------------------------------------------------------------------


def room_files(root):
    return sorted(path for room in ROOMS for path in (root / room).rglob("*.py"))


def imports_of(path, root):
    """Yield (line number, module's dotted name, whether it was relative).

    Relative imports are spelled out from the package's root: in ``studies/run/draw.py``,
    ``from ...model.feeder import Feeder`` is ``openphase.model.feeder``, and
    ``from .. import run`` is ``openphase.studies.run``.
    """
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield node.lineno, alias.name, False
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield node.lineno, node.module, False
        elif isinstance(node, ast.ImportFrom):
            folder = ("openphase", *path.parent.relative_to(root).parts)
            base = folder[: len(folder) - node.level + 1]
            tails = [node.module] if node.module else [alias.name for alias in node.names]
            for tail in tails:
                yield node.lineno, ".".join((*base, tail)), True


def direction_faults(root):
    """Imports that point rightwards; in optimise, all that leave it but those of the errors."""
    faults = []
    for path in room_files(root):
        room = path.relative_to(root).parts[0]
        for line, module, _ in imports_of(path, root):
            package, _, rest = module.partition(".")
            other = rest.partition(".")[0]
            if package != "openphase" or other not in ROOMS or other == room:
                continue
            rightwards = ROOMS.index(other) > ROOMS.index(room)
            sees_feeders = room == "optimise" and module != "openphase.model.errors"
            if rightwards or sees_feeders:
                faults.append(f"{path.relative_to(root)}:{line}: {module}")
    return faults


def absolute_faults(root):
    """Imports that would load a second copy, or that name the package from inside it."""
    faults = []
    outside = [path for room in ("tests", "benchmarks") for path in (root / room).rglob("*.py")]
    for path in room_files(root) + sorted(outside):
        forbidden = ROOMS if path in outside else (*ROOMS, "openphase")
        for line, module, relative in imports_of(path, root):
            if not relative and module.partition(".")[0] in forbidden:
                faults.append(f"{path.relative_to(root)}:{line}: {module}")
    return faults


def stray_root_files(root):
    return sorted({path.name for path in root.glob("*.py")} - {"__init__.py"})


def long_files(root):
    texts = {path: path.read_text(encoding="utf-8") for path in room_files(root)}
    lengths = {path.relative_to(root): len(text.splitlines()) for path, text in texts.items()}
    return [f"{path}: {length} lines" for path, length in lengths.items() if length > LONGEST_FILE]


def package_folders(root):
    """Dotted names of all folders that are packages, and of all that hold a module."""
    tops = [top for top in root.iterdir() if top.is_dir() and top.name[0] != "."]
    tops = [top for top in tops if top.name not in NOT_PACKAGED and top.suffix != ".egg-info"]
    modules = [path for top in tops for path in top.rglob("*.py")]
    folders = {path.parent.relative_to(root).parts for path in modules}
    return {"openphase"} | {".".join(("openphase", *parts)) for parts in folders}


def pin_faults(text):
    """Lines of a constraints file that are neither a comment nor a plain name==version."""
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    return [line for line in lines if not re.fullmatch(r"[\w.-]+==[\w.!+-]+", line)]


# --- the rules, held against this repository -------------------------------------------


@pytest.fixture(scope="module")
def project():
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def test_the_walk_sees_every_room():
    seen = {path.relative_to(ROOT).parts[0] for path in room_files(ROOT)}
    assert seen == set(ROOMS)


@pytest.mark.parametrize("rule", [direction_faults, absolute_faults, stray_root_files, long_files])
def test_the_house_keeps_its_rule(rule):
    assert rule(ROOT) == []


@pytest.mark.parametrize(
    ("rule", "file", "source"),
    [
        (direction_faults, "model/a.py", "from ..detector.criteria import judge"),
        (direction_faults, "model/a.py", "from .. import detector"),
        (direction_faults, "detector/a.py", "def f():\n    from ..studies import cli"),
        (direction_faults, "detector/a.py", "import openphase.optimise.thresholds"),
        (direction_faults, "optimise/a.py", "from ..model.feeder import Feeder"),
        (direction_faults, "optimise/a.py", "from ..model import errors"),
        (direction_faults, "optimise/a.py", "from ..detector.evidence import Evidence"),
        (direction_faults, "optimise/inner/a.py", "from ...studies import cli"),
        (absolute_faults, "studies/a.py", "import model.parts"),
        (absolute_faults, "studies/a.py", "from openphase.model import Feeder"),
        (absolute_faults, "tests/test_a.py", "from detector import criteria"),
        (absolute_faults, "benchmarks/bench_a.py", "import studies"),
        (stray_root_files, "setup.py", ""),
        (long_files, "model/a.py", "x = 1\n" * (LONGEST_FILE + 1)),
    ],
)
def test_a_broken_rule_is_seen(rule, file, source, tmp_path):
    (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / file).write_text(source, encoding="utf-8")
    assert len(rule(tmp_path)) == 1


@pytest.mark.parametrize(
    ("file", "source"),
    [
        ("optimise/a.py", "from ..model.errors import InputError\nfrom .counts import add"),
        ("studies/run/a.py", "from ...model.feeder import Feeder\nfrom ... import __version__"),
        ("detector/a.py", "import numpy as np\nfrom ..model import Feeder"),
        ("model/a.py", "x = 1\n" * LONGEST_FILE),
        ("tests/test_a.py", "from openphase.model import Feeder"),
    ],
)
def test_what_is_allowed_passes(file, source, tmp_path):
    (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / file).write_text(source, encoding="utf-8")
    rules = [direction_faults, absolute_faults, stray_root_files, long_files]
    assert [fault for rule in rules for fault in rule(tmp_path)] == []


# --- packaging -------------------------------------------------------------------------


def test_pyproject_lists_every_package_and_each_has_its_init(project):
    listed = project["tool"]["setuptools"]["packages"]
    assert sorted(listed) == sorted(package_folders(ROOT))
    inits = [ROOT.joinpath(*name.split(".")[1:], "__init__.py") for name in listed]
    assert [path for path in inits if not path.is_file()] == []


def test_a_folder_that_nobody_listed_is_seen(tmp_path):
    for file in ("model/importers/a.py", "extra/__init__.py", "tests/a.py", ".venv/lib/a.py"):
        (tmp_path / file).parent.mkdir(parents=True)
        (tmp_path / file).touch()
    assert package_folders(tmp_path) == {
        "openphase",
        "openphase.extra",
        "openphase.model.importers",
    }


def test_the_version_is_the_same_everywhere(project):
    assert project["project"]["version"] == openphase.__version__
    assert importlib.metadata.version("openphase") == openphase.__version__
    assert f"## [{openphase.__version__}]" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_constraints_hold_versions_only():
    assert pin_faults((ROOT / "constraints.txt").read_text(encoding="utf-8")) == []
    wrong = ["numpy", "numpy>=2", "numpy==2.0 --hash=sha256:00", "-i https://host/simple"]
    wrong += ["numpy @ https://host/numpy.whl", "numpy==2.0; python_version > '3.11'"]
    assert pin_faults("\n".join(["# comment", "numpy==2.0", *wrong])) == wrong


def test_constraints_pin_every_direct_dependency(project):
    house = project["project"]
    lists = [house["dependencies"], *house["optional-dependencies"].values()]
    needs = [need for some in lists for need in some]
    names = {re.match(r"[\w-]+", need).group() for need in needs} - {"openphase"}
    text = (ROOT / "constraints.txt").read_text(encoding="utf-8")
    assert names - {line.partition("==")[0] for line in text.splitlines()} == set()


def test_tests_run_on_the_installed_package():
    assert Path(openphase.__file__).resolve().parent != ROOT.resolve()


def test_the_wheel_holds_the_package_and_nothing_else():
    """What was installed is what the wheel held: the rooms' files as they are here, no more."""
    house = importlib.metadata.distribution("openphase")
    origin = json.loads(house.read_text("direct_url.json") or "{}")
    if origin.get("dir_info", {}).get("editable"):
        pytest.skip("an editable install has no files of its own; make test installs plainly")
    files = [file for file in house.files if "__pycache__" not in file.parts]
    ours = {file.as_posix(): file for file in files if file.parts[0] == "openphase"}
    others = [file.as_posix() for file in files if file.parts[0] != "openphase"]
    assert [name for name in others if ".dist-info/" not in name] == [
        name for name in others if name.endswith("bin/openphase")
    ]
    here = [path for room in ROOMS for path in (ROOT / room).rglob("*") if path.is_file()]
    here = [path for path in here if "__pycache__" not in path.parts]
    here += [ROOT / "__init__.py", ROOT / "py.typed"]
    expected = {f"openphase/{path.relative_to(ROOT).as_posix()}": path for path in here}
    assert sorted(ours) == sorted(expected)
    stale = [name for name in ours if ours[name].read_binary() != expected[name].read_bytes()]
    assert stale == [], "these changed since they were installed; run make test"


# --- the front door --------------------------------------------------------------------


def cpu_seconds(command):
    """The least processor time of five runs, children included."""
    least = float("inf")
    for _ in range(5):
        before = os.times()
        subprocess.run(command, check=True, capture_output=True)
        after = os.times()
        user = after.children_user - before.children_user
        least = min(least, user + after.children_system - before.children_system)
    return least


def test_help_lists_every_verb_and_is_quick():
    door = str(Path(sysconfig.get_path("scripts")) / "openphase")
    said = subprocess.run([door, "--help"], check=True, capture_output=True, text=True).stdout
    for group, verbs in VERBS.items():
        assert f"{group}:\n" in said
        for verb, summary in verbs.items():
            assert re.search(rf"^  {verb} +{re.escape(summary)}$", said, re.MULTILINE)
    assert {"check", "solve", "size"} <= {verb for verbs in VERBS.values() for verb in verbs}
    assert cpu_seconds([door, "--help"]) - cpu_seconds([sys.executable, "-c", "pass"]) < 0.2


def test_the_clock_of_the_front_door_sees_a_heavy_import():
    busy = "import time\nwhile time.process_time() < 0.5: pass"
    assert cpu_seconds([sys.executable, "-c", busy]) > 0.4
