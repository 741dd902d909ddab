"""The page of a diagnosis: where the disagreement is, what explains it, and that it went away."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from calibrator import __version__
from calibrator.case.vocabulary import PARAMETERS, effect_of
from calibrator.diagnosis.gap import Detection, Location
from calibrator.diagnosis.outcome import (
    Diagnosis,
    ExplanationRun,
    FingerprintTable,
    Ghosts,
    ObservableRow,
    Power,
)
from calibrator.diagnosis.rule import Rule
from calibrator.diagnosis.verdict import BEYOND, FIXED, MEASUREMENT, NONE, UNKNOWN
from calibrator.files import write_text
from calibrator.report import diagnosis_seen as seen
from calibrator.report.beside import link_pages
from calibrator.report.figures import diagnosis as plots
from calibrator.report.html import Album, folded, note, page, paragraph, section, table
from calibrator.report.verdict import opening, sized
from calibrator.report.words import (
    experiment_words,
    in_unit,
    key_words,
    number,
    percent,
    text,
    words,
)
from calibrator.runs.workspace import Workspace

PAGE = "diagnosis.html"


def write_diagnosis(space: Workspace, found: Diagnosis) -> str:
    """Write diagnosis.html and its figures into the folder of the results; returns its path."""
    path = space.folder() / PAGE
    folder = space.folder("diagnosis_figures")
    for old in folder.glob("*.png"):
        old.unlink()
    album = Album(folder)
    title = f"What is missing from the model of {words(space.case.name)}?"
    about = paragraph(text(space.case.about), "about")
    parts = [f"<header><h1>{text(title)}</h1>{about}</header>", opening(space, found)]
    if found.detection is not None:
        parts.append(_where(found, found.detection, album))
        parts.append(_what(found, found.detection, album))
    if len(found.explanations) > 1:
        parts.append(_proof(found.explanations, album))
    if found.powers:
        parts.append(_power(found.powers, album))
    parts.append(_rests_on(space, found))
    write_text(path, page(title, parts))
    link_pages(space.path)
    return str(path)


def _where(found: Diagnosis, detection: Detection, album: Album) -> str:
    said = (
        f"χ² = {number(detection.chi2)} with {detection.degrees} degrees of freedom, p ="
        f" {number(detection.p_chi2, 2)}; best single effect, p ="
        f" {number(detection.p_effect, 2)}."
    )
    parts = [_residuals(found, album)]
    if found.locations:
        parts.append(_locations(found.locations, album))
    return section("Where the disagreement is", paragraph(said), *parts)


def _residuals(found: Diagnosis, album: Album) -> str:
    rows = found.observables
    z = np.array([row.z for row in rows])
    named = z.shape[1] > 1 and found.explained
    return album.figure(
        "residuals",
        "Residual of every observable, of fresh YADE runs at the best parameters. Grey band: two"
        " standard errors.",
        lambda: plots.residuals(
            [_label(row) for row in rows],
            [row.held_out for row in rows],
            z[:, 0],
            z[:, 1] if named else None,
        ),
        seen.residuals(found),
    )


def _locations(places: Sequence[Location], album: Album) -> str:
    names = [experiment_words(place.experiment) for place in places]
    rows = [
        [text(name), number(place.chi2, 3), str(place.degrees), number(place.p_holm, 2)]
        for name, place in zip(names, places, strict=True)
    ]
    figure = album.figure(
        "locations",
        "Each experiment predicted from all others; p is corrected for looking at all of them"
        " (Holm).",
        lambda: plots.locations(names, np.array([place.p_holm for place in places])),
        seen.locations(places),
    )
    head = ["experiment", "χ²", "degrees of freedom", "p (Holm)"]
    return figure + table("Experiments that disagree with the others", head, rows)


def _what(found: Diagnosis, detection: Detection, album: Album) -> str:
    parts, details = [], []
    if found.posterior:
        parts.append(_posterior(found, album))
    if found.fingerprints is not None:
        rows = [row for row in found.observables if row.used]
        details += _fingerprints(found.fingerprints, rows, album)
        if found.ghosts is not None:
            details.append(_ghosts(found.fingerprints, found.ghosts, detection.chi2, album))
    if details:
        parts.append(folded("What each effect does, and which look alike", *details))
    return section("What explains it", *parts)


def _fingerprints(
    prints: FingerprintTable, rows: Sequence[ObservableRow], album: Album
) -> list[str]:
    names = [effect_of(name).called for name in prints.effects]
    shifts, likeness = np.array(prints.shifts), np.array(prints.confusability)
    largest = float(np.percentile(np.abs(shifts), 95)) or 1.0
    return [
        album.figure(
            "fingerprints",
            "What each effect of plausible size does to the observables, in standard errors, before"
            " recalibration.",
            lambda: plots.heat(
                [_label(row) for row in rows], names, shifts, "fingerprints", largest
            ),
            seen.fingerprints(prints, [_label(row) for row in rows]),
        ),
        album.figure(
            "confusability",
            "Likeness of the effects after recalibration: 1.0 for two that these observables cannot"
            " tell apart.",
            lambda: plots.heat(names, names, likeness, "confusability |cos ψ|", 1.0),
            seen.confusability(prints),
        ),
    ]


def _posterior(found: Diagnosis, album: Album) -> str:
    rule = Rule()
    adequate = {_words(name): p >= rule.adequacy for name, p in found.adequacy.items()}
    weights = {_words(name): weight for name, weight in found.posterior.items()}
    rows = [
        [text(_words(name)), number(weight, 3), number(found.adequacy.get(name), 2)]
        for name, weight in found.posterior.items()
    ]
    figure = album.figure(
        "posterior",
        "Probability of each explanation, all parameters recalibrated with it.",
        lambda: plots.posterior(weights, adequate, rule.posterior),
        seen.posterior(weights),
    )
    return figure + table("Explanations", ["explanation", "probability", "p of its fit"], rows)


def _ghosts(prints: FingerprintTable, ghosts: Ghosts, chi2: float, album: Album) -> str:
    shares = {
        effect_of(name).called: ratio / chi2
        for name, ratio in zip(prints.effects, prints.likelihood_ratios, strict=True)
    }
    return album.figure(
        "ghosts",
        "Any library shrinks a gap: grey, what the same effects reach when turned into random"
        " directions.",
        lambda: plots.ghosts(shares, ghosts.ghost_median, ghosts.ghost_95),
        seen.ghosts(ghosts),
    )


def _proof(tried: Sequence[ExplanationRun], album: Album) -> str:
    held = [one.gap_held_out for one in tried if one.gap_held_out is not None]
    figure = album.figure(
        "gap",
        "The gap in fresh YADE runs at each explanation that was tried.",
        lambda: plots.gap(
            [one.called for one in tried],
            np.array([one.gap_used for one in tried]),
            np.array(held) if len(held) == len(tried) else None,
            (tried[0].floor_used, tried[0].floor_held_out),
        ),
        seen.gap(tried),
    )
    head = ["model", "amplitude", "χ²", "p of its fit", "gap, data used", "gap, held out"]
    rows = [
        [
            text(one.called),
            _amplitudes(one),
            number(one.chi2, 3),
            number(one.adequacy, 2),
            number(one.gap_used, 3),
            number(one.gap_held_out, 3),
        ]
        for one in tried
    ]
    return section(
        "Whether it goes away",
        figure,
        table("Explanations that were run on YADE, best parameters of each", head, rows),
        note("The gap is the root mean square of the residuals, in standard errors."),
    )


def _amplitudes(one: ExplanationRun) -> str:
    sizes = one.amplitudes.items()
    return ", ".join(f"{n} = {sized(a)}" for n, a in sizes) or "–"


def _power(powers: Sequence[Power], album: Album) -> str:
    sizes = np.array([power.sizes for power in powers])
    figure = album.figure(
        "powers",
        "Smallest amplitudes that these observables show in 80 of 100 cases, and that they tell"
        " from the nearest rival.",
        lambda: plots.powers([power.called for power in powers], sizes[:, 0], sizes[:, 1]),
        seen.powers(powers),
    )
    head = ["effect", "column", "plausible", "seen from", "named from", "hidden by recalibration"]
    rows = [
        [
            text(power.called),
            text(power.effect) + in_unit(PARAMETERS[power.effect]),
            number(power.scale, 3),
            number(power.smallest_detectable, 2),
            number(power.smallest_nameable, 2),
            percent(power.absorbed, signed=False, digits=0),
        ]
        for power in powers
    ]
    return section(
        "What could have been seen", table("Sizes that are seen and named", head, rows), figure
    )


def _rests_on(space: Workspace, found: Diagnosis) -> str:
    """The verdict as the command line has it, notes, and what would be needed to do it again."""
    notes = "".join(f"<li>{text(one)}</li>" for one in found.notes)
    settings = space.case.diagnosis
    rows = [
        ["calibrator", text(__version__)],
        ["case file", text(space.case.path.name)],
        ["lab file", text(space.case.measured.name)],
        ["sets, replicates of each", f"{settings.sets}, {settings.replicates}"],
        ["sets of each effect", str(settings.effect_sets)],
        ["fresh runs of each explanation", f"{settings.verify_replicates} per experiment"],
        ["first seed", str(settings.seed)],
    ]
    return section(
        "Notes and provenance",
        paragraph(text(found.sentence)),
        f"<ul>{notes}</ul>" if notes else paragraph("No run or observable was left out."),
        table("What it rests on", ["", ""], rows),
    )


def _label(row: ObservableRow) -> str:
    return key_words(row.key)


def _words(name: str) -> str:
    others = {
        NONE: "nothing missing",
        UNKNOWN: "something else",
        MEASUREMENT: "an error of the measurement",
        BEYOND: "parameters beyond their bounds",
        FIXED: "another value of what the case keeps fixed",
    }
    return others.get(name) or effect_of(name).called
