"""One page that says what was asked, what came out and how far to trust it.

Self-contained HTML, figures embedded.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from calibrator.files import write_text
from calibrator.report.answer import answer, candidates_table
from calibrator.report.calibration import calibration
from calibrator.report.findings import Findings
from calibrator.report.html import Album, page
from calibrator.report.provenance import failures, provenance
from calibrator.report.runs import pictures, validation, verification
from calibrator.runs.workspace import Workspace


def write_report(space: Workspace) -> dict[str, Any]:
    """Write report.html and its figures into the folder of the results.

    The interpolant and the search are made anew from the database (they are deterministic);
    everything else is read from the summary that the verbs left. Steps that have not been done are
    named with the command that does them.

    Returns {"page": path, "figures": paths}. Raises CalibratorError where `calibrate` has not been
    done.
    """
    findings = Findings.of(space)
    folder = space.folder("figures")
    for old in folder.glob("*.png"):
        old.unlink()
    album = Album(folder)
    whole = page(f"Calibration of {space.case.name}", [make(findings, album) for make in SECTIONS])
    path = space.path / "report.html"
    write_text(path, whole)
    return space.note("report", {"page": str(path), "figures": [str(p) for p in album.paths]})


SECTIONS: tuple[Callable[[Findings, Album], str], ...] = (
    answer,
    pictures,
    calibration,
    candidates_table,
    verification,
    validation,
    failures,
    provenance,
)
