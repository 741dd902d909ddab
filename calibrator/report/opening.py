"""What a report opens with: a picture of the recommended set at work."""

from __future__ import annotations

from calibrator.files import read_bytes
from calibrator.report.findings import Findings
from calibrator.report.html import Album, embedded, paragraph
from calibrator.report.runs import own_picture
from calibrator.search.outcome import COMPROMISE
from calibrator.view.choice import candidate_run
from calibrator.view.outcome import PICTURE, place, read_view

PNG = b"\x89PNG\r\n\x1a\n"
LARGEST = 8.0
"""Megabytes of a picture that is embedded."""


def opening(findings: Findings, album: Album) -> str:
    """The picture of the recommended set's run, as `view` drew it.

    Else its grains before and after, where a fresh run kept them, and how to get that picture.
    """
    space = findings.space
    first = space.case.problem.experiments[0]
    choice = candidate_run(space, findings.calibration, COMPROMISE, first)
    folder = place(space, choice.request)
    view = read_view(folder)
    try:
        picture = read_bytes(folder / PICTURE, LARGEST, links=False)
    except OSError:
        picture = b""
    if view is None or not picture.startswith(PNG):
        how = f"{findings.command('view')}, then {findings.command('report')}"
        hint = paragraph(f"To see the recommended set at work on this page: {how}.", "note")
        return own_picture(findings, album, first) + hint
    another = (
        "" if view.same is not False else " It was made by another version than the noted run."
    )
    caption = (
        f"The recommended set at work: run {view.run_id}.{another} An animation and files for"
        f" ParaView are in views/{view.run_id} of the results."
    )
    return embedded(picture, view.seen, caption)
