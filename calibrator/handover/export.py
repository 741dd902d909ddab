"""The verb `export`: the chosen material as files for other scenes and other engines."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from calibrator.case.values import known
from calibrator.files import own_folder, write_text
from calibrator.handover import lammps, liggghts, tables, yade
from calibrator.handover.chosen import Chosen, chosen
from calibrator.handover.names import CALLED, ENGINES
from calibrator.handover.unmapped import unmapped
from calibrator.runs.workspace import Workspace

ALL = "all"
FILES: dict[str, tuple[str, Callable[[Chosen], str]]] = {
    "yade": ("_yade.py", yade.text),
    "liggghts": (".liggghts", liggghts.text),
    "lammps": (".lammps", lammps.text),
    "mercury": ("_mercurydpm.csv", tables.mercury),
    "edem": ("_edem.csv", tables.edem),
}
"""End of the file's name, and what is in it, by engine."""


@dataclass(frozen=True)
class Export:
    """Outcome of the verb `export`.

    Attributes
    ----------
    candidate : which parameter set; verified : whether fresh runs met every target, None where none
        say so; standing : the same in words.
    files : by engine; missing : what each file does not hold of the material, by engine.
    """

    candidate: str
    verified: bool | None
    standing: str
    files: dict[str, Path]
    missing: dict[str, tuple[str, ...]]

    def lines(self) -> list[str]:
        """The outcome in plain words."""
        said = [f"{self.candidate}, {self.standing}"]
        for engine, path in self.files.items():
            said.append(f"  {CALLED[engine]}: {path}")
            said += [f"    {sentence}" for sentence in self.missing[engine]]
        return said


def export(
    space: Workspace, candidate: str = "", engine: str = ALL, out: Path | None = None
) -> Export:
    """Write the material of a calibration as files for YADE and other engines.

    Parameters
    ----------
    candidate : label of a member of the front; the compromise unless one is named.
    engine : one of `names.ENGINES`, or "all".
    out : folder of the files; "export" in the folder of the results unless one is given.

    Raises
    ------
    CalibratorError, with what to do, where the calibration is missing or stale, or has no such
    candidate, or where there is no such engine.
    """
    known(engine, (*ENGINES, ALL), "engine")
    found = chosen(space, candidate)
    folder = space.folder("export") if out is None else own_folder(out)
    wanted = ENGINES if engine == ALL else (engine,)
    files = {name: folder / f"{found.stem}{FILES[name][0]}" for name in wanted}
    for name, path in files.items():
        write_text(path, FILES[name][1](found))
    missing = {name: unmapped(found, name) for name in wanted}
    standing = found.standing
    done = Export(found.label, standing.passed, standing.here(space), files, missing)
    return space.note("export", done)
