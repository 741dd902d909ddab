"""The sections of a report on single runs: pictures, verification, validation, curves."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence

import numpy as np

from calibrator.case.experiment import ordered, parts_of
from calibrator.case.problem import Target
from calibrator.report.figures import grains
from calibrator.report.figures import runs as figures
from calibrator.report.figures.outlines import scenes
from calibrator.report.findings import Findings, arrays_of, by_distance, missing
from calibrator.report.html import Album, mark, note, section, table
from calibrator.report.seen import curves_seen, verification_seen
from calibrator.report.words import (
    called,
    experiment_words,
    file_name,
    heading,
    key_words,
    number,
    percent,
    short,
    with_error,
    words,
)
from calibrator.responses.table import experiment_of
from calibrator.runs.folder import gather
from calibrator.runs.record import Record
from calibrator.runs.setup import Curve, Setup
from calibrator.runs.setups import SETUP_ENTRIES, numbers
from calibrator.search.outcome import COMPROMISE
from calibrator.verification.outcome import Comparison, Verdict
from calibrator.verification.verify import probe_request

# Pictures of the set-ups


def pictures(findings: Findings, album: Album) -> str:
    """Grains of one run per experiment, but for those that are seen above."""
    problem = findings.space.case.problem
    both = (*problem.experiments, *problem.held_out_experiments)
    above = {path.stem for path in album.paths}
    shown = [e for e in ordered(both, problem.conditions) if _packing(e) not in above]
    if not shown:
        return ""
    return section("The set-ups", *(_picture(findings, album, experiment) for experiment in shown))


def own_picture(findings: Findings, album: Album, experiment: str) -> str:
    """The grains of a run of the recommended set; empty where none kept them."""
    found = _kept(findings, experiment, _own_runs(findings, experiment))
    return _drawn_grains(findings, album, experiment, *found) if found else ""


def _packing(experiment: str) -> str:
    """The name of the figure of its grains."""
    return f"packing_{file_name(experiment)}"


def _picture(findings: Findings, album: Album, experiment: str) -> str:
    """The grains of one run; a sentence where no run kept them."""
    runs = [*_own_runs(findings, experiment), *by_distance(findings, findings.records)]
    if found := _kept(findings, experiment, runs):
        return _drawn_grains(findings, album, experiment, *found)
    verb = "verify" if experiment in findings.space.case.problem.experiments else "validate"
    return missing(findings, f"The picture of the {experiment_words(experiment)}", verb)


def _drawn_grains(
    findings: Findings,
    album: Album,
    experiment: str,
    record: Record,
    arrays: dict[str, np.ndarray],
) -> str:
    setup, words_of_it = record.request.setup, experiment_words(experiment)
    p = numbers(record.request)
    values = ", ".join(f"{words(n)} {number(p[n], 3)}" for n in findings.space.case.problem.names)
    cut, last = SETUP_ENTRIES[setup].cut, SETUP_ENTRIES[setup].last
    view = "; the grains in front of the axis are cut away" if cut else ""
    caption = (
        f"{words_of_it.capitalize()} in YADE: {len(arrays['filled'])} grains filled,"
        f" {len(arrays['final'])} {last}{view}. Red: the scanned surface (mean)."
        f" Run {record.run_id} with {values}."
    )
    moments = scenes(setup, p, arrays)
    return album.figure(
        _packing(experiment),
        caption,
        lambda: grains.packing(moments, p["particle_radius"], cut),
    )


def _own_runs(findings: Findings, experiment: str) -> list[Record]:
    """The recommended set's own fresh runs."""
    own = findings.verified.get(COMPROMISE, []) + findings.validated.get(COMPROMISE, [])
    request = probe_request(findings.space, findings.calibration, experiment)
    return [*gather(findings.space.runs, [request]), *own]


def _kept(
    findings: Findings, experiment: str, runs: Sequence[Record]
) -> tuple[Record, dict[str, np.ndarray]] | None:
    """The first of these runs of an experiment that kept its grains, with its arrays."""
    problem = findings.space.case.problem
    for record in runs:
        if record.status == "ok" and experiment_of(problem, record.request) == experiment:
            arrays = arrays_of(findings, record)
            if {"filled", "final"} <= set(arrays):
                return record, arrays
    return None


