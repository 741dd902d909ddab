"""One page that says what was asked, what came out and how far to trust it. Self-contained HTML, figures embedded."""

from __future__ import annotations

import csv
import functools
import importlib.metadata
import platform
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from calibrator import __version__, plot
from calibrator.database import response_table
from calibrator.errors import CalibratorError
from calibrator.files import read_arrays, read_text, write_text
from calibrator.interpolation import Interpolant, average_replicates
from calibrator.nsga2 import SearchResult
from calibrator.objectives import OBJECTIVES
from calibrator.page import (
    Album,
    amount,
    axis_label,
    key_words,
    listed,
    mark,
    note,
    number,
    page,
    paragraph,
    percent,
    response,
    section,
    table,
    text,
    unit,
    with_error,
    words,
)
from calibrator.problem import Target
from calibrator.quantities import PARAMETERS, SETUPS, STATUSES, Quantity
from calibrator.records import Record
from calibrator.runner import gather
from calibrator.scenes import scenes
from calibrator.selection import bands
from calibrator.workflow import (
    Workspace,
    database_records,
    fit,
    for_new_seeds,
    probe_request,
    search_fronts,
    validation_requests,
    verification_requests,
)

PACKAGES = ("numpy", "scipy", "scikit-learn", "pymoo", "matplotlib")
SLICE_POSITIONS = 121
REACH = 0.35  # of the box's half diagonal: a run this far from a slice is drawn at 1/e of full strength
STALE = 1e-6  # relative difference of a prediction that rounding cannot explain


def write_report(space: Workspace) -> dict[str, Any]:
    """Write report.html and its figures into the folder of the results.

    The interpolant and the search are made anew from the database (they are deterministic); everything else is read from
    the summary that the verbs left. Steps that have not been done are named with the command that does them.

    Returns {"page": path, "figures": paths}. Raises CalibratorError where `calibrate` has not been done.
    """
    findings = Findings.of(space)
    folder = space.folder("figures")
    for old in folder.glob("*.png"):
        old.unlink()
    album = Album(folder)
    whole = page(space.case.name, [make(findings, album) for make in SECTIONS])
    path = space.path / "report.html"
    write_text(path, whole)
    return space.note("report", {"page": str(path), "figures": [str(p) for p in album.paths]})


@dataclass(frozen=True, eq=False)
class Findings:
    """All that the sections draw on: the workspace, its summary, the runs of the plan, and what is computed from them."""

    space: Workspace
    summary: dict[str, Any]
    records: list[Record]
    verified: dict[str, list[Record]]
    validated: dict[str, list[Record]]
    interpolant: Interpolant
    fronts: list[SearchResult]

    @classmethod
    def of(cls, space: Workspace) -> Findings:
        """Gather the runs and repeat interpolation and search."""
        space.outcome("calibrate")
        case = space.case
        records = database_records(space)
        interpolant = fit(case, records)
        return cls(
            space,
            space.summary(),
            records,
            {k: for_new_seeds(space, case.verify).finished(own) for k, own in verification_requests(space).items()},
            {k: for_new_seeds(space, case.validate).finished(own) for k, own in validation_requests(space).items()},
            interpolant,
            search_fronts(case, interpolant),
        )

    @property
    def calibration(self) -> dict[str, Any]:
        """Outcome of the verb calibrate."""
        return self.summary["calibrate"]

    @property
    def candidates(self) -> dict[str, dict[str, Any]]:
        """The compromise, then the individuals in order along the front."""
        found = self.calibration["candidates"]
        return {"compromise": found["compromise"], **{k: v for k, v in found.items() if k != "compromise"}}

    @property
    def compromise(self) -> np.ndarray:
        """Parameter set (d,) of the compromise."""
        chosen = self.candidates["compromise"]["parameters"]
        return np.array([chosen[name] for name in self.space.case.problem.names])

    @property
    def stale(self) -> bool:
        """Whether the database has changed since `calibrate` wrote its predictions."""
        stored = [self.candidates["compromise"]["predicted"][key]["mean"] for key in self.interpolant.responses]
        return not np.allclose(self.interpolant.predict(self.compromise[None])[0], stored, rtol=STALE, atol=0)

    def outcome(self, verb: str) -> dict[str, Any] | None:
        """Outcome of verify (of the compromise) or validate; None where its runs are not those of the present compromise."""
        found = self.summary.get(verb)
        runs = (self.validated if verb == "validate" else self.verified).get("compromise", [])
        counts = {} if found is None else found["candidates"]["compromise"] if verb == "verify" else found
        return found if found and sum(counts["statuses"].values()) == len(runs) > 0 else None

    def command(self, verb: str) -> str:
        """The command that does a step, as HTML."""
        return f"<code>{text(f'calibrator {verb} {self.space.case.path}')}</code>"


