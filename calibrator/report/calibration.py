"""The sections of a report on the interpolant, the search, and what the targets say."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from calibrator.case.experiment import parts_of
from calibrator.case.problem import Target
from calibrator.case.vocabulary import PARAMETERS
from calibrator.report.fidelity import two_kinds
from calibrator.report.figures import calibration as figures
from calibrator.report.figures import search as search_figures
from calibrator.report.findings import Findings
from calibrator.report.html import Album, folded, note, paragraph, section
from calibrator.report.seen import (
    distance_seen,
    front_seen,
    likelihood_seen,
    parity_seen,
    ridge_seen,
    sensitivity_seen,
    slices_seen,
)
from calibrator.report.words import (
    amount,
    axis_label,
    file_name,
    key_words,
    number,
    response,
    text,
    words,
)
from calibrator.responses.interpolant import average_replicates
from calibrator.responses.objectives import OBJECTIVES
from calibrator.responses.success import Success
from calibrator.responses.table import points_of, response_table
from calibrator.responses.targets import bands

SLICE_POSITIONS = 121

# Of the box's half diagonal: a run this far from a slice is drawn at 1/e of full strength.
REACH = 0.35


def spoken(findings: Findings, sentence: str) -> str:
    """A sentence of the summary with the targets in words."""
    sentence = findings.in_words(sentence)
    return f"{sentence[:1].upper()}{sentence[1:]}."


def calibration(findings: Findings, album: Album) -> str:
    """The interpolant, the search, and what the targets say."""
    keys, found = [t.key for t in findings.space.case.problem.targets], findings.calibration
    return section(
        "Calibration",
        paragraph(text(_said_database(findings))),
        two_kinds(findings, album),
        *(_slices(findings, album, key) for key in keys),
        _front(findings, album),
        _likelihood(findings, album),
        _ridge(findings, album),
        folded(
            "How good the interpolant and the search are, and what each parameter does",
            _parity(findings, album),
            _distance(findings, album),
            _sensitivity(findings, album),
        ),
        *(
            paragraph(text(spoken(findings, s)), "small")
            for s in (*found.unseen, *found.failures, *found.reachability.sentences)
        ),
    )


def _said_database(findings: Findings) -> str:
    good = sum(r.status == "ok" for r in findings.records)
    noise = ", ".join(
        f"{key_words(k)} {'not known' if v is None else amount(v, response(k), 2)}"
        for k, v in findings.calibration.seed_noise.items()
        if v is not None or k in findings.interpolant.responses
    )
    cheap = sum(r.status == "ok" for r in findings.cheap)
    beside = f" beside {cheap} cheap ones" if cheap else ""
    return (
        f"The interpolant rests on {good} good runs at {len(_means(findings)[0])} parameter sets"
        f"{beside}. "
        f"Seed noise of a single run: {noise}."
    )


def _means(findings: Findings) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Distinct points (p, d), mean responses and runs behind each, both (p, m).

    They are in the order of the interpolant's own.
    """
    problem, keys = findings.space.case.problem, findings.interpolant.responses
    return average_replicates(*response_table(problem, findings.records, keys))


def _slices(findings: Findings, album: Album, key: str) -> str:
    problem, column = findings.space.case.problem, findings.interpolant.responses.index(key)
    index = [t.key for t in problem.targets].index(key)
    target = problem.targets[index]
    known = findings.calibration.seed_noise.get(key)
    noise = np.array([np.nan if known is None else known])
    replicates = findings.space.case.verify.replicates
    if said := _said_uninformative(findings, target):
        return note(said)
    band = float(bands([dataclasses.replace(target, weight=1.0)], noise, replicates)[0])
    seen = problem.seen_by(target.experiment)
    success = Success.of_experiment(problem, target.experiment, findings.records)
    panels = [_slice(findings, column, problem.names.index(n), success) for n in seen]
    caption = (
        f"{key_words(key).capitalize()} along each parameter, the others at the recommended set."
        f" The band is that within which the mean of {replicates} fresh runs meets the target; bars"
        " are one standard error of the mean."
    )
    label = axis_label(response(key))
    return album.figure(
        f"slices_{file_name(key)}",
        caption,
        lambda: figures.slices(panels, label, target.value, band),
        slices_seen(findings, target),
    )


def _said_uninformative(findings: Findings, target: Target) -> str:
    """A sentence where the parameters hardly move a response over the whole box; else empty.

    It tells nothing then: two standard errors of the difference between the measurement and the
    mean of the verification's runs are more than all of its range.
    """
    noise = findings.calibration.seed_noise.get(target.key) or 0.0
    measured = target.standard_error or target.tolerance * target.scale / 2
    error = math.hypot(measured, noise / math.sqrt(findings.space.case.verify.replicates))
    reach = findings.reach_of(target)
    if reach is None or reach.high - reach.low >= 2 * error:
        return ""
    quantity = response(target.key)
    return (
        f"{key_words(target.key).capitalize()} is uninformative, and not drawn: the parameters move"
        f" it from {number(reach.low)} to {amount(reach.high, quantity, 4)} over the whole box,"
        f" less than the two standard errors of {amount(2 * error, quantity, 2)} to which"
        " measurement and fresh runs can be compared."
    )


