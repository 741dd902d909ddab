"""The verbs `verify` and `validate`: fresh runs against promise and measurement."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

from calibrator.case.fingerprint import Fingerprint, fingerprint
from calibrator.case.problem import Target
from calibrator.case.settings import Replicates
from calibrator.plan.curves import components_of, with_components
from calibrator.plan.requests import replicate_requests
from calibrator.plan.run import with_curves
from calibrator.responses.table import by_experiment
from calibrator.runs.record import Record
from calibrator.runs.request import Request
from calibrator.runs.workspace import (
    Report,
    Workspace,
    carry_out,
    contents,
    counts,
    for_new_seeds,
    silent,
)
from calibrator.search.outcome import COMPROMISE, Calibration, current_calibration
from calibrator.search.parts import Promise
from calibrator.verification.comparison import compare, error_o1
from calibrator.verification.curve import CurveComparison, compare_curve
from calibrator.verification.outcome import (
    Comparison,
    Validation,
    Verdict,
    Verification,
    all_passed,
    worst_verdict,
)

Requests = dict[str, list[Request]]
"""Fresh runs by candidate."""


def verification_requests(space: Workspace, calibration: Calibration) -> Requests:
    """Fresh seeds in the calibration's own experiments, most of them for the compromise."""
    case = space.case
    return _requests(space, calibration, case.verify, case.problem.experiments)


def validation_requests(space: Workspace, calibration: Calibration) -> Requests:
    """Fresh seeds in every experiment with a target held out.

    They are of the compromise, and of the other candidates only where asked for.
    """
    case = space.case
    return _requests(space, calibration, case.validate, case.problem.held_out_experiments)


def _requests(
    space: Workspace, calibration: Calibration, settings: Replicates, experiments: Sequence[str]
) -> Requests:
    """Fresh seeds in these experiments by candidate; none for one that gets no replicate."""
    requests = {}
    for index, (label, candidate) in enumerate(calibration.ordered.items()):
        count = settings.replicates if label == COMPROMISE else settings.spread_replicates
        fresh = dataclasses.replace(settings, replicates=max(count, 1))
        point = candidate.point(space.case.problem.names)
        if count:
            requests[label] = [
                request
                for experiment in experiments
                for request in replicate_requests(space.case, experiment, point, fresh, index)
            ]
    return requests


def verify(space: Workspace, report: Report = silent) -> Verification:
    """Run YADE afresh at the candidates, as calibrated, and compare with promise and target.

    Never uses the plan's runs; those of `verify.shipped` only, where a case has it. Raises
    CalibratorError where the calibration is missing or stale.
    """
    space = with_curves(space)
    calibration, targets = current_calibration(space), space.case.problem.targets
    requests = verification_requests(space, calibration)
    done = _carried_out(space, "verify", space.case.verify, requests, report)
    verdicts = {
        label: _verdict(
            space,
            targets,
            own,
            space.case.verify,
            calibration.candidates[label].predicted,
            calibration.seed_noise,
        )
        for label, own in done.items()
    }
    rests_on = verification_rests_on(space, calibration, done)
    passed = bool(verdicts[COMPROMISE].passed)
    return space.note("verify", Verification(passed, verdicts, rests_on))


def validate(space: Workspace, report: Report = silent) -> Validation:
    """Predict the held-out measurements with fresh runs of the compromise.

    See `verify` for the runs it uses. Raises CalibratorError where the calibration is missing or
    stale.
    """
    space = with_curves(space)
    calibration = current_calibration(space)
    requests = validation_requests(space, calibration)
    done = _carried_out(space, "validate", space.case.validate, requests, report)
    space, done = with_held_out_curves(space, done)
    targets = space.case.problem.held_out
    verdicts = {
        label: _verdict(space, targets, own, space.case.validate, noise=calibration.seed_noise)
        for label, own in done.items()
    }
    compromise = verdicts.pop(COMPROMISE)
    fields = {f.name: getattr(compromise, f.name) for f in dataclasses.fields(compromise)}
    rests_on = validation_rests_on(space, calibration, done)
    return space.note("validate", Validation(**fields, candidates=verdicts, fingerprint=rests_on))