def _missing(findings: Findings, what: str, verb: str) -> str:
    return paragraph(f"{text(what)} is missing: run {findings.command(verb)}, then {findings.command('report')}.", "missing")


# What was asked, and the answer


def _answer(findings: Findings, album: Album) -> str:
    """The first screen: question, three sentences, warnings, and the parameters in a table."""
    case = findings.space.case
    return "\n".join(
        [
            f"<header><h1>Calibration of {text(words(case.name))}</h1>{paragraph(text(case.about), 'about')}</header>",
            section("What was asked", paragraph(_question(findings)), _targets_table(findings)),
            section("The answer", *_warnings(findings), paragraph(_sentences(findings), "answer"), _parameters_table(findings)),
        ]
    )


def _question(findings: Findings) -> str:
    problem = findings.space.case.problem
    held_out = listed([key_words(t.key) for t in problem.held_out])
    return text(
        f"Which {listed([words(n) for n in problem.names])} make YADE reproduce the measured "
        f"{listed([key_words(t.key) for t in problem.targets])}, with the least computing time?"
        + (f" Held out to test the answer: {held_out}." if held_out else "")
    )


def _targets_table(findings: Findings) -> str:
    problem = findings.space.case.problem
    rows = [_target_row(t, "calibrate") for t in problem.targets] + [_target_row(t, "held out") for t in problem.held_out]
    head = ["response", "measured", "scatter of one", "repeats", "weight", "tolerance", "role"]
    return table("Measured responses", head, rows)


def _target_row(target: Target, role: str) -> list[str]:
    numbers = [number(target.value), number(target.scatter or None), str(target.replicates), number(target.weight)]
    return [_heading(target), *numbers, percent(target.tolerance, False, 1), role]


def _heading(target: Target) -> str:
    return text(key_words(target.key)) + _in_unit(response(target.key))


def _warnings(findings: Findings) -> list[str]:
    """What must not be overlooked: unreachable targets, and predictions that no longer belong to the database."""
    reach = findings.calibration["reachability"]
    alarms = []
    if not reach["all"]:
        missed = [s for s in reach["sentences"] if "cannot" in s]
        alarms.append("The targets are out of reach. " + " ".join(_spoken(findings, s) for s in missed))
    if findings.stale:
        alarms.append("The database has changed since the calibration: run `calibrator calibrate` again before using this page.")
    return [paragraph(text(alarm), "alarm") for alarm in alarms]


def _spoken(findings: Findings, sentence: str) -> str:
    """A sentence of the summary with the targets in words."""
    for target in findings.space.case.problem.targets:
        sentence = sentence.replace(target.key, key_words(target.key))
    return f"{sentence[:1].upper()}{sentence[1:]}."


def _sentences(findings: Findings) -> str:
    return " ".join(said(findings) for said in (_said_values, _said_verified, _said_pinned, _said_outside, _said_truth))


def _said_values(findings: Findings) -> str:
    chosen = findings.candidates["compromise"]["parameters"]
    said = []
    for profile in findings.calibration["identifiability"]["parameters"]:
        quantity, (low, high) = PARAMETERS[profile["name"]], profile["interval_95"]
        said.append(
            f"<b>{text(words(quantity.name))} {text(amount(chosen[quantity.name], quantity))}</b> "
            f"(95 %: {number(low, 3)} to {number(high, 3)})"
        )
    return f"Use {listed(said)}."