def verification(findings: Findings, album: Album) -> str:
    """Like the paper's Table 7, with the curves of the fresh runs."""
    found = findings.verification
    if found is None:
        return section(
            "Verification", missing(findings, "The verification with fresh YADE runs", "verify")
        )
    outcome = found.candidates
    caption = (
        "Fresh YADE runs of each candidate against the measurement. Filled: simulated; open:"
        " promised by the interpolant."
    )
    rows = _deviations(outcome)
    return section(
        "Verification",
        _verification_table(findings, outcome),
        note(
            "Means of runs with new seeds ± one standard error, and (simulated − target) / target."
            " A question mark: the mean is too uncertain to tell. None was used to calibrate. The"
            " band is the recommended set's; that of fewer runs is wider, where noise decides."
            + _shipped_note(outcome)
        ),
        album.figure(
            "verification",
            caption,
            lambda: figures.verification(rows),
            verification_seen(outcome),
        ),
        _run_curves(findings, album),
    )


def _shipped_note(outcome: Mapping[str, Verdict]) -> str:
    shipped = sum(own.from_shipped_database for own in outcome.values())
    if not shipped:
        return ""
    return f" {shipped} of the runs come with the project; --fresh makes them anew."


def _verification_table(findings: Findings, outcome: Mapping[str, Verdict]) -> str:
    """A row per target, a column per candidate, and the verdicts below."""
    targets, verdicts = findings.space.case.problem.targets, list(outcome.values())
    rows = []
    for i, target in enumerate(targets):
        own = [verdict.responses[i] for verdict in verdicts]
        rows.append([heading(target), _target_band(own[0]), *map(_simulated_cell, own)])
    rows.append(["O1", "", *(number(own.o1, 3) for own in verdicts)])
    rows.append(["good runs", "", *(f"{own.good} of {own.total}" for own in verdicts)])
    rows.append(["verdict", "", *(mark(bool(own.passed), "passed", "failed") for own in verdicts)])
    caption = "Verification: simulated responses of the candidates, and their errors"
    return table(caption, ["", "target ± band", *map(short, outcome)], rows, 2)


def _target_band(row: Comparison) -> str:
    """The measured value as it was given, and the band; no rounding of the one to the other."""
    return f"{number(row.target)} ± {number(row.band, 2)}"


def _simulated(row: Comparison) -> str:
    """The mean of the fresh runs with its standard error."""
    if row.simulated is None:
        return f"not measured by {row.attempted} runs"
    if row.standard_error is None:
        return f"{number(row.simulated)} ± unknown"
    return with_error(row.simulated, row.standard_error)


def _simulated_cell(row: Comparison) -> str:
    """Simulated value, and under it the relative error and whether the target counts as met."""
    kind, sign = ("yes", "✓") if row.passed else ("no", "?" if row.undecided else "✗")
    if row.reported_only:
        kind, sign = "small", "(reported only)"
    return f'{_simulated(row)}<br><span class="{kind}">{percent(row.relative_error)} {sign}</span>'


def _deviations(outcome: Mapping[str, Verdict]) -> list[figures.Deviation]:
    """What is drawn: the responses that fresh runs measured."""
    rows = [(label, row) for label, own in outcome.items() for row in own.responses]
    keys = list(dict.fromkeys(row.key for _, row in rows))
    titles = dict(zip(keys, _titles(keys), strict=True))
    return [
        _deviation(label, titles[row.key], row, row.relative_error, row.standard_error or 0.0)
        for label, row in rows
        if row.relative_error is not None
    ]


def _titles(keys: Sequence[str]) -> list[str]:
    """Keys of responses in words, with their experiments where several measure the same."""
    names = [key.split(".")[1] for key in keys]
    return [
        words(name) if names.count(name) == 1 else key_words(key).replace(" (", "\n(")
        for key, name in zip(keys, names, strict=True)
    ]


