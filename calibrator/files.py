"""Files that others made are read with care, and files are written whole or not at all.

Read are regular files of a bounded size only: a pipe or a device would be waited for, or never end.
Nothing is unpickled.
"""

from __future__ import annotations

import io
import json
import os
import stat
import zipfile
from collections.abc import Collection
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from calibrator.errors import CalibratorError

MEGABYTE = 2**20
LARGEST_INTEGER = 10**300  # what is larger cannot become a float


def beside(name: str) -> Path:
    """A folder of the project that is no Python package: yade_scripts, grid or cases.

    It lies below the package once that is installed, and beside it in a checkout.
    """
    package = Path(__file__).resolve().parent
    installed = package / name
    return installed if installed.is_dir() else package.parent / name


def read_text(path: Path, megabytes: float = 256, links: bool = True) -> str:
    """The text of a file, without the mark that some editors put before UTF-8.

    links : whether a symbolic link is followed; not in a results folder, where everything was made
    here. Raises FileNotFoundError, or another OSError that says why the file is not read.
    """
    raw = read_bytes(path, megabytes, links)
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise OSError(f"not UTF-8 text: {error.reason} at byte {error.start}") from None


def read_bytes(path: Path, megabytes: float = 256, links: bool = True) -> bytes:
    """The bytes of a regular file; see `read_text`."""
    if "\0" in str(path):
        raise OSError("a path cannot contain a null character")
    if not links and path.is_symlink():
        raise OSError("it is a symbolic link")
    # Without O_NONBLOCK, opening a pipe waits for somebody to write.
    number = os.open(
        path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC | (0 if links else os.O_NOFOLLOW)
    )
    with open(number, "rb") as stream:
        about = os.fstat(number)
        if not stat.S_ISREG(about.st_mode):
            raise OSError("not a regular file")
        if about.st_size > megabytes * MEGABYTE:
            raise OSError(f"larger than {megabytes:g} MB")
        return stream.read()


def parse_json(text: str) -> Any:
    """JSON without the liberties of Python's reader.

    Raises ValueError for NaN and infinities, keys given twice, integers beyond a float, and nesting
    without end.
    """
    try:
        return json.loads(
            text, parse_constant=_refuse_constant, parse_int=_integer, object_pairs_hook=_once
        )
    except RecursionError:
        raise ValueError("nested too deeply") from None


def _refuse_constant(text: str) -> float:
    """Raise ValueError: JSON has neither NaN nor infinities."""
    raise ValueError(f"{text} is not a number")


def _integer(text: str) -> int:
    """The integer, if a float can hold it."""
    if len(text) > 302 or abs(int(text)) > LARGEST_INTEGER:
        raise ValueError(f"an integer of {len(text)} digits")
    return int(text)


def _once(pairs: list[tuple[str, object]]) -> dict[str, object]:
    """The object of these pairs; ValueError where a key occurs twice."""
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError("a key is given twice")
    return found


def read_arrays(
    path: Path, megabytes: float = 256, names: Collection[str] | None = None
) -> dict[str, np.ndarray]:
    """The arrays of an .npz file as floats; names : of those that are wanted, None for all.

    A file that would have to be unpickled is refused: unpickling runs whatever code the file holds.
    Raises FileNotFoundError, or ValueError where it is damaged.
    """
    try:
        read_bytes(path, megabytes, links=False)
        with zipfile.ZipFile(path) as archive:
            if sum(member.file_size for member in archive.infolist()) > megabytes * MEGABYTE:
                raise ValueError(f"it unpacks to more than {megabytes:g} MB")
        with np.load(path, allow_pickle=False) as arrays:
            wanted = arrays.files if names is None else set(arrays.files) & set(names)
            found = {name: arrays[name] for name in wanted}
    except FileNotFoundError:
        raise
    # the readers of zip, deflate and npy raise a dozen kinds on damaged bytes
    except Exception as error:
        raise ValueError(str(error) or type(error).__name__) from None
    for name, array in found.items():
        if array.dtype.kind not in "iuf":
            raise ValueError(f"{name} does not hold numbers")
    return {name: array.astype(float) for name, array in found.items()}


def write_text(path: Path, text: str) -> None:
    """Write a text file atomically; see `write_bytes`."""
    write_bytes(path, text.encode("utf-8", "backslashreplace"))  # a name may hold no UTF-8


def write_bytes(path: Path, raw: bytes) -> None:
    """Write a file atomically: whoever looks finds the old file or the whole new one.

    A link is replaced, not followed.
    """
    temporary = path.with_name(f"{path.name}.{os.getpid()}.tmp")
    temporary.unlink(missing_ok=True)
    try:
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC
        with open(os.open(temporary, flags, 0o666), "wb") as stream:
            stream.write(raw)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def packed(arrays: dict[str, np.ndarray]) -> bytes:
    """The bytes of an .npz file of these arrays, the same for equal arrays."""
    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays)  # type: ignore[arg-type]
    return stream.getvalue()


def own_folder(path: Path) -> Path:
    """Make a folder of the results.

    Raises CalibratorError where it is a link: nothing is written outside the results.
    """
    if path.is_symlink():
        raise CalibratorError(
            f"{path} is a symbolic link, and results stay in their folder: remove it, or give"
            " --results"
        )
    try:
        path.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise CalibratorError(
            f"{path} is not a folder: remove it, or give another one with --results"
        ) from None
    return path


def named_file(case: Path, name: str, key: str) -> Path:
    """The path of a file that a case names under `key`.

    A case that somebody sends must not be able to read anything on this machine: the file lies in
    the case's folder or in the one above it (so that cases/ and grid/ can lie side by side), also
    after symbolic links. Raises CalibratorError.
    """
    parts = PurePosixPath(name).parts
    project = os.path.realpath(case.parent / "..")
    path = case.parent / name
    allowed = parts and "\0" not in name and not name.startswith("/") and ".." not in parts[1:]
    if not allowed or os.path.commonpath([project, os.path.realpath(path)]) != project:
        raise CalibratorError(
            f"{key} = {name!r} leaves the case's folder: put the file into that folder or the one"
            ' above it, and give a relative path such as "lab.csv" or "../grid/runs.csv"'
        )
    return path