def _slice(findings: Findings, column: int, axis: int, success: Success) -> figures.Slice:
    problem = findings.space.case.problem
    points, values, counts = _means(findings)
    there = np.isfinite(values[:, column])
    line = np.repeat(findings.compromise[None], SLICE_POSITIONS, axis=0)
    line[:, axis] = problem.parameters[axis].values_at(np.linspace(0, 1, SLICE_POSITIONS))
    mean, std = findings.interpolant.predict_with_error(line)
    shares = problem.shares_of(points[there]) - problem.shares_of(findings.compromise[None])
    away = np.delete(shares, axis, axis=1)
    distance = (
        np.sqrt(np.mean(np.nan_to_num(away) ** 2, axis=1)) if away.shape[1] else np.zeros(len(away))
    )
    return figures.Slice(
        axis_label(PARAMETERS[problem.names[axis]]),
        float(findings.compromise[axis]),
        line[:, axis],
        mean[:, column],
        std[:, column],
        points[there, axis],
        values[there, column],
        np.nan_to_num(findings.interpolant.noise[column]) / np.sqrt(counts[there, column]),
        np.exp(-distance / REACH),
        success.failed[:, axis],
        success.shortfall(line) > 0,
        problem.parameters[axis].scale == "log",
    )


def _parity(findings: Findings, album: Album) -> str:
    predicted, std = findings.interpolant.leave_one_out()
    labels = [_response_label(key) for key in findings.interpolant.responses]
    caption = (
        "Each parameter set predicted from the others alone (leave-one-out); bars: the standard"
        " deviation it was given."
    )
    return album.figure(
        "parity",
        caption,
        lambda: figures.parity(findings.interpolant.values, predicted, std, labels),
        parity_seen(findings),
    )


def _response_label(key: str) -> str:
    """A response with its unit, and the condition under which it is measured where there is one."""
    _, condition = parts_of(key.split(".")[0])
    label = axis_label(response(key))
    return f"{label}\n{condition.replace('_', ' ')}" if condition else label


def _front(findings: Findings, album: Album) -> str:
    traces, objectives = findings.traces, findings.space.case.search.objectives[:2]
    if len(objectives) < 2:
        return note("The search had a single objective: there is no front to draw.")
    names = [f"{OBJECTIVES[n].symbol}: {OBJECTIVES[n].about}" for n in objectives]
    marks = {
        label: [c.objectives[n] for n in objectives] for label, c in findings.candidates.items()
    }
    axes = [f"{OBJECTIVES[n].symbol} ({words(n)})" for n in objectives]
    caption = (
        f"The population of the genetic algorithm on its way to the Pareto front. {names[0]};"
        f" {names[1]}.{_said_scale(findings)}"
    )
    snapshots = {generation: found[:, :2] for generation, found in traces.snapshots.items()}
    return album.figure(
        "front_evolution",
        caption,
        lambda: search_figures.front_evolution(snapshots, traces.objectives[:, :2], axes, marks),
        front_seen(findings),
    )


def _said_scale(findings: Findings) -> str:
    """What a logarithmic axis hides; empty for a linear one."""
    traces = findings.traces
    largest = max(float(found[:, 0].max()) for found in traces.snapshots.values())
    least = search_figures.least_shown(traces.objectives, largest)
    if not least:
        return ""
    return (
        f" The axis upwards is logarithmic, as the front is close to zero; what is below"
        f" {number(least, 2)} is drawn there."
    )


def _distance(findings: Findings, album: Album) -> str:
    curves = [np.array(curve) for curve in findings.calibration.generational_distance]
    caption = (
        f"Mean generational distance to the final front in {len(curves)} searches with different"
        " seeds."
    )
    return album.figure(
        "generational_distance",
        caption,
        lambda: search_figures.generational_distance(curves),
        distance_seen(curves),
    )


def _likelihood(findings: Findings, album: Album) -> str:
    chosen = findings.calibration.compromise.parameters
    found = [
        figures.Profile(
            axis_label(PARAMETERS[p.name]),
            p.positions,
            p.chi2,
            p.interval_95,
            chosen[p.name],
            p.truth,
            p.scale == "log",
        )
        for p in findings.calibration.identifiability.parameters
    ]
    caption = (
        "Profile likelihood: how much worse the targets are met when one parameter is held and the"
        " others adapt. Values under the grey line, χ² = 3.84 above the minimum, are accepted at 95"
        " %; a flat curve means that the targets say nothing."
    )
    return album.figure(
        "profile_likelihood",
        caption,
        lambda: figures.profile_likelihood(found),
        likelihood_seen(findings),
    )


def _ridge(findings: Findings, album: Album) -> str:
    problem, found = findings.space.case.problem, findings.calibration.identifiability
    caption = (
        "Parameter sets that the measurements accept, seen along every pair of parameters: each"
        " cloud is as wide as one parameter is free where the other is known, and a slanted band is"
        " a ridge of sets that are equally good."
    )
    labels = [axis_label(PARAMETERS[n]) for n in problem.names]
    bounds, logs = (
        np.array([problem.low, problem.high]),
        [p.scale == "log" for p in problem.parameters],
    )
    failed = points_of(problem, [r.request for r in findings.records if r.status != "ok"])
    return album.figure(
        "ridge",
        caption,
        lambda: figures.ridge(found.accepted, bounds, labels, findings.compromise, failed, logs),
        ridge_seen(findings),
    )


def _sensitivity(findings: Findings, album: Album) -> str:
    found = findings.calibration.sensitivity
    indices = {
        "alone": (found.first, found.first_error),
        "with all interactions": (found.total, found.total_error),
    }
    caption = (
        "What each parameter does over the whole box: Sobol indices of the interpolated responses."
        " Lines are 95 % intervals, from the finite sample and, for Gaussian processes, from"
        " leaving parts of the database out."
    )
    labels, names = [key_words(k) for k in found.responses], [words(n) for n in found.parameters]
    return album.figure(
        "sensitivity",
        caption,
        lambda: figures.sensitivity(indices, labels, names),
        sensitivity_seen(findings),
    )
