"""The page of a diagnosis: where the disagreement is, what explains it, and that it went away."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from calibrator.case.vocabulary import effect_of
from calibrator.diagnosis.gap import Detection, Location
from calibrator.diagnosis.outcome import (
    Amplitude,
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
from calibrator.report.figures import diagnosis as plots
from calibrator.report.html import Album, note, page, paragraph, section, table
from calibrator.report.words import key_words, number, text, with_error
from calibrator.runs.workspace import Workspace


def write_diagnosis(space: Workspace, found: Diagnosis) -> str:
    """Write diagnosis.html and its figures into the folder of the results; returns its path."""
    path = space.folder() / "diagnosis.html"
    folder = space.folder("diagnosis_figures")
    for old in folder.glob("*.png"):
        old.unlink()
    album = Album(folder)
    title = f"What is missing from the model of {text(space.case.name)}?"
    parts = [f"<h1>{title}</h1>{paragraph(text(found.sentence), 'answer')}"]
    if found.detection is not None:
        parts.append(_where(found, found.detection, album))
        parts.append(_what(found, found.detection, album))
    if len(found.explanations) > 1:
        parts.append(_proof(found.explanations, album))
    if found.powers:
        parts.append(_power(found.powers, album))
    write_text(path, page(f"What is missing from {space.case.name}?", parts))
    return str(path)


def _where(found: Diagnosis, detection: Detection, album: Album) -> str:
    words = (
        f"χ² = {number(detection.chi2)} with {detection.degrees} degrees of freedom, p ="
        f" {number(detection.p_chi2, 2)}; best single effect, p ="
        f" {number(detection.p_effect, 2)}."
    )
    figures = [_residuals(found, album)]
    if found.locations:
        figures.append(_locations(found.locations, album))
    return section("Where the disagreement is", paragraph(words), *figures)


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
    )


def _locations(places: Sequence[Location], album: Album) -> str:
    return album.figure(
        "locations",
        "Each experiment predicted from all others; p is corrected for looking at all of them"
        " (Holm).",
        lambda: plots.locations(
            [place.experiment for place in places], np.array([place.p_holm for place in places])
        ),
    )


def _what(found: Diagnosis, detection: Detection, album: Album) -> str:
    figures = []
    if found.fingerprints is not None:
        rows = [row for row in found.observables if row.used]
        figures += _fingerprints(found.fingerprints, rows, album)
    if found.posterior:
        figures.append(_posterior(found, album))
    if found.fingerprints is not None and found.ghosts is not None:
        figures.append(_ghosts(found.fingerprints, found.ghosts, detection.chi2, album))
    return section("What explains it", *figures, *(note(one) for one in found.notes))


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
        ),
        album.figure(
            "confusability",
            "Likeness of the effects after recalibration: 1.0 for two that these observables cannot"
            " tell apart.",
            lambda: plots.heat(names, names, likeness, "confusability |cos ψ|", 1.0),
        ),
    ]


def _posterior(found: Diagnosis, album: Album) -> str:
    rule = Rule()
    adequate = {_words(name): p >= rule.adequacy for name, p in found.adequacy.items()}
    weights = {_words(name): weight for name, weight in found.posterior.items()}
    return album.figure(
        "posterior",
        "Probability of each explanation, all parameters recalibrated with it.",
        lambda: plots.posterior(weights, adequate, rule.posterior),
    )


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
        "That it went away",
        figure,
        table("Explanations that were run on YADE, best parameters of each", head, rows),
    )


def _amplitudes(one: ExplanationRun) -> str:
    sizes = one.amplitudes.items()
    return ", ".join(f"{n} = {_size(a)}" for n, a in sizes) or "–"


def _size(one: Amplitude) -> str:
    if one.low is None or one.high is None:
        return with_error(one.value, one.error or 0.0)
    return f"{one.value:.3g} (95 %: {one.low:.2g} to {one.high:.2g})"


def _power(powers: Sequence[Power], album: Album) -> str:
    seen, named = np.array([power.sizes for power in powers]).T
    return section(
        "What could have been seen",
        album.figure(
            "powers",
            "Smallest amplitudes that these observables show in 80 of 100 cases, and that they tell"
            " from the nearest rival.",
            lambda: plots.powers([power.called for power in powers], seen, named),
        ),
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
