"""The last part of a report: failed runs, versions, cost, and the case file."""

from __future__ import annotations

import csv
import importlib.metadata
import platform
from collections.abc import Sequence
from pathlib import Path

from calibrator import __version__
from calibrator.case.vocabulary import STATUSES
from calibrator.errors import CalibratorError
from calibrator.files import read_text
from calibrator.report.findings import Findings
from calibrator.report.html import Album, paragraph, section, table
from calibrator.report.model import dates, every_run
from calibrator.report.words import distinct, number, text
from calibrator.runs.record import Record

PACKAGES = ("numpy", "scipy", "scikit-learn", "pymoo", "matplotlib")


def failures(findings: Findings, album: Album) -> str:
    """How many runs of each stage ended how, and why the bad ones did."""
    stages = {
        "plan": findings.records,
        "verification": [r for own in findings.verified.values() for r in own],
        "validation": [r for own in findings.validated.values() for r in own],
    }
    kinds = [
        k
        for k in STATUSES
        if k == "ok" or any(r.status == k for own in stages.values() for r in own)
    ]
    rows = [
        [stage, *(str(sum(r.status == k for r in own)) for k in kinds)]
        for stage, own in stages.items()
        if own
    ]
    meanings = [
        paragraph(f"<b>{text(k)}</b>: {text(STATUSES[k])}.", "small") for k in kinds if k != "ok"
    ]
    bad = [
        [r.run_id, stage, text(r.status), text(r.error or STATUSES[r.status])]
        for stage, own in stages.items()
        for r in own
        if r.status != "ok"
    ]
    reasons = (
        table("Runs without a full set of responses", ["run", "stage", "status", "reason"], bad)
        if bad
        else ""
    )
    words = "" if bad else paragraph("Every run that was started ended well.")
    return section(
        "Failed and clogged runs",
        table("Runs by outcome", ["stage", *map(text, kinds)], rows),
        words,
        *meanings,
        reasons,
    )


def provenance(findings: Findings, album: Album) -> str:
    """What would be needed to do it again."""
    case = findings.space.case
    verified = [r for own in findings.verified.values() for r in own]
    validated = [r for own in findings.validated.values() for r in own]
    runs = every_run(findings)
    shipped = findings.collection.from_shipped_database if findings.collection else 0
    counts = {
        "of the plan": len(findings.records),
        "to verify": len(verified),
        "to validate": len(validated),
    }
    rows = [
        ["calibrator", text(__version__)],
        ["YADE", text(distinct(runs, "yade"))],
        ["scripts (hash)", text(distinct(runs, "scripts"))],
        ["Python", text(platform.python_version())],
        *([name, text(importlib.metadata.version(name))] for name in PACKAGES),
        ["runs", ", ".join(f"{n} {what}" for what, n in counts.items())],
        ["dates", text(dates(runs))],
        ["from the shipped database", str(shipped)],
        ["core-seconds of the plan", text(_spent_on_plan(findings))],
        ["core-seconds to verify and validate", number(_core_seconds([*verified, *validated]))],
    ]
    return section(
        "Provenance",
        table("Versions, runs and cost", ["", ""], rows),
        f"<h3>Case file {text(case.path.name)}</h3><pre>{text(_case_text(case.path))}</pre>",
    )


def _case_text(path: Path) -> str:
    """The case file as it is now."""
    try:
        return read_text(path)
    except OSError as error:
        return f"(the case file cannot be read any more: {error})"


def _spent_on_plan(findings: Findings) -> str:
    """Core-seconds from timings.csv.

    It knows the runs made here but not those that were shipped. Raises CalibratorError where it is
    damaged.
    """
    try:
        timings = read_text(findings.space.path / "timings.csv", links=False)
        rows = list(csv.DictReader(timings.splitlines()))
        spent = sum(float(row["filling_cpu"]) + float(row["release_cpu"]) for row in rows)
    except FileNotFoundError:
        return f"timings.csv is missing: run `{findings.space.command('collect')}`"
    except (OSError, KeyError, TypeError, ValueError, csv.Error) as error:
        raise CalibratorError(
            f"{findings.space.path}/timings.csv is damaged ({error}): run"
            f" `{findings.space.command('collect')}` again"
        ) from None
    return f"{number(spent)} in {len(rows)} runs made here"


def _core_seconds(records: Sequence[Record]) -> float:
    """What these runs took, where their records say so."""
    return sum(
        float(r.diagnostics.get(k, 0.0)) for r in records for k in ("filling_cpu", "release_cpu")
    )
