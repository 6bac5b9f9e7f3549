"""The run folder: blocks and results, each written whole or not at all.

A manifest names what the run was made from. The same command finds its blocks again; a
changed input starts afresh and says so.
"""

from __future__ import annotations

import functools
import io
import json
import os
import typing
import zipfile
from contextlib import suppress
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...model.errors import OpenPhaseError

__all__ = ["RunFolder", "as_json", "block_array", "npz", "pack", "unpack", "write_whole"]

T = TypeVar("T")

#: what reading a damaged block may raise, down to the zip format's own refusals
DAMAGED = (
    OSError,
    ValueError,
    KeyError,
    EOFError,
    NotImplementedError,
    RuntimeError,
    zipfile.BadZipFile,
)


def write_whole(path: Path, content: bytes) -> None:
    """Write a file so that it is there complete, or not at all.

    Raises OpenPhaseError where the folder cannot be written or the disk is full.
    """
    part = path.with_name(f"{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part.write_bytes(content)
        part.replace(path)
    except OSError as error:
        with suppress(OSError):  # the folder itself may be what is wrong
            part.unlink(missing_ok=True)
        raise OpenPhaseError(f"{path}: cannot be written: {error.strerror or error}") from error


def as_json(value: object) -> str:
    """JSON as the project writes it: indented, keys in the given order, a final newline."""
    return json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def pack(value: Any, name: str = "") -> dict[str, NDArray[Any]]:
    """Flatten a dataclass of arrays, tuples and dataclasses into named arrays."""
    if is_dataclass(value):
        parts = [(field.name, getattr(value, field.name)) for field in fields(value)]
    elif isinstance(value, tuple):
        parts = [(str(n), item) for n, item in enumerate(value)]
    else:
        return {name: np.asarray(value)}
    flat: dict[str, NDArray[Any]] = {}
    for key, item in parts:
        flat |= pack(item, f"{name}.{key}" if name else key)
    return flat


def npz(arrays: dict[str, NDArray[Any]]) -> bytes:
    """Named arrays as the bytes of an npz file; equal arrays give equal bytes."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as file:
        for name, values in arrays.items():
            content = _head(values.dtype, values.shape) + values.tobytes()
            file.writestr(zipfile.ZipInfo(f"{name}.npy"), content)
    return buffer.getvalue()


@functools.lru_cache(maxsize=4096)
def _head(dtype: np.dtype[Any], shape: tuple[int, ...]) -> bytes:
    """What stands before an array's numbers in an npy file; most arrays are of few shapes."""
    buffer = io.BytesIO()
    own = {"descr": np.lib.format.dtype_to_descr(dtype), "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(buffer, own)
    return buffer.getvalue()


def unpack(kind: type[T], flat: dict[str, NDArray[Any]], name: str = "") -> T:
    """Rebuild what ``pack`` flattened, from the dataclass's annotations."""
    hints = _hints(kind)  # type: ignore[arg-type]
    values: dict[str, Any] = {}
    for field in fields(kind):  # type: ignore[arg-type]
        hint, key = hints[field.name], f"{name}.{field.name}" if name else field.name
        if typing.get_origin(hint) is tuple:
            item = typing.get_args(hint)[0]
            values[field.name] = tuple(
                unpack(item, flat, f"{key}.{n}") for n in range(_length(flat, key))
            )
        else:
            values[field.name] = flat[key]
    return kind(**values)


@functools.cache
def _hints(kind: type) -> dict[str, Any]:
    return typing.get_type_hints(kind)


def _length(flat: dict[str, NDArray[Any]], name: str) -> int:
    heads = {key[len(name) + 1 :].split(".", 1)[0] for key in flat if key.startswith(name + ".")}
    return len(heads)


def block_array(path: Path, name: str) -> NDArray[Any] | None:
    """One array of a stored block; None where the file is damaged, or has no such array."""
    try:
        with np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as file:
            return np.asarray(file[name])
    except DAMAGED:
        return None


#: what a run leaves behind, beside its blocks; nothing else is ever removed
OWN = (
    "manifest.json",
    "study.toml",
    "result.json",
    "settings.csv",
    "counts.npz",
    "report.html",
    "timing.json",
    "log.txt",
    "overview.png",
    "feeder.png",
    "*-evidence.png",
    "*-along-line.png",
    "*.part",
    "blocks/*.npz",
    "blocks/*.part",
)


class RunFolder:
    """A study's folder on disk."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.blocks = path / "blocks"

    def finds(self, manifest: dict[str, object]) -> Literal["nothing", "this run", "another run"]:
        """What is in the folder, seen from a run with these inputs; nothing is written.

        Raises OpenPhaseError where the folder holds anything but a run of openphase.
        """
        try:
            if not self.path.exists() or not any(self.path.iterdir()):
                return "nothing"
            text = (self.path / "manifest.json").read_text(encoding="utf-8")
            known = json.loads(text)
        except (FileNotFoundError, ValueError):
            known = None
        except OSError as error:
            raise OpenPhaseError(f"{self.path}: {error.strerror or error}") from error
        if not isinstance(known, dict) or not manifest.keys() <= known.keys():
            raise OpenPhaseError(
                f"{self.path}: holds files, but no run of openphase; choose another --out"
            )
        return "this run" if text == as_json(manifest) else "another run"

    def begin(self, manifest: dict[str, object]) -> None:
        """Make the folder this run's own: another run's files are removed, and only these."""
        if self.finds(manifest) == "another run":
            try:
                for pattern in OWN:
                    for file in self.path.glob(pattern):
                        file.unlink()
            except OSError as error:
                raise OpenPhaseError(f"{self.path}: {error.strerror or error}") from error
        self.write("manifest.json", as_json(manifest))

    def count_blocks(self) -> int:
        """How many blocks are stored."""
        return len(list(self.blocks.glob("*.npz")))

    def write(self, name: str, content: str | bytes) -> Path:
        """Write one file of the run."""
        path = self.path / name
        write_whole(path, content.encode("utf-8") if isinstance(content, str) else content)
        return path

    def log(self, line: str) -> None:
        """Append a line to log.txt."""
        path = self.path / "log.txt"
        try:
            with path.open("a", encoding="utf-8") as file:
                file.write(line + "\n")
        except OSError as error:
            message = f"{path}: cannot be written: {error.strerror or error}"
            raise OpenPhaseError(message) from error

    def block(self, name: str, kind: type[T]) -> T | None:
        """A block that is there already, else None; a damaged one counts as not there."""
        try:
            content = io.BytesIO((self.blocks / f"{name}.npz").read_bytes())
            with np.load(content, allow_pickle=False) as file:
                return unpack(kind, {key: file[key] for key in file.files})
        except DAMAGED:
            return None

    def keep_block(self, name: str, value: object) -> None:
        """Store a block."""
        write_whole(self.blocks / f"{name}.npz", npz(pack(value)))
