"""The verb `demo`: the case that comes with the project, copied into a folder of the user's."""

from __future__ import annotations

from pathlib import Path

from calibrator.errors import CalibratorError
from calibrator.files import beside, own_folder, read_bytes, write_bytes

FILES = (
    "cases/coarse_sand.toml",
    "cases/coarse_sand_lab.csv",
    "cases/coarse_sand_truth.toml",
    "grid/coarse_sand.csv",
)
"""The case first, then what it names: where they lie in the project, and in the user's folder."""


def lay_out(folder: Path) -> tuple[Path, list[str]]:
    """Copy the demo's case, laboratory and shipped runs into a folder.

    Files that are there already and are the same are left alone, so that the demo can be called
    again, and in a checkout.

    Returns
    -------
    Path of the case, and the names of the files that were written.

    Raises
    ------
    CalibratorError where a file of the same name has other contents: nothing is written then.
    """
    wanted = {name: read_bytes(beside(name.split("/")[0]) / name.split("/")[1]) for name in FILES}
    for name, raw in wanted.items():
        path = folder / name
        if path.is_symlink() or (path.exists() and not _holds(path, raw)):
            raise CalibratorError(
                f"{path} is not the demo's own, and is not overwritten: call the demo in an empty"
                f" folder, or call the verb all on {folder / FILES[0]} to calibrate what is here"
            )
    missing = [name for name in wanted if not (folder / name).exists()]
    for name in missing:
        own_folder((folder / name).parent)
        write_bytes(folder / name, wanted[name])
    return folder / FILES[0], missing


def _holds(path: Path, raw: bytes) -> bool:
    """Whether a file has these contents."""
    try:
        return read_bytes(path) == raw
    except OSError:
        return False
