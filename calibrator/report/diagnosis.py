"""The page of a diagnosis: first where the disagreement is, then what explains it, then that it
went away.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from calibrator.case.vocabulary import EFFECTS, effect_of
from calibrator.diagnosis.verdict import Rule
from calibrator.files import write_text
from calibrator.report.figures import diagnosis as plots
from calibrator.report.html import Album, note, page, paragraph, section, table
from calibrator.report.words import key_words, number, text, with_error
from calibrator.runs.workspace import Workspace


def write_diagnosis(space: Workspace, outcome: dict[str, Any]) -> str:
    """Write diagnosis.html and its figures into the folder of the results; returns the path of the
    page.
    """
    path = space.folder() / "diagnosis.html"
    folder = space.folder("diagnosis_figures")
    for old in folder.glob("*.png"):
        old.unlink()
    album = Album(folder)
    head = (
        "<h1>What is missing from the model of"
        f" {text(space.case.name)}?</h1>{paragraph(text(outcome['sentence']), 'answer')}"
    )
    parts = (
        [head]
        if outcome["verdict"] == "cannot tell"
        else [head, _where(outcome, album), _what(outcome, album)]
    )
    if "explanations" in outcome and len(outcome["explanations"]) > 1:
        parts.append(_proof(outcome, album))
    if "powers" in outcome:
        parts.append(_power(outcome, album))
    write_text(path, page(f"What is missing from {space.case.name}?", parts))
    return str(path)


def _where(o: dict[str, Any], album: Album) -> str:
    rows = o["observables"]
    z = np.array([r["z"] for r in rows])
    named = z.shape[1] > 1 and o["verdict"] in ("named", "two effects")
    detection = o["detection"]
    figure = album.figure(
        "residuals",
        "Residual of every observable, of fresh YADE runs at the best parameters. Grey band: two"
        " standard errors.",
        lambda: plots.residuals(
            [_label(r["key"]) for r in rows],
            [r["role"] == "held_out" for r in rows],
            z[:, 0],
            z[:, 1] if named else None,
        ),
    )
    places = o["locations"]
    where = album.figure(
        "locations",
        "Each experiment predicted from all others; p is corrected for looking at all of them"
        " (Holm).",
        lambda: plots.locations(
            [p["experiment"] for p in places], np.array([p["p_holm"] for p in places])
        ),
    )
    words = (
        f"χ² = {number(detection['chi2'])} with {detection['degrees']} degrees of freedom, p ="
        f" {number(detection['p_chi2'], 2)}; best single effect, p ="
        f" {number(detection['p_effect'], 2)}."
    )
    return section("Where the disagreement is", paragraph(words), figure, where if places else "")


def _what(o: dict[str, Any], album: Album) -> str:
    prints = o["fingerprints"]
    names = [effect_of(n).called for n in prints["effects"]]
    shifts = np.array(prints["shifts"])
    largest = float(np.percentile(np.abs(shifts), 95)) or 1.0
    rows = [r for r in o["observables"] if r["used"]]
    figures = [
        album.figure(
            "fingerprints",
            "What each effect of plausible size does to the observables, in standard errors, before"
            " recalibration.",
            lambda: plots.heat(
                [_label(r["key"]) for r in rows], names, shifts, "fingerprints", largest
            ),
        ),
        album.figure(
            "confusability",
            "Likeness of the effects after recalibration: 1.0 for two that these observables cannot"
            " tell apart.",
            lambda: plots.heat(
                names, names, np.array(prints["confusability"]), "confusability |cos ψ|", 1.0
            ),
        ),
    ]
    if o["posterior"]:
        adequate = {_words(n): p >= Rule().adequacy for n, p in o["adequacy"].items()}
        weights = {_words(n): w for n, w in o["posterior"].items()}
        figures.append(
            album.figure(
                "posterior",
                "Probability of each explanation, all parameters recalibrated with it.",
                lambda: plots.posterior(weights, adequate, Rule().posterior),
            )
        )
    shares = {
        n: ratio / o["detection"]["chi2"]
        for n, ratio in zip(names, prints["likelihood_ratios"], strict=True)
    }
    ghosts = o["ghosts"]
    figures.append(
        album.figure(
            "ghosts",
            "Any library shrinks a gap: grey, what the same effects reach when turned into random"
            " directions.",
            lambda: plots.ghosts(shares, ghosts["ghost_median"], ghosts["ghost_95"]),
        )
    )
    return section("What explains it", *figures, *(note(one) for one in o["notes"]))


def _proof(o: dict[str, Any], album: Album) -> str:
    tried = o["explanations"]
    labels = [
        " and ".join(effect_of(n).called for n in e["effects"]) or "model as it is" for e in tried
    ]
    held = [e["gap_held_out"] for e in tried]
    figure = album.figure(
        "gap",
        "The gap in fresh YADE runs at each explanation that was tried.",
        lambda: plots.gap(
            labels,
            np.array([e["gap_used"] for e in tried]),
            np.array(held) if None not in held else None,
            (tried[0]["floor_used"], 1.0),
        ),
    )
    rows = [
        [
            text(label),
            ", ".join(
                f"{n} = {with_error(a['value'], a['error'] or 0.0)}"
                for n, a in e["amplitudes"].items()
            )
            or "–",
            number(e["chi2"], 3),
            number(e["adequacy"], 2),
            number(e["gap_used"], 3),
            number(e["gap_held_out"], 3),
        ]
        for label, e in zip(labels, tried, strict=True)
    ]
    head = ["model", "amplitude", "χ²", "p of its fit", "gap, data used", "gap, held out"]
    return section(
        "That it went away",
        figure,
        table("Explanations that were run on YADE, best parameters of each", head, rows),
    )


def _power(o: dict[str, Any], album: Album) -> str:
    powers = o["powers"]

    def in_scales(key: str) -> np.ndarray:
        return np.array([math.inf if p[key] is None else p[key] / p["scale"] for p in powers])

    return section(
        "What could have been seen",
        album.figure(
            "powers",
            "Smallest amplitudes that these observables show in 80 of 100 cases, and that they tell"
            " from the nearest rival.",
            lambda: plots.powers(
                [p["called"] for p in powers],
                in_scales("smallest_detectable"),
                in_scales("smallest_nameable"),
            ),
        ),
    )


def _label(key: str) -> str:
    experiment, _, response = key.partition(".")
    setup, _, condition = experiment.partition("@")
    words = key_words(f"{setup}.{response}")
    return f"{words[:-1]}, {condition.replace('_', ' ')})" if condition else words


def _words(name: str) -> str:
    return (
        effect_of(name).called
        if name in EFFECTS
        else {"none": "nothing missing", "unknown": "something else"}[name]
    )