def _said_verified(findings: Findings) -> str:
    outcome = findings.outcome("verify")
    if outcome is None:
        return f"This is a promise of the interpolant, <b>not verified yet</b>: run {findings.command('verify')}."
    rows = outcome["candidates"]["compromise"]["responses"]
    missed = [key_words(r["key"]) for r in rows if not r["passed"]]
    if not rows:
        return "The verification <b>failed</b>: no fresh run of the compromise was good."
    if outcome["passed"]:
        return f"<b>Verified:</b> the mean of {rows[0]['runs']} fresh YADE runs meets every target."
    return f"<b>Not verified:</b> fresh YADE runs miss {text(listed(missed))}."


def _said_pinned(findings: Findings) -> str:
    profiles = findings.calibration["identifiability"]["parameters"]
    loose = [words(p["name"]) for p in profiles if not p["pinned"]]
    if not loose:
        return "The measurements pin down every parameter."
    return f"The measurements <b>do not pin down</b> {text(listed(loose))}: other values are about as good."


def _said_outside(findings: Findings) -> str:
    """Which parameters of the compromise the measurements would refuse: it may trade agreement for computing time."""
    chosen = findings.candidates["compromise"]["parameters"]
    profiles = findings.calibration["identifiability"]["parameters"]
    outside = [p["name"] for p in profiles if not p["interval_95"][0] <= chosen[p["name"]] <= p["interval_95"][1]]
    names = text(listed([words(name) for name in outside]))
    return f"To save computing time the compromise leaves the 95 % interval of {names}." if outside else ""


def _said_truth(findings: Findings) -> str:
    """How far the compromise is from the parameters behind a synthetic lab; empty for a real one."""
    chosen = findings.candidates["compromise"]["parameters"]
    off = [
        f"{words(p['name'])} {percent(chosen[p['name']] / p['truth'] - 1, digits=1)}"
        for p in findings.calibration["identifiability"]["parameters"]
        if p["truth"]
    ]
    return f"The lab is synthetic; from the truth behind it the compromise is off by {text(listed(off))}." if off else ""


def _parameters_table(findings: Findings) -> str:
    problem, chosen = findings.space.case.problem, findings.candidates["compromise"]["parameters"]
    truth_known = any(p["truth"] is not None for p in findings.calibration["identifiability"]["parameters"])
    rows = []
    for parameter, profile in zip(problem.parameters, findings.calibration["identifiability"]["parameters"], strict=True):
        quantity = PARAMETERS[parameter.name]
        row = [
            text(words(parameter.name)) + _in_unit(quantity),
            number(chosen[parameter.name]),
            _range(*profile["interval_95"]),
            number(profile["best"]),
            _range(parameter.low, parameter.high),
            mark(profile["pinned"], "yes", "no"),
        ]
        rows.append(row + [number(profile["truth"])] * truth_known)
    head = ["parameter", "compromise", "95 % interval", "best fit", "searched", "pinned down"] + ["truth"] * truth_known
    return table("Calibrated parameters", head, rows, 1) + paragraph(text(_reason(findings)), "small")


def _range(low: float, high: float) -> str:
    return f"{number(low, 3)} to {number(high, 3)}"


def _reason(findings: Findings) -> str:
    return (
        f"How the compromise was chosen: {findings.calibration['compromise_reason']}. Intervals come from the profile "
        "likelihood; one that ends where the search ended is set by the bounds, not by the measurements. The best fit "
        "ignores the computing time."
    )


# Pictures of the set-ups


def _pictures(findings: Findings, album: Album) -> str:
    """Grains of one run per set-up."""
    case = findings.space.case
    setups = [s for s in SETUPS if any(t.setup == s for t in (*case.problem.targets, *case.problem.held_out))]
    return section("The set-ups", *(_picture(findings, album, setup) for setup in setups))


def _picture(findings: Findings, album: Album, setup: str) -> str:
    found = _run_with_curves(findings, setup)
    if found is None:
        verb = "verify" if setup in findings.space.case.problem.calibration_setups else "validate"
        return _missing(findings, f"The picture of the {words(setup)}", verb)
    record, arrays = found
    p = {name: float(value) for name, value in record.request.parameters.items() if not isinstance(value, str)}
    values = ", ".join(f"{words(n)} {number(p[n], 3)}" for n in findings.space.case.problem.names)
    view = "; the grains in front of the axis are cut away" if setup == "hourglass" else ""
    caption = (
        f"{words(setup).capitalize()} in YADE: {len(arrays['filled'])} grains filled, {len(arrays['final'])} at rest after the "
        f"release{view}. Red: the scanned surface (mean). Run {record.run_id} with {values}."
    )
    moments = scenes(setup, p, arrays)
    return album.figure(f"packing_{setup}", caption, lambda: plot.packing(moments, p["particle_radius"], setup == "hourglass"))