def with_held_out_curves(
    space: Workspace, done: Mapping[str, Sequence[Record]]
) -> tuple[Workspace, dict[str, list[Record]]]:
    """The workspace with the targets that stand for curves held out, and the runs with theirs.

    done : fresh runs by candidate, which give the components: of a single candidate's runs there is
    but one, the difference between their mean curve and the measured one.
    """
    records = [r for own in done.values() for r in own]
    afresh = with_components(for_new_seeds(space, space.case.validate), records, held_out=True)
    case = dataclasses.replace(space.case, problem=afresh.case.problem)
    seen = dataclasses.replace(space, case=case, measure=afresh.measure)
    return seen, {label: afresh.measure(afresh, own) for label, own in done.items()}


def _carried_out(
    space: Workspace, verb: str, settings: Replicates, requests: Requests, report: Report
) -> dict[str, list[Record]]:
    """Finished fresh runs by candidate, and all of them as a CSV."""
    afresh = for_new_seeds(space, settings)
    records = carry_out(afresh, [r for own in requests.values() for r in own], report)
    name = {"verify": "verification.csv", "validate": "validation.csv"}[verb]
    afresh.write_database(name, records, verb)
    by_id = {r.run_id: r for r in records}
    return {
        label: [by_id[r.run_id] for r in own if r.run_id in by_id]
        for label, own in requests.items()
    }


def _verdict(
    space: Workspace,
    targets: Sequence[Target],
    records: Sequence[Record],
    settings: Replicates,
    promised: Mapping[str, Promise] | None = None,
    noise: Mapping[str, float | None] | None = None,
) -> Verdict:
    """The verdict on one candidate's fresh runs; promised, noise : see `compare`."""
    runs = by_experiment(space.case.problem, records)
    comparisons = compare(targets, runs, promised, noise)
    shipped = for_new_seeds(space, settings).shipped()
    return Verdict(
        responses=comparisons,
        curves=_curves(for_new_seeds(space, settings), comparisons, runs),
        most_failed=settings.most_failed,
        passed=all_passed(comparisons, settings.most_failed),
        o1=error_o1(targets, comparisons),
        from_shipped_database=len(shipped.find([r.request for r in records])),
        **counts(records),
    )


def _curves(
    afresh: Workspace,
    comparisons: Sequence[Comparison],
    runs: Mapping[str, Sequence[Record]],
) -> tuple[CurveComparison, ...]:
    """The curves that the comparisons are of the components of, as a whole."""
    compared, found = {c.key: c for c in comparisons}, []
    for curve in components_of(afresh):
        own = [compared[t.key] for t in curve.targets if t.key in compared]
        if own:
            good = [r for r in runs.get(curve.curve.experiment, ()) if r.status == "ok"]
            left = [one.get(curve.curve.response) for one in afresh.curves(good).values()]
            bands = {c.key: c.band for c in own}
            curves = [one for one in left if one is not None]
            found.append(compare_curve(curve, curves, bands, worst_verdict(own)))
    return tuple(found)


def verification_rests_on(
    space: Workspace, calibration: Calibration, done: Mapping[str, Sequence[Record]]
) -> Fingerprint:
    """Fingerprint of all that a verification is computed from."""
    return _rests_on(space, calibration, space.case.verify, space.case.problem.targets, done)


def validation_rests_on(
    space: Workspace, calibration: Calibration, done: Mapping[str, Sequence[Record]]
) -> Fingerprint:
    """Fingerprint of all that a validation is computed from."""
    return _rests_on(space, calibration, space.case.validate, space.case.problem.held_out, done)


def _rests_on(
    space: Workspace,
    calibration: Calibration,
    settings: Replicates,
    targets: Sequence[Target],
    done: Mapping[str, Sequence[Record]],
) -> Fingerprint:
    """Fingerprint of the calibration, the targets, the settings and the runs."""
    setups = {t.experiment: space.case.problem.values_of(t.experiment) for t in targets}
    return fingerprint(
        {
            "calibration": (calibration.fingerprint, calibration.candidates),
            "targets": targets,
            "set-ups": setups,
            "replicates and seeds": dataclasses.replace(settings, shipped=""),
            "runs": {label: contents(records) for label, records in done.items()},
        }
    )


def probe_request(space: Workspace, calibration: Calibration, experiment: str) -> Request:
    """The compromise's first fresh run in an experiment: the one whose grains the report draws."""
    case = space.case
    point = calibration.compromise.point(case.problem.names)
    fresh = case.verify if experiment in case.problem.experiments else case.validate
    return replicate_requests(case, experiment, point, dataclasses.replace(fresh, replicates=1))[0]