def _deviation(
    label: str, title: str, row: Comparison, off: float, error: float
) -> figures.Deviation:
    """One response of one candidate as fractions of its target's scale."""
    promised = None if row.predicted is None else (row.predicted - row.target) / row.scale
    return figures.Deviation(label, title, off, error / row.scale, promised, row.band / row.scale)


def validation(findings: Findings, album: Album) -> str:
    """Like the paper's Tables 8 and 9: measurements that were not used."""
    problem, outcome = findings.space.case.problem, findings.validation
    if not problem.held_out:
        return section(
            "Validation",
            note(
                "No measurement was held out: give a row of the lab file the role held_out to"
                " validate."
            ),
        )
    if outcome is None:
        return section(
            "Validation", missing(findings, "The validation on measurements not used", "validate")
        )
    rows = [
        [called(label), *_validation_row(target, own.responses[i])]
        for i, target in enumerate(problem.held_out)
        for label, own in outcome.by_candidate.items()
    ]
    head = [
        "candidate",
        "response",
        "measured ± band",
        "simulated",
        "error",
        "good runs",
        "verdict",
    ]
    own = _arrays_by_experiment(findings, findings.validated)
    figures = [
        _drawn(album, experiment, runs, curve)
        for experiment, runs in own.items()
        if (curve := _setup(experiment).profile)
    ]
    caption = "Validation: the candidates predict measurements that were not used"
    return section("Validation", table(caption, head, rows, 3), *figures)


def _validation_row(target: Target, row: Comparison) -> list[str]:
    return [
        heading(target),
        _target_band(row),
        _simulated(row),
        percent(row.relative_error),
        f"{row.runs} of {row.attempted}",
        "reported only"
        if row.reported_only
        else mark(row.passed, "met", _why_not(row), row.undecided),
    ]


def _why_not(row: Comparison) -> str:
    return "cannot tell" if row.undecided else "missed"


# Curves of single runs


def _arrays_by_experiment(
    findings: Findings, runs: Mapping[str, Sequence[Record]]
) -> dict[str, dict[str, list[dict[str, np.ndarray]]]]:
    """Arrays of the runs that reached rest, by experiment and candidate."""
    found: dict[str, dict[str, list[dict[str, np.ndarray]]]] = {}
    problem = findings.space.case.problem
    for label, records in runs.items():
        for record in records:
            arrays = arrays_of(findings, record) if record.status == "ok" else {}
            if arrays:
                own = found.setdefault(experiment_of(problem, record.request), {})
                own.setdefault(label, []).append(arrays)
    return found


def _run_curves(findings: Findings, album: Album) -> str:
    """The curves of the verification's runs, in the order of the candidates."""
    ordered = {
        label: findings.verified[label]
        for label in findings.candidates
        if label in findings.verified
    }
    parts = [
        _drawn(album, experiment, runs, curve)
        for experiment, runs in _arrays_by_experiment(findings, ordered).items()
        for curve in _setup(experiment).curves
        if curve is _setup(experiment).profile or _pairs(runs, curve)
    ]
    return "".join(parts) or note("The verification runs left no curves.")


def _setup(experiment: str) -> Setup:
    """What is known of an experiment's set-up."""
    return SETUP_ENTRIES[parts_of(experiment)[0]]


def _drawn(
    album: Album,
    experiment: str,
    runs: Mapping[str, Sequence[Mapping[str, np.ndarray]]],
    curve: Curve,
) -> str:
    """The figure of a curve; a sentence where the runs left none."""
    caption = curve.caption.format(setup=experiment_words(experiment))
    pairs = _pairs(runs, curve)
    draw = functools.partial(figures.run_curves, pairs, curve)
    name = f"{curve.name}_{file_name(experiment)}"
    return album.figure(name, caption, draw, curves_seen(pairs, curve))


def _pairs(
    runs: Mapping[str, Sequence[Mapping[str, np.ndarray]]], curve: Curve
) -> dict[str, list[tuple[np.ndarray, np.ndarray]]]:
    """The two arrays of a curve for each run that left both, by candidate."""
    found = {
        label: [(a[curve.across], a[curve.up]) for a in own if {curve.across, curve.up} <= set(a)]
        for label, own in runs.items()
    }
    return {label: own for label, own in found.items() if own}