def _run_with_curves(findings: Findings, setup: str) -> tuple[Record, dict[str, np.ndarray]] | None:
    """The compromise's own fresh run where there is one, else the run nearest to the compromise that kept its grains."""
    own = findings.verified.get("compromise", []) + findings.validated.get("compromise", [])
    probe = gather(findings.space.runs, [probe_request(findings.space, setup)])
    for record in [*probe, *own, *_by_distance(findings, findings.records)]:
        if record.status == "ok" and record.request.setup == setup:
            arrays = _curves(findings, record)
            if {"filled", "final"} <= set(arrays):
                return record, arrays
    return None


def _by_distance(findings: Findings, records: Sequence[Record]) -> list[Record]:
    problem = findings.space.case.problem

    def distance(record: Record) -> float:
        point = np.array([record.request.value(n) for n in problem.names], float)
        return float(np.linalg.norm((point - findings.compromise) / (problem.high - problem.low)))

    return sorted(records, key=distance)


def _checked_curves(arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The arrays, if they have the shapes that the figures need; else ValueError."""
    for name in {"filled", "final"} & set(arrays):
        if arrays[name].ndim != 2 or arrays[name].shape[1] != 3 or not np.isfinite(arrays[name]).all():
            raise ValueError(f"{name} is not a list of grain centres")
    if "filled" in arrays and not len(arrays["filled"]):
        raise ValueError("filled holds no grain")
    for across, up in (("time", "passed_mass"), ("profile_x", "profile_height"), ("profile_radius", "profile_height")):
        if across in arrays and (arrays[across].ndim != 1 or up not in arrays or arrays[up].shape != arrays[across].shape):
            raise ValueError(f"{across} and {up} are not the two columns of a curve")
    return arrays


def _curves(findings: Findings, record: Record) -> dict[str, np.ndarray]:
    """Arrays of a run; empty where it left none (shipped runs do not come with theirs)."""
    path = findings.space.runs.curves(record.run_id)
    try:
        return _checked_curves(read_arrays(path))
    except FileNotFoundError:
        return {}
    except ValueError as error:
        raise CalibratorError(f"{path} is damaged ({error}): delete it and its record, then run the verbs again") from None


# Calibration


def _calibration(findings: Findings, album: Album) -> str:
    """The interpolant, the search, and what the targets say."""
    keys = [t.key for t in findings.space.case.problem.targets]
    return section(
        "Calibration",
        paragraph(text(_said_database(findings))),
        *(_slices(findings, album, key) for key in keys),
        _parity(findings, album),
        _front(findings, album),
        _distance(findings, album),
        _likelihood(findings, album),
        _ridge(findings, album),
        _sensitivity(findings, album),
        *(paragraph(text(_spoken(findings, s)), "small") for s in findings.calibration["reachability"]["sentences"]),
    )


def _said_database(findings: Findings) -> str:
    good = sum(r.status == "ok" for r in findings.records)
    noise = ", ".join(f"{key_words(k)} {amount(v, response(k), 2)}" for k, v in findings.calibration["seed_noise"].items())
    return (
        f"The interpolant rests on {good} good runs at {len(_means(findings)[0])} parameter sets. "
        f"Seed noise of a single run: {noise}."
    )


def _means(findings: Findings) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Distinct points (p, d), mean responses and runs behind each (p, m), in the order of the interpolant's own."""
    return average_replicates(*response_table(findings.space.case.problem, findings.records, findings.interpolant.responses))


def _slices(findings: Findings, album: Album, key: str) -> str:
    problem, column = findings.space.case.problem, findings.interpolant.responses.index(key)
    index = [t.key for t in problem.targets].index(key)
    target = problem.targets[index]
    noise = dict(zip(findings.interpolant.responses, findings.interpolant.noise, strict=True))
    band = float(bands(problem, noise)[index])
    panels = [_slice(findings, column, i) for i in range(len(problem.names))]
    caption = (
        f"{key_words(key).capitalize()} along each parameter, the others at the compromise. The band around the target is the "
        "tolerance or twice the seed noise, whichever is larger; bars are one standard error of the mean."
    )
    label = axis_label(response(key))
    return album.figure(f"slices_{key.replace('.', '_')}", caption, lambda: plot.slices(panels, label, target.value, band))


def _slice(findings: Findings, column: int, axis: int) -> plot.Slice:
    problem = findings.space.case.problem
    points, values, counts = _means(findings)
    there = np.isfinite(values[:, column])
    line = np.repeat(findings.compromise[None], SLICE_POSITIONS, axis=0)
    line[:, axis] = np.linspace(problem.low[axis], problem.high[axis], SLICE_POSITIONS)
    mean, std = findings.interpolant.predict_with_error(line)
    away = np.delete((points[there] - findings.compromise) / (problem.high - problem.low), axis, axis=1)
    distance = np.sqrt(np.mean(away**2, axis=1)) if away.shape[1] else np.zeros(there.sum())
    return plot.Slice(
        axis_label(PARAMETERS[problem.names[axis]]),
        float(findings.compromise[axis]),
        line[:, axis],
        mean[:, column],
        std[:, column],
        points[there, axis],
        values[there, column],
        findings.interpolant.noise[column] / np.sqrt(counts[there, column]),
        np.exp(-distance / REACH),
    )


def _parity(findings: Findings, album: Album) -> str:
    predicted, std = findings.interpolant.leave_one_out()
    labels = [axis_label(response(key)) for key in findings.interpolant.responses]
    caption = "Each parameter set predicted from the others alone (leave-one-out); bars: the standard deviation it was given."
    return album.figure("parity", caption, lambda: plot.parity(_means(findings)[1], predicted, std, labels))


def _front(findings: Findings, album: Album) -> str:
    front = findings.fronts[0]
    if len(front.names) < 2:
        return note("The search had a single objective: there is no front to draw.")
    names = [f"{OBJECTIVES[n].symbol}: {OBJECTIVES[n].about}" for n in front.names[:2]]
    marks = {label: [c["objectives"][n] for n in front.names[:2]] for label, c in findings.candidates.items()}
    axes = [f"{OBJECTIVES[n].symbol} ({words(n)})" for n in front.names[:2]]
    caption = f"The population of the genetic algorithm on its way to the Pareto front. {names[0]}; {names[1]}."
    snapshots = {generation: objectives[:, :2] for generation, (_, objectives) in front.snapshots.items()}
    return album.figure("front_evolution", caption, lambda: plot.front_evolution(snapshots, front.objectives[:, :2], axes, marks))


def _distance(findings: Findings, album: Album) -> str:
    curves = [np.array(curve) for curve in findings.calibration["generational_distance"]]
    caption = f"Mean generational distance to the final front in {len(curves)} searches with different seeds."
    return album.figure("generational_distance", caption, lambda: plot.generational_distance(curves))


def _likelihood(findings: Findings, album: Album) -> str:
    chosen = findings.candidates["compromise"]["parameters"]
    found = [
        plot.Profile(
            axis_label(PARAMETERS[p["name"]]),
            np.array(p["positions"]),
            np.array(p["chi2"]),
            tuple(p["interval_95"]),
            chosen[p["name"]],
            p["truth"],
        )
        for p in findings.calibration["identifiability"]["parameters"]
    ]
    caption = (
        "Profile likelihood: how much worse the targets are met when one parameter is held and the others adapt. Values under "
        "the grey line, χ² = 3.84 above the minimum, are accepted at 95 %; a flat curve means that the targets say nothing."
    )
    return album.figure("profile_likelihood", caption, lambda: plot.profile_likelihood(found))


def _ridge(findings: Findings, album: Album) -> str:
    problem, found = findings.space.case.problem, findings.calibration["identifiability"]
    caption = (
        "Parameter sets that the measurements accept, seen along every pair of parameters: each cloud is as wide as one "
        "parameter is free where the other is known, and a slanted band is a ridge of sets that are equally good."
    )
    labels, bounds = [axis_label(PARAMETERS[n]) for n in problem.names], np.array([problem.low, problem.high])
    return album.figure("ridge", caption, lambda: plot.ridge(np.array(found["accepted"]), bounds, labels, findings.compromise))


def _sensitivity(findings: Findings, album: Album) -> str:
    found = findings.calibration["sensitivity"]
    kinds = {"alone": "first", "with all interactions": "total"}
    indices = {kind: (np.array(found[k]), np.array(found[f"{k}_error"])) for kind, k in kinds.items()}
    caption = (
        "What each parameter does over the whole box: Sobol indices of the interpolated responses. Lines are 95 % intervals, "
        "from the finite sample and, for Gaussian processes, from leaving parts of the database out."
    )
    labels, names = [key_words(k) for k in found["responses"]], [words(n) for n in found["parameters"]]
    return album.figure("sensitivity", caption, lambda: plot.sensitivity(indices, labels, names))


# Tables of the candidates


def _candidates_table(findings: Findings, album: Album) -> str:
    """Like the paper's Table 6."""
    found, problem = findings.candidates, findings.space.case.problem
    rows = [
        [text(words(n)) + _in_unit(PARAMETERS[n]), *(number(c["parameters"][n]) for c in found.values())] for n in problem.names
    ]
    rows += [[f"error of {text(key_words(t.key))}", *(_promised_error(t, c) for c in found.values())] for t in problem.targets]
    for name in found["compromise"]["objectives"]:
        symbol = OBJECTIVES[name].symbol
        rows.append([f"{text(symbol)} ({text(words(name))})", *(number(c["objectives"][name]) for c in found.values())])
    caption = "Calibration: compromise and individuals, with the errors and objectives that the interpolant promises"
    meaning = "Errors are (predicted − target) / target ± one standard error of the interpolant."
    return section("Candidates on the front", table(caption, ["", *map(_short, found)], rows, 1), note(meaning))


def _in_unit(quantity: Quantity) -> str:
    return f" [{text(unit(quantity))}]" if unit(quantity) else ""


def _short(candidate: str) -> str:
    return text(candidate.removeprefix("individual "))


def _promised_error(target: Target, candidate: Mapping[str, Any]) -> str:
    promised, size = candidate["predicted"][target.key], abs(target.value)
    error = percent((promised["mean"] - target.value) / size).removesuffix("\u00a0%")
    return f"{error} ± {100 * promised['error'] / size:.2f} %"


def _verification(findings: Findings, album: Album) -> str:
    """Like the paper's Table 7, with the curves of the fresh runs."""
    found = findings.outcome("verify")
    if found is None:
        return section("Verification", _missing(findings, "The verification with fresh YADE runs", "verify"))
    outcome = {label: found["candidates"][label] for label in findings.candidates if label in found["candidates"]}
    caption = "Fresh YADE runs of each candidate against the measurement. Filled: simulated; open: promised by the interpolant."
    rows = _deviations(outcome)
    return section(
        "Verification",
        _verification_table(findings, outcome),
        note(
            "Means of runs with new seeds ± one standard error, and (simulated − target) / target. None was used to calibrate."
            + _shipped_note(outcome)
        ),
        album.figure("verification", caption, lambda: plot.verification(rows)),
        _run_curves(findings, album),
    )


def _shipped_note(outcome: Mapping[str, Any]) -> str:
    shipped = sum(own.get("from_shipped_database", 0) for own in outcome.values())
    return f" {shipped} of the runs come with the project; --fresh makes them anew." if shipped else ""


def _verification_table(findings: Findings, outcome: Mapping[str, Any]) -> str:
    targets = findings.space.case.problem.targets
    by_key = [{r["key"]: r for r in own["responses"]} for own in outcome.values()]
    rows = [[_heading(t), _target_band(t, by_key), *(_simulated_cell(r.get(t.key)) for r in by_key)] for t in targets]
    rows.append(["O1", "", *(number(own["o1"], 3) for own in outcome.values())])
    rows.append(["good runs", "", *(str(own["statuses"].get("ok", 0)) for own in outcome.values())])
    rows.append(["verdict", "", *(mark(own["passed"], "passed", "failed") for own in outcome.values())])
    caption = "Verification: simulated responses of compromise and individuals, and their errors"
    return table(caption, ["", "target ± band", *map(_short, outcome)], rows, 2)


def _target_band(target: Target, by_key: Sequence[Mapping[str, Any]]) -> str:
    """The measured value as it was given, and the band; no rounding of the one to the other."""
    band = next((r[target.key]["band"] for r in by_key if target.key in r), None)
    return number(target.value) + (f" ± {number(band, 2)}" if band else "")


def _simulated(row: Mapping[str, Any] | None) -> str:
    return "no good run" if row is None else with_error(row["simulated"], row["standard_error"])


def _simulated_cell(row: Mapping[str, Any] | None) -> str:
    """Simulated value, and under it the relative error and whether the target counts as met."""
    if row is None:
        return _simulated(row)
    kind, sign = ("yes", "✓") if row["passed"] else ("no", "✗")
    return f'{_simulated(row)}<br><span class="{kind}">{percent(row["relative_error"])} {sign}</span>'


def _deviations(outcome: Mapping[str, Any]) -> list[plot.Deviation]:
    return [_deviation(label, row) for label, own in outcome.items() for row in own["responses"]]


def _deviation(label: str, row: Mapping[str, Any]) -> plot.Deviation:
    size = abs(row["target"])
    promised = None if row["predicted"] is None else (row["predicted"] - row["target"]) / size
    title = words(row["key"].split(".")[1])
    return plot.Deviation(label, title, row["relative_error"], row["standard_error"] / size, promised, row["band"] / size)


def _validation(findings: Findings, album: Album) -> str:
    """Like the paper's Tables 8 and 9: measurements that were not used."""
    problem, outcome = findings.space.case.problem, findings.outcome("validate")
    if not problem.held_out:
        return section(
            "Validation", note("No measurement was held out: give a row of the lab file the role held_out to validate.")
        )
    if outcome is None:
        return section("Validation", _missing(findings, "The validation on measurements not used", "validate"))
    verdicts = {"compromise": outcome, **outcome["candidates"]}
    rows = [
        [label, *_validation_row(t, {r["key"]: r for r in own["responses"]}.get(t.key))]
        for t in problem.held_out
        for label, own in verdicts.items()
    ]
    head = ["candidate", "response", "measured ± band", "simulated", "error", "good runs", "verdict"]
    own = _by_setup(findings, findings.validated)
    figures = [_profiles(findings, album, setup, runs) for setup, runs in own.items()]
    caption = "Validation: the candidates predict measurements that were not used"
    return section("Validation", table(caption, head, rows, 3), *figures)


def _validation_row(target: Target, row: Mapping[str, Any] | None) -> list[str]:
    if row is None:
        return [_heading(target), number(target.value), "no good run", "–", "0", mark(False)]
    measured = _target_band(target, [{target.key: row}])
    return [_heading(target), measured, _simulated(row), percent(row["relative_error"]), str(row["runs"]), mark(row["passed"])]


# Curves of single runs


def _by_setup(findings: Findings, runs: Mapping[str, Sequence[Record]]) -> dict[str, dict[str, list[dict[str, np.ndarray]]]]:
    """set-up -> candidate -> arrays of its runs that reached rest."""
    found: dict[str, dict[str, list[dict[str, np.ndarray]]]] = {}
    for label, records in runs.items():
        for record in records:
            arrays = _curves(findings, record) if record.status == "ok" else {}
            if arrays:
                found.setdefault(record.request.setup, {}).setdefault(label, []).append(arrays)
    return found


def _run_curves(findings: Findings, album: Album) -> str:
    ordered = {label: findings.verified[label] for label in findings.candidates if label in findings.verified}
    parts = []
    for setup, runs in _by_setup(findings, ordered).items():
        curves = _pairs(runs, "time", "passed_mass")
        if curves:
            caption = f"Mass that has passed the neck of the {words(setup)}, every verification run."
            parts.append(album.figure(f"mass_time_{setup}", caption, functools.partial(plot.mass_time, curves)))
        parts.append(_profiles(findings, album, setup, runs))
    return "".join(parts) or note("The verification runs left no curves.")


def _profiles(findings: Findings, album: Album, setup: str, runs: Mapping[str, Sequence[Mapping[str, np.ndarray]]]) -> str:
    across = "profile_x" if setup == "ledge" else "profile_radius"
    curves = _pairs(runs, across, "profile_height")
    caption = f"Scanned surface of the {words(setup)} at rest, every run."
    return album.figure(f"profiles_{setup}", caption, lambda: plot.profiles(curves, setup))


def _pairs(
    runs: Mapping[str, Sequence[Mapping[str, np.ndarray]]], across: str, up: str
) -> dict[str, list[tuple[np.ndarray, np.ndarray]]]:
    found = {label: [(a[across], a[up]) for a in own if across in a and up in a] for label, own in runs.items()}
    return {label: own for label, own in found.items() if own}


# Failures and provenance


def _failures(findings: Findings, album: Album) -> str:
    """How many runs of each stage ended how, and why the bad ones did."""
    stages = {
        "plan": findings.records,
        "verification": [r for own in findings.verified.values() for r in own],
        "validation": [r for own in findings.validated.values() for r in own],
    }
    kinds = [k for k in STATUSES if k == "ok" or any(r.status == k for own in stages.values() for r in own)]
    rows = [[stage, *(str(sum(r.status == k for r in own)) for k in kinds)] for stage, own in stages.items() if own]
    meanings = [paragraph(f"<b>{text(k)}</b>: {text(STATUSES[k])}.", "small") for k in kinds if k != "ok"]
    bad = [
        [r.run_id, stage, text(r.status), text(r.error or STATUSES[r.status])]
        for stage, own in stages.items()
        for r in own
        if r.status != "ok"
    ]
    reasons = table("Runs without a full set of responses", ["run", "stage", "status", "reason"], bad) if bad else ""
    words = "" if bad else paragraph("Every run that was started ended well.")
    return section(
        "Failed and clogged runs", table("Runs by outcome", ["stage", *map(text, kinds)], rows), words, *meanings, reasons
    )


def _provenance(findings: Findings, album: Album) -> str:
    """What would be needed to do it again."""
    case = findings.space.case
    verified = [r for own in findings.verified.values() for r in own]
    validated = [r for own in findings.validated.values() for r in own]
    runs = [*findings.records, *verified, *validated]
    shipped = findings.summary.get("run", {}).get("from_shipped_database", 0)
    rows = [
        ["calibrator", text(__version__)],
        ["YADE", text(_distinct(runs, "yade"))],
        ["scripts (hash)", text(_distinct(runs, "scripts"))],
        ["Python", text(platform.python_version())],
        *([name, text(importlib.metadata.version(name))] for name in PACKAGES),
        ["runs", f"{len(findings.records)} of the plan, {len(verified)} to verify, {len(validated)} to validate"],
        ["from the shipped database", str(shipped)],
        ["core-seconds of the plan", text(_spent_on_plan(findings))],
        ["core-seconds to verify and validate", number(_core_seconds([*verified, *validated]))],
    ]
    return section(
        "Provenance",
        table("Versions, runs and cost", ["", ""], rows),
        f"<h3>Case file {text(case.path.name)}</h3><pre>{text(_case_text(case.path))}</pre>",
    )


def _distinct(records: Sequence[Record], key: str) -> str:
    return ", ".join(sorted({str(r.provenance[key]) for r in records if r.provenance.get(key)})) or "not recorded"


def _case_text(path: Path) -> str:
    try:
        return read_text(path)
    except OSError as error:
        return f"(the case file cannot be read any more: {error})"


def _spent_on_plan(findings: Findings) -> str:
    """Core-seconds from timings.csv, which knows the runs made here but not those that were shipped."""
    try:
        rows = list(csv.DictReader(read_text(findings.space.path / "timings.csv", links=False).splitlines()))
        spent = sum(float(row["filling_cpu"]) + float(row["release_cpu"]) for row in rows)
    except FileNotFoundError:
        return "timings.csv is missing: run `calibrator collect`"
    except (OSError, KeyError, TypeError, ValueError, csv.Error) as error:
        raise CalibratorError(f"{findings.space.path}/timings.csv is damaged ({error}): run `calibrator collect` again") from None
    return f"{number(spent)} in {len(rows)} runs made here"


def _core_seconds(records: Sequence[Record]) -> float:
    return sum(float(r.diagnostics.get(k, 0.0)) for r in records for k in ("filling_cpu", "release_cpu"))


SECTIONS: tuple[Callable[[Findings, Album], str], ...] = (
    _answer,
    _pictures,
    _calibration,
    _candidates_table,
    _verification,
    _validation,
    _failures,
    _provenance,
)
