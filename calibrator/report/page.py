"""One page that says what was asked, what came out and how far to trust it.

Self-contained HTML, figures embedded.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from calibrator.files import write_text
from calibrator.report.answer import answer, candidates_table
from calibrator.report.beside import link_pages
from calibrator.report.calibration import calibration
from calibrator.report.curves import curves
from calibrator.report.findings import Findings
from calibrator.report.html import Album, page
from calibrator.report.methods import methods
from calibrator.report.model import model
from calibrator.report.provenance import failures, provenance
from calibrator.report.runs import pictures, validation, verification
from calibrator.runs.workspace import Workspace


@dataclass(frozen=True)
class Page:
    """Outcome of the verb `report`: the page, and the figures beside it."""

    page: Path
    figures: tuple[Path, ...]

    def lines(self) -> list[str]:
        """Where the page is."""
        return [str(self.page)]


def write_report(space: Workspace) -> Page:
    """Write report.html, its figures, methods.md and references.bib into the results.

    It reads what the verbs noted and searches for nothing; steps that have not been done are named
    with the command that does them. Raises CalibratorError, with the command to run, where
    `calibrate` has not been done, or where an outcome no longer fits the case or the runs.
    """
    findings = Findings.of(space)
    folder = space.folder("figures")
    for old in folder.glob("*.png"):
        old.unlink()
    album = Album(folder)
    whole = page(f"Calibration of {space.case.name}", [make(findings, album) for make in SECTIONS])
    path = space.path / "report.html"
    write_text(path, whole)
    link_pages(space.path)
    return space.note("report", Page(path, tuple(album.paths)))


SECTIONS: tuple[Callable[[Findings, Album], str], ...] = (
    answer,
    pictures,
    model,
    calibration,
    candidates_table,
    verification,
    validation,
    curves,
    methods,
    failures,
    provenance,
)
